import re
import warnings
from functools import partial

import numpy as np
import pytest

from porefv.errors import InputError, PackingFileWarning

DATA = """LAMMPS data file, any title: Atoms

3 atoms
1 atom types

-1 1 xlo xhi
0 2.5 ylo yhi   # comment
0 1e1 zlo zhi

Masses

1 2500

Atoms  # sphere

3 1 0.3 2500 0.7 0.8 0.9 0 0 0
1 1 0.1 2500 0.1 0.2 0.3 0 0 0

2 1 0.2 2500 0.4 0.5 0.6 0 0 0  # one more

Velocities

1 0 0 0 0 0 0
2 0 0 0 0 0 0
3 0 0 0 0 0 0
"""


def frame(step, radius, columns="id type x y z radius", bounds="ff fs mm"):
    return f"""ITEM: TIMESTEP
{step}
ITEM: NUMBER OF ATOMS
2
ITEM: BOX BOUNDS {bounds}
-1 1
0 2
0 4
ITEM: ATOMS {columns}
2 1 0.5 0.75 0.5 {radius}
1 1 0.25 0.5 0.125 {radius}
"""


@pytest.fixture
def read(read):
    """Read a LAMMPS file with this content."""
    return partial(read, name="grains.lammps")


def test_a_data_file_gives_spheres_by_atom_id_and_the_box(read):
    packing = read(DATA)
    np.testing.assert_allclose(packing.radii, [0.05, 0.1, 0.15], rtol=1e-15)
    np.testing.assert_array_equal(packing.centres, np.arange(1, 10).reshape(3, 3) / 10)
    np.testing.assert_array_equal(packing.box.lower, [-1, 0, 0])
    np.testing.assert_array_equal(packing.box.upper, [1, 2.5, 10])
    assert packing.source.name(0) == "line 17 (sphere 0)"


def test_a_data_file_without_box_or_hint_is_read(read):
    packing = read("t\n\n1 atoms\n\nAtoms\n\n1 1 0.5 1 0.5 0.5 0.5\n")
    assert packing.box is None and packing.radii[0] == 0.25


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("3 atoms", "4 atoms", ", line 19: 4 atoms declared, 3 given"),
        ("3 atoms", "2 atoms", ", line 19: 2 atoms declared, 3 given"),
        ("3 atoms", "³ atoms", ": the header has no line like '100 atoms'"),
        ("Atoms  # sphere", "Atoms  # bond", ", line 14: atom_style 'bond' is not read"),
        ("Atoms  # sphere", "Ellipsoids", ": not a LAMMPS data file"),
        ("0 2.5 ylo yhi", "0 two ylo yhi", ", line 7: '0 two' are not two numbers"),
        ("0 2.5 ylo yhi", "2 2 ylo yhi", ": the box has size 0 m along y"),
        ("Masses", "0 0.1 0 xy xz yz", ", line 10: the box is tilted"),
        ("0.7 0.8 0.9 0 0 0", "0.7 0.8", ", line 16: 6 cells where atom_style sphere has 7"),
        ("0.1 0.2 0.3 0 0 0", "0.1 0.2 0.3", ", line 17: 7 cells instead of 10"),
        ("2 1 0.2 2500", "2 1 big 2500", ", line 19: diameter is 'big', not a number"),
        ("2 1 0.2 2500", "2 1 0 2500", "line 19 (sphere 1): radius 0"),
        ("2 1 0.2 2500", "3 1 0.2 2500", ", line 19: atom id 3 stands on line 16 already"),
    ],
)
def test_a_bad_data_file_is_refused_by_its_line(error, old, new, said):
    assert old in DATA and said in error(DATA.replace(old, new, 1))


def test_of_a_dump_the_last_frame_is_read_by_atom_id(read):
    packing = read(frame(0, 0.1) + frame(1000, 0.2))
    np.testing.assert_array_equal(packing.radii, [0.2, 0.2])
    np.testing.assert_array_equal(packing.centres, [[0.25, 0.5, 0.125], [0.5, 0.75, 0.5]])
    np.testing.assert_array_equal(packing.box.lower, [-1, 0, 0])
    np.testing.assert_array_equal(packing.box.upper, [1, 2, 4])
    assert packing.source.name(0) == "line 22 (sphere 0)"


