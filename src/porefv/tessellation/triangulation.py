"""RegularTriangulation: the weighted Delaunay triangulation of spheres in a box, exact in every tie."""

from __future__ import annotations

from functools import cached_property

import numpy as np
from numba import njit

from porefv.errors import ComputationError
from porefv.packing import Box
from porefv.tessellation import insertion
from porefv.tessellation.ordering import morton_codes, rounds


class RegularTriangulation:
    """Regular triangulation of weighted points in a box whose six walls are ideal vertices.

    A wall is the limit of a sphere of infinite radius: an outward direction and an offset. Cells are
    quadruples of vertices, spheres or walls, whose common power centre is closer, in power, to no other vertex
    (C12 §2.1). All decisions are exact: ties (lattices) are broken by a symbolic perturbation
    of the radii in lexicographic order of the centres, so that cells are never flat, and the result does not depend
    on the order of the input.

    Parameters
    ----------
    centres : (n, 3) array
        Sphere centres, strictly inside the box, no two equal [m].
    radii : (n,) array
        Sphere radii [m].
    box : Box
        The box.

    Attributes
    ----------
    cells : (m, 4) int32 array
        Vertices of each cell, positively oriented: ids of spheres (< n), or n + w for wall w in the order
        x_min, x_max, y_min, y_max, z_min, z_max.
    neighbours : (m, 4) int32 array
        Cell across the facet opposite to each vertex; -1 across the facet of three walls.
    local_vertices : (m, 3) array
        Laguerre vertices (power centres) in the local frame [m].
    origin : (3,) array
        Origin of the local frame, x_local = x - origin, chosen such that the difference is exact [m].
    """

    def __init__(self, centres: np.ndarray, radii: np.ndarray, box: Box):
        n = len(radii)
        self.n_spheres = n
        self.box = box
        self.origin = exact_origin(box)
        scale = 2.0 ** -np.ceil(np.log2(box.size.max()))  # a power of two: scaling is exact
        points = np.empty((n + 6, 3))
        weights = np.empty(n + 6)
        np.multiply(centres - self.origin, scale, out=points[:n])
        np.multiply(radii, scale, out=weights[:n])
        points[n:] = wall_normals()
        weights[n + 0 :: 2] = -(box.lower - self.origin) * scale
        weights[n + 1 :: 2] = (box.upper - self.origin) * scale
        # Products of five coordinates must not underflow for the predicates to be exact.
        smallest = np.abs(points[:n][points[:n] != 0.0]).min(initial=1.0)
        if min(smallest, weights[:n].min()) < 2.0**-140:
            raise ComputationError(
                "coordinates or radii smaller than 1e-42 of the box cannot be triangulated exactly; "
                "move the spheres to 0 or away from it"
            )

        # Inside, spheres are numbered along a space-filling curve: near in space, near in memory.
        curve = np.argsort(morton_codes(points, n), kind="stable")
        points[:n] = points[curve]
        weights[:n] = weights[curve]
        shuffled = np.random.default_rng(0).permutation(n)
        order = np.concatenate([np.sort(shuffled[part]) for part in rounds(n)])
        cells, neighbours, planes = _build(order, n, points, weights, box.size * scale)
        names = np.concatenate([curve, np.arange(n, n + 6)]).astype(np.int32)
        self.cells, self.neighbours, self.local_vertices = _compact(
            cells, neighbours, planes, n, 0.5 / scale, weights, 1.0 / scale, names
        )

    @cached_property
    def vertices(self) -> np.ndarray:
        """(m, 3) Laguerre vertices: the power centre of each cell [m]."""
        return self.local_vertices + self.origin

    @cached_property
    def hidden(self) -> np.ndarray:
        """Ids of the spheres without a cell: each lies within the union of others."""
        present = np.zeros(self.n_spheres + 6, bool)
        present[self.cells.ravel()] = True
        return np.flatnonzero(~present[: self.n_spheres])

    def __repr__(self) -> str:
        hidden = f", {len(self.hidden)} hidden" if len(self.hidden) else ""
        return f"RegularTriangulation({self.n_spheres} spheres{hidden}, {len(self.cells)} cells)"


