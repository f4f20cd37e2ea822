import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.integrate import quad

from porefv.errors import InputError
from porefv.flow.walls import Walls
from porefv.mesh.cell_kernels import polyhedron_volumes
from porefv.mesh.pore_mesh import PoreMesh
from porefv.packing.box import Box
from porefv.packing.packing import Packing
from porefv.tessellation.vertices import Vertices

SMALL = ["sc8", "nine_0.72", "n25_s1", "n54_s1", "n200_s1"]
ODD_BOX = Box([-3.0, 0.25, 1e3], [-1.0, 0.5, 1e3 + 7.0])


def section_of_wall(box, wall):
    return box.section(wall // 2)


# ---- cells ----------


@pytest.mark.parametrize("name", [*SMALL, "n2000_s1", "n5000_s1"])
def test_cells_fill_the_box(mesh_of, name):
    mesh = mesh_of(name)
    assert mesh.cell_volumes.min() > 0.0
    # Rounding of a sum of positive terms.
    assert_allclose(mesh.cell_volumes.sum(), mesh.box.volume, rtol=1e-13)


def test_cells_fill_a_box_of_any_place_and_shape(random_packing):
    mesh = PoreMesh(random_packing(100, seed=1, fraction=0.1, box=ODD_BOX))
    assert_allclose(mesh.cell_volumes.sum(), ODD_BOX.volume, rtol=1e-13)


@pytest.mark.parametrize("name", SMALL)
def test_faces_of_a_cell_close(mesh_of, name):
    mesh = mesh_of(name)
    faces = mesh.wall_faces
    vectors = mesh.facets.areas[:, None] * mesh.facets.normals
    total = np.zeros((mesh.n_cells, 3))
    np.add.at(total, mesh.facets.cells[:, 0], vectors)
    np.add.at(total, mesh.facets.cells[:, 1], -vectors)
    np.add.at(total, faces.cells, faces.areas[:, None] * mesh.local_points[mesh.n_spheres + faces.walls])
    # Rounding, relative to the faces of a box of unit section.
    assert_allclose(total, 0.0, rtol=0, atol=1e-15)


@pytest.mark.parametrize("name", SMALL)
def test_void_of_the_cells_is_the_void_of_the_packing(mesh_of, name):
    mesh = mesh_of(name)
    void = mesh.packing.porosity * mesh.box.volume
    # Exact although grains overlap; the rest is rounding of the solid volume.
    assert_allclose(mesh.cell_void_volumes.sum(), void, rtol=1e-12)
    assert_allclose(mesh.pore_volumes.sum(), void, rtol=1e-12)
    assert mesh.cell_void_volumes.min() > 0.0


def test_laguerre_vertices_have_equal_power_to_their_spheres_and_lie_on_their_walls(mesh_of):
    mesh = mesh_of("n200_s1")
    n = mesh.n_spheres
    c, r = mesh.packing.centres, mesh.packing.radii
    of_sphere = mesh.cells < n
    k = np.where(of_sphere, mesh.cells, 0)
    power = ((mesh.vertices[:, None] - c[k]) ** 2).sum(axis=2) - r[k] ** 2
    spread = np.where(of_sphere, power, -np.inf).max(axis=1) - np.where(of_sphere, power, np.inf).min(axis=1)
    # A flat cell's vertex is worse conditioned than its power; 1e-12 is 10⁴ roundings.
    assert spread.max() < 1e-12
    t, i = np.nonzero(~of_sphere)
    wall = mesh.cells[t, i] - n
    np.testing.assert_array_equal(mesh.vertices[t, wall // 2], (wall % 2).astype(float))
    assert (mesh.vertices >= 0.0).all() and (mesh.vertices <= 1.0).all()


# ---- facets ----------


@pytest.mark.parametrize("name", SMALL)
def test_facets_hold_the_three_vertices_their_cells_share_spheres_first(mesh_of, name):
    mesh = mesh_of(name)
    assert 2 * len(mesh.facets.cells) == 4 * mesh.n_cells - 8  # all but the box's corners have two cells
    for (i, j), vertices in zip(mesh.facets.cells.tolist(), mesh.facets.vertices.tolist(), strict=True):
        assert set(mesh.cells[i].tolist()) & set(mesh.cells[j].tolist()) == set(vertices)
        walls = [v >= mesh.n_spheres for v in vertices]
        assert walls == sorted(walls)


@pytest.mark.parametrize("name", [*SMALL, "n2000_s1"])
def test_laguerre_edges_are_normal_to_their_facets_and_point_along_them(mesh_of, name):
    mesh = mesh_of(name)
    i, j = mesh.facets.cells.T
    edge = mesh.vertices[j] - mesh.vertices[i]
    along = mesh.facets.lengths
    # 1e-13 of the box: the rounding of the vertices of flat cells.
    assert_allclose(edge, along[:, None] * mesh.facets.normals, rtol=0, atol=1e-13)
    assert along.min() >= -1e-15


@pytest.mark.parametrize("packing_box", [None, ODD_BOX])
def test_wall_faces_tile_the_walls(reference, random_packing, packing_box):
    packing = reference("n54_s1") if packing_box is None else random_packing(60, 0.5, 2, 0.1, packing_box)
    mesh = PoreMesh(packing)
    faces, box = mesh.wall_faces, mesh.box
    for wall in range(6):
        on = faces.walls == wall
        assert_allclose(faces.areas[on].sum(), section_of_wall(box, wall), rtol=1e-13)
        middle = (faces.areas[on, None] * faces.centroids[on]).sum(axis=0) / faces.areas[on].sum()
        expected = 0.5 * (box.lower + box.upper)
        expected[wall // 2] = box.upper[wall // 2] if wall % 2 else box.lower[wall // 2]
        # Relative to the box: coordinates of the odd box carry the rounding of its distance.
        assert_allclose((middle + mesh.triangulation.origin - expected) / box.size, 0.0, rtol=0, atol=1e-12)
    assert (mesh.cells[faces.cells] == (mesh.n_spheres + faces.walls)[:, None]).any(axis=1).all()


# ---- pores ----------


def test_cells_that_share_a_laguerre_vertex_are_one_pore(mesh_of):
    mesh = mesh_of("sc8")
    assert (mesh.n_cells, mesh.n_pores, mesh.n_united) == (38, 27, 11)
    # The pores are the vertices of a cube cut into eight, each with the void that belongs to it.
    places = {}
    for pore, vertex in zip(mesh.cell_pore.tolist(), mesh.vertices.tolist(), strict=True):
        assert places.setdefault(pore, vertex) == vertex
    assert len(set(map(tuple, places.values()))) == 27
    solid = 4 / 3 * np.pi * 0.25**3 / 8  # an eighth of a sphere in each eighth of its cell
    for pore, vertex in places.items():
        size = np.prod([0.5 if x == 0.5 else 0.25 for x in vertex])
        spheres = size / 0.25**3
        assert_allclose(mesh.pore_volumes[pore], size - spheres * solid, rtol=1e-13)


def test_lattices_keep_one_pore_for_each_hole(lattice):
    # Periodic simple cubic: holes at the corners of the cells. Exact ties and rounded ones alike.
    for spacing in (1.0, 0.1, 1 / 3):
        assert PoreMesh(lattice("sc", 5, spacing=spacing), unite_tolerance=0.0).n_pores == 6**3


@pytest.mark.parametrize("name", ["n25_s1", "n54_s1", "n200_s1"])
def test_tolerance_zero_unites_exact_ties_only(reference, name):
    mesh = PoreMesh(reference(name), unite_tolerance=0.0)
    assert mesh.n_pores == mesh.n_cells and mesh.n_united == 0
    assert len(mesh.throats) == len(mesh.facets.cells)


def test_uniting_hardly_changes_the_permeability_and_keeps_volume(reference, mesh_of, unit_flow):
    apart = PoreMesh(reference("n200_s1"), unite_tolerance=0.0)
    united = mesh_of("n200_s1")
    assert united.n_united > 0
    k = unit_flow(apart, Walls.along("y")).permeability
    # The facets that are united resist next to nothing: 1e-5 for this tolerance (design §3.4).
    assert_allclose(unit_flow(united, Walls.along("y")).permeability, k, rtol=2e-5)
    assert_allclose(np.bincount(united.cell_pore, apart.cell_void_volumes), united.pore_volumes, rtol=1e-13)


@pytest.mark.parametrize("name", ["n54_s1", "n200_s1"])
def test_uniting_hardly_changes_forces(reference, mesh_of, unit_flow, name):
    # The default model has pore centres, which throats of vanishing length do not move: nothing jumps.
    apart = unit_flow(PoreMesh(reference(name), unite_tolerance=0.0), Walls.along("y")).forces.total
    change = unit_flow(mesh_of(name), Walls.along("y")).forces.total - apart
    assert np.abs(change).max() < 4e-3 * np.abs(apart[:, 1]).mean()


def test_pores_are_numbered_without_gaps(mesh_of):
    mesh = mesh_of("n2000_s1")
    np.testing.assert_array_equal(np.unique(mesh.cell_pore), np.arange(mesh.n_pores))
    assert mesh.n_united == mesh.n_cells - mesh.n_pores > 0


# ---- use ----------


def test_nothing_is_computed_before_it_is_asked_for(reference):
    mesh = PoreMesh(reference("n25_s1"))
    assert "triangulation" not in vars(mesh)
    assert mesh.n_cells == 122
    assert {"triangulation", "cell_volumes", "throats", "wall_faces"} & set(vars(mesh)) == {"triangulation"}


def test_box_can_be_replaced(reference):
    larger = Box([-1, -1, -1], [2, 2, 2])
    mesh = PoreMesh(reference("n25_s1"), larger)
    assert mesh.box is larger and mesh.packing.box is larger
    assert_allclose(mesh.cell_volumes.sum(), 27.0, rtol=1e-13)


def test_packing_without_a_box_or_not_fit_for_use_is_refused(reference):
    packing = reference("n25_s1")
    with pytest.raises(InputError, match="no box"):
        PoreMesh(Packing(packing.centres, packing.radii))
    with pytest.raises(InputError, match="centre not inside the box"):
        PoreMesh(packing, Box([0, 0, 0], [1, 0.5, 1]))
    with pytest.raises(InputError, match="beyond a wall"):
        PoreMesh(packing, wall_tolerance=1e-6)


@pytest.mark.parametrize("tolerance", [-0.01, 1.0, np.nan])
def test_unite_tolerance_out_of_range_is_refused(reference, tolerance):
    with pytest.raises(InputError, match="unite_tolerance"):
        PoreMesh(reference("n25_s1"), unite_tolerance=tolerance)


def test_repr_tells_what_is_inside(mesh_of):
    assert repr(mesh_of("n25_s1")) == "PoreMesh(25 spheres, 122 pores, 240 throats, box 1×1×1 m)"
    assert repr(mesh_of("n25_s1").throats) == "Throats(240 throats between 122 pores)"
    assert repr(mesh_of("n25_s1").triangulation) == "RegularTriangulation(25 spheres, 122 cells)"


# ---- rates of volume ----------


def moved(mesh, velocities, speeds, h):
    """Volumes of the cells after a time h at fixed topology."""
    n = mesh.n_spheres
    points, sizes = mesh.local_points.copy(), mesh.sizes.copy()
    points[:n] += h * velocities
    sizes[n:] += h * speeds
    volumes = np.empty(mesh.n_cells)
    polyhedron_volumes(0, mesh.n_cells, mesh.cells, Vertices(n, points, sizes), volumes)
    return volumes


@pytest.mark.parametrize("name", ["n25_s1", "n200_s1", "sc8"])
def test_rates_of_volume_are_the_derivative_of_the_volumes(mesh_of, name):
    mesh = mesh_of(name)
    rng = np.random.default_rng(0)
    velocities, speeds = rng.normal(size=(mesh.n_spheres, 3)), rng.normal(size=6)
    rates = mesh.cell_volume_rates(velocities, speeds)
    h = 1e-6
    differences = (moved(mesh, velocities, speeds, h) - moved(mesh, velocities, speeds, -h)) / (2 * h)
    assert_allclose(rates, differences, rtol=0, atol=1e-8 * np.abs(rates).max())
    # What the cells gain together is what the walls clear.
    cleared = sum((speeds[2 * a] + speeds[2 * a + 1]) * mesh.box.section(a) for a in range(3))
    assert_allclose(rates.sum(), cleared, rtol=1e-12)


def test_grains_and_walls_that_move_as_one_change_no_volume(mesh_of):
    mesh = mesh_of("n200_s1")
    velocity = np.array([1.0, -2.0, 0.5])
    speeds = np.stack([-velocity, velocity], axis=1).ravel()
    rates = mesh.cell_volume_rates(np.tile(velocity, (mesh.n_spheres, 1)), speeds)
    assert_allclose(rates, 0.0, atol=1e-14)


def test_uniform_strain_changes_every_volume_alike(mesh_of):
    mesh = mesh_of("n200_s1")
    strain = np.array([0.1, -0.3, 0.05])
    middle = 0.5 * (mesh.box.lower + mesh.box.upper)
    speeds = np.repeat(0.5 * strain * mesh.box.size, 2)
    rates = mesh.cell_volume_rates(strain * (mesh.packing.centres - middle), speeds)
    assert_allclose(rates, strain.sum() * mesh.cell_volumes, rtol=1e-10, atol=1e-18)


# ---- Laguerre cells ----------


@pytest.mark.parametrize("name", ["n25_s1", "n200_s1", "n2000_s1"])
def test_laguerre_cells_fill_the_box_and_hold_their_spheres(mesh_of, name):
    mesh = mesh_of(name)
    volumes = mesh.laguerre_volumes
    assert_allclose(volumes.sum(), mesh.box.volume, rtol=1e-12)
    assert (volumes > 4.0 / 3.0 * np.pi * mesh.packing.radii**3).all()


def test_laguerre_cells_of_a_lattice_are_its_cubes(mesh_of):
    assert_allclose(mesh_of("sc8").laguerre_volumes, 0.125, rtol=1e-12)


def test_laguerre_cells_are_where_the_power_is_least(mesh_of):
    mesh = mesh_of("n25_s1")
    tries = 200_000
    x = mesh.box.lower + np.random.default_rng(0).random((tries, 3)) * mesh.box.size
    power = ((x[:, None] - mesh.packing.centres) ** 2).sum(axis=2) - mesh.packing.radii**2
    share = np.bincount(power.argmin(axis=1), minlength=25) / tries
    expected = mesh.laguerre_volumes / mesh.box.volume
    assert (np.abs(share - expected) < 4.5 * np.sqrt(expected * (1.0 - expected) / tries)).all()


# ---- surfaces of grains ----------


def sphere_surface(radii):
    return 4.0 * np.pi * (radii**2).sum()


def seen_surface(packing, tries, seed):
    """Surface of a packing's spheres within its box and outside other spheres, by random points; and its scatter."""
    rng = np.random.default_rng(seed)
    total = variance = 0.0
    for centre, radius in zip(packing.centres, packing.radii, strict=True):
        directions = rng.normal(size=(tries, 3))
        x = centre + radius * directions / np.linalg.norm(directions, axis=1)[:, None]
        inside = ((x > packing.box.lower) & (x < packing.box.upper)).all(axis=1)
        power = ((x[:, None] - packing.centres) ** 2).sum(axis=2) - packing.radii**2
        part = (inside & (power > -1e-9 * radius**2).all(axis=1)).mean()
        whole = 4.0 * np.pi * radius**2
        total += whole * part
        variance += whole**2 * part * (1.0 - part) / tries
    return total, np.sqrt(variance)


@pytest.mark.parametrize("seed", range(3))
def test_surfaces_of_pores_add_up_to_those_of_spheres(random_packing, seed):
    mesh = PoreMesh(random_packing(100, seed=seed))
    assert_allclose(mesh.pore_surfaces.sum(), sphere_surface(mesh.packing.radii), rtol=1e-12)
    assert (mesh.pore_surfaces > 0.0).all()


def test_eight_pores_around_a_sphere_have_an_eighth_of_it_each():
    mesh = PoreMesh(Packing([[0.5, 0.5, 0.5]], [0.3], Box([0, 0, 0], [1, 1, 1])))
    assert_allclose(mesh.pore_surfaces, np.full(8, 0.5 * np.pi * 0.3**2), rtol=1e-12)


def test_surfaces_end_at_a_wall():
    mesh = PoreMesh(Packing([[0.2, 0.5, 0.5]], [0.3], Box([0, 0, 0], [1, 1, 1])), wall_tolerance=0.5)
    assert_allclose(mesh.pore_surfaces.sum(), 2.0 * np.pi * 0.3 * (0.3 + 0.2), rtol=1e-12)


def test_surfaces_end_at_an_edge_of_the_box():
    r, d = 0.4, 0.2
    mesh = PoreMesh(Packing([[d, d, 0.5]], [r], Box([0, 0, 0], [1, 1, 1])), wall_tolerance=0.9)
    # The part beyond both walls: arcs of the circles at distance x.
    beyond_both = quad(lambda x: 2.0 * r * np.arccos(d / np.sqrt(r * r - x * x)), d, np.sqrt(r * r - d * d))[0]
    seen = 4.0 * np.pi * r * r - 2.0 * 2.0 * np.pi * r * (r - d) + beyond_both
    assert_allclose(mesh.pore_surfaces.sum(), seen, rtol=1e-7)


def test_surfaces_have_no_part_in_another_sphere():
    r, s, apart = 0.2, 0.15, 0.3
    mesh = PoreMesh(Packing([[0.35, 0.5, 0.5], [0.35 + apart, 0.5, 0.5]], [r, s], Box([0, 0, 0], [1, 1, 1])))
    d = 0.5 * (apart**2 + r**2 - s**2) / apart
    caps = 2.0 * np.pi * (r * (r - d) + s * (s - (apart - d)))
    assert_allclose(mesh.pore_surfaces.sum(), sphere_surface(mesh.packing.radii) - caps, rtol=1e-12)


@pytest.mark.parametrize("factor", [1.2, 1.4])
def test_surfaces_are_exact_where_three_spheres_overlap(reference, factor):
    packing = reference("n25_s1")
    cemented = Packing(packing.centres, factor * packing.radii, packing.box)
    assert cemented.triple_overlaps
    mesh = PoreMesh(cemented, wall_tolerance=0.9)
    seen, scatter = seen_surface(cemented, 50_000, seed=0)
    assert abs(mesh.pore_surfaces.sum() - seen) < 4.0 * scatter
    assert scatter < 2e-3 * seen


def test_the_surface_in_a_pore_is_what_lies_in_its_cells(mesh_of):
    """Random points on the spheres, each counted in the tetrahedron that holds it."""
    mesh = mesh_of("n25_s1")
    cells = np.flatnonzero((mesh.cells < mesh.n_spheres).all(axis=1))
    corners = mesh.packing.centres[mesh.cells[cells]]
    rng, tries = np.random.default_rng(0), 20_000
    found = variance = np.zeros(len(cells))
    for centre, radius in zip(mesh.packing.centres, mesh.packing.radii, strict=True):
        directions = rng.normal(size=(tries, 3))
        x = centre + radius * directions / np.linalg.norm(directions, axis=1)[:, None]
        parts = np.linalg.solve(
            (corners[:, 1:] - corners[:, :1]).transpose(0, 2, 1), (x[None] - corners[:, :1]).transpose(0, 2, 1)
        )
        part = ((parts > 0.0).all(axis=1) & (parts.sum(axis=1) < 1.0)).mean(axis=1)
        whole = 4.0 * np.pi * radius**2
        found = found + whole * part
        variance = variance + whole**2 * part * (1.0 - part) / tries
    assert len(cells) > 20
    assert (np.abs(mesh.cell_surfaces[cells] - found) < 5.0 * np.sqrt(variance)).all()
