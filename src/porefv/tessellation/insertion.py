"""Incremental construction of the regular triangulation (Bowyer 1981, Watson 1981), one sphere after another."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from porefv.system.kernels import helper, kernel
from porefv.tessellation.predicates import EPSILON, determinant, in_conflict, minors, power_centre, row, side

# Relative error of a power centre beyond which it is computed again in exact arithmetic.
_CENTRE_TOLERANCE = 2.0**-30
# Places in `Workspace.counts`.
_FREE, _UNUSED, _LAST, _INSERTED = 0, 1, 2, 3


class Cells(NamedTuple):
    """Cells of a triangulation, and room for more of them, m in all.

    Attributes
    ----------
    vertices : (m, 4) int32 array
        Vertices, positively oriented: spheres < n, walls n ... n + 5. The first is -1 in a cell that is free.
    neighbours : (m, 4) int32 array
        Cell across the facet opposite to each vertex; -1 beyond a corner of the box.
    planes : (m, 4) array
        (2 P, β): f(q) = |c_q|² - r_q² - β - 2 P·c_q is the power of q to P less ρ² (six operations).
    bounds : (m,) array
        Bound on the rounding error of f for any q in the box.
    """

    vertices: np.ndarray
    neighbours: np.ndarray
    planes: np.ndarray
    bounds: np.ndarray


class Workspace(NamedTuple):
    """What insertion keeps besides the m cells.

    Attributes
    ----------
    marks : (m,) int32 array
        s or -s: the cell is in conflict, or not in conflict, with the s-th inserted sphere.
    ends : (m, 4) int32 array
        New cell on each facet of the cavity's boundary.
    free : (m,) int32 array
        Stack of free cells.
    counts : (4,) int64 array
        How many cells are in the stack, first cell that was never used, last new cell, how many spheres are inserted.
    found, cavity : (m,) int32 arrays
        Cells in conflict with a sphere: those whose neighbours are still to be looked at, and all of them.
    boundary : (2 m + 2,) int32, facets : (2 m + 2,) int8 arrays
        Facets of the cavity's boundary: their cells, and the places in these. Cells that are joined to each other have
        no more facets than that.
    """

    marks: np.ndarray
    ends: np.ndarray
    free: np.ndarray
    counts: np.ndarray
    found: np.ndarray
    cavity: np.ndarray
    boundary: np.ndarray
    facets: np.ndarray


class Scale(NamedTuple):
    """Sizes from which rounding errors are bounded.

    Attributes
    ----------
    extent : (3,) array
        Size of the box.
    magnitude : float
        Sum of the largest |c|² and r² of the spheres and the largest s² of the walls.
    """

    extent: np.ndarray
    magnitude: float


def cells_used(work: Workspace) -> int:
    """How many cells have been in use, free ones among them."""
    return int(work.counts[_UNUSED])


@kernel
def start(q, vertices, triangulation, work, scale):
    """The first sphere: eight cells, each of the sphere and the three walls at one corner of the box.

    Parameters
    ----------
    q : int
        The sphere.
    vertices : Vertices
    triangulation : Cells
    work : Workspace
    scale : Scale
    """
    n = vertices.n_spheres
    cells, neighbours, _, _ = triangulation
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
        _place(corner, q, vertices, triangulation, scale)
    work.counts[_FREE] = 0
    work.counts[_UNUSED] = 8
    work.counts[_LAST] = 0
    work.counts[_INSERTED] = 1


@kernel(allocates=False)
def insert(order, first, vertices, triangulation, work, scale):
    """Insert the spheres order[first:] into `Cells`; returns how many were done (fewer where the arrays are full).

    Parameters
    ----------
    order : (n,) int array
        Spheres in the order of their insertion.
    first : int
        Place in `order` at which to go on.
    vertices : Vertices
    triangulation : Cells
    work : Workspace
    scale : Scale
    """
    _, points, weights = vertices
    cells, neighbours, planes, bounds = triangulation
    marks, ends, free, counts, stack, dead, boundary_cells, boundary_facets = work
    capacity = cells.shape[0]
    for k in range(first, order.shape[0]):
        q = order[k]
        hq = (
            points[q, 0] * points[q, 0]
            + points[q, 1] * points[q, 1]
            + points[q, 2] * points[q, 2]
            - weights[q] * weights[q]
        )
        t = _find_conflict(counts[_LAST], q, hq, vertices, triangulation)
        if t < 0:
            counts[_INSERTED] += 1  # hidden: lies above the lower hull, and so has no cell
            continue

        # The cavity: all cells in conflict form one connected set, found by search from the first.
        stamp = np.int32(counts[_INSERTED] + 1)
        marks[t] = stamp
        stack[0] = t
        n_stack = 1
        n_boundary = 0
        n_dead = 0
        while n_stack > 0:
            n_stack -= 1
            c = stack[n_stack]
            dead[n_dead] = c
            n_dead += 1
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
                            inside = in_conflict(cells[u], q, vertices)
                        marks[u] = stamp if inside else -stamp
                if inside:
                    stack[n_stack] = u
                    n_stack += 1
                else:
                    boundary_cells[n_boundary] = c
                    boundary_facets[n_boundary] = i
                    n_boundary += 1
        if n_boundary > counts[_FREE] + capacity - counts[_UNUSED]:
            for d in range(n_dead):  # undo the marks: this sphere is inserted again into larger arrays
                marks[dead[d]] = 0
            return k

        # One new cell on each facet of the boundary: the facet and q.
        for b in range(n_boundary):
            c = boundary_cells[b]
            i = boundary_facets[b]
            if counts[_FREE] > 0:
                counts[_FREE] -= 1
                new = np.int64(free[counts[_FREE]])
            else:
                new = counts[_UNUSED]
                counts[_UNUSED] += 1
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
            _place(new, q, vertices, triangulation, scale)
            counts[_LAST] = new

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
            free[counts[_FREE]] = dead[d]
            counts[_FREE] += 1
        counts[_INSERTED] += 1
    return order.shape[0]


@helper(inline="always")
def _find_conflict(t, q, hq, vertices, triangulation):
    """A cell in conflict with q, or -1 if q is hidden.

    The cells' planes bound the lifted hull from below, f is the height of q above each, and the highest plane at q is
    that of the cell holding q: so descend on f until it is surely negative. Where rounding blurs the
    end of the descent, an exact visibility walk finds the cell that holds q; q is hidden if not in conflict there.
    """
    cells, neighbours, planes, bounds = triangulation
    x = vertices.points[q, 0]
    y = vertices.points[q, 1]
    z = vertices.points[q, 2]
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
            if u >= 0 and side(cells[t], i, q, vertices) < 0:
                t = u
                moved = True
                break
    return t if in_conflict(cells[t], q, vertices) else -1


@helper(inline="always")
def _place(t, q, vertices, triangulation, scale):
    """Power centre of cell t, relative to its sphere q, with a bound on the error of f."""
    _, points, weights = vertices
    cells, _, planes, bounds = triangulation
    extent = scale.extent
    k0 = 0 if cells[t, 0] != q else 1
    k1 = k0 + 1 if cells[t, k0 + 1] != q else k0 + 2
    k2 = k1 + 1 if cells[t, k1 + 1] != q else k1 + 2
    a, ha, ta = row(cells[t, k0], q, vertices)
    b, hb, tb = row(cells[t, k1], q, vertices)
    c, hc, tc = row(cells[t, k2], q, vertices)
    d, permanent = determinant(a, b, c)
    # Cramer's rule: each minor and height has an error of a few ε of its permanent.
    room = abs(d) - 8.0 * EPSILON * permanent
    error = np.inf
    size = 0.0
    x = y = z = 0.0
    if room > 0.0:
        (x, y, z), (px, py, pz) = _numerators((a, b, c), (ha, hb, hc), (ta, tb, tc))
        half = 0.5 / d
        x *= half
        y *= half
        z *= half
        size = abs(x) * extent[0] + abs(y) * extent[1] + abs(z) * extent[2]
        error = (px * extent[0] + py * extent[1] + pz * extent[2] + size * permanent) * 8.0 * EPSILON / room
    if not error <= _CENTRE_TOLERANCE * size:
        x, y, z = power_centre(cells[t], q, vertices)
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
    bounds[t] = 2.0 * error + 32.0 * EPSILON * scale.magnitude


@kernel
def place_again(first, last, vertices, triangulation, scale):
    """Power centres of cells first ... last - 1, each relative to its first vertex, a sphere.

    Parameters
    ----------
    first, last : int
        Cells to treat: first ... last - 1.
    vertices : Vertices
    triangulation : Cells
    scale : Scale
    """
    for t in range(first, last):
        _place(t, triangulation.vertices[t, 0], vertices, triangulation, scale)


@helper
def _numerators(rows, heights, magnitudes):
    """The vector Σ H (a × b) of three rows, and its permanents, with terms of magnitude T for H."""
    a, b, c = rows
    ha, hb, hc = heights
    ta, tb, tc = magnitudes
    bc, abs_bc = minors(b, c)
    ca, abs_ca = minors(c, a)
    ab, abs_ab = minors(a, b)
    return (
        (
            ha * bc[0] + hb * ca[0] + hc * ab[0],
            ha * bc[1] + hb * ca[1] + hc * ab[1],
            ha * bc[2] + hb * ca[2] + hc * ab[2],
        ),
        (
            ta * abs_bc[0] + tb * abs_ca[0] + tc * abs_ab[0],
            ta * abs_bc[1] + tb * abs_ca[1] + tc * abs_ab[1],
            ta * abs_bc[2] + tb * abs_ca[2] + tc * abs_ab[2],
        ),
    )
