import sys
from pathlib import Path

import numpy as np
import pytest

from porefv.conductance.effective_radius import EffectiveRadius
from porefv.conductance.registry import AUTO
from porefv.errors import ComputationError, InputError, MissingExtraError
from porefv.scenes.flow_scene import FlowScene
from porefv.scenes.toml_file import line_of

DATA = Path(__file__).parents[2] / "data"

PLAIN = """\
packing = "{packing}"
[fluid]
viscosity = 1.0e-3
[walls]
y_min = {{ pressure = 1.0 }}
y_max = {{ pressure = 0.0 }}
[flow]
solver = "auto"
[output]
quantities = ["permeability"]
"""


@pytest.fixture
def write_scene(tmp_path):
    """Write the plain scene with a text replaced, and give its path."""

    def write(old="", new=""):
        text = PLAIN.format(packing=(DATA / "packings" / "n25_s1.csv").as_posix())
        assert old in text
        path = tmp_path / "scene.toml"
        path.write_text(text.replace(old, new) if old else text, encoding="utf-8")
        return path

    return write


def mapping(**tables):
    return {
        "packing": "n25_s1.csv",
        "walls": {"y_min": {"pressure": 1.0}, "y_max": {"pressure": 0.0}},
        **tables,
    }


# What a scene may say


SCENES = [path for path in sorted((DATA / "scenes").glob("*.toml")) if not path.name.startswith("pack_")]
SCENES = [path for path in SCENES if "[[stages]]" not in path.read_text(encoding="utf-8")]  # of porefv simulate


@pytest.mark.parametrize("path", SCENES, ids=lambda path: path.stem)
def test_scenes_of_the_project_are_sound(path):
    assert len(FlowScene.read(path).check()) > 0


def test_a_wall_tolerance_of_one_which_any_cropped_packing_needs_is_accepted():
    assert FlowScene.from_mapping(mapping(mesh={"wall_tolerance": 1.0}), DATA / "packings").mesh.wall_tolerance == 1.0


def test_every_key_is_understood():
    scene = FlowScene.read(DATA / "scenes" / "n25.toml")
    assert scene.packing.format == "csv"
    assert scene.box is not None and scene.box.volume == 1.0
    assert (scene.fluid.viscosity, scene.fluid.density) == (10.0, 970.0)
    assert scene.walls.z_max.pressure == 10.0
    assert list(scene.walls.slip) == [True, False, False, False, False, False]
    assert (scene.mesh.unite_tolerance, scene.mesh.wall_tolerance) == (0.01, 0.05)
    assert scene.flow.conductance == EffectiveRadius()
    assert (scene.flow.solver, scene.flow.tolerance) == ("direct", 1e-12)
    assert scene.flow.gravity == (0.0, 0.0, -9.81)
    assert scene.output.quantities == ("permeability", "pressure", "forces")
    assert scene.output.vtk is True


@pytest.mark.parametrize("table_format", ["csv", "npy"])
def test_scene_chooses_the_format_of_the_table(write_scene, table_format):
    output = f'quantities = ["forces"]\ntable_format = "{table_format}"'
    directory = FlowScene.read(write_scene('quantities = ["permeability"]', output)).solve()
    assert sorted(path.name for path in directory.iterdir()) == [f"forces.{table_format}", "summary.json"]


def test_check_and_solve_say_that_pyarrow_is_missing(write_scene, monkeypatch):
    monkeypatch.setitem(sys.modules, "pyarrow", None)
    monkeypatch.setattr(FlowScene, "read_packing", lambda self: pytest.fail("read"))
    output = 'quantities = ["forces"]\ntable_format = "parquet"'
    scene = FlowScene.read(write_scene('quantities = ["permeability"]', output))
    for refuses in (scene.check, scene.solve):
        with pytest.raises(MissingExtraError, match="Writing forces.parquet needs .* pip install pyarrow"):
            refuses()


def test_unknown_table_format_is_refused_with_its_line(write_scene):
    path = write_scene('quantities = ["permeability"]', 'table_format = "nyp"')
    with pytest.raises(InputError, match="line 10.* table_format .*npy"):
        FlowScene.read(path)


