"""The triangulation in blocks, side by side on several threads, with exactly the cells it would have in one piece.

Each block is triangulated with a halo of the spheres around it. A cell is one of the whole triangulation if no
sphere at all is in conflict with it, and a sphere that may be lies within R of its power centre P, R² = ρ² + r_max².
So where the balls of all cells at a block's own spheres lie within block and halo, the stars of these spheres are
those of the whole triangulation; where one does not, the halo is widened. Each cell is taken from the block that owns
its first sphere, and cells of different blocks are joined where they have a facet in common.
"""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from typing import NamedTuple

import numpy as np
from numba import get_num_threads

from porefv.packing.memory_estimate import ensure_room_for_cells
from porefv.system.kernels import njit
from porefv.tessellation import insertion
from porefv.tessellation.insertion import Cells, Scale, Workspace
from porefv.tessellation.ordering import rounds
from porefv.tessellation.vertices import Vertices

# Fewer spheres than this are not worth a block of their own: the halo would cost more than the thread gains.
LEAST_BLOCK = 8_000
_FOREIGN = -2


class FoundCells(NamedTuple):
    """Cells of a triangulation.

    Attributes
    ----------
    vertices, neighbours : (m, 4) int32 arrays
    planes : (m, 4) array
        As of `porefv.tessellation.insertion.Cells`.
    """

    vertices: np.ndarray
    neighbours: np.ndarray
    planes: np.ndarray


class Slab(NamedTuple):
    """The points x with low <= x[axis] < high."""

    axis: int
    low: float
    high: float


