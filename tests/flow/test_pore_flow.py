"""PoreFlow: fluxes, permeability, velocities, and scenes at the edge of what a packing is."""

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from porefv.conductance.effective_radius import EffectiveRadius
from porefv.errors import ComputationError, InputError
from porefv.flow.fluid import Fluid
from porefv.flow.pore_flow import STANDARD_GRAVITY, PoreFlow
from porefv.flow.walls import Wall, Walls
from porefv.mesh.pore_mesh import PoreMesh
from porefv.packing.box import WALLS, Box
from porefv.packing.packing import Packing

UNIT = Box([0, 0, 0], [1, 1, 1])
ODD_BOX = Box([-3.0, 0.25, 1e3], [-1.0, 0.5, 1e3 + 7.0])
NAMES = ["sc8", "nine_0.72", "n25_s1", "n54_s1", "n200_s1", "n2000_s1"]


def check_balance(flow, axis=1):
    """What holds for any flow between a pair of walls, whatever the packing."""
    mesh = flow.mesh
    wall_flux = np.array([flow.wall_flux[name] for name in WALLS])
    held = ~np.isnan(flow.walls.pressures)
    assert_array_equal(wall_flux[~held], 0.0)
    assert flow.inflow > 0.0
    # The tolerance of the solver, or what rounding of the pressures leaves of it.
    bound = 10 * max(flow.solver_report.tolerance, flow.solver_report.floor)
    assert flow.imbalance <= bound < 1e-6
    assert_allclose(wall_flux[2 * axis], -wall_flux[2 * axis + 1], rtol=bound)
    # The maximum principle, but for rounding.
    low, high = np.nanmin(flow.walls.pressures), np.nanmax(flow.walls.pressures)
    slack = 1e-12 * (high - low)
    assert flow.pressure.min() >= low - slack and flow.pressure.max() <= high + slack
    # Every free pore passes on what it receives.
    i, j = mesh.throats.pores.T
    out = np.bincount(i, flow.flux, mesh.n_pores) - np.bincount(j, flow.flux, mesh.n_pores)
    assert np.abs(out[np.isnan(flow.imposed_pressures)]).sum() <= bound * flow.inflow
    assert flow.forces.conservation_residual < 1e-12
    assert np.isfinite(flow.forces.total).all() and np.isfinite(flow.forces.wall_total).all()


# ---- fluxes and permeability ----------


@pytest.mark.parametrize("slip", [False, True], ids=["no-slip", "symmetry"])
@pytest.mark.parametrize("name", NAMES)
def test_what_enters_leaves_and_nothing_passes_the_other_walls(mesh_of, unit_flow, name, slip):
    check_balance(unit_flow(mesh_of(name), Walls.along("y", slip=slip)))


def test_permeability_is_darcys(random_packing):
    mesh = PoreMesh(random_packing(100, seed=2, box=Box([0, -1, 0], [1, 1, 0.5])))
    walls = Walls(y_min=Wall(pressure=7.0), y_max=Wall(pressure=2.0))
    flow = PoreFlow(mesh, walls, Fluid(viscosity=3.0, density=800.0))
    # k = μ Q h0 / (ΔP S)
    assert_allclose(flow.permeability, 3.0 * flow.inflow * 2.0 / (5.0 * 0.5), rtol=1e-11)
    assert flow.hydraulic_conductivity == flow.permeability * 800.0 * STANDARD_GRAVITY / 3.0
    assert_allclose(flow.wall_flux["y_min"], flow.inflow, rtol=1e-12)
    assert_allclose(flow.wall_flux["y_max"], -flow.outflow, rtol=1e-12)


def test_flow_reverses_with_the_pressures(mesh_of, unit_flow):
    mesh = mesh_of("n54_s1")
    there = unit_flow(mesh, Walls.along("y", 1.0))
    back = unit_flow(mesh, Walls.along("y", -1.0))
    assert back.permeability > 0.0
    assert_allclose(back.permeability, there.permeability, rtol=1e-12)
    assert back.wall_flux["y_min"] < 0.0 < back.wall_flux["y_max"]
    assert_allclose(back.forces.total, -there.forces.total, rtol=0, atol=1e-14)


