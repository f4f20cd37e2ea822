"""The JSON Schemas that are stored are those of the models, and say what the scenes say."""

import copy
import inspect
import json
import math
import subprocess
import sys
import tomllib
from pathlib import Path

import jsonschema
import pytest

from porefv.coupling.coupling import Coupling
from porefv.dem.dem import DEM
from porefv.dem.growth import grow
from porefv.errors import InputError
from porefv.flow.pore_flow import PoreFlow
from porefv.mesh.pore_mesh import PoreMesh
from porefv.scenes import schema
from porefv.scenes.schema import KINDS, json_schema

DATA = Path(__file__).parents[2] / "data"
SCENES = sorted((DATA / "scenes").glob("*.toml"))


def kind_of(path):
    return {"pack": "packing"}.get(
        path.name[:4], "simulation" if "[[stages]]" in path.read_text(encoding="utf-8") else "flow"
    )


@pytest.mark.parametrize("kind", KINDS)
def test_stored_schemas_are_those_of_the_models(kind, tmp_path):
    """Run python -m porefv.scenes.schema data/schemas where they are not."""
    schema.main([str(tmp_path)])
    stored = (DATA / "schemas" / f"{kind}.json").read_text(encoding="utf-8")
    assert stored == (tmp_path / f"{kind}.json").read_text(encoding="utf-8")


@pytest.mark.parametrize("kind", KINDS)
def test_schemas_are_schemas_and_every_key_has_a_description(kind):
    found = json_schema(kind)
    jsonschema.Draft7Validator.check_schema(found)
    for table in (found, *found["definitions"].values()):
        assert table["additionalProperties"] is False
        for name, key in table["properties"].items():
            text = key["description"]
            assert text[0].isupper() and text.endswith(".") and "`" not in text and "](" not in text, name
            assert {"type", "$ref", "oneOf"} & set(key), name


@pytest.mark.parametrize("path", SCENES, ids=lambda path: path.stem)
def test_scenes_of_the_project_follow_their_schema(path):
    data = tomllib.loads(path.read_text(encoding="utf-8"))
    jsonschema.Draft7Validator(json_schema(kind_of(path))).validate(data)
    data["outputs"] = {}
    with pytest.raises(jsonschema.ValidationError, match="'outputs' was unexpected"):
        jsonschema.Draft7Validator(json_schema(kind_of(path))).validate(data)


# ---- the schema and the scene agree ----------

# A scene of each kind, into which values of keys are put.
BASES = {
    "flow": {
        "packing": {"file": "../packings/n25_s1.csv"},
        "box": {"lower": [0.0, 0.0, 0.0], "upper": [1.0, 1.0, 1.0]},
        "walls": {"y_min": {"pressure": 1.0}, "y_max": {"pressure": 0.0}},
        "flow": {"conductance": "hydraulic-radius"},
        "sources": [{"sphere": {"centre": [0.5, 0.5, 0.5], "radius": 0.1}, "flow": 1.0}],
        "pressures": [{"sphere": {"centre": [0.5, 0.5, 0.5], "radius": 0.1}, "pressure": 1.0}],
        "output": {"quantities": ["pressure"]},
    },
    "packing": {
        "output": "out.csv",
        "grains": {"number": 10},
        "box": {"upper": [1.0, 1.0, 1.0]},
        "growth": {"porosity": 0.5},
    },
    "simulation": {
        "packing": {"file": "../packings/n25_s1.csv"},
        "fluid": {},
        "coupling": {"conductance": "hydraulic-radius", "pair_resistance": True},
        "stages": [{"fluid": False, "rest": {}, "plates": {"z_max": {"stress": 1.0, "top_speed": 1.0}}}],
    },
}