@pytest.mark.parametrize(
    ("columns", "factor", "size", "lower"),
    [
        ("id type xu yu zu radius", 1, 1, 0),
        ("id type xs ys zs radius", 1, [2, 2, 4], [-1, 0, 0]),
        ("id type xsu ysu zsu diameter", 0.5, [2, 2, 4], [-1, 0, 0]),
        ("id type x y z diameter", 0.5, 1, 0),
    ],
)
def test_scaled_and_unwrapped_coordinates_and_diameters(read, columns, factor, size, lower):
    packing = read(frame(0, 0.2, columns))
    expected = np.array([[0.25, 0.5, 0.125], [0.5, 0.75, 0.5]]) * size + lower
    np.testing.assert_array_equal(packing.centres, expected)
    np.testing.assert_array_equal(packing.radii, 0.2 * factor)


def test_a_dump_is_known_by_its_content_and_may_hold_units_and_time(read):
    packing = read("ITEM: UNITS\nsi\nITEM: TIME\n0.5\n" + frame(0, 0.1))
    assert len(packing) == 2


@pytest.mark.parametrize(
    ("content", "said"),
    [
        (frame(0, 0.1)[:-24], ", line 10: 2 atoms declared, 1 given. Was the file cut off?"),
        (frame(1, 0.1)[:41], ": the last frame lacks ITEM: BOX BOUNDS"),
        ("ITEM: TIMESTEP\n", ": the last frame lacks ITEM: NUMBER OF ATOMS"),
        (frame(0, 0.1).replace("ATOMS\n2", "ATOMS\ntwo"), ", line 4: 'two' is not a number of atoms"),
        (frame(0, 0.1).replace("0 2\n", "0\n"), ", line 7: two numbers, lower and upper, are expected"),
        (frame(0, 0.1).replace("0 2\n", "2 0\n"), ": the box has size -2 m along y"),
        (frame(0, 0.1, bounds="xy xz yz pp pp pp"), ", line 6: three numbers, lower, upper and tilt"),
        (frame(0, 0.1, bounds="abc origin pp pp pp"), ", line 5: the box is tilted"),
        (
            frame(0, 0.1, bounds="xy xz yz ff ff ff")
            .replace("0 4\n", "0 4 0\n")
            .replace("-1 1\n", "-1 1 0.5\n")
            .replace("0 2\n", "0 2 0\n"),
            ", line 6: the box is tilted",
        ),
        (frame(0, 0.1, bounds="ff pp mm"), ", line 5: the packing is periodic along y (BOX BOUNDS ff pp mm)"),
        (frame(0, 0.1, columns="id type x y z mass"), ", line 9: the columns 'id type x y z mass' lack"),
        (frame(0, 0.1, columns="id x y z radius"), ", line 10: 6 cells instead of 5"),
        (frame(0, 0.1).replace("2 1 0.5", "nan 1 0.5"), ", line 10: atom id nan is not a whole number"),
        (frame(0, 0.1).replace("2 1 0.5", "1e99 1 0.5"), ", line 10: atom id 1e+99 is not a whole number"),
        (frame(0, 0.1).replace("2 1 0.5", "2.5 1 0.5"), ", line 10: atom id 2.5 is not a whole number"),
        (frame(0, "nan"), "line 10 (sphere 1)"),
        (frame(0, "wide"), ", line 10: radius is 'wide', not a number"),
    ],
)
def test_a_bad_dump_is_refused_by_its_line(error, content, said):
    assert said in error(content)