def test_what_a_scene_leaves_out_has_defaults():
    scene = FlowScene.from_mapping(mapping(), directory=DATA / "packings")
    assert scene.box is None
    assert scene.flow.conductance == AUTO()
    assert scene.flow.solver == "auto"
    assert scene.output.quantities == ("permeability",)
    assert scene.output.vtk is False
    assert not scene.walls.slip.any()


def test_none_stands_for_what_is_left_out():
    scene = FlowScene.from_mapping(mapping(box=None, flow={"alpha": None}, mesh=None), directory=DATA / "packings")
    assert scene.box is None and scene.mesh.wall_tolerance == 0.05
    with pytest.raises(InputError, match="packing: missing; give it at the top of the file"):
        FlowScene.from_mapping(mapping(packing=None))


def test_lateral_is_every_wall_not_named():
    walls = {"y_min": {"pressure": 1.0}, "y_max": {"pressure": 0.0}, "lateral": {"slip": True}, "x_min": {}}
    scene = FlowScene.from_mapping(mapping(walls=walls), directory=DATA / "packings")
    assert list(scene.walls.slip) == [False, True, False, False, True, True]


def test_paths_are_relative_to_the_scene_file(tmp_path, monkeypatch):
    folder = tmp_path / "project"
    folder.mkdir()
    (folder / "grains.csv").write_text("x,y,z,radius\n0.5,0.5,0.5,0.4\n")
    text = PLAIN.format(packing="grains.csv") + "[box]\nlower = [0, 0, 0]\nupper = [1, 1, 1]\n"
    (folder / "scene.toml").write_text(text)
    monkeypatch.chdir(tmp_path)
    scene = FlowScene.read("project/scene.toml")
    assert scene.output.directory == Path("project/results")
    assert len(scene.read_packing()) == 1


def test_alpha_scales_the_permeability():
    def permeability(**flow):
        flow["conductance"] = "hydraulic-radius"
        return FlowScene.from_mapping(mapping(flow=flow), directory=DATA / "packings").pore_flow().permeability

    assert permeability(alpha=1.0) == pytest.approx(2.0 * permeability(), rel=1e-9)


def test_scene_is_the_flow_of_the_same_objects_in_python():
    from porefv.flow.pore_flow import PoreFlow
    from porefv.flow.walls import Walls
    from porefv.packing.packing import Packing

    scene = FlowScene.from_mapping(mapping(), directory=DATA / "packings")
    flow = PoreFlow(Packing.read(DATA / "packings" / "n25_s1.csv"), Walls.along("y"))
    assert scene.pore_flow().permeability == flow.permeability


# Only what is asked for


def computed(scene, tmp_path, monkeypatch):
    """Names of what a solve has computed, of the flow, its mesh and its throats."""
    flows = []
    original = FlowScene.pore_flow
    monkeypatch.setattr(FlowScene, "pore_flow", lambda self, mesh: flows.append(original(self, mesh)) or flows[0])
    scene.solve()
    flow = flows[0]
    return {name for part in (flow, flow.mesh, flow.mesh.facets, flow.mesh.throats) for name in vars(part)}


def output(tmp_path, *quantities, vtk=False):
    return {"directory": str(tmp_path / "results"), "quantities": list(quantities), "vtk": vtk}


def test_permeability_needs_no_forces_velocities_or_void_volumes(tmp_path, monkeypatch):
    scene = FlowScene.from_mapping(mapping(output=output(tmp_path, "permeability")), DATA / "packings")
    names = computed(scene, tmp_path, monkeypatch)
    assert "solution" in names
    assert not names & {"forces", "pore_velocity", "cell_void_volumes", "pore_volumes"}


def test_effective_radius_needs_no_solid_angles(tmp_path, monkeypatch):
    tables = {"flow": {"conductance": "effective-radius"}, "output": output(tmp_path, "permeability")}
    scene = FlowScene.from_mapping(mapping(**tables), DATA / "packings")
    names = computed(scene, tmp_path, monkeypatch)
    assert not names & {"_volumes", "volumes", "cell_void_volumes"}


