"""What all formats share: dispatch by extension, and files that cannot be read at all."""

import os
import sys
from pathlib import Path

import numpy as np
import pytest

from porefv.errors import InputError, MissingExtraError
from porefv.packing.box import Box
from porefv.packing.files.detection import EXTENSIONS
from porefv.packing.files.registry import FORMATS, read_packing, write_packing
from porefv.packing.packing import Packing

PACKING = Packing([[0.1, 0.2, 0.3], [0.7, 1 / 3, 0.5]], [0.05, 0.1], Box([0, 0, 0], [1, 2, 3]))
TEXT_FORMATS = ("csv", "yade", "lammps", "mercury", "esys", "xyz")


@pytest.mark.parametrize("name", ["a.csv", "a.CSV", "a.txt", "a.spheres", "a.vtp"])
def test_a_packing_reads_back_to_the_same_numbers_by_extension(tmp_path, name):
    if name == "a.vtp":
        pytest.importorskip("pyvista")
    if name == "a.CSV":
        write_packing(PACKING, tmp_path / "a.csv")
        os.rename(tmp_path / "a.csv", tmp_path / name)
    else:
        PACKING.write(tmp_path / name)
    again = Packing.read(tmp_path / name)
    np.testing.assert_array_equal(again.centres, PACKING.centres)
    np.testing.assert_array_equal(again.radii, PACKING.radii)
    np.testing.assert_array_equal(again.box.lower, PACKING.box.lower)
    np.testing.assert_array_equal(again.box.upper, PACKING.box.upper)
    assert os.listdir(tmp_path) == [name]


def test_format_overrides_the_extension(tmp_path):
    PACKING.write(tmp_path / "grains.dat", format="csv")
    np.testing.assert_array_equal(read_packing(tmp_path / "grains.dat", format="csv").radii, PACKING.radii)


def test_the_box_given_overrides_the_one_in_the_file(tmp_path):
    PACKING.write(tmp_path / "a.csv")
    assert read_packing(tmp_path / "a.csv", box=Box([0, 0, 0], [5, 5, 5])).box.volume == 125


def test_unknown_extensions_and_formats_are_refused_with_the_known_ones(tmp_path):
    (tmp_path / "b.stl").write_bytes(b"\0\1\2")
    with pytest.raises(InputError, match=r"b.stl: neither the content nor the extension '.stl'.*\.csv"):
        read_packing(tmp_path / "b.stl")
    with pytest.raises(InputError, match=r"\.csv.*format as one of csv, yade"):
        write_packing(PACKING, tmp_path / "a")
    with pytest.raises(InputError, match="'stl' cannot be read. Give one of csv, yade, lammps, vtk"):
        read_packing("a.csv", format="stl")
    with pytest.raises(InputError, match="lammps.*cannot be written"):
        write_packing(PACKING, tmp_path / "a", format="lammps")
    with pytest.raises(InputError, match=".data"):
        write_packing(PACKING, tmp_path / "a.data")
    with pytest.raises(InputError, match="tells no format"):
        write_packing(PACKING, tmp_path / "a.csv.gz")
    assert os.listdir(tmp_path) == ["b.stl"] and set(EXTENSIONS.values()) <= set(FORMATS)


@pytest.mark.parametrize("format", FORMATS)
def test_a_missing_file_a_directory_and_an_empty_file_are_refused_by_name(tmp_path, format):
    (tmp_path / "empty").write_bytes(b"\n \r\n")
    for name, said in (("nowhere", "no such file"), (".", "is a directory"), ("empty", "the file is empty")):
        with pytest.raises(InputError, match=said) as caught:
            read_packing(tmp_path / name, format=format)
        assert str(caught.value).startswith(f"{tmp_path / name}: ") and "cannot be read" not in str(caught.value)


