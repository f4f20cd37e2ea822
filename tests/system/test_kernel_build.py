"""What the package is built with: kernels for all that scenes need, by recorded signatures."""

import configparser
import json
import subprocess
import sys
import tomllib
from pathlib import Path

import numpy as np
import pytest
from numba import from_dtype, typeof, types

from porefv.mesh.facet_kernels import FacetTopology
from porefv.system import kernel_build, kernel_files
from porefv.system.kernel_types import types_from_text, types_text

ROOT = Path(__file__).parents[2]
# Its equation is not solved by SciPy, as that of a few pores is.
PACKING = ROOT / "data" / "packings" / "n2000_s1.csv"


def run(code, *arguments):
    done = subprocess.run([sys.executable, *arguments, "-c", code], capture_output=True, text=True, timeout=300)
    assert done.returncode == 0, done.stderr
    return done.stdout


def test_every_kernel_that_a_scene_needs_is_recorded():
    script = Path(__file__).with_name("kernel_signatures.py")
    done = subprocess.run([sys.executable, str(script)], capture_output=True, text=True, timeout=300)
    assert done.returncode == 0, done.stderr
    lacking = [line for line in done.stdout.splitlines() if line.startswith("lacks ")]
    assert "compared" in done.stdout
    assert lacking == [], f"record them: python {script.relative_to(ROOT)} --write"


def test_every_recorded_kernel_is_there_and_its_types_can_be_read():
    code = (
        "from importlib import import_module\n"
        "from porefv.system.kernel_build import recorded\n"
        "from porefv.system.kernel_types import types_from_text, types_text\n"
        "for name, signatures in recorded().items():\n"
        "    module, _, function = name.rpartition('.')\n"
        "    assert hasattr(getattr(import_module(module), function), 'py_func'), name\n"
        "    for signature in signatures:\n"
        "        assert types_text(types_from_text(signature)) == signature, (name, signature)\n"
        "print(len(recorded()))\n"
    )
    assert int(run(code)) > 60


@pytest.mark.parametrize(
    "value",
    [
        3, 2.5, True, (1, 2.0), (1, 2), np.uint64(7), np.zeros(3), np.zeros((3, 2), np.int32),
        np.zeros((2, 3), order="F"), np.zeros((4, 4))[::2, ::2], np.broadcast_to(0.0, (3,)), np.zeros(2, bool),
        np.zeros(2, [("weight", "f8"), ("other", "i4"), ("following", "i4")]), np.random.default_rng(0),
        FacetTopology(np.zeros((1, 2), np.int32), np.zeros((1, 3), np.int32)), (FacetTopology(1, 2.0), 3),
    ],
)  # fmt: skip
def test_types_are_read_as_they_are_written(value):
    kind = typeof(value)
    assert types_from_text(types_text([kind])) == (kind,)


def test_a_type_that_is_none_is_refused():
    assert types_from_text("") == ()
    assert from_dtype(np.dtype("f8")) == types_from_text("float64")[0] == types.float64
    with pytest.raises(AttributeError):
        types_from_text("float640")
    with pytest.raises(ValueError, match="names no type"):
        types_from_text("3")
    with pytest.raises(ValueError, match="other fields"):
        types_from_text("porefv.mesh.facet_kernels.FacetTopology(vertices=int64, cells=int64)")


def test_kernels_that_were_built_are_used_and_nothing_is_kept(tmp_path, monkeypatch):
    record = {
        name: signatures
        for name, signatures in kernel_build.recorded().items()
        if name in ("porefv.mesh.uniting.tied_facets", "porefv.mesh.uniting.unite")
    }
    (tmp_path / "record.json").write_text(json.dumps(record))
    built, kept = tmp_path / "built", tmp_path / "kept"
    code = (
        "import sys, os\nfrom pathlib import Path\n"
        "from porefv.system import kernel_build, kernel_files\n"
        f"kernel_build.RECORD = Path({str(tmp_path / 'record.json')!r})\n"
        f"kernel_files.BUILT = Path({str(built)!r})\n"
        f"os.environ['NUMBA_CACHE_DIR'] = {str(kept)!r}\n"
    )
    # As the build does, but in this one process.
    compiling = "kernel_build.compile_recorded(kernel_build.recorded())\n"
    run(code + f"os.environ['NUMBA_CACHE_DIR'] = {str(tmp_path)!r}\n" + compiling)
    (tmp_path / kernel_files.KEPT).rename(built)
    assert len(list(built.iterdir())) == sum(len(signatures) for signatures in record.values())
    found = run(
        code + compiling + "from porefv.system.kernels import all_kernels\n"
        "print(sum(sum(kernel.stats.cache_misses.values()) for kernel in all_kernels().values()))"
    )
    assert found == "0\n"
    assert list((kept / kernel_files.KEPT).iterdir()) == []


def test_the_build_and_the_package_require_the_same_numba():
    metadata = configparser.ConfigParser()
    metadata.read(ROOT / "setup.cfg")
    package = metadata["options"]["install_requires"].split("\n")
    build = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["build-system"]["requires"]
    for name in ("numba", "numpy", "scipy"):
        assert [line for line in package if line.split(" ")[0] == name] == [
            line for line in build if line.split(" ")[0] == name
        ]


# ---- what a warm start loads ----------


def test_a_warm_solve_loads_nothing_that_it_does_not_need(tmp_path):
    (tmp_path / "scene.toml").write_text(
        f'packing = "{PACKING.as_posix()}"\n'
        "walls = { y_min = { pressure = 1.0 }, y_max = { pressure = 0.0 } }\n"
        'output = { directory = "results", quantities = ["permeability", "pressure", "forces"], vtk = true }\n'
    )
    code = (
        "import sys\nfrom porefv.cli import main\n"
        f"assert main(['solve', '--quiet', '--force', {str(tmp_path / 'scene.toml')!r}]) == 0\n"
        "print(sorted(name for name in sys.modules if name in "
        "('scipy.linalg', 'pyvista', 'fipy', 'matplotlib', 'meshio', 'pyarrow', 'numba.np.linalg')))"
    )
    run(code)  # compiles what is not kept yet, for which numba loads scipy.linalg
    assert run(code).splitlines()[-1] == "[]"