def test_without_quantities_the_pores_are_made_and_no_walls_needed(tmp_path):
    tables = {"walls": {}, "output": output(tmp_path)}
    scene = FlowScene.from_mapping(mapping(**tables), DATA / "packings")
    assert scene.stages == ("reading", "validation", "triangulation", "writing")
    assert [path.name for path in scene.solve().iterdir()] == ["summary.json"]


def test_check_computes_nothing(write_scene, monkeypatch):
    from porefv.mesh.pore_mesh import PoreMesh

    def refuse(self):
        raise AssertionError("check must not triangulate")

    monkeypatch.setattr(PoreMesh, "triangulation", property(refuse))
    scene = FlowScene.read(write_scene())
    assert len(scene.check()) == 25
    assert not scene.output.directory.exists()


# Bad scenes

BAD = {
    "unknown key": ("solver =", "solvr =", "line 8: .flow. unknown key 'solvr'; did you mean 'solver'"),
    "unknown table": ("[fluid]", "[fluids]", "line 2: unknown key 'fluids'; did you mean 'fluid'"),
    "unknown wall": ("y_max", "y_mx", "line 6: .walls. unknown wall 'y_mx'; did you mean 'y_max'"),
    "unknown key of a wall": ("pressure = 1", "presure = 1", "line 5: .walls.y_min. unknown key 'presure'"),
    "unknown solver": ('"auto"', '"dirct"', "line 8: .flow. solver: unknown solver 'dirct'; did"),
    "unknown model": ('solver = "auto"', 'conductance = "square"', "unknown conductance 'square'; known"),
    "unknown quantity": ('"permeability"', '"vorticity"', "line 10: .output. quantities: 'vorticity'"),
    "quantities not a list": ('["permeability"]', '"permeability"', "expected a list"),
    "no viscosity": ("1.0e-3", "0.0", "line 3: .fluid. viscosity must be a positive"),
    "negative viscosity": ("1.0e-3", "-1", "viscosity must be a positive"),
    "viscosity not a number": ("1.0e-3", '"low"', "line 3: .fluid. viscosity: expected a finite"),
    "viscosity a truth value": ("1.0e-3", "true", "viscosity: expected a finite number, not True"),
    "viscosity beyond numbers": ("1.0e-3", "1" + 400 * "0", "viscosity: expected a finite number"),
    "viscosity nan": ("1.0e-3", "nan", "viscosity: expected a finite number, not nan"),
    "negative density": ("viscosity = 1.0e-3", "density = -1.0", "density must be"),
    "pressure not a number": ("1.0 }", '"high" }', "line 5: .walls.y_min. pressure: expected a"),
    "pressure infinite": ("1.0 }", "inf }", "line 5: .walls.y_min. pressure: .* not inf"),
    "slip not a truth value": ("1.0 }", "1.0, slip = 1 }", "line 5: .walls.y_min. slip: expected true or"),
    "wall not a table": ("{ pressure = 1.0 }", "1.0", "line 5: .walls. y_min: expected a table"),
    "pressure of all lateral walls": ("y_max", "lateral", "line 6: .walls.lateral. pressure: .* wall by"),
    "one pressure wall": ("pressure = 0.0", "slip = true", "permeability needs exactly two pressure walls"),
    "pressure walls at a corner": ("y_max", "x_max", "opposite each other .* x_max at 0 Pa, y_min at 1 Pa"),
    "equal pressures": ("pressure = 0.0", "pressure = 1.0", "at different pressures"),
    "no pressure wall": ("pressure", "# pressure", "not TOML"),
    "walls left out": ("[walls]", "[box]", ".box. unknown key 'y_min'"),
    "gravity": ("[flow]", "[flow]\ngravity = [0, 0]", "line 8: .flow. gravity: expected three"),
    "negative alpha": (
        "[flow]", '[flow]\nconductance = "hydraulic-radius"\nalpha = -1', "alpha must be a positive number"
    ),
    "alpha of another model": (
        "[flow]", '[flow]\nconductance = "effective-radius"\nalpha = 1.0', "line 9: .flow. alpha: .* no param"
    ),
    "tolerance": ("[flow]", "[flow]\ntolerance = 0.0", "tolerance: must lie between 0 and 1"),
    "unite_tolerance": ("[flow]", "[mesh]\nunite_tolerance = -0.1\n[flow]", "must lie in .0, 1"),
    "wall_tolerance": ("[flow]", "[mesh]\nwall_tolerance = 1.1\n[flow]", "must lie in .0, 1."),
    "flat box": ("[flow]", "[box]\nlower = [0, 0, 0]\nupper = [0, 1, 1]\n[flow]", "line 9: .box. .* 0 m"),
    "half a box": ("[flow]", "[box]\nlower = [0, 0, 0]\n[flow]", "line 7: .box. upper: missing"),
    "unknown format": ("packing =", "[packing]\nformat = 'cvs'\nfile =", "line 2: .packing. format: .* mean 'csv'"),
    "pressure out of range": ("1.0 }", "1e300 }", "line 5: .walls.y_min. pressure: a wall's pressure must be"),
    "missing packing": ("n25_s1.csv", "n26.csv", "line 1: packing: .*n26.csv does not exist"),
    "packing a directory": ("/n25_s1.csv", "", "packing: .* is not a file"),
    "packing not named": ("packing =", "# packing =", "packing: missing"),
    "packing without a file": ("[fluid]", "[packing]\nfile = 3\n[fluid]", "not TOML"),
    "vtk not a truth value": ("[output]", '[output]\nvtk = "yes"', "line 10: .output. vtk: expected true"),
    "directory not a text": ("[output]", "[output]\ndirectory = 3", "directory: expected a text in quotes"),
    "not TOML": ("[fluid]", "[fluid", "line 2: not TOML: .*\n    .fluid\n          \\^"),
}  # fmt: skip


