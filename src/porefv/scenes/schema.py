"""JSON Schemas of scenes, for editors: `python -m porefv.scenes.schema DIRECTORY` writes one for each kind.

A schema says which tables and keys there are, what they mean, and of which kind and between which limits a value must
be. What several keys say together is checked when the scene is read.
"""

from __future__ import annotations

import argparse
import json
import re
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from pydantic.json_schema import GenerateJsonSchema
from pydantic_core import core_schema

from porefv.scenes.flow_scene import FlowScene
from porefv.scenes.packing_scene import PackingScene
from porefv.scenes.simulation_scene import SimulationScene
from porefv.scenes.table import Scene

# Kind of scene by the name of its schema.
KINDS: dict[str, type[Scene]] = {"flow": FlowScene, "packing": PackingScene, "simulation": SimulationScene}


class TomlSchema(GenerateJsonSchema):
    """A schema of what can stand in TOML, which has no null, for editors, which know draft 7 best."""

    schema_dialect = "http://json-schema.org/draft-07/schema#"

    def nullable_schema(self, schema: core_schema.NullableSchema) -> dict[str, Any]:
        return self.generate_inner(schema["schema"])

    def default_schema(self, schema: core_schema.WithDefaultSchema) -> dict[str, Any]:
        # None, {} and () stand for keys and tables that are left out.
        left_out = schema.get("default") in (None, {}, ())
        return self.generate_inner(schema["schema"]) if left_out else super().default_schema(schema)

    def field_title_should_be_set(self, schema: Any) -> bool:
        return False


def json_schema(kind: str) -> dict[str, Any]:
    """The JSON Schema of a kind of scene, one of `KINDS`."""
    found = KINDS[kind].model_json_schema(schema_generator=TomlSchema, ref_template="#/definitions/{model}")
    tables = found.pop("$defs")
    schema = {"$schema": TomlSchema.schema_dialect, "title": f"porefv {kind} scene", **_readable(found)}
    return schema | {"definitions": {name: _readable(table) for name, table in sorted(tables.items())}}


def _readable(table: dict[str, Any]) -> dict[str, Any]:
    """A table whose descriptions are sentences, with units, and without links, which lead nowhere from an editor."""
    described = {
        "description": " ".join(table["description"].partition("\n\n")[0].replace("`", "").split()),
        "type": "object",
        "properties": {name: _sentence(key) for name, key in table["properties"].items()},
    }
    required = {"required": table["required"]} if "required" in table else {}
    return described | required | {"additionalProperties": False}


def _sentence(key: dict[str, Any]) -> dict[str, Any]:
    # Early versions of pydantic put a reference into a list of one.
    key = key | key.get("allOf", [{}])[0]
    extra = {name: key[name] for name in ("unit", "shown")}
    text = re.sub(r"\[([^]]*)\]\([^)]*\)", r"\1", key["description"])
    sentences = [text[0].upper() + text[1:]]
    sentences += [f"Unit: {extra['unit']}"] if extra["unit"] else []
    sentences += [f"Default: {extra['shown']}"] if extra["shown"] else []
    rest = {name: value for name, value in key.items() if name not in ("description", "allOf", *extra)}
    return {"description": ". ".join(sentences).replace("`", "") + "."} | (_or_text(rest) if extra["unit"] else rest)


def _or_text(key: dict[str, Any]) -> dict[str, Any]:
    """A key of numbers where texts with a unit can stand, too: `porefv.scenes.units`."""
    if key.get("type") == "number":
        return key | {"type": ["number", "string"]}
    if "items" in key:
        return key | {"items": _or_text(key["items"])}
    if "oneOf" in key:
        return key | {"oneOf": [_or_text(kind) for kind in key["oneOf"]]}
    return key


def main(arguments: Sequence[str] | None = None) -> None:
    """Write the schemas."""
    parser = argparse.ArgumentParser(description="Write the JSON Schemas of scene files.")
    parser.add_argument("directory", metavar="DIRECTORY", type=Path)
    directory = parser.parse_args(arguments).directory
    directory.mkdir(parents=True, exist_ok=True)
    for kind in KINDS:
        text = json.dumps(json_schema(kind), indent=2, ensure_ascii=False)
        (directory / f"{kind}.json").write_text(f"{text}\n", encoding="utf-8")


if __name__ == "__main__":
    main()