@pytest.mark.parametrize(
    ("units", "metres"),
    [
        ("si", 1.0),
        ("cgs", 1e-2),
        ("micro", 1e-6),
        ("nano", 1e-9),
        ("metal", 1e-10),
        ("real", 1e-10),
        ("electron", 5.29177210903e-11),
    ],
)
def test_units_are_converted_with_the_box(read, units, metres):
    dump = read(f"ITEM: UNITS\n{units}\n" + frame(0, 0.1) + frame(1, 0.1))  # LAMMPS states them once
    data = read(DATA.replace("any title", f"version 1, timestep = 0, units = {units}"))
    for packing, radius, upper in ((dump, 0.1, [1, 2, 4]), (data, 0.05, [1, 2.5, 10])):
        assert packing.radii[0] == pytest.approx(radius * metres, rel=1e-15)
        np.testing.assert_allclose(packing.box.upper, np.array(upper) * metres, rtol=1e-15)
        assert packing.reading.scale == metres and packing.reading.units.startswith(units)


@pytest.mark.parametrize("units", ["lj", "furlongs"])
def test_units_without_a_length_in_metres_need_a_scale(read, units):
    content = f"ITEM: UNITS\n{units}\n" + frame(0, 0.1)
    with pytest.raises(InputError, match=rf"line 2: lengths are in '{units}'.* Give the length of this unit .* scale"):
        read(content)
    packing = read(content, scale=1e-3)
    np.testing.assert_array_equal(packing.radii, 1e-4)
    np.testing.assert_array_equal(packing.box.upper, [1e-3, 2e-3, 4e-3])


def test_a_scale_other_than_the_stated_unit_is_told(read):
    content = "ITEM: UNITS\ncgs\n" + frame(0, 0.1)
    with pytest.warns(PackingFileWarning, match="line 2: scale 1 is used instead of the stated unit cgs"):
        packing = read(content, scale=1.0)
    assert packing.radii[0] == 0.1 and "scale 1 is used instead" in str(packing.reading)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert read(content, scale=0.01).radii[0] == 0.001


def test_frame_chooses_among_frames(read):
    content = frame(0, 0.1) + "ITEM: TIME\n0.5\n" + frame(100, 0.2) + "ITEM: TIME\n1\n" + frame(200, 0.3)
    for number, radius in ((None, 0.3), (-1, 0.3), (2, 0.3), (0, 0.1), (1, 0.2), (-3, 0.1)):
        packing = read(content, frame=number)
        assert packing.radii[0] == radius and packing.reading.frames == 3
    with pytest.raises(InputError, match=r"frame 3 is asked for, and the file has 3 frames, 0 to 2 \(-1 is the last\)"):
        read(content, frame=3)
    with pytest.raises(InputError, match="frame -2 is asked for, and the file has one frame, 0"):
        read(frame(0, 0.1), frame=-2)


@pytest.mark.parametrize("lost", [1, 2, 20, 60, 100, *range(130, len(frame(1, 0.25)))])
def test_a_last_frame_that_is_cut_off_is_left_out_and_told(read, lost):
    whole = frame(0, 0.1)
    with pytest.warns(PackingFileWarning, match="line .*: the last frame is cut off, and the whole one before it"):
        packing = read((whole + frame(1, 0.25))[:-lost])
    assert packing.radii[0] == 0.1 and packing.reading.frames == 1
    assert "the last frame is cut off" in str(packing.reading)


def test_a_dump_without_ids_is_in_the_order_of_the_file(read):
    packing = read(frame(0, 0.1, columns="mol type x y z radius"))
    np.testing.assert_array_equal(packing.centres[:, 0], [0.5, 0.25])


@pytest.mark.parametrize(
    ("columns", "missing"),
    [
        ("id type x y z mass", "lack radius (or diameter)."),
        ("id type x y vz radius", "lack x y z (or xu, xs, xsu)."),
    ],
)
def test_a_missing_column_is_named_alone(error, columns, missing):
    assert missing in error(frame(0, 0.1, columns=columns))


def test_columns_of_a_dump_can_be_mapped_and_a_radius_given(read):
    content = frame(0, 0.1, columns="id type x y z f_size")
    assert read(content, columns={"diameter": "f_size"}).radii[0] == 0.05
    assert read(content, radius=0.2).radii[0] == 0.2
    scaled = frame(0, 0.1, columns="id type xs b zs radius")
    np.testing.assert_array_equal(
        read(scaled, columns={"x": "xs", "y": "b", "z": "zs"}).centres[0], [-1 + 0.25 * 2, 0.5, 0.125 * 4]
    )


