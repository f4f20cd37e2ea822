"""Units in the names of columns, and comments that name columns."""

import numpy as np
import pytest

from porefv.errors import InputError


@pytest.mark.parametrize(
    "form",
    ["{}_mm", "{} / mm", "{} (mm)", "{}.mm", "{} in mm", "{} {{mm}}", "{} <mm>", "{}-mm", "{}:mm", "{}..mm.", "{}_MM"],
)
def test_units_in_names_that_are_known_or_mapped_are_converted(read, form):
    known = ",".join(form.format(name) for name in ("x", "y", "z", "radius"))
    assert read(f"{known}\n1,2,3,4\n").radii[0] == 0.004
    names = [form.format(name) for name in ("east", "north", "up", "size")]
    columns = dict(zip(("x", "y", "z", "radius"), names, strict=True))
    assert read(f"{','.join(names)}\n1,2,3,4\n", columns=columns).radii[0] == 0.004
    with pytest.raises(InputError, match="states a unit, and 'x' states none"):
        read(f"x,y,z,{names[3]}\n1,2,3,4\n", columns={"radius": names[3]})


@pytest.mark.parametrize("form", ["{} in mm", "{} {{mm}}", "{} / mm", "{} (mm)"])
def test_units_in_names_between_blanks(read, form):
    header = " ".join(form.format(name) for name in ("x", "y", "z", "radius"))
    assert read(f"{header}\n1 2 3 4\n").radii[0] == 0.004


@pytest.mark.parametrize(("unit", "metres"), [("in", 0.0254), ("inch", 0.0254), ("Å", 1e-10)])
def test_inches_and_angstroms_are_converted(read, unit, metres):
    packing = read(f"x ({unit}),y ({unit}),z ({unit}),r ({unit})\n1,2,3,4\n")
    np.testing.assert_allclose(packing.radii, 4 * metres, rtol=1e-15)


@pytest.mark.parametrize("header", ["x (Mm),y (Mm),z (Mm),r (Mm)", "x,y,z,r\npx,px,px,px", "x_Mm,y_Mm,z_Mm,r_Mm"])
def test_units_that_are_not_known_need_a_scale(read, header):
    with pytest.raises(InputError, match=r"line 1: lengths are in '(Mm|px)'.* as scale"):
        read(f"{header}\n1,2,3,4\n")
    assert read(f"{header}\n1,2,3,4\n", scale=0.5).radii[0] == 2


@pytest.mark.parametrize("ending", ["in mm", "/ mm", "(mm)"])
def test_a_unit_at_the_end_of_a_header_is_not_dropped(read, ending):
    with pytest.raises(InputError, match=r"line 1: .* as scale"):
        read(f"# x y z radius {ending}\n1 2 3 4\n")
    assert read(f"# x y z radius {ending}\n1 2 3 4\n", scale=0.5).radii[0] == 2


@pytest.mark.parametrize(
    "comment",
    [
        "columns: x y z diameter and so on", "Columns are X, Y, Z and diameter", "x(1) y(2) z(3) d(4)",
        "1:x 2:y 3:z 4:diameter", "radius, then x y z", "column 4 is the diameter", "xyzd of each",
    ],
)  # fmt: skip
def test_a_comment_that_names_other_columns_is_not_dropped(read, comment):
    with pytest.raises(InputError, match="line 1: the comment .* does not fit as a header of columns"):
        read(f"# {comment}\n1 2 3 4\n5 6 7 8\n")
    columns = {"x": "1", "y": "2", "z": "3", "diameter": "4"}
    np.testing.assert_array_equal(read(f"# {comment}\n1 2 3 4\n5 6 7 8\n", columns=columns).radii, [2, 4])


@pytest.mark.parametrize(
    "comment", ["columns: x, y, z, radius", "x(1) y(2) z(3) r(4)", "a 3D packing, x y z r in turn"]
)
def test_a_comment_that_names_the_columns_that_are_read_is_accepted(read, comment):
    assert read(f"# {comment}\n1 2 3 4\n5 6 7 8\n").radii[0] == 4


@pytest.mark.parametrize("header", ["columns: x y z diameter", "Columns: x, y, z, diameter", "fields: x y z d"])
def test_a_comment_that_lists_columns_is_a_header(read, header):
    np.testing.assert_array_equal(read(f"# {header}\n1 2 3 4\n5 6 7 8\n").radii, [2, 4])


def test_a_row_of_a_number_and_a_box_is_no_sphere(read):
    with pytest.raises(InputError, match="line 1: '2 1 1 1' may be the number of the rows after it and the sides"):
        read("2 1 1 1\n0.25 0.5 0.5 0.1\n0.75 0.5 0.5 0.1\n")
    with pytest.raises(InputError, match="line 1: '2.0e0 1 1 1' may be the number of the rows"):
        read("2.0e0 1 1 1\n0.25 0.5 0.5 0.1\n0.75 0.5 0.5 0.1\n")
    assert len(read("2 1 1 1\n4 0.5 0.5 0.1\n6 0.5 0.5 0.1\n")) == 3  # whole numbers as the others
    assert len(read("x y z r\n2 1 1 1\n0.25 0.5 0.5 0.1\n0.75 0.5 0.5 0.1\n")) == 3


def test_headers_of_rocky_and_of_r(read):
    names = [f"Particle {axis}-Coordinate : Time 0 s [mm]" for axis in "XYZ"]
    assert read(f"ID,{','.join(names)},Particle Radius : Time 0 s [mm]\n1,1,2,3,4\n").radii[0] == 0.004
    assert read('"x" "y" "z" "r"\n"1" 1 2 3 4\n"2" 5 6 7 8\n').radii[1] == 8
    assert read('"x","y","z","r"\n"1",1,2,3,4\n"2",5,6,7,8\n').radii[1] == 8