def wall_normals() -> np.ndarray:
    """(6, 3) outward unit normals of the walls, in the order x_min, x_max, y_min, ..."""
    normals = np.zeros((6, 3))
    for wall in range(6):
        normals[wall, wall // 2] = 1.0 if wall % 2 else -1.0
    return normals


def exact_origin(box: Box) -> np.ndarray:
    """A point near the box from which coordinates inside the box are measured without rounding.

    Multiples of the power of two above the box's size, at or between the box and zero: numbers beyond it
    then have no finer bits than the difference can hold.
    """
    grid = 2.0 ** np.ceil(np.log2(box.size))
    origin = np.where(box.lower > 0.0, np.floor(box.lower / grid), 0.0)
    return np.where(box.upper < 0.0, np.ceil(box.upper / grid), origin) * grid


def _build(order, n, points, weights, extent):
    capacity = 8 * n + 64
    cells = np.empty((capacity, 4), np.int32)
    neighbours = np.empty((capacity, 4), np.int32)
    planes = np.empty((capacity, 4))
    bounds = np.empty(capacity)
    marks = np.zeros(capacity, np.int32)
    ends = np.empty((capacity, 4), np.int32)
    free = np.empty(capacity, np.int32)
    state = np.zeros(4, np.int64)
    magnitude = float(np.sum(np.abs(points[:n]).max(axis=0) ** 2) + weights[:n].max() ** 2)
    magnitude += float(np.abs(weights[n:]).max()) ** 2
    insertion.start(order[0], n, points, weights, cells, neighbours, planes, bounds, free, state, extent, magnitude)
    done = 1
    while True:
        done = insertion.insert(
            order, done, n, points, weights, cells, neighbours, planes, bounds, marks, ends, free, state,
            extent, magnitude,
        )  # fmt: skip
        if done == n:
            break
        cells, neighbours, planes, bounds, marks, ends, free = (
            np.concatenate([a, np.zeros_like(a)]) for a in (cells, neighbours, planes, bounds, marks, ends, free)
        )
    used = state[1]
    return cells[:used], neighbours[:used], planes[:used]


@njit(cache=True)
def _compact(cells, neighbours, planes, n, half, weights, length, names):
    """Drop free cells, number the rest along the curve of their first sphere, and give the spheres their own ids."""
    m = cells.shape[0]
    start = np.zeros(n + 1, np.int64)
    key = np.full(m, -1, np.int64)
    for t in range(m):
        if cells[t, 0] < 0:
            continue
        least = n
        for i in range(4):
            if cells[t, i] < n:
                least = min(least, cells[t, i])
        key[t] = least
        start[least + 1] += 1
    for k in range(n):
        start[k + 1] += start[k]
    count = start[n]
    number = np.full(m, -1, np.int32)
    for t in range(m):
        if key[t] >= 0:
            number[t] = start[key[t]]
            start[key[t]] += 1
    new_cells = np.empty((count, 4), np.int32)
    new_neighbours = np.empty((count, 4), np.int32)
    vertices = np.empty((count, 3))
    for t in range(m):
        if key[t] < 0:
            continue
        c = number[t]
        for i in range(4):
            new_cells[c, i] = names[cells[t, i]]
            u = neighbours[t, i]
            new_neighbours[c, i] = number[u] if u >= 0 else -1
        for axis in range(3):
            vertices[c, axis] = planes[t, axis] * half
        for i in range(4):
            wall = cells[t, i] - n
            if wall >= 0:  # the Laguerre vertex lies on the wall exactly
                axis = wall // 2
                offset = weights[n + wall] * length
                vertices[c, axis] = offset if wall % 2 else -offset
    return new_cells, new_neighbours, vertices
