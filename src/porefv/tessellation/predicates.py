"""The two predicates of a regular triangulation, evaluated exactly, for spheres and ideal walls alike.

Vertices
    Spheres and walls, as of `porefv.tessellation.vertices`. A wall is the limit of a sphere of infinite radius.
Rows of a cell (v0, v1, v2, v3), seen from the sphere q
    a_k = c_k - c_q, H_k = |a_k|² - r_k² + r_q² for a sphere;  a_k = d, H_k = 2 (s - d·c_q) for a wall.
    C_k = (-1)^(k+3) det(the other three a): the orientation of the cell with v_k replaced by q.
    Δ = Σ H_k C_k = -f O, with O > 0 the orientation of the cell and f = |c_q - P|² - r_q² - ρ²:
    q is *in conflict* with the cell, f < 0, where Δ > 0.

Each predicate is decided in floating point when an error bound allows it, else with expansions, and where
the exact value is zero by symbolic perturbation: the weights r_k² are regarded as lowered by infinitesimals
of decreasing size, in lexicographic order of the centres (Edelsbrunner and Mücke 1990). The answer so
depends on the packing alone, not on the order of its spheres or of their insertion.
"""

from __future__ import annotations

import numpy as np

from porefv.system.kernels import helper
from porefv.tessellation.expansions import add, estimate, multiply, sign, two_product, two_sum

EPSILON = 2.0**-53
# Shewchuk's bounds are 7 ε (3x3) and 16 ε (insphere) times the permanent; the radii add a few roundings.
_MINOR_BOUND = 8.0 * EPSILON
_CONFLICT_BOUND = 24.0 * EPSILON


@helper
def minors(b, c):
    """The vector b × c of two rows, and its permanents of absolute values (the scale of its rounding error)."""
    return (
        (b[1] * c[2] - b[2] * c[1], b[2] * c[0] - b[0] * c[2], b[0] * c[1] - b[1] * c[0]),
        (
            abs(b[1] * c[2]) + abs(b[2] * c[1]),
            abs(b[2] * c[0]) + abs(b[0] * c[2]),
            abs(b[0] * c[1]) + abs(b[1] * c[0]),
        ),
    )


@helper
def determinant(a, b, c):
    """det of three rows and its permanent of absolute values (the scale of its rounding error)."""
    m, p = minors(b, c)
    return a[0] * m[0] + a[1] * m[1] + a[2] * m[2], abs(a[0]) * p[0] + abs(a[1]) * p[1] + abs(a[2]) * p[2]


@helper
def row(v, q, vertices):
    """a_k, H_k and the magnitude of the terms of H_k, in floating point."""
    n, points, weights = vertices
    if v < n:
        x = points[v, 0] - points[q, 0]
        y = points[v, 1] - points[q, 1]
        z = points[v, 2] - points[q, 2]
        square = x * x + y * y + z * z
        rk2 = weights[v] * weights[v]
        rq2 = weights[q] * weights[q]
        return (x, y, z), square - rk2 + rq2, square + rk2 + rq2
    x = points[v, 0]
    y = points[v, 1]
    z = points[v, 2]
    along = x * points[q, 0] + y * points[q, 1] + z * points[q, 2]
    return (x, y, z), 2.0 * (weights[v] - along), 2.0 * (abs(weights[v]) + abs(along))


@helper(forceinline=False)
def side(cell, i, q, vertices):
    """Sign of C_i: positive where q lies on the cell's own side of the facet opposite to its vertex i.

    Parameters
    ----------
    cell : (4,) int array
        Its vertices.
    i : int
        Place of a vertex in it.
    q : int
        A sphere.
    vertices : Vertices
    """
    j, k, m = _others(i)
    a, _, _ = row(cell[j], q, vertices)
    b, _, _ = row(cell[k], q, vertices)
    c, _, _ = row(cell[m], q, vertices)
    value, permanent = determinant(a, b, c)
    if abs(value) > _MINOR_BOUND * permanent:
        s = 1 if value > 0.0 else -1
    else:
        exact = np.empty(192)
        rows = _exact_rows(cell, q, vertices)
        s = sign(exact, _exact_minor(rows, j, k, m, exact))
    return -s if i % 2 == 0 else s


