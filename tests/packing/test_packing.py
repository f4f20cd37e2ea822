import pickle
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from porefv.errors import InputError, PackingFileWarning
from porefv.packing.box import Box
from porefv.packing.overlaps import cap_volume, lens_volume
from porefv.packing.packing import Packing, Source

PACKINGS = Path(__file__).parents[2] / "data" / "packings"
UNIT = Box([0, 0, 0], [1, 1, 1])

# Scales and offsets (in box sizes) at which every statement must hold.
SCALES = [1e-9, 1e-4, 1.0, 1e6]
OFFSETS = [0.0, 1e3]


def ball(radius):
    return 4 / 3 * np.pi * radius**3


def moved(packing, scale, offset):
    """A packing of the unit box, scaled and moved."""
    return Packing((packing.centres + offset) * scale, packing.radii * scale, cube(scale, offset))


def cube(scale, offset):
    return Box(np.full(3, offset * scale), np.full(3, (offset + 1) * scale))


# Box


def test_box_knows_its_size_volume_and_sections():
    box = Box([-1, 0, 2], [1, 3, 2.5])
    np.testing.assert_array_equal(box.size, [2, 3, 0.5])
    assert box.volume == 3 and [box.section(axis) for axis in range(3)] == [1.5, 1, 6]
    assert repr(box) == "Box(2×3×0.5 m, lower (-1, 0, 2))"


@pytest.mark.parametrize(
    ("lower", "upper", "said"),
    [
        ([0, 0, 0], [1, 0, 1], "size 0 m along y"),
        ([0, 0, 0], [1, 1, -1], "size -1 m along z"),
        ([0, 0, np.nan], [1, 1, 1], "three finite numbers"),
        ([0, 0, 0], [np.inf, 1, 1], "three finite numbers"),
        ([0, 0], [1, 1], "three finite numbers"),
        ("a", [1, 1, 1], "must be numbers"),
        ([0, 0, 0], [1e200, 1e200, 1e200], "volume"),
        ([-1e308, 0, 0], [1e308, 1, 1], "volume"),
        ([0, 0, 0], [1e-200, 1e-200, 1e-200], "volume"),
    ],
)
def test_box_without_a_volume_is_refused(lower, upper, said):
    with pytest.raises(InputError, match=said):
        Box(lower, upper)


# What a packing is


def test_packing_converts_copies_and_protects_its_arrays():
    centres = np.full((1, 3), 0.5, dtype=np.float32)
    packing = Packing(centres, [0.25])
    centres[:] = 7
    assert packing.centres.dtype == np.float64 and (packing.centres == 0.5).all()
    with pytest.raises(ValueError, match="read-only"):
        packing.radii[0] = 1


def test_repr_is_for_people():
    packing = Packing.read(PACKINGS / "n2000_s1.csv")
    assert repr(packing) == "Packing(2000 spheres, radii 0.0268...0.0536 m, box 1×1×1 m)"
    assert repr(packing.overlaps) == "Overlaps(5010 pairs, 733 wall crossings)"
    assert repr(Packing([[0, 0, 0]], [1])) == "Packing(1 sphere, radius 1 m, no box)"
    assert len(packing) == 2000


def test_with_box_changes_only_the_box():
    packing = Packing.read(PACKINGS / "n25_s1.csv")
    other = packing.with_box(Box([0, 0, 0], [2, 2, 2]))
    assert other.box.volume == 8 and packing.box.volume == 1 and other.source is packing.source
    np.testing.assert_array_equal(other.centres, packing.centres)


def test_packing_survives_pickling():
    packing = Packing.read(PACKINGS / "n25_s1.csv")
    again = pickle.loads(pickle.dumps(packing))
    np.testing.assert_array_equal(again.centres, packing.centres)
    assert again.box.volume == 1


@pytest.mark.parametrize(
    ("centres", "radii", "said"),
    [
        (np.zeros((2, 2)), [1, 1], "shape"),
        (np.zeros((2, 3)), [1], "shape"),
        (np.zeros((2, 3)), 1, "shape"),
        (np.zeros((0, 3)), [], "no sphere"),
        ([["a", 0, 0]], [1], "must be numbers"),
        ([[0, 0, 0], [0, np.nan, 0]], [1, 1], "sphere 1: centre 0, nan, 0"),
        ([[0, 0, 0], [0, 1, 0]], [1, np.inf], "sphere 1: .* radius inf"),
        ([[0, 0, 0], [0, 1, 0]], [0, 1], "sphere 0: radius 0"),
        ([[0, 0, 0], [0, 1, 0]], [1, -0.5], "sphere 1: radius -0.5"),
    ],
)
def test_values_that_are_no_packing_are_refused_by_id(centres, radii, said):
    with pytest.raises(InputError, match=said):
        Packing(centres, radii)


