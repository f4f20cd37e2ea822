"""The triangulation in blocks, side by side on several threads, with exactly the cells it would have in one piece.

Each block is triangulated with a halo of the spheres around it. A cell is one of the whole triangulation if no
sphere at all is in conflict with it, and a sphere that may be lies within R of its power centre P, R² = ρ² + r_max².
So where the balls of all cells at a block's own spheres lie within block and halo, the stars of these spheres are
those of the whole triangulation; where one does not, the halo is widened. Each cell is taken from the block that owns
its first sphere, and cells of different blocks are joined where they have a facet in common.
"""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor

import numpy as np
from numba import get_num_threads

from porefv.packing.memory_estimate import ensure_room_for_cells
from porefv.system.kernels import njit
from porefv.tessellation import insertion
from porefv.tessellation.ordering import rounds

# Fewer spheres than this are not worth a block of their own: the halo would cost more than the thread gains.
LEAST_BLOCK = 8_000
_FOREIGN = -2


def triangulate(points: np.ndarray, weights: np.ndarray, n: int, extent: np.ndarray):
    """Cells of the regular triangulation, numbered along the numbering of their spheres.

    Parameters
    ----------
    points, weights, n
        See `porefv.tessellation.predicates`; spheres numbered along a space-filling curve.
    extent : (3,) array
        Size of the box.

    Returns
    -------
    cells (m, 4), neighbours (m, 4), planes (m, 4)
    """
    n_blocks = max(1, min(get_num_threads(), n // LEAST_BLOCK))
    if n_blocks == 1:
        cells, neighbours, planes = _build(n, points, weights, extent)
        return _compact(cells, neighbours, planes, n, np.ones(n, np.bool_))

    axis = int(np.argmax(extent))
    x = points[:n, axis]
    cuts = np.partition(x, [n * k // n_blocks for k in range(1, n_blocks)])
    edges = [-np.inf, *(cuts[n * k // n_blocks] for k in range(1, n_blocks)), np.inf]
    reach = 1.5 * float(np.prod(extent) / n) ** (1.0 / 3.0) + 1.5 * float(weights[:n].max())
    with ThreadPoolExecutor(n_blocks) as pool:
        blocks = list(
            pool.map(lambda k: _block(edges[k], edges[k + 1], reach, axis, n, points, weights, extent), range(n_blocks))
        )
    return _join(blocks)


def _build(n, points, weights, extent):
    """Triangulate spheres numbered along a curve; arrays still hold free cells."""
    shuffled = np.random.default_rng(0).permutation(n)
    order = np.concatenate([np.sort(shuffled[part]) for part in rounds(n)])
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
        ensure_room_for_cells(len(cells))
        cells, neighbours, planes, bounds, marks, ends, free = (
            np.concatenate([a, np.zeros_like(a)]) for a in (cells, neighbours, planes, bounds, marks, ends, free)
        )
    used = state[1]
    return cells[:used], neighbours[:used], planes[:used]


def _block(low, high, reach, axis, n, points, weights, extent):
    """The cells of the whole triangulation whose first sphere has low <= x < high."""
    x = points[:n, axis]
    while True:
        spheres = np.flatnonzero((x >= low - reach) & (x < high + reach))
        own = (x[spheres] >= low) & (x[spheres] < high)
        names = np.concatenate([spheres, np.arange(n, n + 6)]).astype(np.int32)
        k = len(spheres)
        cells, neighbours, planes = _build(k, points[names], weights[names], extent)
        largest = float(weights[:n].max())
        if k == n or cells_are_certain(
            cells, planes, own, k, points[names], weights[names], largest, axis, low - reach, high + reach
        ):
            cells, neighbours, planes = _compact(cells, neighbours, planes, k, own)
            return names[cells], neighbours, planes
        reach *= 2.0


def _join(blocks):
    """One triangulation from those of the blocks."""
    offsets = np.cumsum([0] + [len(cells) for cells, _, _ in blocks])
    cells = np.concatenate([block[0] for block in blocks])
    neighbours = np.concatenate(
        [np.where(block[1] >= 0, block[1] + offset, block[1]) for block, offset in zip(blocks, offsets, strict=False)]
    ).astype(np.int32)
    planes = np.concatenate([block[2] for block in blocks])
    # Facets towards another block's cells occur twice, once from each side.
    cell, place = np.nonzero(neighbours == _FOREIGN)
    others = np.array([[1, 2, 3], [0, 2, 3], [0, 1, 3], [0, 1, 2]])[place]
    facets = np.sort(cells[cell[:, None], others], axis=1)
    pairs = np.lexsort(facets.T).reshape(-1, 2)
    a, b = pairs.T
    assert np.array_equal(facets[a], facets[b])
    neighbours[cell[a], place[a]] = cell[b]
    neighbours[cell[b], place[b]] = cell[a]
    return cells, neighbours, planes


@njit(cache=True, nogil=True)
def cells_are_certain(cells, planes, own, n, points, weights, largest, axis, low, high):
    """Whether every cell at a block's own spheres keeps clear of all spheres outside low <= x < high.

    Parameters
    ----------
    cells, planes : (m, 4) int32 array, (m, 4) float64 array
        Of the block with its halo: see `porefv.tessellation.insertion`. Free cells are passed over.
    own : (n,) bool array
        Spheres of the block itself.
    n : int
        Number of spheres of block and halo.
    points, weights : (n + 6, 3), (n + 6,) float64 arrays
        See `porefv.tessellation.predicates`.
    largest : float
        Largest radius of all spheres of the packing, in the unit of `points`.
    axis : int
        Axis of x, across which the box is cut into blocks: 0, 1 or 2.
    low, high : float
        Bounds of block and halo on the axis, in the unit of `points`.
    """
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
def _compact(cells, neighbours, planes, n, own):
    """The cells whose first sphere is the block's own, numbered along the numbering of their first spheres."""
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
    return new_cells, new_neighbours, new_planes
