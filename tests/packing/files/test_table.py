"""Tables of text: names, places, units, separators, preambles."""

import numpy as np
import pytest

from porefv.errors import InputError, PackingFileWarning
from porefv.packing.cell import Cell


@pytest.mark.parametrize(
    "header",
    [
        "x,y,z,r",
        "X,Y,Z,Radius",
        "pos_x,pos_y,pos_z,rad",
        "x_pos,y_pos,z_pos,particle_radius",
        "Position X (m),Position Y (m),Position Z (m),Radius (m)",
        "Points:0,Points:1,Points:2,radii",
        "Points_0,Points_1,Points_2,Radius",
        "position[0],position[1],position[2],radius",
        "Centre X,Centre Y,Centre Z,Equivalent Radius",
        "x [m],y [m],z [m],r [m]",
        "x / m,y / m,z / m,r / m",
        "x-coordinate,y-coordinate,z-coordinate,radius",
        "cx,cy,cz,r",
        "BaryCenterX,BaryCenterY,BaryCenterZ,EqRadius",
        "Q01 : Particle Position X (m),Q02 : Particle Position Y (m),Q03 : Particle Position Z (m),Q04 : Radius (m)",
        "'x','y','z','radius'",
    ],
)
@pytest.mark.parametrize("separator", [",", ";", "\t"])
def test_common_names_are_recognised(read, header, separator):
    packing = read("\n".join([header, "1,2,3,4", "5,6,7,8", ""]).replace(",", separator))
    np.testing.assert_array_equal(packing.centres, [[1, 2, 3], [5, 6, 7]])
    np.testing.assert_array_equal(packing.radii, [4, 8])


def test_other_columns_are_not_taken_for_coordinates(read):
    packing = read("vx,fx,x,y,z,mx,px,radius,density\n9,9,1,2,3,9,9,4,9\n")
    np.testing.assert_array_equal(packing.centres, [[1, 2, 3]])


@pytest.mark.parametrize(
    ("unit", "metres"), [("m", 1.0), ("cm", 1e-2), ("mm", 1e-3), ("um", 1e-6), ("µm", 1e-6), ("micron", 1e-6)]
)
def test_units_in_names_are_converted(read, unit, metres):
    for header in (f"x ({unit}),y ({unit}),z ({unit}),d ({unit})", f"X [{unit}],Y [{unit}],Z [{unit}],D [{unit}]"):
        packing = read(f"# box_lower = 0 0 0\n# box_upper = 4 4 4\n{header}\n1,2,3,1\n")
        np.testing.assert_allclose(packing.centres, [np.array([1, 2, 3]) * metres], rtol=1e-15)
        np.testing.assert_allclose(packing.radii, 0.5 * metres, rtol=1e-15)
        np.testing.assert_allclose(packing.box.upper, 4 * metres, rtol=1e-15)
        assert (packing.reading.units, packing.reading.scale) == (unit, metres)


def test_units_of_columns_may_differ(read):
    packing = read("x (mm),y (cm),z (m),radius (um)\n1000,200,3,4e5\n")
    np.testing.assert_allclose(packing.centres, [[1, 2, 3]], rtol=1e-15)
    np.testing.assert_allclose(packing.radii, [0.4], rtol=1e-15)


def test_units_that_are_not_known_need_a_scale(read):
    for header in ("x [px],y [px],z [px],r [px]", "x (mm),y (mm),z (mm),r"):
        with pytest.raises(InputError, match=r"line 1: .* as scale"):
            read(f"{header}\n1,2,3,4\n")
        packing = read(f"{header}\n1,2,3,4\n", scale=0.5)
        np.testing.assert_array_equal(packing.centres, [[0.5, 1, 1.5]])
        np.testing.assert_array_equal(packing.radii, [2])


def test_lines_before_the_header_and_a_header_in_a_comment(read):
    for content in (
        "Title of an export\nTIME:,0.5,s\n\nID,X,Y,Z,R\n1,1,2,3,4\n2,5,6,7,8\n",
        "# ID,X,Y,Z,R\n1,1,2,3,4\n2,5,6,7,8\n",
        "# ID X Y Z R\n1,1,2,3,4\n2,5,6,7,8\n",
        "% ID X Y Z R\n1 1 2 3 4\n2 5 6 7 8\n",
        "# made by hand\n# ID X Y Z R\n1 1 2 3 4\n2 5 6 7 8\n",
    ):
        np.testing.assert_array_equal(read(content).centres, [[1, 2, 3], [5, 6, 7]])