def test_an_error_shows_five_culprits_and_counts_them_all():
    with pytest.raises(InputError) as caught:
        Packing(np.zeros((20, 3)), np.zeros(20))
    lines = str(caught.value).splitlines()
    assert lines[0] == "radius not positive (20 spheres):"
    assert [line.split(":")[0] for line in lines[1:6]] == [f"  sphere {i}" for i in range(5)]
    assert lines[6] == "  ... and 15 more" and len(lines) == 8


# Overlaps, solid volume, porosity


@given(r=st.floats(1e-6, 1e6), fraction=st.floats(0, 1))
def test_two_caps_make_a_ball(r, fraction):
    h = 2 * r * fraction
    assert cap_volume(r, h) + cap_volume(r, 2 * r - h) == pytest.approx(ball(r), rel=1e-12)


@settings(deadline=None)
@given(r=st.floats(0.01, 1), fraction=st.floats(0.01, 0.99))
def test_lens_is_the_integral_of_its_sections(r, fraction):
    d = (1 - r) + fraction * 2 * r  # between engulfed and touching a sphere of radius 1
    x = np.linspace(-1, 1, 20_001)
    sections = np.pi * np.clip(np.minimum(1 - x**2, r**2 - (x - d) ** 2), 0, None)
    integral = np.sum((sections[1:] + sections[:-1]) / 2 * np.diff(x))
    # The trapezoidal rule loses about its step times the height of the kinks.
    assert lens_volume(1.0, r, d) == pytest.approx(integral, rel=1e-2, abs=1e-6)
    assert lens_volume(r, 1.0, d) == pytest.approx(lens_volume(1.0, r, d), rel=1e-12)


def test_lens_of_equal_spheres_is_the_textbook_formula():
    d = np.linspace(0.01, 1.99, 50)
    np.testing.assert_allclose(lens_volume(1.0, 1.0, d), np.pi * (4 + d) * (2 - d) ** 2 / 12, rtol=1e-12)


def test_a_shallow_lens_keeps_its_relative_accuracy():
    # Leading term for small depth: pi r_i r_j / (r_i + r_j) depth^2. Depths 2^-k make d exact.
    for k in (20, 30, 40):
        depth = 2.0**-k
        expected = np.pi * (0.5 * 0.25) / 0.75 * depth**2
        assert lens_volume(0.5, 0.25, 0.75 - depth) == pytest.approx(expected, rel=4 * depth)


def test_lens_of_an_engulfed_sphere_is_the_sphere():
    np.testing.assert_allclose(lens_volume(1.0, 0.25, np.array([0, 0.3, 0.75])), ball(0.25), rtol=1e-14)
    assert lens_volume(1.0, 0.25, 0.75 + 1e-9) == pytest.approx(ball(0.25), rel=1e-8)


@pytest.mark.parametrize("scale", SCALES)
@pytest.mark.parametrize("offset", OFFSETS)
def test_solid_volume_of_overlapping_spheres_that_cross_walls(scale, offset):
    # Two spheres overlap; one crosses x_min, the other y_min and z_max. No three of these regions meet.
    packing = Packing([[0.24, 0.5, 0.5], [0.72, 0.27, 0.73]], [0.25, 0.25], UNIT)
    d = np.linalg.norm(packing.centres[1] - packing.centres[0])
    packing = Packing(packing.centres, [0.25, d - 0.24], UNIT)
    r = packing.radii[1]
    expected = (
        ball(0.25)
        + ball(r)
        - lens_volume(0.25, r, d)
        - cap_volume(0.25, 0.01)
        - 2 * cap_volume(r, r - 0.27)
        - cap_volume(r, max(r - 0.28, 0))
    )
    found = moved(packing, scale, offset).solid_volume / scale**3
    assert found == pytest.approx(expected, rel=1e-9)  # 1e3 box sizes away, coordinates keep 13 digits


def test_solid_volume_agrees_with_counting_random_points():
    packing = Packing.read(PACKINGS / "n25_s1.csv")
    swollen = Packing(packing.centres, packing.radii * 1.04, UNIT)
    points = np.random.default_rng(0).random((200_000, 3))
    inside = np.zeros(len(points), dtype=bool)
    for centre, radius in zip(swollen.centres, swollen.radii, strict=True):
        inside |= ((points - centre) ** 2).sum(axis=1) < radius**2
    # Four standard deviations of a binomial mean.
    assert 1 - swollen.porosity == pytest.approx(inside.mean(), abs=4 * 0.5 / np.sqrt(len(points)))


