"""The triangulation in blocks, side by side on several threads, with exactly the cells it would have in one piece.

Each block is triangulated with a halo of the spheres around it. A cell is one of the whole triangulation if no
sphere at all is in conflict with it, and a sphere that may be lies within R of its power centre P, R² = ρ² + r_max².
So where the balls of all cells at a block's own spheres lie within block and halo, the stars of these spheres are
those of the whole triangulation; where one does not, the halo is widened. Each cell is taken from the block that owns
its first sphere, and cells of different blocks are joined where they have a facet in common.
"""

from __future__ import annotations

from itertools import pairwise
from typing import NamedTuple

import numpy as np

from porefv.packing.memory_estimate import ensure_room_for_cells
from porefv.system.kernels import helper, kernel
from porefv.system.threads import for_each, for_rows, thread_count
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
    n_blocks = max(1, min(thread_count(), n // LEAST_BLOCK))
    if n_blocks == 1:
        return _compact(_build(vertices, extent), np.ones(n, np.bool_), vertices, extent, sort=n >= 2 * LEAST_BLOCK)

    axis = int(np.argmax(extent))
    x = points[:n, axis]
    cuts = np.partition(x, [n * k // n_blocks for k in range(1, n_blocks)])
    edges = [-np.inf, *(cuts[n * k // n_blocks] for k in range(1, n_blocks)), np.inf]
    reach = 1.5 * float(np.prod(extent) / n) ** (1.0 / 3.0) + 1.5 * float(radii[:n].max())
    slabs = [Slab(axis, low, high) for low, high in pairwise(edges)]
    return _join(for_each(lambda slab: _block(slab, reach, vertices, extent), slabs))


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
        **_room_for_cavity(capacity),
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
        work = work._replace(
            marks=_with_as_many_zeros(work.marks),
            ends=_with_as_many_zeros(work.ends),
            free=_with_as_many_zeros(work.free),
            **_room_for_cavity(len(cells.vertices)),
        )
    used = insertion.cells_used(work)
    return FoundCells(cells.vertices[:used], cells.neighbours[:used], cells.planes[:used])


def _room_for_cavity(capacity: int) -> dict[str, np.ndarray]:
    """Arrays of `Workspace` for the largest cavity there may be; what is not used is never touched."""
    return {
        "found": np.empty(capacity, np.int32),
        "cavity": np.empty(capacity, np.int32),
        "boundary": np.empty(2 * capacity + 2, np.int32),
        "facets": np.empty(2 * capacity + 2, np.int8),
    }


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
            cells = _compact(cells, own, within, extent, sort=True)
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
    # In the order of their first spheres, as in one piece.
    order = np.argsort(cells[:, 0], kind="stable")
    number = np.empty(len(order) + 1, np.int32)
    number[order], number[-1] = np.arange(len(order)), -1
    return FoundCells(cells[order], number[neighbours[order]], planes[order])


@kernel
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


def _compact(found: FoundCells, own: np.ndarray, vertices: Vertices, extent: np.ndarray, sort: bool) -> FoundCells:
    """The cells whose first sphere is one of a block's own, numbered along the numbering of their first spheres.

    With `sort` their order does not depend on how they were found: cells of the same first sphere are sorted by their
    vertices, and so are the vertices of each cell, but for the last two where its orientation asks for it. Power
    centres are worked out anew from that order: their rounding depends on it.
    """
    m = len(found.vertices)
    ends, firsts = np.zeros(vertices.n_spheres + 1, np.int64), np.empty(m, np.int32)
    count = _count_own(found.vertices, own, ends, firsts)
    cells = Cells(np.empty((count, 4), np.int32), np.empty((count, 4), np.int32), np.empty((count, 4)), np.empty(count))
    _group_cells(found, ends, firsts, np.full(m, _FOREIGN, np.int32), cells, sort)
    if sort:
        for_rows(insertion.place_again, count, vertices, cells, Scale(extent, 0.0))
    return FoundCells(*cells[:3])


@kernel
def _count_own(cells, own, ends, firsts):
    """How many cells have their first sphere, the least, among `own`.

    Parameters
    ----------
    cells : (m, 4) int32 array
    own : (n,) bool array
    ends : (n + 1,) int64 array
        Zero; to be filled with the number of cells whose first sphere is below each sphere.
    firsts : (m,) int32 array
        To be filled with the first sphere of each cell, -1 for others.
    """
    n = own.shape[0]
    for t in range(cells.shape[0]):
        firsts[t] = -1
        if cells[t, 0] < 0:
            continue
        least = min(min(cells[t, 0], cells[t, 1]), min(cells[t, 2], cells[t, 3]))
        if own[least]:
            firsts[t] = least
            ends[least + 1] += 1
    for k in range(n):
        ends[k + 1] += ends[k]
    return ends[n]


@kernel
def _group_cells(found, starts, firsts, number, grouped, sort):
    """Fill `grouped` with cells in groups that have the same first sphere.

    Parameters
    ----------
    found : FoundCells
    starts, firsts : (n + 1,), (m,) arrays
        As `_count_own` leaves them; the starts are moved.
    number : (m,) int32 array
        To be filled with the place of each cell; what is there before stays for others.
    grouped : Cells
    sort : bool
        See `_compact`.
    """
    vertices, neighbours, planes = found
    order = np.empty((grouped.vertices.shape[0], 4), np.int8)
    members = np.empty(order.shape[0], np.int32)
    for t in range(vertices.shape[0]):
        k = firsts[t]
        if k < 0:
            continue
        place = starts[k]
        starts[k] += 1
        members[place] = t
        for i in range(4):
            order[place, i] = i
        if sort:
            _sort_four(vertices[t], order[place])
    if sort:  # within each group; `starts` now holds their ends
        first = 0
        for k in range(starts.shape[0] - 1):
            for i in range(first + 1, starts[k]):
                t = members[i]
                o0, o1, o2, o3 = order[i]
                j = i
                while j > first and _before(vertices, t, (o1, o2, o3), members[j - 1], order[j - 1]):
                    members[j] = members[j - 1]
                    order[j] = order[j - 1]
                    j -= 1
                members[j] = t
                order[j, 0], order[j, 1], order[j, 2], order[j, 3] = o0, o1, o2, o3
            first = starts[k]
    for place in range(members.shape[0]):
        number[members[place]] = place
    for place in range(members.shape[0]):
        t = members[place]
        o0, o1, o2, o3 = order[place]
        if _is_odd(o0, o1, o2, o3):
            order[place, 2], order[place, 3] = o3, o2
        for i in range(4):
            u = neighbours[t, order[place, i]]
            grouped.vertices[place, i] = vertices[t, order[place, i]]
            grouped.neighbours[place, i] = number[u] if u >= 0 else -1
            grouped.planes[place, i] = planes[t, i]


@helper
def _sort_four(values, order):
    """Fill in the places of four values in rising order."""
    for i in range(4):
        j = i
        while j > 0 and values[order[j - 1]] > values[i]:
            order[j] = order[j - 1]
            j -= 1
        order[j] = i


@helper
def _before(vertices, t, places, u, others):
    """Whether the last three vertices of cell t come before those of cell u."""
    for i in range(3):
        a = vertices[t, places[i]]
        b = vertices[u, others[i + 1]]
        if a != b:
            return a < b
    return False


@helper
def _is_odd(a, b, c, d):
    """Whether an odd number of swaps sorts the four places."""
    return ((a > b) + (a > c) + (a > d) + (b > c) + (b > d) + (c > d)) % 2 == 1
