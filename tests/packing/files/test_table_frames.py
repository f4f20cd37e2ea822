"""Tables of several frames: names of columns, and blocks of rows."""

import numpy as np
import pytest

from porefv.errors import InputError


@pytest.mark.parametrize(
    "name",
    [
        "time_ms", "time/s", "time / s", "t_s", "time in s", "time.s", "timestamp", "current_time", "tstep", "iter",
        "cycle", "snapshot", "dump", "output", "elapsed", "frame_idx", "frame #", "run", "frame_time", "Sim Time (s)",
        "TIME=", "time_sec", '"time"',
    ],
)  # fmt: skip
def test_names_of_columns_of_frames(read, name):
    content = f"{name},x,y,z,radius\n0,1,2,3,1\n1,2,2,3,1\n"
    with pytest.raises(InputError, match="has 2 values .* Give frame, 0 to 1"):
        read(content)
    np.testing.assert_array_equal(read(content, frame=0).centres, [[1, 2, 3]])


@pytest.mark.parametrize("name", ["particle", "particle_number", "Particle No", "grain id", "index"])
def test_names_of_columns_of_ids(read, name):
    with pytest.raises(InputError, match="line 3: .* stands on line 2 already. Does the table hold several frames"):
        read(f"{name},x,y,z,radius\n7,1,2,3,1\n7,2,2,3,1\n")


def test_kinds_of_particles_are_no_ids(read):
    assert len(read("particle,x,y,z,radius\nglass,1,2,3,1\nglass,2,2,3,1\n")) == 2


@pytest.mark.parametrize(
    ("content", "line"),
    [
        ("# t = 0\n# x y z r\n1 2 3 4\n# t = 1\n# x y z r\n1 2 3 5\n1 2 3 6\n", 4),
        ("# x y z r\n1 2 3 4\n1 2 3 5\n# x y z r\n1 2 3 6\n1 2 3 7\n", 4),
        ("# x y z r\n1 2 3 4\n1 2 3 5\n\n\n1 2 3 6\n1 2 3 7\n", 5),
        ("# x y z r\n1 2 3 4\n1 2 3 5\n\n1 2 3 6\n1 2 3 7\n", 4),
        ("1 2 3 4\n1 2 3 5\n#time 1\n1 2 3 6\n1 2 3 7\n", 3),
    ],
)
def test_blocks_of_rows_are_refused(read, content, line):
    with pytest.raises(
        InputError, match=rf"line {line}: .* stands between spheres. Does the table hold several frames"
    ):
        read(content)


def test_rows_with_a_blank_line_each_and_single_comments_are_one_packing(read):
    assert len(read("x y z r\n\n1 2 3 4\n\n1 2 3 5\n\n1 2 3 6\n\n")) == 3
    assert len(read("x y z r\n1 2 3 4\n# the others\n1 2 3 5\n# 1 2 3 7\n# 1 2 3 8\n1 2 3 6\n")) == 3


def test_blank_lines_between_the_frames_of_a_column_do_no_harm(read):
    content = "time,x,y,z,r\n0,1,2,3,4\n0,1,2,4,4\n\n1,1,2,3,5\n1,1,2,4,5\n"
    np.testing.assert_array_equal(read(content, frame=1).radii, [5, 5])
