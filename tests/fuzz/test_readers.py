"""Damaged files of every kind: read, or refused in one line of words; never a crash, a hang or a traceback."""

import contextlib
import gzip
import io
import json
import os
import warnings
from pathlib import Path

import numpy as np
import pytest
from hypothesis import event, example, given, settings
from hypothesis import strategies as st

from porefv import cli, results
from porefv.errors import PackingFileWarning, PorefvError
from porefv.flow.fluid import Fluid
from porefv.flow.pore_flow import PoreFlow
from porefv.flow.walls import Walls
from porefv.packing.box import Box
from porefv.packing.files.registry import FORMATS, read_packing
from porefv.packing.packing import Packing

FUZZ = settings.get_profile("fuzz-nightly" if os.environ.get("POREFV_FUZZ") == "nightly" else "fuzz")

PACKING = Packing([[0.25, 0.25, 0.25], [0.75, 0.5, 0.5], [0.4, 0.7, 0.6]], [0.2, 0.15, 0.1], Box([0, 0, 0], [1, 1, 1]))
LAMMPS_DATA = """made by hand

3 atoms
1 atom types
0.0 1.0 xlo xhi
0.0 1.0 ylo yhi
0.0 1.0 zlo zhi

Atoms # sphere

1 1 0.4 2500 0.25 0.25 0.25
3 1 0.3 2500 0.75 0.5 0.5
2 1 0.2 2500 0.4 0.7 0.6 0 0 0

Velocities

1 0 0 0 0 0 0
"""
LAMMPS_DUMP = """ITEM: TIMESTEP
0
ITEM: NUMBER OF ATOMS
2
ITEM: BOX BOUNDS ff ff ff
0 1
0 1
0 1
ITEM: ATOMS id xs ys zs diameter
2 0.25 0.25 0.25 0.3
1 0.75 0.75 0.75 0.4
"""
MERCURY = "2 0.5 0 0 0 1 1 1\n" + "0.25 0.25 0.25 0 0 0 0.2 0 0 0 0 0 0 0\n0.75 0.75 0.75 0 0 0 0.2 0 0 0 0 0 0 0\n"
ESYS = """LSMGeometry 1.2
BoundingBox 0 0 0 1 1 1
PeriodicBoundaries 0 0 0
Dimension 3D
BeginParticles
Simple
2
0.25 0.25 0.25 0.2 0 1
0.75 0.75 0.75 0.2 1 1
EndParticles
"""
XYZ = """2
Lattice="1 0 0 0 1 0 0 0 1" Origin="0 0 0" pbc="F F F" Properties=species:S:1:pos:R:3:radius:R:1
A 0.25 0.25 0.25 0.2
A 0.75 0.75 0.75 0.2
"""
EDEM = """EXPORTED DATA
TIME:,0.5,s

Particle ID,Position X (mm),Position Y (mm),Position Z (mm),Diameter (mm)
1,250,250,250,400
2,750,750,750,400
"""
SPHERE_PACK = "0.25 0.25 0.25 0.2 -1\n0.75 0.75 0.75 0.2 -1\n"
VORO = "1 0.25 0.25 0.25 0.2\n2 0.75 0.75 0.75 0.2\n"
XYZD = np.array([[0.25, 0.25, 0.25, 0.4], [0.75, 0.75, 0.75, 0.4]], "<f8").tobytes()
NFO = "N: 2\nDimensions: 1 1 1\nTheoretical Porosity: 0.9\nFinal Porosity: 0.9\n"
LEGACY = """# vtk DataFile Version 3.0
grains
ASCII
DATASET POLYDATA
FIELD FieldData 2
box_lower 3 1 double
0 0 0
box_upper 3 1 double
1 1 1
POINTS 2 double
0.25 0.25 0.25
0.75 0.75 0.75
POINT_DATA 2
SCALARS radius double 1
LOOKUP_TABLE default
0.2 0.2
"""
LEGACY_BINARY = (
    b"# vtk DataFile Version 3.0\ngrains\nBINARY\nDATASET POLYDATA\nPOINTS 2 double\n"
    + np.array([0.25] * 3 + [0.75] * 3, ">f8").tobytes()
    + b"\nPOINT_DATA 2\nSCALARS radius float 1\nLOOKUP_TABLE default\n"
    + np.array([0.2, 0.2], ">f4").tobytes()
    + b"\n"
)


