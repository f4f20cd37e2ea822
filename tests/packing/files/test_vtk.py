import gzip
import warnings

import numpy as np
import pytest

from porefv.errors import InputError, PackingFileWarning
from porefv.packing.box import Box
from porefv.packing.packing import Packing

pyvista = pytest.importorskip("pyvista")

CENTRES = np.array([[0.1, 0.2, 0.3], [0.7, 1 / 3, 0.5]])


@pytest.fixture
def points():
    """Points with a radius and a box."""
    mesh = pyvista.PolyData(CENTRES)
    mesh.point_data["radius"] = [0.05, 0.1]
    mesh.field_data["box_lower"] = [0.0, 0.0, 0.0]
    mesh.field_data["box_upper"] = [1.0, 2.0, 3.0]
    return mesh


@pytest.mark.parametrize("extension", ["vtp", "vtk", "vtu"])
@pytest.mark.parametrize("binary", [True, False])
def test_points_radii_and_box_are_read(tmp_path, points, extension, binary):
    mesh = points.cast_to_unstructured_grid() if extension == "vtu" else points
    mesh.save(tmp_path / f"a.{extension}", binary=binary)
    packing = Packing.read(tmp_path / f"a.{extension}")
    # ASCII files hold fewer digits than float64.
    np.testing.assert_allclose(packing.centres, CENTRES, rtol=0 if binary else 1e-5)
    np.testing.assert_allclose(packing.radii, [0.05, 0.1], rtol=0 if binary else 1e-5)
    np.testing.assert_array_equal(packing.box.upper, [1, 2, 3])


@pytest.mark.parametrize(("name", "factor"), [("radii", 1), ("Radius", 1), ("r", 1), ("Diameter", 0.5)])
def test_names_of_radii_and_diameters(tmp_path, name, factor):
    mesh = pyvista.PolyData(CENTRES.astype(np.float32))
    mesh.point_data[name] = np.array([0.5, 1], dtype=np.float32)
    mesh.point_data["id"] = [7, 8]
    mesh.save(tmp_path / "a.vtp")
    packing = Packing.read(tmp_path / "a.vtp")
    np.testing.assert_array_equal(packing.radii, [0.5 * factor, 1 * factor])
    assert packing.box is None and packing.centres.dtype == np.float64


def test_a_file_written_by_meshio_is_read(tmp_path):
    meshio = pytest.importorskip("meshio")
    mesh = meshio.Mesh(CENTRES, [("vertex", [[0], [1]])], point_data={"radius": np.array([0.05, 0.1])})
    mesh.write(tmp_path / "a.vtu")
    np.testing.assert_array_equal(Packing.read(tmp_path / "a.vtu").radii, [0.05, 0.1])


def test_what_is_written_opens_in_pyvista_with_a_vertex_a_sphere(tmp_path):
    Packing(CENTRES, [0.05, 0.1], Box([0, 0, 0], [1, 1, 1])).write(tmp_path / "a.vtp")
    mesh = pyvista.read(tmp_path / "a.vtp")
    assert mesh.n_verts == 2
    np.testing.assert_array_equal(mesh["radius"], [0.05, 0.1])


@pytest.mark.parametrize("extension", ["vtp", "vtk", "vtu"])
def test_what_is_written_is_read_back_to_the_bit(tmp_path, extension):
    rng = np.random.default_rng(1)
    packing = Packing(rng.random((20, 3)), 0.1 * rng.random(20) + 0.01, Box([0, -1, 0], [1, 1, 3]))
    packing.write(tmp_path / f"a.{extension}")
    again = Packing.read(tmp_path / f"a.{extension}")
    np.testing.assert_array_equal(again.centres, packing.centres)
    np.testing.assert_array_equal(again.radii, packing.radii)
    np.testing.assert_array_equal(again.box.upper, [1, 1, 3])


def test_missing_or_wrong_arrays_are_refused_with_those_there_are(tmp_path, points):
    def error():
        points.save(tmp_path / "a.vtp")
        with pytest.raises(InputError) as caught:
            Packing.read(tmp_path / "a.vtp")
        return str(caught.value)

    points.point_data["diameter"] = [0.1, 0.4]
    assert "the columns 'radius' and 'diameter' disagree" in error()
    del points.point_data["diameter"]
    points.point_data["radius"] = [0.1, -0.1]
    assert "sphere 1: radius -0.1" in error()
    points.point_data["radius"] = np.ones((2, 3))
    assert "must have one component" in error()
    del points.point_data["radius"]
    points.point_data["mass"] = [1, 2]
    assert "point data: 'mass', and there is no radius" in error()
    points.point_data["radius"] = [0.1, 0.1]
    points.field_data["box_upper"] = [1.0, 0.0, 1.0]
    assert "the box has size 0 m along y" in error()
    del points.field_data["box_upper"]
    assert "field data box_upper is missing" in error()


