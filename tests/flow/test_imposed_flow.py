"""Walls of imposed flow: they have the pressure at which that flow passes."""

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from porefv.errors import ComputationError, InputError
from porefv.flow.fluid import Fluid
from porefv.flow.forces import grain_forces
from porefv.flow.imposed_flow import solve_imposed_flow
from porefv.flow.pore_flow import PoreFlow
from porefv.flow.pressure import solve_pressure
from porefv.flow.walls import Wall, Walls
from porefv.mesh.pore_mesh import PoreMesh
from porefv.packing.box import WALLS, Box
from porefv.packing.packing import Packing


@pytest.mark.parametrize("solver", ["direct", "cg"])
@pytest.mark.parametrize(
    "pressures",
    [
        {"y_min": 2.0, "y_max": 0.5},
        {"x_min": 1.0, "y_max": 0.0},
        {"x_min": 1.0, "y_max": 0.0, "z_min": 0.4},
        {name: float(k) for k, name in enumerate(WALLS)},
    ],
    ids=["opposite", "at a corner", "three", "six"],
)
def test_the_flow_of_given_pressures_imposed_again_gives_these_pressures(mesh_of, pressures, solver):
    mesh = mesh_of("n200_s1")
    given = PoreFlow(mesh, Walls(**{name: Wall(p) for name, p in pressures.items()}), solver=solver)
    last = list(pressures)[-1]
    imposed = {name: Wall(inflow=given.wall_flux[name]) for name in pressures if name != last}
    found = PoreFlow(mesh, Walls(**imposed, **{last: Wall(pressures[last])}), solver=solver)
    # The tolerance of the solver is 1e-10 of the flow.
    assert found.wall_pressure == pytest.approx(pressures, rel=1e-9, abs=1e-9)
    assert_allclose(found.pressure, given.pressure, rtol=0, atol=1e-9 * np.ptp(given.pressure))
    assert found.wall_flux == pytest.approx(given.wall_flux, abs=1e-9 * given.inflow)
    assert_allclose(found.forces.total, given.forces.total, rtol=0, atol=1e-9)
    assert found.forces.conservation_residual < 1e-12
    assert found.imbalance < 1e-9 and found.closing_error == pytest.approx(given.closing_error, rel=1e-6)


@pytest.mark.parametrize("factor", [-1.0, 3.0, 1e-9])
def test_pressures_are_in_proportion_to_the_imposed_flows(mesh_of, factor):
    mesh = mesh_of("n54_s1")

    def flow(size):
        return PoreFlow(mesh, Walls(y_min=Wall(inflow=0.1 * size), x_max=Wall(inflow=-0.3 * size), z_max=Wall(0.0)))

    one, other = flow(1.0), flow(factor)
    assert_allclose(other.pressure, factor * one.pressure, rtol=0, atol=1e-9 * abs(factor) * np.ptp(one.pressure))
    assert_allclose(other.forces.total, factor * one.forces.total, rtol=0, atol=1e-9 * abs(factor))


def test_flows_through_all_walls_add_up_to_zero(mesh_of):
    walls = Walls(y_min=Wall(inflow=0.1), x_max=Wall(velocity=-0.2), z_max=Wall(3.0), x_min=Wall(slip=True))
    flow = PoreFlow(mesh_of("n200_s1"), walls)
    assert_allclose(flow.wall_flux["y_min"], 0.1, rtol=1e-9)
    assert_allclose(flow.wall_flux["x_max"], -0.2, rtol=1e-9)
    assert abs(sum(flow.wall_flux.values())) < 1e-9 * flow.inflow


def test_a_velocity_is_a_flow_through_the_area_of_the_wall(random_packing):
    mesh = PoreMesh(random_packing(80, seed=6, box=Box([0, 0, 0], [0.3, 0.7, 1.1])))
    flow = PoreFlow(mesh, Walls(y_min=Wall(velocity=2e-3), y_max=Wall(0.0)))
    assert_allclose(flow.wall_flux["y_min"], 2e-3 * 0.3 * 1.1, rtol=1e-9)


def test_permeability_is_the_same_whether_the_flow_or_the_pressure_is_imposed(mesh_of):
    mesh, fluid = mesh_of("n54_s1"), Fluid(viscosity=2.0)
    plain = PoreFlow(mesh, Walls.along("y", slip=True), fluid).permeability
    for y_max in (Wall(7.0), Wall(inflow=-1e-3)):  # without any pressure, the last wall has 0 Pa
        walls = Walls(**{name: Wall(slip=True) for name in WALLS} | {"y_min": Wall(inflow=1e-3), "y_max": y_max})
        flow = PoreFlow(mesh, walls, fluid)
        assert_allclose(flow.permeability, plain, rtol=1e-9)
        assert flow.wall_pressure["y_max"] == (y_max.pressure or 0.0)


def test_a_small_drop_on_a_large_pressure_keeps_its_digits(mesh_of):
    mesh = mesh_of("n54_s1")
    low, high = (PoreFlow(mesh, Walls(y_min=Wall(inflow=1e-9), y_max=Wall(p))) for p in (0.0, 1e5))
    assert_allclose(high.flux, low.flux, rtol=1e-9, atol=1e-9 * 1e-9)
    assert_allclose(high.permeability, low.permeability, rtol=1e-9)
    assert_allclose(high.forces.total, low.forces.total, rtol=0, atol=1e-12 * np.ptp(low.pressure))


