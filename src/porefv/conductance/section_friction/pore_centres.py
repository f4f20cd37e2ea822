"""Pore centres: the points where the cross-sections of a pore's throats meet.

The throats of a pore meet at its Laguerre vertex, unless a small sphere lies in the pore. The vertex is then not in the
middle of the open space: it may lie in the plane of a constriction, or beyond that plane. The friction of the
constriction on that side would be attributed to the wider throats around the small sphere. The centre of such a pore is
therefore the vertex moved towards the small sphere.
"""

from __future__ import annotations

import numpy as np

from porefv.mesh.throats import Throats
from porefv.mesh.vectors import dot, minus, vector_at
from porefv.packing.box import WALL_AXES
from porefv.system.kernels import njit, prange

# Least height of the centre over a constriction, as a part of the height of a sphere of vanishing size.
LEAST_HEIGHT = 0.5
# The move that a throat demands is reduced where the throat is shorter than this part of its smallest radius, down to
# zero as its length vanishes: without it, forces jump where pores are united.
SHORT = 0.1


def centres_of_pores(throats: Throats) -> np.ndarray:
    """(m, 3): centre of each cell's pore, its Laguerre vertex moved to small spheres, from the local origin [m]."""
    mesh, facets = throats.mesh, throats.mesh.facets
    order, firsts = mesh.cells_of_pores
    ordered, starts = throats.facets_of_throats
    parts, centres = np.zeros((mesh.n_cells, 4)), np.empty((mesh.n_cells, 3))
    _shift_parts(
        ordered, starts, facets.cells, facets.vertices, mesh.cells, order, firsts, mesh.cell_pore, mesh.n_spheres,
        mesh.local_points, mesh.sizes, mesh.local_vertices, facets.normals, throats.effective_lengths, parts,
    )  # fmt: skip
    _pore_centres(mesh.cells, order, firsts, mesh.n_spheres, mesh.local_points, mesh.local_vertices, parts, centres)
    return centres


@njit(cache=True)
def _shift_parts(
    facets, starts, facet_cells, facet_vertices, cells, order, firsts, pores, n, points, sizes, vertices, normals,
    lengths, parts,
):  # fmt: skip
    """Parts (m, 4) of the distance from a pore's vertex to each sphere of its cells by which the centre moves there.

    A throat demands that the height of the centre over the throat's plane is at least (1 - r / r_n) / 2 of the height H
    of the sphere of radius r; r_n is the smallest radius of the throat. This is one half for very small spheres, and
    nothing for equal spheres. The part is the largest of those that the pore's throats demand. It is multiplied by
    H / r for a sphere that reaches into the throat's plane (H < r), and so vanishes as the sphere comes into the plane.
    It is reduced in proportion for a throat shorter than `SHORT` r_n, so that nothing jumps where throats vanish.

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
        first = vector_at(facet_vertices[f, 0], points)
        normal = vector_at(f, normals)
        least = np.inf
        for j in range(starts[t], starts[t + 1]):
            for v in range(3):
                k = facet_vertices[facets[j], v]
                if k < n:
                    least = min(least, sizes[k])
        demand = min(lengths[t] / (SHORT * least), 1.0)
        for side in range(2):
            inward = 1.0 if side == 1 else -1.0
            height = inward * dot(minus(vector_at(facet_cells[f, side], vertices), first), normal)
            pore = pores[facet_cells[f, side]]
            for c in order[firsts[pore] : firsts[pore + 1]]:
                for i in range(4):
                    k = cells[c, i]
                    if k >= n or sizes[k] >= least:
                        continue
                    above = inward * dot(minus(vector_at(k, points), first), normal)
                    wanted = LEAST_HEIGHT * (1.0 - sizes[k] / least) * above
                    if above > 0.0 and height < wanted:
                        part = demand * min(above / sizes[k], 1.0) * (wanted - height) / (above - height)
                        parts[c, i] = max(parts[c, i], part)


@njit(cache=True, parallel=True)
def _pore_centres(cells, order, firsts, n, points, vertices, parts, centres):
    """Centre (m, 3) of each cell's pore, moved from the cell's own vertex.

    Where several spheres move the centre, the moves are averaged with the parts as weights. The centre of a pore on a
    wall stays on that wall: the mirror image of the sphere moves it by as much in the other sense.
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
                    free[WALL_AXES[k - n]] = 0.0
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