def triangulate(vertices: Vertices, extent: np.ndarray) -> FoundCells:
    """Cells of the regular triangulation, numbered along the numbering of their spheres.

    Parameters
    ----------
    vertices : Vertices
        Spheres numbered along a space-filling curve.
    extent : (3,) array
        Size of the box.
    """
    n, points, radii = vertices
    n_blocks = max(1, min(get_num_threads(), n // LEAST_BLOCK))
    if n_blocks == 1:
        return _compact(_build(vertices, extent), n, np.ones(n, np.bool_))

    axis = int(np.argmax(extent))
    x = points[:n, axis]
    cuts = np.partition(x, [n * k // n_blocks for k in range(1, n_blocks)])
    edges = [-np.inf, *(cuts[n * k // n_blocks] for k in range(1, n_blocks)), np.inf]
    reach = 1.5 * float(np.prod(extent) / n) ** (1.0 / 3.0) + 1.5 * float(radii[:n].max())
    with ThreadPoolExecutor(n_blocks) as pool:
        blocks = list(
            pool.map(lambda k: _block(Slab(axis, edges[k], edges[k + 1]), reach, vertices, extent), range(n_blocks))
        )
    return _join(blocks)


def _build(vertices: Vertices, extent: np.ndarray) -> FoundCells:
    """Triangulate spheres numbered along a curve; arrays still hold free cells."""
    n, points, radii = vertices
    shuffled = np.random.default_rng(0).permutation(n)
    order = np.concatenate([np.sort(shuffled[part]) for part in rounds(n)])
    capacity = 8 * n + 64
    cells = Cells(
        vertices=np.empty((capacity, 4), np.int32),
        neighbours=np.empty((capacity, 4), np.int32),
        planes=np.empty((capacity, 4)),
        bounds=np.empty(capacity),
    )
    work = Workspace(
        marks=np.zeros(capacity, np.int32),
        ends=np.empty((capacity, 4), np.int32),
        free=np.empty(capacity, np.int32),
        counts=np.zeros(4, np.int64),
    )
    magnitude = float(np.sum(np.abs(points[:n]).max(axis=0) ** 2) + radii[:n].max() ** 2)
    scale = Scale(extent, magnitude + float(np.abs(radii[n:]).max()) ** 2)
    insertion.start(order[0], vertices, cells, work, scale)
    done = 1
    while True:
        done = insertion.insert(order, done, vertices, cells, work, scale)
        if done == n:
            break
        ensure_room_for_cells(len(cells.vertices))
        cells = Cells(*(_with_as_many_zeros(array) for array in cells))
        marks, ends, free, counts = work
        work = Workspace(_with_as_many_zeros(marks), _with_as_many_zeros(ends), _with_as_many_zeros(free), counts)
    used = insertion.cells_used(work)
    return FoundCells(cells.vertices[:used], cells.neighbours[:used], cells.planes[:used])


def _with_as_many_zeros(array: np.ndarray) -> np.ndarray:
    return np.concatenate([array, np.zeros_like(array)])


def _block(slab: Slab, reach: float, vertices: Vertices, extent: np.ndarray) -> FoundCells:
    """The cells of the whole triangulation whose first sphere is in a slab, at first with a halo as wide as `reach`."""
    n, points, radii = vertices
    axis, low, high = slab
    x = points[:n, axis]
    largest = float(radii[:n].max())
    while True:
        spheres = np.flatnonzero((x >= low - reach) & (x < high + reach))
        own = (x[spheres] >= low) & (x[spheres] < high)
        names = np.concatenate([spheres, np.arange(n, n + 6)]).astype(np.int32)
        within = Vertices(len(spheres), points[names], radii[names])
        cells = _build(within, extent)
        if len(spheres) == n or cells_are_certain(cells, own, within, largest, Slab(axis, low - reach, high + reach)):
            cells = _compact(cells, len(spheres), own)
            return FoundCells(names[cells.vertices], cells.neighbours, cells.planes)
        reach *= 2.0


def _join(blocks: list[FoundCells]) -> FoundCells:
    """One triangulation from those of the blocks."""
    offsets = np.cumsum([0] + [len(block.vertices) for block in blocks])
    cells = np.concatenate([block.vertices for block in blocks])
    neighbours = np.concatenate(
        [
            np.where(block.neighbours >= 0, block.neighbours + offset, block.neighbours)
            for block, offset in zip(blocks, offsets, strict=False)
        ]
    ).astype(np.int32)
    planes = np.concatenate([block.planes for block in blocks])
    # Facets towards another block's cells occur twice, once from each side.
    cell, place = np.nonzero(neighbours == _FOREIGN)
    others = np.array([[1, 2, 3], [0, 2, 3], [0, 1, 3], [0, 1, 2]])[place]
    facets = np.sort(cells[cell[:, None], others], axis=1)
    pairs = np.lexsort(facets.T).reshape(-1, 2)
    a, b = pairs.T
    assert np.array_equal(facets[a], facets[b])
    neighbours[cell[a], place[a]] = cell[b]
    neighbours[cell[b], place[b]] = cell[a]
    return FoundCells(cells, neighbours, planes)


@njit(cache=True, nogil=True)
def cells_are_certain(found, own, vertices, largest, slab):
    """Whether every cell at a block's own spheres keeps clear of all spheres outside a slab.

    Parameters
    ----------
    found : FoundCells
        Of the block and its halo.
    own : (n,) bool array
        Spheres of the block itself.
    vertices : Vertices
        Of the block and its halo.
    largest : float
        The largest radius of all spheres.
    slab : Slab
        What block and halo hold all spheres of.
    """
    n, points, weights = vertices
    axis, low, high = slab
    cells, _, planes = found
    for t in range(cells.shape[0]):
        if cells[t, 0] < 0:
            continue
        owned = False
        k = -1
        for i in range(4):
            if cells[t, i] < n:
                k = cells[t, i]
                owned = owned or own[k]
        if not owned:
            continue
        square = largest * largest - weights[k] * weights[k]
        for j in range(3):
            square += (points[k, j] - 0.5 * planes[t, j]) ** 2
        radius = 1.000001 * np.sqrt(max(square, 0.0))
        p = 0.5 * planes[t, axis]
        if p - radius < low or p + radius >= high:
            return False
    return True


@njit(cache=True, nogil=True)
def _compact(found, n, own):
    """The cells whose first sphere is one of a block's own, numbered along the numbering of their first spheres."""
    cells, neighbours, planes = found
    m = cells.shape[0]
    start = np.zeros(n + 1, np.int64)
    key = np.full(m, -1, np.int64)
    for t in range(m):
        if cells[t, 0] < 0:
            continue
        least = n
        for i in range(4):
            if cells[t, i] < least:
                least = cells[t, i]
        if own[least]:
            key[t] = least
            start[least + 1] += 1
    for k in range(n):
        start[k + 1] += start[k]
    count = start[n]
    number = np.full(m, _FOREIGN, np.int32)
    for t in range(m):
        if key[t] >= 0:
            number[t] = start[key[t]]
            start[key[t]] += 1
    new_cells = np.empty((count, 4), np.int32)
    new_neighbours = np.empty((count, 4), np.int32)
    new_planes = np.empty((count, 4))
    for t in range(m):
        c = number[t]
        if c < 0:
            continue
        for i in range(4):
            u = neighbours[t, i]
            new_cells[c, i] = cells[t, i]
            new_neighbours[c, i] = number[u] if u >= 0 else -1
            new_planes[c, i] = planes[t, i]
    return FoundCells(new_cells, new_neighbours, new_planes)