def test_a_number_of_spheres_before_them_is_compared(read):
    assert len(read("2\n1 2 3 4\n5 6 7 8\n", "a.txt")) == 2
    with pytest.raises(InputError, match="line 1: 3 spheres declared, 2 given"):
        read("3\n1 2 3 4\n5 6 7 8\n", "a.txt")


def test_indices_of_an_image_are_no_coordinates(read):
    # scikit-image counts axes in the order of the array, which is that of the image reversed.
    with pytest.raises(InputError, match="lacks x, y, z"):
        read("label,centroid-0,centroid-1,centroid-2,equivalent_diameter\n1,1,2,3,4\n")


def test_a_comment_that_is_no_header_is_left_alone(read):
    for comment in ("# columns: x y z r of 2 grains", "# x y z", "# grains of x"):
        np.testing.assert_array_equal(read(f"{comment}\n1 2 3 4\n5 6 7 8\n").radii, [4, 8])


def test_units_in_comments_and_beside_names_are_converted(read):
    for content in (
        "# units = mm\n1 2 3 4\n",
        "# Length unit: mm\nx,y,z,r\n1,2,3,4\n",
        "# x [mm] y [mm] z [mm] r [mm]\n1 2 3 4\n",
        "x (mm) y (mm) z (mm) r (mm)\n1 2 3 4\n",
    ):
        assert read(content).radii[0] == 0.004
    for content, said in (
        ("# x y z r [mm]\n1 2 3 4\n", "'r [mm]' states a unit, and 'x' states none"),
        (
            "# units = mm\nx (m),y (m),z (m),r (m)\n1,2,3,4\n",
            "line 1: the unit is 'mm', and the names of columns state",
        ),
        ("# units = furlong\n1 2 3 4\n", "line 1: lengths are in 'furlong'"),
    ):
        with pytest.raises(InputError) as caught:
            read(content)
        assert said in str(caught.value)


def test_columns_are_mapped_by_name_or_by_place(read):
    content = "a,b,c,size\n1,2,3,4\n5,6,7,8\n"
    columns = {"x": "c", "y": "B", "z": "a", "diameter": "size"}
    packing = read(content, columns=columns)
    np.testing.assert_array_equal(packing.centres, [[3, 2, 1], [7, 6, 5]])
    np.testing.assert_array_equal(packing.radii, [2, 4])
    assert packing.reading.columns == {"x": "c", "y": "b", "z": "a", "radius": "size (halved)"}
    packing = read("9 1 2 3 9 9 4\n", columns={"x": "2", "y": "3", "z": "4", "radius": "7"})
    np.testing.assert_array_equal(packing.centres, [[1, 2, 3]])
    assert packing.radii[0] == 4


@pytest.mark.parametrize(
    ("options", "said"),
    [
        ({"columns": {"x": "w"}}, "line 1: 'w', given for x, is no column. Columns: 'x', 'y', 'z', 'r'"),
        ({"columns": {"size": "r"}}, "columns are names of x, y, z, radius, diameter, not 'size'"),
        ({"columns": {"radius": "r", "diameter": "r"}}, "give one of columns.radius, columns.diameter and radius"),
        ({"columns": {"radius": "r"}, "radius": 1.0}, "give one of columns.radius, columns.diameter and radius"),
        ({"radius": -1.0}, "radius must be a positive number of m, not -1.0"),
        ({"scale": float("nan")}, "scale must be a positive number of m, not nan"),
        ({"frame": 1.5}, "frame must be a whole number"),
        ({"frame": 1}, "frame 1 is asked for, and the file has one frame, 0"),
        ({"periodic": "yes"}, 'periodic must be "cell", "ignore", or not be given'),
        ({"periodic": "cell"}, "the file has no box. Give the periodic cell, as in box=Cell(vectors)"),
    ],
)
def test_impossible_options_are_refused(read, options, said):
    with pytest.raises(InputError) as caught:
        read("x,y,z,r\n1,2,3,4\n", **options)
    assert said in str(caught.value) and "grains.csv" in str(caught.value)


def test_columns_that_agree_are_read_and_others_refused_with_the_remedy(read):
    packing = read("x,y,z,radius,diameter\n1,2,3,0.1234567,0.2469\n")
    assert packing.radii[0] == 0.1234567
    with pytest.raises(InputError) as caught:
        read("x,y,z,radius,diameter\n1,2,3,0.1,0.1\n")
    assert "the columns 'radius' and 'diameter' disagree about radius" in str(caught.value)
    assert 'columns = { diameter = "diameter" }' in str(caught.value)
    assert read("x,y,z,radius,diameter\n1,2,3,0.1,0.1\n", columns={"diameter": "diameter"}).radii[0] == 0.05
    with pytest.raises(InputError, match="'x' and 'Position X' disagree about x"):
        read("x,y,z,radius,Position X\n1,2,3,0.1,2\n")


