"""How much of a flow is where the conductance model was not tested."""

import json

import numpy as np
import pytest

from porefv import Box, Packing, PoreFlow, PoreMesh, Walls
from porefv.cli.program import main
from porefv.flow.reliability import OVERLAP

SC8 = (np.stack(np.meshgrid(*[np.arange(2)] * 3), axis=-1).reshape(-1, 3) + 0.5) / 2
UNIT = Box([0, 0, 0], [1, 1, 1])
# Permeabilities of the cubic lattice by resolved flow (lattice Boltzmann), by the factor of the touching radii.
CEMENTED = {1.1: 2.08e-4, 1.2: 5.2e-5, 1.3: 5.2e-6}


def cemented(factor):
    return PoreMesh(Packing(SC8, np.full(8, 0.25 * factor), UNIT), wall_tolerance=1.0)


@pytest.mark.parametrize("name", ["n25_s1", "n2000_s1"])
def test_touching_grains_are_within_the_range(reference, name):
    found = PoreFlow(reference(name), Walls.along("y")).reliability
    assert found.outside < 0.001 and found.warning is None


@pytest.mark.parametrize(("factor", "resolved"), CEMENTED.items())
def test_cemented_grains_are_outside_with_the_errors_that_are_told(unit_flow, factor, resolved):
    flow = unit_flow(cemented(factor), Walls.along("x", slip=True))
    found = flow.reliability
    assert found.overlap == found.outside == pytest.approx(1.0)
    error = 100 * (flow.permeability / resolved - 1)
    told = dict(zip(CEMENTED, (-8, -23, -38), strict=True))[factor]
    assert error == pytest.approx(told, abs=1.0) and str(told) in found.warning


def test_the_range_ends_at_an_overlap(unit_flow):
    # Neighbours overlap by 2 r - d.
    for part, outside in ((0.99, 0.0), (1.01, 1.0)):
        factor = 1.0 / (1.0 - 0.5 * part * OVERLAP)
        assert unit_flow(cemented(factor), Walls.along("x", slip=True)).reliability.outside == pytest.approx(outside)


def test_fluid_that_flows_along_a_bed_is_outside(unit_flow):
    floor = Packing(SC8[SC8[:, 2] < 0.5], np.full(4, 0.25), Box([0, 0, 0], [1, 1, 1.5]))
    found = unit_flow(PoreMesh(floor), Walls.along("x")).reliability
    assert found.openness > 0.9 and "free fluid along a bed" in found.warning


def test_discs_between_plates_are_outside(unit_flow):
    discs = SC8[SC8[:, 2] < 0.5] * [1, 1, 0.08]
    mesh = PoreMesh(Packing(discs, np.full(4, 0.2), Box([0, 0, 0], [1, 1, 0.04])), wall_tolerance=1.0)
    found = unit_flow(mesh, Walls.along("x")).reliability
    assert found.cut == pytest.approx(1.0) and "-52 %" in found.warning


def test_a_speck_among_grains_is_outside_by_its_size(unit_flow):
    packing = Packing(np.vstack([SC8, [[0.5, 0.5, 0.5]]]), np.append(np.full(8, 0.25), 0.01), UNIT)
    found = unit_flow(PoreMesh(packing), Walls.along("x", slip=True)).reliability
    assert 0.0 < found.size_ratio <= found.outside <= 1.0


def test_where_nothing_flows_nothing_is_outside(unit_flow):
    same = Walls.from_mapping({"x_min": {"pressure": 1.0}, "x_max": {"pressure": 1.0}})
    assert unit_flow(cemented(1.2), same).reliability.outside == 0.0


def test_results_say_it_and_warn(tmp_path, capsys):
    Packing(SC8, np.full(8, 0.3), UNIT).write(tmp_path / "grains.csv")
    scene = tmp_path / "scene.toml"
    scene.write_text(
        'packing = "grains.csv"\n[walls]\nx_min = { pressure = 1.0 }\nx_max = { pressure = 0.0 }\n'
        "lateral = { slip = true }\n[mesh]\nwall_tolerance = 0.5\n"
    )
    assert main(["solve", str(scene)]) == 0
    assert "outside the range where the conductance model was tested" in capsys.readouterr().err
    summary = json.loads((tmp_path / "results" / "summary.json").read_text())
    assert summary["reliability"]["outside"] == pytest.approx(1.0)
    assert main(["info", str(tmp_path / "results")]) == 0
    assert "outside tested range" in capsys.readouterr().out
    assert main(["solve", str(scene), "--force", "--quiet"]) == 0
    assert capsys.readouterr() == ("", "")
