from pathlib import Path

import numpy as np
import pytest

from porefv.errors import InputError
from porefv.export.vtk_datasets import cells_grid, flux_data, spheres_polydata, throats_polydata, write_paths
from porefv.export.vtk_files import FORMAT_VERSION, attach_provenance, write_xml
from porefv.flow.pore_flow import PoreFlow
from porefv.flow.walls import Walls
from porefv.mesh.polyhedra import HEXAHEDRON, TETRA, WEDGE, polyhedra
from porefv.mesh.pore_mesh import PoreMesh
from porefv.packing.box import Box
from porefv.packing.packing import Packing
from porefv.system.version import __version__

pyvista = pytest.importorskip("pyvista")
PACKINGS = Path(__file__).parents[2] / "data" / "packings"
BRICK = Box([-1.0, 0.0, 2.0], [1.0, 3.0, 2.5])


def one_sphere():
    return Packing([[0.3, 1.0, 2.2]], [0.1], BRICK)


def two_spheres():
    return Packing([[0.3, 1.0, 2.2], [-0.5, 2.0, 2.3]], [0.1, 0.15], BRICK)


def coplanar():
    return Packing([[x, y, 2.25] for x in (-0.5, 0.1, 0.6) for y in (0.5, 1.3, 2.2)], [0.2] * 9, BRICK)


def read(name):
    return lambda: Packing.read(PACKINGS / name)


CASES = {
    "one": one_sphere,
    "two": two_spheres,
    "coplanar": coplanar,
    "n25": read("n25_s1.csv"),
    "n200": read("n200_s1.csv"),
    "lattice": read("sc8.csv"),
    "nine": read("nine_0.72.csv"),
}


@pytest.fixture(params=CASES, ids=str)
def mesh(request):
    return PoreMesh(CASES[request.param]())


def test_vtk_finds_every_cell_valid(mesh):
    # Positive volumes, convex, faces outwards, no node without a cell: by VTK's own judgement.
    grid = mesh.to_pyvista()
    assert grid.validate_mesh().invalid_fields == ()


def test_cells_are_positively_oriented_and_have_the_volumes_of_the_mesh(mesh):
    volumes = mesh.to_pyvista().compute_cell_sizes()["Volume"]
    assert volumes.min() > 0.0
    np.testing.assert_allclose(volumes, mesh.cell_volumes, rtol=1e-9, atol=1e-12 * mesh.box.volume)
    assert volumes.sum() == pytest.approx(mesh.box.volume, rel=1e-13)


def test_mesh_conforms_its_surface_is_that_of_the_box(mesh):
    # A face that is not shared exactly would count as surface.
    surface = mesh.to_pyvista().extract_surface(algorithm="geometry")
    sides = 2.0 * sum(mesh.box.section(axis) for axis in range(3))
    assert surface.area == pytest.approx(sides, rel=1e-12)
    np.testing.assert_array_equal(
        np.reshape(surface.bounds, (3, 2)), np.stack([mesh.box.lower, mesh.box.upper], axis=1)
    )


def test_one_sphere_makes_eight_boxes_from_its_centre_to_the_corners():
    solids = polyhedra(PoreMesh(one_sphere()))
    assert list(solids.types) == [HEXAHEDRON] * 8
    assert len(solids.points) == 27
    np.testing.assert_array_equal(solids.points[0], [0.3, 1.0, 2.2])


def test_cells_are_tetrahedra_wedges_and_hexahedra_by_their_number_of_walls():
    mesh = PoreMesh(Packing.read(PACKINGS / "n25_s1.csv"))
    walls = np.count_nonzero(mesh.cells >= mesh.n_spheres, axis=1)
    expected = np.array([TETRA, WEDGE, HEXAHEDRON, HEXAHEDRON])[walls]
    np.testing.assert_array_equal(polyhedra(mesh).types, expected)
    np.testing.assert_array_equal(mesh.to_pyvista().celltypes, expected)


def test_points_of_the_spheres_come_first():
    mesh = PoreMesh(Packing.read(PACKINGS / "n25_s1.csv"))
    np.testing.assert_array_equal(polyhedra(mesh).points[:25], mesh.packing.centres)


def test_meshio_has_the_same_cells_and_survives_a_file(mesh, tmp_path):
    pytest.importorskip("meshio")
    found = mesh.to_meshio()
    assert sum(len(block) for block in found.cells) == mesh.n_cells
    ids = np.concatenate(found.cell_data["cell"])
    np.testing.assert_array_equal(np.concatenate(found.cell_data["pore"]), mesh.cell_pore[ids])
    found.write(tmp_path / "mesh.vtu")
    grid = pyvista.read(tmp_path / "mesh.vtu")
    volumes = grid.compute_cell_sizes()["Volume"]
    np.testing.assert_allclose(volumes, mesh.cell_volumes[ids], rtol=1e-9, atol=1e-12 * mesh.box.volume)


def test_cell_data_may_be_given_per_cell_or_per_pore():
    mesh = PoreMesh(Packing.read(PACKINGS / "sc8.csv"))
    assert mesh.n_pores < mesh.n_cells
    grid = mesh.to_pyvista(volume=mesh.pore_volumes, rank=np.arange(mesh.n_cells))
    np.testing.assert_array_equal(grid["pore"], mesh.cell_pore)
    np.testing.assert_array_equal(grid["volume"], mesh.pore_volumes[mesh.cell_pore])
    np.testing.assert_array_equal(grid["rank"], np.arange(mesh.n_cells))
    with pytest.raises(InputError, match="'volume' has 3 rows"):
        mesh.to_pyvista(volume=np.zeros(3))


