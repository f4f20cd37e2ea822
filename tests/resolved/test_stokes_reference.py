"""The resolved reference: what it samples, what it keeps, and that it solves Stokes flow."""

import json
from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_allclose

from porefv import cli
from porefv.errors import InputError
from porefv.flow.walls import Walls
from porefv.mesh.pore_mesh import PoreMesh
from porefv.packing.box import Box
from porefv.packing.packing import Packing
from porefv.resolved import refinement
from porefv.resolved.facet_quadrature import cells_of, facet_points
from porefv.resolved.fluid_geometry import contacts
from porefv.resolved.reference import Run, StokesReference, Values
from porefv.resolved.refinement import Options, stokes_reference

STORED = sorted((Path(__file__).parents[2] / "data" / "reference" / "stokes").glob("*.json"))
UNIT = Box([0, 0, 0], [1, 1, 1])


# ---- without finite elements -------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", ["n25_s1", "nine_0.72"])
def test_points_on_facets_fill_their_fluid_areas(mesh_of, name):
    mesh = mesh_of(name)
    points = facet_points(mesh)
    areas = np.bincount(points.facets, points.weights, len(mesh.facets.cells))
    # Where spheres overlap, areas are signed and points are not: facets that this touches are the closed ones.
    exact = mesh.facets.fluid_areas
    sound = exact > 1e-3 * mesh.facets.areas
    assert_allclose(areas[sound], exact[sound], rtol=2e-3)
    offsets = mesh.local_points[mesh.facets.vertices[points.facets, 0]] - points.points
    assert_allclose((offsets * mesh.facets.normals[points.facets]).sum(axis=1), 0.0, atol=1e-12)


def test_every_point_is_in_one_cell_and_cells_have_their_volumes(mesh_of):
    mesh = mesh_of("n25_s1")
    side = (np.arange(40) + 0.5) / 40
    points = np.array(np.meshgrid(side, side, side)).reshape(3, -1).T
    cells = cells_of(mesh, points - mesh.triangulation.origin)
    volumes = np.bincount(cells, minlength=mesh.n_cells) / len(points)
    assert_allclose(volumes, mesh.cell_volumes, atol=1e-3)
    # Sphere centres are corners of every cell around them.
    assert np.abs(volumes - mesh.cell_volumes).sum() < 0.05


def test_contacts_are_gaps_and_small_overlaps():
    centres = np.array([[0.25, 0.5, 0.5], [0.45, 0.5, 0.5], [0.655, 0.5, 0.5], [0.85, 0.5, 0.5]])
    found = contacts(centres, np.full(4, 0.1), UNIT.lower, UNIT.upper, 0.03)
    # Touching, a gap of 0.05 radii, an overlap of 0.05 radii: a neck, which stays.
    assert [(contact.sphere, contact.other) for contact in found] == [(0, 1), (1, 2)]
    assert_allclose(found[1].point, [0.5525, 0.5, 0.5])


@pytest.fixture
def made_up(mesh_of):
    """A reference with made-up values on a real mesh."""
    mesh = mesh_of("nine_0.72")
    rng = np.random.default_rng(1)
    shapes = [(9, 3), (9, 3), (6, 3), (6, 3), 6, len(mesh.facets.cells), len(mesh.wall_faces.cells), mesh.n_cells]
    arrays = [rng.normal(size=shape) for shape in [*shapes, mesh.n_cells]]
    arrays[-1][::3] = np.nan
    return StokesReference(
        name="made up", method="finite-elements", packing=mesh.packing,
        walls=Walls.along("y", slip=True), viscosity=2.0, values=Values(*arrays),
        errors={"permeability": 1e-6}, permeability=3e-4, order=3, contacts="caps",
        runs=[Run(0.5, 0.03, 10, 100, 0, 1.0, 3e-4, 1e-16, 1e-3)], cells=mesh.cells,
        facet_vertices=mesh.facets.vertices, facet_cells=mesh.facets.cells, face_cells=mesh.wall_faces.cells,
        face_walls=mesh.wall_faces.walls, versions={"ngsolve": "6"},
    )  # fmt: skip


def test_what_is_written_is_read_back(made_up, tmp_path, mesh_of):
    made_up.write(tmp_path / "flow.json")
    back = StokesReference.read(tmp_path / "flow.json")
    assert (back.name, back.walls, back.errors, back.runs) == (
        made_up.name, made_up.walls, made_up.errors, made_up.runs
    )  # fmt: skip
    assert np.array_equal(back.packing.centres, made_up.packing.centres)
    for name, array in vars(made_up.values).items():
        assert_allclose(getattr(back.values, name), array, rtol=0, atol=1e-6 * np.nanmax(np.abs(array)))
    assert np.isnan(back.values.vertex_pressure[0])
    assert_allclose(back.throat_flux(mesh_of("nine_0.72")), made_up.throat_flux(mesh_of("nine_0.72")), atol=1e-6)


def test_values_are_refused_on_another_mesh(made_up, mesh_of):
    with pytest.raises(InputError, match="not the one these values were read off"):
        made_up.throat_flux(mesh_of("nine_0.5"))


