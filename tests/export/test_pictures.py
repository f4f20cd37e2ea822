from importlib import import_module
from pathlib import Path

import numpy as np
import pytest

from porefv import results
from porefv.errors import ComputationError, InputError
from porefv.export import picture, rendering
from porefv.export.picture_style import Colours
from porefv.flow.fluid import Fluid
from porefv.flow.pore_flow import PoreFlow
from porefv.flow.walls import Wall, Walls
from porefv.mesh.pore_mesh import PoreMesh
from porefv.packing.box import Box
from porefv.packing.packing import Packing

pyvista = pytest.importorskip("pyvista")
PACKINGS = Path(__file__).parents[2] / "data" / "packings"
SMALL = {"size": (400, 300), "dpi": 50}
IN_3D = ("forces", "pressure", "network", "throats", "paths", "packing")


@pytest.fixture(scope="module")
def flow():
    return PoreFlow(Packing.read(PACKINGS / "n25_s1.csv"), Walls.along("y"))


@pytest.fixture(scope="module", autouse=True)
def machine_that_draws():
    try:
        rendering.load_pyvista()
    except ComputationError as error:
        pytest.skip(str(error))


def share_of(image, condition):
    red, green, blue = (image[..., channel].astype(int) for channel in range(3))
    return condition(red, green, blue).mean()


def warm(red, green, blue):
    """Colours of forces, orange to red; the yellow of high pressures is none."""
    return (red > blue + 60) & (red > green + 40)


def cool(red, green, blue):
    """Colours of middling pressures: blue to green, unlike the grey of grains and the yellow of forces."""
    return (blue > red + 40) & (green > red + 20)


def white(red, green, blue):
    return np.minimum(np.minimum(red, green), blue) > 250


def test_picture_shows_forces_and_pressures_on_white(flow):
    image = picture(flow, **SMALL).image()
    assert image.shape == (300, 400, 3)
    assert share_of(image, warm) > 0.05
    assert share_of(image, cool) > 0.02
    assert (image[:3] > 250).all() and (image[-3:] > 250).all()  # nothing is cut off above or below
    assert 0.2 < share_of(image, white) < 0.8


def test_picture_of_pressures_has_grey_grains(flow):
    image = picture(flow, "pressure", **SMALL).image()
    assert share_of(image, warm) < 0.01
    assert share_of(image, cool) > 0.02


@pytest.mark.parametrize("what", IN_3D)
def test_the_title_has_a_band_of_its_own(flow, what):
    plain = picture(flow, what, **SMALL).image()
    titled = picture(flow, what, title="x" * 60, **SMALL).image()
    changed = np.flatnonzero((plain != titled).any(axis=(1, 2)))
    assert len(changed) and (plain[changed, :310] > 250).all()  # where the title is, nothing else is
    assert (plain[:3] > 250).all()


@pytest.mark.parametrize("what", ["forces", "section", "network"])
def test_picture_does_not_depend_on_the_unit_of_length(flow, what):
    packing = flow.mesh.packing
    scale = 1e-6  # the bar of length is as long as in metres
    small = Packing(packing.centres * scale, packing.radii * scale, Box([0, 0, 0], [scale, scale, scale]))
    large, tiny = (picture(PoreFlow(p, Walls.along("y")), what, **SMALL).image()[:, :300] for p in (packing, small))
    # Beyond the rounding of the graphics' single precision at outlines, and the numbers.
    differs = np.abs(large.astype(int) - tiny).max(axis=2) > 30
    assert differs.mean() < 0.02


@pytest.mark.parametrize("walls", [
    Walls.along("x"),
    Walls(z_min=Wall(pressure=0.0), z_max=Wall(pressure=1.0)),
    Walls(x_min=Wall(pressure=1.0), y_max=Wall(pressure=0.0)),
    Walls(x_min=Wall(pressure=3.0), x_max=Wall(pressure=3.0)),
], ids=["x", "z down", "around a corner", "at rest"])  # fmt: skip
@pytest.mark.parametrize("what", ["forces", "section"])
def test_any_flow_of_a_single_sphere_can_be_drawn(walls, what):
    flow = PoreFlow(Packing([[0.4, 0.5, 1.0]], [0.3], Box([0, 0, 0], [1, 1, 2])), walls)
    image = picture(flow, what, title="one", **SMALL).image()
    assert share_of(image, white) < 0.95


