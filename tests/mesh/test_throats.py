"""Throat geometry: sums that are exact, and single throats that can be worked out by hand."""

import pickle

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.testing import assert_allclose

from porefv.conductance.effective_radius import EffectiveRadius
from porefv.conductance.hydraulic_radius import HydraulicRadius
from porefv.errors import InputError
from porefv.flow.walls import Walls
from porefv.mesh.pore_mesh import PoreMesh
from porefv.packing.box import Box
from porefv.packing.packing import Packing

NO_SLIP = np.zeros(6, bool)
ROOT_3 = np.sqrt(3.0)


def ball(r):
    return 4 / 3 * np.pi * r**3


def sphere_surfaces(mesh):
    """(n,): Σγ^k over the facets of each sphere; (6,): the same for the walls."""
    total = np.zeros(mesh.n_spheres + 6)
    np.add.at(total, mesh.facets.vertices, mesh.facets.surfaces)
    return total[: mesh.n_spheres], total[mesh.n_spheres :]


def segment(r, d):
    """Part of a disc beyond a chord at distance d from its centre."""
    return r * r * np.arccos(d / r) - d * np.sqrt(r * r - d * d)


def facet_throat(mesh, *vertices):
    """The one throat of the facet of these vertices: spheres by id, walls by n + id."""
    facet = np.flatnonzero((np.sort(mesh.facets.vertices, axis=1) == sorted(vertices)).all(axis=1))
    assert len(facet) == 1
    return mesh.throats.facet_throat[facet[0]]


# ---- sums ----------

packings = st.tuples(
    st.integers(1, 60), st.sampled_from([0.02, 0.2, 0.5, 1.0]), st.integers(0, 10**6), st.floats(0.001, 0.25)
)
boxes = st.sampled_from([Box([0, 0, 0], [1, 1, 1]), Box([1e3, -2, 0], [1e3 + 0.5, 3, 1e-1])])


