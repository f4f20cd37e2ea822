"""Kernels of the circles inscribed in facets: tangent to their spheres and no-slip walls, and how much lies within."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from porefv.mesh.vectors import cross_product, dot, minus, plus, times, towards, unit, vector_at, wall_distance
from porefv.system.kernels import helper, kernel, unsigned_range


class Circles(NamedTuple):
    """A circle in the plane of each triple of vertices.

    Attributes
    ----------
    radii : (k,) array
        0 where there is no circle [m].
    centres : (k, 3) array
        From the local origin [m].
    """

    radii: np.ndarray
    centres: np.ndarray


class TiedCircles(NamedTuple):
    """The circles of throats that have several facets.

    Attributes
    ----------
    throats : (k,) int array
        The throats, in their order.
    radii, centres : (k,), (k, 3) arrays
        As of `Circles`.
    """

    throats: np.ndarray
    radii: np.ndarray
    centres: np.ndarray


@kernel
def inscribed_circles(first, last, corners, vertices, slip, circles):
    """Fill in the circles in the planes of triples of vertices, first ... last - 1.

    Parameters
    ----------
    first, last : int
        Rows to treat: first ... last - 1.
    corners : (k, 3) int32 array
        Vertices of each triple, a sphere first.
    vertices : Vertices
    slip : (6,) bool array
        Walls of symmetry.
    circles : Circles
        To be filled in.
    """
    for i in unsigned_range(first, last):
        radius, centre = _inscribed_circle(
            _plane(corners[i, 0], corners[i, 1], corners[i, 2], vertices), vertices, slip
        )
        circles.radii[i] = radius
        for axis in range(3):
            circles.centres[i, axis] = centre[axis]


@kernel
def circles_of_throats(first, last, throats, facet_vertices, vertices, slip, tied, radii, portions):
    """Fill in radius (t,) and portion (t,) of the inscribed circles of throats first ... last - 1.

    The portion is the part of a circle's area that lies within the throat's facets; 0 for a radius of zero.

    Parameters
    ----------
    first, last : int
        Throats to treat: first ... last - 1.
    throats : ThroatFacets
    facet_vertices : (f, 3) int32 array
        Vertices of each facet, spheres first.
    vertices : Vertices
    slip : (6,) bool array
        Walls of symmetry.
    tied : TiedCircles
    radii, portions : (t,) arrays
        To be filled in [m, -].
    """
    starts = throats.starts
    place = 0  # of the next throat among those that are tied
    while place < tied.throats.shape[0] and tied.throats[place] < first:
        place += 1
    for t in range(first, last):
        count = starts[t + 1] - starts[t]
        f = throats.facets[starts[t]]
        plane = _plane(facet_vertices[f, 0], facet_vertices[f, 1], facet_vertices[f, 2], vertices)
        if count == 1:
            radius, centre = _inscribed_circle(plane, vertices, slip)
        else:
            radius, centre = tied.radii[place], vector_at(place, tied.centres)
            place += 1
        radii[t] = radius
        portions[t] = 0.0
        if radius > 0.0:
            portions[t] = _portion(plane, radius, centre, vertices)
            for j in range(starts[t] + 1, starts[t + 1]):
                g = throats.facets[j]
                plane = _plane(facet_vertices[g, 0], facet_vertices[g, 1], facet_vertices[g, 2], vertices)
                portions[t] += _portion(plane, radius, centre, vertices)


class Plane(NamedTuple):
    """Three vertices and their plane, as seen from the first, which is a sphere.

    Attributes
    ----------
    a, b, c : int
        Vertices.
    ab, ac : vectors
        From the centre of a to b and c; to a wall, its outward unit normal [m, -].
    e1, e2 : vectors
        Two unit vectors in the plane, at right angles in its sense [-].
    """

    a: int
    b: int
    c: int
    ab: tuple[float, float, float]
    ac: tuple[float, float, float]
    e1: tuple[float, float, float]
    e2: tuple[float, float, float]


@helper
def _plane(a, b, c, vertices):
    ab = towards(a, b, vertices)
    ac = towards(a, c, vertices)
    return Plane(a, b, c, ab, ac, unit(ab), unit(cross_product(cross_product(ab, ac), ab)))


@helper
def _inscribed_circle(plane, vertices, slip):
    """Radius and centre of the circle in a plane tangent to its three vertices; a radius of 0 where there is none [m].

    On walls with slip, (6,) bool, a circle is centred. With the first sphere's centre as origin and x = X₀ + ρ X₁ that
    of the circle, its tangency to the other two is linear in ρ and to the first quadratic.
    """
    r = vertices.sizes[plane.a]
    origin = vector_at(plane.a, vertices.points)
    b_constant, b_slope = _tangency(plane.a, plane.b, plane.ab, vertices, slip)
    c_constant, c_slope = _tangency(plane.a, plane.c, plane.ac, vertices, slip)
    bx, by = dot(plane.ab, plane.e1), dot(plane.ab, plane.e2)
    cx, cy = dot(plane.ac, plane.e1), dot(plane.ac, plane.e2)
    det = bx * cy - by * cx
    if det == 0.0:
        return 0.0, origin
    x0 = (b_constant * cy - c_constant * by) / det
    y0 = (c_constant * bx - b_constant * cx) / det
    x1 = (b_slope * cy - c_slope * by) / det
    y1 = (c_slope * bx - b_slope * cx) / det
    # |X₀ + ρ X₁| = r + ρ, as A ρ² + 2 B ρ + C = 0
    qa = x1 * x1 + y1 * y1 - 1.0
    qb = x0 * x1 + y0 * y1 - r
    qc = x0 * x0 + y0 * y0 - r * r
    discriminant = qb * qb - qa * qc
    if not (qc > 0.0 and discriminant >= 0.0):
        return 0.0, origin
    below = np.sqrt(discriminant) - qb
    if not below > 0.0:
        return 0.0, origin
    radius = qc / below
    return radius, plus(origin, plus(times(x0 + radius * x1, plane.e1), times(y0 + radius * y1, plane.e2)))


@helper
def _tangency(a, m, towards_m, vertices, slip):
    """Constant and slope in ρ of (x - x_a)·(x_m - x_a), for a circle that is tangent to spheres a and m."""
    n, sizes = vertices.n_spheres, vertices.sizes
    if m >= n:
        return wall_distance(a, m, vertices), 0.0 if slip[m - n] else -1.0
    difference = sizes[a] - sizes[m]
    return 0.5 * (dot(towards_m, towards_m) + difference * (sizes[a] + sizes[m])), difference


@helper
def _portion(plane, radius, centre, vertices):
    """Part of a circle's area that lies within a facet."""
    a, b, c, ab, ac, _, _ = plane
    n = vertices.n_spheres
    # From the circle's centre to the facet's corners, in radii: three, or four on walls.
    at_a = minus(vector_at(a, vertices.points), centre)
    at_b = plus(at_a, times(1.0 if b < n else wall_distance(a, b, vertices), ab))
    p = _in_plane(at_a, plane, radius)
    q = _in_plane(at_b, plane, radius)
    if c < n:
        s = _in_plane(plus(at_a, ac), plane, radius)
        if _beyond(p, q) and _beyond(q, s) and _beyond(s, p):
            return 1.0
        return abs(_within_circle(p, q) + _within_circle(q, s) + _within_circle(s, p)) / np.pi
    s = _in_plane(plus(at_b, times(wall_distance(b if b < n else a, c, vertices), ac)), plane, radius)
    u = _in_plane(plus(at_a, times(wall_distance(a, c, vertices), ac)), plane, radius)
    if _beyond(p, q) and _beyond(q, s) and _beyond(s, u) and _beyond(u, p):
        return 1.0
    return abs(_within_circle(p, q) + _within_circle(q, s) + _within_circle(s, u) + _within_circle(u, p)) / np.pi


