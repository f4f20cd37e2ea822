"""What the examples of docstrings are run with (pytest --doctest-modules src)."""

import shutil
from pathlib import Path

import numpy as np
import pytest

import porefv

ROOT = Path(__file__).parent
# ParaView's own Python runs it.
collect_ignore = ["src/porefv/export/paraview/show.py"]


@pytest.fixture(autouse=True)
def for_examples(request, tmp_path, monkeypatch):
    """The names of porefv, numpy, and a folder with a copy of the data to stand and write in."""
    if type(request.node).__name__ != "DoctestItem":
        return
    shutil.copytree(ROOT / "data", tmp_path / "data", ignore=shutil.ignore_patterns("results", "reference"))
    monkeypatch.chdir(tmp_path)
    names = {name: getattr(porefv, name) for name in porefv.__all__}
    request.getfixturevalue("doctest_namespace").update(names, np=np, porefv=porefv)