@pytest.mark.parametrize(("bounds", "axes"), [("pp ff ff", "x"), ("ff pp pp", "y, z"), ("pp pp pp", "x, y, z")])
def test_periodic_axes_are_refused_or_ignored_by_name(read, error, bounds, axes):
    said = error(frame(0, 0.1, bounds=bounds))
    assert said.startswith(f", line 5: the packing is periodic along {axes} (BOX BOUNDS {bounds}). Give ")
    assert re.search('Give periodic = "ignore"', said)
    packing = read(frame(0, 0.1, bounds=bounds), periodic="ignore")
    assert packing.reading.periodicity.startswith(f"periodic along {axes}") and packing.box.volume == 16
    if axes == "x, y, z":
        cell = read(frame(0, 0.1, bounds=bounds), periodic="cell").box
        np.testing.assert_array_equal(cell.vectors, np.diag([2, 2, 4]))
        np.testing.assert_array_equal(cell.origin, [-1, 0, 0])
    else:
        with pytest.raises(InputError, match=f"periodic along {axes} alone .*periodic cells without walls only"):
            read(frame(0, 0.1, bounds=bounds), periodic="cell")


def test_a_tilted_box_is_a_periodic_cell(read):
    # Of a box of sides 2, 2 and 4 at (-1, 0, 0) with the tilts xy 0.5, xz -0.25 and yz 1.
    content = frame(0, 0.1, bounds="xy xz yz pp pp pp")
    for side, bound in (("-1 1", "-1.25 1.5 0.5"), ("0 2", "0 3 -0.25"), ("0 4", "0 4 1")):
        content = content.replace(f"{side}\n", f"{bound}\n", 1)
    with pytest.raises(InputError, match="line 6: the box is tilted"):
        read(content, periodic="ignore")
    packing = read(content, periodic="cell")
    np.testing.assert_allclose(packing.box.vectors, [[2, 0, 0], [0.5, 2, 0], [-0.25, 1, 4]])
    np.testing.assert_array_equal(packing.box.origin, [-1, 0, 0])
    plain = read(content, periodic="cell").centres
    scaled = read(content.replace(" x y z", " xs ys zs"), periodic="cell").centres
    np.testing.assert_allclose(scaled, [-1, 0, 0] + plain @ packing.box.vectors)


def test_a_data_file_is_read_into_a_periodic_cell(read):
    moved = DATA.replace("0.7 0.8 0.9 0 0 0", "0.7 0.8 0.9 1 0 -1")  # an atom that has crossed a boundary
    packing = read(moved, periodic="cell")
    np.testing.assert_array_equal(packing.box.vectors, np.diag([2, 2.5, 10]))
    assert packing.reading.periodicity.startswith("periodic by image flags along x, z")
    tilted = read(DATA.replace("zlo zhi\n", "zlo zhi\n0.5 0 -0.5 xy xz yz\n"), periodic="cell")
    np.testing.assert_array_equal(tilted.box.vectors, [[2, 0, 0], [0.5, 2.5, 0], [0, -0.5, 10]])


def test_bounds_without_flags_are_not_periodic(read):
    assert read(frame(0, 0.1, bounds="")).reading.periodicity == ""


def test_a_tilt_of_zero_is_no_tilt(read):
    content = frame(0, 0.1, bounds="xy xz yz ff ff ff")
    for side in ("-1 1", "0 2", "0 4"):
        content = content.replace(f"{side}\n", f"{side} 0.0\n", 1)
    assert read(content).box.volume == 16
    assert read(DATA.replace("Masses", "0 0 0 xy xz yz\n\nMasses")).box.volume == 50


@pytest.mark.parametrize("words", ["units cgs", "units = cgs", "units: cgs", "in cgs units", "Units CGS"])
def test_a_title_states_units_in_words(read, words):
    packing = read(DATA.replace("any title", f"a title, {words}"))
    assert packing.reading.units == "cgs (cm)"
    np.testing.assert_allclose(packing.radii, [0.0005, 0.001, 0.0015], rtol=1e-15)


