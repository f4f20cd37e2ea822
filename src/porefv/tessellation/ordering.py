"""The order of insertion: random in the large, along a space-filling curve in the small.

Biased randomised insertion order (Amenta, Choi and Rote 2003): rounds of doubling size keep the expected cost
linear for any packing, and sorting each round along a Morton curve keeps the search for the next
sphere short and the memory warm.
"""

from __future__ import annotations

import numpy as np

from porefv.system.kernels import helper, kernel, read_only

_BITS = 20


def morton_codes(points: np.ndarray) -> np.ndarray:
    """(n,) int64: Morton code of each point, its coordinates on a 2^20 grid with their bits interleaved."""
    lower = points.min(axis=0)
    size = float((points.max(axis=0) - lower).max())
    return _interleave(read_only(points), lower, ((1 << _BITS) - 1) / size if size > 0.0 else 0.0)


@kernel
def _interleave(points, lower, inverse):
    codes = np.empty(points.shape[0], np.int64)
    for k in range(points.shape[0]):
        code = np.int64(0)
        for axis in range(3):
            code |= _spread(np.int64((points[k, axis] - lower[axis]) * inverse)) << axis
        codes[k] = code
    return codes


@helper
def _spread(x):
    x = (x | (x << 32)) & 0x1F00000000FFFF
    x = (x | (x << 16)) & 0x1F0000FF0000FF
    x = (x | (x << 8)) & 0x100F00F00F00F00F
    x = (x | (x << 4)) & 0x10C30C30C30C30C3
    return (x | (x << 2)) & 0x1249249249249249


def rounds(n: int) -> list[slice]:
    """Bounds of the insertion rounds over randomly permuted spheres, each twice the one before."""
    bounds = [n]
    while bounds[-1] > 1000:
        bounds.append(bounds[-1] // 2)
    bounds.append(0)
    return [slice(a, b) for a, b in zip(bounds[:0:-1], bounds[-2::-1], strict=True)]
