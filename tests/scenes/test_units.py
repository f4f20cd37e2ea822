"""Numbers of scenes that are written with a unit."""

import copy
import subprocess
import sys
from pathlib import Path

import jsonschema
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from porefv.errors import InputError
from porefv.scenes.flow_scene import FlowScene
from porefv.scenes.packing_scene import PackingScene
from porefv.scenes.schema import KINDS, json_schema
from porefv.scenes.simulation_scene import SimulationScene

DATA = Path(__file__).parents[2] / "data"
PACKING = (DATA / "packings" / "n25_s1.csv").as_posix()
# A unit of each dimension of keys, and what it is in the unit of the key.
OTHERS = {
    "Pa s": ("cP", 1e-3),
    "Pa": ("kPa", 1e3),
    "m": ("mm", 1e-3),
    "s": ("hour", 3600.0),
    "kg/m³": ("g/cm³", 1e3),
    "m/s": ("km/hour", 1.0 / 3.6),
    "m/s²": ("cm/s^2", 1e-2),
    "m³/s": ("mL/min", 1e-6 / 60.0),
    "degrees": ("rad", 180.0 / np.pi),
}
SIZES = st.floats(1e-6, 1e6)


def flow_scene(**tables):
    walls = {"y_min": {"pressure": 1.0}, "y_max": {"pressure": 0.0}}
    return FlowScene.from_mapping({"packing": PACKING, "walls": walls} | tables)


# ---- the same value to rounding ----------


@given(
    value=SIZES, unit=st.sampled_from([("cP", 1e-3), ("mPa·s", 1e-3), ("Pa s", 1.0), ("poise", 0.1), ("N*s/m**2", 1.0)])
)
def test_a_viscosity_in_another_unit_is_the_same_to_rounding(value, unit):
    found = flow_scene(fluid={"viscosity": f"{value!r} {unit[0]}"}).fluid.viscosity
    assert found == pytest.approx(value * unit[1], rel=1e-15)


@given(
    values=st.tuples(SIZES, SIZES, SIZES),
    unit=st.sampled_from([("mm", 1e-3), ("µm", 1e-6), ("km", 1e3), ("inch", 0.0254)]),
)
def test_a_corner_in_another_unit_is_the_same_to_rounding(values, unit):
    upper = [f"{value!r}{unit[0]}" for value in values]
    found = flow_scene(box={"lower": ["0 mm", 0, 0.0], "upper": upper}).box
    np.testing.assert_allclose(found.upper, np.array(values) * unit[1], rtol=1e-15)
    np.testing.assert_array_equal(found.lower, 0.0)


@given(values=st.lists(st.floats(1e-3, 1e3), min_size=2, max_size=5, unique=True).map(sorted))
def test_times_and_pressures_of_a_table_may_have_units(values):
    table = {"times": [f"{value} ms" for value in values], "pressures": [f"-{value} kPa" for value in values]}
    scene = SimulationScene.from_mapping(
        {"packing": PACKING, "fluid": {}, "walls": {"z_min": {"pressure": table}}, "stages": [{"duration": "2 hour"}]}
    )
    found = scene.walls["z_min"].pressure
    np.testing.assert_allclose(found.times, np.array(values) * 1e-3, rtol=1e-15)
    np.testing.assert_allclose(found.pressures, np.array(values) * -1e3, rtol=1e-15)
    assert scene.stages[0].duration == 7200.0


