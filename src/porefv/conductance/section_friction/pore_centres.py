"""Pore centres: the points where the cross-sections of a pore's throats meet.

The throats of a pore meet at its Laguerre vertex, unless a small sphere lies in the pore. The vertex is then not in the
middle of the open space: it may lie in the plane of a constriction, or beyond that plane. The friction of the
constriction on that side would be attributed to the wider throats around the small sphere. The centre of such a pore is
therefore the vertex moved towards the small sphere.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from porefv.mesh.throats import Throats
from porefv.mesh.vectors import dot, minus, vector_at
from porefv.packing.box import WALL_AXES
from porefv.system.kernels import helper, kernel
from porefv.system.threads import for_rows

# Least height of the centre over a constriction, as a part of the height of a sphere of vanishing size.
LEAST_HEIGHT = 0.5
# The move that a throat demands is reduced where the throat is shorter than this part of its smallest radius, down to
# zero as its length vanishes: without it, forces jump where pores are united.
SHORT = 0.1


class Pores(NamedTuple):
    """Cells and pores.

    Attributes
    ----------
    vertices : (m, 4) int32 array
        Spheres and walls of each cell.
    of_cells : (m,) int32 array
        Pore of each cell.
    cells, starts : (m,), (n_pores + 1,) int arrays
        Pore i has the entries starts[i] ... starts[i + 1] - 1 of `cells`.
    """

    vertices: np.ndarray
    of_cells: np.ndarray
    cells: np.ndarray
    starts: np.ndarray


def centres_of_pores(throats: Throats) -> np.ndarray:
    """(m, 3): centre of each cell's pore, its Laguerre vertex moved to small spheres, from the local origin [m].

    Theory, section friction: :eq:`eq-pore-centre`.
    """
    mesh = throats.mesh
    pores = Pores(mesh.cells, mesh.cell_pore, *mesh.cells_of_pores)
    parts, centres = np.zeros((len(mesh.cells), 4)), np.empty((len(mesh.cells), 3))
    _shift_parts(
        throats.facets_of_throats,
        throats.effective_lengths,
        mesh.facets.planes,
        pores,
        mesh.cell_vertices,
        mesh.local_vertices,
        parts,
    )
    parts = mesh.greatest_of_images(parts)
    for_rows(_pore_centres, len(pores.starts) - 1, pores, mesh.cell_vertices, mesh.local_vertices, parts, centres)
    return centres


@kernel
def _shift_parts(throats, lengths, facets, pores, vertices, laguerre_vertices, parts):
    """Fill `parts`: by which part of the distance from a pore's vertex to a sphere of its cells the centre moves there.

    A throat demands that the height of the centre over the throat's plane is at least (1 - r / r_n) / 2 of the height H
    of the sphere of radius r; r_n is the smallest radius of the throat. This is one half for very small spheres, and
    nothing for equal spheres. The part is the largest of those that the pore's throats demand. It is multiplied by
    H / r for a sphere that reaches into the throat's plane (H < r), and so vanishes as the sphere comes into the plane.
    It is reduced in proportion for a throat shorter than `SHORT` r_n, so that nothing jumps where throats vanish.

    Parameters
    ----------
    throats : ThroatFacets
    lengths : (t,) array
        Of throats [m].
    facets : FacetPlanes
    pores : Pores
    vertices : Vertices
    laguerre_vertices : (m, 3) array
        Of the cells [m].
    parts : (m, 4) array
        Part for each vertex of each cell, zero before [-].
    """
    n, points, sizes = vertices
    starts = throats.starts
    for t in range(starts.shape[0] - 1):
        f = throats.facets[starts[t]]
        first = vector_at(facets.vertices[f, 0], points)
        normal = vector_at(f, facets.normals)
        least = np.inf
        for j in range(starts[t], starts[t + 1]):
            for v in range(3):
                k = facets.vertices[throats.facets[j], v]
                if k < n:
                    least = min(least, sizes[k])
        demand = min(lengths[t] / (SHORT * least), 1.0)
        for side in range(2):
            inward = 1.0 if side == 1 else -1.0
            height = inward * dot(minus(vector_at(facets.cells[f, side], laguerre_vertices), first), normal)
            pore = pores.of_cells[facets.cells[f, side]]
            for c in pores.cells[pores.starts[pore] : pores.starts[pore + 1]]:
                for i in range(4):
                    k = pores.vertices[c, i]
                    if k >= n or sizes[k] >= least:
                        continue
                    above = inward * dot(minus(vector_at(k, points), first), normal)
                    least_height = LEAST_HEIGHT * (1.0 - sizes[k] / least) * above
                    if above > 0.0 and height < least_height:
                        part = demand * min(above / sizes[k], 1.0) * (least_height - height) / (above - height)
                        parts[c, i] = max(parts[c, i], part)


@kernel
def _pore_centres(first, last, pores, vertices, laguerre_vertices, parts, centres):
    """Fill in the centres (m, 3) of pores first ... last - 1 for each of their cells, moved from the cell's own vertex.

    Where several spheres move the centre, the moves are averaged with the parts as weights. The centre of a pore on a
    wall stays on that wall: the mirror image of the sphere moves it by as much in the other sense.
    """
    n, points, _ = vertices
    for pore in range(first, last):
        members = pores.cells[pores.starts[pore] : pores.starts[pore + 1]]
        free = np.ones(3)
        total = 0.0
        weight = 0.0
        x = np.zeros(3)
        for a in range(members.shape[0]):
            for i in range(4):
                k = pores.vertices[members[a], i]
                part = parts[members[a], i]
                if k >= n:
                    free[WALL_AXES[k - n]] = 0.0
                elif part > 0.0 and not _seen(k, pores.vertices, members[:a]):
                    total += part
                    weight += part * part
                    for axis in range(3):
                        x[axis] += part * part * points[k, axis]
        for c in members:
            for axis in range(3):
                v = laguerre_vertices[c, axis]
                centres[c, axis] = v + free[axis] * (x[axis] - weight * v) / total if total > 0.0 else v


@helper
def _seen(k, cell_vertices, members):
    """Whether one of the cells has vertex k."""
    for c in members:
        for i in range(4):
            if cell_vertices[c, i] == k:
                return True
    return False
