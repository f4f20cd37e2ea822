from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from porefv.errors import InputError
from porefv.export.picture_data import cells_of_mesh
from porefv.export.sections import Plane, cut_cells, cut_spheres, open_points
from porefv.mesh.pore_mesh import PoreMesh
from porefv.packing.box import Box
from porefv.packing.packing import Packing

PACKINGS = Path(__file__).parents[2] / "data" / "packings"
MESH = PoreMesh(Packing.read(PACKINGS / "n25_s1.csv"))


@settings(max_examples=30, deadline=None)
@given(st.sampled_from("xyz"), st.floats(0.001, 0.999))
def test_the_polygons_of_cells_tile_the_section(axis, at):
    plane = Plane.through(MESH.box, axis, at)
    polygons = cut_cells(cells_of_mesh(MESH).polyhedra, plane)
    assert polygons.areas.sum() == pytest.approx(MESH.box.section(plane.normal), rel=1e-12)
    assert (polygons.areas >= -1e-15).all()


def test_integrating_sections_gives_the_volumes_of_cells():
    """The areas of a convex cell rise to a largest and fall: a sum over planes is off by it times their distance."""
    count = 400
    volumes, largest = np.zeros((2, MESH.n_cells))
    for at in (np.arange(count) + 0.5) / count:
        polygons = cut_cells(cells_of_mesh(MESH).polyhedra, Plane.through(MESH.box, "z", at))
        volumes[polygons.cells] += polygons.areas / count
        largest[polygons.cells] = np.maximum(largest[polygons.cells], polygons.areas)
    assert (np.abs(volumes - MESH.cell_volumes) <= 1.01 * largest / count + 1e-12).all()


def test_a_plane_through_centres_cuts_every_lattice_cell_once():
    lattice = PoreMesh(Packing.read(PACKINGS / "sc8.csv"))
    for at in (0.25, 0.5, 0.75):
        polygons = cut_cells(cells_of_mesh(lattice).polyhedra, Plane.through(lattice.box, "x", at))
        assert polygons.areas.sum() == pytest.approx(1.0, rel=1e-14)


def test_discs_have_the_radius_of_the_circle_in_the_plane():
    packing = Packing([[0.5, 0.5, 0.5], [0.5, 0.5, 2.0]], [0.5, 0.3], Box([0, 0, 0], [1, 1, 3]))
    discs = cut_spheres(packing.centres, packing.radii, Plane.through(packing.box, "z", 0.8))
    assert discs.spheres.tolist() == [0]
    assert discs.radii == pytest.approx([0.4])
    assert discs.centres.tolist() == [[0.5, 0.5]]
    assert len(cut_spheres(packing.centres, packing.radii, Plane.through(packing.box, "z", 1.0)).radii) == 0


def test_open_points_are_in_their_polygons_and_outside_discs():
    plane = Plane.through(MESH.box, "z", 0.4)
    polygons = cut_cells(cells_of_mesh(MESH).polyhedra, plane)
    discs = cut_spheres(MESH.packing.centres, MESH.packing.radii, plane)
    points, gaps = open_points(polygons, discs)
    assert (gaps > 0.0).sum() > 10
    for point, gap, corners in zip(points, gaps, polygons.corners, strict=True):
        sides = np.roll(corners, -1, axis=0) - corners
        out = point - corners
        assert (sides[:, 0] * out[:, 1] - sides[:, 1] * out[:, 0] >= -1e-12).all()
        nearest = (np.linalg.norm(discs.centres - point, axis=1) - discs.radii).min()
        assert gap == pytest.approx(nearest)


@pytest.mark.parametrize(("upright", "normal", "across", "up"), [(1, 2, 0, 1), (2, 1, 0, 2), (0, 2, 1, 0)])
def test_the_axis_of_flow_points_up_by_default(upright, normal, across, up):
    plane = Plane.through(MESH.box, upright=upright)
    assert (plane.normal, plane.across, plane.up, plane.at) == (normal, across, up, 0.5)


def test_a_plane_on_a_wall_is_refused():
    with pytest.raises(InputError, match="must lie within the box"):
        Plane.through(MESH.box, "x", 0.0)
