"""MercuryDPM, ESyS-Particle, extended XYZ, packing-generation: frames, boxes, and errors by their line."""

import gzip
import warnings

import numpy as np
import pytest

from porefv.errors import InputError, PackingFileWarning

MERCURY = "2 0.5 0 0 -1 1 2 3\n0.1 0.2 0.3 0 0 0 {0} 0 0 0 0 0 0 0\n0.4 0.5 0.6 0 0 0 {0} 0 0 0 0 0 0 0\n"
ESYS = """LSMGeometry 1.2
BoundingBox 0 0 -1 1 2 3
PeriodicBoundaries 0 0 0
Dimension 3D
BeginParticles
Simple
2
0.1 0.2 0.3 0.05 0 1
0.4 0.5 0.6 0.05 1 1
EndParticles
BeginConnect
0
EndConnect
"""
XYZ = (
    '2\nLattice="1 0 0 0 2 0 0 0 4" Origin="0 0 -1" pbc="F F F" '
    "Properties=species:S:1:pos:R:3:radius:R:1:q:R:4 Time=1\n"
    "A 0.1 0.2 0.3 {0} 1 0 0 0\nB 0.4 0.5 0.6 {0} 1 0 0 0\n"
)


@pytest.fixture
def read(read):
    """Read a file with this content, of this name if not of another."""

    def reader(content, name="grains.data", **options):
        return read(content, name, **options)

    return reader


@pytest.mark.parametrize("content", [MERCURY.format(0.05), ESYS, XYZ.format(0.05)], ids=["mercury", "esys", "xyz"])
@pytest.mark.parametrize("name", ["grains.data", "grains.txt", "grains"])
def test_formats_are_known_by_their_content(read, content, name):
    for ends in ("\n", "\r\n"):
        packing = read(content.replace("\n", ends), name)
        np.testing.assert_array_equal(packing.centres, [[0.1, 0.2, 0.3], [0.4, 0.5, 0.6]])
        np.testing.assert_array_equal(packing.radii, 0.05)
        np.testing.assert_array_equal(packing.box.lower, [0, 0, -1])
        np.testing.assert_array_equal(packing.box.upper, [1, 2, 3])


@pytest.mark.parametrize("frame", [MERCURY, XYZ], ids=["mercury", "xyz"])
def test_frame_chooses_and_a_frame_that_is_cut_off_is_left_out(read, frame):
    content = "".join(frame.format(radius) for radius in (0.1, 0.2, 0.3))
    for number, radius in ((None, 0.3), (0, 0.1), (1, 0.2), (-2, 0.2)):
        assert read(content, frame=number).radii[0] == radius
    with pytest.raises(InputError, match="3 frames, 0 to 2"):
        read(content, frame=3)
    for lost in (1, 5, 30, len(frame.format(0.3)) - 2):
        with pytest.warns(PackingFileWarning, match="the last frame is cut off, and the 2 whole before it are kept"):
            packing = read(content[:-lost])
        assert packing.radii[0] == 0.2 and (packing.reading.frame, packing.reading.frames) == (1, 2)


@pytest.mark.parametrize(
    ("content", "said"),
    [
        (MERCURY.format(0.1)[:54], "line 2: 2 spheres declared, 1 given. Was the file cut off?"),
        (MERCURY.format(0.1) + "one more line\n" * 2, "line 4: 'one more line' is not the header of a frame"),
        (MERCURY.format("wide"), "line 2: radius is 'wide', not a number"),
        (MERCURY.format(-1.0), "line 2 (sphere 0): radius -1"),
        (MERCURY.format(0.1).replace("-1 1 2", "-1 one 2"), "line 1: '2 0.5 0 0 -1 one 2 3' has a word"),
        (MERCURY.format(0.1).replace("2 0.5", "999999999999999 0.5"), "999999999999999 spheres declared, 2 given"),
        ("1 0 0 0 1 1\n0.5 0.5 0 0 0.1 0 0 0\n", "line 1: the file is of two dimensions"),
        (ESYS.replace("3D", "2D"), "line 4: the dimension is '2D'. Only 3D is read"),
        (ESYS.replace("Simple\n2\n", "Simple\n3\n"), "line 7: '3' particles declared, 2 given before EndParticles"),
        (ESYS[:120], "line 7: '2' particles declared, 1 given"),
        (ESYS.replace("Simple", "RotSphere"), "line 6: particles of the type Simple are expected"),
        (ESYS.replace("-1 1 2 3", "-1 1 2"), "line 2: BoundingBox must be followed by six numbers"),
        (
            ESYS.replace("0 0 0\nDim", "0 1 0\nDim"),
            "line 3: the packing is periodic along y (PeriodicBoundaries 0 1 0)",
        ),
        (ESYS.replace("0.6 0.05 1 1", "0.6 0.05"), "line 9: 4 cells instead of 6"),
        (XYZ.format(0.1)[:-40], "line 1: 2 spheres declared, 1 given. Was the file cut off?"),
        (XYZ.format(0.1).replace("F F F", "T T F"), 'line 2: the packing is periodic along x, y (pbc="T T F")'),
        (XYZ.format(0.1).replace("1 0 0 0 2", "1 0.1 0 0 2"), "line 2: the box is tilted"),
        (XYZ.format(0.1).replace("1 0 0 0 2", "1 0 0 2"), "line 2: Lattice must be nine numbers"),
        (XYZ.format(0.1).replace("radius:R", "mass:R"), "line 2: the columns are 'species,x,y,z,mass,q:0,q:1,q:2,q:3'"),
        (XYZ.format(0.1).replace("q:R:4", "q:R:9999999"), "line 2: Properties must be name:type:count groups"),
        (XYZ.format(0.1).replace("q:R:4", "q:R"), "line 2: Properties must be name:type:count groups"),
        (XYZ.format("wide"), "line 3: radius is 'wide', not a number"),
        (XYZ.format(0.1).replace("A 0.1", "# 0.1"), "a line among them is blank or a comment"),
        ("999999999999999" + XYZ.format(0.1)[1:], "999999999999999 spheres declared, 2 given"),
    ],
)
def test_a_bad_file_is_refused_by_its_line(read, content, said):
    with pytest.raises(InputError) as caught:
        read(content)
    assert said in str(caught.value) and "grains.data" in str(caught.value) and "\n" not in str(caught.value)[:100]


