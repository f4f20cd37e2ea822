"""Spheres that overlap one another and spheres that cross walls, and the volumes that are then shared or cut off."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from porefv.errors import counted
from porefv.packing.box import Floats

Ints = NDArray[np.int32]


@dataclass(frozen=True, eq=False, repr=False)
class Overlaps:
    """Spheres that overlap one another, and spheres that cross walls.

    Parameters
    ----------
    pairs : (m, 2) int32 array
        Overlapping spheres i < j, in lexicographic order.
    depths : (m,) array, m
        ``r_i + r_j - |c_i - c_j|``, positive.
    wall_spheres, wall_ids : (w,) int32 arrays
        Sphere and wall (position in `WALLS`) of each crossing.
    wall_depths : (w,) array, m
        How far the sphere reaches beyond the wall, positive.
    """

    pairs: Ints
    depths: Floats
    wall_spheres: Ints
    wall_ids: Ints
    wall_depths: Floats

    def __repr__(self) -> str:
        pairs, crossings = counted(len(self.pairs), "pair"), counted(len(self.wall_ids), "wall crossing")
        return f"Overlaps({pairs}, {crossings})"


def cap_volume(radius: Floats, height: Floats) -> Floats:
    """Volume of the cap cut off a ball by a plane, m³; heights beyond the diameter give the whole ball."""
    height = np.minimum(height, 2 * radius)
    return np.pi * height**2 * (radius - height / 3)


def sphere_volumes(radii: ArrayLike) -> Floats:
    """Volumes of spheres, m³."""
    return 4.0 / 3.0 * np.pi * np.asarray(radii, float) ** 3


def lens_volume(r_i: Floats, r_j: Floats, distance: Floats) -> Floats:
    """Volume shared by two overlapping balls, m³: two caps, or the smaller ball if it lies in the larger."""
    depth = r_i + r_j - distance
    engulfed = distance <= np.abs(r_i - r_j)
    # The plane of intersection cuts caps of these heights; the factor `depth` keeps shallow lenses accurate.
    twice = 2 * np.where(engulfed, 1.0, distance)
    h_i = depth * (r_j - r_i + distance) / twice
    h_j = depth * (r_i - r_j + distance) / twice
    lens = cap_volume(r_i, h_i) + cap_volume(r_j, h_j)
    return np.where(engulfed, sphere_volumes(np.minimum(r_i, r_j)), lens)
