"""Forces of the fluid: what they add up to, what does not move, and what is symmetric."""

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from porefv.conductance.effective_radius import EffectiveRadius
from porefv.conductance.hydraulic_radius import HydraulicRadius
from porefv.conductance.section_friction.model import SectionFriction
from porefv.flow.fluid import Fluid
from porefv.flow.forces import grain_forces
from porefv.flow.pore_flow import PoreFlow
from porefv.flow.walls import Wall, Walls
from porefv.mesh.pore_mesh import PoreMesh
from porefv.packing.box import Box
from porefv.packing.packing import Packing

UNIT = Box([0, 0, 0], [1, 1, 1])
NAMES = ["sc8", "nine_0.2", "nine_0.72", "n25_s1", "n54_s1", "n200_s1", "n2000_s1"]
MODELS = [HydraulicRadius(), EffectiveRadius(), SectionFriction()]


def everything(forces):
    """Sum of the pressure and viscous forces on all spheres and walls."""
    return (forces.pressure + forces.viscous).sum(axis=0) + (forces.wall_pressure + forces.wall_viscous).sum(axis=0)


# ---- sums ----------


@pytest.mark.parametrize("model", MODELS, ids=["hydraulic", "effective", "sections"])
@pytest.mark.parametrize("slip", [False, True], ids=["no-slip", "symmetry"])
@pytest.mark.parametrize("name", NAMES)
def test_force_sum_equals_pressure_drop_times_section(mesh_of, unit_flow, name, slip, model):
    forces = unit_flow(mesh_of(name), Walls.along("y", slip=slip), model).forces
    # Exact for any pressures, converged or not: rounding of 10⁵ terms is all there is.
    assert_allclose(everything(forces), [0.0, 1.0, 0.0], rtol=0, atol=1e-12)
    assert_allclose(forces.thrust, [0.0, 1.0, 0.0], rtol=0, atol=1e-12)
    assert forces.conservation_residual < 1e-12
    assert forces.scale == 1.0


@pytest.mark.parametrize("axis", "xyz")
def test_force_sum_is_the_thrust_in_any_box(random_packing, axis):
    box = Box([-3.0, 0.25, 1e3], [-1.0, 0.5, 1e3 + 7.0])
    mesh = PoreMesh(random_packing(120, ratio=0.3, seed=4, fraction=0.15, box=box))
    forces = PoreFlow(mesh, Walls.along(axis, 250.0), Fluid(1e-3)).forces
    k = "xyz".index(axis)
    expected = np.zeros(3)
    expected[k] = 250.0 * box.section(k)
    assert_allclose(everything(forces), expected, rtol=0, atol=1e-12 * forces.scale)
    assert forces.scale == 250.0 * 14.0  # the largest section


def test_force_sum_is_the_thrust_with_adjoining_pressure_walls(mesh_of, unit_flow):
    mesh = mesh_of("n54_s1")
    walls = Walls(x_min=Wall(pressure=3.0), y_min=Wall(pressure=1.0), y_max=Wall(pressure=0.0))
    flow = unit_flow(mesh, walls)
    forces = flow.forces
    assert_allclose(everything(forces), forces.thrust, rtol=0, atol=1e-12 * forces.scale)
    # The thrust is the mean pressure on each open wall times its section; pores on edges have the mean of theirs.
    faces = mesh.wall_faces
    on = faces.walls == 0
    assert_allclose(forces.thrust[0], faces.areas[on] @ flow.cell_pressure[faces.cells[on]], rtol=1e-12)
    assert 2.0 < forces.thrust[0] < 3.0


def test_force_sum_does_not_wait_for_the_solver(mesh_of):
    # Any pressures on the pores: the facets' forces add up to the resultant on the box's surface.
    mesh = mesh_of("n200_s1")
    pressure = np.random.default_rng(0).random(mesh.n_pores)
    forces = grain_forces(mesh, pressure, Walls())
    assert_allclose(everything(forces), 0.0, rtol=0, atol=1e-12)
    assert_array_equal(forces.thrust, 0.0)


def test_sums_are_those_of_the_parts(mesh_of):
    flow = PoreFlow(mesh_of("n25_s1"), Walls.along("y"), Fluid(1.0, 2.0), gravity=(0, -9.81, 0))
    forces = flow.forces
    sums = forces.sums
    assert list(sums) == [
        "pressure", "viscous", "buoyancy", "total", "wall_pressure", "wall_viscous", "wall_buoyancy", "wall_total"
    ]  # fmt: skip
    assert_allclose(sums["total"], sums["pressure"] + sums["viscous"] + sums["buoyancy"], rtol=1e-13, atol=1e-14)
    assert_array_equal(forces.total, forces.pressure + forces.viscous + forces.buoyancy)
    assert_array_equal(forces.wall_total, forces.wall_pressure + forces.wall_viscous + forces.wall_buoyancy)
    assert "25 spheres" in repr(forces)


