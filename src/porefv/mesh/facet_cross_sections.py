"""Kernel of the facets as cross-sections of throats: normals, lengths, fluid areas and solid sectors (C12 §2.2.2).

Each sphere owns its ball as far as the Laguerre plane towards each neighbour (or wall). Where balls overlap or cross a
wall, the part of a sector beyond that plane is left out.
"""

from __future__ import annotations

import numpy as np

from porefv.mesh.facet_kernels import facet_angles, facet_corners
from porefv.mesh.laguerre import crosses_laguerre_plane, laguerre_plane_distances
from porefv.mesh.vectors import dot, minus, times, vector_at, wall_distance
from porefv.system.kernels import njit, prange


@njit(cache=True, parallel=True, error_model="numpy")
def facet_cross_sections(
    facet_cells, facet_vertices, vertices, n, points, sizes, normals, lengths, fluid, sectors, covered
):
    """Unit normal, L = (P_j - P_i)·n, A^f, sector areas A^k of each facet, and whether its spheres cover it.

    They do where its radical centre, the point of equal power in its plane, lies inside of them.
    """
    for f in prange(facet_cells.shape[0]):
        a, b, c, ab, ac, cross, twice = facet_corners(f, facet_vertices, n, points)
        normal = times(1.0 / twice if twice > 0.0 else 0.0, cross)
        ra = sizes[a]
        angles = facet_angles(b, c, n, ab, ac, twice)
        sectors[f, 0] = 0.5 * angles[0] * ra * ra
        sectors[f, 1] = 0.5 * angles[1] * sizes[b] * sizes[b]
        sectors[f, 2] = 0.5 * angles[2] * sizes[c] * sizes[c]
        if c < n:
            area = 0.5 * twice
        elif b < n:
            area = 0.5 * (wall_distance(a, c, points, sizes) + wall_distance(b, c, points, sizes)) * twice
        else:
            area = wall_distance(a, b, points, sizes) * wall_distance(a, c, points, sizes)
        _cut_sectors(f, 0, 1, a, b, ab, n, points, sizes, sectors)
        if b < n:
            _cut_sectors(f, 1, 2, b, c, minus(ac, ab) if c < n else ac, n, points, sizes, sectors)
        _cut_sectors(f, 0, 2, a, c, ac, n, points, sizes, sectors)
        fluid[f] = area - (sectors[f, 0] + sectors[f, 1] + sectors[f, 2])
        pi = vector_at(facet_cells[f, 0], vertices)
        lengths[f] = dot(normal, minus(vector_at(facet_cells[f, 1], vertices), pi))
        gap = minus(vector_at(a, points), pi)
        above = dot(gap, normal)
        covered[f] = dot(gap, gap) - ra * ra <= above * above
        for axis in range(3):
            normals[f, axis] = normal[axis]


@njit(cache=True)
def _cut_sectors(f, i, j, k, m, u, n, points, sizes, sectors):
    """Take from the sectors of vertices k and m of facet f what reaches beyond the Laguerre plane between them."""
    if not crosses_laguerre_plane(k, m, u, n, points, sizes):
        return
    d, beyond = laguerre_plane_distances(k, m, u, n, points, sizes)
    sectors[f, i] -= _half_segment(sizes[k], d)
    if m < n:
        sectors[f, j] -= _half_segment(sizes[m], beyond)


@njit(cache=True)
def _half_segment(r, d):
    """Half the part of a disc of radius r beyond a chord at distance d from its centre."""
    chord = np.sqrt((r - d) * (r + d))
    return 0.5 * (r * r * np.arctan2(chord, d) - d * chord)
