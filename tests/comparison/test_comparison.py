"""Comparison of methods: their errors against the reference, the Pareto front, and what the command writes."""

import csv

import numpy as np
import pytest

from porefv import InputError, Packing, PoreFlow, Walls, cli
from porefv.comparison.comparison import MethodComparison, compare
from porefv.comparison.measurement import MethodResult, measure
from porefv.comparison.methods import Method, methods
from porefv.conductance.registry import MODELS, conductance_model

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


def result(name, seconds, error, exact):
    return MethodResult(Method(name, name), 1.0, exact * (1.0 + error), seconds, 0)


def test_the_front_is_what_nothing_beats_in_both():
    exact = np.array([[1.0, 0.0, 0.0]])
    reference = result("reference", 100.0, 0.0, exact)
    quick, good, beaten = (
        result("quick", 1.0, 0.1, exact), result("good", 2.0, 0.01, exact), result("beaten", 3.0, 0.05, exact)
    )  # fmt: skip
    found = MethodComparison([quick, good, beaten, reference], reference)
    assert [found.is_best(each) for each in found.results] == [True, True, False, True]
    assert found.errors(good)[1] == pytest.approx(0.01)
    assert found.errors(reference) == (0.0, 0.0)


def test_methods_are_all_models_and_tolerances_where_they_matter():
    small = methods(tuple(MODELS), "hydraulic-radius", False, False)
    assert [method.conductance for method in small] == list(MODELS)
    large = methods(tuple(MODELS), "hydraulic-radius", True, True)
    assert large[-1].conductance is None
    assert len(large) > len(small) + 2


def test_a_method_is_the_flow_of_its_model(scene, reference):
    for name in MODELS:
        found = measure(scene, Method(name, name))
        flow = PoreFlow(reference("n25_s1"), Walls.along("y"), conductance=conductance_model(name))
        assert found.permeability == pytest.approx(flow.permeability, rel=1e-9)
        np.testing.assert_allclose(found.forces, flow.forces.pressure + flow.forces.viscous, atol=1e-9)
        assert found.seconds > 0.0


def test_the_command_prints_and_keeps_the_comparison(scene, capsys):
    assert cli.main(["trade", str(scene), "--no-resolved"]) == 0
    printed = capsys.readouterr().out
    assert all(name in printed for name in MODELS)
    directory = scene.parent / "results_trade"
    rows = list(csv.DictReader((directory / "trade.csv").open()))
    assert [row["method"] for row in rows] == list(MODELS)
    assert (directory / "trade.png").read_bytes().startswith(b"\x89PNG")
    assert cli.main(["trade", str(scene), "--no-resolved"]) == 2  # it holds results now
    assert "--force" in capsys.readouterr().err


def test_nothing_driven_is_nothing_to_compare(scene):
    scene.write_text(scene.read_text().replace("pressure = 1.0", "slip = true").replace("pressure = 0.0", "slip = true")
                     .replace('directory = "results"', 'directory = "results"\nquantities = []'))  # fmt: skip
    with pytest.raises(InputError, match="nothing flows"):
        compare(scene)
    assert Packing.read(scene.parent / "packing.csv").box is not None
