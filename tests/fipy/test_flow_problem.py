"""A solved flow in FiPy: its velocity, its pressure equation, and the way back to forces."""

import pickle
import warnings

import numpy as np
import pytest
from numpy.testing import assert_allclose

from porefv.conductance.registry import MODELS
from porefv.errors import NoOpenPathWarning, OutOfRangeWarning
from porefv.flow.inside import FixedPressure, FlowSource
from porefv.flow.pore_flow import PoreFlow
from porefv.flow.regions import Point, Sphere
from porefv.flow.walls import Wall, Walls
from porefv.mesh.pore_mesh import PoreMesh
from porefv.packing.box import Box
from porefv.packing.packing import Packing

fipy = pytest.importorskip("fipy")

FLOWS = {
    "along y": {"walls": Walls.along("y")},
    "across a corner": {"walls": Walls(z_min=Wall(pressure=3.0), x_max=Wall(pressure=-2.0), y_min=Wall(slip=True))},
    "imposed": {
        "walls": Walls(y_min=Wall(inflow=0.1), y_max=Wall(0.0)),
        "sources": [FlowSource(Point([0.3, 0.5, 0.6]), 0.2), FlowSource(Sphere([0.5, 0.5, 0.5], 0.3), -0.1)],
        "fixed_pressures": [FixedPressure(Point([0.8, 0.4, 0.4]), 0.7)],
    },
}


def direct():
    """FiPy's own direct solver, which needs no porefv."""
    return fipy.LinearLUSolver(tolerance=1e-14, criterion="RHS", iterations=10)


@pytest.fixture(params=FLOWS)
def flow(request, mesh_of):
    return PoreFlow(mesh_of("n54_s1"), tolerance=1e-13, **FLOWS[request.param])


def test_fipy_finds_the_same_pressures(flow):
    # Walls are at 1e-7 of the resistance of their pores.
    assert_allclose(flow.to_fipy().solve(solver=direct()), flow.pressure, atol=1e-7 * np.ptp(flow.pressure))


@pytest.mark.parametrize("model", MODELS.values())
def test_fipy_finds_the_same_pressures_to_rounding_without_the_pores_on_pressure_walls(mesh_of, model):
    flow = PoreFlow(mesh_of("n54_s1"), Walls.along("y"), conductance=model(), tolerance=1e-14)
    found = flow.to_fipy(without=("y_min", "y_max")).solve(solver=direct())
    assert_allclose(found, flow.pressure, rtol=0, atol=1e-12 * np.ptp(flow.pressure))


def test_the_flow_of_fipys_pressure_is_the_flow(flow):
    again = PoreFlow.from_pressure(
        flow.mesh, flow.to_fipy().solve(solver=direct()), flow.walls_at_pressures,
        sources=flow.sources, fixed_pressures=flow.fixed_pressures,
    )  # fmt: skip
    assert_allclose(again.flux, flow.flux, atol=1e-7 * np.abs(flow.flux).max())
    assert_allclose(again.forces.total, flow.forces.total, atol=1e-7 * np.abs(flow.forces.total).max())


def test_the_velocity_is_that_of_the_solved_flow(flow):
    fluid = flow.to_fipy()
    mesh, flux = fluid.mesh, fluid.mesh.flux(fluid.velocity)
    throats = mesh.throats >= 0
    assert_allclose(flux[throats], flow.flux[mesh.throats[throats]], rtol=1e-13)
    for wall, entering in flow.wall_flux.items():
        assert mesh.through(fluid.velocity, mesh.on_wall(wall)) == pytest.approx(-entering, abs=1e-13 * flow.inflow)
    assert mesh.through(fluid.velocity, fluid.inlet) < 0.0 < mesh.through(fluid.velocity, fluid.outlet)


def test_the_velocity_is_free_of_divergence_but_for_sources(flow):
    fluid = flow.to_fipy()
    leaving = fluid.velocity.divergence.value * fluid.mesh.cellVolumes
    if flow.fixed_pressures:
        fixed = ~np.isnan(flow.imposed_pressures) & ((flow.mesh.pore_walls & 0b1100) == 0)
        injected = flow.flow_of_sources[fixed]
        assert (leaving[fixed] - injected).sum() == pytest.approx(sum(flow.fixed_pressure_flux), rel=1e-10)
        leaving[fixed] = injected
    assert_allclose(leaving, flow.flow_of_sources, atol=1e-12 * flow.inflow)


