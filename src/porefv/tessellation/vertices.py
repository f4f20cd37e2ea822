"""The vertices of cells as kernels take them."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np


class Vertices(NamedTuple):
    """The vertices of cells: spheres 0 ... n - 1, then the six walls n ... n + 5 as x_min, x_max, y_min, ...

    Attributes
    ----------
    n_spheres : int
        n.
    points : (n + 6, 3) array
        Centre of each sphere, from a local origin [m]; outward unit normal d of each wall [-].
    sizes : (n + 6,) array
        Radius of each sphere; offset s of each wall d·x = s from the local origin [m].

    Notes
    -----
    `tessellation` measures lengths in a unit near the size of the box, a power of two of the metre.
    """

    n_spheres: int
    points: np.ndarray
    sizes: np.ndarray
