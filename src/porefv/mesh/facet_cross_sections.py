"""Kernel of the facets as cross-sections of throats: normals, lengths, areas, solid sectors (C12 §2.2.2).

Each sphere owns its ball as far as the Laguerre plane towards each neighbour (or wall). Where balls overlap or cross a
wall, the part of a sector beyond that plane is left out.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from porefv.mesh.facet_kernels import area_factor, facet_angles, frame_of
from porefv.mesh.laguerre import crosses_laguerre_plane, laguerre_plane_distances
from porefv.mesh.vectors import dot, minus, times, vector_at
from porefv.system.kernels import helper, kernel, unsigned_range


class CrossSections(NamedTuple):
    """The facets as cross-sections of throats.

    Attributes
    ----------
    normals : (f, 3) array
        Unit normal n, from the first cell to the second [-].
    lengths : (f,) array
        L = (P_j - P_i)·n, with P_i and P_j the Laguerre vertices of the two cells [m].
    areas : (f,) array
        A, solid and fluid [m²].
    fluid_areas : (f,) array
        A^f = A - Σ A^k [m²].
    sectors : (f, 3) array
        A^k, inside the sphere of each vertex, 0 for walls [m²].
    covered : (f,) bool array
        Whether the facet's radical centre, the point of equal power in its plane, lies inside its spheres.
    """

    normals: np.ndarray
    lengths: np.ndarray
    areas: np.ndarray
    fluid_areas: np.ndarray
    sectors: np.ndarray
    covered: np.ndarray


@kernel(error_model="numpy")
def facet_cross_sections(first, last, facets, laguerre_vertices, vertices, found):
    """Fill the `CrossSections` of the facets (`FacetTopology`); `laguerre_vertices` (m, 3) are those of the cells.

    Parameters
    ----------
    first, last : int
        Rows to treat: first ... last - 1.
    facets : FacetTopology
    laguerre_vertices : (m, 3) float64 array
        Laguerre vertex of each cell, from the local origin [m].
    vertices : Vertices
        Spheres and walls that are the vertices of the cells.
    found : CrossSections
        Arrays to fill.
    """
    for f in unsigned_range(first, last):
        _cross_section(f, facets, laguerre_vertices, vertices, found)


@helper(error_model="numpy")
def _cross_section(f, facets, laguerre_vertices, vertices, found):
    """Fill row f."""
    frame = frame_of(f, facets, vertices)
    normal = times(1.0 / frame.twice if frame.twice > 0.0 else 0.0, frame.cross)
    area = area_factor(frame, vertices) * frame.twice
    of_a, of_b, of_c = _sectors(frame, vertices)
    found.sectors[f, 0] = of_a
    found.sectors[f, 1] = of_b
    found.sectors[f, 2] = of_c
    found.areas[f] = area
    found.fluid_areas[f] = area - (of_a + of_b + of_c)
    pi = vector_at(facets.cells[f, 0], laguerre_vertices)
    pj = vector_at(facets.cells[f, 1], laguerre_vertices)
    found.lengths[f] = dot(normal, minus(pj, pi))
    gap = minus(vector_at(frame.a, vertices.points), pi)
    above = dot(gap, normal)
    radius = vertices.sizes[frame.a]
    found.covered[f] = dot(gap, gap) - radius * radius <= above * above
    for axis in range(3):
        found.normals[f, axis] = normal[axis]


@helper(error_model="numpy")
def _sectors(frame, vertices):
    """A^k of each vertex: its sector, less what lies beyond the Laguerre planes towards the other two [m²]."""
    n, _, sizes = vertices
    a, b, c, ab, ac, _, _ = frame
    at_a, at_b, at_c = facet_angles(frame, n)
    a_to_b, b_to_a = _half_segments(a, b, ab, vertices)
    a_to_c, c_to_a = _half_segments(a, c, ac, vertices)
    b_to_c = c_to_b = 0.0
    if b < n:
        b_to_c, c_to_b = _half_segments(b, c, minus(ac, ab) if c < n else ac, vertices)
    of_a = 0.5 * at_a * sizes[a] * sizes[a] - a_to_b - a_to_c
    of_b = 0.5 * at_b * sizes[b] * sizes[b] - b_to_a - b_to_c
    of_c = 0.5 * at_c * sizes[c] * sizes[c] - c_to_b - c_to_a
    return of_a, of_b, of_c


@helper(error_model="numpy")
def _half_segments(k, m, u, vertices):
    """Areas of the sectors of sphere k and vertex m beyond the Laguerre plane between them; u leads from k to m."""
    if not crosses_laguerre_plane(k, m, u, vertices):
        return 0.0, 0.0
    d, beyond = laguerre_plane_distances(k, m, u, vertices)
    of_m = _half_segment(vertices.sizes[m], beyond) if m < vertices.n_spheres else 0.0
    return _half_segment(vertices.sizes[k], d), of_m


@helper
def _half_segment(r, d):
    """Half the part of a disc of radius r beyond a chord at distance d from its centre."""
    chord = np.sqrt((r - d) * (r + d))
    return 0.5 * (r * r * np.arctan2(chord, d) - d * chord)