def test_network_has_a_point_per_pore_and_a_line_per_throat():
    flow = PoreFlow(Packing.read(PACKINGS / "n200_s1.csv"), Walls.along("y"))
    throats = flow.mesh.throats
    network = pyvista.wrap(throats_polydata(throats, flux=flow.flux))
    assert network.n_points == flow.mesh.n_pores
    np.testing.assert_array_equal(network["volume"], flow.mesh.pore_volumes)
    np.testing.assert_array_equal(network["pore"], np.arange(flow.mesh.n_pores))
    np.testing.assert_array_equal(network.lines.reshape(-1, 3)[:, 1:], throats.pores)
    np.testing.assert_array_equal(network.cell_data["flux"], flow.flux)
    lines = np.diff(network.points[throats.pores], axis=1)[:, 0]
    single = np.bincount(flow.mesh.cell_pore)[throats.pores].max(axis=1) == 1
    np.testing.assert_allclose(lines[single], throats.lengths[single, None] * throats.normals[single], atol=1e-12)


def test_spheres_carry_their_ids_and_radii():
    packing = two_spheres()
    points = pyvista.wrap(spheres_polydata(packing, weight=np.array([1.0, 2.0])))
    np.testing.assert_array_equal(points.points, packing.centres)
    np.testing.assert_array_equal(points["radius"], packing.radii)
    np.testing.assert_array_equal(points["id"], [0, 1])
    np.testing.assert_array_equal(points["weight"], [1.0, 2.0])
    assert points.n_verts == 2


def test_fluxes_of_the_network_are_speeds_through_necks():
    flow = PoreFlow(Packing.read(PACKINGS / "n200_s1.csv"), Walls.along("y"))
    throats = flow.mesh.throats
    data = flux_data(throats, flow.flux, flow.walls.slip)
    areas = np.pi * data["neck_radius"] ** 2
    np.testing.assert_allclose(areas[~throats.closed], throats.fluid_areas[~throats.closed])
    np.testing.assert_allclose(data["speed"] * areas, np.where(throats.closed, 0.0, abs(flow.flux)))
    np.testing.assert_array_equal(data["inscribed_radius"], throats.inscribed_radii(flow.walls.slip))


@pytest.mark.parametrize("name", ["spheres.vtp", "pores.vtu"])
def test_field_data_say_where_a_file_comes_from(tmp_path, name):
    mesh = PoreMesh(two_spheres())
    grid = cells_grid(mesh, pressure=np.ones(mesh.n_pores))
    dataset = grid if name == "pores.vtu" else spheres_polydata(mesh.packing)
    attach_provenance(dataset, {"scene": "bläh.toml", "viscosity": 2.0})
    write_xml(dataset, tmp_path / name)
    fields = pyvista.read(tmp_path / name).field_data
    assert fields["scene"][0] == "bläh.toml" and fields["viscosity"][0] == 2.0
    assert fields["format_version"][0] == FORMAT_VERSION and fields["porefv_version"][0] == __version__
    assert list(fields["units"]) == (["pressure: Pa"] if name == "pores.vtu" else ["radius: m"])


def test_files_are_binary_and_compressed(tmp_path):
    mesh = PoreMesh(Packing.read(PACKINGS / "n200_s1.csv"))
    write_xml(cells_grid(mesh), tmp_path / "pores.vtu")
    content = (tmp_path / "pores.vtu").read_bytes()
    assert b'<AppendedData encoding="raw">' in content
    assert b"vtkLZ4DataCompressor" in content
    assert pyvista.read(tmp_path / "pores.vtu").n_cells == mesh.n_cells


def test_arrays_of_another_number_of_rows_are_refused():
    mesh = PoreMesh(two_spheres())
    with pytest.raises(InputError, match=r"force must have 2 rows, not shape \(3, 3\)"):
        spheres_polydata(mesh.packing, force=np.zeros((3, 3)))
    with pytest.raises(InputError, match=rf"flux must have {len(mesh.throats)} rows, not shape \(1,\)"):
        throats_polydata(mesh.throats, flux=np.zeros(1))


# ---- paths of particles ----------


def test_paths_are_written_with_times_pressures_and_speeds(tmp_path):
    flow = PoreFlow(Packing.read(PACKINGS / "n25_s1.csv"), Walls.along("y"))
    paths = flow.paths(20, seed=1)
    path = tmp_path / "paths.vtp"
    for _ in range(2):  # a file that exists is replaced
        write_paths(paths, path)
    found = pyvista.read(path)
    assert found.n_lines == 20
    np.testing.assert_array_equal(found.points, paths.points)
    for name, values in (
        ("time", paths.times), ("pressure", paths.pressures), ("speed", paths.speeds), ("pore", paths.pores),
    ):  # fmt: skip
        np.testing.assert_array_equal(found.point_data[name], values)
    np.testing.assert_array_equal(found.cell_data["residence_time"], paths.residence_times)
    np.testing.assert_allclose(found.compute_cell_sizes()["Length"], paths.lengths)
    assert paths.to_pyvista().n_points == len(paths.points)


def test_paths_need_a_name_of_their_format(tmp_path):
    flow = PoreFlow(Packing.read(PACKINGS / "n25_s1.csv"), Walls.along("y"))
    with pytest.raises(InputError, match=r"\.vtp"):
        write_paths(flow.paths(2), tmp_path / "paths.vtu")


def test_a_flow_has_its_fields_on_the_cells():
    flow = PoreFlow(Packing.read(PACKINGS / "n25_s1.csv"), Walls.along("y"))
    grid = flow.to_pyvista()
    np.testing.assert_array_equal(grid["pressure"], flow.cell_pressure)
    np.testing.assert_array_equal(grid["velocity"], flow.pore_velocity[flow.mesh.cell_pore])