def numbers(kind):
    """(path, key of the schema) of all numbers in the scene of `BASES` and in tables that it may have."""
    found = json_schema(kind)

    def walk(table, path):
        for name, key in table["properties"].items():
            if "$ref" in key:
                yield from walk(found["definitions"][key["$ref"].rpartition("/")[2]], (*path, name))
            elif key.get("type") in ("number", "integer", ["number", "string"]):
                yield (*path, name), key
            elif "items" in key and "$ref" in key["items"]:
                yield from walk(found["definitions"][key["items"]["$ref"].rpartition("/")[2]], (*path, name, 0))

    for path, key in walk(found, ()):
        # What excludes a table or key of the base, and walls other than its own.
        if (
            path[0] not in ("cloud", "settling")
            and "duration" not in path
            and not ("plates" in path and "z_max" not in path)
        ):
            yield path, key


def accepts(kind, path, value):
    data = copy.deepcopy(BASES[kind])
    table = data
    for step in path[:-1]:
        table = table[step] if isinstance(step, int) else table.setdefault(step, {})
    table[path[-1]] = value
    try:
        KINDS[kind].from_mapping(data, directory=DATA / "scenes")
    except InputError as error:
        assert path[-1] in str(error)
        return False
    return True


@pytest.mark.parametrize(
    ("kind", "path", "key"),
    [
        pytest.param(kind, path, key, id=f"{kind} {'.'.join(map(str, path))}")
        for kind in KINDS
        for path, key in numbers(kind)
    ],
)
def test_scenes_have_the_limits_of_the_schema(kind, path, key):
    whole = key["type"] == "integer"
    step = 1 if whole else 1e-9
    for name, inwards in (("minimum", step), ("maximum", -step)):
        if name in key:
            assert accepts(kind, path, key[name])
            assert not accepts(kind, path, key[name] - inwards)
    for name, inwards in (("exclusiveMinimum", step), ("exclusiveMaximum", -step)):
        if name in key:
            assert accepts(kind, path, key[name] + inwards)
            assert not accepts(kind, path, key[name])
    assert not accepts(kind, path, "1.0")
    assert not accepts(kind, path, True)
    assert not accepts(kind, path, math.nan)
    if whole:
        assert accepts(kind, path, 2.0) and not accepts(kind, path, 2.5)


def test_defaults_are_those_of_the_functions():
    def defaults(function):
        return {
            name: parameter.default
            for name, parameter in inspect.signature(function).parameters.items()
            if parameter.default is not parameter.empty
        }

    flow = KINDS["flow"].from_mapping(BASES["flow"] | {"flow": {}}, DATA / "scenes")
    found = defaults(PoreMesh)
    assert dict(flow.mesh) == {name: found[name] for name in ("unite_tolerance", "wall_tolerance")}
    found = defaults(PoreFlow)
    assert (flow.flow.solver, flow.flow.tolerance, flow.flow.gravity) == tuple(
        found[name] for name in ("solver", "tolerance", "gravity")
    )
    plain = BASES["simulation"] | {"coupling": {"conductance": "hydraulic-radius"}}
    coupling = KINDS["simulation"].from_mapping(plain, DATA / "scenes").coupling
    found = defaults(Coupling)
    assert len(coupling.parameters) == 8
    assert coupling.parameters == {name: found[name] for name in coupling.parameters}
    rest = KINDS["simulation"].from_mapping(BASES["simulation"], DATA / "scenes").stages[0].end
    found = defaults(DEM.run_to_rest)
    assert (rest.unbalanced, rest.stress) == (found["unbalanced"], found["stress"])
    growth = KINDS["packing"].from_mapping(BASES["packing"]).method
    found = defaults(grow)
    assert (growth.damping, growth.unbalanced) == (found["damping"], found["unbalanced"])


def test_the_command_writes_the_schemas(tmp_path):
    command = [sys.executable, "-m", "porefv.scenes.schema", str(tmp_path / "new")]
    subprocess.run(command, check=True)
    assert sorted(path.name for path in (tmp_path / "new").iterdir()) == [f"{kind}.json" for kind in sorted(KINDS)]
    assert json.loads((tmp_path / "new" / "flow.json").read_text(encoding="utf-8"))["title"] == "porefv flow scene"