def test_periodic_boundaries_are_ignored_on_demand(read):
    for content in (ESYS.replace("0 0 0\nDim", "1 1 1\nDim"), XYZ.format(0.1).replace("F F F", "1 1 1")):
        assert read(content, periodic="ignore").reading.periodicity.startswith("periodic along x, y, z")


def test_a_lattice_without_pbc_is_periodic_as_ase_reads_it(read):
    content = XYZ.format(0.1).replace('pbc="F F F" ', "")
    with pytest.raises(InputError, match=r"line 2: the packing is periodic along x, y, z \(Lattice without pbc"):
        read(content)
    assert "Lattice without pbc" in read(content, periodic="ignore").reading.periodicity
    assert read(XYZ.format(0.1)).reading.periodicity == ""
    tilted = read(content.replace("1 0 0 0 2", "1 0.1 0 0 2"), periodic="cell").box
    np.testing.assert_array_equal(tilted.vectors[0], [1, 0.1, 0])
    assert read(content, periodic="cell").box.is_orthogonal


@pytest.mark.parametrize(
    ("key", "axes"),
    [
        ('periodic="T T T"', "x, y, z"), ('boundary="pp ff pp"', "x, z"), ('pbc = "T F F"', "x"), ("pbc='F T F'", "y"),
        ('pbc="[true, true, false]"', "x, y"), ("pbc=T", "x, y, z"),
    ],
)  # fmt: skip
def test_periodic_boundaries_by_other_keys_and_forms(read, key, axes):
    content = XYZ.format(0.1).replace('pbc="F F F"', key)
    with pytest.raises(InputError, match=f"line 2: the packing is periodic along {axes} "):
        read(content)
    assert len(read(content, periodic="ignore")) == 2


def test_a_value_of_pbc_that_is_not_understood_is_refused(read):
    with pytest.raises(InputError, match="line 2: pbc='2 2' is not understood. Write pbc="):
        read(XYZ.format(0.1).replace('"F F F"', '"2 2"'))