def written(folder: Path, name: str) -> bytes:
    PACKING.write(folder / name)
    return (folder / name).read_bytes()


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return tmp_path_factory.mktemp("fuzz")


@pytest.fixture(scope="module")
def sound(folder):
    """Sound files of every format, by extension."""
    return {
        ".csv": written(folder, "a.csv"),
        ".txt": written(folder, "a.txt"),
        ".lammps": LAMMPS_DATA.encode(),
        ".dump": LAMMPS_DUMP.encode(),
        ".vtk": LEGACY.encode(),
        ".bin.vtk": LEGACY_BINARY,
        ".units.dump": (f"ITEM: UNITS\ncgs\n{LAMMPS_DUMP}ITEM: TIME\n1\n{LAMMPS_DUMP}").encode(),
        ".mercury": MERCURY.encode() * 2,
        ".geo": ESYS.encode(),
        ".xyz": XYZ.encode() * 2,
        ".edem.csv": EDEM.encode(),
        ".pack.txt": SPHERE_PACK.encode(),
        ".voro.txt": VORO.encode(),
        ".xyzd": XYZD,
        ".csv.gz": gzip.compress(written(folder, "a.csv")),
    }


KINDS = (
    ".csv", ".txt", ".lammps", ".dump", ".vtk", ".bin.vtk", ".units.dump", ".mercury", ".geo", ".xyz", ".edem.csv",
    ".pack.txt", ".voro.txt", ".xyzd", ".csv.gz",
)  # fmt: skip


TEXTS = [
    b"nan", b"inf", b"-inf", b"1e999", b"-1", b"0", b"1e-320", b"99999999999999", b"1_0", b"\xef\xbb\xbf", b"\xc2\xa0",
    b"\x00", b"\xff", b"\r", b"\n", b",", b";", b"\t", b'"', b"#", b"# box_lower = 0 0 0\n", b"ITEM:", b"ITEM: ATOMS",
    b"ITEM: TIMESTEP\n", b"Atoms\n", b"POINTS", b"POINT_DATA 2\n", b"radius", b"BINARY", b"\xe2\x88\x92", b"\xd9\xa3",
    b"ITEM: UNITS\nlj\n", b"(mm)", b"pp pp pp", b"##PERIODIC:: 1 1 1\n", b"PeriodicBoundaries 1 1 1\n", b"Properties=",
    b":R:99999999999", b"BeginParticles\n", b"x y z r\n",
    b"",
]  # fmt: skip

# A change: where (a fraction of the file), how many bytes go, and what comes in their place.
changes = st.lists(
    st.tuples(st.floats(0, 1), st.sampled_from([0, 0, 1, 1, 3, 20, 10**6]), st.sampled_from(TEXTS)), max_size=4
)


def damaged(content: bytes, damage) -> bytes:
    for where, length, text in damage:
        start = int(where * len(content))
        content = content[:start] + text + content[start + length :]
    return content


def read(path: Path, format: str | None = None) -> str:
    """What becomes of a file."""
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", PackingFileWarning)
            packing = read_packing(path, format)
        assert str(packing.reading) and json.dumps(packing.reading.as_data(), allow_nan=False)
        assert np.isfinite(packing.centres).all() and (packing.radii > 0).all()
        if packing.box is not None:
            packing.validate()
    except PorefvError as error:
        assert str(path) in str(error)
        assert len(str(error)) < 2000
        return "refused"
    return "read"


