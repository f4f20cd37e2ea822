"""A kill, or a full disk, at any operation on files: earlier or new results are whole, and the next command finds them.

    pytest tests/faults -s

prints the number of operations.
"""

import errno
import json
import os
import shutil
from pathlib import Path

import numpy as np
import pytest

from porefv.cli.program import main
from porefv.comparison import comparison, output
from porefv.comparison.comparison import MethodComparison
from porefv.comparison.measurement import MethodResult
from porefv.comparison.methods import Method
from porefv.packing.packing import Packing
from porefv.resolved.reference import StokesReference
from porefv.simulation.run_record import read_record
from porefv.system.atomic_files import put_back

pytestmark = pytest.mark.skipif(not hasattr(os, "fork"), reason="copies of the process by fork")

SOLVE = """\
packing = "{packing}"
[fluid]
viscosity = {viscosity}
[walls]
y_min = {{ pressure = 1.0 }}
y_max = {{ pressure = 0.0 }}
[output]
quantities = ["permeability", "forces"]
vtk = true
"""
SIMULATE = """\
gravity = [0.0, 0.0, {gravity}]
[packing]
file = "{packing}"
scale = 0.05
[fluid]
viscosity = 1.0
[walls]
z_min = {{ pressure = 0.0 }}
[[stages]]
name = "dry"
fluid = false
duration = 2.0e-4
[[stages]]
name = "wet"
duration = 2.0e-4
[output]
every = 1.0e-4
frames = [3.0e-4]
[checkpoint]
steps = 4
"""
PACK = """\
output = "made.csv"
[grains]
number = {number}
[box]
upper = [1.0, 1.0, 1.0]
[cloud]
porosity = 0.7
"""


def contents(folder, but=("created", "seconds", "solver", "path")):
    """What the files of a folder hold, without the times that computations took."""
    found = {}
    for path in sorted(path for path in folder.rglob("*") if path.is_file()):
        content = path.read_bytes()
        if path.suffix == ".json":
            content = {key: value for key, value in json.loads(content).items() if key not in but}
        elif path.suffix == ".npz":
            content = "a checkpoint"
        found[str(path.relative_to(folder))] = content
    return found


def quietly(*arguments):
    assert main([*arguments, "--quiet"]) == 0


@pytest.fixture(scope="module")
def made(tmp_path_factory, data_packing):
    """made(name, text, command): a folder with a scene and what the command has made of it, once for each."""
    folders = {}

    def made(name, text, command):
        if name not in folders:
            folder = tmp_path_factory.mktemp(name)
            (folder / "scene.toml").write_text(text)
            before = os.getcwd()
            os.chdir(folder)
            quietly(command, "scene.toml")
            os.chdir(before)
            folders[name] = folder
        return folders[name]

    return made


@pytest.fixture(scope="module")
def data_packing(request):
    return (request.config.rootpath / "data" / "packings" / "n25_s1.csv").as_posix()


def put(source, folder, *names):
    for name in names:
        if (source / name).is_dir():
            shutil.copytree(source / name, folder / name)
        else:
            shutil.copyfile(source / name, folder / name)


# ---- results that are written at once ---------------------------------------------------------------------------


@pytest.fixture(scope="module")
def old(made, data_packing):
    return made("old_flow", SOLVE.format(packing=data_packing, viscosity=1.0), "solve")


@pytest.fixture(scope="module")
def new(made, data_packing):
    return made("new_flow", SOLVE.format(packing=data_packing, viscosity=2.0), "solve")


@pytest.mark.parametrize("force", [False, True], ids=["first", "force"])
def test_solve(survives, old, new, force):
    whole = [contents(old / "results"), contents(new / "results")]
    arguments = ["solve", "scene.toml", "--quiet", *["--force"] * force]

    def prepare(folder):
        put(new, folder, "scene.toml")
        if force:
            put(old, folder, "results")

    def check(folder):
        status = main(["info", "results"])
        assert status == 0 or (not force and not (folder / "results").exists())
        if status == 0:
            assert contents(folder / "results") in whole
        assert main(["solve", "scene.toml", "--quiet"]) == (2 if status == 0 else 0)  # what there is, is not replaced
        quietly("solve", "scene.toml", "--force")
        assert contents(folder / "results") == whole[1]
        assert sorted(os.listdir(folder)) == ["results", "scene.toml"]

    survives(arguments, prepare, check)
    survives(arguments, prepare, check, errno.ENOSPC)


@pytest.mark.parametrize("force", [False, True], ids=["first", "force"])
def test_pack(survives, made, force):
    first = made("old_packing", PACK.format(number=20), "pack")
    then = made("new_packing", PACK.format(number=21), "pack")
    arguments = ["pack", "scene.toml", "--quiet", *["--force"] * force]

    def prepare(folder):
        put(then, folder, "scene.toml")
        if force:
            put(first, folder, "made.csv")

    def check(folder):
        if force or (folder / "made.csv").exists():
            assert len(Packing.read(folder / "made.csv")) in (20, 21)
        quietly("pack", "scene.toml", "--force")
        assert contents(folder) == contents(then)

    survives(arguments, prepare, check)
    survives(arguments, prepare, check, errno.ENOSPC)