def test_whole_frames_of_a_gzip_file_that_is_cut_off_are_read(read):
    rng = np.random.default_rng(0)
    rows = "".join("{:.17g} {:.17g} {:.17g} 0 0 0 0.1 0 0 0 0 0 0 0\n".format(*rng.random(3)) for _ in range(400))
    frames = f"400 0 0 0 0 1 1 1\n{rows}" + f"400 1 0 0 0 1 1 1\n{rows}"
    compressed = gzip.compress(frames.encode())
    with pytest.warns(
        PackingFileWarning, match="the gzip file is cut off, and only its beginning is read: 1 whole frame"
    ):
        packing = read(compressed[: -len(compressed) // 4], "a.data.gz")
    assert len(packing) == 400 and packing.reading.frames == 1
    with pytest.raises(InputError, match="the gzip file is cut off. Make or fetch it again"):
        read(compressed[: len(compressed) // 4], "a.data.gz")  # within the first frame
    with pytest.raises(InputError, match="the gzip file is cut off. Make or fetch it again"):
        read(gzip.compress(f"x,y,z,r\n{rows}".encode())[:-20], "a.csv.gz")  # a table has no number of its spheres


def test_plain_xyz_needs_a_radius(read):
    content = "2\nmade by hand\nA 1 2 3\nB 4 5 6\n"
    np.testing.assert_array_equal(read(content, "a.xyz", radius=0.5).centres, [[1, 2, 3], [4, 5, 6]])
    with pytest.raises(InputError, match="there is no radius or diameter"):
        read(content, "a.xyz")
    assert read(content.replace("3\n", "3 9\n").replace("6\n", "6 9\n"), "a.xyz", columns={"radius": "5"}).radii[0] == 9


# ---- packing-generation ------------------------------------------------------------------------------------

SPHERES = np.array([[0.1, 0.2, 0.3, 0.1], [0.4, 0.5, 0.6, 0.2]], "<f8").tobytes()


@pytest.fixture
def read_xyzd(tmp_path, read):
    """Read doubles with this information beside them."""

    def reader(nfo, content=SPHERES, **options):
        (tmp_path / "a.nfo").write_text(nfo)
        return read(content, "a.xyzd", periodic="ignore", **options)

    return reader


def test_diameters_of_packing_generation_grow_to_the_final_porosity(read_xyzd):
    nfo = "N: 2\nDimensions: 1 2 3\nTheoretical Porosity: 0.5\nFinal Porosity: 0.4\nTime: 1 s\n"
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        packing = read_xyzd(nfo)
    np.testing.assert_allclose(packing.radii, np.array([0.05, 0.1]) * 1.2 ** (1 / 3), rtol=1e-15)
    np.testing.assert_array_equal(packing.box.upper, [1, 2, 3])
    assert "diameters multiplied by 1.06265857" in str(packing.reading)


def test_without_an_nfo_file_there_is_no_box(read):
    assert read(SPHERES, "b.xyzd", periodic="ignore").box is None
    packing = read(gzip.compress(SPHERES), "b.xyzd.gz", periodic="ignore")
    np.testing.assert_array_equal(packing.radii, [0.05, 0.1])


@pytest.mark.parametrize(
    ("nfo", "content", "said"),
    [
        ("N: 3\nDimensions: 1 1 1\n", SPHERES, "it has 2 spheres, and .*a.nfo, line 1, says '3'"),
        ("N: 2\nDimensions: 1 1\n", SPHERES, "a.nfo, line 2: 3 numbers are expected, not '1 1'"),
        ("Theoretical Porosity: 1\nFinal Porosity: 0.4\n", SPHERES, "states porosities 1 and 0.4, not below 1"),
        ("N: 2\n", SPHERES[:-3], "61 bytes are no multiple of the 32 of a sphere. Was it cut off"),
        ("N: 2\n", b"0.1 0.2 0.3 0.4\n0.1 0.2 0.3 0.4\n", "text, and an .xyzd file holds binary numbers"),
        ("N: 2\n", SPHERES[::-1], "a.xyzd: "),
    ],
)
def test_bad_doubles_are_refused(read_xyzd, nfo, content, said):
    with pytest.raises(InputError, match=said):
        read_xyzd(nfo, content)


# ---- gzip --------------------------------------------------------------------------------------------------


def test_damaged_gzip_files_are_refused(read):
    compressed = gzip.compress(MERCURY.format(0.1).encode())
    assert read(compressed + gzip.compress(MERCURY.format(0.2).encode()), "a.data.gz").radii[0] == 0.2  # two members
    for content, said in (
        (compressed[:-15], "the gzip file is cut off"),
        (compressed[:15] + b"\xff" + compressed[16:], "the gzip file is damaged"),
        (compressed + b"junk", "the gzip file is damaged"),
        (gzip.compress(b"0" * 10**6), "compressed to less than 1/200 of its size"),
        (gzip.compress(b" \n"), "the file is empty"),
    ):
        with pytest.raises(InputError, match=said):
            read(content, "a.data.gz")


def test_a_unit_in_the_comment_of_extended_xyz_is_honoured(read):
    for key in ("units=mm", "Unit=mm", 'length_unit="mm"', "UnitLength=mm", "units: mm", "units='mm'", "units = mm"):
        packing = read(XYZ.format(0.1).replace("Time=1", key), "grains.xyz")
        np.testing.assert_allclose(packing.radii, 1e-4, rtol=1e-15)
        np.testing.assert_allclose(packing.box.upper, [1e-3, 2e-3, 3e-3], rtol=1e-15)
    with pytest.raises(InputError, match=r"line 2: lengths are in 'furlong'.* as scale"):
        read(XYZ.format(0.1).replace("Time=1", "units=furlong"), "grains.xyz")


def test_a_row_too_many_is_not_called_a_frame_that_is_cut_off(read):
    row = "0.7 0.8 0.9 0 0 0 0.1 0 0 0 0 0 0 0\n"
    with pytest.raises(
        InputError, match="line 4: a row of a sphere where the frame ends. Its header, line 1, declares 2"
    ):
        read(MERCURY.format(0.1) + row)


def test_one_frame_of_xyz_without_a_line_end_is_warned_of(read):
    content = "1\nProperties=pos:R:3:radius:R:1\n0.1 0.2 0.3 0.12"
    with pytest.warns(PackingFileWarning, match="line 3: the last line has no line end"):
        read(content, "grains.xyz")