@settings(FUZZ)
@given(kind=st.sampled_from(KINDS), damage=changes)
def test_a_damaged_packing_file_is_read_or_refused(folder, sound, kind, damage):
    path = folder / f"damaged{kind}"
    path.write_bytes(damaged(sound[kind], damage))
    event(f"{kind} {read(path)}")


@settings(FUZZ)
@given(
    format=st.sampled_from([None, *FORMATS]),
    content=st.one_of(st.binary(max_size=200), st.text(max_size=200)),
)
@example(format="lammps", content="\ufeff \n\n")
@example(format="lammps", content="\xa0\n")
def test_any_content_is_read_or_refused_in_any_format(folder, format, content):
    path = folder / "anything"
    path.write_bytes(content.encode("utf-8", "surrogatepass") if isinstance(content, str) else content)
    event(f"{format} {read(path, format)}")


@settings(FUZZ)
@given(damage=changes)
def test_a_damaged_nfo_file_is_read_or_refused(folder, damage):
    path = folder / "with_nfo.xyzd"
    path.write_bytes(XYZD)
    path.with_suffix(".nfo").write_bytes(damaged(NFO.encode(), damage))
    event(read(path))


@settings(FUZZ)
@given(
    kind=st.sampled_from(KINDS),
    options=st.fixed_dictionaries(
        {},
        optional={
            "columns": st.dictionaries(
                st.sampled_from(["x", "y", "z", "radius", "diameter"]),
                st.sampled_from(["x", "1", "2", "4", "Diameter (mm)", "xs", "radius", ""]),
            ),
            "radius": st.sampled_from([0.1, 1e-300, 1e300]),
            "scale": st.sampled_from([1e-3, 1e-300, 1e300]),
            "frame": st.integers(-3, 3),
            "periodic": st.just("ignore"),
        },
    ),
)
def test_any_options_read_a_sound_file_or_are_refused(folder, sound, kind, options):
    path = folder / f"options{kind}"
    path.write_bytes(sound[kind])
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", PackingFileWarning)
            packing = read_packing(path, **options)
        assert np.isfinite(packing.centres).all() and (packing.radii > 0).all()
        event(f"{kind} read")
    except PorefvError as error:
        assert str(path) in str(error)
        event(f"{kind} refused")


PVD = """<?xml version="1.0"?>
<VTKFile type="Collection" version="0.1">
<Collection>
<DataSet timestep="0.0" part="0" file="frame.vtk"/>
<DataSet timestep="1.0" part="0" file="frame.vtk"/>
</Collection>
</VTKFile>
"""


@settings(FUZZ)
@given(damage=changes)
@example(damage=[])
def test_a_damaged_list_of_frames_is_read_or_refused(folder, damage):
    (folder / "frame.vtk").write_text(LEGACY)
    path = folder / "damaged.pvd"
    path.write_bytes(damaged(PVD.encode(), damage))
    event(read(path))


# ---- results -------------------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def solved(folder):
    """A results directory, and its files as they were written."""
    flow = PoreFlow(PACKING, Walls.along("y"), Fluid(1.0))
    directory = results.write(flow, folder / "results", vtk=False)
    return directory, {path.name: path.read_bytes() for path in directory.iterdir()}


JSON = [
    b"null",
    b"[]",
    b"{}",
    b"1e999",
    b"NaN",
    b'"',
    b"true",
    b",",
    b":",
    b"-",
    b"[" * 3000,
    b"{",
    b"}",
    b"\xff",
    b"\x00",
    b"",
]


@settings(FUZZ)
@given(
    damage=st.lists(
        st.tuples(st.floats(0, 1), st.sampled_from([0, 1, 3, 12, 200, 10**6]), st.sampled_from(JSON)),
        min_size=1,
        max_size=4,
    )
)
@example(damage=[(0.0, 0, b"[" * 5000)])
@example(damage=[(0.0, 10**6, b'{"packing": {}}')])
def test_a_damaged_summary_is_told_or_refused(solved, damage):
    directory, files = solved
    (directory / "summary.json").write_bytes(damaged(files["summary.json"], damage))
    said, complained = io.StringIO(), io.StringIO()
    with contextlib.redirect_stdout(said), contextlib.redirect_stderr(complained):
        status = cli.main(["info", str(directory)])
    assert status in (0, 2), complained.getvalue()
    event(f"status {status}")


