"""Incremental construction of the regular triangulation (Bowyer 1981, Watson 1981), one sphere after another.

Arrays (capacity m cells)
    cells (m, 4) int32       vertices, positively oriented; spheres < n, walls n .. n+5; cells[t, 0] = -1: free
    neighbours (m, 4) int32  cell across the facet opposite to each vertex; -1 beyond a corner of the box
    planes (m, 4)            (2 P, β): f(q) = |c_q|² - r_q² - β - 2 P·c_q is q's power to P less ρ² (six operations)
    bounds (m,)              bound on the rounding error of f for any q in the box
    marks (m,) int32         +s / -s: cell found in conflict / not in conflict with the s-th inserted sphere
    ends (m, 4) int32        new cell built on each facet of the cavity's boundary
    free (m,) int32          stack of unused cells
    state (4,) int64         [number in `free`, first never-used cell, last new cell, spheres inserted]
"""

from __future__ import annotations

import numpy as np

from porefv.system.growing_arrays import doubled
from porefv.system.kernels import njit
from porefv.tessellation.predicates import EPSILON, determinant, in_conflict, power_centre, row, side

# Relative error of a power centre beyond which it is computed again in exact arithmetic.
_CENTRE_TOLERANCE = 2.0**-30


@njit(cache=True)
def start(q, n, points, weights, cells, neighbours, planes, bounds, free, state, extent, magnitude):
    """The first sphere: eight cells, each of the sphere and the three walls at one corner of the box.

    Parameters
    ----------
    q : int
        The first sphere.
    n : int
        Number of spheres.
    points, weights : (n + 6, 3), (n + 6,) float64 arrays
        See `porefv.tessellation.predicates`.
    cells, neighbours, planes, bounds, free, state : as in the module's docstring
        The eight cells are written to the first places; `free` is left as it is.
    extent : (3,) float64 array
        Size of the box, in the unit of `points`.
    magnitude : float
        Bound on |c|² + r² of any sphere, plus the square of the largest offset of a wall, in the squared unit of
        `points`.
    """
    for corner in range(8):
        outward = 1
        cells[corner, 0] = q
        for axis in range(3):
            upper = (corner >> axis) & 1
            outward *= 2 * upper - 1
            cells[corner, axis + 1] = n + 2 * axis + upper
            neighbours[corner, axis + 1] = corner ^ (1 << axis)
        neighbours[corner, 0] = -1
        if outward > 0:  # keep the orientation positive
            cells[corner, 1], cells[corner, 2] = cells[corner, 2], cells[corner, 1]
            neighbours[corner, 1], neighbours[corner, 2] = neighbours[corner, 2], neighbours[corner, 1]
        _place(corner, q, n, points, weights, cells, planes, bounds, extent, magnitude)
    state[0] = 0
    state[1] = 8
    state[2] = 0
    state[3] = 1


