"""Images of the spheres of a periodic cell in and around it."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from porefv.packing.box import Floats


class Images(NamedTuple):
    """Images of spheres, in the order of their spheres, and those of one sphere in the order of their steps.

    Attributes
    ----------
    spheres : (k,) int array
        Sphere of each image.
    steps : (k, 3) int array
        How many of each lattice vector lead from the sphere to its image.
    """

    spheres: NDArray[np.int64]
    steps: NDArray[np.int64]


class Faces(NamedTuple):
    """The three pairs of opposite faces of a cell.

    Attributes
    ----------
    normals : (3, 3) array
        Unit normal of each pair of faces, inward from the face at the origin [-].
    heights : (3,) array
        Distance between the faces of each pair [m].
    """

    normals: Floats
    heights: Floats


def faces_of(vectors: Floats) -> Faces:
    """The faces of the cell of three vectors, (3, 3)."""
    inverse = np.linalg.inv(vectors)  # its columns are normal to the faces, and 1 / height long
    heights = 1.0 / np.linalg.norm(inverse, axis=0)
    return Faces((inverse * heights).T, heights)


def images_within(fractions: Floats, heights: Floats, reach: float) -> Images:
    """All images of spheres that are in a cell or no further than `reach` from one of its faces' planes.

    Parameters
    ----------
    fractions : (n, 3) array
        Place of each sphere in the cell, along each vector, 0 ... 1 [-].
    heights : (3,) array
        Distance between the cell's opposite faces [m].
    reach : float, m
    """
    layers = np.ceil(reach / heights).astype(int) + 1
    near = []
    for axis in range(3):
        place = (fractions[:, axis, None] + np.arange(-layers[axis], layers[axis] + 1)) * heights[axis]
        near.append((place >= -reach) & (place < heights[axis] + reach))
    x, y, z = near
    spheres, *steps = np.nonzero(x[:, :, None, None] & y[:, None, :, None] & z[:, None, None, :])
    return Images(spheres, np.stack(steps, axis=1) - layers)
