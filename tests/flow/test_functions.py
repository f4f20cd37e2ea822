"""The functions that PoreFlow calls give what PoreFlow gives; PoreFlow takes a pressure that was found elsewhere."""

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from porefv import results
from porefv.conductance.conductances import throat_conductances
from porefv.conductance.hydraulic_radius import HydraulicRadius
from porefv.conductance.model import ConductanceModel
from porefv.conductance.registry import MODELS
from porefv.errors import ImbalanceWarning, InputError
from porefv.flow.flux import fluxes, net_outflows, wall_face_fluxes
from porefv.flow.forces import grain_forces
from porefv.flow.pore_flow import PoreFlow
from porefv.flow.pressure import solve_pressure
from porefv.flow.pressure_on_grains import acting_pressure
from porefv.flow.walls import Wall, Walls
from porefv.mesh.cell_mesh import CellMesh


@pytest.mark.parametrize("model", MODELS.values())
@pytest.mark.parametrize("walls", [Walls.along("y", 3.0), Walls.along("z", slip=True)], ids=["no-slip", "slip"])
def test_functions_in_turn_are_the_flow(mesh_of, model, walls):
    mesh, model = mesh_of("n54_s1"), model()
    flow = PoreFlow(mesh, walls, conductance=model)
    conductances = throat_conductances(mesh, model, walls.slip, flow.fluid.viscosity)
    field = solve_pressure(mesh, conductances, walls)
    acting = acting_pressure(mesh, model, conductances, walls, field)
    flux = fluxes(mesh, conductances, field)
    assert_array_equal(field.pressure, flow.pressure)
    assert_array_equal(flux, flow.flux)
    forces = grain_forces(mesh, acting, walls, model.force_split)
    assert_array_equal(forces.total, flow.forces.total)
    by_array = grain_forces(mesh, acting.pressure, walls, model.force_split)
    assert_allclose(by_array.total, forces.total, atol=1e-13)
    assert_allclose(fluxes(mesh, conductances, field.pressure), flux, atol=1e-12 * abs(flux).max())
    into = wall_face_fluxes(mesh, net_outflows(mesh, flux), walls.held)
    assert_allclose(into[into > 0.0].sum(), flow.inflow, rtol=1e-13)


def test_a_source_flows_out_through_the_walls_of_imposed_pressure(mesh_of):
    mesh, walls = mesh_of("n25_s1"), Walls(y_max=Wall(pressure=5.0))
    conductances = throat_conductances(mesh, HydraulicRadius(), walls.slip, 1e-3)
    sources = np.zeros(mesh.n_pores)
    held = np.zeros(mesh.n_pores, bool)
    held[mesh.cell_pore[mesh.wall_faces.cells[mesh.wall_faces.walls == 3]]] = True
    sources[np.flatnonzero(~held)[7]] = 2e-4
    field = solve_pressure(mesh, conductances, walls, sources=sources)
    into = wall_face_fluxes(mesh, net_outflows(mesh, fluxes(mesh, conductances, field)), walls.held)
    assert_allclose(into.sum(), -2e-4, rtol=1e-9)
    assert field.pressure.min() >= 5.0 - 1e-12
    assert field.pressure.argmax() == np.flatnonzero(~held)[7]


def test_arguments_of_the_wrong_shape_are_refused(mesh_of):
    mesh, walls = mesh_of("n25_s1"), Walls.along("y")
    with pytest.raises(InputError, match=r"one value per throat, \(240,\), not shape \(3,\)"):
        solve_pressure(mesh, np.ones(3), walls)
    with pytest.raises(InputError, match="sources must have one value per pore"):
        solve_pressure(mesh, np.ones(240), walls, sources=np.ones(3))
    with pytest.raises(InputError, match="no wall has a pressure"):
        solve_pressure(mesh, np.ones(240), Walls())
    with pytest.raises(InputError, match="pressure must have one value per pore"):
        grain_forces(mesh, np.ones(3), walls)


# ---- a pressure found elsewhere ----------


def test_the_flow_of_its_own_pressure_is_the_flow(mesh_of, tmp_path):
    flow = PoreFlow(mesh_of("n54_s1"), Walls.along("y", 2.0), gravity=(0.0, 0.0, -9.81))
    again = PoreFlow.from_pressure(flow.mesh, flow.pressure, flow.walls, flow.fluid, gravity=flow.gravity)
    assert_allclose(again.permeability, flow.permeability, rtol=1e-9)
    assert_allclose(again.forces.total, flow.forces.total, atol=1e-11)
    assert again.solver_report.name == "given" and again.solver_report.imbalance < 1e-9
    found = results.read(results.write(again, tmp_path / "results"))
    assert found.summary["solver"]["name"] == "given"
    assert found.summary["solver"]["pressure_error"] is None
    assert_allclose(found.pores["pressure"], flow.cell_pressure, rtol=1e-6)


def test_the_imbalance_of_a_wrong_pressure_is_reported(mesh_of):
    # Linear in y, whatever the pores: no pore is in balance.
    mesh, walls = mesh_of("n54_s1"), Walls.along("y")
    linear = PoreFlow(mesh, walls).imposed_pressures
    free = np.isnan(linear)
    place = np.zeros(mesh.n_pores)
    place[mesh.cell_pore] = 1.0 - mesh.vertices[:, 1]
    linear[free] = place[free]
    with pytest.warns(ImbalanceWarning, match="out of balance"):
        flow = PoreFlow.from_pressure(mesh, linear, walls)
    assert flow.solver_report.imbalance > 0.1
    assert flow.forces.conservation_residual < 1e-12  # forces add up for any pressure