@pytest.mark.parametrize("what", ["network", "throats"])
def test_a_network_without_flow_is_refused_and_not_drawn_empty(what):
    walls = Walls(x_min=Wall(pressure=3.0), x_max=Wall(pressure=3.0))
    flow = PoreFlow(Packing([[0.4, 0.5, 1.0]], [0.3], Box([0, 0, 0], [1, 1, 2])), walls)
    with pytest.raises(InputError, match="nothing flows through any of 12 throats"):
        picture(flow, what, **SMALL)


def test_a_network_without_open_throats_says_why():
    # Four spheres of such size that their discs cover every facet.
    packing = Packing([[0.5, 0.5, 0.5]], [0.71], Box([0, 0, 0], [1, 1, 1]))
    mesh = PoreMesh(packing, wall_tolerance=1.0)
    assert mesh.throats.closed.all()
    with pytest.raises(InputError, match="of 12 throats none is open"):
        mesh.plot("network", **SMALL)


def test_paths_are_those_of_a_flow(flow):
    assert "200 paths of particles, sampled by flux" in picture(flow, "paths", **SMALL).notes
    with pytest.raises(InputError, match="needs the paths of a flow"):
        flow.mesh.plot("paths", **SMALL)
    walls = Walls(x_min=Wall(pressure=3.0), x_max=Wall(pressure=3.0))
    with pytest.raises(InputError, match="flow"):
        PoreFlow(flow.mesh, walls).plot("paths", **SMALL)


def test_what_is_left_out_is_said(flow):
    found = picture(flow, "network", **SMALL)
    still = int(np.count_nonzero(flow.flux == 0.0))
    assert any(note.startswith(f"{still} of {len(flow.mesh.throats)} throats left out") for note in found.notes)


def test_a_mesh_and_a_packing_are_drawn_without_a_flow(flow):
    assert "no flux" in flow.mesh.plot("network", **SMALL).notes[-1]
    assert picture(flow.mesh.packing, **SMALL).image().min() < 200
    for sample in (flow.mesh, flow.mesh.packing):
        with pytest.raises(InputError, match="needs the force of a flow"):
            picture(sample, "forces", **SMALL)


def test_a_grain_is_drawn_to_the_scale_of_the_bar():
    """The projection is parallel: a sphere is a disc whose width is that of its diameter on an axis across."""
    packing = Packing([[0.5, 0.5, 0.5]], [0.25], Box([0, 0, 0], [1, 1, 1]))
    image = picture(packing, size=(1600, 1200)).image()
    grain = image.astype(int).max(axis=2) < 235
    columns = np.flatnonzero(grain.sum(axis=0) > 60)
    rows = np.flatnonzero(grain.sum(axis=1) > 60)
    assert len(columns) / len(rows) == pytest.approx(1.0, abs=0.05)


@pytest.mark.parametrize("sides", [(1, 1, 10), (10, 1, 1), (1, 10, 10), (1, 1, 1)])
def test_sections_are_to_scale_and_ticks_have_room(sides):
    box = Box([0, 0, 0], sides)
    packing = Packing([[0.5, 0.5, 0.5]], [0.4], box)
    for axis, (across, up) in zip("xyz", ((1, 2), (0, 2), (0, 1)), strict=True):
        axes = picture(packing, "section", axis=axis).figure.axes[0]
        size = axes.get_position().size * axes.figure.get_size_inches()
        assert size[1] / size[0] == pytest.approx(sides[up] / sides[across])
        for length, ticks in zip(size, (axes.get_xticks(), axes.get_yticks()), strict=True):
            assert len(ticks) <= max(3, length / 0.35)


def test_a_scale_of_speeds_is_pointed_if_a_few_are_much_higher():
    speeds = np.append(np.linspace(0.0, 1.0, 1000), 9.0)
    scale = Colours.of_speeds("speed", speeds)
    assert scale.beyond and scale.high / scale.unit.factor < 1.0
    assert not Colours.of_speeds("speed", speeds[:-1]).beyond
    assert np.array_equal(scale.of(speeds)[-1], scale.of(speeds)[-2])


def test_files_have_the_format_of_their_name(flow, tmp_path):
    section = flow.plot("section", **SMALL)
    for name, begin in (("a.png", b"\x89PNG"), ("a.svg", b"<?xml"), ("a.pdf", b"%PDF")):
        section.save(tmp_path / name)
        assert (tmp_path / name).read_bytes().startswith(begin)
    with pytest.raises(InputError, match=r"ends in \.png or \.svg or \.pdf"):
        section.save(tmp_path / "a.html")
    with pytest.raises(InputError, match=r"ends in \.png or \.html"):
        flow.plot(**SMALL).save(tmp_path / "a.svg")


