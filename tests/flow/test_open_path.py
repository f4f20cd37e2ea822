"""Packings that are closed: no path of open throats leads from one imposed pressure to another."""

import json
import warnings

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from porefv import Box, FixedPressure, FlowSource, Packing, Point, PoreFlow, PoreMesh, Wall, Walls
from porefv.cli.program import main
from porefv.errors import ComputationError, NoOpenPathWarning
from porefv.flow.directional_permeabilities import directional_permeabilities
from porefv.results import QUANTITIES, read, write

UNIT = Box([0, 0, 0], [1, 1, 1])


def lattice_with(factor, cells=3, plugs=None):
    """Spheres of a simple cubic lattice, radii `factor` of touching ones; with √2 of them no passage is left.

    `plugs` are the layers along y that have the factor; the others have touching spheres.
    """
    places = (np.stack(np.meshgrid(*[np.arange(cells)] * 3, indexing="ij"), axis=-1).reshape(-1, 3) + 0.5) / cells
    plugged = np.ones(len(places), bool) if plugs is None else np.isin((places[:, 1] * cells).astype(int), plugs)
    return PoreMesh(Packing(places, np.where(plugged, factor, 1.0) * 0.5 / cells, UNIT), wall_tolerance=1.0)


@pytest.fixture(scope="module")
def cemented(reference):
    """cemented(factor): the 25 grains with radii times a factor."""

    def cemented(factor):
        packing = reference("n25_s1")
        return PoreMesh(Packing(packing.centres, factor * packing.radii, packing.box), wall_tolerance=1.0)

    return cemented


@pytest.mark.parametrize("factor", [1.5, 1.6, 1.7, 2.0])
@pytest.mark.parametrize("solver", ["auto", "direct", "cg"])
@pytest.mark.parametrize("slip", [False, True])
def test_nothing_flows_exactly_through_a_closed_packing(cemented, factor, solver, slip):
    flow = PoreFlow(cemented(factor), Walls.along("y", slip=slip), solver=solver)
    with pytest.warns(NoOpenPathWarning, match="no open path leads from the inlet to the outlet"):
        assert flow.permeability == 0.0
    assert not flow.has_open_path
    assert flow.hydraulic_conductivity == flow.inflow == flow.outflow == flow.imbalance == 0.0
    assert not flow.flux.any() and not flow.plane_fluxes([0.2, 0.5, 0.9]).any() and not flow.darcy_velocity.any()
    assert not np.signbit(flow.darcy_velocity).any() and not flow.pore_velocity.any()
    assert np.isnan(flow.tortuosity) and 0.0 <= flow.closing_error <= 1.0


def test_the_warning_has_the_numbers_of_closed_throats(cemented):
    mesh = cemented(1.5)
    closed, covered = np.count_nonzero(mesh.throats.closed), np.count_nonzero(mesh.throats.covered)
    said = rf"y_min, y_max.*{len(mesh.throats)} throats, of which {closed} are closed, {covered} of them"
    with pytest.warns(NoOpenPathWarning, match=said):
        _ = PoreFlow(mesh, Walls.along("y")).pressure


@pytest.mark.filterwarnings("ignore::porefv.errors.NoOpenPathWarning")
@pytest.mark.parametrize("high", [1.0, 7.3, -2.0])
def test_parts_that_touch_one_wall_are_at_rest_at_its_pressure(cemented, high):
    mesh = cemented(1.5)
    flow = PoreFlow(mesh, Walls(y_min=Wall(pressure=high), y_max=Wall(pressure=0.1)))
    joined = ~flow.solution.isolated
    assert set(flow.solution.relative[joined]) == {0.0, abs(high - 0.1)}
    i, j = mesh.throats.pores[flow.conductances > 0.0].T
    both = joined[i] & joined[j]
    assert_array_equal(flow.solution.relative[i[both]], flow.solution.relative[j[both]])
    # Isolated pores are between the two.
    assert flow.solution.relative.min() == 0.0 and flow.solution.relative.max() == abs(high - 0.1)


@pytest.mark.filterwarnings("ignore::porefv.errors.NoOpenPathWarning")
@pytest.mark.parametrize("factor", [1.5, 1.7, 2.0])
def test_forces_of_a_closed_packing_bear_the_pressure_drop(cemented, factor):
    forces = PoreFlow(cemented(factor), Walls.along("y", drop=3.0)).forces
    assert np.isfinite(forces.total).all()
    on_all = forces.total.sum(axis=0) + (forces.wall_pressure + forces.wall_viscous).sum(axis=0)
    assert_allclose(on_all, [0.0, 3.0, 0.0], rtol=0, atol=1e-12)


def test_a_plug_of_one_layer_closes_a_packing():
    # The middle one of five layers is closed: pores before it have the pressure of the inlet, those behind that of the
    # outlet.
    mesh = lattice_with(1.42, 5, plugs=[2])
    flow = PoreFlow(mesh, Walls.along("y"))
    with pytest.warns(NoOpenPathWarning):
        pressure = flow.pressure
    heights = mesh.pore_centres[:, 1]
    assert (pressure[heights < 0.35] == 1.0).all() and (pressure[heights > 0.65] == 0.0).all()
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert PoreFlow(lattice_with(1.40, 5, plugs=[2]), Walls.along("y")).permeability > 0.0