@pytest.mark.parametrize("case", BAD)
def test_bad_scenes_are_refused_with_file_line_and_remedy(write_scene, case):
    old, new, message = BAD[case]
    path = write_scene(old, new)
    with pytest.raises(InputError, match=message) as error:
        FlowScene.read(path)
    assert str(path) in str(error.value)
    assert len(str(error.value).splitlines()) < 20


def test_several_errors_stand_in_the_order_of_their_lines(write_scene):
    path = write_scene('"auto"', '"dirct"\ntolerance = 2.0\nalpha = "a"')
    text = path.read_text().replace("viscosity = 1.0e-3", "viscosity = true\ndensity = []")
    path.write_text(text)
    with pytest.raises(InputError) as error:
        FlowScene.read(path)
    assert str(error.value).splitlines() == [
        f"{path}, line 3: [fluid] viscosity: expected a finite number, not True",
        f"{path}, line 4: [fluid] density: expected a finite number, not []",
        f"{path}, line 9: [flow] solver: unknown solver 'dirct'; did you mean 'direct'?",
        f"{path}, line 10: [flow] tolerance: must lie between 0 and 1 (a bound on the relative residual), not 2.0",
        f"{path}, line 11: [flow] alpha: expected a finite number, not 'a'",
    ]
    path.write_text(text.replace("pressure = 1.0", "slip = 1"))
    with pytest.raises(InputError, match=r"\[walls.y_min\] slip: (.|\n)*\.\.\. and 1 more$"):
        FlowScene.read(path)


def test_long_values_are_cut_in_errors(write_scene):
    with pytest.raises(InputError, match=r"not 10{79}\.\.\.$"):
        FlowScene.read(write_scene("1.0e-3", "1" + 400 * "0"))


def test_flow_without_any_pressure_wall_is_refused(write_scene):
    path = write_scene("y_min = { pressure = 1.0 }\ny_max = { pressure = 0.0 }", "")
    with pytest.raises(InputError, match="no wall has a pressure, and permeability cannot"):
        FlowScene.read(path)


