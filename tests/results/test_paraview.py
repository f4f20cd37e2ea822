"""The script for ParaView: what it says, and that ParaView draws with it, where it is installed."""

import os
import shlex
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from porefv import results
from porefv.cli.program import main
from porefv.errors import InputError
from porefv.flow.pore_flow import PoreFlow
from porefv.flow.walls import Walls
from porefv.packing.packing import Packing
from porefv.results.paraview import write_script
from porefv.scenes.simulation_scene import SimulationScene
from porefv.simulation.simulate import run

pyvista = pytest.importorskip("pyvista")
PACKINGS = Path(__file__).parents[2] / "data" / "packings"
SIMULATION = {
    "packing": {"file": str(PACKINGS / "n25_s1.csv"), "scale": 0.05},
    "material": {"young": 15.0e6, "density": 2600.0},
    "fluid": {"viscosity": 10.0},
    "walls": {"z_max": {"pressure": 0.0}},
    "stages": [
        {"name": "dry", "fluid": False, "duration": 0.002},
        {"name": "wet", "plates": {"z_max": {"stress": 1.0e4, "top_speed": 0.1}}, "duration": 0.002},
    ],
}


@pytest.fixture(scope="module")
def solved(tmp_path_factory):
    flow = PoreFlow(Packing.read(PACKINGS / "n25_s1.csv").scaled(0.01), Walls.along("y"))
    return results.write(flow, tmp_path_factory.mktemp("solved") / "results")


@pytest.fixture(scope="module")
def simulated(tmp_path_factory):
    directory = tmp_path_factory.mktemp("simulated") / "results"
    output = {"directory": str(directory), "frames": 0.001, "velocity": True, "throats": True}
    return run(SimulationScene.from_mapping({**SIMULATION, "output": output}))


def paraview():
    """Commands that give a display and that start ParaView without a window; skipped where it is missing."""
    pvpython = shutil.which("pvpython")
    if pvpython is None:
        pytest.skip("ParaView is not installed: there is no pvpython")
    # Debian's ParaView needs a display even for pictures without a window. Without -noreset, Xvfb starts anew when a
    # client leaves, and may refuse the next.
    virtual = shutil.which("xvfb-run")
    if sys.platform == "linux" and "DISPLAY" not in os.environ and virtual is None:
        pytest.skip("ParaView needs a display here, or xvfb-run: there is neither")
    return [virtual, "-a", "-s", "-screen 0 1280x1024x24 -noreset"] if virtual else [], [
        pvpython,
        "--force-offscreen-rendering",
    ]


@pytest.mark.parametrize("kind", ["solved", "simulated"])
def test_paraview_draws_results_and_loads_the_state(kind, request, tmp_path):
    display, command = paraview()
    script = write_script(request.getfixturevalue(kind), tmp_path / "show.py")
    loads = tmp_path / "load.py"
    loads.write_text(
        "from paraview.simple import *\nLoadState('view.pvsm')\nGetAnimationScene().GoToLast()\n"
        "SaveScreenshot('loaded.png', GetActiveView())\n"
    )
    # ParaView's Python is another one: it must not find the packages of this one.
    environment = {name: value for name, value in os.environ.items() if not name.startswith("PYTHON")}
    runs = (
        [str(script), "--picture", "view.png", "--state", "view.pvsm"],
        [str(script), "--throats", "--picture", "throats.png"],
        [str(loads)],
    )
    steps = " && ".join(shlex.join([*command, *arguments]) for arguments in runs)
    done = subprocess.run(
        [*display, "sh", "-c", steps], cwd=tmp_path, env=environment, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
    for name in ("view.png", "throats.png", "loaded.png"):
        pixels = np.asarray(pyvista.read(tmp_path / name)["PNGImage"])[:, :3].astype(int)
        coloured = np.ptp(pixels, axis=1) > 40  # neither the white around nor the grey of the grains
        assert coloured.mean() > 0.02, name


@pytest.mark.parametrize("kind", ["solved", "simulated"])
def test_the_script_has_the_place_of_the_results(kind, request, tmp_path, capsys):
    directory = request.getfixturevalue(kind)
    assert main(["export", str(directory), "--to", "paraview", "--out", str(tmp_path / "show.py")]) == 0
    assert capsys.readouterr().out == f"written {tmp_path / 'show.py'}\n"
    assert f"RESULTS = {str(directory)!r}\n" in (tmp_path / "show.py").read_text(encoding="utf-8")


def test_a_script_is_replaced_by_force_only_and_needs_its_extension(solved, tmp_path):
    write_script(solved, tmp_path / "show.py")
    with pytest.raises(InputError, match="exists.*replace it with force=True"):
        write_script(solved, tmp_path / "show.py")
    write_script(solved, tmp_path / "show.py", force=True)
    with pytest.raises(InputError, match=r"ends in \.py"):
        write_script(solved, tmp_path / "show.pvsm")


def test_results_without_files_for_paraview_are_refused(tmp_path):
    with pytest.raises(InputError, match=r"has neither spheres\.vtp nor frames/grains\.pvd: set vtk = true"):
        write_script(tmp_path, tmp_path / "show.py")
