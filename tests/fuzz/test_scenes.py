"""Scenes of all kinds of nonsense: solved, or refused in words that name the file."""

import os
import shutil
from pathlib import Path

import pytest
from hypothesis import event, example, given, settings
from hypothesis import strategies as st

from porefv import results
from porefv.errors import PorefvError
from porefv.packing.box import WALLS
from porefv.scenes.flow_scene import FlowScene

FUZZ = settings.get_profile("fuzz-nightly" if os.environ.get("POREFV_FUZZ") == "nightly" else "fuzz")

SOUND = """\
packing = "grains.csv"
[box]
lower = [0.0, 0.0, 0.0]
upper = [1.0, 1.0, 1.0]
[fluid]
viscosity = 1.0e-3
density = 1000.0
[walls]
y_min = { pressure = 1.0 }
y_max = { pressure = 0.0 }
lateral = { slip = true }
[mesh]
unite_tolerance = 0.01
wall_tolerance = 0.05
[flow]
conductance = "auto"
solver = "auto"
tolerance = 1e-10
gravity = [0.0, 0.0, -9.81]
[output]
directory = "results"
quantities = ["permeability", "pressure", "forces"]
vtk = false
"""
# Imposed flows, regions and units.
DRIVEN = """\
packing = "grains.csv"
[box]
lower = ["0 mm", 0.0, 0.0]
upper = [1.0, "1 m", 1.0]
[fluid]
viscosity = "1 cP"
[walls]
y_min = { inflow = 1.0e-3 }
y_max = { pressure = 0.0 }
x_max = { velocity = "-1 mm/s" }
[[sources]]
point = [0.5, 0.5, 0.5]
flow = 1.0e-3
[[sources]]
box = { lower = [-1.0, -1.0, -1.0], upper = [2.0, 2.0, 2.0] }
flow = "-1 L/s"
[[pressures]]
sphere = { centre = [0.1, 0.3, 1.0], radius = "200 mm" }
pressure = "1 kPa"
[output]
quantities = ["permeabilities", "pressure", "forces"]
"""
# The paper's model, and its parameter.
PAPER = SOUND.replace('conductance = "auto"', 'conductance = "hydraulic-radius"\nalpha = 0.5')

WORDS = [
    "1.0", "0.0", "-1.0", "nan", "inf", "1e308", "1e-320", "1e999", "9" * 400, "true", "[]", "{}", "[1, 2, 3]", '""',
    '"é"',
    '"\\u0000"', '"' + "a" * 300 + '"', '"../.."', '"/"', '"."', '"auto"', '"cg"', '"effective-radius"',
    "[0.0, 0.0, 0.0]", "[1e9, 1e9, 1e9]",
    '"1 cP"', '"-2 mm/s"', '["1 mm", 0.5, "5e-4 km"]', '{ inflow = 1e-3 }', '{ velocity = "1 mm/s" }',
    '["permeabilities"]',
    '{ lower = [0, 0, 0], upper = [1, 1, 1] }', '{ centre = [0.5, 0.5, 0.5], radius = 0.4 }',
    '["permeability"]', '{ pressure = 2.0 }', '{ pressure = 1e300 }', '{ slip = 3 }', "1979-05-27", "[[1]]", "[" * 2000,
    "{ a = " * 400, "\x00", "\t", "=", "#", "'''",
]  # fmt: skip
KEYS = [
    "packing", "viscosity", "density", "pressure", "slip", "lateral", "unite_tolerance", "wall_tolerance", "alpha",
    "solver",
    "inflow", "velocity", "point", "box", "sphere", "flow", "sources", "pressures",
    "tolerance", "gravity", "quantities", "vtk", "lower", "upper", "conductance", *WALLS,
]  # fmt: skip


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    folder = tmp_path_factory.mktemp("scenes")
    (folder / "grains.csv").write_text("x,y,z,radius\n0.3,0.3,0.3,0.2\n0.6,0.7,0.6,0.25\n0.8,0.2,0.7,0.1\n")
    return folder


@st.composite
def texts(draw):
    """A sound scene with values replaced, lines left out, doubled or moved, tables added, characters lost."""
    lines = draw(st.sampled_from([SOUND, SOUND, PAPER, DRIVEN])).splitlines()
    for _ in range(draw(st.integers(1, 4))):
        k = draw(st.integers(0, len(lines) - 1))
        match draw(st.sampled_from(["value", "value", "value", "drop", "double", "move", "key", "table", "cut"])):
            case "value":
                # Nothing is written but beside the scene.
                if "=" in lines[k] and not lines[k].startswith("directory"):
                    lines[k] = lines[k].split("=")[0] + "= " + draw(st.sampled_from(WORDS))
            case "drop":
                lines[k] = ""
            case "double":
                lines.insert(k, lines[k])
            case "move":
                lines.insert(draw(st.integers(0, len(lines) - 1)), lines.pop(k))
            case "key":
                lines.insert(k, draw(st.sampled_from(KEYS)) + " = " + draw(st.sampled_from(WORDS)))
            case "table":
                lines.insert(
                    k,
                    draw(
                        st.sampled_from(
                            [
                                "[walls.x_min]",
                                "[[walls]]",
                                "[packing]",
                                "[a.b]",
                                "[",
                                "[]",
                                "[mesh]",
                                "[[sources]]",
                                "[[pressures]]",
                            ]
                        )
                    ),
                )
            case "cut":
                lines[k] = lines[k][: draw(st.integers(0, len(lines[k])))]
    return "\n".join(lines)


@settings(FUZZ)
@given(text=texts())
@example(text=SOUND)
@example(text=PAPER)
@example(text=DRIVEN)
@example(text="a = " + "[" * 5000)
@example(text=PAPER.replace("alpha = 0.5", "alpha = 1e308"))
@example(text=PAPER.replace("alpha = 0.5", "alpha = 1e-320"))
@example(text=SOUND.replace('"grains.csv"', '"' + "a" * 300 + '.csv"'))
@example(text=SOUND.replace('"grains.csv"', '"\\u0000"'))
@example(text=SOUND.replace('"results"', '"\\u0000"'))
@example(text=SOUND.replace('"results"', '"' + "a" * 300 + '"'))
@example(text=SOUND.replace('"results"', '"grains.csv"'))
def test_a_scene_is_solved_or_refused(folder, text):
    path: Path = folder / "scene.toml"
    path.write_text(text, encoding="utf-8")
    try:
        scene = FlowScene.read(path)
        scene.check()
        directory = scene.solve(force=True)
        assert results.read(directory).summary["scene"] == str(path)
        event("solved")
        shutil.rmtree(directory)
    except PorefvError as error:
        assert str(error) and len(str(error)) < 3000
        event("refused")
    assert sorted(p.name for p in folder.iterdir()) == ["grains.csv", "scene.toml"]