@njit(cache=True, nogil=True)
def insert(
    order, first, n, points, weights, cells, neighbours, planes, bounds, marks, ends, free, state, extent, magnitude
):
    """Insert the spheres order[first:]; returns how many were done (fewer where the arrays are full).

    Parameters
    ----------
    order : (n,) int64 array
        Spheres in the order of insertion.
    first : int
        Number of them that are done already, at least one.
    n, points, weights, extent, magnitude
        As for `start`.
    cells, neighbours, planes, bounds, marks, ends, free, state : as in the module's docstring
        Are changed in place.

    Returns
    -------
    int
        How many spheres of `order` are done, those before `first` included.
    """
    capacity = cells.shape[0]
    stack = np.empty(1024, np.int32)
    boundary_cells = np.empty(1024, np.int32)
    boundary_facets = np.empty(1024, np.int8)
    dead = np.empty(1024, np.int32)
    for k in range(first, order.shape[0]):
        q = order[k]
        hq = (
            points[q, 0] * points[q, 0]
            + points[q, 1] * points[q, 1]
            + points[q, 2] * points[q, 2]
            - weights[q] * weights[q]
        )
        t = _find_conflict(state[2], q, hq, n, points, weights, cells, neighbours, planes, bounds)
        if t < 0:
            state[3] += 1  # hidden: lies above the lower hull, and so has no cell
            continue

        # The cavity: all cells in conflict form one connected set, found by search from the first.
        stamp = np.int32(state[3] + 1)
        marks[t] = stamp
        stack[0] = t
        n_stack = 1
        n_boundary = 0
        n_dead = 0
        while n_stack > 0:
            n_stack -= 1
            c = stack[n_stack]
            if n_dead + 1 >= dead.shape[0]:
                dead = doubled(dead)
            dead[n_dead] = c
            n_dead += 1
            if n_stack + 4 >= stack.shape[0]:
                stack = doubled(stack)
            if n_boundary + 4 >= boundary_cells.shape[0]:
                boundary_cells = doubled(boundary_cells)
                boundary_facets = doubled(boundary_facets)
            for i in range(4):
                u = neighbours[c, i]
                inside = False
                if u >= 0:
                    if marks[u] == stamp:
                        continue
                    if marks[u] != -stamp:
                        f = (
                            hq
                            - planes[u, 3]
                            - (planes[u, 0] * points[q, 0] + planes[u, 1] * points[q, 1] + planes[u, 2] * points[q, 2])
                        )
                        if abs(f) > bounds[u]:
                            inside = f < 0.0
                        else:
                            inside = in_conflict(cells[u], q, n, points, weights)
                        marks[u] = stamp if inside else -stamp
                if inside:
                    stack[n_stack] = u
                    n_stack += 1
                else:
                    boundary_cells[n_boundary] = c
                    boundary_facets[n_boundary] = i
                    n_boundary += 1
        if n_boundary > state[0] + capacity - state[1]:
            for d in range(n_dead):  # undo the marks: this sphere is inserted again into larger arrays
                marks[dead[d]] = 0
            return k

        # One new cell on each facet of the boundary: the facet and q.
        for b in range(n_boundary):
            c = boundary_cells[b]
            i = boundary_facets[b]
            if state[0] > 0:
                state[0] -= 1
                new = np.int64(free[state[0]])
            else:
                new = state[1]
                state[1] += 1
            for j in range(4):
                cells[new, j] = cells[c, j]
                neighbours[new, j] = -2
            cells[new, i] = q
            marks[new] = 0
            ends[c, i] = new
            u = neighbours[c, i]
            neighbours[new, i] = u
            if u >= 0:
                for j in range(4):
                    if neighbours[u, j] == c:
                        neighbours[u, j] = new
            _place(new, q, n, points, weights, cells, planes, bounds, extent, magnitude)
            state[2] = new

        # New cells meet across facets through q: turn about the edge they share until the boundary is met again.
        for b in range(n_boundary):
            c = boundary_cells[b]
            i = boundary_facets[b]
            new = ends[c, i]
            for j in range(4):
                if j == i or neighbours[new, j] != -2:
                    continue
                current = c
                out = j
                pivot = int(i)
                while True:
                    u = neighbours[current, out]
                    if u < 0 or marks[u] != stamp:
                        break
                    v = cells[current, pivot]
                    for m in range(4):
                        if neighbours[u, m] == current:
                            pivot = m
                    for m in range(4):
                        if cells[u, m] == v:
                            out = m
                    current = u
                other = ends[current, out]
                neighbours[new, j] = other
                neighbours[other, pivot] = new
        for d in range(n_dead):
            cells[dead[d], 0] = -1
            free[state[0]] = dead[d]
            state[0] += 1
        state[3] += 1
    return order.shape[0]


