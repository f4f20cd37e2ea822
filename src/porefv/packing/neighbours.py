"""Which spheres lie near each other: all pairs closer than a gap, in time linear in their number.

A hierarchy of cell grids, one level per factor two of the radius, keeps the cost linear for any mixture of
sizes: a sphere lives in the level whose cells are just larger than itself, and looks for partners in its own
level and in those of larger spheres. Only occupied cells are stored (hashed), so a few fine grains in a large
box cost nothing.
"""

import numpy as np
from numpy.typing import ArrayLike, NDArray

from porefv.errors import InputError
from porefv.system.kernels import helper, kernel
from porefv.system.threads import for_rows

# More neighbours per sphere than this, over a whole cell, cannot come from a packing of grains; it comes from
# radii and centres in different units, and listing the pairs would exhaust the memory.
CROWDED = 1000

# A cell is one int64: 6 bits of level, then 19 bits for each of its coordinates z, y, x.
_AXIS_BITS = 19
_AXIS_MASK = (1 << _AXIS_BITS) - 1
_MOST_CELLS_ALONG_AN_AXIS = 1 << (_AXIS_BITS - 1)
_FINEST_LEVEL = 31

# Cells are larger than the spheres they hold by this much, more than the rounding of a cell coordinate
# (2^18 cells times 2^-52), so that rounding never puts two neighbours two cells apart.
_ROUNDING_MARGIN = 1.0 + 2.0**-30


def neighbour_pairs(centres: ArrayLike, radii: ArrayLike, gap: float = 0.0) -> NDArray[np.int32]:
    """All pairs of spheres whose surfaces are closer than `gap`: ``|c_i - c_j| < r_i + r_j + gap``.

    Parameters
    ----------
    centres : (n, 3) array, m
    radii : (n,) array, m, positive
    gap : float, m, not negative
        Zero gives the spheres that overlap; exactly touching spheres are not a pair.

    Returns
    -------
    (m, 2) int32 array
        Rows ``(i, j)`` with ``i < j``, in lexicographic order, whatever the number of threads.

    Raises
    ------
    InputError
        For arrays of the wrong shape or not finite, radii not positive, a negative gap, or spheres with more
        than `CROWDED` neighbours each.
    """
    centres, radii = np.asarray(centres, dtype=np.float64), np.asarray(radii, dtype=np.float64)
    _check(centres, radii, gap)
    keys, levels = _cell_keys(centres, radii + 0.5 * gap)
    order = np.argsort(keys)
    keys = keys[order]
    starts = np.flatnonzero(np.concatenate(([True], keys[1:] != keys[:-1], [True])))
    cells = keys[starts[:-1]]
    table = _hash_table(cells)
    spheres = np.column_stack((centres, radii))[order]

    none = np.empty(0, dtype=np.int64)
    counts = np.empty(len(cells), np.int64)
    gap = float(gap)
    for_rows(_pairs_by_cell, len(cells), cells, starts, table, levels, spheres, order, gap, none, none, counts)
    crowded = counts > CROWDED * np.diff(starts)
    if crowded.any():
        culprit = order[starts[np.flatnonzero(crowded)[0]]]
        raise InputError(
            f"sphere {culprit} and those around it have more than {CROWDED} neighbours each. "
            "Check that radii and centres are in the same unit, and that spheres are not given many times."
        )
    ends = np.cumsum(counts)
    found = np.empty(ends[-1], dtype=np.int64)
    firsts = ends - counts
    for_rows(_pairs_by_cell, len(cells), cells, starts, table, levels, spheres, order, gap, firsts, found, counts)
    found.sort()
    return np.column_stack((found >> 32, found & 0xFFFFFFFF)).astype(np.int32)


def _check(centres: NDArray, radii: NDArray, gap: float) -> None:
    if centres.ndim != 2 or centres.shape[1] != 3 or radii.shape != centres.shape[:1] or len(radii) == 0:
        raise InputError(
            f"centres must have shape (n, 3) and radii (n,), n >= 1, not {centres.shape} and {radii.shape}."
        )
    if not (np.isfinite(centres).all() and np.isfinite(radii).all() and (radii > 0).all()):
        raise InputError("centres and radii must be finite, and radii positive.")
    if not (np.isfinite(gap) and gap >= 0):
        raise InputError(f"gap must be a length >= 0, not {gap}.")