def test_a_flow_of_zero_leaves_the_wall_at_the_pressure_at_which_nothing_passes(mesh_of):
    flow = PoreFlow(mesh_of("n54_s1"), Walls(x_min=Wall(1.0), x_max=Wall(0.0), y_min=Wall(inflow=0.0)))
    assert abs(flow.wall_flux["y_min"]) < 1e-9 * flow.inflow
    assert 0.0 < flow.wall_pressure["y_min"] < 1.0
    still = PoreFlow(mesh_of("n54_s1"), Walls(x_min=Wall(inflow=0.0), x_max=Wall(3.0)))
    assert_array_equal(still.pressure, 3.0)


def test_the_flow_of_the_pressures_found_is_the_same_to_the_bit(mesh_of):
    mesh = mesh_of("n54_s1")
    flow = PoreFlow(mesh, Walls(y_min=Wall(inflow=1e-3), y_max=Wall(0.0)))
    again = PoreFlow(mesh, flow.walls_at_pressures)
    assert_array_equal(again.pressure, flow.pressure)
    assert_array_equal(again.forces.total, flow.forces.total)
    assert again.wall_pressure == flow.wall_pressure
    assert "y_min 0.001 m³/s, y_max 0 Pa" in repr(flow)


def test_functions_that_need_pressures_say_where_they_come_from(mesh_of):
    mesh, walls = mesh_of("n25_s1"), Walls(y_min=Wall(inflow=1e-3), y_max=Wall(0.0))
    flow = PoreFlow(mesh, walls)
    for call in (
        lambda: solve_pressure(mesh, flow.conductances, walls),
        lambda: grain_forces(mesh, flow.pressure, walls),
        lambda: PoreFlow.from_pressure(mesh, flow.pressure, walls),
    ):
        with pytest.raises(InputError, match="y_min has an imposed flow.*walls_at_pressures"):
            call()
    found = solve_imposed_flow(mesh, flow.conductances, walls)
    assert_array_equal(found.field.pressure, flow.pressure)
    same = PoreFlow.from_pressure(mesh, flow.pressure, flow.walls_at_pressures)
    assert_allclose(same.forces.total, flow.forces.total, rtol=0, atol=1e-12)


@pytest.mark.parametrize(
    ("walls", "said"),
    [
        ({"y_min": Wall(inflow=1.0)}, "sum is 1 m³/s instead of 0.*give a wall a pressure"),
        ({"y_min": Wall(inflow=1.0), "y_max": Wall(inflow=-0.5)}, "sum is 0.5 m³/s instead of 0"),
        ({"y_min": Wall(inflow=1.0), "x_max": Wall(velocity=-0.5)}, "sum is .* instead of 0"),
    ],
)
def test_only_flows_that_do_not_add_up_to_zero_are_refused_before_anything_is_computed(mesh_of, walls, said):
    with pytest.raises(InputError, match=said):
        PoreFlow(mesh_of("n25_s1"), Walls(**walls))


@pytest.mark.parametrize(
    ("values", "said"),
    [
        ({"pressure": 1.0, "inflow": 1.0}, "inflow and pressure exclude each other"),
        ({"velocity": 1.0, "inflow": 1.0}, "velocity and inflow exclude each other"),
        ({"inflow": "much"}, "inflow must be a number in cubic metres per second"),
        ({"velocity": float("inf")}, "velocity must be a number in metres per second, and finite"),
        ({"inflow": 1e-80}, "inflow must be 0 or of size"),
    ],
)
def test_contradictions_on_a_wall_are_refused(values, said):
    with pytest.raises(InputError, match=said):
        Wall(**values)


def test_a_flow_into_a_closed_packing_is_refused_by_the_name_of_the_wall():
    """Spheres of a simple cubic lattice at √2 times their touching radius leave no passage."""
    centres = (np.stack(np.meshgrid(*[np.arange(3)] * 3), axis=-1).reshape(-1, 3) + 0.5) / 3
    packing = Packing(centres, np.full(27, 0.5 * 1.42 / 3), Box([0, 0, 0], [1, 1, 1]))
    mesh = PoreMesh(packing, wall_tolerance=0.5)
    with pytest.raises(ComputationError, match="no open path leads from y_min"):
        _ = PoreFlow(mesh, Walls(y_min=Wall(inflow=1.0), y_max=Wall(0.0))).pressure


def test_a_flow_that_is_much_smaller_than_others_is_found_as_exactly(mesh_of):
    walls = Walls(x_min=Wall(1e6), x_max=Wall(0.0), y_min=Wall(inflow=1e-4))
    flow = PoreFlow(mesh_of("n54_s1"), walls, Fluid(viscosity=1e-3))
    assert flow.inflow > 1e8 * 1e-4
    assert_allclose(flow.wall_flux["y_min"], 1e-4, rtol=1e-4)  # 12 digits less than those of the largest flow