@settings(FUZZ)
@given(damage=changes)
@example(damage=[(1.0, 0, b"nan")])
@example(damage=[(0.0, 0, b"\xff")])
@example(damage=[(0.3, 1, b"nan")])
@example(damage=[(0.0, 10**6, b"")])
def test_a_damaged_table_of_forces_is_read_or_refused(solved, damage):
    directory, files = solved
    (directory / "summary.json").write_bytes(files["summary.json"])
    (directory / "forces.csv").write_bytes(damaged(files["forces.csv"], damage))
    try:
        table = results.read(directory).forces
        assert table.dtype.names[0] == "id"
        event("read")
    except PorefvError as error:
        assert "forces.csv" in str(error)
        event("refused")


@pytest.fixture(scope="module", params=["npy", "parquet"])
def binary_table(request, folder):
    """The path of a table of forces, and its sound content."""
    if request.param == "parquet":
        pytest.importorskip("pyarrow")
    flow = PoreFlow(PACKING, Walls.along("y"), Fluid(1.0))
    directory = results.write(flow, folder / request.param, vtk=False, table_format=request.param)
    path = directory / f"forces.{request.param}"
    return path, path.read_bytes()


@settings(FUZZ)
@given(damage=changes)
@example(damage=[(0.0, 10**6, b"")])
@example(damage=[(0.0, 6, b"\x93NUMPX")])
@example(damage=[(0.0, 2, b"PK")])
@example(damage=[(0.5, 1, b"")])
@example(damage=[(1.0, 0, b"behind")])
def test_a_damaged_binary_table_of_forces_is_read_or_refused(binary_table, damage):
    path, sound = binary_table
    path.write_bytes(damaged(sound, damage))
    try:
        table = results.read(path.parent).forces
        assert table.dtype.names[0] == "id"
        event("read")
    except PorefvError as error:
        assert path.name in str(error)
        event("refused")


# ---- VTK's XML -----------------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def xml(folder):
    """Sound XML files, by extension: data at the end of the file, and in the text."""
    import pyvista

    PACKING.write(folder / "a.vtp")
    pyvista.read(folder / "a.vtp").cast_to_unstructured_grid().save(folder / "a.vtu", binary=False)
    return {extension: (folder / f"a{extension}").read_bytes() for extension in (".vtp", ".vtu")}


@settings(FUZZ, max_examples=FUZZ.max_examples // 10)  # each reads in a process of its own
@given(
    extension=st.sampled_from([".vtp", ".vtu"]),
    damage=st.lists(
        st.tuples(
            st.floats(0, 1),
            st.sampled_from([0, 0, 1, 1, 3, 20, 10**6]),
            st.sampled_from([*TEXTS, b"9", b"-3", b"<", b">", b"/>", b"PolyData", b"UnstructuredGrid"]),
        ),
        max_size=3,
    ),
)
def test_a_damaged_xml_file_is_read_or_refused(folder, xml, extension, damage):
    path = folder / f"damaged{extension}"
    path.write_bytes(damaged(xml[extension], damage))
    event(f"{extension} {read(path)}")


def test_a_size_that_no_memory_holds_does_not_end_the_program(folder):
    # Digits before a block's header of base64 make VTK ask for 10^17 bytes, and abort.
    path = folder / "damaged.vtp"
    PACKING.write(path)
    content = path.read_bytes()
    header = content.index(b"AQAAAA", content.index(b'Name="offsets"'))
    path.write_bytes(content[:header] + b"99999999999999" + content[header:])
    assert read(path) == "refused"