@pytest.mark.parametrize("format", FORMATS)
def test_binary_junk_is_refused_in_one_line(tmp_path, format):
    rng = np.random.default_rng(0)
    junk = {
        "noise": rng.integers(0, 256, 10_000, dtype=np.uint8).tobytes(),
        "no_zeros": rng.integers(128, 256, 10_000, dtype=np.uint8).tobytes(),
        "one_long_line": b"a" * 200_000,
        "letters": rng.integers(97, 123, 10_000, dtype=np.uint8).tobytes(),
        "utf16": "x,y,z,radius\n0,0,0,1\n".encode("utf-16"),
    }
    for name, content in junk.items():
        (tmp_path / name).write_bytes(content)
        with pytest.raises(InputError) as caught:
            read_packing(tmp_path / name, format=format)
        assert str(caught.value).startswith(str(tmp_path / name)) and len(str(caught.value)) < 400


VALID = {
    "csv": "# box_lower = 0 0 0\n# box_upper = 1 1 1\nx,y,z,radius\n0.1,0.2,0.3,0.05\n0.7,0.5,0.5,0.1\n",
    "yade": "#format x_y_z_r_id\n# box_lower = 0 0 0\n# box_upper = 1 1 1\n0.1 0.2 0.3 0.05 1\n0.7 0.5 0.5 0.1 2\n",
    "lammps": "title\n\n2 atoms\n0 1 xlo xhi\n0 1 ylo yhi\n0 1 zlo zhi\n\nAtoms # sphere\n\n"
    "1 1 0.1 2500 0.1 0.2 0.3\n2 1 0.2 2500 0.7 0.5 0.5\n",
    "lammps dump": "ITEM: TIMESTEP\n0\nITEM: NUMBER OF ATOMS\n2\nITEM: BOX BOUNDS ff ff ff\n0 1\n0 1\n0 1\n"
    "ITEM: ATOMS id x y z radius\n1 0.1 0.2 0.3 0.05\n2 0.7 0.5 0.5 0.1\n",
    "vtk": "# vtk DataFile Version 3.0\ntitle\nASCII\nDATASET POLYDATA\nFIELD f 2\n"
    "box_lower 3 1 double\n0 0 0\n"
    "box_upper 3 1 double\n1 1 1\nPOINTS 2 double\n0.1 0.2 0.3\n0.7 0.5 0.5\nPOINT_DATA 2\n"
    "SCALARS radius double 1\nLOOKUP_TABLE default\n0.05 0.1\n",
}


@pytest.mark.filterwarnings("ignore::porefv.errors.PackingFileWarning")
@pytest.mark.parametrize("format", VALID)
def test_a_damaged_file_gives_a_packing_or_an_error_that_names_it(tmp_path, format):
    path, valid = tmp_path / "damaged", VALID[format]
    path.write_text(valid)
    assert Packing.read(path, format.split()[0]).box.volume == 1
    rng = np.random.default_rng(0)
    for _ in range(300):
        start, length = rng.integers(len(valid)), rng.choice([0, 1, 3, len(valid)])
        path.write_text(valid[:start] + rng.choice(list('\n 0-#,x.eé"')) + valid[start + length :])
        try:
            assert len(Packing.read(path, format.split()[0])) > 0
        except InputError as error:
            assert str(path) in str(error) and len(str(error).splitlines()) < 10


@pytest.mark.parametrize("format", TEXT_FORMATS)
def test_an_unreadable_file_is_refused_with_the_reason(tmp_path, format, monkeypatch):
    # The super-user may read anything: permission is denied here instead of by the file system.
    (tmp_path / "a").write_text("x")

    def deny(self):
        raise PermissionError(13, "Permission denied", str(self))

    monkeypatch.setattr(Path, "read_bytes", deny)
    with pytest.raises(InputError, match="cannot be read: Permission denied"):
        read_packing(tmp_path / "a", format=format)


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="no pipes on this system")
def test_a_pipe_is_refused_instead_of_waited_for(tmp_path):
    os.mkfifo(tmp_path / "pipe.csv")
    with pytest.raises(InputError, match="not a regular file"):
        read_packing(tmp_path / "pipe.csv")


def test_a_missing_vtk_package_is_an_error_that_says_what_to_install(tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "pyvista", None)
    monkeypatch.setitem(sys.modules, "vtkmodules", None)
    (tmp_path / "a.vtu").write_text("<?xml version='1.0'?>")
    for ask in (lambda: read_packing(tmp_path / "a.vtu"), lambda: PACKING.write(tmp_path / "a.vtp")):
        with pytest.raises(MissingExtraError, match="VTK files needs .* pip install pyvista"):
            ask()
