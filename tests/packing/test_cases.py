"""The same 25 spheres in the shapes that other programs give them: all have the same permeability."""

import gzip
from pathlib import Path

import numpy as np
import pytest

from porefv.errors import InputError, PackingFileWarning
from porefv.flow.fluid import Fluid
from porefv.flow.pore_flow import PoreFlow
from porefv.flow.walls import Walls
from porefv.packing.box import Box
from porefv.packing.packing import Packing

CASES = Path(__file__).with_name("cases")
UNIT = Box([0, 0, 0], [1, 1, 1])
# Of the 25 spheres in the unit box, without slip, along y, m².
PERMEABILITY = 1.902923e-4


def permeability(packing):
    return PoreFlow(packing, Walls.along("y"), Fluid(viscosity=1.0)).permeability


@pytest.mark.parametrize(
    ("name", "format"),
    [
        ("f03_liggghts.dump", "LAMMPS dump"),
        ("f04_dump10000.liggghts", "LAMMPS dump"),
        ("f06_triclinic_zero.dump", "LAMMPS dump"),
        ("f09_granular.data", "LAMMPS data file, atom_style sphere"),
        ("f10_no_id.dump", "LAMMPS dump"),
        ("f13_diameter.csv", "table with header, separated by commas"),
        ("f16_header.txt", "table with header, separated by blanks"),
        ("f17_mercury.data", "MercuryDPM data"),
        ("f19_textext_matid.txt", "Yade text (#format)"),
        ("f25_esys.geo", "ESyS-Particle geometry"),
    ],
)
def test_a_file_with_spheres_and_box_needs_nothing_else(name, format):
    packing = Packing.read(CASES / name)
    assert permeability(packing) == pytest.approx(PERMEABILITY, rel=1e-6)
    assert packing.reading.format == format
    assert packing.reading.scale == 1.0 and packing.reading.units == "" and packing.reading.periodicity == ""


@pytest.mark.parametrize("name", ["f01_liggghts.vtk", "f12_edem.csv", "f20_voro.txt", "f23_savetxt.csv"])
def test_a_file_without_box_needs_a_box(name):
    packing = Packing.read(CASES / name)
    assert packing.box is None and packing.reading.box == ""
    packing = Packing.read(CASES / name, box=UNIT)
    assert permeability(packing) == pytest.approx(PERMEABILITY, rel=1e-6)
    assert packing.reading.box == "given"


def test_units_that_a_dump_states_are_converted():
    packing = Packing.read(CASES / "f05_units_cgs.dump")
    assert permeability(packing) == pytest.approx(PERMEABILITY, rel=1e-6)
    assert (packing.reading.units, packing.reading.scale) == ("cgs (cm)", 0.01)


def test_voxels_need_a_scale_and_a_box():
    packing = Packing.read(CASES / "f24_ct_voxels.csv", scale=1 / 500, box=UNIT)
    assert permeability(packing) == pytest.approx(PERMEABILITY, rel=1e-5)  # the file has three decimals of a voxel


def test_doubles_of_packing_generation_are_read_with_the_box_beside_them():
    with pytest.warns(PackingFileWarning, match="packing-generation makes periodic packings"):
        packing = Packing.read(CASES / "f22_packing.xyzd")
    assert permeability(packing) == pytest.approx(PERMEABILITY, rel=1e-6)
    assert packing.reading.box == "Dimensions in f22_packing.nfo"


def test_points_alone_need_a_radius():
    with pytest.raises(InputError, match=r"line 3: the columns are 'x,y,z', and there is no radius or diameter"):
        Packing.read(CASES / "f26_points_only.csv")
    packing = Packing.read(CASES / "f26_points_only.csv", radius=0.1)
    np.testing.assert_array_equal(packing.radii, 0.1)
    assert "radius of all spheres 0.1 m, given" in packing.reading.notes
    np.testing.assert_array_equal(packing.centres, Packing.read(CASES / "f13_diameter.csv").centres)


def test_a_periodic_packing_is_refused_as_such():
    for name, line in (("f18_spherepack.txt", 1), ("f27_periodic.dump", 5)):
        with pytest.raises(InputError) as caught:
            Packing.read(CASES / name)
        said = str(caught.value)
        assert f"{name}, line {line}: the packing is periodic along x, y, z" in said
        assert 'Give periodic = "ignore" to read it into a box with six walls' in said and "larger" not in said


def test_a_periodic_packing_is_read_into_walls_if_the_user_says_so():
    packing = Packing.read(CASES / "f18_spherepack.txt", periodic="ignore")
    assert permeability(packing) == pytest.approx(PERMEABILITY, rel=1e-6)
    assert packing.reading.format == "SpherePack text (x y z radius clump)"
    assert "which is ignored: the box has walls" in packing.reading.periodicity
    lattice = Packing.read(CASES / "f27_periodic.dump", periodic="ignore")
    with pytest.raises(InputError) as caught:  # centres on the walls
        lattice.validate()
    assert "boundaries of a periodic cell" in str(caught.value) and "larger" not in str(caught.value)


@pytest.mark.parametrize("name", ["f04_dump10000.liggghts", "f16_header.txt", "f17_mercury.data", "f01_liggghts.vtk"])
def test_text_compressed_by_gzip_reads_as_the_text(tmp_path, name):
    (tmp_path / f"{name}.gz").write_bytes(gzip.compress((CASES / name).read_bytes()))
    packing, plain = Packing.read(tmp_path / f"{name}.gz"), Packing.read(CASES / name)
    np.testing.assert_array_equal(packing.centres, plain.centres)
    assert packing.reading == plain.reading