@pytest.mark.parametrize("extension", ["vtp", "vtk", "vtu"])
def test_a_damaged_file_is_refused_and_vtk_prints_nothing(tmp_path, points, extension, capfd, caplog):
    mesh = points.cast_to_unstructured_grid() if extension == "vtu" else points
    mesh.save(tmp_path / f"a.{extension}")
    content = (tmp_path / f"a.{extension}").read_bytes()
    for size in range(30, len(content) - 100, len(content) // 7):
        (tmp_path / f"b.{extension}").write_bytes(content[:size])
        with pytest.raises(InputError, match=f"b.{extension}") as caught:
            Packing.read(tmp_path / f"b.{extension}")
        assert "\n" not in str(caught.value)
    assert capfd.readouterr() == ("", "") and not caplog.records


@pytest.mark.parametrize("encoding", ["ASCII", "BINARY"])
def test_a_field_that_is_said_to_be_larger_than_the_file_is_refused(tmp_path, encoding):
    huge = 10**15 - 1
    (tmp_path / "a.vtk").write_text(
        f"# vtk DataFile Version 3.0\ntitle\n{encoding}\nDATASET POLYDATA\nPOINTS 1 float\n0 0 0 \n"
        f"POINT_DATA 1\nFIELD FieldData 1\nradius {huge} {huge} float\n1\n"
    )
    with pytest.raises(InputError, match=r"a\.vtk: radius is said to have 1e\+30 numbers, more than the file"):
        Packing.read(tmp_path / "a.vtk")


def test_another_data_set_is_refused(tmp_path):
    pyvista.MultiBlock([pyvista.Sphere()]).save(tmp_path / "a.vtm")
    with pytest.raises(InputError, match="a.vtm"):
        Packing.read(tmp_path / "a.vtm", format="vtk")


def test_the_array_of_the_radius_can_be_mapped_and_lengths_scaled(tmp_path, points):
    points.point_data["size"] = [0.2, 0.4]
    points.point_data["x"] = [7.0, 8.0]  # no coordinate
    points.save(tmp_path / "a.vtp")
    packing = Packing.read(tmp_path / "a.vtp", columns={"diameter": "size"}, scale=10.0)
    np.testing.assert_allclose(packing.radii, [1.0, 2.0], rtol=1e-15)
    np.testing.assert_allclose(packing.centres, 10 * CENTRES, rtol=1e-15)
    with pytest.raises(InputError, match="the points of a VTK file are the centres"):
        Packing.read(tmp_path / "a.vtp", columns={"x": "size"})
    with pytest.warns(PackingFileWarning, match="the radius given is used"):
        assert Packing.read(tmp_path / "a.vtp", radius=0.3).radii[0] == 0.3
    (tmp_path / "a.vtp.gz").write_bytes(gzip.compress((tmp_path / "a.vtp").read_bytes()))
    assert len(Packing.read(tmp_path / "a.vtp.gz")) == 2


LEGACY = """# vtk DataFile Version 3.0
spheres
ASCII
DATASET POLYDATA
POINTS 2 double
0 0 0
1 1 1
POINT_DATA 2
SCALARS radius double 1
LOOKUP_TABLE default
0.25
0.375"""


def test_the_last_number_of_a_legacy_file_without_a_line_end_is_warned_of(tmp_path):
    file = tmp_path / "grains.vtk"
    file.write_text(LEGACY)
    with pytest.warns(PackingFileWarning, match="may have lost digits"):
        Packing.read(file)
    with warnings.catch_warnings():
        warnings.simplefilter("error", PackingFileWarning)
        for whole in (LEGACY + "\n", LEGACY + "\nMETADATA"):
            file.write_text(whole)
            np.testing.assert_array_equal(Packing.read(file).radii, [0.25, 0.375])


def test_the_last_whole_frame_of_a_list_is_read(tmp_path):
    for name, text in (("0.vtk", LEGACY + "\n"), ("1.vtk", LEGACY[:-8])):
        (tmp_path / name).write_text(text)
    frames = "".join(f'<DataSet timestep="{k}" file="{k}.vtk"/>' for k in range(2))
    (tmp_path / "grains.pvd").write_text(f'<VTKFile type="Collection"><Collection>{frames}</Collection></VTKFile>')
    with pytest.warns(PackingFileWarning, match="'1.vtk': the last frame is cut off"):
        packing = Packing.read(tmp_path / "grains.pvd")
    assert (packing.reading.frame, packing.reading.frames) == (0, 1)
    with pytest.raises(InputError, match="its frame 1 cannot be read"):
        Packing.read(tmp_path / "grains.pvd", frame=1)


def test_the_title_of_a_legacy_file_may_state_a_unit(tmp_path):
    file = tmp_path / "grains.vtk"
    file.write_text(LEGACY.replace("spheres", "spheres, units = mm", 1) + "\n")
    np.testing.assert_allclose(Packing.read(file).radii, [0.25e-3, 0.375e-3], rtol=1e-15)
    file.write_text(LEGACY.replace("spheres", "voxel size = 5 um", 1) + "\n")
    with pytest.raises(InputError, match=r"line 2: 'voxel size = 5 um' names a unit or a scale .* as scale"):
        Packing.read(file)


def test_percent_signs_in_names_are_decoded(tmp_path):
    file = tmp_path / "grains.vtk"
    file.write_text(LEGACY.replace("SCALARS radius", "SCALARS radius%20(mm)") + "\n")
    with pytest.raises(InputError, match=r"'radius \(mm\)' states a unit, and 'x' states none"):
        Packing.read(file)
    np.testing.assert_allclose(Packing.read(file, scale=2.0).radii, [0.5, 0.75], rtol=1e-15)


def test_of_a_list_that_is_cut_off_the_whole_entries_are_read(tmp_path):
    (tmp_path / "0.vtk").write_text(LEGACY + "\n")
    entries = "".join(f'<DataSet timestep="{k}" file="{k}.vtk"/>\n' for k in range(2))
    content = f'<VTKFile type="Collection"><Collection>\n{entries}</Collection></VTKFile>'
    for cut in (content[:-40], content[:-30].replace('"1.vtk"', '"0.vtk"')[:90]):
        (tmp_path / "grains.pvd").write_text(cut)
        with pytest.warns(PackingFileWarning, match=r"line \d: the last frame is cut off, and the whole one before"):
            packing = Packing.read(tmp_path / "grains.pvd")
        assert packing.reading.frames == 1 and "cut off" in packing.reading.notes[-1]