def test_all_kinds_of_scenes_read_units():
    flow = flow_scene(
        walls={"y_min": {"velocity": "1 mm/hour"}, "y_max": {"pressure": "2 bar"}},
        sources=[{"sphere": {"centre": ["50 cm", 0.5, 0.5], "radius": "1 dm"}, "flow": "3 mL/min"}],
        output={"quantities": ["pressure"]},
    )
    assert flow.walls.y_min.velocity == pytest.approx(1e-3 / 3600) and flow.walls.y_max.pressure == pytest.approx(2e5)
    assert flow.sources[0].flow == pytest.approx(5e-8) and flow.sources[0].region.radius == pytest.approx(0.1)
    packing = PackingScene.from_mapping(
        {
            "output": "out.csv", "grains": {"number": 10}, "box": {"upper": ["1 mm", "2 mm", "3 mm"]},
            "growth": {"stress": "5 kPa", "friction_angle": "0.5 rad"}, "material": {"young": "10 MPa"},
        }
    )  # fmt: skip
    assert packing.growth.stress == 5000.0 and packing.growth.friction_angle == pytest.approx(np.degrees(0.5))
    assert packing.material.young == 1e7
    simulation = SimulationScene.from_mapping(
        {
            "packing": {"file": PACKING, "scale": "1 mm"}, "gravity": [0, 0, "-981 cm/s**2"],
            "stages": [{"duration": "3 ms", "plates": {"z_max": {"stress": "1 kPa", "top_speed": "1 cm/s"}}}],
            "output": {"every": "100 µs", "frames": ["1 ms", 2e-3]},
        }
    )  # fmt: skip
    assert simulation.packing.scale == 1e-3 and simulation.gravity == pytest.approx((0.0, 0.0, -9.81))
    assert simulation.output.frames == pytest.approx((1e-3, 2e-3)) and simulation.output.every == pytest.approx(1e-4)
    assert simulation.stages[0].plates["z_max"].stress == 1000.0


# ---- every key with a unit ----------

BASES = {
    "flow": {"packing": PACKING, "walls": {"y_min": {"pressure": 1.0}, "y_max": {"pressure": 0.0}},
             "box": {"lower": [0.0, 0.0, 0.0], "upper": [1.0, 1.0, 1.0]}},
    "packing": {"output": "out.csv", "grains": {"number": 10}, "box": {"upper": [1.0, 1.0, 1.0]},
                "growth": {"stress": 1.0}},
    "simulation": {"packing": {"file": PACKING}, "fluid": {}, "stages": [{"duration": 1.0}]},
}  # fmt: skip


def keys_with_units(kind):
    """(path, unit) of all keys with a unit, in tables that the scene of `BASES` may have."""
    schema = json_schema(kind)
    for name in schema["definitions"]:
        for key, said in schema["definitions"][name]["properties"].items():
            unit = said["description"].partition("Unit: ")[2].partition(".")[0]
            if unit:
                yield name, key, unit, said


@pytest.mark.parametrize("kind", KINDS)
def test_the_schema_allows_texts_for_each_key_with_a_unit(kind):
    found = list(keys_with_units(kind))
    assert len(found) > 5
    for table, key, unit, said in found:
        assert unit in OTHERS, (table, key)
        value = f"1 {OTHERS[unit][0]}"
        kinds = said.get("oneOf", [said])
        assert any(
            "string" in kind.get("type", "") or "string" in kind.get("items", {}).get("type", "") for kind in kinds
        ), (table, key)
        if "oneOf" not in said and said["type"] != "array":
            jsonschema.Draft7Validator(said).validate(value)


@pytest.mark.parametrize(
    ("kind", "path", "unit"),
    [
        ("flow", ("fluid", "viscosity"), "Pa s"),
        ("flow", ("fluid", "density"), "kg/m³"),
        ("flow", ("walls", "y_min", "pressure"), "Pa"),
        ("packing", ("growth", "stress"), "Pa"),
        ("packing", ("growth", "friction_angle"), "degrees"),
        ("packing", ("material", "young"), "Pa"),
        ("simulation", ("packing", "scale"), "m"),
        ("simulation", ("step",), "s"),
        ("simulation", ("output", "every"), "s"),
        ("simulation", ("checkpoint", "seconds"), "s"),
        ("simulation", ("stages", 0, "duration"), "s"),
        ("simulation", ("walls", "z_min", "pressure"), "Pa"),
    ],
)
def test_a_wrong_dimension_is_refused_with_the_unit_that_is_expected(kind, path, unit):
    def scene(value):
        data = copy.deepcopy(BASES[kind])
        table = data
        for step in path[:-1]:
            table = table[step] if isinstance(step, int) else table.setdefault(step, {})
        table[path[-1]] = value
        return KINDS[kind].from_mapping(data)

    other, _ = OTHERS[unit]
    assert scene(f"1 {other}")
    wrong = "cP" if unit != "Pa s" else "mm"
    with pytest.raises(
        InputError, match=rf"{path[-1]}: '1 {wrong}' is not of the dimension of {unit}; expected a finite"
    ):
        scene(f"1 {wrong}")


