"""Points in three spheres at once, or in two and outside the box: sums over pairs are wrong there."""

from __future__ import annotations

import numpy as np

from porefv.packing.box import WALL_AXES, WALL_SENSES
from porefv.system.kernels import helper, kernel


@kernel
def triple_overlaps(pairs, centres, radii, crossings):
    """How many triples have a point in common: three spheres, two spheres and a wall, or a sphere and two walls.

    Parameters
    ----------
    pairs : (m, 2) int array
        Overlapping spheres i < j, in lexicographic order.
    centres, radii : (n, 3), (n,) arrays
    crossings : (n, 6) array
        How far each sphere reaches beyond each wall; not positive where it does not.
    """
    n = radii.shape[0]
    first = np.zeros(n + 1, np.int64)
    for p in range(pairs.shape[0]):
        first[pairs[p, 0] + 1] += 1
    for i in range(n):
        first[i + 1] += first[i]
    count = 0
    for i in range(n):
        for a in range(first[i], first[i + 1]):
            j = pairs[a, 1]
            for b in range(a + 1, first[i + 1]):
                k = pairs[b, 1]
                c = first[j]
                while c < first[j + 1] and pairs[c, 1] != k:
                    c += 1
                if c < first[j + 1] and _meet(i, j, k, centres, radii):
                    count += 1
            for w in range(6):
                if crossings[i, w] > 0.0 and crossings[j, w] > 0.0 and _reach(i, j, w, centres, radii, crossings) > 0.0:
                    count += 1
        for w in range(6):
            for v in range(w + 1, 6):
                if WALL_AXES[w] == WALL_AXES[v] or crossings[i, w] <= 0.0 or crossings[i, v] <= 0.0:
                    continue
                if (radii[i] - crossings[i, w]) ** 2 + (radii[i] - crossings[i, v]) ** 2 < radii[i] ** 2:
                    count += 1
    return count


@helper
def _meet(i, j, k, centres, radii):
    """Whether three balls, no one within another, have a point in common.

    They do in the plane of their centres, where a point on two of the circles lies in the third disc; if not, the
    lens of two is so thin that it lies within the third.
    """
    u = _vector(i, j, centres)
    v = _vector(i, k, centres)
    d = np.sqrt(_dot(u, u))
    x = _dot(v, u) / d
    y = np.sqrt(max(_dot(v, v) - x * x, 0.0))
    disc_i, disc_j, disc_k = (0.0, 0.0, radii[i]), (d, 0.0, radii[j]), (x, y, radii[k])
    return (
        _holds_crossing(disc_i, disc_j, disc_k)
        or _holds_crossing(disc_j, disc_k, disc_i)
        or _holds_crossing(disc_k, disc_i, disc_j)
    )


@helper
def _holds_crossing(a, b, c):
    """Whether a point where the circles of two discs cross lies in a third; each is x, y and radius."""
    along_x = b[0] - a[0]
    along_y = b[1] - a[1]
    length = np.sqrt(along_x * along_x + along_y * along_y)
    foot = 0.5 * (length + (a[2] - b[2]) * (a[2] + b[2]) / length)
    half = np.sqrt(max(a[2] * a[2] - foot * foot, 0.0))
    for sense in (-1.0, 1.0):
        px = a[0] + (foot * along_x - sense * half * along_y) / length - c[0]
        py = a[1] + (foot * along_y + sense * half * along_x) / length - c[1]
        if px * px + py * py < c[2] * c[2] * (1.0 - 1e-12):
            return True
    return False


@helper
def _vector(i, j, centres):
    """From the centre of sphere i to that of j."""
    return centres[j, 0] - centres[i, 0], centres[j, 1] - centres[i, 1], centres[j, 2] - centres[i, 2]


@helper
def _dot(a, b):
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


@helper
def _reach(i, j, w, centres, radii, crossings):
    """How far the lens of two spheres reaches beyond a wall that both cross."""
    u = _vector(i, j, centres)
    length = np.sqrt(_dot(u, u))
    up = WALL_SENSES[w] * u[WALL_AXES[w]] / length
    foot = 0.5 * (length + (radii[i] - radii[j]) * (radii[i] + radii[j]) / length)
    # The outermost point of a ball, where it lies in the other; else one of the circle that both surfaces share.
    if radii[i] * up >= foot:
        return crossings[i, w]
    if -radii[j] * up >= length - foot:
        return crossings[j, w]
    half = np.sqrt(max(radii[i] * radii[i] - foot * foot, 0.0))
    return crossings[i, w] - radii[i] + foot * up + half * np.sqrt(max(1.0 - up * up, 0.0))