def test_a_title_that_speaks_of_units_without_naming_them_states_none(read):
    assert read(DATA.replace("any title", "units differ")).reading.units == ""


def test_atoms_without_a_style_are_said_to_be_read_as_spheres(read):
    assert read(DATA.replace("Masses\n\n1 2500\n", "").replace("Atoms  # sphere", "Atoms")).reading.notes == (
        "no style after Atoms, read as atom_style sphere",
    )
    assert read(DATA).reading.notes == ()


def test_a_frame_without_atoms_is_named(read):
    empty = frame(1, 1).split("2 1 0.5")[0].replace("ATOMS\n2", "ATOMS\n0")
    with pytest.raises(InputError, match=r"line 15: frame 1 of 2 \(from 0\) has no atoms. Choose another as frame."):
        read(frame(0, 1) + empty)
    assert len(read(frame(0, 1) + empty, frame=0)) == 2


def test_one_frame_without_a_line_end_is_warned_of(read):
    with pytest.warns(PackingFileWarning, match="may have lost digits"):
        read(frame(0, 0.125).rstrip("\n"))
    whole = DATA.partition("Velocities")[0].replace(" 0 0 0\n", "\n").replace(" 0 0 0  #", " #").rstrip()
    with pytest.warns(PackingFileWarning, match="may have lost digits"):
        read(whole)


@pytest.mark.parametrize(
    ("title", "metres"),
    [
        ("metal units", 1e-10), ("micro units", 1e-6), ("unit: cgs", 1e-2), ("units in cm", 1e-2), ("units = mm", 1e-3),
        ("a packing, lengths in mm", 1e-3), ("units=real, atom_style sphere", 1e-10),
    ],
)  # fmt: skip
def test_a_title_states_units_in_other_words(read, title, metres):
    packing = read(DATA.replace("LAMMPS data file, any title: Atoms", title))
    np.testing.assert_allclose(packing.radii, np.array([0.05, 0.1, 0.15]) * metres, rtol=1e-14)


@pytest.mark.parametrize("title", ["lj units", "grains of 3 mm"])
def test_a_title_with_a_unit_that_is_not_known_or_not_understood_needs_a_scale(read, title):
    content = DATA.replace("LAMMPS data file, any title: Atoms", title)
    with pytest.raises(InputError, match=r"line 1: .* as scale"):
        read(content)
    assert read(content, scale=2.0).radii[0] == 0.1


def test_image_flags_tell_that_a_packing_is_periodic(read):
    for content, axes in (
        (DATA.replace("0.9 0 0 0", "0.9 0 -1 0"), "y"),
        (frame(0, 0.1, "id type x y z radius ix iy iz").replace(" 0.1\n", " 0.1 1 0 0\n"), "x"),
    ):
        with pytest.raises(InputError, match=rf"periodic along {axes} \(image flags that are not 0\)"):
            read(content)
        assert "image flags" in read(content, periodic="ignore").reading.periodicity
    assert read(frame(0, 0.1, "id type x y z radius ix iy iz").replace(" 0.1\n", " 0.1 0 0 0\n")).radii[0] == 0.1


def test_atoms_of_another_style_are_not_read_as_spheres(read):
    full = DATA.replace("Atoms  # sphere", "Atoms")
    with pytest.raises(InputError, match="no atom_style stands after Atoms, and with Masses it is not sphere"):
        read(full)
    with pytest.raises(InputError, match=r"the density of atom_style sphere, the fourth cell, is not positive"):
        read(full.replace("Masses\n\n1 2500\n", "").replace("0.3 2500", "0.3 0"))


def test_units_of_names_and_of_the_dump_must_agree(read):
    content = "ITEM: UNITS\ncgs\n" + frame(0, 0.1)
    assert read(content).radii[0] == 0.001
    with pytest.raises(InputError, match="the unit is 'cgs.*', and the names of columns state 'mm'"):
        read(content.replace("x y z radius", "x(mm) y(mm) z(mm) radius(mm)"), columns={k: f"{k}(mm)" for k in "xyz"})
