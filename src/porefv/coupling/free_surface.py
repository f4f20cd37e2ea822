"""Free surfaces: the fluid above the grains holds the pressure of its wall, however far the grains have sunk."""

from __future__ import annotations

import numpy as np

from porefv.mesh.pore_mesh import PoreMesh
from porefv.packing.box import WALL_AXES, WALL_SENSES
from porefv.system.kernels import kernel

# How far beyond the outermost grain of its column the clear fluid begins, and how wide a column is, in mean diameters.
_BEYOND, _WIDE = 1.0, 1.5


def clear_layers(mesh: PoreMesh, free: np.ndarray) -> np.ndarray:
    """(n_pores,) int: wall with a free surface in whose clear layer each pore is, -1 in none.

    A pore is in the clear layer where all its Laguerre vertices are further towards the wall than the outermost grain
    of their column, by a mean diameter; a column is 1.5 mean diameters wide to each side.

    Parameters
    ----------
    mesh : PoreMesh
    free : (6,) bool array
        Walls that are free surfaces.
    """
    layers = np.full(mesh.n_pores, -1)
    diameter = 2.0 * float(mesh.packing.radii.mean())
    for wall in np.flatnonzero(free):
        axis, sense = WALL_AXES[wall], WALL_SENSES[wall]
        across = [a for a in range(3) if a != axis]
        columns = [across[0], across[1], axis]
        places, grains = mesh.vertices[:, columns], mesh.packing.centres[:, columns]
        places[:, 2] *= sense
        grains[:, 2] *= sense
        buried = np.empty(len(places), bool)
        _find_buried(places, *_in_columns(grains, _WIDE * diameter), _WIDE * diameter, _BEYOND * diameter, buried)
        layers[np.bincount(mesh.cell_pore, buried, mesh.n_pores) == 0] = wall
    return layers


def _in_columns(grains: np.ndarray, wide: float) -> tuple[np.ndarray, np.ndarray, np.ndarray, int]:
    """Grains (n, 3), the third their height, sorted by square columns so wide, with where each column starts.

    Returns also the corner of the first column (2,), and how many there are in a row.
    """
    corner = grains[:, :2].min(axis=0)
    column = ((grains[:, :2] - corner) / wide).astype(np.int64)
    rows, width = column.max(axis=0) + 1
    number = column @ np.array([width, 1])
    order = np.argsort(number, kind="stable")
    starts = np.searchsorted(number[order], np.arange(rows * width + 1))
    return grains[order], starts, corner, int(width)


@kernel
def _find_buried(places, grains, starts, corner, width, wide, beyond, buried):
    """Whether places (v, 3), the third their height, have a grain within `wide` to the side less than `beyond` below.

    Parameters
    ----------
    places : (v, 3) array
        [m]
    grains, starts, corner, width
        As of `_in_columns`.
    wide, beyond : float
        [m]
    buried : (v,) bool array
        Filled in.
    """
    rows = (starts.shape[0] - 1) // width
    for v in range(places.shape[0]):
        x, y, height = places[v, 0], places[v, 1], places[v, 2]
        row = int(np.floor((x - corner[0]) / wide))
        column = int(np.floor((y - corner[1]) / wide))
        found = False
        for a in range(max(row - 1, 0), min(row + 2, rows)):
            for b in range(max(column - 1, 0), min(column + 2, width)):
                for g in range(starts[a * width + b], starts[a * width + b + 1]):
                    if height <= grains[g, 2] + beyond:
                        found = found or (grains[g, 0] - x) ** 2 + (grains[g, 1] - y) ** 2 <= wide * wide
        buried[v] = found
