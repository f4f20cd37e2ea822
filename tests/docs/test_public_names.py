"""docs/api.md and `__all__` of the packages name the same."""

import importlib
import re
from pathlib import Path

import pytest

PAGE = (Path(__file__).parents[2] / "docs" / "api.md").read_text(encoding="utf-8")
TABLE = dict(re.findall(r"^\| `(porefv[.\w]*)` \| (.*) \|$", PAGE.split("## Public names")[1], re.MULTILINE))


@pytest.mark.parametrize("package", TABLE)
def test_the_page_names_what_a_package_exports_and_it_exists(package):
    module = importlib.import_module(package)
    assert sorted(re.findall(r"`(\w+)`", TABLE[package])) == sorted(module.__all__)
    assert all(hasattr(module, name) for name in module.__all__)


def test_the_page_has_every_package_that_exports_names():
    source = Path(importlib.import_module("porefv").__file__).parent
    packages = {
        "porefv" if path.parent == source else f"porefv.{path.parent.name}"
        for path in [source / "__init__.py", *source.glob("*/__init__.py")]
        if "__all__" in path.read_text(encoding="utf-8")
    }
    assert packages - {"porefv.cli"} == set(TABLE)
