import re
from functools import partial

import numpy as np
import pytest

from porefv.errors import InputError
from porefv.packing.box import Box
from porefv.packing.packing import Packing


@pytest.fixture
def read(read):
    """Read a Yade text file with this content."""
    return partial(read, name="grains.txt")


@pytest.mark.parametrize(
    "content",
    [
        "1 2 3 4\n5 6 7 8\n",
        "#format x_y_z_r\n1\t2\t3\t4\n5\t6\t7\t8\n",
        "#format x_y_z_r_matId\n1 2 3 4 0\n5 6 7 8 0\n",
        "x y z r\n1 2 3 4\n5 6 7 8\n",
        "x,y,z,radius\n1,2,3,4\n5,6,7,8\n",
        "#format id_x_y_z_r\n0 1 2 3 4\n1 5 6 7 8\n",
        "#format x_y_z_r_attrs\n1 2 3 4 sand 0.1\n5 6 7 8 silt 0.2\n",
        "# by hand\n  1 2   3 4\n\n# more\n5 6 7 8",
    ],
)
def test_accepted_forms(read, content):
    packing = read(content)
    np.testing.assert_array_equal(packing.centres, [[1, 2, 3], [5, 6, 7]])
    np.testing.assert_array_equal(packing.radii, [4, 8])


def test_what_is_written_is_what_yade_reads(tmp_path):
    packing = Packing([[0.1, 1 / 3, 0.5]], [0.1], Box([0, 0, 0], [1, 1, 1]))
    packing.write(tmp_path / "grains.txt")
    lines = (tmp_path / "grains.txt").read_text().splitlines()
    # Yade's reader takes the format from the first line and fails on blank lines.
    assert lines[0] == "#format x_y_z_r" and all(lines)
    assert lines[-1].split() == ["0.1", repr(1 / 3), "0.5", "0.1"]
    assert Packing.read(tmp_path / "grains.txt").box.volume == 1


@pytest.mark.parametrize(
    ("content", "said"),
    [
        ("1 2 3 4\n5 6 seven 8\n", "line 2: z is 'seven', not a number"),
        ("1 2 3 4\n\n5 6 7\n", "line 3: 3 cells instead of 4"),
        ("1 2 3 4 5\n", "line 1: 5 columns without names are neither clearly"),
        ("1 2 3 4 5 6\n", "line 1: 6 columns without names"),
        ("# c\n1 2 3 4\n5 6 7 0\n", r"line 3 \(sphere 1\): radius 0"),
        ("1 2 nan 4\n", r"line 1 \(sphere 0\)"),
        ("#format x_y_z\n1 2 3\n", "line 1: the format 'x_y_z' lacks"),
        ("# nothing\n", "only comments"),
    ],
)
def test_a_bad_file_is_refused_by_its_line(read, content, said):
    with pytest.raises(InputError) as caught:
        read(content)
    assert re.search(said, str(caught.value).split("grains.txt", 1)[1])
