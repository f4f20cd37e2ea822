import numpy as np
import pytest

from porefv.packing.packing import Packing

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
def read(tmp_path):
    """Read a LAMMPS file with this content."""

    def reader(content):
        (tmp_path / "grains.lammps").write_text(content)
        return Packing.read(tmp_path / "grains.lammps")

    return reader


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
