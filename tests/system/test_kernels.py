"""Kernels are compiled and run, whether or not they can be kept on disk, and found again as long as they are right."""

import os
import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from porefv.errors import CompilationWarning
from porefv.system import kernel_files
from porefv.system.kernels import helper, kernel, unsigned_range

# A small kernel of the package, for two types.
CODE = """
import numpy as np
from porefv.solvers.pressure_equation import reached
from porefv.system.kernels import all_kernels
for kind in (np.int32, np.int64):
    print(reached(np.array([[0, 1], [1, 2]], kind), np.array([1.0, 0.0]), np.array([True, False, False])).tolist())
"""
FOUND = "[True, True, False]\n" * 2
posix = pytest.mark.skipif(os.name != "posix", reason="limits and rights of POSIX")


def run(preexec=None, code=CODE, **environment):
    return subprocess.run(
        [sys.executable, "-c", code], env=os.environ | environment, preexec_fn=preexec,
        capture_output=True, text=True, timeout=120,
    )  # fmt: skip


def check(done, reason):
    assert (done.returncode, done.stdout) == (0, FOUND), done.stderr
    assert done.stderr.count("compiled kernels cannot be kept") == 1 and reason in done.stderr
    assert "Traceback" not in done.stderr and "NUMBA_CACHE_DIR" in done.stderr


def kept(folder):
    return sorted((folder / kernel_files.KEPT).glob("solvers.pressure_equation.*joined_parts-*"))


# ---- where they are kept ----------


def test_kernels_are_kept_where_there_is_room_and_found_again(tmp_path):
    done = run(NUMBA_CACHE_DIR=str(tmp_path))
    assert (done.returncode, done.stdout, done.stderr) == (0, FOUND, "")
    times = {path: path.stat().st_mtime_ns for path in kept(tmp_path)}
    assert len(times) == 2
    counting = "print(sum(sum(kernel.stats.cache_misses.values()) for kernel in all_kernels().values()))"
    again = run(code=CODE + counting, NUMBA_CACHE_DIR=str(tmp_path))
    assert (again.stdout, again.stderr) == (FOUND + "0\n", "")
    assert {path: path.stat().st_mtime_ns for path in kept(tmp_path)} == times


@posix
def test_on_a_full_disk_kernels_are_compiled_all_the_same(tmp_path):
    import resource  # of POSIX

    done = run(lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (0, 0)), NUMBA_CACHE_DIR=str(tmp_path))
    check(done, "File too large")
    assert not [path for path in tmp_path.rglob("*") if path.is_file()]


def test_without_any_directory_to_write_to_kernels_are_compiled_all_the_same(tmp_path):
    (tmp_path / "taken").write_text("a file, so that there can be no directory")
    check(run(NUMBA_CACHE_DIR=str(tmp_path / "taken")), "no directory for them can be written to")


@posix
def test_a_directory_that_others_may_write_to_is_left_out(tmp_path):
    folder = tmp_path / kernel_files.KEPT
    folder.mkdir()
    folder.chmod(0o777)
    done = run(NUMBA_CACHE_DIR=str(tmp_path))
    assert (done.returncode, done.stdout) == (0, FOUND)
    assert "can be written to by other users" in done.stderr and "chmod go-w" in done.stderr
    assert list(folder.iterdir()) == []


@pytest.mark.skipif(not hasattr(os, "geteuid") or os.geteuid() != 0, reason="only the administrator gives files away")
def test_a_directory_of_another_user_is_left_out(tmp_path):
    folder = tmp_path / kernel_files.KEPT
    folder.mkdir()
    os.chown(folder, 12345, 12345)
    done = run(NUMBA_CACHE_DIR=str(tmp_path))
    assert (done.returncode, done.stdout) == (0, FOUND)
    assert "can be written to by other users" in done.stderr and list(folder.iterdir()) == []