@pytest.mark.parametrize(
    ("name", "porosity"),
    [
        ("n25_s1", 0.533554371),
        ("n54_s1", 0.490331494),
        ("n200_s1", 0.451134641),
        ("n2000_s1", 0.394052005),
        ("n5000_s1", 0.384950698),
        ("n20000_s1", 0.375511698),
        ("nine_0.72", 0.451972200),
    ],
)
def test_porosity_is_the_one_of_the_packings_origin(name, porosity):
    # That value subtracts neither lenses nor caps from the balls: together less than 1e-6 of the box.
    assert Packing.read(PACKINGS / f"{name}.csv").porosity == pytest.approx(porosity, abs=1e-6)


def test_simple_cubic_lattice_touches_without_overlap():
    packing = Packing.read(PACKINGS / "sc8.csv").validate()
    assert len(packing.overlaps.pairs) == 0 and len(packing.overlaps.wall_ids) == 0
    assert packing.porosity == pytest.approx(1 - np.pi / 6, rel=1e-15)


def test_overlaps_give_pairs_walls_and_depths():
    packing = Packing([[0.2, 0.5, 0.5], [0.5, 0.5, 0.95], [0.5, 0.5, 0.5]], [0.25, 0.1, 0.1], UNIT)
    found = packing.overlaps
    np.testing.assert_array_equal(found.pairs, [[0, 2]])
    np.testing.assert_allclose(found.depths, [0.05])
    np.testing.assert_array_equal(found.wall_spheres, [0, 1])
    np.testing.assert_array_equal(found.wall_ids, [0, 5])
    np.testing.assert_allclose(found.wall_depths, [0.05, 0.05])


def test_without_a_box_no_wall_is_crossed_and_there_is_no_porosity():
    packing = Packing([[0, 0, 0]], [1], source=Source("one.csv"))
    assert len(packing.overlaps.wall_ids) == 0
    assert packing.solid_volume == pytest.approx(ball(1))
    for ask in (lambda: packing.porosity, packing.validate):
        with pytest.raises(InputError, match=r"(?s)one\.csv: the packing has no box.*box_lower"):
            ask()


# Validation, at every scale and offset


@pytest.fixture(params=[(scale, offset) for scale in SCALES for offset in OFFSETS], ids=str)
def refused(request):
    """The error of validating a packing given in the unit box, or None."""

    def error(centres, radii, **options):
        packing = moved(Packing(centres, radii), *request.param)
        try:
            assert packing.validate(**options) is packing
        except InputError as found:
            assert len(str(found).splitlines()) <= 8
            return str(found)

    return error


def test_one_sphere_and_spheres_on_a_line_or_in_a_plane_are_legitimate(refused):
    line = np.array([[0.125, 0.5, 0.5], [0.375, 0.5, 0.5], [0.625, 0.5, 0.5]])
    assert refused(line[:1], [0.1]) is None
    assert refused(line, [0.1] * 3) is None
    assert refused(np.concatenate((line, line + np.array([0, 0.25, 0]))), [0.1] * 6) is None


def test_moderate_overlap_is_legitimate(refused):
    assert refused([[0.375, 0.5, 0.5], [0.5, 0.5, 0.5]], [0.12, 0.12]) is None
    assert refused([[0.375, 0.5, 0.5], [0.5, 0.5, 0.5]], [0.12, 0.01]) is None


def test_duplicate_centres_are_refused(refused):
    error = refused([[0.5, 0.5, 0.5], [0.2, 0.2, 0.2], [0.5, 0.5, 0.5]], [0.1, 0.1, 0.05])
    assert "sphere 0 and sphere 2: same centre" in error and "(1 pair)" in error


def test_a_sphere_inside_another_is_refused(refused):
    error = refused([[0.5, 0.5, 0.5], [0.5, 0.5, 0.55]], [0.02, 0.2])
    assert "sphere 0 lies inside sphere 1" in error


def test_a_centre_may_lie_inside_another_sphere(refused):
    assert refused([[0.5, 0.5, 0.5], [0.5, 0.5, 0.69]], [0.2, 0.1]) is None
    assert "lies inside" in refused([[0.5, 0.5, 0.5], [0.5, 0.5, 0.6]], [0.2, 0.1])


@pytest.mark.parametrize(("wall", "axis", "value"), [("x_min", 0, -0.25), ("y_max", 1, 1.25), ("z_max", 2, 1.0)])
def test_a_centre_beyond_or_on_a_wall_is_refused(refused, wall, axis, value):
    centres = np.full((2, 3), 0.5)
    centres[1, axis] = value
    error = refused(centres, [0.1, 0.1])
    assert f"on or beyond {wall}" in error and "sphere 1:" in error and "sphere 0" not in error


