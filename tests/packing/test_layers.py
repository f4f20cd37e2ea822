"""Porosity by layer: segments, lenses, caps, and what three or more spheres and walls share."""

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.testing import assert_allclose
from scipy.integrate import quad

from porefv.errors import InputError
from porefv.packing.box import Box
from porefv.packing.free_space import wall_layers
from porefv.packing.layers import layer_edges, layer_porosities
from porefv.packing.packing import Packing

UNIT = Box([0, 0, 0], [1, 1, 1])


def union_area(discs):
    """Area of the union of two discs (x, y, radius)."""
    (xa, ya, a), (xb, yb, b) = discs
    distance = np.hypot(xb - xa, yb - ya)
    if distance >= a + b or min(a, b) <= 0.0:
        return np.pi * (max(a, 0.0) ** 2 + max(b, 0.0) ** 2)
    if distance <= abs(a - b):
        return np.pi * max(a, b) ** 2
    at_a = np.arccos((distance**2 + a**2 - b**2) / (2 * distance * a))
    at_b = np.arccos((distance**2 + b**2 - a**2) / (2 * distance * b))
    shared = a**2 * (at_a - np.sin(2 * at_a) / 2) + b**2 * (at_b - np.sin(2 * at_b) / 2)
    return np.pi * (a**2 + b**2) - shared


def disc(centre, radius, axis, place):
    x, y = np.delete(centre, axis)
    return x, y, np.sqrt(max(radius**2 - (place - centre[axis]) ** 2, 0.0))


@given(st.integers(0, 10_000), st.integers(1, 20), st.integers(0, 2))
def test_porosities_weighted_with_the_layers_add_up_to_that_of_the_packing(random_packing, seed, layers, axis):
    packing = random_packing(20, ratio=0.2, seed=seed, box=Box([-1, 2, 0], [1, 2.5, 3]))
    edges = layer_edges(packing.box, axis, layers)
    porosities = layer_porosities(packing, axis, edges)
    assert_allclose(np.average(porosities, weights=np.diff(edges)), packing.porosity, rtol=0, atol=1e-13)
    assert ((porosities >= -1e-13) & (porosities <= 1.0 + 1e-13)).all()


@pytest.mark.parametrize("name", ["n54_s1", "n200_s1", "nine_0.72", "sc8"])
@pytest.mark.parametrize("axis", range(3))
def test_they_add_up_with_overlaps_and_spheres_across_walls(reference, name, axis):
    packing = reference(name)
    edges = np.array([0.0, 0.013, 0.3, 0.31, 0.92, 1.0]) * packing.box.size[axis] + packing.box.lower[axis]
    porosities = layer_porosities(packing, axis, edges)
    assert_allclose(np.average(porosities, weights=np.diff(edges)), packing.porosity, rtol=0, atol=1e-13)


@settings(max_examples=40)
@given(st.integers(0, 10_000), st.floats(0.0, 1.0), st.floats(0.02, 0.99))
def test_the_union_of_two_spheres_is_cut_exactly(seed, tilt, lower):
    # Two spheres that overlap, at any angle to the planes, against an integral of the area of their sections.
    rng = np.random.default_rng(seed)
    radii = rng.uniform(0.08, 0.2, 2)
    direction = rng.normal(size=3) * [1.0, tilt, 1.0]
    direction /= np.linalg.norm(direction)
    step = direction * rng.uniform(radii.max() * 1.01, radii.sum())
    packing = Packing([0.5 - step / 2, 0.5 + step / 2], radii, UNIT)
    upper = lower + 0.5 * (1.0 - lower)
    # The section has kinks at the ends of the spheres, and of the circle in which they meet.
    distance = np.linalg.norm(step)
    to_plane = (distance**2 + radii[0] ** 2 - radii[1] ** 2) / (2 * distance)
    extent = np.sqrt((radii[0] ** 2 - to_plane**2) * (1 - direction[1] ** 2))
    middles, extents = [*packing.centres[:, 1], packing.centres[0, 1] + to_plane * direction[1]], [*radii, extent]
    breaks = np.concatenate([np.subtract(middles, extents), np.add(middles, extents)])
    within = breaks[(breaks > lower) & (breaks < upper)]

    def section(y):
        return union_area([disc(c, r, 1, y) for c, r in zip(packing.centres, radii, strict=True)])

    solid = quad(section, lower, upper, points=within if len(within) else None, epsabs=1e-11, limit=400)[0]
    found = layer_porosities(packing, 1, [0.0, lower, upper, 1.0])[1]
    assert_allclose((1.0 - found) * (upper - lower), solid, rtol=0, atol=1e-9)


