"""A mesh of cells exists without pores and throats."""

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from porefv.errors import InputError
from porefv.mesh.cell_mesh import CellMesh
from porefv.mesh.pore_mesh import PoreMesh


@pytest.fixture(scope="module")
def mesh(reference):
    return CellMesh(reference("n54_s1"))


def test_cells_and_facets_are_those_of_the_pore_mesh(mesh, mesh_of):
    pores = mesh_of("n54_s1")
    assert_array_equal(mesh.cells, pores.cells)
    for name in ("cells", "vertices", "normals", "lengths", "areas", "fluid_areas", "volumes", "surfaces", "centroids"):
        assert_array_equal(getattr(mesh.facets, name), getattr(pores.facets, name))
    assert_allclose(mesh.cell_volumes.sum(), mesh.box.volume, rtol=1e-13)
    assert_allclose(mesh.facets.volumes.sum(), mesh.cell_void_volumes.sum(), rtol=1e-12)


def test_it_has_no_pores_and_says_so(mesh):
    assert not hasattr(mesh, "throats")
    assert repr(mesh) == "CellMesh(54 spheres, 272 cells, box 1×1×1 m)"


def test_it_goes_to_meshio_and_pyvista_with_data_by_cell(mesh):
    pytest.importorskip("pyvista")
    grid = mesh.to_pyvista(volume=mesh.cell_volumes)
    assert grid.n_cells == 272 and set(grid.cell_data) == {"volume"}
    assert set(mesh.to_meshio().cell_data) == {"cell"}
    with pytest.raises(InputError, match=r"needed is one per cell \(272\)$"):
        mesh.to_pyvista(volume=np.ones(267))


def test_areas_of_facets_are_those_of_their_polygons(mesh):
    # By the shoelace formula on the nodes that VTK gets.
    from porefv.mesh.polyhedra import polygons

    points, corners = polygons(mesh, np.arange(len(mesh.facets)), np.zeros(0, int), np.zeros(0, int))
    for corner, area in zip(corners, mesh.facets.areas, strict=True):
        polygon = points[corner[corner >= 0]]
        vector = 0.5 * np.cross(polygon[1:-1] - polygon[0], polygon[2:] - polygon[0]).sum(axis=0)
        assert_allclose(np.linalg.norm(vector), area, rtol=1e-9, atol=1e-15)


def test_a_pore_mesh_is_a_cell_mesh(mesh_of):
    assert isinstance(mesh_of("n54_s1"), CellMesh) and PoreMesh.cell_volumes is CellMesh.cell_volumes
