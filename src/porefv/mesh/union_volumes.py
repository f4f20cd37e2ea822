"""Kernel of the solid in facets where three spheres, or spheres and walls, share points: exact for any overlap.

The Laguerre cell of sphere k is a signed sum of orthoschemes, tetrahedra with right angles

    centre c_k,  foot F_1 on a face,  foot F_2 on an edge of that face,  vertex P,

an edge being where the cell meets two others: it is dual to a facet of the triangulation, and leads from the Laguerre
vertex P_i of the facet's first cell to P_j of its second. A ball within an orthoscheme at its centre has a closed form.
The ball of sphere k counts within its own Laguerre cell only, so that the sum over all orthoschemes is the volume of
the union of the balls, as far as the walls. Edelsbrunner (1995) has the sum over simplices in place of cells. Single
terms are signed.
"""

from __future__ import annotations

import numpy as np

from porefv.mesh.facet_kernels import area_factor, frame_of
from porefv.mesh.laguerre import laguerre_feet
from porefv.mesh.vectors import cross_product, dot, minus, times, vector_at, wall_distance
from porefv.packing.orthoschemes import ball_in_orthoscheme
from porefv.system.kernels import helper, kernel, unsigned_range


@kernel(error_model="numpy")
def union_volumes(first, last, facets, laguerre_vertices, vertices, volumes, surfaces, solids, solid_surfaces):
    """As `porefv.mesh.facet_volumes.facet_volumes`, for any overlap, and the solid on both sides of each facet.

    Parameters
    ----------
    first, last : int
        Rows to treat: first ... last - 1.
    facets : FacetTopology
    laguerre_vertices : (m, 3) array
        Laguerre vertex of each cell [m].
    vertices : Vertices
    volumes, surfaces : (f,), (f, 3) arrays
        Void volume φ of each facet and solid surface γ^k of each of its vertices, to be filled [m³, m²].
    solids : (f, 2) array
        Solid between the facet and the Laguerre vertex of its first, and of its second cell, to be filled [m³].
    solid_surfaces : (f, 2) array
        Surface of spheres there, to be filled [m²].
    """
    for f in unsigned_range(first, last):
        n, points, _ = vertices
        frame = frame_of(f, facets, vertices)
        a, b, c, ab, ac, cross, twice = frame
        pi = minus(vector_at(facets.cells[f, 0], laguerre_vertices), vector_at(a, points))
        pj = minus(vector_at(facets.cells[f, 1], laguerre_vertices), vector_at(a, points))
        up = 1.0 / twice if twice > 0.0 else 0.0
        low, high = dot(cross, pi) * up, dot(cross, pj) * up
        before = after = surface_before = surface_after = 0.0
        for v in range(3):
            surfaces[f, v] = 0.0
        # Edges in the facet's cyclic sense. Each has an orthoscheme on both sides, at the spheres that it joins.
        for e in range(3):
            if e == 0:
                k, m, edge, from_k = a, b, ab, pi
            elif e == 1:
                k, m, edge = b, c, minus(ac, ab) if c < n else ac
                from_k = minus(pi, ab)
            else:
                # From c back to a; seen from a, which is a sphere.
                k, m, edge, from_k = a, c, times(-1.0, ac), pi
            if k >= n:
                continue
            inward = times(1.0 / np.sqrt(dot(edge, edge)), cross_product(cross, edge))
            across = dot(inward, from_k) * up
            u = edge if e < 2 else ac
            of_k = e if e < 2 else 0
            of_m = (e + 1) if e < 2 else 2
            if m >= n:
                d = wall_distance(k, m, vertices)
                beyond = 0.0
            else:
                d, beyond = laguerre_feet(u, vertices.sizes[k], vertices.sizes[m])
            lower, upper, surface_i, surface_j, face = _between(vertices.sizes[k], d, across, low, high)
            before += lower
            after += upper
            surface_before += surface_i
            surface_after += surface_j
            surfaces[f, of_k] += surface_j - surface_i
            if m < n:
                lower, upper, surface_i, surface_j, _ = _between(vertices.sizes[m], beyond, across, low, high)
                before += lower
                after += upper
                surface_before += surface_i
                surface_after += surface_j
                surfaces[f, of_m] += surface_j - surface_i
            else:
                # The wall's own face, a triangle between F_1 and the vertices, less what the ball covers of it.
                surfaces[f, of_m] += 0.5 * across * (high - low) - face
        solids[f, 0], solids[f, 1] = -before, after
        solid_surfaces[f, 0], solid_surfaces[f, 1] = -surface_before, surface_after
        volumes[f] = area_factor(frame, vertices) * twice * (high - low) / 3.0 - (after - before)


@helper
def _between(r, d1, d2, low, high):
    """What a ball has in the two orthoschemes of an edge of a facet, signed.

    Parameters
    ----------
    r : float
        Radius of the ball [m].
    d1, d2 : float
        From its centre to F_1, and on to F_2 [m].
    low, high : float
        From F_2 to P_i and P_j, along the facet's normal [m].

    Returns
    -------
    float, float
        Volume in that of P_i, and in that of P_j [m³].
    float, float
        Surface in that of P_i, and in that of P_j [m²].
    float
        Area in the face at F_1 in that of P_j less that of P_i [m²].
    """
    sense = -1.0 if (d1 < 0.0) != (d2 < 0.0) else 1.0
    volume_i, surface_i, face_i = ball_in_orthoscheme(r, abs(d1), abs(d2), abs(low))
    volume_j, surface_j, face_j = ball_in_orthoscheme(r, abs(d1), abs(d2), abs(high))
    at_i = -sense if low < 0.0 else sense
    at_j = -sense if high < 0.0 else sense
    return (
        at_i * volume_i,
        at_j * volume_j,
        at_i * surface_i,
        at_j * surface_j,
        at_j * face_j - at_i * face_i,
    )
