"""Flat cells, which rounding leaves where spheres tie: their Laguerre vertices, settled at a neighbour's."""

from __future__ import annotations

import numpy as np

from porefv.system.kernels import helper, kernel

# A cell whose edges enclose less than this part of the volume of their lengths is flat but for rounding.
_FLAT = 1e-9


@kernel
def settle_flat_cells(cells, neighbours, vertices, laguerre_vertices):
    """Give each flat cell the Laguerre vertex of a neighbour, in place in `laguerre_vertices` (m, 3).

    A square of spheres that rounding has bent is two pairs of triangles with a flat cell between them. Its vertex may
    lie anywhere on the line through the square's middle, by rounding alone; with a neighbour's, which lies there too,
    the passage through the square is whole, as it is in the exact square.

    Parameters
    ----------
    cells, neighbours : (m, 4) int32 arrays
        Vertices of each cell, and the cell across the facet opposite to each of them, -1 where there is none.
    vertices : Vertices
    laguerre_vertices : (m, 3) float64 array
        Changed in place [m].
    """
    flat = np.zeros(cells.shape[0], np.bool_)
    count = 0
    for t in range(cells.shape[0]):
        flat[t] = _is_flat(cells[t], vertices)
        count += flat[t]
    while count > 0:
        settled = 0
        for t in range(cells.shape[0]):
            if not flat[t]:
                continue
            best = -1
            least = np.inf
            for i in range(4):
                u = neighbours[t, i]
                if u < 0 or flat[u]:
                    continue
                square = 0.0
                for axis in range(3):
                    square += (laguerre_vertices[u, axis] - laguerre_vertices[t, axis]) ** 2
                if square < least:
                    least = square
                    best = u
            if best >= 0:
                for axis in range(3):
                    laguerre_vertices[t, axis] = laguerre_vertices[best, axis]
                flat[t] = False
                settled += 1
        if settled == 0:
            return
        count -= settled


@kernel
def flat_cells(cells, vertices, flat):
    """Fill in which cells, (m, 4), are flat, (m,) bool: as `settle_flat_cells` takes them."""
    for t in range(cells.shape[0]):
        flat[t] = _is_flat(cells[t], vertices)


@helper
def _is_flat(cell, vertices):
    """Whether the directions from a sphere of the cell to its other vertices lie in a plane, but for rounding."""
    n, points, _ = vertices
    rows = np.empty((3, 3))
    first = -1
    for i in range(4):
        if cell[i] < n:
            first = i
            break
    m = 0
    size = 1.0
    for i in range(4):
        if i == first:
            continue
        square = 0.0
        for axis in range(3):
            rows[m, axis] = points[cell[i], axis]
            if cell[i] < n:
                rows[m, axis] -= points[cell[first], axis]
            square += rows[m, axis] ** 2
        size *= np.sqrt(square)
        m += 1
    value = (
        rows[0, 0] * (rows[1, 1] * rows[2, 2] - rows[1, 2] * rows[2, 1])
        + rows[0, 1] * (rows[1, 2] * rows[2, 0] - rows[1, 0] * rows[2, 2])
        + rows[0, 2] * (rows[1, 0] * rows[2, 1] - rows[1, 1] * rows[2, 0])
    )
    return abs(value) <= _FLAT * size