@settings(max_examples=60)
@given(packings, boxes)
def test_sums_are_exact_for_any_packing_without_overlap(random_packing, case, box):
    n, ratio, seed, fraction = case
    mesh = PoreMesh(random_packing(n, ratio, seed, fraction, box))
    r = mesh.packing.radii
    # A few hundred roundings of terms no larger than the whole; polydispersity adds terms that cancel.
    assert_allclose(mesh.facets.volumes.sum(), box.volume - ball(r).sum(), rtol=1e-12)
    spheres, walls = sphere_surfaces(mesh)
    assert_allclose(spheres, 4 * np.pi * r**2, rtol=1e-12)
    assert_allclose(walls, [box.section(wall // 2) for wall in range(6)], rtol=1e-12)
    assert_allclose(mesh.cell_void_volumes.sum(), box.volume - ball(r).sum(), rtol=1e-12)
    assert_allclose(mesh.cell_volumes.sum(), box.volume, rtol=1e-13)


def test_sums_are_exact_for_a_large_polydisperse_packing(random_packing):
    mesh = PoreMesh(random_packing(1500, ratio=0.05, seed=3))
    r = mesh.packing.radii
    assert_allclose(mesh.facets.volumes.sum(), 1.0 - ball(r).sum(), rtol=1e-12)
    spheres, walls = sphere_surfaces(mesh)
    assert_allclose(spheres, 4 * np.pi * r**2, rtol=1e-12)
    assert_allclose(walls, 1.0, rtol=1e-12)


@pytest.mark.parametrize(("kind", "m"), [("sc", 4), ("bcc", 3), ("fcc", 3), ("hcp", 5)])
@pytest.mark.parametrize("radius", [1.0, 0.6], ids=["touching", "loose"])
def test_sums_are_exact_for_lattices(lattice, kind, m, radius):
    mesh = PoreMesh(lattice(kind, m, radius, spacing=0.3))
    r = mesh.packing.radii
    assert_allclose(mesh.facets.volumes.sum(), mesh.box.volume - ball(r).sum(), rtol=1e-12)
    assert_allclose(sphere_surfaces(mesh)[0], 4 * np.pi * r**2, rtol=1e-12)


@pytest.mark.parametrize("name", ["sc8", "nine_0.2", "n25_s1", "n54_s1", "n200_s1", "n2000_s1", "n20000_s1"])
def test_throats_of_reference_packings_hold_their_void_overlaps_included(mesh_of, name):
    mesh = mesh_of(name)
    void = mesh.packing.porosity * mesh.box.volume
    # 1e-12 for a void that is a difference of sums over 20 000 spheres.
    assert_allclose(mesh.facets.volumes.sum(), void, rtol=1e-12)


def test_surfaces_of_reference_packings_are_those_outside_their_neighbours(mesh_of):
    mesh = mesh_of("n200_s1")
    r, found = mesh.packing.radii, mesh.packing.overlaps
    free = 4 * np.pi * r**2
    for (i, j), depth in zip(found.pairs, found.depths, strict=True):
        d = r[i] + r[j] - depth
        for k, m in ((i, j), (j, i)):
            free[k] -= 2 * np.pi * r[k] * (r[k] - (d * d + r[k] ** 2 - r[m] ** 2) / (2 * d))
    np.subtract.at(free, found.wall_spheres, 2 * np.pi * r[found.wall_spheres] * found.wall_depths)
    spheres, walls = sphere_surfaces(mesh)
    assert_allclose(spheres, free, rtol=1e-12)
    covered = np.pi * found.wall_depths * (2 * r[found.wall_spheres] - found.wall_depths)
    assert_allclose(walls, 1.0 - np.bincount(found.wall_ids, covered, 6), rtol=1e-12)


# ---- the overlap rule ----------


@settings(max_examples=50)
@given(
    st.floats(0.05, 0.15), st.floats(0.05, 0.15), st.floats(0.02, 0.98),
    st.lists(st.floats(-1, 1), min_size=3, max_size=3).filter(lambda v: np.linalg.norm(v) > 0.1),
)  # fmt: skip
def test_lens_of_two_overlapping_spheres_is_counted_once(r1, r2, depth, along):
    # From just touching to the centre of one on the surface of the other.
    d = r1 + r2 - depth * min(r1, r2)
    step = np.array(along) / np.linalg.norm(along) * d
    mesh = PoreMesh(Packing([0.5 - 0.4 * step, 0.5 + 0.6 * step], [r1, r2], Box([0, 0, 0], [1, 1, 1])))
    x1 = (d * d + r1 * r1 - r2 * r2) / (2 * d)
    h1, h2 = r1 - x1, r2 - (d - x1)
    lens = np.pi * (h1 * h1 * (r1 - h1 / 3) + h2 * h2 * (r2 - h2 / 3))
    void = 1.0 - ball(r1) - ball(r2) + lens
    assert_allclose(mesh.facets.volumes.sum(), void, rtol=1e-12)
    assert_allclose(mesh.cell_void_volumes.sum(), void, rtol=1e-12)
    free = [4 * np.pi * r1**2 - 2 * np.pi * r1 * h1, 4 * np.pi * r2**2 - 2 * np.pi * r2 * h2]
    assert_allclose(sphere_surfaces(mesh)[0], free, rtol=1e-12)


@pytest.mark.parametrize("wall", range(6))
@pytest.mark.parametrize("depth", [1e-9, 0.01, 0.05, 0.6])
def test_cap_beyond_a_wall_is_left_out(wall, depth):
    r, box = 0.2, Box([0, 0, 0], [1, 2, 1.5])
    h = depth * r
    centre = np.array([0.4, 0.9, 0.8])
    centre[wall // 2] = box.size[wall // 2] - r + h if wall % 2 else r - h
    mesh = PoreMesh(Packing([centre], [r], box), wall_tolerance=0.7)
    void = box.volume - ball(r) + np.pi * h * h * (r - h / 3)
    assert_allclose(mesh.facets.volumes.sum(), void, rtol=1e-13)
    assert_allclose(mesh.cell_void_volumes.sum(), void, rtol=1e-13)
    spheres, walls = sphere_surfaces(mesh)
    assert_allclose(spheres[0], 4 * np.pi * r * r - 2 * np.pi * r * h, rtol=1e-13)
    free = np.array([box.section(w // 2) for w in range(6)])
    free[wall] -= np.pi * h * (2 * r - h)
    assert_allclose(walls, free, rtol=1e-13)


def triangle(side, r=0.1):
    """Three equal spheres at the corners of an equilateral triangle in the middle of a box."""
    corners = np.array([[0.0, 0, 0], [side, 0, 0], [side / 2, side * ROOT_3 / 2, 0]])
    return PoreMesh(Packing(corners - corners.mean(axis=0) + 0.5, [r] * 3, Box([0, 0, 0], [1, 1, 1])))


@pytest.mark.parametrize("side", [3.0, 2.0, 1.9, 1.75])
def test_fluid_area_between_three_spheres_leaves_out_their_union(side):
    r = 0.1
    mesh = triangle(side * r, r)
    t = facet_throat(mesh, 0, 1, 2)
    lens = segment(r, side * r / 2) if side < 2 else 0.0  # half of each lens lies in the triangle
    area = ROOT_3 / 4 * (side * r) ** 2 - np.pi / 2 * r * r + 3 * lens
    assert_allclose(mesh.throats.fluid_areas[t], area, rtol=1e-11)
    assert_allclose(mesh.throats.areas[t], ROOT_3 / 4 * (side * r) ** 2, rtol=1e-13)
    assert not mesh.throats.closed[t]


@pytest.mark.parametrize("side", [1.73, 1.6, 1.2, 1.01])
def test_three_spheres_that_overlap_in_their_middle_close_the_throat(unit_flow, side):
    # The middle is side/√3 from the centres: within all three spheres as soon as side < √3 r.
    mesh = triangle(side * 0.1)
    t = facet_throat(mesh, 0, 1, 2)
    assert mesh.throats.closed[t]
    assert mesh.throats.inscribed_radii(NO_SLIP)[t] == 0.0
    for model in (HydraulicRadius(), EffectiveRadius()):
        assert unit_flow(mesh, Walls.along("z"), model).conductances[t] == 0.0


def test_deep_overlaps_of_many_spheres_still_give_finite_throats(unit_flow):
    rng = np.random.default_rng(2)
    grid = np.stack(np.meshgrid(*[np.arange(5)] * 3), axis=-1).reshape(-1, 3)
    centres = (grid + 0.5 + rng.uniform(-0.05, 0.05, grid.shape)) / 5
    mesh = PoreMesh(Packing(centres, np.full(125, 0.114), Box([0, 0, 0], [1, 1, 1])), wall_tolerance=0.7)
    assert mesh.packing.overlaps.depths.max() > 0.2 * 0.114
    throats = mesh.throats
    for values in (throats.fluid_areas, throats.volumes, throats.wetted_surfaces(NO_SLIP), throats.lengths):
        assert np.isfinite(values).all()
    flow = unit_flow(mesh, Walls.along("y"))
    assert (flow.conductances >= 0.0).all() and np.isfinite(flow.conductances).all()
    assert ((flow.pressure >= 0.0) & (flow.pressure <= 1.0)).all()
    assert flow.forces.conservation_residual < 1e-12


# ---- single throats ----------


def test_throat_of_one_sphere_and_two_walls():
    # A sphere in the middle of a cube: twelve equal throats, one for each edge of the box.
    r = 0.3
    mesh = PoreMesh(Packing([[0.5, 0.5, 0.5]], [r], Box([0, 0, 0], [1, 1, 1])))
    throats = mesh.throats
    assert len(throats) == 12 and mesh.n_pores == 8
    assert_allclose(throats.lengths, 1.0, rtol=1e-15)
    assert_allclose(throats.areas, 0.25, rtol=1e-15)
    assert_allclose(throats.fluid_areas, 0.25 - np.pi * r**2 / 4, rtol=1e-14)
    assert_allclose(throats.volumes, (1 - ball(r)) / 12, rtol=1e-14)
    assert_allclose(throats.wetted_surfaces(NO_SLIP), (4 * np.pi * r**2 + 6) / 12, rtol=1e-14)
    assert_allclose(throats.wetted_surfaces(~NO_SLIP), 4 * np.pi * r**2 / 12, rtol=1e-14)
    assert (throats.mirror_images(~NO_SLIP) == 4.0).all()
    assert (throats.mirror_images(NO_SLIP) == 1.0).all()
    np.testing.assert_array_equal(np.abs(throats.normals).max(axis=1), 1.0)


def test_facets_of_a_tie_are_one_throat(mesh_of):
    # The squares of a cubic lattice are cut into triangles; each square is one throat of the lattice's area.
    mesh = mesh_of("sc8")
    throats = mesh.throats
    assert len(throats) == 54 < len(mesh.facets.cells)
    square = np.isclose(throats.areas, 0.25)
    assert square.sum() == 6  # from the middle of the box to its six neighbours
    assert_allclose(throats.fluid_areas[square], 0.25 - np.pi * 0.25**2, rtol=1e-14)
    assert_allclose(throats.volumes.sum(), 1 - 8 * ball(0.25), rtol=1e-14)
    assert_allclose(throats.lengths, 0.5, rtol=1e-14)


def test_throats_between_united_pores_leave_none_inside(mesh_of):
    mesh = mesh_of("n2000_s1")
    throats = mesh.throats
    assert (throats.pores[:, 0] != throats.pores[:, 1]).all()
    inside = throats.facet_throat < 0
    np.testing.assert_array_equal(inside, np.equal(*mesh.cell_pore[mesh.facets.cells].T))
    assert len(throats) == (~inside).sum()  # a random packing has no ties


def test_symmetry_walls_do_not_drag(mesh_of):
    mesh = mesh_of("n54_s1")
    slip = np.array([True, True, False, False, True, True])
    throats = mesh.throats
    lost = (throats.wetted_surfaces(NO_SLIP) - throats.wetted_surfaces(slip)).sum()
    inside = throats.facet_throat < 0  # surfaces inside a united pore belong to no throat
    walls = (mesh.facets.vertices >= mesh.n_spheres) & slip[np.maximum(mesh.facets.vertices - mesh.n_spheres, 0)]
    assert_allclose(lost, (mesh.facets.surfaces * walls)[~inside].sum(), rtol=1e-12)
    assert_allclose(lost, 4.0, rtol=0.01)


def test_solid_angles_wait_until_they_are_needed(reference, unit_flow, monkeypatch):
    def refuse(*arrays):
        raise AssertionError("solid angles")

    mesh = PoreMesh(reference("n25_s1"))
    monkeypatch.setattr("porefv.mesh.facets.facet_volumes", refuse)
    assert unit_flow(mesh, Walls.along("y"), EffectiveRadius()).permeability > 0.0
    with pytest.raises(AssertionError, match="solid angles"):
        _ = unit_flow(mesh, Walls.along("y"), HydraulicRadius()).permeability


def test_area_of_a_facet_of_one_sphere_is_the_product_of_its_distances_from_two_walls_to_the_bit(mesh_of):
    mesh = mesh_of("n2000_s1")
    n, facets = mesh.n_spheres, mesh.facets
    rectangles = np.flatnonzero(facets.vertices[:, 1] >= n)
    sphere, *walls = facets.vertices[rectangles].T
    to_b, to_c = (mesh.sizes[w] - (mesh.local_points[w] * mesh.local_points[sphere]).sum(axis=1) for w in walls)
    np.testing.assert_array_equal(facets.areas[rectangles], to_b * to_c)


# ---- inscribed circles ----------


@pytest.mark.parametrize("radii", [(0.1, 0.1, 0.1), (0.1, 0.12, 0.07), (0.05, 0.15, 0.1)])
@pytest.mark.parametrize("gap", [0.0, 0.03])
def test_circle_between_three_spheres_touches_them(radii, gap):
    a, b, c = np.array(radii) + gap  # pairwise distances r_i + r_j + 2 gap
    ab, ac, bc = a + b, a + c, b + c
    x = (ab**2 + ac**2 - bc**2) / (2 * ab)
    corners = np.array([[0, 0, 0], [ab, 0, 0], [x, np.sqrt(ac**2 - x**2), 0]]) + np.array([0.35, 0.35, 0.5])
    mesh = PoreMesh(Packing(corners, radii, Box([0, 0, 0], [1, 1, 1])))
    t = facet_throat(mesh, 0, 1, 2)
    rho = mesh.throats.inscribed_radii(NO_SLIP)[t]
    assert rho > 0
    # Descartes' theorem for circles of curvature k: a circle between three touching ones, widened by the gap.
    k = 1 / (np.array(radii) + gap)
    soddy = 1 / (k.sum() + 2 * np.sqrt(k[0] * k[1] + k[1] * k[2] + k[2] * k[0]))
    assert_allclose(rho, soddy + gap, rtol=1e-12)


def test_circle_between_two_spheres_and_a_wall_touches_them_or_is_centred_on_the_wall():
    r = 0.1
    mesh = PoreMesh(Packing([[0.4, 0.5, r], [0.6, 0.5, r]], [r, r], Box([0, 0, 0], [1, 1, 1])))
    t = facet_throat(mesh, 0, 1, 2 + 4)
    assert_allclose(mesh.throats.inscribed_radii(NO_SLIP)[t], r / 4, rtol=1e-13)
    assert_allclose(mesh.throats.inscribed_radii(~NO_SLIP)[t], (np.sqrt(2) - 1) * r, rtol=1e-13)


def test_circle_between_a_sphere_and_two_walls_touches_them_or_is_centred_on_the_edge():
    r, a, b = 0.2, 0.3, 0.5
    mesh = PoreMesh(Packing([[a, 0.5, b]], [r], Box([0, 0, 0], [1, 1, 1])))
    t = facet_throat(mesh, 0, 1 + 0, 1 + 4)
    rho = mesh.throats.inscribed_radii(NO_SLIP)[t]
    assert_allclose(np.hypot(a - rho, b - rho), r + rho, rtol=1e-13)
    assert 0 < rho < a
    assert_allclose(mesh.throats.inscribed_radii(~NO_SLIP)[t], np.hypot(a, b) - r, rtol=1e-13)
    one_slips = np.arange(6) == 0
    rho = mesh.throats.inscribed_radii(one_slips)[t]
    assert_allclose(np.hypot(a, b - rho), r + rho, rtol=1e-13)


# ---- centres of pores ----------------------------------------------------------------------------------------


def test_a_mesh_can_be_pickled_whatever_has_been_derived_from_it(mesh_of):
    mesh = mesh_of("n25_s1")
    assert mesh.throats.derived(lambda throats: len(throats)) == len(mesh.throats)
    again = pickle.loads(pickle.dumps(mesh))
    np.testing.assert_array_equal(again.throats.areas, mesh.throats.areas)


# ---- single throats by their spheres ----------


@pytest.mark.parametrize("name", ["n25_s1", "n54_s1", "sc8"])
def test_a_throat_is_found_between_its_spheres_in_any_order(mesh_of, name):
    throats = mesh_of(name).throats
    for t in range(0, len(throats), 7):
        i, j, k = throats.spheres[t].tolist()
        assert throats.between(i, j, k) == throats.between(k, i, j) == throats.between(j, i, k) == t


def test_between_spheres_without_a_facet_there_is_no_throat(mesh_of):
    mesh = mesh_of("n25_s1")
    for vertices in ((0, 0, 1), (0, 1, 1000), (mesh.n_spheres, mesh.n_spheres + 1, 0)):
        with pytest.raises(InputError, match="no facet of the vertices"):
            mesh.throats.between(*vertices)


def test_a_facet_inside_a_united_pore_is_no_throat(mesh_of):
    mesh = mesh_of("sc8")
    inside = np.flatnonzero(mesh.throats.facet_throat < 0)
    with pytest.raises(InputError, match="united pore"):
        mesh.throats.between(*mesh.facets.vertices[inside[0]])


def test_the_hydraulic_radius_is_the_volume_over_the_surface(mesh_of):
    throats = mesh_of("n54_s1").throats
    surfaces = throats.wetted_surfaces(NO_SLIP)
    assert (surfaces > 0.0).all()
    assert_allclose(throats.hydraulic_radii(NO_SLIP), throats.volumes / surfaces)


@pytest.mark.parametrize("name", ["n54_s1", "n200_s1"])
def test_circles_touch_the_spheres_and_walls_of_their_throats(mesh_of, name):
    mesh = mesh_of(name)
    throats, n = mesh.throats, mesh.n_spheres
    single = np.diff(throats.facets_of_throats.starts) == 1
    radii = throats.inscribed_radii(NO_SLIP)
    centres = throats.inscribed_centres(NO_SLIP)
    for column in throats.spheres.T:
        rows = np.flatnonzero(single & (radii > 0.0) & (column < n))
        gaps = np.linalg.norm(centres[rows] - mesh.packing.centres[column[rows]], axis=1)
        assert_allclose(gaps - mesh.packing.radii[column[rows]], radii[rows], rtol=1e-7, atol=1e-12)
        rows = np.flatnonzero(single & (radii > 0.0) & (column >= n))
        gaps = mesh.box.wall_distances(centres[rows])[np.arange(len(rows)), column[rows] - n]
        assert_allclose(gaps, radii[rows], rtol=1e-7, atol=1e-12)