@helper(forceinline=False)
def in_conflict(cell, q, vertices):
    """Whether the sphere q lies closer, in power, to the cell's power centre than the cell's own vertices."""
    a0, h0, t0 = row(cell[0], q, vertices)
    a1, h1, t1 = row(cell[1], q, vertices)
    a2, h2, t2 = row(cell[2], q, vertices)
    a3, h3, t3 = row(cell[3], q, vertices)
    c0, p0 = determinant(a1, a2, a3)
    c1, p1 = determinant(a0, a2, a3)
    c2, p2 = determinant(a0, a1, a3)
    c3, p3 = determinant(a0, a1, a2)
    value = -h0 * c0 + h1 * c1 - h2 * c2 + h3 * c3
    if abs(value) > _CONFLICT_BOUND * (t0 * p0 + t1 * p1 + t2 * p2 + t3 * p3):
        return value > 0.0
    s = _exact_conflict(cell, q, vertices)
    if s == 0:
        s = _perturbed_conflict(cell, q, vertices)
    return s > 0


@helper(forceinline=False)
def power_centre(cell, q, vertices):
    """Power centre of a cell relative to its sphere q, correctly rounded from exact determinants."""
    centre = np.empty(3)
    rows = _exact_rows(cell, q, vertices)
    numerator = np.empty(36864)
    product = np.empty(9216)
    total = np.empty(36864)
    minor = np.empty(192)
    height = np.empty(32)
    others = np.empty(3, np.int64)
    m = 0
    for k in range(4):
        if cell[k] != q:
            others[m] = k
            m += 1
    denominator = estimate(minor, _exact_minor(rows, others[0], others[1], others[2], minor))
    for axis in range(3):
        # Cramer's rule for 2 a_k·x = H_k: the column `axis` replaced by H, developed along that column.
        u = (axis + 1) % 3
        v = (axis + 2) % 3
        count = 0
        for k in range(3):
            b = others[(k + 1) % 3]
            c = others[(k + 2) % 3]
            nm = _exact_minor2(rows, b, c, u, v, minor)
            nh = _exact_height(cell[others[k]], q, rows, others[k], vertices, height)
            np_ = multiply(minor, nm, height, nh, product)
            for i in range(count):
                total[i] = numerator[i]
            count = add(total, count, product, np_, numerator)
        centre[axis] = 0.5 * estimate(numerator, count) / denominator
    return centre[0], centre[1], centre[2]


@helper
def _others(i):
    """The other three places of a cell."""
    if i == 0:
        return 1, 2, 3
    if i == 1:
        return 0, 2, 3
    if i == 2:
        return 0, 1, 3
    return 0, 1, 2


@helper(forceinline=False)
def _exact_rows(cell, q, vertices):
    """The rows a_k as (4, 3, 2): each entry the exact sum of a small and a large double."""
    n, points, _ = vertices
    rows = np.zeros((4, 3, 2))
    for k in range(4):
        v = cell[k]
        for axis in range(3):
            if v >= n:
                rows[k, axis, 1] = points[v, axis]
            elif v != q:
                high, low = two_sum(points[v, axis], -points[q, axis])
                rows[k, axis, 0] = low
                rows[k, axis, 1] = high
    return rows


@helper(forceinline=False)
def _entry(low, high, out):
    """The expansion low + high."""
    n = 0
    if low != 0.0:
        out[n] = low
        n += 1
    if high != 0.0:
        out[n] = high
        n += 1
    return n


@helper(forceinline=False)
def _exact_minor2(rows, j, k, u, v, out):
    """rows[j, u] rows[k, v] - rows[j, v] rows[k, u] (at most 16 components)."""
    x = np.empty(2)
    y = np.empty(2)
    left = np.empty(8)
    right = np.empty(8)
    nx = _entry(rows[j, u, 0], rows[j, u, 1], x)
    ny = _entry(rows[k, v, 0], rows[k, v, 1], y)
    nl = multiply(x, nx, y, ny, left)
    nx = _entry(rows[j, v, 0], rows[j, v, 1], x)
    ny = _entry(rows[k, u, 0], rows[k, u, 1], y)
    nr = multiply(x, nx, y, ny, right)
    for i in range(nr):
        right[i] = -right[i]
    return add(left, nl, right, nr, out)