@pytest.mark.parametrize(
    "pressures",
    [
        {"y_min": 1.0},
        {"y_min": 1.0, "x_max": 0.0},
        {"y_min": 1.0, "y_max": 0.0, "x_min": 0.5},
        {"y_min": 1.0, "y_max": 1.0},
        {name: 1.0 for name in WALLS},
    ],
)
def test_permeability_needs_one_pair_of_opposite_walls_at_different_pressures(mesh_of, unit_flow, pressures):
    flow = unit_flow(mesh_of("n25_s1"), Walls(**{name: Wall(pressure=p) for name, p in pressures.items()}))
    with pytest.raises(InputError, match="exactly two pressure walls, opposite each other and at different"):
        _ = flow.permeability
    assert np.isfinite(flow.pressure).all()  # the flow itself is well posed


@pytest.mark.parametrize("solver", ["direct", "cg"])
def test_both_solvers_give_the_same_flow(mesh_of, unit_flow, solver):
    mesh = mesh_of("n2000_s1")
    auto = unit_flow(mesh, Walls.along("y"), tolerance=1e-12)
    flow = unit_flow(mesh, Walls.along("y"), solver=solver, tolerance=1e-12)
    assert flow.solver_report.name == solver
    # Conductances over 10⁵: the tolerance of 1e-12 on fluxes allows 1e-9 on pressures.
    assert_allclose(flow.pressure, auto.pressure, rtol=0, atol=1e-9)
    assert_allclose(flow.permeability, auto.permeability, rtol=1e-11)
    assert flow.solver_report.imbalance <= max(1e-12, flow.solver_report.floor) < 1e-10


def test_a_looser_tolerance_is_passed_on(mesh_of, unit_flow):
    flow = unit_flow(mesh_of("n2000_s1"), Walls.along("y"), tolerance=1e-4)
    assert flow.solver_report.tolerance == 1e-4
    assert_allclose(flow.permeability, unit_flow(mesh_of("n2000_s1"), Walls.along("y")).permeability, rtol=1e-3)


def test_repeated_runs_are_equal_to_the_bit(reference, unit_flow):
    one, two = (unit_flow(PoreMesh(reference("n2000_s1")), Walls.along("y")) for _ in range(2))
    assert_array_equal(one.pressure, two.pressure)
    assert_array_equal(one.forces.total, two.forces.total)
    assert one.permeability == two.permeability


# ---- pressure walls ----------


def test_pores_on_a_pressure_wall_have_its_pressure(mesh_of, unit_flow):
    flow = unit_flow(mesh_of("n54_s1"), Walls(z_max=Wall(pressure=4.0), z_min=Wall(pressure=-1.0)))
    mesh = flow.mesh
    on = mesh.wall_faces.walls == 5
    assert_array_equal(np.unique(flow.cell_pressure[mesh.wall_faces.cells[on]]), [4.0])
    assert (flow.imposed_pressures[mesh.cell_pore[mesh.wall_faces.cells[on]]] == 4.0).all()


def test_pores_on_the_edge_of_two_pressure_walls_have_the_mean_of_theirs(mesh_of, unit_flow):
    mesh = mesh_of("n54_s1")
    flow = unit_flow(mesh, Walls(x_min=Wall(pressure=1.0), y_min=Wall(pressure=0.0), z_min=Wall(pressure=4.0)))
    n = mesh.n_spheres
    walls_of_pore = [set() for _ in range(mesh.n_pores)]
    for cell, pore in zip(mesh.cells.tolist(), mesh.cell_pore.tolist(), strict=True):
        walls_of_pore[pore] |= {v - n for v in cell if v - n in (0, 2, 4)}
    value = {0: 1.0, 2: 0.0, 4: 4.0}
    for pore, walls in enumerate(walls_of_pore):
        if walls:
            assert_allclose(flow.imposed_pressures[pore], np.mean([value[w] for w in walls]), rtol=1e-14)
        else:
            assert np.isnan(flow.imposed_pressures[pore])
    assert max(map(len, walls_of_pore)) == 3


def test_adjoining_pressure_walls_balance(mesh_of, unit_flow):
    for name in ("n25_s1", "n54_s1", "nine_0.72"):
        flow = unit_flow(mesh_of(name), Walls(x_min=Wall(pressure=1.0), y_max=Wall(pressure=0.0)))
        q = flow.wall_flux
        assert q["x_min"] > 0.0 > q["y_max"]
        assert_allclose(q["x_min"], -q["y_max"], rtol=1e-11)
        assert [q[w] for w in ("x_max", "y_min", "z_min", "z_max")] == [0.0] * 4
        assert flow.imbalance < 1e-11
        assert flow.forces.conservation_residual < 1e-12