def test_a_packing_with_one_open_path_flows(cemented):
    flow = PoreFlow(cemented(1.4), Walls.along("y"))
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert flow.permeability == pytest.approx(1.9689236396973e-8, rel=1e-10)  # as before closed ones had a rule
    assert flow.has_open_path and flow.tortuosity > 1.0 and flow.reliability.of == "dissipation"


def test_equal_pressures_are_no_closed_packing(cemented):
    flow = PoreFlow(cemented(1.5), Walls(y_min=Wall(pressure=2.0), y_max=Wall(pressure=2.0)))
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert (flow.pressure == 2.0).all()
    assert flow.has_open_path and flow.reliability.outside == 0.0


@pytest.mark.filterwarnings("ignore::porefv.errors.NoOpenPathWarning")
def test_the_warning_of_overlaps_stays(cemented):
    found = PoreFlow(cemented(1.5), Walls.along("y")).reliability
    assert found.of == "throats" and found.outside > 0.9 and found.overlap > 0.7
    assert found.warning is not None and "of the throats are outside the range" in found.warning


@pytest.mark.parametrize("given", [{"inflow": 1.0}, {"velocity": 1e-3}])
@pytest.mark.parametrize("outlet", [{"pressure": 0.0}, None])
def test_an_imposed_flow_cannot_pass_and_is_refused(cemented, given, outlet):
    outlet = outlet if outlet is not None else {name: -value for name, value in given.items()}
    flow = PoreFlow(cemented(1.5), Walls(y_min=Wall(**given), y_max=Wall(**outlet)))
    with pytest.raises(ComputationError, match="no open path leads from y_min"):
        _ = flow.permeability


@pytest.mark.filterwarnings("ignore::porefv.errors.NoOpenPathWarning")
def test_a_source_leaves_by_the_wall_that_its_part_touches(cemented):
    for place, wall in ((0.02, "y_min"), (0.98, "y_max")):
        sources = [FlowSource(Point((0.3, place, 0.5)), 1e-6)]
        flow = PoreFlow(cemented(1.5), Walls.along("y"), sources=sources)
        through = flow.wall_flux
        assert through.pop(wall) == pytest.approx(-1e-6) and not any(through.values())
        assert flow.imbalance < 1e-12
    sources = [FlowSource(Point((0.3, 0.5, 0.5)), 1e-6)]
    with pytest.raises(ComputationError, match="no open path leads from it"):
        _ = PoreFlow(cemented(1.5), Walls.along("y"), sources=sources).pressure


def test_fixed_pressures_count_as_inlet_or_outlet(cemented):
    fixed = [FixedPressure(Point((0.5, 0.9, 0.5)), 0.0)]
    flow = PoreFlow(cemented(1.5), Walls(y_min=Wall(pressure=1.0)), fixed_pressures=fixed)
    with pytest.warns(NoOpenPathWarning, match="y_min, the point"):
        assert flow.fixed_pressure_flux == [0.0] and flow.inflow == 0.0


def test_permeabilities_along_closed_axes_are_zero_with_one_warning(cemented):
    with pytest.warns(NoOpenPathWarning, match=r"along x, y\)") as caught:
        found = directional_permeabilities(cemented(1.7))
    assert (found.x, found.y) == (0.0, 0.0) and found.z > 0.0 and len(caught) == 1


@pytest.mark.filterwarnings("ignore::porefv.errors.PorefvWarning")
def test_results_of_a_closed_packing_have_null_and_no_nan(cemented, tmp_path):
    flow = PoreFlow(cemented(1.5), Walls.along("y"))
    found = read(write(flow, tmp_path / "results", quantities=QUANTITIES, vtk=False))
    assert found.tortuosity is None and found.summary["permeability"] == 0.0
    assert found.summary["flow"]["imbalance"] == 0.0 and found.summary["reliability"]["of"] == "throats"


def test_the_command_says_it_once_and_that_overlaps_are_out_of_range(cemented, tmp_path, capsys):
    cemented(1.5).packing.write(tmp_path / "grains.csv")
    scene = tmp_path / "scene.toml"
    scene.write_text(
        'packing = "grains.csv"\n[walls]\ny_min = { pressure = 1.0 }\ny_max = { pressure = 0.0 }\n'
        '[mesh]\nwall_tolerance = 1.0\n[output]\nquantities = ["permeability", "forces", "tortuosity"]\nvtk = false\n'
    )
    assert main(["solve", str(scene)]) == 0
    said = capsys.readouterr()
    assert said.err.count("no open path leads from the inlet to the outlet") == 1
    assert "of the throats are outside the range" in said.err and "permeability 0 m²" in said.out
    summary = json.loads((tmp_path / "results" / "summary.json").read_text())
    assert summary["permeability"] == 0.0 and summary["tortuosity"] is None
    assert main(["info", str(tmp_path / "results")]) == 0
    told = capsys.readouterr().out
    assert "unknown, as nothing flows" in told and "100 % of the throats" in told
