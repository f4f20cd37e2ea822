"""Scenes of imposed flows, regions and permeabilities along all axes."""

from pathlib import Path

import pytest

from porefv import cli, results
from porefv.errors import InputError
from porefv.flow.directional_permeabilities import directional_permeabilities
from porefv.flow.inside import FixedPressure, FlowSource
from porefv.flow.pore_flow import PoreFlow
from porefv.flow.regions import Point, Sphere
from porefv.flow.walls import Wall, Walls
from porefv.mesh.pore_mesh import PoreMesh
from porefv.packing.box import Box
from porefv.packing.packing import Packing
from porefv.scenes.flow_scene import FlowScene

PACKING = (Path(__file__).parents[2] / "data" / "packings" / "n25_s1.csv").as_posix()
REGIONS = """\
[[sources]]
point = [0.5, 0.5, 0.5]
flow = 1e-3
[[sources]]
sphere = { centre = [0.5, 0.5, 0.5], radius = 0.3 }
flow = -2e-3
[[pressures]]
box = { lower = [0.0, 0.3, 0.0], upper = [0.5, 0.6, 0.5] }
pressure = 1e-3
"""


@pytest.fixture
def write_scene(tmp_path):
    """Write a scene with these walls, regions and quantities, and give its path."""

    def write(y_min="{ inflow = 1e-3 }", y_max="{ pressure = 0.0 }", more="", quantities='["pressure", "forces"]'):
        path = tmp_path / "scene.toml"
        path.write_text(
            f'packing = "{PACKING}"\n[walls]\ny_min = {y_min}\ny_max = {y_max}\n{more}\n'
            f"[output]\nquantities = {quantities}\n",
            encoding="utf-8",
        )
        return path

    return write


def test_a_scene_is_the_flow_of_the_same_objects_in_python(write_scene):
    scene = FlowScene.read(write_scene("{ inflow = 1e-3 }", "{ velocity = 2e-3, slip = true }", REGIONS))
    flow = PoreFlow(
        Packing.read(PACKING), Walls(y_min=Wall(inflow=1e-3), y_max=Wall(velocity=2e-3, slip=True)),
        sources=[FlowSource(Point([0.5, 0.5, 0.5]), 1e-3), FlowSource(Sphere([0.5, 0.5, 0.5], 0.3), -2e-3)],
        fixed_pressures=[FixedPressure(Box([0.0, 0.3, 0.0], [0.5, 0.6, 0.5]), 1e-3)],
    )  # fmt: skip
    found = scene.pore_flow()
    assert (found.pressure == flow.pressure).all() and found.wall_flux == flow.wall_flux


def test_the_pressures_found_and_the_flows_of_regions_are_written_and_shown(write_scene, capsys):
    scene = write_scene(more=REGIONS)
    assert cli.main(["check", str(scene)]) == 0
    printed = capsys.readouterr().out
    assert "y_min: 0.001 m³/s" in printed and "0.001 m³/s in the point 0.5, 0.5, 0.5" in printed
    assert cli.main(["solve", str(scene), "--quiet"]) == 0
    summary = results.read(scene.parent / "results").summary
    flow = FlowScene.read(scene).pore_flow()
    assert summary["flow"]["wall_pressure"] == flow.wall_pressure
    assert summary["walls"]["y_min"] == {"pressure": None, "slip": False, "inflow": 1e-3}
    assert summary["pressures"][0]["flow"] == flow.fixed_pressure_flux[0]
    assert [source["flow"] for source in summary["sources"]] == [1e-3, -2e-3]
    assert cli.main(["info", str(scene.parent / "results")]) == 0
    printed = capsys.readouterr().out
    assert f"y_min {flow.wall_pressure['y_min']:.6g}, y_max 0 Pa" in printed
    assert f"flow {flow.fixed_pressure_flux[0]:.6g} m³/s" in printed


def test_results_of_an_imposed_flow_can_be_drawn(write_scene, tmp_path):
    scene = write_scene(y_max="{ inflow = -1e-3 }", quantities='["permeability", "pressure", "forces"]\nvtk = true')
    assert cli.main(["solve", str(scene), "--quiet"]) == 0
    assert cli.main(["plot", str(scene.parent / "results"), "--out", str(tmp_path / "flow.png")]) == 0
    assert (tmp_path / "flow.png").stat().st_size > 10_000


@pytest.mark.parametrize("slip", [False, True])
def test_permeabilities_need_no_wall_that_drives(tmp_path, slip, capsys):
    scene = tmp_path / "scene.toml"
    scene.write_text(
        f'packing = "{PACKING}"\n[walls]\nlateral = {{ slip = {str(slip).lower()} }}\n'
        '[output]\nquantities = ["permeabilities"]\n'
    )
    assert cli.main(["solve", str(scene)]) == 0
    found = directional_permeabilities(PoreMesh(Packing.read(PACKING)), slip=slip)
    assert f"permeabilities x {found.x:.6g}, y {found.y:.6g}, z {found.z:.6g} m²" in capsys.readouterr().out
    summary = results.read(tmp_path / "results").summary
    assert summary["permeabilities"] == {"x": found.x, "y": found.y, "z": found.z, "slip": slip}
    assert "flow" not in summary
    assert cli.main(["info", str(tmp_path / "results")]) == 0
    assert f"{found.z:.6g} m²" in capsys.readouterr().out


