"""Grains and fluid together: conservation, limits with closed solutions, stability, resumption."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_allclose

from porefv import Box, Fluid, Packing, PoreFlow, PoreMesh, Wall, Walls
from porefv.conductance.registry import MODELS
from porefv.conductance.section_friction.model import SectionFriction
from porefv.coupling.coupling import Coupling
from porefv.coupling.exchange import Exchange
from porefv.dem.dem import DEM
from porefv.dem.material import Material
from porefv.dem.plate import Plate
from porefv.errors import InputError
from porefv.flow.pressure_on_grains import solid_pressure_weights

DRAINED = Walls.from_mapping({"z_min": {"pressure": 0.0}, "z_max": {"pressure": 0.0}, "lateral": {"slip": True}})
SEALED = Walls.from_mapping({"lateral": {"slip": True}})
OUTWARD = np.tile([-1.0, 1.0], 3)


def normal_speeds(grains):
    return grains.wall_velocities[np.arange(6), np.arange(6) // 2] * OUTWARD


@pytest.fixture
def sample(reference):
    """200 grains at rest between fixed smooth walls and a plate on z_max."""

    def make(stress, friction=30.0, **plates):
        dem = DEM(
            reference("n200_s1"), Material(15e6, 0.5, friction, 2600.0),
            {"z_max": Plate(stress=3e3, top_speed=0.05)}, damping=0.3,
        )  # fmt: skip
        dem.run_to_rest(1e-5, 1e-4, 20_000)
        dem.damping = 0.0
        dem.set_plates({"z_max": Plate(stress=stress, top_speed=0.05), **plates})
        return dem

    return make


# ---- the operator ----------------------------------------------------------------------------------------------


@pytest.fixture(params=["facets", "facets of pore centres", "volumes"])
def exchange(request, reference):
    mesh, slip = PoreMesh(reference("n54_s1")), np.array([True] * 4 + [False] * 2)
    if request.param != "facets of pore centres":
        return mesh, Exchange.of(mesh, request.param, slip)
    flow = PoreFlow(mesh, Walls(z_max=Wall(pressure=1.0), **dict.fromkeys(("x_min", "x_max"), Wall(slip=True))))
    weights = solid_pressure_weights(
        mesh, SectionFriction(), flow.conductances, slip, ~np.isnan(flow.imposed_pressures)
    )
    return mesh, Exchange.of(mesh, "facets", slip, split="drag", solid_pressure=weights)


def test_rates_of_all_pores_add_up_to_that_of_the_box(exchange):
    mesh, operator = exchange
    rng = np.random.default_rng(1)
    walls = rng.normal(size=(6, 3))
    rates = operator.rates(rng.normal(size=(54, 3)), walls)
    sections = [mesh.box.section(wall // 2) for wall in range(6)]
    box = np.dot(walls[np.arange(6), np.arange(6) // 2] * OUTWARD, sections)
    assert_allclose(rates.sum(), box, rtol=1e-12)


def test_forces_do_the_work_that_rates_take(exchange):
    mesh, operator = exchange
    rng = np.random.default_rng(2)
    velocities, walls, pressure = rng.normal(size=(54, 3)), rng.normal(size=(6, 3)), rng.normal(size=mesh.n_cells)
    grains, on_walls = operator.forces(pressure, 54)
    work = (grains * velocities).sum() + (on_walls * walls).sum()
    assert_allclose(work, np.dot(pressure, operator.rates(velocities, walls)), rtol=1e-11)


def test_forces_of_any_pressures_add_up_to_nothing(exchange):
    mesh, operator = exchange
    pressure = np.random.default_rng(3).normal(size=mesh.n_cells)
    grains, walls = operator.forces(pressure, 54)
    assert_allclose(grains.sum(axis=0) + walls.sum(axis=0), 0.0, atol=1e-12 * np.abs(grains).sum())


def test_the_whole_moving_on_changes_no_pore(exchange):
    _mesh, operator = exchange
    velocity = np.array([0.3, -0.2, 0.5])
    rates = operator.rates(np.tile(velocity, (54, 1)), np.tile(velocity, (6, 1)))
    assert_allclose(rates, 0.0, atol=1e-14)


def test_volume_rates_are_those_of_the_cells(reference):
    mesh = PoreMesh(reference("n54_s1"))
    rng = np.random.default_rng(4)
    velocities, speeds = rng.normal(size=(54, 3)), rng.normal(size=6)
    walls = np.zeros((6, 3))
    walls[np.arange(6), np.arange(6) // 2] = speeds * OUTWARD
    rates = Exchange.of(mesh, "volumes", np.zeros(6, bool)).rates(velocities, walls)
    assert_allclose(rates, mesh.cell_volume_rates(velocities, speeds), atol=1e-13)


@pytest.mark.parametrize("slip", [False, True])
@pytest.mark.parametrize("model", MODELS.values())
def test_facet_forces_are_those_of_a_steady_flow(reference, slip, model):
    packing = reference("n54_s1")
    walls = Walls.along("y", slip=slip)
    flow = PoreFlow(packing, walls, conductance=model())
    held = ~np.isnan(flow.imposed_pressures)
    weights = solid_pressure_weights(flow.mesh, flow.conductance, flow.conductances, walls.slip, held)
    assert (weights is not None) == (model is SectionFriction)
    operator = Exchange.of(flow.mesh, "facets", walls.slip, split=model.force_split, solid_pressure=weights)
    grains, _ = operator.forces(flow.cell_pressure, len(packing))
    assert_allclose(grains, flow.forces.pressure + flow.forces.viscous, atol=1e-13)


# ---- one pore, one layer, a piston -----------------------------------------------------------------------------


def piston(viscosity, scheme="implicit-drag"):
    """One grain between smooth walls, not touching; z_max, drained, pushed down at a given speed."""
    packing = Packing([[0.5, 0.5, 0.5]], [0.4], Box([0, 0, 0], [1, 1, 1]))
    dem = DEM(packing, plates={"z_max": Plate(velocity=(0.0, 0.0, -1e-6))}, step=1e-5)
    walls = Walls.from_mapping({"z_max": {"pressure": 0.0}, "lateral": {"slip": True}})
    return Coupling(dem, walls, Fluid(viscosity=viscosity), scheme=scheme, tolerance=1e-12)


def test_a_piston_drives_out_what_it_displaces():
    coupling = piston(1.0)
    coupling.run(50)
    assert_allclose(coupling.wall_flux["z_max"], -1e-6, rtol=1e-9)
    assert coupling.wall_flux["z_min"] == 0.0
    assert coupling.power.imbalance < 1e-9


def test_a_grain_under_a_piston_comes_to_move_with_the_fluid():
    # No force holds the grain: in the end none acts on it, and it goes at the speed at which the four pores below,
    # one by symmetry, are squeezed as fast as they are fed: no flow past it, v = that of the fluid it displaces.
    coupling = piston(1e3)
    coupling.run(2000)
    weight = coupling.grains.masses[0] * 9.81
    assert np.abs(coupling.fluid_forces).max() < 1e-9 * weight
    below = coupling.cell_pressure.max()
    assert below < 1e-6


@pytest.mark.parametrize("steps", [100, 400, 4000])
def test_a_grain_is_pushed_through_a_tube_as_its_throats_let_it(steps):
    # The pore below is joined to that above by throats of conductance K in all. A grain that sweeps the area A drives
    # A v through them, against a pressure A v / K: m v' = F - A² v / K, v = (1 - exp(-t A²/(K m))) F K / A².
    packing = Packing([[0.5, 0.5, 0.5]], [0.45], Box([0, 0, 0], [1, 1, 1]))
    dem = DEM(packing, Material(15e6), step=1e-5)
    walls = Walls.from_mapping({"z_max": {"pressure": 0.0}, "lateral": {"slip": True}})
    coupling = Coupling(dem, walls, Fluid(viscosity=500.0), scheme="implicit-drag", tolerance=1e-12)
    force = 20.0
    dem.apply(np.array([[0.0, 0.0, -force]]))
    coupling.run(steps)

    mesh = coupling.mesh
    low = mesh.vertices[:, 2] < 0.5
    below = np.zeros(mesh.n_pores, bool)
    below[mesh.cell_pore[low]] = True
    flow = PoreFlow(mesh, walls, Fluid(viscosity=500.0))
    conductance = flow.conductances[below[mesh.throats.pores].sum(axis=1) == 1].sum()
    swept = abs(Exchange.of(mesh, "facets", walls.slip).rates(np.array([[0.0, 0.0, 1.0]]), np.zeros((6, 3)))[low].sum())
    drag = swept**2 / conductance
    speed = force / drag * -np.expm1(-dem.time * drag / dem.masses[0])
    # The step is implicit: first order in dt drag / m, which is 5e-4.
    assert_allclose(-dem.velocities[0, 2], speed, rtol=5e-4)
    assert_allclose(coupling.cell_pressure[low], swept * speed / conductance, rtol=5e-4)


# ---- conservation ----------------------------------------------------------------------------------------------


def test_momentum_and_volume_and_power_balance_at_each_step(sample):
    dem = sample(6e3)
    coupling = Coupling(dem, DRAINED, Fluid(viscosity=100.0), tolerance=1e-11)
    for _ in range(20):
        momentum = (dem.masses[:, None] * dem.velocities).sum(axis=0)
        predicted, _, mobilities, _ = dem.predict()
        contacts = ((predicted[dem.rows] - dem.velocities) / mobilities[dem.rows, None]).sum(axis=0)
        coupling.run(1)
        gained = (dem.masses[:, None] * dem.velocities).sum(axis=0) - momentum
        fluid = coupling.fluid_forces
        assert_allclose(gained, dem.step * (contacts + fluid.sum(axis=0)), atol=1e-10 * dem.step * np.abs(fluid).sum())
        on_walls = coupling.wall_fluid_forces.sum(axis=0)
        assert_allclose(fluid.sum(axis=0) + on_walls, 0.0, atol=1e-10 * np.abs(fluid).sum())
        box = coupling.mesh.box
        rate = np.dot(normal_speeds(dem), [box.section(wall // 2) for wall in range(6)])
        assert_allclose(sum(coupling.wall_flux.values()), rate, rtol=1e-8)
        assert coupling.power.imbalance < 1e-9


def test_a_closed_vessel_has_no_pressure_but_what_moves_its_fluid(reference):
    """Where a common pressure drives nothing, its level is free: it must not come from rounding."""
    dem = DEM(reference("n54_s1"), Material(15e6, 0.5, 30.0, 2600.0), gravity=(0.0, 0.0, -9.81))
    coupling = Coupling(dem, SEALED, Fluid(1.0))
    for _ in range(5):
        coupling.run(5)
        assert np.abs(coupling.pressure).max() <= 10.0 * np.ptp(coupling.pressure)


@pytest.mark.parametrize(("walls", "height"), [
    ({"z_min": {"pressure": 0.0}, "z_max": {"pressure": 0.0}}, 0.5), ({"z_max": {"pressure": 0.0, "free": True}}, 0.05),
])  # fmt: skip
def test_walls_that_hold_every_pore_are_refused(walls, height):
    dem = DEM(Packing([[0.5, 0.5, height]], [0.05], Box([0, 0, 0], [1, 1, 1])), gravity=(0.0, 0.0, -9.81))
    with pytest.raises(InputError, match=r"each of 8 pores is imposed by a wall"):
        Coupling(dem, Walls.from_mapping(walls), Fluid(1.0)).run(1)


def test_an_undrained_sample_bears_an_isotropic_load_in_its_pressure(sample):
    # An incompressible fluid lets nothing through to the grains: p = Δσ everywhere, contacts as before.
    plates = {wall: Plate(stress=3e3, top_speed=0.05) for wall in ("x_max", "y_max", "z_max")}
    dem = sample(3e3)
    dem.damping = 0.3
    dem.set_plates(plates)
    dem.run_to_rest(1e-5, 1e-5, 20_000)
    dem.damping = 0.0
    before = dem.stress
    dem.set_plates({wall: Plate(stress=8e3, top_speed=0.05) for wall in plates})
    coupling = Coupling(dem, SEALED, Fluid(viscosity=1.0), tolerance=1e-8)
    coupling.run(2000)
    assert_allclose(coupling.pressure, 5e3, rtol=1e-3)
    assert_allclose(np.diag(dem.stress), np.diag(before), atol=1e-3 * 5e3)


def test_an_incompressible_fluid_needs_a_way_out(sample):
    dem = sample(3e3)
    dem.set_plates({"z_max": Plate(velocity=(0.0, 0.0, -1e-3))})
    with pytest.raises(InputError, match="nowhere to go"):
        Coupling(dem, SEALED).run(1)


def test_walls_of_imposed_flow_are_refused(sample):
    walls = Walls(z_max=Wall(inflow=1e-3), z_min=Wall(pressure=0.0))
    with pytest.raises(InputError, match="z_max has an imposed flow"):
        Coupling(sample(3e3), walls)


# ---- schemes ---------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("viscosity", [1e-6, 1e-3, 1.0, 1e3, 1e6])
def test_any_viscosity_runs_at_the_step_of_the_dry_grains(sample, viscosity):
    dem = sample(6e3)
    coupling = Coupling(dem, DRAINED, Fluid(viscosity=viscosity), scheme="implicit-drag")
    start = dem.energies.stored
    coupling.run(300)
    assert np.isfinite(coupling.pressure).all()
    energies = dem.energies
    # What grains hold is what they had and what the plate gave, less what the fluid took.
    assert energies.kinetic <= start + energies.walls
    assert coupling.pressure.max() < 3 * 6e3


def test_an_unstable_explicit_step_is_refused(sample):
    with pytest.raises(InputError, match=r"drag number is .*Use scheme = 'implicit-drag', or a step below"):
        Coupling(sample(6e3), DRAINED, Fluid(viscosity=100.0), scheme="semi-implicit")


def test_auto_takes_the_explicit_step_where_drag_is_weak(sample):
    assert Coupling(sample(6e3), DRAINED, Fluid(viscosity=1e-6)).scheme == "semi-implicit"
    assert Coupling(sample(6e3), DRAINED, Fluid(viscosity=100.0)).scheme == "implicit-drag"


def test_schemes_agree_where_the_step_is_short(sample):
    settled = {}
    for scheme in ("semi-implicit", "implicit-drag"):
        dem = sample(6e3)
        coupling = Coupling(dem, DRAINED, Fluid(viscosity=1e-3), scheme=scheme, tolerance=1e-8)
        assert coupling.drag_number is None or coupling.drag_number < 1e-2
        coupling.run(300)
        settled[scheme] = dem.positions
    moved = np.abs(settled["semi-implicit"] - sample(6e3).positions).max()
    assert_allclose(settled["semi-implicit"], settled["implicit-drag"], atol=5e-3 * moved)


def test_the_drag_number_is_the_limit_of_the_explicit_step(sample):
    # The largest eigenvalue of D Eᵀ G⁻¹ E against that of the dense matrix.
    dem = sample(6e3)
    coupling = Coupling(dem, DRAINED, Fluid(viscosity=1e-3), scheme="semi-implicit", end_correction=False)
    pores = coupling.equation
    free = np.count_nonzero(pores.free)
    forces = np.stack([pores.forces(unit)[:-6].ravel() for unit in np.eye(free)], axis=1)
    mobilities = np.empty(len(dem))
    mobilities[dem.rows] = dem.step / dem.masses
    root = np.sqrt(np.repeat(mobilities, 3))[:, None]
    drag = (root * forces) @ np.linalg.solve(pores.network.to_matrix().toarray(), (root * forces).T)
    assert_allclose(coupling.drag_number, np.linalg.eigvalsh(drag)[-1], rtol=0.02)


# ---- meshes, states --------------------------------------------------------------------------------------------


def test_pressures_go_on_when_the_mesh_is_made_anew(sample):
    dem = sample(6e3)
    coupling = Coupling(dem, DRAINED, Fluid(viscosity=100.0), tolerance=1e-6, renewal=1.0)
    coupling.run(200)
    before, meshes = coupling.cell_pressure.copy(), coupling.effort.meshes
    volumes = coupling.mesh.cell_volumes
    coupling.renew_mesh()
    coupling.run(1)
    assert coupling.effort.meshes == meshes + 1
    mean = np.average(before, weights=volumes)
    after = np.average(coupling.cell_pressure, weights=coupling.mesh.cell_volumes)
    assert_allclose(after, mean, rtol=0.02)


def test_pressures_of_walls_may_change(sample):
    # The same pressure on both ends is borne by all pores, and moves nothing.
    dem = sample(3e3)
    coupling = Coupling(dem, DRAINED, Fluid(viscosity=1e-3), tolerance=1e-9)
    coupling.run(1)
    still = {wall: Wall(pressure=7e3) for wall in ("z_min", "z_max")} | {
        wall: Wall(slip=True) for wall in ("x_min", "x_max", "y_min", "y_max")
    }
    dem.set_plates({})
    coupling.set_walls(Walls(**still))
    coupling.run(200)
    assert_allclose(coupling.pressure, 7e3, rtol=1e-4)
    assert coupling.effort.meshes == 1


@given(st.integers(0, 2**32 - 1), st.integers(1, 12), st.sampled_from(["facets", "volumes"]))
def test_the_operator_balances_in_any_packing(random_packing, seed, n, kind):
    mesh = PoreMesh(random_packing(n, 0.2, seed))
    rng = np.random.default_rng(seed)
    operator, n = Exchange.of(mesh, kind, np.zeros(6, bool)), mesh.n_spheres
    velocities, walls, pressure = rng.normal(size=(n, 3)), rng.normal(size=(6, 3)), rng.normal(size=mesh.n_cells)
    grains, on_walls = operator.forces(pressure, n)
    size = np.abs(operator.gradients).sum()
    work = (grains * velocities).sum() + (on_walls * walls).sum()
    assert_allclose(work, np.dot(pressure, operator.rates(velocities, walls)), atol=1e-12 * size)
    assert_allclose(grains.sum(axis=0) + on_walls.sum(axis=0), 0.0, atol=1e-12 * size)
    sections = [mesh.box.section(wall // 2) for wall in range(6)]
    box = np.dot(walls[np.arange(6), np.arange(6) // 2] * OUTWARD, sections)
    assert_allclose(operator.rates(velocities, walls).sum(), box, atol=1e-12 * size)