def test_the_velocity_of_fipys_pressure_is_that_of_the_flow(flow):
    fluid = flow.to_fipy()
    fluid.solve(solver=direct())
    v = fluid.velocity_with(fluid.mobility)
    scale = np.abs(fluid.mesh.flux(fluid.velocity)).max()
    assert_allclose(fluid.mesh.flux(v), fluid.mesh.flux(fluid.velocity), atol=1e-6 * scale)
    assert_allclose(
        fluid.mesh.flux(fluid.velocity_with(0.5 * fluid.mobility)), 0.5 * fluid.mesh.flux(v), atol=1e-14 * scale
    )


def test_a_viscosity_that_depends_on_the_solute_is_swept_to_rounding(mesh_of):
    flow = PoreFlow(mesh_of("n54_s1"), Walls.along("y"))
    fluid = flow.to_fipy()
    c = fipy.CellVariable(mesh=fluid.mesh, hasOld=True)
    c.constrain(1.0, where=fluid.inlet)
    c.faceGrad.constrain(np.zeros((3, 1)), where=fluid.outlet)
    mobility = fluid.mobility / (1.0 + 4.0 * c.faceValue)
    v = fluid.velocity_with(mobility)
    of_pressure = fipy.DiffusionTerm(coeff=mobility) == 0.0
    of_solute = fipy.TransientTerm() + fipy.UpwindConvectionTerm(coeff=v) == 0.0
    dt = 0.1 * fluid.mesh.cellVolumes.sum() / flow.inflow
    changes = []
    for _ in range(40):
        before = c.value.copy()
        of_pressure.solve(var=fluid.pressure)
        of_solute.sweep(var=c, dt=dt)
        changes.append(np.abs(c.value - before).max())
    assert changes[-1] < 1e-12
    stored = ((c.value - c.old.value) * fluid.mesh.cellVolumes).sum() / dt
    passed = fluid.mesh.through(c.faceValue * v, fluid.mesh.exteriorFaces)
    assert abs(stored + passed) < 1e-14 * flow.inflow
    assert c.value.min() >= 0.0 and c.value.max() <= 1.0 + 1e-12


def test_with_storage_the_pressure_settles_to_that_of_the_flow(mesh_of):
    flow = PoreFlow(mesh_of("n54_s1"), Walls.along("y"), tolerance=1e-13)
    fluid = flow.to_fipy()
    equation = fipy.TransientTerm(coeff=1e-3) == fipy.DiffusionTerm(coeff=fluid.mobility)
    for _ in range(30):
        equation.solve(var=fluid.pressure, dt=1.0, solver=direct())
    assert_allclose(fluid.pressure.value, flow.pressure, atol=1e-7 * np.ptp(flow.pressure))


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
    found = flow.to_fipy().solve(solver=direct())
    assert flow.solution.isolated.any() == (overlap > 1.1547)
    assert_allclose(found, flow.pressure, rtol=0, atol=1e-7)


@pytest.mark.parametrize("factor", [1.17, 1.2, 1.3, 1.4, 1.5])
def test_closed_throats_and_isolated_pores_have_the_pressures_and_forces_of_porefv(factor, mesh_of):
    packing = mesh_of("n200_s1").packing
    mesh = PoreMesh(Packing(packing.centres, factor * packing.radii, packing.box), wall_tolerance=1.0)
    flow = PoreFlow(mesh, Walls.along("y"))
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", OutOfRangeWarning)
        warnings.simplefilter("ignore", NoOpenPathWarning)
        fluid = flow.to_fipy()
        found = fluid.solve()
        assert fluid.mesh.closed_throats > 0
        assert_allclose(found, flow.pressure, atol=1e-7)
        again = PoreFlow.from_pressure(mesh, found, flow.walls)
        assert_allclose(again.forces.total, flow.forces.total, atol=1e-6 * np.abs(flow.forces.total).max())
        c = fipy.CellVariable(mesh=fluid.mesh)
        c.constrain(1.0, where=fluid.mesh.facesBottom)
        c.constrain(0.0, where=fluid.mesh.facesTop)
        for diffusivity in (1.0, 3.0, 1e-14):
            fipy.DiffusionTerm(coeff=diffusivity).solve(var=c)
            assert c.value.min() >= -1e-12
            assert c.value.max() <= 1.0 + 1e-12


def test_a_velocity_of_a_pressure_is_pickled_as_its_values(mesh_of):
    fluid = PoreFlow(mesh_of("n25_s1"), Walls.along("y")).to_fipy()
    fluid.solve()
    v = fluid.velocity_with(fluid.mobility)
    assert_allclose(pickle.loads(pickle.dumps(v)).value, v.value, rtol=1e-15)
