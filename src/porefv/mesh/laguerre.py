"""Laguerre planes between spheres that overlap or are neighbours, and the volumes of Laguerre cells."""

from __future__ import annotations

import numpy as np

from porefv.mesh.facet_kernels import frame_of
from porefv.mesh.vectors import cross_product, dot, minus, times, towards, unit, vector_at, wall_distance
from porefv.system.kernels import helper, kernel


@helper
def crosses_laguerre_plane(k, m, u, vertices):
    """Whether sphere k reaches beyond its Laguerre plane towards vertex m, to which u leads.

    Parameters
    ----------
    k : int
        A sphere.
    m : int
        Another sphere, or a wall.
    u : tuple of three floats
        From k to m [m].
    vertices : Vertices
    """
    sizes = vertices.sizes
    if m >= vertices.n_spheres:
        return wall_distance(k, m, vertices) < sizes[k]
    return dot(u, u) < (sizes[k] + sizes[m]) * (sizes[k] + sizes[m])


@helper(error_model="numpy")
def laguerre_plane_distances(k, m, u, vertices):
    """Distances of centres k and m from the Laguerre plane between them, each within its radius [m].

    u leads from k to m. Of a wall, the second distance has no meaning.

    Parameters
    ----------
    k : int
        A sphere.
    m : int
        Another sphere, or a wall.
    u : tuple of three floats
        From k to m [m].
    vertices : Vertices
    """
    sizes = vertices.sizes
    r = sizes[k]
    if m >= vertices.n_spheres:
        return min(max(wall_distance(k, m, vertices), -r), r), 0.0
    d, beyond = laguerre_feet(u, r, sizes[m])
    return min(max(d, -r), r), min(max(beyond, -sizes[m]), sizes[m])


@helper(error_model="numpy")
def laguerre_feet(u, r, s):
    """Distances of the centres of two spheres of radii r and s, u apart, from the Laguerre plane between them."""
    square = dot(u, u)
    length = np.sqrt(square)
    d = 0.5 * (square + (r - s) * (r + s)) / length
    return d, length - d


@kernel(error_model="numpy")
def laguerre_volumes(facets, laguerre_vertices, vertices):
    """(n,): volume of the Laguerre cell of each sphere [m³].

    The face between spheres k and m is a polygon with a corner P_i for each cell around the edge km. A facet with that
    edge owns the triangle from P_i to P_j and the face's foot, d from centre k, and a pyramid d h L / 6 under it: h is
    from the foot to the line of the P's, towards the facet's own side, and all are signed.
    """
    n, points, sizes = vertices
    volumes = np.zeros(n)
    for f in range(facets.cells.shape[0]):
        a, b, c, _, _, cross, twice = frame_of(f, facets, vertices)
        if twice == 0.0:
            continue
        pi = vector_at(facets.cells[f, 0], laguerre_vertices)
        length = dot(cross, minus(vector_at(facets.cells[f, 1], laguerre_vertices), pi)) / twice
        for side in range(3):
            k = a if side != 1 else b
            m = b if side == 0 else c
            if k >= n:
                continue
            # Along the edge from k to m, in the facet's cyclic sense and unit.
            u = towards(k, m, vertices)
            edge = unit(u)
            inward = cross_product(cross, edge if side != 2 else times(-1.0, edge))
            h = dot(inward, minus(pi, vector_at(k, points))) / twice
            if m >= n:
                volumes[k] += wall_distance(k, m, vertices) * h * length / 6.0
                continue
            d, beyond = laguerre_feet(u, sizes[k], sizes[m])
            volumes[k] += d * h * length / 6.0
            volumes[m] += beyond * h * length / 6.0
    return volumes