def test_given_pressures_that_are_no_pressures_of_these_walls_are_refused(mesh_of):
    mesh, walls = mesh_of("n25_s1"), Walls.along("y")
    flow = PoreFlow(mesh, walls)
    with pytest.raises(InputError, match=r"one value per pore, \(122,\), not shape \(121,\)"):
        PoreFlow.from_pressure(mesh, flow.pressure[:-1], walls)
    with pytest.raises(InputError, match="must be finite: 122 pores have nan, pore 0 first"):
        PoreFlow.from_pressure(mesh, np.full(122, np.nan), walls)
    with pytest.raises(InputError, match=r"on walls of imposed pressure have another pressure.* instead of 1 Pa"):
        PoreFlow.from_pressure(mesh, 0.5 * flow.pressure, walls)


def test_a_model_that_does_not_derive_from_the_base_is_refused_with_the_remedy(mesh_of):
    class Slits:
        name = "slits"

        def conductivity(self, throats, slip):
            return throats.fluid_areas**2

    with pytest.raises(InputError, match=r"write class Slits\(ConductanceModel\)"):
        PoreFlow(mesh_of("n25_s1"), Walls.along("y"), conductance=Slits())
    with pytest.raises(InputError, match=r"not a class: write HydraulicRadius\(\)"):
        PoreFlow(mesh_of("n25_s1"), Walls.along("y"), conductance=HydraulicRadius)
    with pytest.raises(InputError, match=r"conductance_model\('hydraulic-radius'\)"):
        PoreFlow(mesh_of("n25_s1"), Walls.along("y"), conductance="hydraulic-radius")


def test_a_conductivity_of_another_shape_is_refused(mesh_of):
    class One(ConductanceModel):
        name = "one"

        def conductivity(self, throats, slip):
            return 1.0

    with pytest.raises(InputError, match=r"model one must have one value per throat, \(240,\), not shape \(\)"):
        _ = PoreFlow(mesh_of("n25_s1"), Walls.along("y"), conductance=One()).conductances


@pytest.mark.parametrize("value", [-1.0, np.nan, np.inf])
def test_conductances_that_are_none_are_refused(mesh_of, value):
    mesh = mesh_of("n25_s1")
    conductances = np.ones(240)
    conductances[7] = value
    for function in (solve_pressure, lambda mesh, k, walls: fluxes(mesh, k, np.zeros(mesh.n_pores))):
        with pytest.raises(InputError, match="1 throat are not, the first of them throat 7 with"):
            function(mesh, conductances, Walls.along("y"))


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (("packing.csv", Walls.along("y")), "mesh must be a PoreMesh or a Packing"),
        ((None, Walls.along("y")), "mesh must be"),
        ((0, {"y_min": 1.0}), "walls must be Walls"),
        ((0, Walls.along("y"), 1e-3), "fluid must be a Fluid"),
    ],
)
def test_arguments_of_another_kind_are_refused(mesh_of, arguments, said):
    if arguments[0] == 0:
        arguments = (mesh_of("n25_s1"), *arguments[1:])
    with pytest.raises(InputError, match=said):
        PoreFlow(*arguments)


def test_a_number_is_no_wall():
    with pytest.raises(InputError, match=r"y_min must be a Wall, such as Wall\(pressure=1.0\), not 1.0"):
        Walls(y_min=1.0)


def test_slips_of_another_number_of_walls_and_meshes_without_pores_are_refused(mesh_of):
    mesh = mesh_of("n25_s1")
    for slip in ([True], [False] * 5, []):
        with pytest.raises(InputError, match=r"slip must have one value per wall, \(6,\)"):
            throat_conductances(mesh, HydraulicRadius(), slip, 1e-3)
    numbers = throat_conductances(mesh, HydraulicRadius(), [1, 0, 0, 0, 0, 0], 1e-3)
    assert_array_equal(
        numbers, throat_conductances(mesh, HydraulicRadius(), [True, False, False, False, False, False], 1e-3)
    )
    with pytest.raises(InputError, match=r"not CellMesh: write PoreMesh\(packing\)"):
        throat_conductances(CellMesh(mesh.packing), HydraulicRadius(), [False] * 6, 1e-3)


def test_given_pressures_are_compared_with_the_range_of_those_imposed(mesh_of):
    # A small drop on a large pressure: one value for all pores is no solution.
    mesh, high = mesh_of("n25_s1"), 101325.0
    walls = Walls(y_min=Wall(pressure=high + 0.05), y_max=Wall(pressure=high))
    with pytest.raises(InputError, match="on walls of imposed pressure have another pressure"):
        PoreFlow.from_pressure(mesh, np.full(mesh.n_pores, high), walls)


class Clogged(HydraulicRadius):
    """Half of the throats are closed, so that there are isolated pores."""

    name = "clogged"

    def conductivity(self, throats, slip):
        found = super().conductivity(throats, slip)
        return np.where(found > np.quantile(found, 0.5), found, 0.0)


def test_nothing_flows_between_isolated_pores(mesh_of):
    mesh, walls = mesh_of("n54_s1"), Walls.along("y")
    flow = PoreFlow(mesh, walls, conductance=Clogged())
    among = flow.solution.isolated[mesh.throats.pores].all(axis=1)
    assert (flow.conductances[among] > 0.0).any() and not flow.flux[among].any()
    given = PoreFlow.from_pressure(mesh, flow.pressure, walls, conductance=Clogged())
    assert given.solver_report.imbalance < 1e-9
    assert_allclose(given.permeability, flow.permeability, rtol=1e-9)