def test_a_radius_for_all_needs_a_file_without_radii(read):
    np.testing.assert_array_equal(read("1 2 3\n4 5 6\n", "a.txt", radius=0.5).radii, 0.5)
    np.testing.assert_array_equal(read("x,y,z\n1,2,3\n", radius=0.5, scale=2.0).centres, [[2, 4, 6]])
    for rows in ("x,y,z,r\n1,2,3,4\n", "1.5 2 3 4 -1\n"):
        with pytest.warns(PackingFileWarning, match="the radius given is used instead of"):
            np.testing.assert_array_equal(read(rows, radius=0.5).radii, 0.5)
    with pytest.raises(InputError, match="line 1: 4 columns without names"):
        read("1 2 3 4\n", radius=0.5)


@pytest.mark.parametrize(
    ("rows", "format", "x"),
    [
        ("0 1 2 3 4\n1 5 6 7 8\n", "Voro++ text (id x y z radius)", 1),
        ("2 1 2 3 4\n1 5 6 7 8\n", "Voro++ text (id x y z radius)", 1),
        ("1.5 2 3 4 -1\n5 6 7 8 0\n", "SpherePack text (x y z radius clump)", 1.5),
    ],
)
def test_five_columns_without_names(read, rows, format, x):
    rows = rows if format.startswith("S") else rows.replace(" 4\n", " 4.5\n")
    packing = read(rows, "grains.txt")
    assert packing.centres[0, 0] == x and packing.reading.format == format


def test_places_that_are_not_clear_are_refused(read):
    for rows, said in (
        ("1 1 2 3 4\n2 5 6 7 8\n", "5 columns without names are neither clearly id x y z radius"),
        ("1.5 1 2 3 4.5\n2 5 6 7 8\n", "5 columns without names are neither clearly id x y z radius"),
        (
            "1 .1 .1 .1\n2 .2 .2 .2\n3 .3 .3 .3\n4 .4 .4 .4\n",
            "the first of 4 columns without names numbers the spheres",
        ),
        ("1 2 3\n", "3 columns without names and no radius"),
    ):
        with pytest.raises(InputError, match=r"line 1") as caught:
            read(rows, "grains.txt")
        assert said in str(caught.value) and 'columns = { x = "1"' in str(caught.value)


def test_the_cell_of_a_sphere_pack_must_be_three_numbers(read):
    for text in ("1 1", "1 1 one"):
        with pytest.raises(InputError, match="line 1: ##PERIODIC:: must be followed by three numbers"):
            read(f"##PERIODIC:: {text}\n1 2 3 4 -1\n", "grains.txt", periodic="ignore")


def test_the_content_comes_before_the_extension(read):
    dump = "ITEM: TIMESTEP\n0\nITEM: NUMBER OF ATOMS\n1\nITEM: BOX BOUNDS ff ff ff\n0 1\n0 1\n0 1\n"
    dump += "ITEM: ATOMS x y z radius\n"
    for name in ("a.csv", "a.txt", "a.liggghts", "a", "a.stl"):
        assert read(dump + "0.5 0.5 0.5 0.1\n", name).reading.format == "LAMMPS dump"
        assert read("x;y;z;r\n1;2;3;4\n", name if name != "a.liggghts" else "b").radii[0] == 4


FRAMES = "time,id,x,y,z,radius\n0,1,1,2,3,1\n0,2,5,6,7,1\n0.5,1,2,2,3,1\n0.5,2,6,6,7,1\n"


@pytest.mark.parametrize("name", ["time", "Time [s]", "t", "timestep", "Frame", "STEP"])
def test_a_table_of_several_times_needs_the_choice_of_a_frame(read, name):
    content = FRAMES.replace("time", name)
    with pytest.raises(InputError, match=r"has 2 values \(0.0, 0.5\).*Give frame, 0 to 1"):
        read(content)
    for frame, x in ((0, [1, 5]), (1, [2, 6]), (-1, [2, 6])):
        packing = read(content, frame=frame)
        np.testing.assert_array_equal(packing.centres[:, 0], x)
        assert (packing.reading.frame, packing.reading.frames) == (frame % 2, 2)
    with pytest.raises(InputError, match="frame 2 is asked for, and the file has 2 frames"):
        read(content, frame=2)