@pytest.mark.parametrize("damage", [b"", b"x", "half", "bit"])
def test_a_damaged_file_is_compiled_anew_and_replaced(tmp_path, damage):
    run(NUMBA_CACHE_DIR=str(tmp_path))
    path, other = kept(tmp_path)
    whole = path.read_bytes()
    if damage == "half":
        damage = whole[: len(whole) // 2]
    elif damage == "bit":
        damage = whole[:-5] + bytes([whole[-5] ^ 1]) + whole[-4:]
    path.write_bytes(damage)
    done = run(NUMBA_CACHE_DIR=str(tmp_path))
    assert (done.returncode, done.stdout) == (0, FOUND)
    assert done.stderr.count(f"{path} is damaged; it is compiled anew") == 1
    assert run(NUMBA_CACHE_DIR=str(tmp_path)).stderr == ""
    assert kept(tmp_path) == [path, other]


# ---- what machine code depends on ----------


PIECES = {
    "FACTOR": "FACTOR = 2.0\n",
    "Pair": "class Pair(NamedTuple):\n    a: float\n    b: float\n",
    "double": "@helper\ndef double(x):\n    return FACTOR * x\n",
    "add": '@kernel\ndef add(pair):\n    """Text."""\n    return double(pair.a) - pair.b  # comment\n',
}
IMPORTS = "from typing import NamedTuple\nfrom porefv.system.kernels import helper, kernel\n"


def stamp(tmp_path, **changes):
    """Stamp of a kernel in a module of its own, with some pieces written otherwise."""
    pieces = PIECES | changes
    source = IMPORTS + "".join(pieces.values())
    names = {"__name__": "module_of_a_test"}
    exec(compile(source, str(tmp_path / "module_of_a_test.py"), "exec"), names)
    return kernel_files.stamp(names["add"])


def test_a_kernel_is_known_by_all_that_its_machine_code_depends_on(tmp_path):
    changes = [
        {"FACTOR": "FACTOR = 3.0\n"},
        {"Pair": "class Pair(NamedTuple):\n    b: float\n    a: float\n"},
        {"double": "@helper\ndef double(x):\n    return x + x\n"},
        {"double": '@helper(error_model="numpy")\ndef double(x):\n    return FACTOR * x\n'},
        {"add": "@kernel\ndef add(pair):\n    return double(pair.a) + pair.b\n"},
        {"add": '@kernel(fastmath={"nsz"})\ndef add(pair):\n    return double(pair.a) - pair.b\n'},
    ]
    uses_pair = {"add": PIECES["add"].replace("double(pair.a)", "double(Pair(pair.a, 0.0).a)")}
    stamps = [stamp(tmp_path, **{**(uses_pair if "Pair" in change else {}), **change}) for change in [{}, *changes]]
    assert stamps[2] != stamp(tmp_path, **uses_pair)
    assert len(set(stamps)) == len(stamps)


def test_what_machine_code_does_not_depend_on_changes_nothing(tmp_path):
    others = "# a line\n" + PIECES["add"].replace("Text.", "Other text.").replace("  # comment", "")
    assert stamp(tmp_path, add=others) == stamp(tmp_path)


def test_a_stamp_is_the_same_in_every_process(tmp_path):
    # Sets, such as the options of fastmath, have another order in every process.
    code = (
        "from porefv.system import kernel_files\nfrom porefv.dem.contacts import grain_contacts\n"
        "print(kernel_files.stamp(grain_contacts))"
    )
    found = {run(code=code, PYTHONHASHSEED=str(seed)).stdout for seed in range(3)}
    assert len(found) == 1 and len(found.pop()) == 65


# ---- what a user is told ----------


def test_that_something_is_compiled_is_told_once(tmp_path):
    code = "from porefv.system.kernel_files import on_compilation\non_compilation(print)\n" + CODE
    done = run(code=code, NUMBA_CACHE_DIR=str(tmp_path))
    assert done.stdout == "compiling for this machine, this once; it takes about half a minute\n" + FOUND
    assert run(code=code, NUMBA_CACHE_DIR=str(tmp_path)).stdout == FOUND


@pytest.mark.parametrize(
    ("built_for", "reason"),
    [
        ("numba 0.1, llvmlite 0.1, cpython-399 linux\nx86-64-v3\n", "porefv was built for numba 0.1"),
        ("{versions}\n{processor}\n", "for arguments that porefv was not built for"),
    ],
)
def test_why_a_package_that_was_built_compiles(tmp_path, monkeypatch, built_for, reason):
    versions, processor = kernel_files.target_text().splitlines()
    monkeypatch.setattr(kernel_files, "BUILT", tmp_path)
    (tmp_path / kernel_files.BUILT_FOR).write_text(built_for.format(versions=versions, processor=processor))
    kernel_files.announce.cache_clear()
    kernel_files.on_compilation(None)
    with pytest.warns(CompilationWarning, match=re.escape(reason)):
        kernel_files.announce()


# ---- decorators ----------


def test_a_loop_over_rows_without_sign_is_that_over_rows():
    @kernel
    def fill(first, last, values):
        for i in unsigned_range(first, last):
            values[i] = twice(values[i])

    @helper
    def twice(x):
        return 2.0 * x

    values = np.ones(5)
    fill(1, 3, values)
    assert values.tolist() == [1.0, 2.0, 2.0, 1.0, 1.0]


def test_kernels_of_the_package_release_the_lock_and_need_no_openmp():
    source = Path(kernel_files.__file__).resolve().parents[1]
    text = "".join(path.read_text(encoding="utf-8") for path in source.rglob("*.py"))
    assert not re.search(r"prange|parallel=True|import njit|set_num_threads", text)
