"""Solutes in a flow: conservation, bounds, linearity, steady state, reactions, and equations assembled by hand."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.testing import assert_allclose
from scipy import sparse
from scipy.sparse.linalg import spsolve

from porefv.conductance.prism_sections import diffusive_conductances
from porefv.errors import InputError
from porefv.flow.inside import FixedPressure, FlowSource
from porefv.flow.pore_flow import PoreFlow
from porefv.flow.regions import Sphere
from porefv.flow.walls import Walls
from porefv.mesh.pore_mesh import PoreMesh
from porefv.packing.packing import Packing
from porefv.transport import implicit
from porefv.transport.solute import Solute


def flow_of(name, scale=1.0, **options):
    packing = Packing.read(f"data/packings/{name}.csv")
    scaled = Packing(packing.centres, scale * packing.radii, packing.box)
    return PoreFlow(PoreMesh(scaled, wall_tolerance=1.0), Walls.along("y"), **options)


@pytest.fixture(scope="module")
def small():
    return flow_of("n200_s1", tolerance=1e-13)


def residence(flow):
    return flow.mesh.pore_volumes.sum() / flow.inflow


def strength(flow, peclet):
    """Diffusivity of a Péclet number of the mean grain."""
    speed = flow.inflow / (flow.mesh.box.section(1) * flow.mesh.packing.porosity)
    return 2.0 * speed * flow.mesh.packing.radii.mean() / peclet


def by_hand(flow, diffusivity, losses=0.0):
    """Matrix of inflow, diffusion and losses, and the supply, of a flow whose fluid enters with 1."""
    mesh, n = flow.mesh, flow.mesh.n_pores
    (i, j), q = mesh.throats.pores.T, flow.flux
    g = diffusivity * diffusive_conductances(mesh.throats)
    up, down = np.maximum(q, 0.0), np.maximum(-q, 0.0)
    at_walls = np.bincount(mesh.cell_pore[mesh.wall_faces.cells], flow.face_flux, n)
    matrix = sparse.coo_array((np.r_[-up - g, -down - g], (np.r_[j, i], np.r_[i, j])), shape=(n, n)).tocsr()
    out = np.bincount(i, up, n) + np.bincount(j, down, n) + np.maximum(-at_walls, 0.0)
    own = out + np.bincount(i, g, n) + np.bincount(j, g, n) + losses
    return matrix + sparse.diags_array(own), np.maximum(at_walls, 0.0)


@pytest.mark.parametrize("peclet", [np.inf, 100.0, 1.0, 0.01])
def test_steps_are_those_of_the_matrix_assembled_by_hand(small, peclet):
    diffusivity, dt = strength(small, peclet), 0.02 * residence(small)
    solute = Solute(small, diffusivity)
    matrix, supply = by_hand(small, diffusivity)
    volumes = small.mesh.pore_volumes
    matrix, c = (matrix + sparse.diags_array(volumes / dt)).tocsc(), np.zeros(len(volumes))
    for _ in range(20):
        c = spsolve(matrix, volumes / dt * c + supply)
        solute.advance(dt)
        assert_allclose(solute.concentration, c, rtol=0.0, atol=1e-10)


@pytest.mark.parametrize("peclet", [100.0, 1.0, 0.01])
def test_iterations_for_many_pores_find_the_same(small, peclet, monkeypatch):
    diffusivity, dt = strength(small, peclet), 0.02 * residence(small)
    direct = Solute(small, diffusivity)
    direct.advance(dt, 5)
    steady = direct.steady()
    monkeypatch.setattr(implicit, "FACTOR_LIMIT", 0)
    solute = Solute(small, diffusivity)
    solute.advance(dt, 5)
    assert_allclose(solute.concentration, direct.concentration, rtol=0.0, atol=1e-10)
    assert_allclose(solute.steady(), steady, rtol=0.0, atol=1e-9)
    assert solute.balance.largest_imbalance < 1e-12


@pytest.mark.parametrize("peclet", [np.inf, 100.0, 1.0])
def test_fipy_finds_the_same(small, peclet):
    fipy = pytest.importorskip("fipy")
    diffusivity, dt = strength(small, peclet), 0.02 * residence(small)
    solute = Solute(small, diffusivity)
    solute.advance(dt, 10)
    fluid = small.to_fipy()
    c = fipy.CellVariable(mesh=fluid.mesh, hasOld=True)
    c.constrain(1.0, where=fluid.inlet)
    c.faceGrad.constrain(np.zeros((3, 1)), where=fluid.outlet)
    inward = fipy.FaceVariable(mesh=fluid.mesh, value=diffusivity)
    inward.setValue(0.0, where=fluid.mesh.exteriorFaces)
    spread = fipy.DiffusionTerm(coeff=inward) if diffusivity else 0.0
    equation = fipy.TransientTerm() + fipy.UpwindConvectionTerm(coeff=fluid.velocity) == spread
    with np.errstate(all="ignore"):
        for _ in range(10):
            c.updateOld()
            equation.solve(var=c, dt=dt)
    assert_allclose(c.value, solute.concentration, rtol=0.0, atol=1e-10)


@pytest.mark.parametrize("peclet", [np.inf, 100.0, 10.0])
def test_a_large_packing_conserves_the_solute_in_each_step(peclet):
    flow = flow_of("n2000_s1")
    solute, dt = Solute(flow, strength(flow, peclet)), residence(flow) / 50.0
    leaving = solute.advance(dt, 200)
    late = solute.advance(1e3 * dt, 50)  # pores that are slow to fill
    assert solute.balance.largest_imbalance <= 1e-14
    assert solute.concentration.min() >= 0.0
    assert solute.concentration.max() <= 1.0 + 1e-13
    lacking = dt * (1.0 - leaving).sum() + 1e3 * dt * (1.0 - late).sum()
    assert_allclose(lacking, residence(flow), rtol=1e-6)


@pytest.mark.parametrize("scale", [1.17, 1.20])
@pytest.mark.parametrize("peclet", [np.inf, 10.0])
def test_closed_throats_leave_concentrations_in_range(scale, peclet):
    flow = flow_of("n200_s1", scale)
    solute = Solute(flow, strength(flow, peclet))
    isolated = flow.solution.isolated
    assert isolated.any()
    solute.advance(residence(flow) / 20.0, 200)
    for c in (solute.concentration, solute.steady()):
        assert c.min() >= 0.0
        assert c.max() <= 1.0 + 1e-13
    assert solute.carried.stagnant[isolated].all()
    if peclet == np.inf:
        assert (solute.concentration[isolated] == 0.0).all()


@given(
    peclet=st.sampled_from([np.inf, 50.0, 1.0]),
    dt=st.floats(1e-3, 10.0),
    reaction=st.sampled_from([0.0, 0.1]),
    seed=st.integers(0, 2**32 - 1),
)
@settings(max_examples=30, deadline=None)
def test_bounds_conservation_linearity_and_order(small, peclet, dt, reaction, seed):
    random = np.random.default_rng(seed)
    first, second = random.random((2, small.mesh.n_pores))
    speed = small.inflow / small.mesh.box.section(1)

    def stepped(initial, inflow):
        solute = Solute(
            small, strength(small, peclet), initial=initial, inflow=inflow, grain_reaction=reaction * speed,
            wall_reaction={"x_min": reaction * speed},
        )  # fmt: skip
        solute.advance(dt * residence(small), 2)
        assert solute.balance.largest_imbalance <= 1e-14
        return solute.concentration

    a, b, both = stepped(first, 1.0), stepped(second, 0.5), stepped(first + 2.0 * second, 2.0)
    assert a.min() >= 0.0
    assert a.max() <= 1.0 + 1e-13
    assert_allclose(both, a + 2.0 * b, rtol=0.0, atol=1e-12)
    assert (stepped(np.maximum(first, second), 1.0) >= a - 1e-13).all()


@pytest.mark.parametrize("peclet", [np.inf, 10.0])
def test_the_steady_state_is_that_of_a_long_time(small, peclet):
    speed = small.inflow / small.mesh.box.section(1)
    solute = Solute(small, strength(small, peclet), grain_reaction=0.01 * speed)
    steady = solute.steady()
    solute.advance(1e3 * residence(small), 10)
    assert_allclose(solute.concentration, steady, rtol=0.0, atol=1e-11)
    losses = 0.01 * speed * small.mesh.pore_surfaces
    matrix, supply = by_hand(small, strength(small, peclet), losses)
    assert_allclose(steady, spsolve(matrix.tocsc(), supply), rtol=0.0, atol=1e-10)


def test_fluid_enters_with_the_concentration_of_its_wall_source_or_fixed_pressure():
    packing = Packing.read("data/packings/n200_s1.csv")
    low, high = np.asarray(packing.box.lower), np.asarray(packing.box.upper)
    third, upper = (Sphere(tuple(low + part * (high - low)), 0.15 * (high - low).min()) for part in (0.3, 0.7))
    flow = PoreFlow(
        packing, Walls.along("y"), tolerance=1e-13, sources=[FlowSource(third, 0.02)],
        fixed_pressures=[FixedPressure(upper, 1.5)],
    )  # fmt: skip
    assert flow.fixed_pressure_flux[0] > 0.0
    given = {"y_min": 0.25, "sources": 0.5, "fixed_pressures": 0.75}
    solute = Solute(flow, inflow=given)
    solute.advance(0.05 * residence(flow))
    entered = (
        0.25 * np.maximum(flow.face_flux[flow.mesh.wall_faces.walls == 2], 0.0).sum()
        + 0.5 * 0.02
        + 0.75 * flow.fixed_pressure_flux[0]
    )
    assert_allclose(solute.balance.entered, entered * solute.time, rtol=1e-9)
    assert solute.balance.largest_imbalance <= 1e-14
    steady = solute.steady()
    assert steady.min() >= 0.0
    assert steady.max() <= 0.75 + 1e-13


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"diffusivity": -1.0}, "diffusivity must be finite and not negative"),
        ({"diffusivity": [1.0, 2.0]}, "one for each throat"),
        ({"inflow": {"top": 1.0}}, "inflow has no 'top'"),
        ({"initial": np.nan}, "initial must be finite"),
        ({"wall_reaction": {"sources": 1.0}}, "wall_reaction has no 'sources'"),
        ({"grain_reaction": -1.0}, "grain_reaction must be finite and not negative"),
        ({"tolerance": 2.0}, "tolerance must lie between 0 and 1"),
    ],
)
def test_bad_input_is_refused(small, options, message):
    with pytest.raises(InputError, match=message):
        Solute(small, **options)


def test_a_flow_without_inflow_is_refused(small):
    with pytest.raises(InputError, match="no fluid enters"):
        Solute(PoreFlow(small.mesh, Walls.along("y", drop=0.0)))


def test_steps_must_be_positive(small):
    with pytest.raises(InputError, match="dt must be a positive time"):
        Solute(small).advance(-1.0)
    with pytest.raises(InputError, match="steps must be a whole number"):
        Solute(small).advance(1.0, 0)
