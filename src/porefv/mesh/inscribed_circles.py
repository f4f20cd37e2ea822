"""Kernels of the circles inscribed in facets: tangent to their spheres and no-slip walls, and how much lies within."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from porefv.mesh.vectors import cross_product, dot, minus, plus, times, towards, unit, vector_at, wall_distance
from porefv.system.kernels import helper, kernel, unsigned_range


class Circles(NamedTuple):
    """A circle in the plane of each facet.

    Attributes
    ----------
    radii : (f,) array
        0 where there is no circle [m].
    centres : (f, 3) array
        From the local origin [m].
    """

    radii: np.ndarray
    centres: np.ndarray


@kernel
def inscribed_circles(first, last, facet_vertices, vertices, slip, radii, centres):
    """Fill radii and centres of the circle in each facet's plane tangent to its spheres and no-slip walls (`Circles`).

    On walls with slip, (6,) bool, a circle is centred. With the first sphere's centre as origin and x = X₀ + ρ X₁ that
    of the circle, its tangency to the other two is linear in ρ and to the first quadratic.

    Parameters
    ----------
    first, last : int
        Rows to treat: first ... last - 1.
    facet_vertices : (f, 3) int32 array
        Vertices of each facet, spheres first.
    vertices : Vertices
    slip : (6,) bool array
        Walls of symmetry.
    radii : (f,) float64 array
        To fill; 0 where there is no circle [m].
    centres : (f, 3) float64 array
        To fill, from the local origin [m].
    """
    n, points, sizes = vertices
    for f in unsigned_range(first, last):
        a = facet_vertices[f, 0]
        rows = np.empty((2, 2))
        constant = np.empty(2)
        slope = np.empty(2)
        e1, e2 = _axes(f, facet_vertices, vertices)
        for i in range(2):
            m = facet_vertices[f, i + 1]
            w = towards(a, m, vertices)
            rows[i, 0] = dot(w, e1)
            rows[i, 1] = dot(w, e2)
            if m < n:
                constant[i] = 0.5 * (dot(w, w) + (sizes[a] - sizes[m]) * (sizes[a] + sizes[m]))
                slope[i] = sizes[a] - sizes[m]
            else:
                constant[i] = wall_distance(a, m, vertices)
                slope[i] = 0.0 if slip[m - n] else -1.0
        radii[f] = 0.0
        det = rows[0, 0] * rows[1, 1] - rows[0, 1] * rows[1, 0]
        if det == 0.0:
            continue
        x0 = (constant[0] * rows[1, 1] - constant[1] * rows[0, 1]) / det
        y0 = (constant[1] * rows[0, 0] - constant[0] * rows[1, 0]) / det
        x1 = (slope[0] * rows[1, 1] - slope[1] * rows[0, 1]) / det
        y1 = (slope[1] * rows[0, 0] - slope[0] * rows[1, 0]) / det
        # |X₀ + ρ X₁| = r + ρ, as A ρ² + 2 B ρ + C = 0
        r = sizes[a]
        qa = x1 * x1 + y1 * y1 - 1.0
        qb = x0 * x1 + y0 * y1 - r
        qc = x0 * x0 + y0 * y0 - r * r
        discriminant = qb * qb - qa * qc
        if qc > 0.0 and discriminant >= 0.0:
            below = np.sqrt(discriminant) - qb
            if below > 0.0:
                rho = qc / below
                radii[f] = rho
                for axis in range(3):
                    centres[f, axis] = points[a, axis] + (x0 + rho * x1) * e1[axis] + (y0 + rho * y1) * e2[axis]


@kernel
def circle_portions(first, last, facet_vertices, vertices, circles, portions):
    """Fill `portions` (f,) with the part of each circle's area that lies within the facet; 0 for a radius of zero.

    Parameters
    ----------
    first, last : int
        Rows to treat: first ... last - 1.
    facet_vertices : (f, 3) int32 array
        Vertices of each facet, spheres first.
    vertices : Vertices
    circles : Circles
    portions : (f,) float64 array
        To fill.
    """
    n = vertices.n_spheres
    radii = circles.radii
    for f in unsigned_range(first, last):
        portions[f] = 0.0
        if radii[f] <= 0.0:
            continue
        a = facet_vertices[f, 0]
        b = facet_vertices[f, 1]
        c = facet_vertices[f, 2]
        e1, e2 = _axes(f, facet_vertices, vertices)
        out = minus(vector_at(a, vertices.points), vector_at(f, circles.centres))
        # From the circle's centre to the facet's corners, in radii.
        corners = np.zeros((4, 2))
        sides = 3 if c < n else 4
        for i in range(sides):
            corner = out
            if i == 1 or (i == 2 and c >= n):
                step = 1.0 if b < n else wall_distance(a, b, vertices)
                corner = plus(corner, times(step, towards(a, b, vertices)))
            if i == 2 and c >= n:
                height = wall_distance(b if b < n else a, c, vertices)
                corner = plus(corner, times(height, vector_at(c, vertices.points)))
            elif i == 2:
                corner = plus(corner, towards(a, c, vertices))
            elif i == 3:
                corner = plus(corner, times(wall_distance(a, c, vertices), vector_at(c, vertices.points)))
            corners[i, 0] = dot(corner, e1) / radii[f]
            corners[i, 1] = dot(corner, e2) / radii[f]
        area = 0.0
        apart = 0  # edges beyond the circle, all of them to the left
        for i in range(sides):
            j = (i + 1) % sides
            u = corners[j, 0] - corners[i, 0]
            v = corners[j, 1] - corners[i, 1]
            if corners[i, 0] * v - corners[i, 1] * u >= np.sqrt(u * u + v * v) > 0.0:
                apart += 1
        if apart == sides:
            portions[f] = 1.0
            continue
        for i in range(sides):
            area += _within_circle(corners[i], corners[(i + 1) % sides])
        portions[f] = abs(area) / np.pi


@helper
def _axes(f, facet_vertices, vertices):
    """Two unit vectors in a facet's plane, at right angles in its sense."""
    a = facet_vertices[f, 0]
    u = towards(a, facet_vertices[f, 1], vertices)
    normal = cross_product(u, towards(a, facet_vertices[f, 2], vertices))
    return unit(u), unit(cross_product(normal, u))


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