def test_a_table_of_one_time_has_one_frame(read):
    assert len(read("time,x,y,z,r\n3,1,2,3,1\n3,5,6,7,1\n")) == 2


def test_an_id_that_occurs_twice_is_refused(read, error):
    content = FRAMES.replace("time", "mass")
    assert error(content) == (
        ", line 4: id '1' stands on line 2 already. Does the table hold several frames? Keep the rows of one; or "
        "rename the column if it is no id of spheres."
    )


@pytest.mark.parametrize("names", ["R,G,B", "r,g,b", "B,G,r"])
def test_a_colour_is_not_taken_for_a_radius(read, names):
    content = f"x,y,z,{names}\n1,2,3,0.1,0.2,0.3\n"
    with pytest.raises(InputError, match="may be a colour or the radius. Map the radius"):
        read(content)
    r = names.lower().split(",").index("r")
    np.testing.assert_array_equal(read(content, columns={"radius": names.split(",")[r]}).radii, [[0.1, 0.2, 0.3][r]])
    np.testing.assert_array_equal(read(content.replace("x", "radius,x").replace("\n1", "\n9,1")).radii, [9])
    np.testing.assert_array_equal(read(content, radius=0.5).radii, [0.5])


def test_two_things_are_not_read_from_one_column(read):
    with pytest.raises(InputError, match="maps 'a' to both x and y"):
        read("a,b,c,r\n1,2,3,4\n", columns={"x": "a", "y": "a", "z": "c"})


def test_a_last_number_without_a_line_end_is_warned_of(read, recwarn):
    content = "x,y,z,r\n1,2,3,0.4\n1,2,5,0.45"
    with pytest.warns(PackingFileWarning, match=r"line 3: the last line has no line end.*may have lost digits"):
        packing = read(content)
    assert "no line end" in packing.reading.notes[0]
    recwarn.clear()
    read(content + "\n")
    read("x,y,z,r,density\n1,2,3,0.4,25")  # what may have lost digits is not read
    read(content + "\n# end")
    assert not [warning for warning in recwarn if warning.category is PackingFileWarning]


@pytest.mark.parametrize(
    ("content", "message"),
    [
        ("0,5 0,5 0,5 0,1\n0,2 0,5 0,5 0,1\n", "decimal commas. Write decimals with a point."),
        ("0,5;0,5;0,5;0,1\n", "decimal commas. Write decimals with a point."),
        ("1.0D-01 2.0D-01 3.0D-01 1.0D-02\n", "exponents of Fortran with D. Write them with E, as in 1.0E-3."),
        ("1.0D-01,2.0D-01,3.0D-01,1.0D-02\n", "exponents of Fortran with D. Write them with E, as in 1.0E-3."),
    ],
)
def test_numbers_written_otherwise_are_no_header(read, error, content, message):
    assert message in error(content)


def test_an_exponent_with_d_under_a_header_is_explained(read, error):
    assert (
        error("x,y,z,r\n1.0D-3,2,3,4\n")
        == ", line 2: x is '1.0D-3', not a number. Write exponents with E instead of D."
    )


@pytest.mark.parametrize("header", ["x,y,z,r", "# x,y,z,r"])
def test_units_may_stand_under_the_names(read, header):
    packing = read(f"{header}\nmm,[mm],(mm),cm\n1000,2000,3000,4\n1000,2000,5000,4\n")
    np.testing.assert_allclose(packing.centres[0], [1, 2, 3], rtol=1e-15)
    np.testing.assert_allclose(packing.radii, 0.04, rtol=1e-15)
    with pytest.raises(InputError, match="line 2: the unit under 'x_mm' is 'm'"):
        read("x_mm,y_mm,z_mm,r_mm\nm,m,m,m\n1,2,3,4\n")


def test_a_spherepack_file_is_read_into_its_periodic_cell(read):
    packing = read("##PERIODIC:: 1 2 3\n0.5 2.5 -0.5 0.1 -1\n", "grains.txt", periodic="cell")
    np.testing.assert_array_equal(packing.box.vectors, np.diag([1, 2, 3]))
    np.testing.assert_allclose(packing.wrapped().centres, [[0.5, 0.5, 2.5]])
    assert packing.reading.periodicity == "periodic along x, y, z (##PERIODIC::), read into a periodic cell"
    given = read("x,y,z,r\n0.1,0.2,0.3,0.04\n", box=Cell([2, 2, 2], [1, 0, 0]), scale=0.5)
    assert given.box.volume == 8 and given.radii[0] == 0.02
