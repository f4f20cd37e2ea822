"""Results for other programs: the network and the mesh, from the files of a results directory."""

from pathlib import Path

import numpy as np
import pytest

from porefv import results
from porefv.cli import export as command
from porefv.errors import InputError
from porefv.flow.pore_flow import PoreFlow
from porefv.flow.walls import Wall, Walls
from porefv.packing.packing import Packing
from porefv.results.exporting import FORMATS, MESH_FORMATS, export, to_openpnm

pytest.importorskip("pyvista")
PACKINGS = Path(__file__).parents[2] / "data" / "packings"


@pytest.fixture(scope="module")
def flow():
    return PoreFlow(Packing.read(PACKINGS / "n54_s1.csv"), Walls(y_min=Wall(2.0), y_max=Wall(0.0), x_min=Wall(1.0)))


@pytest.fixture(scope="module")
def found(flow, tmp_path_factory):
    directory = tmp_path_factory.mktemp("export") / "results"
    return results.read(results.write(flow, directory, quantities=["pressure"]))


def test_the_network_of_the_files_is_that_of_the_flow_to_the_last_bit(flow, found):
    there, here = to_openpnm(found), flow.to_openpnm()
    assert set(there) == set(here)
    for key, values in here.items():
        np.testing.assert_array_equal(there[key], values, err_msg=key)
        assert there[key].dtype == values.dtype


def test_a_npz_file_has_the_arrays_of_the_dictionary(flow, found, tmp_path):
    (path,) = export(found, tmp_path / "network.npz", "openpnm")
    with np.load(path) as arrays:  # refuses pickles
        assert set(arrays) == set(flow.to_openpnm())
        np.testing.assert_array_equal(arrays["throat.conns"], flow.to_openpnm()["throat.conns"])


def test_csv_files_have_a_row_for_each_pore_and_each_throat(flow, found, tmp_path):
    pores, throats = export(found, tmp_path / "a" / "network", "csv")
    table = np.genfromtxt(pores, delimiter=",", names=True)
    np.testing.assert_array_equal(table["volume"], flow.mesh.pore_volumes)
    np.testing.assert_array_equal(table["pressure"], flow.pressure)
    np.testing.assert_array_equal(table["velocity_y"], flow.pore_velocity[:, 1])
    np.testing.assert_array_equal(table["x_min"], flow.mesh.pore_walls & 1)
    np.testing.assert_array_equal(np.stack([table[x] for x in "xyz"], axis=1), flow.mesh.pore_centres)
    table = np.genfromtxt(throats, delimiter=",", names=True)
    np.testing.assert_array_equal(table["flux"], flow.flux)
    np.testing.assert_array_equal(table["conductance"], flow.conductances)
    np.testing.assert_array_equal(table["second_pore"], flow.mesh.throats.pores[:, 1])


@pytest.mark.parametrize("extension", MESH_FORMATS)
def test_meshes_have_every_cell_and_none_is_inside_out(flow, found, tmp_path, extension):
    meshio = pytest.importorskip("meshio")
    (path,) = export(found, tmp_path / f"pores.{extension}", extension)
    mesh = meshio.read(path)
    assert sum(len(block.data) for block in mesh.cells) == flow.mesh.n_cells
    if extension in ("vtk", "vtu"):
        assert set(mesh.cell_data) == {"pore", "volume", "walls", "pressure", "velocity"}
        return  # VTK orders wedges another way than the others
    # The first nodes of a cell and one across are in the same sense in each: cells are not inside out.
    across = {"tetra": 3, "wedge": 3, "hexahedron": 4}
    for block in mesh.cells:
        a, b, c, d = (mesh.points[block.data[:, k]] for k in (0, 1, 2, across[block.type]))
        assert (np.einsum("ij,ij->i", np.cross(b - a, c - a), d - a) > 0.0).all()


@pytest.mark.parametrize("extension", ["vtk", "vtu"])
def test_vtk_finds_cells_of_meshio_valid(flow, found, tmp_path, extension):
    pyvista = pytest.importorskip("pyvista")
    pytest.importorskip("meshio")
    grid = pyvista.read(export(found, tmp_path / f"pores.{extension}", extension)[0])
    assert grid.validate_mesh().invalid_fields == ()
    assert grid.volume == pytest.approx(flow.mesh.box.volume, rel=1e-9)


@pytest.mark.parametrize(("to", "name"), [("openpnm", "network.npz"), ("csv", "network"), ("vtu", "pores.vtu")])
def test_files_that_exist_are_replaced_by_force_only(found, tmp_path, to, name):
    first = export(found, tmp_path / name, to)
    first[-1].write_text("precious")
    with pytest.raises(InputError, match="exists.*replace it with force=True"):
        export(found, tmp_path / name, to)
    assert first[-1].read_text() == "precious"
    assert export(found, tmp_path / name, to, force=True) == first
    assert first[-1].read_bytes() != b"precious"


@pytest.mark.parametrize(("to", "name"), [("openpnm", "network.csv"), ("msh", "pores.vtu"), ("vtu", "pores")])
def test_the_extension_must_be_that_of_the_format(found, tmp_path, to, name):
    with pytest.raises(InputError, match="need a name that ends in"):
        export(found, tmp_path / name, to)
    assert list(tmp_path.iterdir()) == []


def test_csv_needs_a_directory(found, tmp_path):
    (tmp_path / "file").write_text("")
    with pytest.raises(InputError, match="csv needs a directory"):
        export(found, tmp_path / "file", "csv")


def test_unknown_formats_are_refused(found, tmp_path):
    with pytest.raises(InputError, match="unknown format 'stl'; known: openpnm, csv"):
        export(found, tmp_path / "pores.stl", "stl")


def test_results_without_vtk_files_are_refused(flow, tmp_path):
    written = results.read(results.write(flow, tmp_path / "results", quantities=["pressure"], vtk=False))
    with pytest.raises(InputError, match=r"has no throats\.vtp: set vtk = true in the scene's \[output\]"):
        export(written, tmp_path / "network.npz", "openpnm")
    assert not (tmp_path / "network.npz").exists()


def test_without_the_quantity_pressure_the_network_has_no_pressures(flow, tmp_path):
    written = results.read(results.write(flow, tmp_path / "results", quantities=["forces"]))
    there, here = to_openpnm(written), flow.to_openpnm()
    assert set(here) - set(there) == {"pore.pressure"}


def test_the_command_has_the_formats_of_the_function():
    assert command.FORMATS == FORMATS


@pytest.mark.parametrize("extension", ["vtk", "vtu"])
def test_pyvista_finds_the_pressures_and_velocities_of_the_pores_in_the_cells(flow, found, tmp_path, extension):
    pyvista = pytest.importorskip("pyvista")
    pytest.importorskip("meshio")
    grid = pyvista.read(export(found, tmp_path / f"pores.{extension}", extension)[0])
    pores = grid.cell_data["pore"]
    assert grid.n_cells == flow.mesh.n_cells and set(pores) == set(range(flow.mesh.n_pores))
    np.testing.assert_array_equal(grid.cell_data["pressure"], flow.pressure[pores])
    np.testing.assert_allclose(grid.cell_data["velocity"], flow.pore_velocity[pores], rtol=1e-12)


def test_pyvista_finds_the_spheres_and_their_radii_in_the_results(flow, found):
    pyvista = pytest.importorskip("pyvista")
    (path,) = Path(found.directory).rglob("spheres.vtp")
    spheres = pyvista.read(path)
    np.testing.assert_array_equal(spheres.points, flow.mesh.packing.centres)
    np.testing.assert_array_equal(spheres.point_data["radius"], flow.mesh.packing.radii)
