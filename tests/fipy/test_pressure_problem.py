"""The pores as a FiPy mesh: FiPy finds the pressures of porefv, on the same geometry."""

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from porefv.conductance.registry import MODELS
from porefv.errors import InputError
from porefv.flow.pore_flow import PoreFlow
from porefv.flow.walls import Wall, Walls

fipy = pytest.importorskip("fipy")


@pytest.mark.parametrize("model", MODELS.values())
@pytest.mark.parametrize(
    "walls",
    [Walls.along("y"), Walls(z_min=Wall(pressure=3.0), x_max=Wall(pressure=-2.0), y_min=Wall(slip=True))],
    ids=["along y", "across a corner"],
)
def test_fipy_finds_the_same_pressures(mesh_of, model, walls):
    flow = PoreFlow(mesh_of("n54_s1"), walls, conductance=model())
    assert_allclose(flow.to_fipy().solve(), flow.pressure, atol=1e-10 * np.ptp(flow.pressure))


def test_the_flow_of_fipys_pressure_is_the_flow(mesh_of):
    flow = PoreFlow(mesh_of("n25_s1"), Walls.along("y"))
    again = PoreFlow.from_pressure(flow.mesh, flow.to_fipy().solve(), flow.walls)
    assert_allclose(again.flux, flow.flux, atol=1e-9 * np.abs(flow.flux).max())
    assert_allclose(again.forces.total, flow.forces.total, atol=1e-9)


def test_the_mesh_has_the_geometry_of_the_pores(mesh_of):
    mesh = mesh_of("n25_s1")
    found = mesh.to_fipy()
    assert found.numberOfCells == mesh.n_pores
    n = len(found.facets)
    centroids = mesh.facets.centroids[found.facets] + mesh.triangulation.origin
    assert_array_equal(np.asarray(found.faceCenters)[:, :n].T, centroids)
    assert_allclose(found.cellVolumes.sum(), mesh.box.volume, rtol=1e-9)
    for wall, name in enumerate(("x_min", "x_max", "y_min", "y_max")):
        on_wall = found.on_wall(name)
        assert on_wall.sum() == np.count_nonzero(mesh.wall_faces.walls == wall)
        assert_allclose(np.asarray(found.faceCenters)[wall // 2, on_wall], wall % 2, atol=1e-14)


def test_pores_that_are_held_are_left_out(mesh_of):
    mesh = mesh_of("n25_s1")
    held = np.zeros(mesh.n_pores, bool)
    held[5] = True
    found = mesh.to_fipy(held)
    assert found.numberOfCells == mesh.n_pores - 1
    assert found.held_faces.sum() == (mesh.throats.pores == 5).any(axis=1).sum()
    with pytest.raises(InputError, match="held must be a bool array"):
        mesh.to_fipy(np.zeros(3, bool))
    with pytest.raises(InputError, match="every pore is held"):
        mesh.to_fipy(np.ones(mesh.n_pores, bool))
    with pytest.raises(InputError, match="unknown wall"):
        found.on_wall("top")