@helper(forceinline=False)
def _exact_minor(rows, j, k, m, out):
    """det of the rows j, k, m (at most 192 components)."""
    x = np.empty(2)
    minor = np.empty(16)
    product = np.empty(64)
    total = np.empty(192)
    count = 0
    for axis in range(3):
        nm = _exact_minor2(rows, k, m, (axis + 1) % 3, (axis + 2) % 3, minor)
        nx = _entry(rows[j, axis, 0], rows[j, axis, 1], x)
        np_ = multiply(minor, nm, x, nx, product)
        for i in range(count):
            total[i] = out[i]
        count = add(total, count, product, np_, out)
    return count


@helper(forceinline=False)
def _exact_height(v, q, rows, k, vertices, out):
    """H_k of vertex v in row k (at most 24 components)."""
    n, points, weights = vertices
    term = np.empty(2)
    total = np.empty(32)
    count = 0
    if v >= n:
        # Walls are axis-aligned: d has one non-zero entry, +1 or -1, and d·c_q is exact.
        along = points[v, 0] * points[q, 0] + points[v, 1] * points[q, 1] + points[v, 2] * points[q, 2]
        high, low = two_sum(weights[v], -along)
        return _entry(2.0 * low, 2.0 * high, out)
    factors = np.empty((11, 2))
    for axis in range(3):
        low = rows[k, axis, 0]
        high = rows[k, axis, 1]
        factors[3 * axis, 0] = high
        factors[3 * axis, 1] = high
        factors[3 * axis + 1, 0] = 2.0 * high
        factors[3 * axis + 1, 1] = low
        factors[3 * axis + 2, 0] = low
        factors[3 * axis + 2, 1] = low
    factors[9, 0] = weights[q]
    factors[9, 1] = weights[q]
    factors[10, 0] = -weights[v]
    factors[10, 1] = weights[v]
    for f in range(11):
        if factors[f, 0] == 0.0 or factors[f, 1] == 0.0:
            continue
        high, low = two_product(factors[f, 0], factors[f, 1])
        nt = _entry(low, high, term)
        for i in range(count):
            total[i] = out[i]
        count = add(total, count, term, nt, out)
    return count


@helper(forceinline=False)
def _exact_conflict(cell, q, vertices):
    """Sign of Δ in exact arithmetic."""
    rows = _exact_rows(cell, q, vertices)
    minor = np.empty(192)
    height = np.empty(32)
    counts = np.zeros(4, np.int64)
    products = np.empty((4, 9216))
    for k in range(4):
        i, j, m = _others(k)
        nm = _exact_minor(rows, i, j, m, minor)
        nh = _exact_height(cell[k], q, rows, k, vertices, height)
        counts[k] = multiply(minor, nm, height, nh, products[k])
        if k % 2 == 0:
            for c in range(counts[k]):
                products[k, c] = -products[k, c]
    left = np.empty(counts[0] + counts[1])
    right = np.empty(counts[2] + counts[3])
    nl = add(products[0], counts[0], products[1], counts[1], left)
    nr = add(products[2], counts[2], products[3], counts[3], right)
    total = np.empty(nl + nr)
    return sign(total, add(left, nl, right, nr, total))


@helper(forceinline=False)
def _precedes(u, v, points):
    """Whether vertex u comes before v in lexicographic order of the points (n + 6, 3)."""
    for axis in range(3):
        if points[u, axis] != points[v, axis]:
            return points[u, axis] < points[v, axis]
    return u < v


@helper(forceinline=False)
def _perturbed_conflict(cell, q, vertices):
    """Sign of Δ when its exact value is zero: that of the first non-zero derivative by a perturbed weight.

    Raising h_k = |c_k|² - r_k² of a vertex by ε changes Δ by ε C_k, that of q by -ε O; O > 0 never
    vanishes, so a decision is always reached.
    """
    n, points, _ = vertices
    rank = np.empty(5, np.int64)  # positions 0..3 in the cell, 4 for q, in order of decreasing perturbation
    count = 0
    for k in range(5):
        v = q if k == 4 else cell[k]
        if v >= n:
            continue  # walls are not perturbed: they tie only through the spheres
        p = count
        while p > 0:
            w = q if rank[p - 1] == 4 else cell[rank[p - 1]]
            if not _precedes(v, w, points):
                break
            rank[p] = rank[p - 1]
            p -= 1
        rank[p] = k
        count += 1
    for p in range(count):
        if rank[p] == 4:
            return -1
        s = side(cell, rank[p], q, vertices)
        if s != 0:
            return s
    return -1
