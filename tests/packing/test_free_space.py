"""Free space between walls and grains; boxes placed by the spheres; packings scaled and cropped."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from porefv import Box, InputError, Packing, PoreFlow, PoreMesh, Walls
from porefv.packing.box import WALLS
from porefv.packing.free_space import fitted, free_space, wall_layers


def enlarged(packing, part):
    middle, half = 0.5 * (packing.box.lower + packing.box.upper), 0.5 * (1 + part) * packing.box.size
    return packing.with_box(Box(middle - half, middle + half))


def names(packing):
    return [layer.wall for layer in wall_layers(packing) if layer.free]


@pytest.mark.parametrize("name", ["n25_s1", "n54_s1", "n200_s1", "n2000_s1", "n5000_s1", "sc8", "nine_0.5"])
def test_packings_between_their_walls_have_no_free_space(reference, name):
    assert names(reference(name)) == []


@pytest.mark.parametrize("kind", ["sc", "fcc"])
@pytest.mark.parametrize("radius", [1.0, 0.8, 0.5])
def test_lattices_of_separate_spheres_have_none(lattice, kind, radius):
    assert names(lattice(kind, 3, radius=radius)) == []


@pytest.mark.parametrize("part", [0.01, 0.05])
def test_a_box_larger_than_the_grains_is_found_and_makes_the_permeability_too_large(reference, part):
    packing = reference("n5000_s1")
    large = enlarged(packing, part)
    assert names(large) == list(WALLS)
    said = free_space(wall_layers(large), packing.radii.mean())
    assert "x_min: nearest sphere" in said and 'box = "fit"' in said and "z_max" in said
    k, too_large = (PoreFlow(p, Walls.along("y")).permeability for p in (packing, large))
    assert too_large > 1.2 * k
    again = PoreFlow(PoreMesh(fitted(large, "fit")), Walls.along("y")).permeability
    assert again == pytest.approx(k, rel=0.03)


def test_a_bed_ends_where_its_grains_end(reference):
    packing = reference("n2000_s1")
    bed = packing.with_box(Box(packing.box.lower, packing.box.upper * [1, 1, 2]))
    assert names(bed) == ["z_max"]
    found = fitted(bed, "bed").box
    assert_allclose(found.lower, packing.box.lower)
    assert_allclose(found.upper, [1, 1, (packing.centres[:, 2] + packing.radii).max()])
    assert names(fitted(bed, "bed")) == []


def test_the_inside_does_not_notice_free_space(reference):
    packing = reference("n2000_s1")
    inner, outer = (PoreFlow(p, Walls.along("y")).interior for p in (packing, enlarged(packing, 0.03)))
    assert outer.porosity == pytest.approx(inner.porosity, rel=0.02)
    assert outer.permeability == pytest.approx(inner.permeability, rel=0.05)
    assert PoreFlow(reference("n25_s1"), Walls.along("y")).interior is None


def test_a_box_around_a_packing_touches_it_on_six_sides(reference):
    packing = reference("n54_s1")
    gaps = (Box.around(packing).wall_distances(packing.centres) - packing.radii[:, None]).min(axis=0)
    assert_allclose(gaps, 0.0, atol=1e-15)


def test_a_word_that_places_no_box_is_refused(reference):
    with pytest.raises(InputError, match="fit, bed"):
        fitted(reference("sc8"), "tight")
    with pytest.raises(InputError, match="no box of which walls"):
        fitted(Packing([[0, 0, 0]], [1.0]), "bed")


def test_a_packing_is_scaled_with_its_box(reference):
    packing = reference("n25_s1")
    scaled = packing.scaled(1e-3)
    assert scaled.porosity == pytest.approx(packing.porosity, rel=1e-12)
    k, small = (PoreFlow(p, Walls.along("y")).permeability for p in (packing, scaled))
    assert small == pytest.approx(1e-6 * k, rel=1e-9)
    with pytest.raises(InputError, match="positive number"):
        packing.scaled(0.0)


def test_a_cropped_packing_keeps_what_has_its_centre_inside(reference):
    packing = reference("n200_s1")
    box = Box([0.2, 0.2, 0.2], [0.8, 0.8, 0.8])
    found = packing.cropped(box)
    inside = ((packing.centres > 0.2) & (packing.centres < 0.8)).all(axis=1)
    assert len(found) == inside.sum() and np.array_equal(found.radii, packing.radii[inside])
    assert int(found.metadata["caps_lost"]) > 0
    # Spheres cut by walls keep the part inside: less solid than whole balls.
    assert found.solid_volume < (4 / 3 * np.pi * found.radii**3).sum()
    assert PoreFlow(PoreMesh(found, wall_tolerance=1.0), Walls.along("y")).permeability > 0.0
    with pytest.raises(InputError, match="no centre lies in the box"):
        packing.cropped(Box([2, 2, 2], [3, 3, 3]))


def test_a_box_may_be_given_by_its_corners():
    assert Packing([[0.5, 0.5, 0.5]], [0.1], ([0, 0, 0], [1, 1, 1])).box.volume == 1.0
    for wrong in (3, "fit", ([0, 0, 0],)):
        with pytest.raises(InputError):
            Packing([[0.5, 0.5, 0.5]], [0.1], wrong)
