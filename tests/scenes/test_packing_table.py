"""The table [packing]: the same keys, with the same effect, in scenes of flow and of simulations."""

import re

import numpy as np
import pytest

from porefv.errors import InputError
from porefv.scenes.flow_scene import FlowScene
from porefv.scenes.simulation_scene import SimulationScene

BOX = {"lower": [0.0, 0.0, 0.0], "upper": [1.0, 1.0, 1.0]}
ROWS = "e,n,h,size\n300,300,300,400\n700,600,500,300\n"
COLUMNS = {"x": "e", "y": "n", "z": "h", "diameter": "size"}
DUMP = """ITEM: TIMESTEP
{0}
ITEM: NUMBER OF ATOMS
1
ITEM: BOX BOUNDS pp ff ff
0 1
0 1
0 1
ITEM: ATOMS id x y z radius
1 0.5 0.5 0.5 0.{0}
"""


def flow_scene(packing, folder, **tables):
    walls = {"y_min": {"pressure": 1.0}, "y_max": {"pressure": 0.0}}
    return FlowScene.from_mapping({"packing": packing, "walls": walls, **tables}, folder).read_packing()


def simulation_scene(packing, folder, **tables):
    scene = SimulationScene.from_mapping({"packing": packing, "stages": [{"duration": 0.1}], **tables}, folder)
    packing = scene.read_packing()
    np.testing.assert_array_equal(scene.grains().positions, packing.centres)
    return packing


KINDS = pytest.mark.parametrize("read", [flow_scene, simulation_scene], ids=["flow", "simulation"])


@KINDS
def test_columns_and_scale_are_those_of_packing_read(tmp_path, read):
    (tmp_path / "a.csv").write_text(ROWS)
    packing = read({"file": "a.csv", "columns": COLUMNS, "scale": 1e-3}, tmp_path, box=BOX)
    np.testing.assert_allclose(packing.centres, [[0.3, 0.3, 0.3], [0.7, 0.6, 0.5]], rtol=1e-15)
    np.testing.assert_allclose(packing.radii, [0.2, 0.15], rtol=1e-15)
    assert packing.reading.columns["radius"] == "size (halved)" and packing.reading.box == "given"


@KINDS
def test_radius_frame_and_periodic_are_those_of_packing_read(tmp_path, read):
    (tmp_path / "a.txt").write_text("0.3 0.3 0.3\n0.7 0.7 0.7\n")
    assert read({"file": "a.txt", "radius": 0.1}, tmp_path, box=BOX).radii[0] == 0.1
    (tmp_path / "a.dump").write_text("".join(map(DUMP.format, (1, 2, 3))))
    for frame, radius in ((0, 0.1), (1, 0.2), (-1, 0.3)):
        packing = read({"file": "a.dump", "frame": frame, "periodic": "ignore"}, tmp_path)
        assert packing.radii[0] == radius
    with pytest.raises(InputError, match="periodic along x"):
        read("a.dump", tmp_path)


@KINDS
@pytest.mark.parametrize(
    ("keys", "said"),
    [
        ({"columns": {"radius": "r", "diameter": "d"}}, "radius and diameter exclude each other"),
        ({"columns": {"w": "x"}}, "unknown column 'w'"),
        ({"columns": {"x": 1}}, "[packing.columns] x"),
        ({"radius": 0.0}, "[packing] radius: must be a positive number"),
        ({"scale": -1.0}, "[packing] scale: must be a positive number"),
        ({"frame": 0.5}, "[packing] frame: expected a whole number such as 0 or -1"),
        ({"periodic": "yes"}, "[packing] periodic"),
        ({"format": "stl"}, "[packing] format"),
    ],
)
def test_impossible_keys_are_refused_by_name(tmp_path, read, keys, said):
    (tmp_path / "a.csv").write_text(ROWS)
    with pytest.raises(InputError) as caught:
        read({"file": "a.csv", **keys}, tmp_path, box=BOX)
    assert said in str(caught.value)


@KINDS
def test_a_file_without_box_proposes_one_that_can_be_pasted(tmp_path, read):
    import tomllib

    (tmp_path / "a.csv").write_text("x,y,z,r\n-0.123456789,1e-3,500,0.1\n1,2,501,0.25\n")
    with pytest.raises(InputError, match="a.csv holds no box") as caught:
        read("a.csv", tmp_path)
    proposed = tomllib.loads(re.search(r"\[box\].*", str(caught.value), re.DOTALL)[0])
    packing = read("a.csv", tmp_path, **proposed)
    assert packing.validate() is packing
    assert packing.overlaps.wall_depths.max(initial=0.0) <= 1e-12
    np.testing.assert_allclose(packing.box.lower, [-0.223456789, -0.099, 499.9], atol=2e-5)
