"""Tables that notebooks show: of packings, meshes, flows, forces and results."""

import re

import pytest

from porefv import results
from porefv.flow.pore_flow import PoreFlow
from porefv.flow.walls import Walls
from porefv.packing.packing import Packing
from porefv.system.html_table import html_table, range_text

formatters = pytest.importorskip("IPython.core.formatters")


def table(thing):
    """The rows of the table that a notebook shows."""
    shown = formatters.HTMLFormatter()(thing)
    assert shown.startswith("<table>") and shown.endswith("</table>")
    return dict(re.findall(r"<th[^>]*>([^<]*)</th><td[^>]*>([^<]*)</td>", shown))


@pytest.fixture
def flow(mesh_of):
    return PoreFlow(mesh_of("n25_s1"), Walls.along("y"))


def test_a_packing_shows_spheres_radii_box_and_file(reference):
    rows = table(reference("n25_s1"))
    assert rows["spheres"] == "25" and rows["radii"] == "0.111 to 0.2078 m" and rows["sides"] == "1×1×1 m"
    assert rows["file"].endswith("n25_s1.csv")
    assert table(Packing([[0.0, 0.0, 0.0]], [1.0])) == {"spheres": "1", "radii": "1 m", "box": "none"}


def test_a_mesh_shows_pores_and_throats(mesh_of):
    rows = table(mesh_of("n25_s1"))
    assert rows["throats"].startswith("240") and rows["pores"] == "122, of 122 cells"


def test_showing_a_flow_computes_nothing(flow):
    before = set(vars(flow))
    rows = table(flow)
    assert set(vars(flow)) == before
    assert "permeability" not in rows and rows["y_min"].startswith("1 Pa")
    _ = flow.permeability, flow.forces
    rows = table(flow)
    assert rows["permeability"].startswith(f"{flow.permeability:.3g}"[:4]) and "force on all spheres" in rows


def test_forces_show_their_sums(flow):
    rows = table(flow.forces)
    assert set(rows) >= {"pressure", "viscous", "buoyancy", "total", "wall, total", "residual"}


def test_results_show_their_files(flow, tmp_path):
    rows = table(results.read(results.write(flow, tmp_path / "results")))
    assert rows["spheres"] == "25" and "summary.json" in rows["files"] and "permeability" in rows


def test_texts_are_escaped():
    assert "<script>" not in html_table("<script>", [("<script>", "<script>")])


def test_a_range_of_one_value_is_that_value():
    assert range_text([2.0, 2.0], "m") == "2 m"
