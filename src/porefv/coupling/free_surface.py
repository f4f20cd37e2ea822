"""Free surfaces: the fluid above the grains holds the pressure of its wall, however far the grains have sunk."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from porefv.mesh.pore_mesh import PoreMesh
from porefv.packing.box import WALL_AXES, WALL_SENSES
from porefv.system.kernels import helper, kernel

# How far beyond the outermost grain of its column the clear fluid begins, in mean diameters; how wide a column is to
# each side, in mean diameters or in mean distances of the grains that are further out.
_BEYOND, _WIDE = 1.0, 1.5


def clear_layers(mesh: PoreMesh, free: np.ndarray) -> np.ndarray:
    """(n_pores,) int: wall with a free surface in whose clear layer each pore is, -1 in none.

    A pore is in the clear layer where all its Laguerre vertices are further towards the wall than the outermost grain
    of their column, by a mean diameter. A column is 1.5 mean diameters wide to each side, or 1.5 times the mean
    distance of the grains that are further out than the vertex, if that is more: between the grains of a dilute cloud
    there is no clear fluid.

    Parameters
    ----------
    mesh : PoreMesh
    free : (6,) bool array
        Walls that are free surfaces.

    Notes
    -----
    Theory, grains and fluid: :eq:`eq-free-surface`.
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
        wide = _WIDE * np.maximum(diameter, _spacings(places[:, 2], grains[:, 2], mesh.box.section(axis)))
        buried = np.empty(len(places), bool)
        _find_buried(places, wide, _in_columns(grains, _WIDE * diameter), _BEYOND * diameter, buried)
        layers[np.bincount(mesh.cell_pore, buried, mesh.n_pores) == 0] = wall
    return layers


def _spacings(heights: np.ndarray, grains: np.ndarray, section: float) -> np.ndarray:
    """(v,): mean distance of the grains above each height, those of heights `grains`; 0 with none [m].

    It is the edge of the cube that each of them has between that height and the highest one.
    """
    tops = np.sort(grains)
    above = len(tops) - np.searchsorted(tops, heights, side="right")
    return np.cbrt(section * np.maximum(tops[-1] - heights, 0.0) / np.maximum(above, 1))


class _Columns(NamedTuple):
    """Grains by square columns.

    Attributes
    ----------
    grains : (n, 3) array
        Centres, sorted by column; the third is the height [m].
    starts : (c + 1,) int array
        Where each column starts.
    tops : (c,) array
        Highest grain of each column [m].
    corner : (2,) array
        Of the first column [m].
    wide : float
        Edge of a column [m].
    width : int
        Number of columns in a row.
    """

    grains: np.ndarray
    starts: np.ndarray
    tops: np.ndarray
    corner: np.ndarray
    wide: float
    width: int


def _in_columns(grains: np.ndarray, wide: float) -> _Columns:
    corner = grains[:, :2].min(axis=0)
    column = ((grains[:, :2] - corner) / wide).astype(np.int64)
    rows, width = column.max(axis=0) + 1
    number = column @ np.array([width, 1])
    order = np.argsort(number, kind="stable")
    starts = np.searchsorted(number[order], np.arange(rows * width + 1))
    tops = np.full(rows * width, -np.inf)
    np.maximum.at(tops, number, grains[:, 2])
    return _Columns(grains[order], starts, tops, corner, float(wide), int(width))


@kernel
def _find_buried(places, wide, columns, beyond, buried):
    """Whether places have a grain within `wide` to the side that is higher, or less than `beyond` lower.

    Parameters
    ----------
    places : (v, 3) array
        The third is the height [m].
    wide : (v,) array
        [m]
    columns : _Columns
    beyond : float
        [m]
    buried : (v,) bool array
        Filled in.
    """
    for v in range(places.shape[0]):
        buried[v] = _is_buried(places[v, 0], places[v, 1], places[v, 2] - beyond, wide[v], columns)


@helper
def _is_buried(x, y, height, wide, columns):
    grains, starts, tops, corner, edge, width = columns
    rows = tops.shape[0] // width
    for a in range(
        max(int(np.floor((x - wide - corner[0]) / edge)), 0),
        min(int(np.floor((x + wide - corner[0]) / edge)) + 1, rows),
    ):
        for b in range(
            max(int(np.floor((y - wide - corner[1]) / edge)), 0),
            min(int(np.floor((y + wide - corner[1]) / edge)) + 1, width),
        ):
            column = a * width + b
            if tops[column] < height:
                continue
            for g in range(starts[column], starts[column + 1]):
                if grains[g, 2] >= height and (grains[g, 0] - x) ** 2 + (grains[g, 1] - y) ** 2 <= wide * wide:
                    return True
    return False
