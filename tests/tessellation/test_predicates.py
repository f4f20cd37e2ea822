"""The predicates against rational arithmetic, ties and near-ties, spheres and walls: a sign is right or wrong."""

from fractions import Fraction

import numpy as np
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from porefv.packing.box import WALL_NORMALS
from porefv.tessellation.predicates import in_conflict, power_centre, side
from porefv.tessellation.vertices import Vertices

N = 5  # spheres 0 ... 3 may be vertices of the cell, sphere 4 is asked about; walls are 5 ... 10
Q = 4


def nudged(value, ulps):
    for _ in range(abs(ulps)):
        value = np.nextafter(value, np.inf if ulps > 0 else -np.inf)
    return float(value)


# A coarse grid makes ties, a nudge by a few units in the last place near-ties; free numbers are generic.
coordinates = st.one_of(
    st.builds(nudged, st.integers(1, 7).map(lambda k: k / 8), st.sampled_from([0, 0, 0, 0, 1, -1, 3])),
    st.floats(2.0**-20, 1.0 - 2.0**-20),
)
radii = st.one_of(st.sampled_from([0.125, 0.125, 0.25]), st.floats(1e-6, 0.5))


@st.composite
def problems(draw):
    """(cell, points, weights) of a positively oriented cell and five spheres in the unit cube."""
    points = np.concatenate([draw(st.lists(st.tuples(*[coordinates] * 3), min_size=N, max_size=N)), WALL_NORMALS])
    assume(len({tuple(p) for p in points[:N]}) == N)
    weights = np.array(draw(st.lists(radii, min_size=N, max_size=N)) + [0.0, 1.0] * 3)
    n_walls = draw(st.integers(0, 3))
    axes = draw(st.permutations(range(3)))[:n_walls]
    walls = [N + 2 * axis + draw(st.integers(0, 1)) for axis in axes]
    cell = draw(st.permutations([*range(4 - n_walls), *walls]))
    o = orientation(cell, points)
    assume(o != 0)
    if o < 0:
        cell[0], cell[1] = cell[1], cell[0]
    return np.array(cell, np.int32), points, weights


def fractions(values):
    return [Fraction(float(x)) for x in values]


def rows_from(q, cell, points):
    """Rows of the cell seen from a sphere: differences of centres, or outward directions."""
    c = fractions(points[q])
    return [
        fractions(points[v]) if v >= N else [a - b for a, b in zip(fractions(points[v]), c, strict=True)] for v in cell
    ]


def det(a, b, c):
    return a[0] * (b[1] * c[2] - b[2] * c[1]) - a[1] * (b[0] * c[2] - b[2] * c[0]) + a[2] * (b[0] * c[1] - b[1] * c[0])


def signed_minors(rows):
    """C_k: the orientation of the cell with its vertex k replaced by the point it is seen from."""
    return [(-1) ** (k + 1) * det(*(rows[m] for m in range(4) if m != k)) for k in range(4)]


def orientation(cell, points):
    """Sign of det(v1 - v0, v2 - v0, v3 - v0), walls as directions: the signed minors of the spheres add up to it."""
    o = sum(c for v, c in zip(cell, signed_minors(rows_from(Q, cell, points)), strict=True) if v < N)
    return (o > 0) - (o < 0)


def conflict(cell, points, heights, weights):
    """Σ H_k C_k with |c|² - r² of each sphere given as `heights`."""
    c = signed_minors(rows_from(Q, cell, points))
    q = fractions(points[Q])
    total = Fraction(0)
    for v, minor in zip(cell, c, strict=True):
        p = fractions(points[v])
        along = sum(a * b for a, b in zip(p, q, strict=True))
        if v >= N:
            total += 2 * (Fraction(float(weights[v])) - along) * minor
        else:
            # |c_v - c_q|² - r_v² + r_q² = h_v - h_q - 2 c_q·(c_v - c_q), h = |c|² - r²
            square = sum(b * b for b in q)
            total += (heights[v] - heights[Q] - 2 * (along - square)) * minor
    return total


def heights_of(points, weights):
    return [sum(x * x for x in fractions(points[v])) - Fraction(float(weights[v])) ** 2 for v in range(N)]


