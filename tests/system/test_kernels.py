"""Kernels are compiled and run, whether or not they can be kept on disk."""

import os
import subprocess
import sys

import pytest

# A small kernel of the package; numba's own cache would raise.
CODE = """
import numpy as np
from porefv.mesh.facet_kernels import row_sums
print(row_sums(np.ones((2, 3))).tolist(), row_sums(np.ones((3, 2)).T[:, :0].reshape(0, 3)).tolist())
"""
posix = pytest.mark.skipif(os.name != "posix", reason="limits of POSIX")


def run(preexec=None, **environment):
    return subprocess.run(
        [sys.executable, "-c", CODE], env=os.environ | environment, preexec_fn=preexec,
        capture_output=True, text=True, timeout=120,
    )  # fmt: skip


def check(done, reason):
    assert done.returncode == 0, done.stderr
    assert done.stdout == "[0, 1, 2, 1]\n"
    assert done.stderr.count("compiled kernels cannot be kept") == 1 and reason in done.stderr
    assert "Traceback" not in done.stderr and "NUMBA_CACHE_DIR" in done.stderr


def test_kernels_are_kept_where_there_is_room(tmp_path):
    done = run(NUMBA_CACHE_DIR=str(tmp_path))
    assert (done.returncode, done.stdout, done.stderr) == (0, "[0, 1, 2, 1]\n", "")
    assert len(list(tmp_path.glob("*/union_find.join-*.nbc"))) == 2


@posix
def test_on_a_full_disk_kernels_are_compiled_all_the_same(tmp_path):
    import resource  # of POSIX

    done = run(lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (0, 0)), NUMBA_CACHE_DIR=str(tmp_path))
    check(done, "File too large")
    assert not [path for path in tmp_path.rglob("*") if path.is_file()]


def test_without_any_directory_to_write_to_kernels_are_compiled_all_the_same(tmp_path):
    (tmp_path / "taken").write_text("a file, so that there can be no directory")
    # A package that nobody may write to, and no home: root may write anywhere, so that it is taken from the list.
    done = run(NUMBA_CACHE_DIR=str(tmp_path / "taken"), NUMBA_CACHE_LOCATOR_CLASSES="UserProvidedCacheLocator")
    check(done, "no directory for them can be written to")
