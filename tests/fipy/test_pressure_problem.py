"""The pores as a FiPy mesh: FiPy finds the pressures of porefv, on the same geometry."""

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from porefv.conductance.registry import MODELS
from porefv.errors import InputError
from porefv.flow.inside import FixedPressure, FlowSource
from porefv.flow.pore_flow import PoreFlow
from porefv.flow.regions import Point, Sphere
from porefv.flow.walls import Wall, Walls
from porefv.mesh.pore_mesh import PoreMesh
from porefv.packing.box import Box
from porefv.packing.packing import Packing

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


def face_centred(cells, overlap):
    """Packing of `cells`³ unit cells of the face-centred cubic lattice, radii `overlap` times the touching one.

    Throats between three grains close at an overlap of 2 / √3 = 1.1547.
    """
    base = np.array([[0, 0, 0], [0.5, 0.5, 0], [0.5, 0, 0.5], [0, 0.5, 0.5]])
    corners = np.stack(np.meshgrid(*[np.arange(cells)] * 3, indexing="ij"), axis=-1).reshape(-1, 1, 3)
    centres = (corners + base).reshape(-1, 3) + 0.25
    touching = np.sqrt(2.0) / 4.0
    box = Box(centres.min(axis=0) - touching, centres.max(axis=0) + touching)
    return Packing(centres, np.full(len(centres), overlap * touching), box)


@pytest.mark.parametrize("overlap", [1.0, 1.15, 1.155, 1.2])
def test_isolated_pores_have_the_pressures_that_porefv_gives_them(overlap):
    mesh = PoreMesh(face_centred(3, overlap), wall_tolerance=0.3)
    flow = PoreFlow(mesh, Walls.along("y", slip=True))
    problem = flow.to_fipy()
    found = problem.solve()
    assert flow.solution.isolated.any() == (overlap > 1.1547)
    assert_array_equal(problem.isolated, flow.solution.isolated)
    assert_allclose(found, flow.pressure, rtol=0, atol=1e-10)


def test_fipy_finds_the_same_pressures_with_sources_fixed_pressures_and_imposed_flows(mesh_of):
    flow = PoreFlow(
        mesh_of("n54_s1"), Walls(y_min=Wall(inflow=0.1), y_max=Wall(0.0)),
        sources=[FlowSource(Point([0.3, 0.5, 0.6]), 0.2), FlowSource(Sphere([0.5, 0.5, 0.5], 0.3), -0.1)],
        fixed_pressures=[FixedPressure(Point([0.8, 0.4, 0.4]), 0.7)],
    )  # fmt: skip
    assert_allclose(flow.to_fipy().solve(), flow.pressure, rtol=0, atol=1e-9 * np.ptp(flow.pressure))


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