@pytest.mark.parametrize("axis", range(3))
def test_a_cap_beyond_a_wall_does_not_count_in_any_layer(axis):
    centre = np.full(3, 0.5)
    centre[(axis + 1) % 3] = 0.1
    packing = Packing([centre], [0.12], UNIT)

    def section(z):  # the part of a disc within the wall
        rho = np.sqrt(max(0.12**2 - (z - 0.5) ** 2, 0.0))
        half = np.arccos(min(0.1 / rho, 1.0)) if rho > 0.0 else 0.0
        return np.pi * rho**2 - rho**2 * (half - np.sin(2 * half) / 2)

    edges = [0.0, 0.45, 0.53, 1.0]
    solid = [quad(section, a, b, points=[0.38, 0.62], epsabs=1e-12)[0] for a, b in ((0, 0.45), (0.45, 0.53), (0.53, 1))]
    found = layer_porosities(packing, axis, edges)
    assert_allclose((1.0 - found) * np.diff(edges), solid, rtol=0, atol=1e-9)


def test_a_packing_and_its_mirror_image_have_mirrored_porosities(reference):
    packing = reference("n200_s1")
    mirrored = Packing(packing.centres * [1, -1, 1] + [0, 1, 0], packing.radii, packing.box)
    edges = layer_edges(packing.box, 1, 7)
    found = layer_porosities(mirrored, 1, edges)
    assert_allclose(found[::-1], layer_porosities(packing, 1, edges), rtol=0, atol=1e-12)


# ---- three or more spheres and walls share points -----------------------------------------------------------------


def overlapping(seed, count=12, reach=0.5):
    """Spheres of the unit box that overlap by much; some reach beyond its walls, edges and corners."""
    rng = np.random.default_rng(seed)
    return Packing(rng.uniform(0.02, 0.98, (count, 3)), rng.uniform(0.05, reach, count), UNIT)


def cut_disc(rho, half):
    """Area of a disc that lies in a square of sides 2 half around its centre."""
    if rho <= half:
        return np.pi * rho**2
    if rho >= np.sqrt(2) * half:
        return 4 * half**2
    angle = np.arccos(half / rho)
    return np.pi * rho**2 - 4 * rho**2 * (angle - np.sin(2 * angle) / 2)


@pytest.mark.parametrize("radius", [0.45, 0.6, 0.7072, 0.75, 0.8, 0.86, 0.9])
@pytest.mark.parametrize("axis", range(3))
def test_a_sphere_that_all_edges_of_the_box_cut(radius, axis):
    edges = np.array([0.0, 0.03, 0.2, 0.5, 0.77, 1.0])
    ends = 0.5 + np.array([-1, 1])[:, None] * np.sqrt(np.maximum(radius**2 - 0.25 * np.arange(3), 0.0))
    solid = [
        quad(
            lambda z: cut_disc(np.sqrt(max(radius**2 - (z - 0.5) ** 2, 0.0)), 0.5),
            *(a, b),
            points=ends[(ends > a) & (ends < b)],
            epsabs=1e-13,
        )[0]
        for a, b in pairwise(edges)
    ]
    found = layer_porosities(Packing([[0.5] * 3], [radius], UNIT), axis, edges)
    assert_allclose((1.0 - found) * np.diff(edges), solid, rtol=0, atol=1e-11)


@pytest.mark.parametrize(
    ("centre", "part"), [([0, 0, 0], 1 / 8), ([1, 1, 0], 1 / 8), ([0, 0.5, 1], 1 / 4), ([0.5, 1, 0.5], 1 / 2)]
)
@pytest.mark.parametrize("axis", range(3))
def test_a_sphere_at_a_corner_edge_or_face_has_an_eighth_quarter_or_half_in_the_box(centre, part, axis):
    radius, edges = 0.4, np.array([0.0, 0.15, 0.3, 0.5, 0.7, 0.85, 1.0])
    height = np.clip(edges - centre[axis], -radius, radius)
    below = np.pi * (radius**2 * height - height**3 / 3)  # of the ball, from the plane through its centre
    if centre[axis] in (0, 1):
        part *= 2  # the half beyond the wall is not in any layer
    found = layer_porosities(Packing([centre], [radius], UNIT), axis, edges)
    assert_allclose((1.0 - found) * np.diff(edges), part * np.diff(below), rtol=0, atol=1e-14)