# ---- what does not move ----------


@pytest.mark.parametrize("pressure", [3.0, -2e5, 1e-9])
@pytest.mark.parametrize("name", ["nine_0.72", "n54_s1"])
def test_uniform_pressure_gives_no_force_on_any_sphere(mesh_of, unit_flow, name, pressure):
    walls = Walls(y_min=Wall(pressure=pressure), y_max=Wall(pressure=pressure))
    forces = unit_flow(mesh_of(name), walls).forces
    assert_array_equal(forces.total, 0.0)  # not even rounding
    assert_array_equal(forces.wall_viscous, 0.0)
    # The impervious walls bear it, outwards, and so balance one another.
    expected = np.zeros((6, 3))
    for wall in (0, 1, 4, 5):
        expected[wall, wall // 2] = pressure if wall % 2 else -pressure
    assert_allclose(forces.wall_pressure, expected, rtol=1e-14)
    assert forces.conservation_residual < 1e-13


def test_one_pressure_wall_alone_moves_nothing(mesh_of, unit_flow):
    forces = unit_flow(mesh_of("n25_s1"), Walls(y_min=Wall(pressure=2.0))).forces
    assert_array_equal(forces.total, 0.0)
    assert_allclose(forces.wall_pressure[3], [0.0, 2.0, 0.0], rtol=1e-14)
    assert_allclose(forces.thrust, [0.0, 2.0, 0.0], rtol=1e-14)


def test_a_constant_added_to_all_pressures_changes_no_force_on_spheres(mesh_of, unit_flow):
    mesh = mesh_of("n54_s1")
    low = unit_flow(mesh, Walls.along("y", 1.0)).forces
    high = unit_flow(mesh, Walls(y_min=Wall(pressure=4.0), y_max=Wall(pressure=3.0))).forces
    assert_array_equal(high.total, low.total)
    assert_array_equal(high.wall_viscous, low.wall_viscous)
    assert_allclose(high.wall_pressure[5] - low.wall_pressure[5], [0, 0, 3.0], rtol=0, atol=1e-13)


def test_pressure_part_and_viscous_part_are_along_the_drop(mesh_of, unit_flow):
    forces = unit_flow(mesh_of("n2000_s1"), Walls.along("y")).forces
    # On the whole the fluid pushes every grain of a dense packing along.
    assert (forces.pressure[:, 1] > 0.0).all() and (forces.viscous[:, 1] > 0.0).all()
    for wall in (0, 1, 4, 5):
        assert forces.wall_viscous[wall, 1] > 0.0
        assert_allclose(forces.wall_viscous[wall, wall // 2], 0.0, rtol=0, atol=1e-15)  # drag is along the wall
        assert forces.wall_pressure[wall, wall // 2] * (1 if wall % 2 else -1) > 0.0  # pressure presses outwards
    assert_array_equal(forces.wall_pressure[2:4], 0.0)  # open walls


def test_symmetry_walls_are_not_dragged(mesh_of, unit_flow):
    forces = unit_flow(mesh_of("n200_s1"), Walls.along("y", slip=True)).forces
    assert_array_equal(forces.wall_viscous, 0.0)
    assert_allclose((forces.pressure + forces.viscous).sum(axis=0)[1], 1.0, rtol=1e-12)


# ---- gravity ----------


@pytest.mark.parametrize("gravity", [(0, -9.81, 0), (0, 0, 9.81), (1.0, -2.0, 3.0), (0, 0, 0)])
def test_buoyancy_and_hydrostatic_pressure_carry_the_weight_of_the_fluid(random_packing, gravity):
    box = Box([1.0, -2.0, 0.5], [1.5, -1.0, 2.5])
    packing = random_packing(60, seed=7, fraction=0.2, box=box)
    flow = PoreFlow(packing, Walls.along("y"), Fluid(1e-3, 1000.0), gravity=gravity)
    forces = flow.forces
    weight = 1000.0 * np.array(gravity, float)
    volumes = 4 / 3 * np.pi * packing.radii**3
    assert_allclose(forces.buoyancy, -np.outer(volumes, weight), rtol=1e-14)
    # Archimedes: the walls bear the weight of a box full of fluid, the spheres are lifted by what they displace.
    assert_allclose(forces.wall_buoyancy.sum(axis=0), weight * box.volume, rtol=1e-13, atol=1e-9)
    fluid = flow.mesh.pore_volumes.sum()
    total = forces.buoyancy.sum(axis=0) + forces.wall_buoyancy.sum(axis=0)
    assert_allclose(total, weight * fluid, rtol=1e-12, atol=1e-9)
    # Gravity moves nothing else: pressures are piezometric.
    still = PoreFlow(packing, Walls.along("y"), Fluid(1e-3, 1000.0)).forces
    assert_array_equal(forces.pressure, still.pressure)
    assert_array_equal(forces.viscous, still.viscous)


def test_hydrostatic_pressure_is_zero_at_the_top_and_grows_downwards():
    mesh = PoreMesh(Packing([[0.5, 1.0, 1.5]], [0.2], Box([0, 0, 0], [1, 2, 3])))
    forces = PoreFlow(mesh, Walls.along("y"), Fluid(1.0, 10.0), gravity=(0, 0, -5.0)).forces.wall_buoyancy
    # ρ g = 50: no pressure on z_max, 150 on z_min (section 2), a mean of 75 on the sides (sections 6 and 3).
    expected = [[-450, 0, 0], [450, 0, 0], [0, -225, 0], [0, 225, 0], [0, 0, -300], [0, 0, 0]]
    assert_allclose(forces, expected, rtol=1e-14)


# ---- symmetry ----------


@pytest.mark.parametrize("slip", [False, True], ids=["no-slip", "symmetry"])
@pytest.mark.parametrize("name", ["sc8", "nine_0.2", "nine_0.4", "nine_0.5", "nine_0.72"])
def test_forces_on_a_symmetric_packing_are_symmetric(reference, mesh_of, unit_flow, name, slip):
    packing = reference(name)
    forces = unit_flow(mesh_of(name), Walls.along("y", slip=slip)).forces
    for part in (forces.pressure, forces.viscous):
        big = part[:8]
        # Mirrored in x and z with the places; across the middle of the flow, the sense of it changes as well.
        side = np.sign(packing.centres[:8] - 0.5)
        across = (big * side * side[:, 1:2])[:, [0, 2]]
        assert_allclose(across, np.full((8, 2), across[0, 0]), rtol=0, atol=1e-14)
        assert_allclose(big[:, 1], big[0, 1], rtol=1e-12)
        assert_allclose(part[8:, [0, 2]], 0.0, rtol=0, atol=1e-14)  # the centre sphere is pushed along y only
    assert_allclose(forces.wall_viscous[[0, 1, 4, 5], 1], forces.wall_viscous[0, 1], rtol=1e-12)


@pytest.mark.parametrize("axis", "xyz")
def test_spheres_of_a_cubic_lattice_share_the_drop_equally(lattice, unit_flow, axis):
    for radius in (1.0, 0.7):
        forces = unit_flow(PoreMesh(lattice("sc", 4, radius)), Walls.along(axis, slip=True)).forces
        expected = np.zeros((64, 3))
        expected[:, "xyz".index(axis)] = 16.0 / 64  # ΔP S / n
        assert_allclose(forces.total, expected, rtol=0, atol=1e-12)


def test_forces_in_a_lattice_do_not_show_how_ties_were_cut(lattice, unit_flow):
    # Between the symmetric halves of a square a triangulation must choose; forces are shared over the whole square.
    forces = unit_flow(PoreMesh(lattice("sc", 3)), Walls.along("y")).forces.total.reshape(3, 3, 3, 3)
    _x, _y, _z = range(3)
    assert_allclose(forces[::-1], forces * [-1, 1, 1], rtol=0, atol=1e-13)
    assert_allclose(forces[:, :, ::-1], forces * [1, 1, -1], rtol=0, atol=1e-13)
    assert_allclose(forces.transpose(2, 1, 0, 3)[..., [2, 1, 0]], forces, rtol=0, atol=1e-13)
    assert_allclose(forces[:, ::-1], forces * [-1, 1, -1], rtol=0, atol=1e-13)


# ---- one facet by hand ----------


def test_forces_of_one_sphere_between_walls_by_hand(unit_flow):
    # Four equal throats along the flow, ΔP = 1: pressure on the disc of the sphere, drag on the rest by surface.
    r = 0.3
    mesh = PoreMesh(Packing([[0.5, 0.5, 0.5]], [r], UNIT))
    forces = unit_flow(mesh, Walls.along("y"), HydraulicRadius()).forces
    disc = np.pi * r**2
    sphere, walls = 4 * np.pi * r**2 / 12, 0.5
    assert_allclose(forces.pressure[0], [0, disc, 0], rtol=0, atol=1e-15)
    assert_allclose(forces.viscous[0], [0, (1 - disc) * sphere / (sphere + walls), 0], rtol=0, atol=1e-15)
    assert_allclose(forces.wall_viscous[[0, 1, 4, 5], 1], (1 - disc) * walls / 4 / (sphere + walls), rtol=1e-13)