@njit(cache=True)
def _find_conflict(t, q, hq, n, points, weights, cells, neighbours, planes, bounds):
    """A cell in conflict with q, or -1 if q is hidden.

    The cells' planes bound the lifted hull from below, f is the height of q above each, and the highest plane at q is
    that of the cell holding q: so descend on f until it is surely negative. Where rounding blurs the
    end of the descent, an exact visibility walk finds the cell that holds q; q is hidden if not in conflict there.
    """
    x = points[q, 0]
    y = points[q, 1]
    z = points[q, 2]
    f = hq - planes[t, 3] - (planes[t, 0] * x + planes[t, 1] * y + planes[t, 2] * z)
    while f >= -bounds[t]:
        best = t
        for i in range(4):
            u = neighbours[t, i]
            if u >= 0:
                fu = hq - planes[u, 3] - (planes[u, 0] * x + planes[u, 1] * y + planes[u, 2] * z)
                if fu < f:
                    f = fu
                    best = u
        if best == t:
            break
        t = best
    else:
        return t
    moved = True
    while moved:
        moved = False
        for i in range(4):
            u = neighbours[t, i]
            if u >= 0 and side(cells[t], i, q, n, points, weights) < 0:
                t = u
                moved = True
                break
    return t if in_conflict(cells[t], q, n, points, weights) else -1


@njit(cache=True)
def _place(t, q, n, points, weights, cells, planes, bounds, extent, magnitude):
    """Power centre of cell t, relative to its sphere q, with a bound on the error of f."""
    k0 = 0 if cells[t, 0] != q else 1
    k1 = k0 + 1 if cells[t, k0 + 1] != q else k0 + 2
    k2 = k1 + 1 if cells[t, k1 + 1] != q else k1 + 2
    a, ha, ta = row(cells[t, k0], q, n, points, weights)
    b, hb, tb = row(cells[t, k1], q, n, points, weights)
    c, hc, tc = row(cells[t, k2], q, n, points, weights)
    d, scale = determinant(a, b, c)
    # Cramer's rule: each minor and height carries a few ε of its permanent.
    room = abs(d) - 8.0 * EPSILON * scale
    error = np.inf
    size = 0.0
    x = y = z = 0.0
    if room > 0.0:
        x, px = _numerator(a[1], a[2], b[1], b[2], c[1], c[2], ha, hb, hc, ta, tb, tc)
        y, py = _numerator(a[2], a[0], b[2], b[0], c[2], c[0], ha, hb, hc, ta, tb, tc)
        z, pz = _numerator(a[0], a[1], b[0], b[1], c[0], c[1], ha, hb, hc, ta, tb, tc)
        half = 0.5 / d
        x *= half
        y *= half
        z *= half
        size = abs(x) * extent[0] + abs(y) * extent[1] + abs(z) * extent[2]
        error = (px * extent[0] + py * extent[1] + pz * extent[2] + size * scale) * 8.0 * EPSILON / room
    if not error <= _CENTRE_TOLERANCE * size:
        x, y, z = power_centre(cells[t], q, n, points, weights)
        error = 8.0 * EPSILON * (abs(x) * extent[0] + abs(y) * extent[1] + abs(z) * extent[2])
    cx = points[q, 0]
    cy = points[q, 1]
    cz = points[q, 2]
    x = 2.0 * (cx + x)
    y = 2.0 * (cy + y)
    z = 2.0 * (cz + z)
    planes[t, 0] = x
    planes[t, 1] = y
    planes[t, 2] = z
    planes[t, 3] = cx * cx + cy * cy + cz * cz - weights[q] * weights[q] - (x * cx + y * cy + z * cz)
    bounds[t] = 2.0 * error + 32.0 * EPSILON * magnitude


@njit(cache=True)
def _numerator(au, av, bu, bv, cu, cv, ha, hb, hc, ta, tb, tc):
    """One component of Σ H (a x b), and the permanent of its terms of magnitude T."""
    value = ha * (bu * cv - bv * cu) + hb * (cu * av - cv * au) + hc * (au * bv - av * bu)
    permanent = (
        ta * (abs(bu * cv) + abs(bv * cu)) + tb * (abs(cu * av) + abs(cv * au)) + tc * (abs(au * bv) + abs(av * bu))
    )
    return value, permanent