# ---- what is refused ----------


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("1 mm", "line 3: .fluid. viscosity: '1 mm' is not of the dimension of Pa s; expected .* such as \"1 cP\""),
        ("1 foo", "line 3: .fluid. viscosity: the unit of '1 foo' is unknown"),
        ("20 degC", "the unit of '20 degC' does not begin at zero"),
        ("20 degF", "does not begin at zero"),
        ("3 dB", "does not begin at zero"),
        ("1", "expected a finite number of Pa s, or a text with its unit such as \"1 cP\", not '1'"),
        ("cP", "expected a finite number of Pa s"),
        ("1 Pa s m2", "is unknown.*Powers are written m³"),
        ("nan cP", "expected a finite number"),
        ("1e999 cP", "viscosity: expected a finite number, not inf"),
        ("1 m**9**9**9", "expected a finite number"),
        ("1 m**(9**9**9)", "expected a finite number"),
        ("1 m**999999", "expected a finite number"),
        ("1 m/0", "cannot be read"),
        ("1 cP" + 100 * " s", "expected a finite number"),
        ("1 __import__('os')", "expected a finite number"),
        ("", "expected a finite number"),
        ("-1 cP", "viscosity must be a positive"),
    ],
)
def test_texts_that_are_no_such_number_are_refused(tmp_path, text, said):
    path = tmp_path / "scene.toml"
    path.write_text(
        f'packing = "{PACKING}"\n[fluid]\nviscosity = "{text}"\n[walls]\ny_min = {{ pressure = 1 }}\n', "utf-8"
    )
    with pytest.raises(InputError, match=said) as error:
        FlowScene.read(path)
    assert str(path) in str(error.value)


@given(text=st.text(st.sampled_from("0123456789.eE+- */^()mPascgkµ²³⁻·°d_"), max_size=30))
def test_any_text_is_a_number_or_refused(text):
    try:
        assert np.isfinite(flow_scene(fluid={"density": text}).fluid.density)
    except InputError as error:
        assert "density" in str(error)


def test_several_wrong_units_are_reported_together_and_keys_without_units_take_no_texts(tmp_path):
    with pytest.raises(InputError) as error:
        flow_scene(fluid={"viscosity": "1 mm", "density": "1 s"}, mesh={"unite_tolerance": "1 mm"})
    assert [line.partition(":")[2].partition(":")[0] for line in str(error.value).splitlines()] == [
        " [fluid] viscosity", " [fluid] density", " [mesh] unite_tolerance",
    ]  # fmt: skip
    with pytest.raises(
        InputError, match="unite_tolerance: must lie|unite_tolerance: expected a finite number, not '1 mm'"
    ):
        flow_scene(mesh={"unite_tolerance": "1 mm"})


def test_pint_is_imported_only_for_a_scene_with_a_unit():
    code = (
        "import sys\nfrom porefv.scenes.flow_scene import FlowScene\n"
        f"data = {{'packing': {PACKING!r}, 'walls': {{'y_min': {{'pressure': 1.0}}, 'y_max': {{'pressure': 0.0}}}}}}\n"
        "FlowScene.from_mapping(data)\nassert 'pint' not in sys.modules\n"
        "FlowScene.from_mapping(data | {'fluid': {'viscosity': '1 cP'}})\nassert 'pint' in sys.modules\n"
    )
    subprocess.run([sys.executable, "-c", code], check=True)


@pytest.mark.parametrize(("fluid", "given"), [({}, False), ({"viscosity": 0.1}, False), ({"density": 1000.0}, True)])
def test_a_scene_knows_whether_its_density_was_given(fluid, given):
    scene = flow_scene(fluid=fluid)
    assert scene.fluid.density == 1000.0 and scene.fluid.density_given == given