def test_all_six_walls_can_hold_pressures(mesh_of, unit_flow):
    flow = unit_flow(mesh_of("n200_s1"), Walls(**{name: Wall(pressure=float(k)) for k, name in enumerate(WALLS)}))
    assert_allclose(sum(flow.wall_flux.values()), 0.0, rtol=0, atol=1e-11 * flow.inflow)
    assert flow.imbalance < 1e-11
    assert flow.forces.conservation_residual < 1e-12


@pytest.mark.parametrize("pressures", [(3.0,), (3.0, 3.0), (-2e5, -2e5), (0.0, 0.0)])
def test_equal_pressures_drive_nothing(mesh_of, unit_flow, pressures):
    walls = Walls(**{name: Wall(pressure=p) for name, p in zip(("y_min", "y_max"), pressures, strict=False)})
    flow = unit_flow(mesh_of("n54_s1"), walls)
    assert_array_equal(flow.pressure, pressures[0])
    assert not flow.flux.any() and flow.inflow == flow.outflow == flow.imbalance == 0.0
    assert not flow.pore_velocity.any()


@pytest.mark.parametrize("drop", [1e-9, 1e-3])
def test_a_small_drop_on_a_large_pressure_keeps_its_digits(random_packing, drop):
    mesh = PoreMesh(random_packing(80, seed=6, box=Box([0, 0, 0], [0.3, 0.7, 1.1])))
    walls = Walls(y_min=Wall(pressure=1e5 + drop), y_max=Wall(pressure=1e5))
    given = walls.pressures[2] - walls.pressures[3]  # the drop that survived being added to 1e5
    flow = PoreFlow(mesh, walls)
    plain = PoreFlow(mesh, Walls.along("y", given))
    assert_allclose(flow.permeability, plain.permeability, rtol=1e-12)
    assert_allclose(flow.forces.total, plain.forces.total, rtol=1e-12, atol=1e-15 * given)
    assert_allclose(flow.flux, plain.flux, rtol=1e-12)
    # The sum of the imposed pressures' forces is as small as the drop, although each is as large as the pressure.
    assert_allclose(flow.forces.thrust, [0.0, given * 0.33, 0.0], rtol=1e-12, atol=1e-12 * given)


# ---- velocity ----------


@pytest.mark.parametrize("name", NAMES)
def test_mean_velocity_times_void_is_the_flux_times_the_length(mesh_of, unit_flow, name):
    flow = unit_flow(mesh_of(name), Walls.along("y"))
    along = (flow.pore_velocity * flow.mesh.pore_volumes[:, None]).sum(axis=0)
    # ∫ u dV = Q h0, by the divergence theorem: exact, but for the imbalance of the solver.
    assert_allclose(along[1], flow.inflow * 1.0, rtol=1e-10)
    # Through impervious walls nothing moves sideways on the whole, except where it enters and leaves.
    assert np.abs(along[[0, 2]]).max() < 0.15 * along[1]


def test_mean_velocity_does_not_depend_on_where_the_box_stands(random_packing):
    packing = random_packing(80, seed=3, box=ODD_BOX)
    here = PoreFlow(packing, Walls.along("z"))
    total = (here.pore_velocity * here.mesh.pore_volumes[:, None]).sum(axis=0)
    assert_allclose(total[2], here.inflow * 7.0, rtol=1e-10)


@pytest.mark.parametrize(("kind", "m"), [("sc", 4), ("bcc", 3), ("fcc", 2)])
def test_velocities_in_a_lattice_are_mirrored_with_it(lattice, unit_flow, kind, m):
    mesh = PoreMesh(lattice(kind, m))
    flow = unit_flow(mesh, Walls.along("y", slip=True))
    place = np.empty((mesh.n_pores, 3))
    place[mesh.cell_pore] = mesh.vertices
    middle = mesh.box.size / 2
    for axis in (0, 2):
        mirrored = place.copy()
        mirrored[:, axis] = 2 * middle[axis] - mirrored[:, axis]
        order = [np.linalg.norm(place - x, axis=1).argmin() for x in mirrored]
        assert_allclose(place[order], mirrored, rtol=0, atol=1e-12)
        sign = np.where(np.arange(3) == axis, -1.0, 1.0)
        scale = np.abs(flow.pore_velocity).max()
        assert_allclose(flow.pore_velocity[order], sign * flow.pore_velocity, rtol=0, atol=1e-9 * scale)


# ---- packings at the edge ----------