@settings(max_examples=300)
@given(problems())
def test_side_is_the_sign_of_the_exact_minor(problem):
    cell, points, weights = problem
    for i, minor in enumerate(signed_minors(rows_from(Q, cell, points))):
        assert side(cell, i, Q, Vertices(N, points, weights)) == (minor > 0) - (minor < 0)


def exact_conflict(cell, points, weights):
    """(whether the fifth sphere is in conflict, whether that is a tie)."""
    heights = heights_of(points, weights)
    value = conflict(cell, points, heights, weights)
    tie = value == 0
    if tie:
        # The perturbation itself, not its derivative: numbers so small that each outweighs all that follow.
        order = sorted(range(N), key=lambda v: tuple(points[v]))
        for rank, v in enumerate(order):
            heights[v] += Fraction(1, 2 ** (2000 * (rank + 1)))
        value = conflict(cell, points, heights, weights)
    assert value != 0
    return value > 0, tie


@settings(max_examples=300)
@given(problems())
def test_conflict_is_exact(problem):
    cell, points, weights = problem
    assert in_conflict(cell, Q, Vertices(N, points, weights)) == exact_conflict(cell, points, weights)[0]


def test_ties_of_a_cubic_lattice_are_broken_by_weights_lowered_in_the_order_of_the_centres():
    # Five places of a 3³ lattice in random order, up to three of their cell's places taken by walls.
    rng = np.random.default_rng(0)
    grid = np.stack(np.meshgrid(*[np.array([1.0, 2.0, 3.0]) / 4] * 3), axis=-1).reshape(-1, 3)
    weights = np.array([0.125] * N + [0.0, 1.0] * 3)
    ties = 0
    for _ in range(1500):
        points = np.concatenate([grid[rng.choice(27, N, replace=False)], WALL_NORMALS])
        walls = N + 2 * np.arange(3) + rng.integers(0, 2, 3)
        cell = np.arange(4, dtype=np.int32)
        n_walls = rng.integers(0, 4)
        cell[4 - n_walls :] = walls[rng.permutation(3)[:n_walls]]
        o = orientation(cell, points)
        if o == 0:
            continue
        if o < 0:
            cell[:2] = cell[1::-1]
        expected, tie = exact_conflict(cell, points, weights)
        assert in_conflict(cell, Q, Vertices(N, points, weights)) == expected
        ties += tie
    assert ties > 100


@given(problems())
def test_conflict_does_not_depend_on_the_order_of_the_vertices(problem):
    cell, points, weights = problem
    said = {
        bool(in_conflict(cell[list(even)], Q, Vertices(N, points, weights)))
        for even in [(0, 1, 2, 3), (1, 2, 0, 3), (1, 0, 3, 2), (2, 3, 0, 1), (3, 1, 0, 2), (0, 3, 1, 2)]
    }
    assert len(said) == 1


@given(problems())
def test_power_centre_is_rounded_correctly_but_for_a_few_units_in_the_last_place(problem):
    cell, points, weights = problem
    q = next(v for v in cell if v < N)
    rows = [r for v, r in zip(cell, rows_from(q, cell, points), strict=True) if v != q]
    weight = Fraction(float(weights[q])) ** 2
    heights = []
    for v, r in zip((v for v in cell if v != q), rows, strict=True):
        if v >= N:
            along = sum(a * b for a, b in zip(r, fractions(points[q]), strict=True))
            heights.append(2 * (Fraction(float(weights[v])) - along))
        else:
            heights.append(sum(a * a for a in r) - Fraction(float(weights[v])) ** 2 + weight)
    d = det(*rows)
    centre = power_centre(cell, q, Vertices(N, points, weights))
    for axis in range(3):
        columns = [[*r[:axis], h, *r[axis + 1 :]] for r, h in zip(rows, heights, strict=True)]
        exact = det(*columns) / (2 * d)
        # Numerator, denominator and quotient are each rounded once or twice.
        assert abs(Fraction(float(centre[axis])) - exact) <= 8 * Fraction(2) ** -53 * abs(exact)