def test_pressure_needs_only_one_pressure_wall(write_scene):
    path = write_scene("y_max = { pressure = 0.0 }", "")
    path.write_text(path.read_text().replace("permeability", "pressure"))
    assert np.ptp(FlowScene.read(path).pore_flow().pressure) == 0.0


def test_scene_that_cannot_be_read_is_refused(tmp_path):
    with pytest.raises(InputError, match="cannot read the scene .*missing.toml"):
        FlowScene.read(tmp_path / "missing.toml")
    with pytest.raises(InputError, match="cannot read the scene"):
        FlowScene.read(tmp_path)
    (tmp_path / "binary.toml").write_bytes(b"\xff\xfe\x00")
    with pytest.raises(InputError, match="not a text file in UTF-8"):
        FlowScene.read(tmp_path / "binary.toml")


def test_packing_without_box_tells_how_to_give_one(tmp_path):
    (tmp_path / "bare.csv").write_text("x,y,z,radius\n0.5,0.5,0.5,0.4\n")
    scene = FlowScene.from_mapping(mapping(packing="bare.csv"), directory=tmp_path)
    with pytest.raises(
        InputError, match=r"(?s)bare.csv holds no box.*\[box\]\nlower = \[0.1, 0.1, 0.1\]\nupper = \[0.9, "
    ):
        scene.check()


def test_packing_that_does_not_fit_is_refused_before_anything_is_written(tmp_path):
    tables = {"box": {"lower": [0, 0, 0], "upper": [0.5, 1, 1]}, "output": output(tmp_path, "permeability")}
    scene = FlowScene.from_mapping(mapping(**tables), DATA / "packings")
    with pytest.raises(InputError, match="centre not inside the box"):
        scene.solve()
    assert list(tmp_path.iterdir()) == []


def test_failed_computation_leaves_nothing_behind(tmp_path, monkeypatch):
    from porefv.flow.pore_flow import PoreFlow

    def fail(self):
        raise ComputationError("the solver failed")

    monkeypatch.setattr(PoreFlow, "solution", property(fail))
    scene = FlowScene.from_mapping(mapping(output=output(tmp_path, "permeability")), DATA / "packings")
    with pytest.raises(ComputationError):
        scene.solve()
    assert list(tmp_path.iterdir()) == []


def test_lines_of_keys_are_found_in_any_spelling():
    text = 'a = 1\n[t]\n"b" = 2\nc = { d = 1 }\n[t.e]\nf = 3\n[g]\nh.i = 4\n'
    assert line_of(text, "", "a") == 1
    assert line_of(text, "t", "b") == 3
    assert line_of(text, "t.c", "d") == 4
    assert line_of(text, "t.e", "f") == 6
    assert line_of(text, "t", "e") == 5
    assert line_of(text, "g.h", "i") == 8
    assert line_of(text, "", "nowhere") is None


@pytest.mark.parametrize(
    ("output", "message"),
    [
        ({"quantities": ["tortuosity"]}, "tortuosity needs exactly two pressure walls"),
        ({"quantities": ["profile"]}, "profile needs an axis"),
        ({"quantities": ["planes"]}, "planes needs an axis"),
        ({"quantities": ["diffusion"]}, "diffusion needs an axis"),
        ({"layers": 0}, "layers: expected a whole number, 1 or more"),
        ({"axis": "w"}, "axis"),
        ({"planes": 0.5}, "planes: expected a list of finite numbers"),
    ],
)
def test_quantities_of_the_sample_need_an_axis_and_sound_keys(output, message):
    walls = {"y_min": {"pressure": 1.0}, "x_max": {"pressure": 0.0}}
    with pytest.raises(InputError, match=message):
        FlowScene.from_mapping(
            mapping(walls=walls, output={"quantities": ["pressure"]} | output), directory=DATA / "packings"
        )


def test_check_finds_planes_outside_the_box(tmp_path):
    output = {"directory": str(tmp_path / "results"), "quantities": ["planes"], "planes": [2.0]}
    scene = FlowScene.from_mapping(mapping(output=output), directory=DATA / "packings")
    with pytest.raises(InputError, match="planes must lie inside the box, between 0 and 1 m along y: 2 m does not"):
        scene.check()
