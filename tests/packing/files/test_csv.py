import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from porefv.packing.box import Box
from porefv.packing.packing import Packing


@given(
    rows=arrays(np.float64, (3, 3), elements=st.floats(allow_nan=False, allow_infinity=False)),
    radii=arrays(np.float64, 3, elements=st.floats(1e-300, 1e300)),
)
def test_every_finite_number_reads_back_to_itself(tmp_path_factory, rows, radii):
    path = tmp_path_factory.mktemp("csv") / "grains.csv"
    Packing(rows, radii).write(path)
    again = Packing.read(path)
    np.testing.assert_array_equal(again.centres, rows)
    np.testing.assert_array_equal(again.radii, radii)
    assert again.box is None


def test_box_and_metadata_read_back(tmp_path):
    box = Box([-1 / 3, 0, 1e-9], [1, 2 / 3, 3])
    Packing([[0, 0.1, 1]], [0.1], box, metadata={"origin": "a\n lattice = made by hand"}).write(tmp_path / "a.csv")
    again = Packing.read(tmp_path / "a.csv")
    np.testing.assert_array_equal(again.box.lower, box.lower)
    np.testing.assert_array_equal(again.box.upper, box.upper)
    assert again.metadata == {"origin": "a lattice = made by hand"}


@pytest.mark.parametrize(
    "content",
    [
        "x,y,z,radius\n1,2,3,4\n5,6,7,8\n",
        "x,y,z,r\n1,2,3,4\n5,6,7,8",
        "\ufeffx,y,z,radius\r\n1,2,3,4\r\n5,6,7,8\r\n",
        "x,y,z,radius\r1,2,3,4\r5,6,7,8\r",
        "radius;Z;Y;X\n4;3;2;1\n8;7;6;5\n",
        "x\ty\tz\tradius\n1\t2\t3\t4\n5\t6\t7\t8\n",
        '"x", "y", "z", "Radius"\n"1", 2, 3, 4e0\n5,6,7,+8\n',
        'id,kind,x,y,z,note,radius\n7,sand,1,2,3,"a, b",4\n8,,5,6,7,,8\n',
        "# x,y,z,radius\n1,2,3,4\n5,6,7,8\n",
        "1,2,3,4\n5,6,7,8\n",
        "# a comment\n\nx,y,z,radius\n# another = one\n1,2,3,4\n\n   \n5,6,7,8\n\n",
    ],
    ids=[
        "plain",
        "r",
        "bom_crlf",
        "cr",
        "semicolon",
        "tab",
        "quoted",
        "extra_columns",
        "header_in_comment",
        "no_header",
        "comments",
    ],
)
def test_accepted_forms(read, content):
    packing = read(content)
    np.testing.assert_array_equal(packing.centres, [[1, 2, 3], [5, 6, 7]])
    np.testing.assert_array_equal(packing.radii, [4, 8])


def test_box_from_comments(read):
    box = read("# box_lower = 0 0 0\n# box_upper = [1, 2, 3]\nx,y,z,radius\n0.5,0.5,0.5,0.1\n").box
    np.testing.assert_array_equal(box.upper, [1, 2, 3])


@pytest.mark.parametrize(
    ("comments", "said"),
    [
        ("# box_lower = 0 0 0\n", "'# box_upper = x y z' is missing"),
        ("# box_lower = 0 0 0\n# box_lower = 0 0 0\n", ", line 2: box_lower is given twice"),
        ("# box_lower = 0 0\n# box_upper = 1 1 1\n", ", line 1: box_lower must be three numbers"),
        ("# box_lower = 0 0 0\n# box_upper = 1 one 1\n", ", line 2: box_upper must be three numbers"),
        ("# box_lower = 0 0 0\n# box_upper = 1 0 1\n", ": the box has size 0 m along y"),
        ("# box_lower = 0 0 0\n# box_upper = 1 nan 1\n", ": box upper must be three finite numbers"),
    ],
)
def test_a_bad_box_is_refused(error, comments, said):
    assert said in error(comments + "x,y,z,radius\n0.5,0.5,0.5,0.1\n")


@pytest.mark.parametrize(
    ("content", "said"),
    [
        ("a,b,c,w\n1,2,3,4\n", ", line 1: the header 'a,b,c,w' lacks x, y, z, radius (or diameter)."),
        ("# x,y,z,r\n1,2,3,4,5\n", ", line 2: 5 columns without names"),
        ("x,y,radius\n1,2,4\n", ", line 1: the header 'x,y,radius' lacks z"),
        ("x,y,z,radius,r\n1,2,3,4,5\n", ", line 1: the columns 'radius' and 'r' disagree about radius"),
        ("x,y,z,w\n1,2,3,4\n", ", line 1: the columns are 'x,y,z,w', and there is no radius or diameter"),
        ("x,y,z,radius\n", ": there are no spheres after line 1"),
        ("# nothing\n# here\n", ": only comments"),
    ],
)
def test_a_wrong_header_is_refused(error, content, said):
    assert said in error(content)


@pytest.mark.parametrize(
    ("row", "said"),
    [
        ("1,2,three,4", "z is 'three', not a number"),
        ("1,2,,4", "the cell of 'z' is empty"),
        ("1,2,3,1_000", "radius is '1_000', not a number"),
        ("1,2,3,4D-3", "radius is '4D-3', not a number"),
        ("1,2,3", "3 cells instead of 4"),
        ("1,2,3,4,5", "5 cells instead of 4"),
        ("x" * 10_000, "1 cells instead of 4: 'xxxxxx"),
        ("1,2,3,\x07\x1b", r"radius is '\x07\x1b', not a number"),
    ],
)
def test_a_bad_row_is_refused_by_its_line(error, row, said):
    # Comments and blank lines count as lines, as in any editor.
    message = error(f"# comment\nx,y,z,radius\n1,2,3,4\n\n# comment\n1,2,3,5\n{row}\n1,2,3,6\n")
    assert message.startswith(", line 7: ") and said in message and len(message) < 200


def test_a_decimal_comma_is_recognised(error):
    assert "'0,5', not a number. Write decimals with a point." in error("x;y;z;radius\n0,5;1;1;1\n")


@pytest.mark.parametrize(
    ("row", "said"),
    [
        ("nan,2,3,4", "values that are not finite"),
        ("1,2,3,inf", "values that are not finite"),
        ("1,2,3,0", "radius not positive"),
        ("1,2,3,-4", "radius not positive"),
    ],
)
def test_a_value_no_sphere_has_is_refused_by_its_line(error, row, said):
    message = error(f"# comment\nx,y,z,radius\n1,2,3,4\n\n{row}\n")
    assert said in message and "line 5 (sphere 1)" in message


def test_bytes_that_are_not_utf8_are_refused_by_their_line(error):
    assert error(b"# grains\n# caf\xe9\nx,y,z,radius\n1,2,3,4\n").startswith(", line 2: not UTF-8")