@helper
def _in_plane(corner, plane, radius):
    return dot(corner, plane.e1) / radius, dot(corner, plane.e2) / radius


@helper
def _beyond(p, q):
    """Whether an edge lies beyond the unit circle, to the left."""
    u = q[0] - p[0]
    v = q[1] - p[1]
    return p[0] * v - p[1] * u >= np.sqrt(u * u + v * v) > 0.0


@helper
def _within_circle(p, q):
    """Area that the triangle from the origin to p and q has in common with the unit circle, signed as the triangle."""
    u = q[0] - p[0]
    v = q[1] - p[1]
    square = u * u + v * v
    along = p[0] * u + p[1] * v
    across = p[0] * v - p[1] * u
    discriminant = square - across * across  # without the cancellation of |p|² in a circle far smaller than the facet
    if square == 0.0 or discriminant <= 0.0:
        return _sector(p[0], p[1], q[0], q[1])
    root = np.sqrt(discriminant)
    enters = (-along - root) / square
    leaves = (root - along) / square
    if enters >= 1.0 or leaves <= 0.0:
        return _sector(p[0], p[1], q[0], q[1])
    s = max(enters, 0.0)
    t = min(leaves, 1.0)
    area = 0.5 * (t - s) * across
    if enters > 0.0:
        area += _sector(p[0], p[1], p[0] + s * u, p[1] + s * v)
    if leaves < 1.0:
        area += _sector(p[0] + t * u, p[1] + t * v, q[0], q[1])
    return area


@helper
def _sector(px, py, qx, qy):
    """Area of the unit circle's sector from the direction of p to that of q, signed."""
    return 0.5 * np.arctan2(px * qy - py * qx, px * qx + py * qy)