def test_a_file_of_another_kind_is_refused(tmp_path):
    (tmp_path / "other.json").write_text(json.dumps({"kind": "soup"}))
    with pytest.raises(InputError, match="holds no resolved flow"):
        StokesReference.read(tmp_path / "other.json")


@pytest.mark.parametrize("wrong", [{"order": 1}, {"mesh_size": 0.0}, {"delta": 1.0}, {"contacts": "glue"}])
def test_impossible_options_are_refused(wrong):
    with pytest.raises(InputError, match=next(iter(wrong)).replace("_", " ")):
        Options(**wrong)


def test_the_command_says_what_to_install(monkeypatch, capsys, tmp_path):
    monkeypatch.setattr(refinement, "has_ngsolve", lambda: False)
    assert cli.main(["reference", str(tmp_path / "scene.toml"), "--method", "finite-elements"]) == 2
    assert "pip install ngsolve" in capsys.readouterr().err


@pytest.mark.parametrize("path", STORED, ids=lambda path: path.stem)
def test_stored_references_balance(path):
    reference = StokesReference.read(path)
    mesh = reference.pore_mesh()
    values, walls = reference.values, reference.walls
    # Nothing of the thrust along the flow is lost; the open walls let the fluid go.
    along = values.sphere_total[:, 1].sum() + values.wall_viscous[:, 1].sum()
    drop = np.ptp(walls.pressures[~np.isnan(walls.pressures)])
    assert_allclose(along, drop * mesh.box.section(1), rtol=1e-5)
    # What flows in flows out, through the cells as through the walls.
    flux = reference.throat_flux(mesh)
    i, j = mesh.throats.pores.T
    net = np.bincount(i, flux, mesh.n_pores) - np.bincount(j, flux, mesh.n_pores)
    net -= np.bincount(mesh.cell_pore[reference.face_cells], values.face_flux, mesh.n_pores)
    inflow = values.wall_flux.max()
    assert_allclose(values.face_flux[reference.face_walls == 2].sum(), inflow, rtol=1e-3)
    assert np.sqrt(np.mean(net**2)) < 0.01 * inflow
    # Pressures lie between those of the walls, but for what the mesh cannot resolve.
    pressure = reference.pore_pressure(mesh)
    assert np.nanmin(pressure) > -0.05 * drop
    assert np.nanmax(pressure) < 1.05 * drop


# ---- with finite elements ----------------------------------------------------------------------------------------


def test_the_drag_of_a_cubic_lattice_is_that_of_zick_and_homsy():
    pytest.importorskip("ngsolve")
    radius = (3 * 0.343 / (4 * np.pi)) ** (1 / 3)
    box = Box([0, 0, 0], [2.0, 2.0, 2.0])
    mesh = PoreMesh(Packing([[1.0, 1.0, 1.0]], [2.0 * radius], box))
    walls = Walls.along("y", 3.0, slip=True)
    found = stokes_reference(mesh, walls, 0.5, Options(mesh_size=0.4))
    velocity = found.values.wall_flux[2] / box.section(1)
    drag = found.values.sphere_total[0, 1] / (6 * np.pi * 0.5 * 2.0 * radius * velocity)
    assert_allclose(drag, 15.4, rtol=0.01)
    assert found.errors["permeability"] < 0.01 * found.permeability
    assert_allclose(found.permeability, 0.5 * velocity * 2.0 / 3.0, rtol=1e-6)
    # All of the thrust is on the sphere; the flow is symmetric.
    assert_allclose(found.values.sphere_total[0], [0.0, 3.0 * box.section(1), 0.0], atol=2e-3 * 12.0)
    assert_allclose(found.values.wall_flux[3], -found.values.wall_flux[2], rtol=1e-3)
    # Half of the pressure is lost half way, in the planes through the centre: pores above and below are at 3/4 and 1/4
    # of it but for the shape of the fall.
    pressure = found.pore_pressure(mesh)
    assert_allclose(pressure.min() + pressure.max(), 3.0, rtol=0.01)
    flux = found.throat_flux(mesh)
    crossing = np.abs(mesh.throats.normals[:, 1]) > 0.5
    assert_allclose(np.abs(flux[crossing]).sum(), found.values.wall_flux[2], rtol=5e-3)


def test_bridges_leave_the_drag_of_touching_spheres():
    pytest.importorskip("ngsolve")
    mesh = PoreMesh(Packing([[0.5, 0.5, 0.5]], [0.5], UNIT))
    options = Options(mesh_size=0.6, delta=0.15, contacts="bridges", single=True)
    found = stokes_reference(mesh, Walls.along("y", slip=True), 1.0, options)
    # A single run has no error bars; Zick and Homsy have 42.1.
    assert found.errors == {}
    assert_allclose(1.0 / (6 * np.pi * 0.5 * found.permeability), 42.1, rtol=0.01)
    # The bridges to the walls are the sphere's, and their feet on the open walls bear no pressure of the fluid.
    feet = np.pi * (0.15 * 0.5) ** 2
    assert_allclose(found.values.sphere_total[0], [0.0, 1.0 - feet, 0.0], atol=2e-3)
