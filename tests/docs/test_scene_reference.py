"""The pages about scenes have every key, in tables that are written from the models."""

import runpy
from pathlib import Path

import pytest

from porefv.packing.box import WALLS
from porefv.scenes.schema import KINDS, json_schema

DOCS = Path(__file__).parents[2] / "docs"
SCRIPT = runpy.run_path(str(DOCS / "generate_scene_reference.py"))
PAGE_OF = {"flow": "scene.md", "packing": "pack.md", "simulation": "simulate.md"}


@pytest.mark.parametrize("page", SCRIPT["PAGES"], ids=lambda page: page.name)
def test_tables_of_keys_are_up_to_date(page):
    """Run docs/generate_scene_reference.py where they are not."""
    text = page.read_text(encoding="utf-8")
    assert text.count("<!-- keys of") > 5
    assert SCRIPT["with_tables"](text) == text


@pytest.mark.parametrize("kind", KINDS)
def test_the_page_of_a_scene_names_every_key(kind):
    page = (DOCS / PAGE_OF[kind]).read_text(encoding="utf-8")
    schema = json_schema(kind)
    keys = {key for table in (schema, *schema["definitions"].values()) for key in table["properties"]}
    assert len(keys) > 20
    assert [key for key in sorted(keys - set(WALLS)) if f"`{key}`" not in page] == []


@pytest.mark.parametrize(
    ("value", "text"),
    [
        (1e-3, "1.0e-3"),
        (15e6, "15.0e6"),
        (1e-10, "1.0e-10"),
        (0.01, "0.01"),
        (2600.0, "2600.0"),
        (0.0, "0.0"),
        (10, "10"),
        (True, "true"),
        ((0.0, -9.81), "[0.0, -9.81]"),
        (("a", "b"), '["a", "b"]'),
    ],
)
def test_defaults_are_shown_as_in_a_scene(value, text):
    assert SCRIPT["toml"](value) == text
