"""The ladder: rungs, their errors against the judge, the front, and what the command writes."""

import csv

import numpy as np
import pytest

from porefv import InputError, Packing, PoreFlow, Walls, cli
from porefv.conductance import MODELS, conductance_model
from porefv.comparison.methods import Outcome, Rung, Trade, climb, ladder, trade

SCENE = """
packing = "{packing}"
[walls]
y_min = {{ pressure = 1.0 }}
y_max = {{ pressure = 0.0 }}
[output]
directory = "results"
"""


@pytest.fixture
def scene(tmp_path, reference):
    packing = reference("n25_s1")
    file = tmp_path / "packing.csv"
    rows = "\n".join(
        ",".join(map(repr, map(float, (*c, r)))) for c, r in zip(packing.centres, packing.radii, strict=True)
    )
    file.write_text(f"# box_lower = 0 0 0\n# box_upper = 1 1 1\nx,y,z,radius\n{rows}\n")
    path = tmp_path / "scene.toml"
    path.write_text(SCENE.format(packing=file.name))
    return path


def outcome(name, seconds, error, judge):
    return Outcome(Rung(name, name), 1.0, judge * (1.0 + error), seconds, 0)


def test_the_front_is_what_nothing_beats_in_both():
    exact = np.array([[1.0, 0.0, 0.0]])
    judge = outcome("judge", 100.0, 0.0, exact)
    quick, good, beaten = (
        outcome("quick", 1.0, 0.1, exact), outcome("good", 2.0, 0.01, exact), outcome("beaten", 3.0, 0.05, exact)
    )  # fmt: skip
    found = Trade([quick, good, beaten, judge], judge)
    assert [found.is_best(each) for each in found.outcomes] == [True, True, False, True]
    assert found.errors(good)[1] == pytest.approx(0.01)
    assert found.errors(judge) == (0.0, 0.0)


def test_rungs_are_all_models_and_tolerances_where_they_matter():
    small = ladder(tuple(MODELS), "hydraulic-radius", False, False)
    assert [rung.conductance for rung in small] == list(MODELS)
    large = ladder(tuple(MODELS), "hydraulic-radius", True, True)
    assert large[-1].conductance is None
    assert len(large) > len(small) + 2


def test_a_rung_is_the_flow_of_its_model(scene, reference):
    for name in MODELS:
        found = climb(scene, Rung(name, name))
        flow = PoreFlow(reference("n25_s1"), Walls.along("y"), conductance=conductance_model(name))
        assert found.permeability == pytest.approx(flow.permeability, rel=1e-9)
        np.testing.assert_allclose(found.forces, flow.forces.pressure + flow.forces.viscous, atol=1e-9)
        assert found.seconds > 0.0


def test_the_command_prints_and_keeps_the_ladder(scene, capsys):
    assert cli.main(["trade", str(scene), "--no-resolved"]) == 0
    printed = capsys.readouterr().out
    assert all(name in printed for name in MODELS)
    directory = scene.parent / "results_trade"
    rows = list(csv.DictReader((directory / "trade.csv").open()))
    assert [row["rung"] for row in rows] == list(MODELS)
    assert (directory / "trade.png").stat().st_size > 1000
    assert cli.main(["trade", str(scene), "--no-resolved"]) == 2  # it holds results now
    assert "--force" in capsys.readouterr().err


def test_nothing_driven_is_nothing_to_trade(scene):
    scene.write_text(scene.read_text().replace("pressure = 1.0", "slip = true").replace("pressure = 0.0", "slip = true")
                     .replace('directory = "results"', 'directory = "results"\nquantities = []'))  # fmt: skip
    with pytest.raises(InputError, match="nothing flows"):
        trade(scene)
    assert Packing.read(scene.parent / "packing.csv").box is not None
