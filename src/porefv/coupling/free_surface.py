"""Free surfaces: the fluid above the grains holds the pressure of its wall, however far the grains have sunk."""

from __future__ import annotations

import numpy as np

from porefv.mesh.pore_mesh import PoreMesh
from porefv.packing.box import WALL_AXES, WALL_SENSES

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
    from scipy.spatial import cKDTree

    layers = np.full(mesh.n_pores, -1)
    diameter = 2.0 * float(mesh.packing.radii.mean())
    for wall in np.flatnonzero(free):
        axis, sense = WALL_AXES[wall], WALL_SENSES[wall]
        across = [a for a in range(3) if a != axis]
        heights, centres = sense * mesh.vertices[:, axis], mesh.packing.centres
        near = cKDTree(centres[:, across]).query_ball_point(mesh.vertices[:, across], _WIDE * diameter)
        counts = np.array([len(grains) for grains in near])
        tops = np.full(len(near), -np.inf)
        filled = np.flatnonzero(counts)
        if len(filled):
            flat = np.concatenate([near[k] for k in filled]).astype(int)
            starts = np.concatenate([[0], np.cumsum(counts[filled])[:-1]])
            tops[filled] = np.maximum.reduceat(sense * centres[flat, axis], starts)
        clear = heights > tops + _BEYOND * diameter
        layers[np.bincount(mesh.cell_pore, ~clear, mesh.n_pores) == 0] = wall
    return layers
