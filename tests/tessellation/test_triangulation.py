"""RegularTriangulation against its definition in rational numbers, against qhull and CGAL, on lattices and worse."""

from fractions import Fraction
from itertools import permutations

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from numpy.testing import assert_allclose
from scipy.spatial import ConvexHull

from porefv.errors import ComputationError
from porefv.mesh.pore_mesh import PoreMesh
from porefv.packing.box import Box
from porefv.tessellation.triangulation import RegularTriangulation, exact_origin

UNIT = Box([0, 0, 0], [1, 1, 1])

# ---- the definition, in rational numbers ----------


def fractions(values):
    return [Fraction(float(x)) for x in values]


def det(a, b, c):
    return a[0] * (b[1] * c[2] - b[2] * c[1]) - a[1] * (b[0] * c[2] - b[2] * c[0]) + a[2] * (b[0] * c[1] - b[1] * c[0])


def direction(wall):
    return [Fraction((1 if wall % 2 else -1) * (wall // 2 == axis)) for axis in range(3)]


def offset(wall, box):
    return Fraction(float(box.upper[wall // 2])) if wall % 2 else -Fraction(float(box.lower[wall // 2]))


def dot(a, b):
    return sum(x * y for x, y in zip(a, b, strict=True))


def less(a, b):
    return [x - y for x, y in zip(a, b, strict=True)]


def check_by_brute_force(tri, centres, radii, box):
    """Every statement that defines the triangulation, cell by cell, without rounding."""
    n = len(radii)
    c = [fractions(x) for x in centres]
    h = [dot(x, x) - Fraction(float(r)) ** 2 for x, r in zip(c, radii, strict=True)]
    filled = Fraction(0)
    for t, cell in enumerate(tri.cells.tolist()):
        spheres = [v for v in cell if v < n]
        walls = [v - n for v in cell if v >= n]
        first = spheres[0]

        # Positively oriented, (v0 - v3, v1 - v3, v2 - v3) right-handed, walls standing for their directions.
        rows = [direction(v - n) if v >= n else less(c[v], c[first]) for v in cell]
        k = cell.index(first)
        minor = det(*(rows[m] for m in range(4) if m != k))
        assert (-1) ** (k + 1) * minor > 0

        # No sphere is closer, in power, to the power centre; the centre is on the walls of the cell, within all others.
        others = [m for m in range(4) if m != k]
        a = [rows[m] for m in others]
        b = [offset(cell[m] - n, box) if cell[m] >= n else (h[cell[m]] - h[first]) / 2 for m in others]
        d = det(*a)
        p = [det(*([*r[:axis], v, *r[axis + 1 :]] for r, v in zip(a, b, strict=True))) / d for axis in range(3)]
        power = h[first] - 2 * dot(c[first], p)
        assert all(h[q] - 2 * dot(c[q], p) >= power for q in range(n))
        for wall in range(6):
            assert dot(direction(wall), p) <= offset(wall, box)
            if wall in walls:
                assert dot(direction(wall), p) == offset(wall, box)
        # Error of a power centre: rounding, however flat the cell.
        exact = np.array([float(x - Fraction(float(o))) for x, o in zip(p, tri.origin, strict=True)])
        assert np.abs(tri.local_vertices[t] - exact).max() <= 1e-9 * box.size.max()

        # Its volume: centres swept to the walls.
        def height(v, wall):
            return offset(wall, box) - dot(direction(wall), c[v])

        if len(walls) == 0:
            volume = abs(minor) / 6
        elif len(walls) == 1:
            volume = abs(minor) / 2 * sum(height(v, walls[0]) for v in spheres) / 3
        elif len(walls) == 2:
            (a0, b0), (a1, b1) = ([height(v, w) for w in walls] for v in spheres)
            volume = abs(minor) * (2 * a0 * b0 + 2 * a1 * b1 + a0 * b1 + a1 * b0) / 6
        else:
            volume = height(first, walls[0]) * height(first, walls[1]) * height(first, walls[2])
        filled += volume

    size = less(fractions(box.upper), fractions(box.lower))
    assert filled == size[0] * size[1] * size[2]


def check_neighbours(tri):
    """Across each facet stands the one other cell that has it; three walls have nothing behind them."""
    cells, neighbours = tri.cells, tri.neighbours
    n = tri.n_spheres
    m = len(cells)
    own = np.sort(np.stack([np.delete(cells, i, axis=1) for i in range(4)], axis=1), axis=2)  # (m, 4, 3)
    corner = (own >= n).all(axis=2)
    np.testing.assert_array_equal(neighbours == -1, corner)
    assert corner.sum() == 8
    t, i = np.nonzero(~corner)
    u = neighbours[t, i]
    assert u.min() >= 0 and u.max() < m
    back = neighbours[u] == t[:, None]
    np.testing.assert_array_equal(back.sum(axis=1), 1)
    np.testing.assert_array_equal(own[u, back.argmax(axis=1)], own[t, i])
    assert len({tuple(cell) for cell in np.sort(cells, axis=1)}) == m


def check_orientation(tri, centres):
    """No cell is flat or inside out, without rounding."""
    n = tri.n_spheres
    c = [fractions(x) for x in centres]
    for cell in tri.cells.tolist():
        k = next(m for m, v in enumerate(cell) if v < n)
        rows = [direction(v - n) if v >= n else less(c[v], c[cell[k]]) for m, v in enumerate(cell) if m != k]
        assert (-1) ** (k + 1) * det(*rows) > 0


def cell_set(tri, names=None):
    """Cells as sets of vertices; spheres called by `names` instead of their place in the input."""
    n = tri.n_spheres
    names = np.concatenate([np.arange(n) if names is None else names, np.arange(n, n + 6)])
    return {tuple(cell) for cell in np.sort(names[tri.cells], axis=1).tolist()}


# ---- small cases ----------

grid = st.integers(1, 7).map(lambda k: k / 8)
free = st.floats(1e-3, 1.0 - 1e-3)
radius = st.one_of(st.just(0.125), st.sampled_from([1e-3, 0.25, 0.5]), st.floats(1e-6, 0.6))


@st.composite
def spheres(draw, coordinate, radius):
    points = draw(st.lists(st.tuples(*[coordinate] * 3), min_size=1, max_size=12, unique=True))
    return np.array(points), np.array(draw(st.lists(radius, min_size=len(points), max_size=len(points))))


@settings(max_examples=40)
@given(spheres(free, radius))
def test_cells_are_empty_oriented_and_fill_the_box_for_any_spheres(case):
    tri = RegularTriangulation(*case, UNIT)
    check_by_brute_force(tri, *case, UNIT)
    check_neighbours(tri)


@settings(max_examples=60)
@given(spheres(grid, st.sampled_from([0.125, 0.125, 0.125, 0.25])))
def test_cells_are_empty_oriented_and_fill_the_box_in_ties(case):
    tri = RegularTriangulation(*case, UNIT)
    check_by_brute_force(tri, *case, UNIT)
    check_neighbours(tri)


@settings(max_examples=30)
@given(
    spheres(grid, st.sampled_from([0.125, 0.125, 0.25])),
    st.lists(st.floats(-1e4, 1e4), min_size=3, max_size=3),
    st.lists(st.floats(1e-3, 1e3), min_size=3, max_size=3),
)
def test_boxes_of_any_place_and_shape_are_filled_without_rounding(case, lower, size):
    box = Box(lower, np.array(lower) + size)
    centres = box.lower + case[0] * box.size
    assume(((centres > box.lower) & (centres < box.upper)).all() and len(np.unique(centres, axis=0)) == len(centres))
    radii = case[1] * box.size.min()
    tri = RegularTriangulation(centres, radii, box)
    check_by_brute_force(tri, centres, radii, box)
    check_neighbours(tri)


@given(spheres(grid, st.sampled_from([0.125, 0.25])), st.randoms(use_true_random=False))
def test_cells_do_not_depend_on_the_order_of_the_spheres_even_in_ties(case, random):
    centres, radii = case
    order = np.array(random.sample(range(len(radii)), len(radii)))
    assert cell_set(RegularTriangulation(centres[order], radii[order], UNIT), order) == cell_set(
        RegularTriangulation(centres, radii, UNIT)
    )


@given(
    st.lists(st.floats(-1e6, 1e6), min_size=3, max_size=3),
    st.lists(st.floats(1e-6, 1e6), min_size=3, max_size=3),
    st.floats(0, 1),
)
def test_coordinates_from_the_local_origin_are_exact(lower, size, where):
    box = Box(lower, np.array(lower) + size)
    origin = exact_origin(box)
    for point in (box.lower, box.upper, np.clip(box.lower + where * box.size, box.lower, box.upper)):
        local = point - origin
        assert fractions(local) == less(fractions(point), fractions(origin))


# ---- known cases ----------


def test_one_sphere_has_eight_cells_of_three_walls():
    tri = RegularTriangulation(np.array([[0.3, 0.4, 0.7]]), np.array([0.1]), UNIT)
    assert cell_set(tri) == {(0, 1 + x, 3 + y, 5 + z) for x in (0, 1) for y in (0, 1) for z in (0, 1)}
    np.testing.assert_array_equal(np.sort(tri.vertices, axis=0), [[0.0] * 3] * 4 + [[1.0] * 3] * 4)
    check_neighbours(tri)


def test_eight_spheres_of_a_cube_tie_with_one_another_and_with_the_walls(reference):
    packing = reference("sc8")
    tri = RegularTriangulation(packing.centres, packing.radii, packing.box)
    check_by_brute_force(tri, packing.centres, packing.radii, packing.box)
    # The only Laguerre vertices are those of the cube cut into eight.
    assert {tuple(v) for v in tri.vertices.tolist()} == {
        (x, y, z) for x in (0, 0.5, 1) for y in (0, 0.5, 1) for z in (0, 0.5, 1)
    }


@pytest.mark.parametrize("name", ["nine_0.2", "nine_0.4", "nine_0.5", "nine_0.72", "n25_s1", "n54_s1"])
def test_small_reference_packings_satisfy_the_definition(reference, name):
    packing = reference(name)
    tri = RegularTriangulation(packing.centres, packing.radii, packing.box)
    check_by_brute_force(tri, packing.centres, packing.radii, packing.box)
    check_neighbours(tri)


@pytest.mark.parametrize(
    ("name", "pores"),
    [("n25_s1", 122), ("n54_s1", 272), ("n200_s1", 1088), ("n2000_s1", 11_299), ("n20000_s1", 117_562)],
)
def test_there_are_as_many_cells_as_yade_finds(mesh_of, values, name, pores):
    assert mesh_of(name).n_cells == pores == values("yade_flow")["packings"][name]["no_slip"]["cells"]
    check_neighbours(mesh_of(name).triangulation)


def test_a_sphere_buried_in_the_union_of_others_is_hidden():
    # The small sphere in the middle of the octahedron is nowhere the closest: its power is 0.5² - 0.4² > 0 - r².
    centres = np.concatenate([np.eye(3), -np.eye(3), np.zeros((1, 3))]) * 0.25 + 0.5
    radii = np.array([0.3] * 6 + [0.01])
    tri = RegularTriangulation(centres, radii, UNIT)
    assert tri.hidden.tolist() == [6]
    assert "1 hidden" in repr(tri)
    check_by_brute_force(tri, centres, radii, UNIT)
    # The same, seen from every place in the input.
    order = np.roll(np.arange(7), 3)
    assert order[RegularTriangulation(centres[order], radii[order], UNIT).hidden].tolist() == [6]
    # Once it reaches out of the union, it has cells.
    radii[6] = 0.2
    assert RegularTriangulation(centres, radii, UNIT).hidden.tolist() == []


def test_many_hidden_spheres_are_all_found():
    # Small spheres near the surface of a big one, their centres inside: hidden, but for those that poke out.
    rng = np.random.default_rng(5)
    v = rng.normal(size=(100, 3))
    far = rng.uniform(0.05, 0.45, 100)
    centres = np.concatenate([[[0.5, 0.5, 0.5]], 0.5 + v / np.linalg.norm(v, axis=1)[:, None] * far[:, None]])
    radii = np.concatenate([[0.4], np.full(100, 1e-4)])
    tri = RegularTriangulation(centres, radii, UNIT)
    check_neighbours(tri)
    # A point at distance ρ from the middle is closer than the big sphere beyond a plane across the ray through it.
    # The plane of equal power stands at (ρ² + R² - r²) / 2ρ: hidden for sure where that is outside the box.
    inside_box = (far**2 + 0.4**2 - 1e-8) / (2 * far) < np.sqrt(3) / 2
    assert not set(tri.hidden) & {0}
    assert set(np.flatnonzero(~inside_box) + 1) <= set(tri.hidden)
    check_by_brute_force(tri, centres, radii, UNIT)


def test_two_skew_rows_of_spheres_have_a_quadratic_number_of_cells():
    # Each pair of neighbours of one row meets each pair of the other: more cells than first reserved.
    m = 60
    s = np.linspace(0.1, 0.9, m)
    one = np.stack([s, np.full(m, 0.4), np.full(m, 0.4)], axis=1)
    other = np.stack([np.full(m, 0.6), s, np.full(m, 0.6)], axis=1)
    centres = np.concatenate([one, other])
    tri = RegularTriangulation(centres, np.full(2 * m, 1e-3), UNIT)
    check_neighbours(tri)
    of_spheres = (tri.cells < 2 * m).all(axis=1)
    of_each_row = ((tri.cells < m).sum(axis=1) == 2) & of_spheres
    assert of_each_row.sum() > m**2 / 2
    # One large sphere amid them conquers thousands of cells at once.
    centres = np.concatenate([centres, [[0.6, 0.4, 0.5]]])
    tri = RegularTriangulation(centres, np.append(np.full(2 * m, 1e-3), 0.5), UNIT)
    check_neighbours(tri)


def test_spheres_of_very_different_size_and_distance_are_separated_exactly():
    # Coordinates over 30 decades: nothing but exact arithmetic orders these.
    s = 2.0 ** -np.arange(1, 100, 3)
    centres = np.stack([s, s[::-1].copy(), np.full(len(s), 0.5)], axis=1)[::4]
    radii = np.full(len(centres), 1e-9)
    tri = RegularTriangulation(centres, radii, UNIT)
    check_neighbours(tri)
    check_by_brute_force(tri, centres, radii, UNIT)


def test_coordinates_too_small_for_exact_products_are_refused():
    with pytest.raises(ComputationError, match="move the spheres"):
        RegularTriangulation(np.array([[1e-50, 0.5, 0.5]]), np.array([0.1]), Box([-1, 0, 0], [1, 1, 1]))


# ---- others' triangulations ----------


def local(packing):
    return packing.centres - packing.centres.mean(axis=0)


def hull_tetrahedra(packing):
    """Lower hull of the lifted points: the regular triangulation of the whole space, by qhull."""
    x = local(packing)
    hull = ConvexHull(np.column_stack([x, (x * x).sum(axis=1) - packing.radii**2]))
    return np.sort(hull.simplices[hull.equations[:, 3] < 0.0], axis=1)


def cgal_tetrahedra(packing):
    kernel = pytest.importorskip("CGAL.CGAL_Kernel")
    module = pytest.importorskip("CGAL.CGAL_Triangulation_3")
    x = local(packing)
    names = {tuple(p): k for k, p in enumerate(x.tolist())}
    triangulation = module.Regular_triangulation_3()
    triangulation.insert(
        [
            kernel.Weighted_point_3(kernel.Point_3(*p), w)
            for p, w in zip(x.tolist(), (packing.radii**2).tolist(), strict=True)
        ]
    )
    tetrahedra = []
    for cell in triangulation.finite_cells():
        points = [cell.vertex(i).point() for i in range(4)]
        tetrahedra.append([names[p.x(), p.y(), p.z()] for p in points])
    return np.sort(tetrahedra, axis=1)


def within_the_box(packing, tetrahedra):
    """Those whose power centre lies in the box: no wall is in conflict with them, and they are cells of ours."""
    c, h = packing.centres, (packing.centres**2).sum(axis=1) - packing.radii**2
    a = c[tetrahedra[:, 1:]] - c[tetrahedra[:, :1]]
    b = (h[tetrahedra[:, 1:]] - h[tetrahedra[:, :1]]) / 2
    regular = np.abs(np.linalg.det(a)) > 0.0
    p = np.linalg.solve(a[regular], b[regular, :, None])[..., 0]
    inside = ((p > packing.box.lower) & (p < packing.box.upper)).all(axis=1)
    return {tuple(t) for t in tetrahedra[regular][inside].tolist()}


def packings(reference, random_packing):
    yield "polydisperse", random_packing(1500, ratio=0.05, seed=3)
    yield "loose", random_packing(800, ratio=1.0, seed=4, fraction=0.05)
    yield "dense", reference("n2000_s1")
    yield "dense, equal", reference("n200_s1")


@pytest.mark.parametrize("theirs", [hull_tetrahedra, cgal_tetrahedra], ids=["qhull", "cgal"])
def test_cells_away_from_walls_are_those_of_others(theirs, reference, random_packing):
    for name, packing in packings(reference, random_packing):
        tri = RegularTriangulation(packing.centres, packing.radii, packing.box)
        ours = cell_set_of_spheres(tri)
        assert ours == within_the_box(packing, theirs(packing)), name
        # Random and dense packings alike have most of their cells away from walls.
        assert len(ours) > 2 * len(packing), name


def cell_set_of_spheres(tri):
    n = tri.n_spheres
    return {cell for cell in cell_set(tri) if cell[-1] < n}


def test_random_points_of_random_weights_have_the_cells_of_qhull():
    rng = np.random.default_rng(11)

    class Points:
        centres = rng.random((1500, 3))
        radii = rng.uniform(0.0, 0.15, 1500)
        box = UNIT

    tri = RegularTriangulation(Points.centres, Points.radii, UNIT)
    assert len(tri.hidden) > 100
    assert cell_set_of_spheres(tri) == within_the_box(Points, hull_tetrahedra(Points))


# ---- lattices ----------


@pytest.mark.parametrize(("kind", "m"), [("sc", 10), ("bcc", 8), ("fcc", 7), ("hcp", 13)])
@pytest.mark.parametrize("spacing", [1.0, 0.1], ids=["exact", "rounded"])
def test_lattices_triangulate_and_fill_the_box(lattice, kind, m, spacing):
    # A spacing of 0.1 rounds every coordinate: ties become near-ties of either sign, and ties of ties.
    packing = lattice(kind, m, spacing=spacing)
    assert 1000 <= len(packing) <= 4000
    mesh = PoreMesh(packing)
    check_neighbours(mesh.triangulation)
    assert mesh.triangulation.hidden.size == 0
    check_orientation(mesh.triangulation, packing.centres)
    # Summed in floating point: some ε for 10⁴ positive terms.
    assert_allclose(mesh.cell_volumes.sum(), packing.box.volume, rtol=1e-13)


@pytest.mark.parametrize("kind", ["sc", "bcc", "fcc", "hcp"])
def test_small_lattices_satisfy_the_definition(lattice, kind):
    packing = lattice(kind, 3 if kind in ("sc", "hcp") else 2, spacing=0.3)
    tri = RegularTriangulation(packing.centres, packing.radii, packing.box)
    check_by_brute_force(tri, packing.centres, packing.radii, packing.box)


def test_cells_of_a_lattice_do_not_depend_on_the_order_of_its_spheres(lattice):
    packing = lattice("fcc", 5)
    wanted = cell_set(RegularTriangulation(packing.centres, packing.radii, packing.box))
    for seed in range(3):
        order = np.random.default_rng(seed).permutation(len(packing))
        tri = RegularTriangulation(packing.centres[order], packing.radii[order], packing.box)
        assert cell_set(tri, order) == wanted


def test_cells_of_a_packing_turn_with_its_axes(reference):
    # No ties, hence no perturbation that could prefer an axis.
    packing = reference("n54_s1")
    wanted = cell_set(RegularTriangulation(packing.centres, packing.radii, packing.box))
    n = len(packing)
    for axes in permutations(range(3)):
        names = np.concatenate([np.arange(n), [n + 2 * axis + up for axis in axes for up in (0, 1)]])
        tri = RegularTriangulation(packing.centres[:, axes], packing.radii, packing.box)
        assert {tuple(cell) for cell in np.sort(names[tri.cells], axis=1).tolist()} == wanted


def test_repeated_triangulations_are_equal_to_the_bit(reference):
    packing = reference("n200_s1")
    one, two = (RegularTriangulation(packing.centres, packing.radii, packing.box) for _ in range(2))
    np.testing.assert_array_equal(one.cells, two.cells)
    np.testing.assert_array_equal(one.neighbours, two.neighbours)
    np.testing.assert_array_equal(one.vertices, two.vertices)
