"""Kernels of the facets: their vertices, corners, angles, area vectors and centroids.

A facet is a triangle (three spheres), a trapezoid (two spheres swept to a wall) or a rectangle (one sphere swept to two
walls). Its vertices are stored spheres first, in cyclic order, such that the normal (b - a) × (c - a), a wall standing
for its outward direction, points from the first cell to the second.
"""

from __future__ import annotations

import numpy as np

from porefv.mesh.vectors import cross_product, dot, minus, towards, wall_distance
from porefv.system.kernels import njit, prange


@njit(cache=True)
def spheres_first(a, b, c, n):
    """The three vertices turned, in cyclic order, until the spheres come first."""
    while a >= n or (b >= n and c < n):
        a, b, c = b, c, a
    return a, b, c


@njit(cache=True)
def enumerate_facets(cells, neighbours, n, facet_cells, vertices):
    """Facets between cells t < u, their cells (f, 2) and vertices (f, 3), in the order of t; returns f."""
    f = 0
    for t in range(cells.shape[0]):
        for i in range(4):
            if neighbours[t, i] <= t:
                continue
            # (a, b, c, i) an even permutation of (0, 1, 2, 3): the normal then points out of t.
            if i == 0:
                a, b, c = cells[t, 1], cells[t, 3], cells[t, 2]
            elif i == 1:
                a, b, c = cells[t, 0], cells[t, 2], cells[t, 3]
            elif i == 2:
                a, b, c = cells[t, 0], cells[t, 3], cells[t, 1]
            else:
                a, b, c = cells[t, 0], cells[t, 1], cells[t, 2]
            a, b, c = spheres_first(a, b, c, n)
            facet_cells[f, 0] = t
            facet_cells[f, 1] = neighbours[t, i]
            vertices[f, 0] = a
            vertices[f, 1] = b
            vertices[f, 2] = c
            f += 1
    return f


@njit(cache=True)
def area_vector(a, b, c, n, points, sizes):
    """Area vector of a facet: triangle, trapezoid or rectangle."""
    s = cross_product(towards(a, b, n, points), towards(a, c, n, points))
    if c < n:
        factor = 0.5
    elif b < n:
        factor = 0.5 * (wall_distance(a, c, points, sizes) + wall_distance(b, c, points, sizes))
    else:
        factor = wall_distance(a, b, points, sizes) * wall_distance(a, c, points, sizes)
    return factor * s[0], factor * s[1], factor * s[2]


@njit(cache=True)
def centroid(a, b, c, n, points, sizes):
    """Centroid of a facet."""
    u = towards(a, b, n, points)
    w = towards(a, c, n, points)
    if c < n:
        s, t = 1.0 / 3.0, 1.0 / 3.0
    elif b < n:  # a trapezoid over the edge ab, its sides ha and hb
        ha = wall_distance(a, c, points, sizes)
        hb = wall_distance(b, c, points, sizes)
        s = (ha + 2.0 * hb) / (3.0 * (ha + hb))
        t = (ha * ha + ha * hb + hb * hb) / (3.0 * (ha + hb))
    else:
        s = 0.5 * wall_distance(a, b, points, sizes)
        t = 0.5 * wall_distance(a, c, points, sizes)
    return (
        points[a, 0] + s * u[0] + t * w[0],
        points[a, 1] + s * u[1] + t * w[1],
        points[a, 2] + s * u[2] + t * w[2],
    )


@njit(cache=True)
def facet_corners(f, facet_vertices, n, points):
    """Vertices a, b, c of facet f, the vectors from a to b and to c, their cross product and its length.

    The product has the facet's sense, and belongs to the angles at all three vertices.
    """
    a = facet_vertices[f, 0]
    b = facet_vertices[f, 1]
    c = facet_vertices[f, 2]
    ab = towards(a, b, n, points)
    ac = towards(a, c, n, points)
    cross = cross_product(ab, ac)
    return a, b, c, ab, ac, cross, np.sqrt(dot(cross, cross))


@njit(cache=True)
def facet_angles(b, c, n, ab, ac, twice):
    """Angles of a facet at its vertices, 0 at walls: b, c its second and third, the rest as of `facet_corners`."""
    if b >= n:
        return 0.5 * np.pi, 0.0, 0.0
    at_a = np.arctan2(twice, dot(ab, ac))
    if c >= n:
        return at_a, np.pi - at_a, 0.0
    at_b = np.arctan2(twice, dot(minus(ab, ac), ab))
    return at_a, at_b, np.pi - at_a - at_b


@njit(cache=True)
def facet_centroids(facet_vertices, n, points, sizes):
    """(f, 3): centroid of each facet."""
    centres = np.empty((facet_vertices.shape[0], 3))
    for f in range(facet_vertices.shape[0]):
        x = centroid(facet_vertices[f, 0], facet_vertices[f, 1], facet_vertices[f, 2], n, points, sizes)
        for axis in range(3):
            centres[f, axis] = x[axis]
    return centres


@njit(cache=True, parallel=True)
def row_sums(values):
    """(f,): sum of the three values of each row."""
    sums = np.empty(values.shape[0])
    for f in prange(values.shape[0]):
        sums[f] = values[f, 0] + values[f, 1] + values[f, 2]
    return sums