@pytest.mark.parametrize(("to", "name"), [("csv", "tables"), ("openpnm", "net.npz"), ("vtu", "mesh.vtu")])
def test_export(survives, old, new, to, name):
    arguments = ["export", "results", "--to", to, "--out", name, "--force"]
    earlier = {}

    def written(folder):
        return {path: content for path, content in contents(folder).items() if path.startswith(name)}

    def prepare(folder):
        put(old, folder, "results")
        assert main(arguments) == 0
        earlier.update(written(folder))
        shutil.rmtree(folder / "results")
        put(new, folder, "results")

    def check(folder):
        before = written(folder)
        assert main(arguments) == 0
        later = written(folder)
        assert all(before[path] in (earlier[path], later[path]) for path in later)
        assert earlier.keys() == later.keys() and sorted(os.listdir(folder)) == sorted(["results", name])

    survives(arguments, prepare, check)


@pytest.fixture(scope="module")
def resolved(data_packing):
    return StokesReference.read(next((Path(data_packing).parents[1] / "reference" / "stokes").glob("nine*")))


def test_reference(survives, old, resolved, monkeypatch):
    monkeypatch.setattr("porefv.resolved.lattice_reference.lattice_reference", lambda *arguments, **options: resolved)
    arguments = [
        "reference", "scene.toml", "--quiet", "--method", "lattice-boltzmann", "--out", "flow.json", "--force",
    ]  # fmt: skip

    def prepare(folder):
        put(old, folder, "scene.toml")
        (folder / "flow.json").write_text("earlier")

    def check(folder):
        found = (folder / "flow.json").read_text()
        assert found == "earlier" or StokesReference.read("flow.json").permeability == resolved.permeability
        assert main(arguments) == 0
        assert sorted(os.listdir(folder)) == ["flow.json", "scene.toml"]

    survives(arguments, prepare, check)
    survives(arguments, prepare, check, errno.ENOSPC)


def test_trade(survives, old, monkeypatch):
    forces = np.ones((3, 3))
    results = [MethodResult(Method(name, name), 1.0, forces * x, x, x) for name, x in (("one", 1.0), ("two", 2.0))]
    monkeypatch.setattr(output, "draw", lambda found, path: path.write_bytes(b"picture"))
    monkeypatch.setattr(comparison, "compare", lambda *arguments, **options: MethodComparison(results, results[0]))
    arguments = ["trade", "scene.toml", "--quiet", "--out", "trade", "--force"]

    def prepare(folder):
        put(old, folder, "scene.toml")
        (folder / "trade").mkdir()
        (folder / "trade" / "summary.json").write_text('{"kind": "trade"}')

    def check(folder):
        put_back("trade")
        assert sorted(os.listdir("trade")) in (["summary.json"], ["summary.json", "trade.csv", "trade.png"])
        assert main(arguments) == 0
        assert sorted(os.listdir(folder)) == ["scene.toml", "trade"] and len(os.listdir("trade")) == 3

    survives(arguments, prepare, check)


# ---- a simulation -----------------------------------------------------------------------------------------------


def simulation(packing, gravity=-9.81):
    return SIMULATE.format(packing=packing, gravity=gravity)


@pytest.fixture(scope="module")
def whole_run(made, data_packing):
    return made("new_run", simulation(data_packing), "simulate")


def test_simulate(survives, whole_run):
    whole = contents(whole_run)

    def check(folder):
        quietly("simulate", "scene.toml", "--resume")
        assert contents(folder) == whole

    survives(["simulate", "scene.toml", "--quiet"], lambda folder: put(whole_run, folder, "scene.toml"), check)


def test_simulate_force(survives, made, data_packing, whole_run):
    earlier = made("old_run", simulation(data_packing, gravity=-5.0), "simulate")
    old, whole = contents(earlier / "results"), contents(whole_run)
    begun = json.loads((whole_run / "results" / "simulation.json").read_text())["scene"]

    def prepare(folder):
        put(whole_run, folder, "scene.toml")
        put(earlier, folder, "results")

    def check(folder):
        assert main(["info", "results"]) == 0
        if read_record(folder / "results").scene == begun:
            quietly("simulate", "scene.toml", "--resume")
        else:
            found = contents(folder / "results")
            assert {name: found[name] for name in old} == old
            quietly("simulate", "scene.toml", "--force")
        assert contents(folder) == whole

    arguments = ["simulate", "scene.toml", "--quiet", "--force"]
    survives(arguments, prepare, check)
    survives(arguments, prepare, check, errno.ENOSPC)


def test_simulate_resume(survives, killed, whole_run, tmp_path):
    stopped, whole = tmp_path / "stopped", contents(whole_run)
    stopped.mkdir()
    put(whole_run, stopped, "scene.toml")
    os.chdir(stopped)
    killed(["simulate", "scene.toml", "--quiet"], at=70, folder=stopped)
    assert read_record("results").checkpoint is not None

    def check(folder):
        quietly("simulate", "scene.toml", "--resume")
        assert contents(folder) == whole

    arguments = ["simulate", "scene.toml", "--quiet", "--resume"]
    survives(arguments, lambda folder: put(stopped, folder, "scene.toml", "results"), check)


class Figure:
    dpi = 100

    def savefig(self, path, **options):
        path.write_bytes(b"picture")


def test_plot(survives, whole_run, monkeypatch):
    monkeypatch.setattr("porefv.simulation.series_picture.series_picture", lambda directory: Figure())
    arguments = ["plot", "results", "--out", "picture.png", "--force"]

    def prepare(folder):
        put(whole_run, folder, "results")
        (folder / "picture.png").write_bytes(b"earlier")

    def check(folder):
        assert (folder / "picture.png").read_bytes() in (b"earlier", b"picture")
        assert main(arguments) == 0
        assert sorted(os.listdir(folder)) == ["picture.png", "results"]

    survives(arguments, prepare, check)
