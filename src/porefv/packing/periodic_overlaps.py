"""Which spheres of a periodic cell overlap one another, or images of one another and of themselves."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from porefv.packing.box import Floats
from porefv.packing.cell import Cell, reduced_basis
from porefv.packing.images import faces_of, images_within
from porefv.packing.neighbours import neighbour_pairs
from porefv.packing.overlaps import Overlaps
from porefv.packing.triple_overlaps import triple_overlaps


class PeriodicOverlaps(NamedTuple):
    """Overlaps of the spheres of a periodic cell.

    Attributes
    ----------
    overlaps : Overlaps
        A pair i <= j for each image of j that overlaps i; a sphere and its own image are a pair i, i.
    triples : int
        Number of triples of spheres with a point in common.
    """

    overlaps: Overlaps
    triples: int


def periodic_overlaps(centres: Floats, radii: Floats, cell: Cell) -> PeriodicOverlaps:
    """All pairs of spheres of a periodic cell that overlap, each counted once, and the number of triples.

    Parameters
    ----------
    centres, radii : (n, 3), (n,) arrays, m
    cell : Cell

    Raises
    ------
    InputError
        If spheres have too many neighbours (see `neighbour_pairs`).
    """
    vectors = reduced_basis(cell.vectors)
    local = centres - cell.origin
    local = local - np.floor(np.linalg.solve(vectors.T, local.T).T) @ vectors
    fractions = np.linalg.solve(vectors.T, local.T).T
    images = images_within(fractions, faces_of(vectors).heights, 2.0 * float(radii.max()))
    points, sizes = local[images.spheres] + images.steps @ vectors, radii[images.spheres]
    pairs = neighbour_pairs(points, sizes)
    # Images are in the order of spheres and steps, so that the first of a pair is the same one in all its repetitions.
    counted = (images.steps[pairs[:, 0]] == 0).all(axis=1)
    i, j = pairs[counted].T
    spheres = images.spheres.astype(np.int32)
    named = np.stack([spheres[i], spheres[j]], axis=1)
    depths = sizes[i] + sizes[j] - np.linalg.norm(points[j] - points[i], axis=1)
    order = np.lexsort(named.T[::-1])
    none = np.empty(0, np.int32)
    overlaps = Overlaps(named[order], depths[order], none, none, np.empty(0))
    return PeriodicOverlaps(overlaps, _triples(pairs, counted, points, sizes) if len(named) > 2 else 0)


def _triples(pairs: NDArray[np.int32], counted: NDArray[np.bool_], points: Floats, sizes: Floats) -> int:
    """Number of triples whose first sphere is in the cell.

    The kernel counts all triples of images. A copy of each pair's first sphere in the cell, put before all others,
    makes every triple that is wanted occur once more.
    """
    k = len(sizes)
    copies = pairs[counted].copy()
    copies[:, 1] += k
    none = np.zeros((2 * k, 6))
    more = triple_overlaps(
        np.concatenate([copies, pairs + np.int32(k)]), np.concatenate([points, points]), np.tile(sizes, 2), none
    )
    return int(more) - int(triple_overlaps(pairs, points, sizes, none[:k]))