def _cell_keys(centres: NDArray, reach: NDArray) -> tuple[NDArray, NDArray]:
    """The key of the cell of each sphere, and the levels in use, coarsest first.

    Level 0 has cells as large as the largest sphere; a level below has cells half as large. The division by
    the size of the coarsest cell comes first, and powers of two are exact: the grids nest exactly.
    """
    lower = centres.min(axis=0)
    extent = (centres.max(axis=0) - lower).max()
    coarsest = max(2.0 * reach.max() * _ROUNDING_MARGIN, extent / _MOST_CELLS_ALONG_AN_AXIS)
    if extent > 0:
        finest = min(_floor_log2(_MOST_CELLS_ALONG_AN_AXIS * (coarsest / extent)), _FINEST_LEVEL)
    else:
        finest = 0
    level = np.clip(_floor_log2(coarsest / (2.0 * reach * _ROUNDING_MARGIN)), 0, finest)
    cell = np.ldexp((centres - lower) / coarsest, level[:, None]).astype(np.int64)
    key = level.astype(np.int64)
    for axis in (2, 1, 0):
        key = (key << _AXIS_BITS) | cell[:, axis]
    return key, np.unique(level).astype(np.int64)


def _floor_log2(x):
    return np.frexp(x)[1] - 1


@helper
def _slot(key, size):
    """Where the search for a key starts: Fibonacci hashing into a table whose size is a power of two."""
    mixed = np.uint64(key) * np.uint64(0x9E3779B97F4A7C15)
    return np.int64((mixed >> np.uint64(32)) & np.uint64(size - 1))


@kernel
def _hash_table(cells):
    """Open-addressing table of the positions of the occupied cells, at most half full, -1 where free."""
    size = 2
    while size < 2 * len(cells):
        size *= 2
    table = np.full(size, -1, dtype=np.int32)
    for position in range(len(cells)):
        slot = _slot(cells[position], size)
        while table[slot] >= 0:
            slot = (slot + 1) & (size - 1)
        table[slot] = position
    return table


@helper
def _find(key, cells, table):
    """Position of the cell with this key, or -1 if it is empty."""
    slot = _slot(key, len(table))
    while table[slot] >= 0:
        if cells[table[slot]] == key:
            return table[slot]
        slot = (slot + 1) & (len(table) - 1)
    return -1


@helper
def _pairs_of_two_cells(a, b, starts, spheres, order, gap, first, most, found):
    """Number of pairs between cells a and b (or within a, if they are the same).

    The pairs are written to `found[first:]` as ``i << 32 | j``, i < j, unless `found` is empty. Gives up soon
    after `most` pairs.
    """
    count = 0
    for p in range(starts[a], starts[a + 1]):
        x, y, z, r = spheres[p, 0], spheres[p, 1], spheres[p, 2], spheres[p, 3]
        for q in range(p + 1 if a == b else starts[b], starts[b + 1]):
            dx, dy, dz = spheres[q, 0] - x, spheres[q, 1] - y, spheres[q, 2] - z
            distance = r + spheres[q, 3] + gap
            if dx * dx + dy * dy + dz * dz < distance * distance:
                if len(found) > 0:
                    i, j = order[p], order[q]
                    found[first + count] = (min(i, j) << 32) | max(i, j)
                count += 1
        if count > most:
            break
    return count


@kernel
def _pairs_by_cell(begin, end, cells, starts, table, levels, spheres, order, gap, firsts, found, counts):
    """Fill in how many pairs cells begin ... end - 1 find in themselves, in cells after them, and in coarser levels.

    Called twice: with empty `firsts` and `found` to count, then to write the pairs of cell c from
    ``firsts[c]`` on.
    """
    for c in range(begin, end):
        level = cells[c] >> (3 * _AXIS_BITS)
        x = cells[c] & _AXIS_MASK
        y = (cells[c] >> _AXIS_BITS) & _AXIS_MASK
        z = (cells[c] >> (2 * _AXIS_BITS)) & _AXIS_MASK
        most = CROWDED * (starts[c + 1] - starts[c])
        first = firsts[c] if len(firsts) > 0 else 0
        count = 0
        for coarse in levels:
            if coarse > level:
                break
            # Centres of partners lie closer to this cell than half a cell of this level plus half a coarse
            # one. In half cells of this level, a coarse cell is 2^(shift + 1) long.
            shift = level - coarse
            below, above = 1 + (1 << shift), 2 + (1 << shift)
            x0, x1 = max(2 * x - below, 0) >> (shift + 1), (2 * x + above) >> (shift + 1)
            y0, y1 = max(2 * y - below, 0) >> (shift + 1), (2 * y + above) >> (shift + 1)
            z0, z1 = max(2 * z - below, 0) >> (shift + 1), (2 * z + above) >> (shift + 1)
            for k in range(z0, z1 + 1):
                for j in range(y0, y1 + 1):
                    for i in range(x0, x1 + 1):
                        key = (((coarse << _AXIS_BITS | k) << _AXIS_BITS) | j) << _AXIS_BITS | i
                        if coarse == level and key < cells[c]:
                            continue  # that cell finds the pairs with this one
                        other = _find(key, cells, table)
                        if other >= 0 and count <= most:
                            count += _pairs_of_two_cells(
                                c, other, starts, spheres, order, gap, first + count, most - count, found
                            )
        counts[c] = count
