"""Centres of pores: where the sections of their throats meet.

A pore's throats meet at its Laguerre vertex, unless a small sphere lies in the pore. The vertex is then not in the
middle of what is open but off it, up to the plane of a neck and beyond, since to the vertex the small sphere is a
fourth grain like the three of the neck. What the neck resists on that side would go to the throats around the small
sphere, which are wider. So the centre of such a pore is the vertex drawn towards the small sphere.
"""

from __future__ import annotations

import numpy as np

from porefv.facets import _at, _dot, _minus
from porefv.kernels import njit, prange

# How far a vanishing sphere draws the centre, as a part of its height over the neck.
DRAWN = 0.5
# Throats shorter than this part of their neck's least radius ask for less, and for nothing as they vanish.
SHORT = 0.1


@njit(cache=True)
def drawn_parts(
    facets, starts, facet_cells, facet_vertices, cells, order, firsts, pores, n, points, sizes, vertices, normals,
    lengths, parts,
):  # fmt: skip
    """Parts (m, 4) of the way from a pore's vertex to each sphere of its cells by which that sphere draws the centre.

    A throat asks that the centre be at (1 - r / r_n) / 2 of the height H that the sphere of radius r has over the
    throat's plane at least, r_n being the least of the neck's radii: at a half for specks, anywhere for equal spheres.
    The part is the largest of those that the pore's throats ask for. A sphere that reaches into the neck, H < r, draws
    by H / r of it, and so not at all as it comes into the plane. A throat shorter than `SHORT` r_n asks for less, in
    proportion, so that nothing jumps where throats vanish.

    Parameters
    ----------
    facets, starts : arrays
        Of `Throats.facets_of_throats`.
    lengths : (t,) array
        Of throats.
    order, firsts : (m,), (n_pores + 1,) arrays
        Cells in the order of their pores, and where those of each pore begin.
    """
    for t in range(starts.shape[0] - 1):
        f = facets[starts[t]]
        first = _at(facet_vertices[f, 0], points)
        normal = _at(f, normals)
        least = np.inf
        for j in range(starts[t], starts[t + 1]):
            for v in range(3):
                k = facet_vertices[facets[j], v]
                if k < n:
                    least = min(least, sizes[k])
        asks = min(lengths[t] / (SHORT * least), 1.0)
        for side in range(2):
            inward = 1.0 if side == 1 else -1.0
            height = inward * _dot(_minus(_at(facet_cells[f, side], vertices), first), normal)
            pore = pores[facet_cells[f, side]]
            for c in order[firsts[pore] : firsts[pore + 1]]:
                for i in range(4):
                    k = cells[c, i]
                    if k >= n or sizes[k] >= least:
                        continue
                    above = inward * _dot(_minus(_at(k, points), first), normal)
                    wanted = DRAWN * (1.0 - sizes[k] / least) * above
                    if above > 0.0 and height < wanted:
                        part = asks * min(above / sizes[k], 1.0) * (wanted - height) / (above - height)
                        parts[c, i] = max(parts[c, i], part)


@njit(cache=True, parallel=True)
def pore_centres(cells, order, firsts, n, points, vertices, parts, centres):
    """Centre (m, 3) of each cell's pore, as seen from the cell's own vertex.

    Spheres that draw together do so by the mean of their ways, weighed by the parts. A pore on a wall has its centre on
    the wall as it has its vertex: the sphere's mirror image behind draws as well.
    """
    for pore in prange(firsts.shape[0] - 1):
        members = order[firsts[pore] : firsts[pore + 1]]
        free = np.ones(3)
        total = 0.0
        weight = 0.0
        x = np.zeros(3)
        for a in range(members.shape[0]):
            for i in range(4):
                k = cells[members[a], i]
                part = parts[members[a], i]
                if k >= n:
                    free[(k - n) // 2] = 0.0
                elif part > 0.0 and not _seen(k, cells, members[:a]):
                    total += part
                    weight += part * part
                    for axis in range(3):
                        x[axis] += part * part * points[k, axis]
        for c in members:
            for axis in range(3):
                v = vertices[c, axis]
                centres[c, axis] = v + free[axis] * (x[axis] - weight * v) / total if total > 0.0 else v


@njit(cache=True)
def _seen(k, cells, members):
    for c in members:
        for i in range(4):
            if cells[c, i] == k:
                return True
    return False