def test_reaching_beyond_a_wall_is_tolerated_up_to_a_fraction_of_the_radius(refused):
    centres = [[0.5, 0.5, 0.5], [0.5, 0.096, 0.5]]
    assert refused(centres, [0.1, 0.1]) is None
    error = refused(centres, [0.1, 0.1], wall_tolerance=0.01)
    assert "more than 0.01 of its radius" in error and "beyond y_min, 0.04 of its radius" in error
    assert "sphere 1:" in error


@pytest.mark.parametrize("tolerance", [-0.1, np.nan])
def test_wall_tolerance_must_be_a_fraction(tolerance):
    with pytest.raises(InputError, match="wall_tolerance"):
        Packing([[0.5, 0.5, 0.5]], [0.1], UNIT).validate(tolerance)


def test_errors_name_file_and_line_through_the_source():
    source = Source("grains.csv", np.array([4, 7]))
    packing = Packing([[0.5, 0.5, 0.5], [0.5, 0.5, 0.5]], [0.1, 0.1], UNIT, source)
    with pytest.raises(InputError) as caught:
        packing.validate()
    assert str(caught.value).startswith("grains.csv: one sphere lies within another")
    assert "line 4 (sphere 0) and line 7 (sphere 1): same centre 0.5, 0.5, 0.5" in str(caught.value)


def test_many_spheres_at_one_place_are_an_error_that_names_the_file():
    packing = Packing(np.full((5000, 3), 0.5), np.full(5000, 0.1), UNIT, Source("heap.csv"))
    with pytest.raises(InputError, match="heap.csv: .* more than 1000 neighbours"):
        packing.validate()


@pytest.mark.parametrize("path", sorted(PACKINGS.glob("*.csv")), ids=lambda path: path.stem)
def test_every_packing_of_the_project_is_valid_in_its_own_box(path):
    packing = Packing.read(path).validate(wall_tolerance=0.01)
    assert "origin" in packing.metadata
    # data/README.md: all stand in the unit cube but the clouds of the deposition, which are in their vessels.
    assert packing.box.volume == 1 or path.stem in ("deposition", "deposition_500")


def test_bounding_box_holds_every_sphere_with_few_digits():
    rng = np.random.default_rng(3)
    for scale in (1e-6, 1.0, 1e4):
        packing = Packing(scale * (rng.random((50, 3)) + 7.0), scale * (0.01 + 0.1 * rng.random(50)))
        box = packing.bounding_box
        assert (packing.radii[:, None] - box.wall_distances(packing.centres)).max() <= 1e-9 * scale
        extent = (packing.centres + packing.radii[:, None]).max(axis=0)
        np.testing.assert_allclose(box.upper, extent, atol=2e-5 * scale)
    np.testing.assert_allclose(Packing([[0.5, 0.5, 0.5]], [0.4]).bounding_box.upper, 0.9, rtol=1e-15)


@given(st.integers(0, 10_000))
def test_any_cropped_packing_is_accepted_with_a_wall_tolerance_of_one(reference, seed):
    rng = np.random.default_rng(seed)
    packing = reference("n200_s1")
    lower = rng.uniform(0.0, 0.6, 3)
    # A wall that all but touches a centre: the sphere reaches beyond it by its radius, but for rounding.
    lower[0] = np.nextafter(packing.centres[rng.integers(len(packing)), 0], -1.0)
    box = Box(lower, lower + rng.uniform(0.35, 0.4, 3))
    if (box.wall_distances(packing.centres) > 0.0).all(axis=1).any():
        assert packing.cropped(box).validate(wall_tolerance=1.0).porosity > 0.0


def test_a_cropped_packing_with_a_centre_beside_a_wall_needs_more_than_nearly_one(reference):
    packing = reference("n200_s1")
    lower = np.append(packing.centres[0, :2] - 0.2, packing.centres[0, 2] - 1e-6)
    cropped = packing.cropped(Box(lower, lower + 0.4))
    with pytest.raises(InputError, match="reaches beyond a wall by more than 0.99 of its radius"):
        cropped.validate(wall_tolerance=0.99)
    cropped.validate(wall_tolerance=1.0)


def test_spheres_that_are_nearly_the_same_are_warned_of():
    centres = [[0.3, 0.3, 0.3], [0.7, 0.7, 0.7], [0.3 + 1e-7, 0.3, 0.3]]
    with pytest.warns(PackingFileWarning, match="in 1 pair: sphere 0 and sphere 2.* remove one of each pair"):
        Packing(centres, [0.1, 0.1, 0.1], UNIT).validate()


def test_deep_overlaps_that_are_no_duplicates_are_not_warned_of(recwarn):
    Packing([[0.3, 0.3, 0.3], [0.32, 0.3, 0.3]], [0.1, 0.1], UNIT).validate()
    assert not recwarn.list