def test_the_same_picture_is_the_same_file(flow, tmp_path):
    for name in ("a.svg", "a.pdf", "a.png"):
        texts = []
        for _ in range(2):
            flow.plot("section", **SMALL).save(tmp_path / name)
            texts.append((tmp_path / name).read_bytes())
        assert texts[0] == texts[1]


def test_html_holds_the_scene_and_the_scale_of_colours(flow, tmp_path):
    pytest.importorskip("trame_pyvista")
    flow.plot(title="A & B", **SMALL).save(tmp_path / "a.html")
    text = (tmp_path / "a.html").read_text(encoding="utf-8")
    assert "force on a grain" in text and "<title>A &amp; B</title>" in text and text.rstrip().endswith("</html>")
    # The viewer replaces what is in the element of this class; without one, in the body, and the scales with it.
    assert text.index('<div class="content">') < text.index("OfflineLocalView.load") < text.index('class="porefv"')


def test_a_notebook_shows_the_picture(flow):
    formatters = pytest.importorskip("IPython.core.formatters")
    shown = formatters.PNGFormatter()(flow.plot("section", **SMALL))
    assert shown.startswith(b"\x89PNG")
    assert repr(flow.plot("section", **SMALL)) == "Picture(400 x 300 pixels)"


@pytest.mark.parametrize(("options", "said"), [
    ({"what": "vortices"}, "there is no picture 'vortices'"),
    ({"axis": "x"}, "axis and at are those of a plane"),
    ({"what": "section", "at": 1.5}, "between 0 and 1 m, not at 1.5 m"),
    ({"what": "section", "axis": "w"}, "must be x, y or z"),
    ({"size": (10, 300)}, "100 to 10 000 pixels"),
    ({"size": 800}, "a size is a width and a height"),
    ({"size": "800x600"}, "a size is a width and a height"),
    ({"size": (800.5, 600)}, "whole numbers of pixels"),
    ({"dpi": 0}, "30 to 1200 pixels per inch"),
    ({"dpi": "high"}, "a number of pixels per inch"),
    ({"what": "section", "at": "top"}, "a number of metres, not 'top'"),
    ({"size": (400, 300)}, r"2 x 1.5 inches; the letters need 3.5 x 2.5"),
])  # fmt: skip
def test_what_cannot_be_drawn_is_refused(flow, options, said):
    with pytest.raises(InputError, match=said):
        picture(flow, **options)


def test_results_are_drawn_at_full_size(flow, tmp_path):
    found = results.read(results.write(flow, tmp_path / "results"))
    results.draw(found, tmp_path / "flow.png")
    image = pyvista.read(tmp_path / "flow.png")
    assert image.dimensions == (1600, 1200, 1)


@pytest.mark.parametrize("what", [what for what in (*IN_3D, "section", "velocity") if what != "paths"])
def test_results_and_the_flow_have_the_same_picture(flow, tmp_path, what):
    flow = PoreFlow(flow.mesh, flow.walls, Fluid(viscosity=2.0))
    found = results.read(results.write(flow, tmp_path / "results"))
    of_results = results.draw(found, tmp_path / "a.png", what, **SMALL)
    of_flow = picture(flow, what, title=f"25 spheres,  k = {flow.permeability:.4g} m²", **SMALL)
    assert of_results.notes == of_flow.notes
    assert (np.abs(of_results.image().astype(int) - of_flow.image()) > 8).mean() < 1e-3


def test_pictures_that_cannot_be_made_are_refused(flow, tmp_path):
    found = results.read(results.write(flow, tmp_path / "results", vtk=False))
    with pytest.raises(InputError, match="set vtk = true"):
        results.draw(found, tmp_path / "flow.png")
    found = results.read(results.write(flow, tmp_path / "more", quantities=["permeability"]))
    with pytest.raises(InputError, match='add "forces" to the quantities'):
        results.draw(found, tmp_path / "flow.png", "forces")
    with pytest.raises(InputError, match=r"ends in \.png"):
        results.draw(found, tmp_path / "flow.jpg")
    with pytest.raises(InputError, match="there is no directory"):
        results.draw(found, tmp_path / "missing" / "flow.png")
    assert not (tmp_path / "flow.png").exists()


def test_machine_without_any_renderer_is_told_what_to_install(monkeypatch):
    # Not `from vtkmodules import`: trame-vtk puts other modules there.
    core = import_module("vtkmodules.vtkRenderingCore")

    class Window:
        def GetClassName(self):
            return "vtkOSOpenGLRenderWindow"

    monkeypatch.setattr(core, "vtkRenderWindow", Window)
    monkeypatch.setattr(rendering, "library_loads", lambda library: False)
    with pytest.raises(ComputationError, match="apt install libegl1"):
        rendering.ensure_drawing()