def test_a_sphere_whose_centre_lies_beyond_a_wall_leaves_its_cap_in_the_box():
    packing = Packing([[-0.1, 0.5, 0.5]], [0.3], UNIT)
    cap = np.pi * 0.2**2 * (0.3 - 0.2 / 3)
    assert_allclose(1.0 - layer_porosities(packing, 2, [0.0, 0.5, 1.0]), [cap, cap], rtol=1e-13)
    assert_allclose(1.0 - layer_porosities(packing, 0, [0.0, 0.2, 1.0]), [cap / 0.2, 0.0], atol=1e-14)


def test_spheres_within_others_and_at_the_same_place_count_once():
    alone = Packing([[0.4, 0.5, 0.6]], [0.3], UNIT)
    several = Packing([[0.4, 0.5, 0.6]] * 3 + [[0.45, 0.5, 0.6]], [0.3, 0.3, 0.1, 0.2], UNIT)
    edges = layer_edges(UNIT, 1, 7)
    assert_allclose(layer_porosities(several, 1, edges), layer_porosities(alone, 1, edges), rtol=0, atol=1e-15)


@pytest.mark.parametrize("kind", ["sc", "bcc", "fcc"])
@pytest.mark.parametrize("radius", [0.6, 0.7, 0.85])
def test_a_lattice_has_the_porosities_of_its_cell(kind, radius):
    # All spheres around one cell of a lattice, of which up to eight share a point, against one cell of twice the size.
    basis = {
        "sc": [[0] * 3],
        "bcc": [[0] * 3, [0.5] * 3],
        "fcc": [[0] * 3, [0.5, 0.5, 0], [0.5, 0, 0.5], [0, 0.5, 0.5]],
    }[kind]
    shifts = np.array(np.meshgrid(*[range(-1, 3)] * 3)).reshape(3, -1).T
    centres = (shifts[:, None] + np.array(basis)[None]).reshape(-1, 3)
    packing = Packing(centres, np.full(len(centres), radius * len(basis) ** (-1 / 3)), UNIT)
    found = layer_porosities(packing, 2, layer_edges(UNIT, 2, 8))
    assert_allclose(found, found[::-1], rtol=0, atol=1e-13)
    assert_allclose(found, layer_porosities(packing, 0, layer_edges(UNIT, 0, 8)), rtol=0, atol=1e-13)
    half = Packing(centres, packing.radii, Box([0, 0, 0], [0.5, 0.5, 1]))  # by symmetry
    assert_allclose(layer_porosities(half, 2, layer_edges(UNIT, 2, 8)), found, rtol=0, atol=1e-13)


@pytest.mark.parametrize("seed", range(4))
def test_the_void_of_each_layer_is_that_of_points_taken_at_random(seed):
    packing, axis, layers = overlapping(seed, count=8, reach=0.4), seed % 3, 5
    rng, count = np.random.default_rng(seed), 200_000
    found = layer_porosities(packing, axis, layer_edges(UNIT, axis, layers))
    for layer in range(layers):
        points = rng.uniform(size=(count, 3))
        points[:, axis] = (points[:, axis] + layer) / layers
        void = np.ones(count, bool)
        for centre, radius in zip(packing.centres, packing.radii, strict=True):
            void &= ((points - centre) ** 2).sum(axis=1) > radius**2
        scatter = np.sqrt(max(found[layer] * (1.0 - found[layer]), 1e-6) / count)  # up to 1.1e-3
        assert abs(void.mean() - found[layer]) < 5 * scatter


@pytest.mark.parametrize("seed", range(3))
def test_the_void_of_each_layer_is_that_of_lines_through_it(seed):
    # Lines along x on a grid of y, with what spheres leave of them; planes between layers are normal to y.
    packing, lines = overlapping(seed, count=6, reach=0.45), 1500
    y, z = (np.array(np.meshgrid(*[np.arange(lines) + 0.5] * 2, indexing="ij")) / lines).reshape(2, -1)
    ends = []
    for (cx, cy, cz), r in zip(packing.centres, packing.radii, strict=True):
        half = np.sqrt(np.maximum(r**2 - (y - cy) ** 2 - (z - cz) ** 2, 0.0))
        ends.append([np.clip(cx - half, 0, 1), np.clip(cx + half, 0, 1)])
    begins, ends = np.array(ends).transpose(1, 0, 2)
    order = np.argsort(begins, axis=0)
    begins, ends = np.take_along_axis(begins, order, 0), np.take_along_axis(ends, order, 0)
    reached, void = np.zeros(len(y)), np.ones(len(y))
    for begin, end in zip(begins, ends, strict=True):
        void -= np.maximum(end - np.maximum(begin, reached), 0.0)
        reached = np.maximum(reached, end)
    by_layer = void.reshape(5, -1).mean(axis=1)
    # The error of the grid of lines: 1e-5 for 300 lines along each side, 7e-7 for 1500, 2e-7 for 3000.
    assert_allclose(layer_porosities(packing, 1, layer_edges(UNIT, 1, 5)), by_layer, rtol=0, atol=2e-6)


