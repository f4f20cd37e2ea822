from pathlib import Path

import numpy as np
import pytest

from porefv import results
from porefv.errors import ComputationError, InputError
from porefv.export import pictures
from porefv.flow.pore_flow import PoreFlow
from porefv.flow.walls import Wall, Walls
from porefv.packing.box import Box
from porefv.packing.packing import Packing

pyvista = pytest.importorskip("pyvista")
PACKINGS = Path(__file__).parents[2] / "data" / "packings"
SMALL = (400, 300)


@pytest.fixture(scope="module")
def flow():
    return PoreFlow(Packing.read(PACKINGS / "n25_s1.csv"), Walls.along("y"))


@pytest.fixture(scope="module", autouse=True)
def machine_that_draws():
    try:
        pictures.load_pyvista()
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
    image = pictures.flow_picture(flow, size=SMALL).screenshot(return_img=True)
    assert image.shape[:2] == (300, 400)
    assert share_of(image, warm) > 0.05
    assert share_of(image, cool) > 0.02
    assert (image[:3] > 250).all() and (image[-3:] > 250).all()  # nothing is cut off above or below
    assert 0.2 < share_of(image, white) < 0.8


def test_picture_without_forces_has_grey_grains(flow):
    image = pictures.flow_picture(flow, forces=False, size=SMALL).screenshot(return_img=True)
    assert share_of(image, warm) < 0.01
    assert share_of(image, cool) > 0.02


def test_picture_does_not_depend_on_the_unit_of_length(flow):
    packing = flow.mesh.packing
    scale = 2.0**-20
    small = Packing(packing.centres * scale, packing.radii * scale, Box([0, 0, 0], [scale, scale, scale]))
    large, tiny = (
        pictures.flow_picture(PoreFlow(p, Walls.along("y")), forces=False, size=SMALL).screenshot(return_img=True)
        for p in (packing, small)
    )
    # Beyond the rounding of the graphics' single precision at outlines.
    differs = np.abs(large.astype(int) - tiny).max(axis=2) > 30
    assert differs.mean() < 0.01


@pytest.mark.parametrize("walls", [
    Walls.along("x"),
    Walls(z_min=Wall(pressure=0.0), z_max=Wall(pressure=1.0)),
    Walls(x_min=Wall(pressure=1.0), y_max=Wall(pressure=0.0)),
    Walls(x_min=Wall(pressure=3.0), x_max=Wall(pressure=3.0)),
], ids=["x", "z down", "around a corner", "at rest"])  # fmt: skip
def test_any_flow_of_a_single_sphere_can_be_drawn(walls):
    flow = PoreFlow(Packing([[0.4, 0.5, 1.0]], [0.3], Box([0, 0, 0], [1, 1, 2])), walls)
    image = pictures.flow_picture(flow, title="one", size=SMALL).screenshot(return_img=True)
    assert share_of(image, white) < 0.95


def test_results_are_drawn_at_full_size(flow, tmp_path):
    found = results.read(results.write(flow, tmp_path / "results"))
    results.draw(found, tmp_path / "flow.png")
    image = pyvista.read(tmp_path / "flow.png")
    assert image.dimensions == (1600, 1200, 1)


def test_pictures_that_cannot_be_made_are_refused(flow, tmp_path):
    found = results.read(results.write(flow, tmp_path / "results", vtk=False))
    with pytest.raises(InputError, match="set vtk = true"):
        results.draw(found, tmp_path / "flow.png")
    with pytest.raises(InputError, match="ends in .png"):
        results.draw(found, tmp_path / "flow.jpg")
    with pytest.raises(InputError, match="there is no directory"):
        results.draw(found, tmp_path / "missing" / "flow.png")
    assert not (tmp_path / "flow.png").exists()


def test_machine_without_any_renderer_is_told_what_to_install(monkeypatch):
    from vtkmodules import vtkRenderingCore

    class Window:
        def GetClassName(self):
            return "vtkOSOpenGLRenderWindow"

    monkeypatch.setattr(vtkRenderingCore, "vtkRenderWindow", Window)
    monkeypatch.setattr(pictures, "library_loads", lambda library: False)
    with pytest.raises(ComputationError, match="apt install libegl1"):
        pictures.ensure_drawing()