def test_one_sphere_is_a_packing(unit_flow):
    flow = unit_flow(PoreMesh(Packing([[0.3, 0.6, 0.5]], [0.2], UNIT)), Walls.along("y"))
    check_balance(flow)
    assert flow.solver_report.unknowns == 0
    assert flow.mesh.n_pores == 8
    # The sphere stands nearer to x = 0 and in the middle of z: it is pushed along the flow, and not along z.
    force = flow.forces.total[0]
    assert force[1] > 0.0 and abs(force[2]) < 1e-16


@pytest.mark.parametrize("axis", "xyz")
@pytest.mark.parametrize("normal", [0, 1, 2])
def test_coplanar_spheres_are_a_packing(unit_flow, normal, axis):
    rng = np.random.default_rng(normal)
    grid = np.stack(np.meshgrid(np.arange(5), np.arange(5), indexing="ij"), axis=-1).reshape(-1, 2)
    centres = np.insert((grid + 0.5) / 5 + rng.uniform(-0.02, 0.02, grid.shape), normal, 0.4, axis=1)
    mesh = PoreMesh(Packing(centres, rng.uniform(0.04, 0.075, 25), UNIT))
    assert_allclose(mesh.cell_volumes.sum(), 1.0, rtol=1e-13)
    check_balance(unit_flow(mesh, Walls.along(axis)), "xyz".index(axis))


@pytest.mark.parametrize("normal", [0, 1])
def test_a_layer_of_a_square_lattice_is_a_packing(unit_flow, normal):
    # Coplanar and tied at once.
    grid = np.stack(np.meshgrid(np.arange(4), np.arange(4), indexing="ij"), axis=-1).reshape(-1, 2)
    mesh = PoreMesh(Packing(np.insert((grid + 0.5) / 4, normal, 0.5, axis=1), np.full(16, 0.125), UNIT))
    flow = unit_flow(mesh, Walls.along("y"))
    check_balance(flow)
    total = flow.forces.total
    assert_allclose(total.sum(axis=0)[[0, 2]], 0.0, rtol=0, atol=1e-14)


@pytest.mark.parametrize("axis", "xyz")
@pytest.mark.parametrize("line", [0, 1, 2])
def test_collinear_spheres_are_a_packing(unit_flow, line, axis):
    centres = np.full((7, 3), 0.45)
    centres[:, line] = np.array([0.06, 0.17, 0.33, 0.5, 0.62, 0.8, 0.93])
    mesh = PoreMesh(Packing(centres, [0.05, 0.06, 0.07, 0.08, 0.04, 0.07, 0.05], UNIT))
    assert_allclose(mesh.cell_volumes.sum(), 1.0, rtol=1e-13)
    check_balance(unit_flow(mesh, Walls.along(axis)), "xyz".index(axis))


def test_spheres_along_a_diagonal_are_a_packing(unit_flow):
    centres = np.linspace(0.1, 0.9, 6)[:, None] * np.ones(3)
    mesh = PoreMesh(Packing(centres, np.full(6, 0.08), UNIT))
    assert_allclose(mesh.cell_volumes.sum(), 1.0, rtol=1e-13)
    flow = unit_flow(mesh, Walls.along("y"))
    check_balance(flow)
    # x and z play the same part.
    assert_allclose(flow.forces.total[:, 0], flow.forces.total[:, 2], rtol=0, atol=1e-14)


def grain_among_dust(ratio):
    """A large sphere among some fifty, smaller by the ratio."""
    rng = np.random.default_rng(8)
    small = 0.5 + rng.uniform(-0.45, 0.45, (60, 3))
    small = small[np.linalg.norm(small - 0.5, axis=1) > 0.32]
    radii = np.append(np.full(len(small), 0.3 * ratio), 0.3)
    return PoreMesh(Packing(np.concatenate([small, [[0.5, 0.5, 0.5]]]), radii, UNIT))


@pytest.mark.parametrize("ratio", [0.1, 0.01])
def test_spheres_of_very_different_size_are_a_packing(unit_flow, ratio):
    check_balance(unit_flow(grain_among_dust(ratio), Walls.along("y")))


@pytest.mark.parametrize("ratio", [1e-3, 1e-5, 1e-7])
def test_contrast_beyond_double_precision_is_an_error_not_a_wrong_answer(unit_flow, ratio):
    # Hydraulic radii between grains of dust exceed the box: conductances of 10¹⁵ beside 10⁻³.
    flow = unit_flow(grain_among_dust(ratio), Walls.along("y"))
    try:
        k = flow.permeability
    except ComputationError:
        return
    assert k > 0.0
    assert flow.imbalance < 1e-3
    assert_allclose(flow.wall_flux["y_min"], -flow.wall_flux["y_max"], rtol=1e-3)