@pytest.mark.parametrize("name", ["n25_s1", "n200_s1"])
@pytest.mark.parametrize("factor", [1.05, 1.3, 1.5, 1.7, 2.0])
def test_layers_of_cemented_packings_add_up_to_the_packing(reference, name, factor):
    packing = reference(name)
    packing = Packing(packing.centres, factor * packing.radii, packing.box)
    for axis in range(3):
        porosities = layer_porosities(packing, axis, layer_edges(packing.box, axis, 13))
        assert_allclose(porosities.mean(), packing.porosity, rtol=0, atol=1e-12)
        assert ((porosities >= -1e-13) & (porosities <= 1.0)).all()


def test_layers_of_a_cropped_packing_add_up_to_the_packing(reference):
    packing = reference("n200_s1").cropped(Box([0.21, 0.3, 0.28], [0.75, 0.8, 0.73]))
    assert packing.triple_overlaps > 0
    for axis in range(3):
        porosities = layer_porosities(packing, axis, layer_edges(packing.box, axis, 9))
        assert_allclose(porosities.mean(), packing.porosity, rtol=0, atol=1e-12)
        assert ((porosities >= 0.0) & (porosities <= 1.0)).all()


@given(st.integers(0, 10_000), st.integers(0, 2), st.lists(st.floats(0.01, 0.99), min_size=1, max_size=6, unique=True))
def test_porosities_are_fractions_and_layers_divide_additively(seed, axis, inner):
    packing, edges = overlapping(seed), np.array([0.0, *sorted(inner), 1.0])
    fine = layer_porosities(packing, axis, edges)
    assert ((fine >= -1e-13 / np.diff(edges)) & (fine <= 1.0 + 1e-13 / np.diff(edges))).all()
    whole = layer_porosities(packing, axis, [0.0, 1.0])[0]
    assert_allclose(fine @ np.diff(edges), whole, rtol=0, atol=1e-13)
    other = layer_porosities(packing, (axis + 1) % 3, edges)
    assert_allclose(other @ np.diff(edges), whole, rtol=0, atol=1e-13)


@given(st.integers(0, 10_000), st.integers(0, 2), st.integers(0, 2), st.integers(1, 9))
def test_mirror_images_that_overlap_have_mirrored_porosities(seed, axis, mirror, layers):
    packing = overlapping(seed)
    sense = np.where(np.arange(3) == mirror, -1.0, 1.0)
    image = Packing(packing.centres * sense + (sense < 0), packing.radii, UNIT)
    edges = layer_edges(UNIT, axis, layers)
    found, expected = layer_porosities(image, axis, edges), layer_porosities(packing, axis, edges)
    assert_allclose(found[::-1] if axis == mirror else found, expected, rtol=0, atol=1e-12)


@pytest.mark.parametrize("factor", [1.3, 1.7])
def test_wall_layers_of_a_cemented_packing_are_those_of_its_porosities(reference, factor):
    packing = reference("n2000_s1")
    packing = Packing(packing.centres, factor * packing.radii, packing.box)
    thick = 2.0 * packing.radii.mean()
    porosities = layer_porosities(packing, 0, [0.0, thick, 1.0 - thick, 1.0])
    lower, upper = wall_layers(packing)[:2]
    assert (lower.porosity, lower.inside, upper.porosity, upper.inside) == (*porosities[[0, 1]], *porosities[[2, 1]])
    assert 0.0 < lower.inside < lower.porosity < 1.0


@pytest.mark.parametrize("edges", [[0.0, 0.5], [0.0, 0.6, 0.5, 1.0], [1.0], [-0.1, 1.0]])
def test_edges_must_increase_from_wall_to_wall(reference, edges):
    with pytest.raises(InputError, match="edges of layers must"):
        layer_porosities(reference("n25_s1"), 0, edges)


@pytest.mark.parametrize("layers", [0, -1, 2.5, float("nan"), "3"])
def test_a_number_of_layers_is_whole_and_positive(layers):
    with pytest.raises(InputError, match="layers must be a whole number, 1 or more"):
        layer_edges(UNIT, 0, layers)


def test_layers_need_a_box():
    with pytest.raises(InputError, match="no box"):
        layer_porosities(Packing([[0, 0, 0]], [1]), 0, [0, 1])
