"""Kernels of the facets: their vertices, angles, areas and centroids.

A facet is a triangle (three spheres), a trapezoid (two spheres swept to a wall) or a rectangle (one sphere swept to two
walls). Its vertices are stored spheres first, in cyclic order, such that the normal (b - a) × (c - a), a wall standing
for its outward direction, points from the first cell to the second.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from porefv.mesh.vectors import cross_product, dot, minus, plus, times, towards, vector_at, wall_distance
from porefv.system.kernels import helper, kernel, unsigned_range


class FacetTopology(NamedTuple):
    """Which cells and vertices each facet has.

    Attributes
    ----------
    cells : (f, 2) int32 array
        The two cells of each facet; its normal points from the first to the second.
    vertices : (f, 3) int32 array
        Vertices of each facet, spheres first, right-handed about its normal.
    """

    cells: np.ndarray
    vertices: np.ndarray

    @classmethod
    def of(cls, count: int) -> FacetTopology:
        """Arrays for so many facets, to be filled in."""
        return cls(np.empty((count, 2), np.int32), np.empty((count, 3), np.int32))


class FacetPlanes(NamedTuple):
    """`FacetTopology` and the plane of each facet.

    Attributes
    ----------
    cells, vertices : (f, 2), (f, 3) int32 arrays
        As of `FacetTopology`.
    normals : (f, 3) array
        Unit normal of each facet [-].
    """

    cells: np.ndarray
    vertices: np.ndarray
    normals: np.ndarray


class Frame(NamedTuple):
    """One facet, as seen from its first vertex, which is a sphere.

    Attributes
    ----------
    a, b, c : int
        Vertices.
    ab, ac : vectors
        From the centre of a to b and c; to a wall, its outward unit normal [m, -].
    cross : vector
        ab × ac, along the facet's normal.
    twice : float
        |ab × ac|: twice the area of a triangle.
    """

    a: int
    b: int
    c: int
    ab: tuple[float, float, float]
    ac: tuple[float, float, float]
    cross: tuple[float, float, float]
    twice: float


@helper
def spheres_first(a, b, c, n):
    """The three vertices turned, in cyclic order, until the spheres, which are below n, come first.

    Parameters
    ----------
    a, b, c : int
        Vertices of a facet.
    n : int
        Number of spheres; the vertex of wall w is n + w.
    """
    while a >= n or (b >= n and c < n):
        a, b, c = b, c, a
    return a, b, c


@kernel
def enumerate_facets(cells, neighbours, n, facets):
    """Fill the `FacetTopology` with the facets between cells t < u, in the order of t; n is the number of spheres.

    Parameters
    ----------
    cells, neighbours : (m, 4) int32 arrays
        Vertices of each cell, and the cell across the facet opposite to each of them, -1 where there is none.
    n : int
        Number of spheres.
    facets : FacetTopology
        Arrays to fill.
    """
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
            facets.cells[f, 0] = t
            facets.cells[f, 1] = neighbours[t, i]
            facets.vertices[f, 0] = a
            facets.vertices[f, 1] = b
            facets.vertices[f, 2] = c
            f += 1


@helper
def facet_frame(a, b, c, vertices):
    """`Frame` of the facet with these vertices, spheres first.

    Parameters
    ----------
    a, b, c : int
        Vertices of the facet, spheres first.
    vertices : Vertices
    """
    ab = towards(a, b, vertices)
    ac = towards(a, c, vertices)
    cross = cross_product(ab, ac)
    return Frame(a, b, c, ab, ac, cross, np.sqrt(dot(cross, cross)))


@helper
def frame_of(f, facets, vertices):
    """`Frame` of facet f."""
    return facet_frame(facets.vertices[f, 0], facets.vertices[f, 1], facets.vertices[f, 2], vertices)


@helper
def area_factor(frame, vertices):
    """Area of a facet over |ab × ac|: of a triangle ½ [-], of a trapezoid its mean height, of a rectangle its area."""
    a, b, c = frame.a, frame.b, frame.c
    if c < vertices.n_spheres:
        return 0.5
    if b < vertices.n_spheres:
        return 0.5 * (wall_distance(a, c, vertices) + wall_distance(b, c, vertices))
    return wall_distance(a, b, vertices) * wall_distance(a, c, vertices)


@helper
def area_vector(a, b, c, vertices):
    """Area vector of a facet: triangle, trapezoid or rectangle [m²].

    Parameters
    ----------
    a, b, c : int
        Vertices of the facet, spheres first.
    vertices : Vertices
    """
    frame = facet_frame(a, b, c, vertices)
    return times(area_factor(frame, vertices), frame.cross)


@helper
def facet_angles(frame, n):
    """Angles of a facet at its three vertices, 0 at walls, which are from n on."""
    if frame.b >= n:
        return 0.5 * np.pi, 0.0, 0.0
    at_a = np.arctan2(frame.twice, dot(frame.ab, frame.ac))
    if frame.c >= n:
        return at_a, np.pi - at_a, 0.0
    at_b = np.arctan2(frame.twice, dot(minus(frame.ab, frame.ac), frame.ab))
    return at_a, at_b, np.pi - at_a - at_b


@kernel
def centroid(a, b, c, vertices):
    """Centroid of a facet, from the local origin [m].

    Parameters
    ----------
    a, b, c : int
        Vertices of the facet, spheres first.
    vertices : Vertices
    """
    if c < vertices.n_spheres:
        s, t = 1.0 / 3.0, 1.0 / 3.0
    elif b < vertices.n_spheres:  # a trapezoid over the edge ab, its sides ha and hb
        ha = wall_distance(a, c, vertices)
        hb = wall_distance(b, c, vertices)
        s = (ha + 2.0 * hb) / (3.0 * (ha + hb))
        t = (ha * ha + ha * hb + hb * hb) / (3.0 * (ha + hb))
    else:
        s = 0.5 * wall_distance(a, b, vertices)
        t = 0.5 * wall_distance(a, c, vertices)
    along = plus(vector_at(a, vertices.points), times(s, towards(a, b, vertices)))
    return plus(along, times(t, towards(a, c, vertices)))


@kernel
def facet_centroids(facet_vertices, vertices):
    """(f, 3): centroid of each facet [m]."""
    centres = np.empty((facet_vertices.shape[0], 3))
    for f in range(facet_vertices.shape[0]):
        x = centroid(facet_vertices[f, 0], facet_vertices[f, 1], facet_vertices[f, 2], vertices)
        for axis in range(3):
            centres[f, axis] = x[axis]
    return centres


@kernel
def sector_angles(first, last, facet_vertices, sectors, vertices, angles):
    """Fill in 2 Σ A^k / r² of facets first ... last - 1: the angles of their sectors, less what overlaps leave out.

    Parameters
    ----------
    first, last : int
        Rows to treat: first ... last - 1.
    facet_vertices : (f, 3) int32 array
    sectors : (f, 3) array
        A^k, inside the sphere of each vertex, 0 for walls [m²].
    vertices : Vertices
    angles : (f,) array
        To be filled in [-].
    """
    for f in unsigned_range(first, last):
        total = 0.0
        for v in range(3):
            k = facet_vertices[f, v]
            if k < vertices.n_spheres:
                total += sectors[f, v] / (vertices.sizes[k] * vertices.sizes[k])
        angles[f] = 2.0 * total


@kernel
def row_sums(values):
    """(f,): sum of the three values of each row."""
    sums = np.empty(values.shape[0])
    for f in range(values.shape[0]):
        sums[f] = values[f, 0] + values[f, 1] + values[f, 2]
    return sums