@pytest.mark.parametrize("model", [None, EffectiveRadius()], ids=["hydraulic", "effective"])
def test_flat_and_long_boxes_are_boxes(random_packing, unit_flow, model):
    for size in ([1, 1, 0.05], [20, 1, 1], [0.1, 5, 3]):
        mesh = PoreMesh(random_packing(60, seed=1, fraction=0.1, box=Box([0, 0, 0], size)))
        for axis in "xyz":
            check_balance(unit_flow(mesh, Walls.along(axis), model), "xyz".index(axis))


# ---- lattices ----------


@pytest.mark.parametrize(
    ("kind", "m", "axes"), [("sc", 10, (0, 1, 2)), ("bcc", 8, (0, 1, 2)), ("fcc", 7, (0, 1, 2)), ("hcp", 13, (0, 2))]
)
def test_pressures_in_a_lattice_of_a_thousand_spheres_are_mirrored_with_it(lattice, unit_flow, kind, m, axes):
    from scipy.spatial import KDTree

    mesh = PoreMesh(lattice(kind, m, spacing=0.1))  # coordinates, and so ties, are rounded
    flow = unit_flow(mesh, Walls.along("y"))
    check_balance(flow)
    tree = KDTree(mesh.vertices)
    spheres = KDTree(mesh.packing.centres)
    for axis in axes:
        mirrored = mesh.vertices.copy()
        mirrored[:, axis] = mesh.box.upper[axis] - mirrored[:, axis]
        distance, twin = tree.query(mirrored)
        assert distance.max() < 1e-12
        # A mirror across the flow exchanges inlet and outlet. Ties are united, so that no choice of cells shows.
        expected = 1.0 - flow.cell_pressure if axis == 1 else flow.cell_pressure
        assert_allclose(flow.cell_pressure[twin], expected, rtol=0, atol=1e-9)
        image = mesh.packing.centres.copy()
        image[:, axis] = mesh.box.upper[axis] - image[:, axis]
        _, twin = spheres.query(image)
        sign = np.where(np.arange(3) == axis, -1.0, 1.0) * (-1.0 if axis == 1 else 1.0)
        force = flow.forces.total
        assert_allclose(force[twin], sign * force, rtol=0, atol=1e-9 * np.abs(force).max())


# ---- use ----------


def test_packing_will_do_for_a_mesh(reference, mesh_of, unit_flow):
    packing = reference("n25_s1")
    assert (
        unit_flow(packing, Walls.along("y")).permeability == unit_flow(mesh_of("n25_s1"), Walls.along("y")).permeability
    )


def test_only_what_is_asked_for_is_computed(mesh_of, unit_flow):
    flow = unit_flow(mesh_of("n25_s1"), Walls.along("y"))
    assert flow.timings == {}
    _ = flow.permeability
    assert set(flow.timings) == {"throats", "solve"}
    _ = flow.forces
    assert set(flow.timings) == {"throats", "solve", "forces"}


def test_flow_without_a_pressure_wall_is_refused(mesh_of):
    with pytest.raises(InputError, match="no wall has a pressure"):
        PoreFlow(mesh_of("n25_s1"), Walls())


@pytest.mark.parametrize("viscosity", [0.0, -1e-3, np.nan, np.inf])
def test_viscosity_that_is_not_positive_is_refused(viscosity):
    with pytest.raises(InputError, match="viscosity must be a positive number"):
        Fluid(viscosity=viscosity)


@pytest.mark.parametrize("density", [-1.0, np.nan, np.inf])
def test_density_that_is_negative_or_no_number_is_refused(density):
    with pytest.raises(InputError, match="density"):
        Fluid(density=density)


@pytest.mark.parametrize("gravity", [(0, 0), (0, 0, np.nan), 9.81])
def test_gravity_that_is_not_a_vector_is_refused(mesh_of, gravity):
    with pytest.raises(InputError, match="gravity must be three finite numbers"):
        PoreFlow(mesh_of("n25_s1"), Walls.along("y"), gravity=gravity)


def test_repr_tells_what_flows_where(mesh_of, unit_flow):
    flow = unit_flow(mesh_of("n25_s1"), Walls.along("y"))
    assert repr(flow) == (
        "PoreFlow(PoreMesh(25 spheres, 122 pores, 240 throats, box 1×1×1 m), section-friction, y_min 1 Pa, y_max 0 Pa)"
    )