def test_results_are_written_from_python_with_the_permeabilities_if_asked_for(tmp_path):
    flow = PoreFlow(Packing.read(PACKING), Walls.along("y", slip=True))
    results.write(flow, tmp_path / "plain", vtk=False)
    assert "permeabilities" not in results.read(tmp_path / "plain").summary
    results.write(flow, tmp_path / "axes", vtk=False, quantities=["permeability", "permeabilities"])
    summary = results.read(tmp_path / "axes").summary
    assert summary["permeabilities"]["y"] == summary["permeability"]


BAD = {
    "two of them": ({"y_min": "{ inflow = 1.0, pressure = 1.0 }"}, "line 3: .walls.y_min. inflow and pressure exclude"),
    "flow and velocity": ({"y_min": "{ inflow = 1.0, velocity = 1.0 }"}, "line 3: .* exclude each other"),
    "not a number": ({"y_min": "{ inflow = true }"}, "line 3: .walls.y_min. inflow: expected a finite number"),
    "flow of lateral walls": ({"more": "lateral = { inflow = 1.0 }"}, "line 5: .walls.lateral. inflow: .* by wall"),
    "point and box": (
        {"more": "[[sources]]\npoint = [0, 0, 0]\nsphere = { centre = [0, 0, 0], radius = 1.0 }\nflow = 1.0"},
        "line 7: .sources 1. .*point and sphere exclude each other",
    ),
    "no place": ({"more": "[[sources]]\nflow = 1.0"}, "line 5: .sources 1. .*one of point, box and sphere"),
    "no flow": ({"more": "[[sources]]\npoint = [0, 0, 0]"}, "line 5: .sources 1. flow: missing"),
    "no pressure": ({"more": "[[pressures]]\npoint = [0, 0, 0]"}, "line 5: .pressures 1. pressure: missing"),
    "no list": ({"more": "[pressures]\npoint = [0, 0, 0]"}, "line 5: pressures: expected a list of tables"),
    "flow out of range": (
        {"more": "[[sources]]\npoint = [0, 0, 0]\nflow = 1e300"}, "line 7: .sources 1. .*a source's flow must be 0 or"
    ),
    "negative radius": (
        {"more": "[[sources]]\nflow = 1.0\nsphere = { centre = [0, 0, 0], radius = -1.0 }"}, "line 7: .* positive"
    ),
    "permeability with a source": (
        {"more": REGIONS, "quantities": '["permeability"]'}, "permeability is that between two walls, without"
    ),
    "permeability of one wall": (
        {"y_max": "{ slip = true }", "quantities": '["permeability"]'}, "exactly two pressure walls.*y_min at 0.001"
    ),
    "different slips": (
        {"y_max": "{ slip = true }", "quantities": '["permeabilities"]'}, "line 2: walls: .*the same slip"
    ),
}  # fmt: skip


@pytest.mark.parametrize("case", BAD)
def test_bad_scenes_are_refused_with_line_and_remedy(write_scene, case):
    parts, said = BAD[case]
    with pytest.raises(InputError, match=said):
        FlowScene.read(write_scene(**parts))


@pytest.mark.parametrize(
    ("parts", "said"),
    [
        ({"y_max": "{ inflow = -2e-3 }"}, "scene.toml: only flows are imposed, and their sum is -0.001 m³/s"),
        ({"y_max": "{ slip = false }"}, "only flows are imposed, and their sum is 0.001"),
        ({"more": "[[sources]]\npoint = [2, 0, 0]\nflow = 1.0"}, "scene.toml: the point 2, 0, 0 lies outside the box"),
    ],
)
def test_contradictions_are_found_by_check_and_before_anything_is_computed(write_scene, monkeypatch, parts, said):
    monkeypatch.setattr(PoreMesh, "triangulation", property(lambda self: pytest.fail("triangulated")))
    scene = FlowScene.read(write_scene(**parts))
    for refuses in (scene.check, scene.solve):
        with pytest.raises(InputError, match=said):
            refuses()
    assert not (scene.output.directory).exists()


def test_flows_that_cannot_be_compared_are_refused(write_scene, capsys):
    assert cli.main(["trade", str(write_scene())]) == 2
    assert "only flows that pressures of walls drive" in capsys.readouterr().err


@pytest.mark.parametrize("key", ["velocity", "inflow"])
def test_an_imposed_flow_of_zero_has_no_permeability_and_the_wall_is_named(write_scene, key):
    with pytest.raises(InputError, match=r"scene.toml, line 3: .*the flow imposed on y_min is zero: nothing flows"):
        FlowScene.read(write_scene(f"{{ {key} = 0.0 }}", quantities='["permeability"]'))
    FlowScene.read(write_scene(f"{{ {key} = 0.0 }}", quantities='["pressure"]'))


def test_check_finds_a_region_without_pores(write_scene, capsys):
    region = "[[sources]]\nsphere = { centre = [0.5, 0.5, 0.5], radius = 1e-9 }\nflow = 1e-3"
    assert cli.main(["check", str(write_scene(more=region))]) != 0
    assert "scene.toml: no pore has its Laguerre vertex in the sphere of radius 1e-09 m" in capsys.readouterr().err


def test_planes_outside_the_box_are_named_by_their_line(write_scene):
    path = write_scene()
    path.write_text(path.read_text() + 'axis = "y"\nplanes = [0.5, 2.0]\n')
    path.write_text(path.read_text().replace('"forces"', '"planes"'))
    with pytest.raises(InputError, match=r"scene.toml, line 9: \[output\] planes must lie inside the box"):
        FlowScene.read(path).check()
