"""Comparison of methods: their errors against the reference, the Pareto front, and what the command writes."""

import csv
import warnings

import numpy as np
import pytest

from porefv import InputError, Packing, PoreFlow, Walls, cli
from porefv.comparison import comparison
from porefv.comparison.comparison import MethodComparison, compare
from porefv.comparison.measurement import MethodResult, measure
from porefv.comparison.methods import Method, methods
from porefv.comparison.output import draw, table
from porefv.conductance.registry import MODELS, conductance_model
from porefv.errors import MissingExtraError

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


def test_the_table_fits_a_terminal_and_tells_tolerances_from_models():
    exact = np.array([[1.0, 0.0, 0.0]])
    names = [*MODELS, "resolved Stokes flow"]
    models = [MethodResult(Method(name, name), 1.2345678e-12, exact, 12.345, 2.0**30) for name in names]
    loose = [
        MethodResult(
            Method(f"section-friction, cg to {t:.0e}", "section-friction", "cg", t), 1.0, exact * (1 + t), 1.0, 0.0
        )
        for t in (1e-2, 1e-10)
    ]
    found = MethodComparison([*models, *loose], models[0], ("why",))
    lines = table(found).splitlines()
    assert max(map(len, lines)) <= 80
    assert "tolerance 1e-02" in table(found)
    assert lines[-1] == "why"


def test_the_picture_shows_the_reference_and_warns_of_nothing(tmp_path):
    exact = np.array([[1.0, 0.0, 0.0]])
    reference = MethodResult(Method("resolved Stokes flow", None), 1.0, exact, 24.0, 1e9)
    same = MethodResult(Method("same", "same"), 1.0, exact, 1.0, float("nan"))
    loose = MethodResult(Method("a, cg to 1e-02", "a", "cg", 1e-2), 1.0, 1.1 * exact, 1.0, 0.0)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        warnings.simplefilter("ignore", DeprecationWarning)  # between matplotlib and pyparsing; Python shows none
        draw(MethodComparison([same, loose, reference], reference), tmp_path / "trade.png")
    assert (tmp_path / "trade.png").read_bytes().startswith(b"\x89PNG")


def test_a_missing_extra_is_told_in_a_line(scene, monkeypatch):
    def missing():
        raise MissingExtraError("ngsolve", "The resolved flow")

    monkeypatch.setattr(comparison, "require_ngsolve", missing)
    assert compare(scene).remarks == ('The resolved flow needs an extra: pip install "porefv[reference]"',)
    with pytest.raises(MissingExtraError):
        compare(scene, resolved=True)


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
