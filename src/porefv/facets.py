"""Kernels of the facets: areas, sectors, throat volumes and solid surfaces (C12 §2.2.2), overlaps included.

A facet is a triangle (three spheres), a trapezoid (two spheres swept to a wall) or a rectangle (one sphere swept to
two walls); its vertices are stored spheres first, in cyclic order, such that the normal
(b - a) × (c - a), a wall standing for its outward direction, points from the first cell to the second.

Each sphere owns its ball as far as the Laguerre plane towards each neighbour (or wall). Where balls overlap or cross a
wall, the cap beyond that plane is left out of volumes, surfaces and sectors: around an edge the caps of its
facets add up to the whole cap, so sums stay exact for any overlap of pairs.
"""

from __future__ import annotations

import numpy as np
from numba import njit, prange

from porefv.union_find import join

_NEXT = (1, 2, 0)
_LAST = (2, 0, 1)


@njit(cache=True)
def spheres_first(a, b, c, n):
    """The three vertices turned, in cyclic order, until the spheres come first."""
    while a >= n or (b >= n and c < n):
        a, b, c = b, c, a
    return a, b, c


@njit(cache=True)
def enumerate_facets(cells, neighbours, n):
    """Facets between cells t < u as (cells (f, 2), vertices (f, 3)), in the order of t."""
    count = 0
    for t in range(cells.shape[0]):
        for i in range(4):
            if neighbours[t, i] > t:
                count += 1
    facet_cells = np.empty((count, 2), np.int32)
    vertices = np.empty((count, 3), np.int32)
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
    return facet_cells, vertices


@njit(cache=True)
def unite(facet_cells, facet_vertices, vertices, n, sizes, tolerance):
    """Label of each cell, equal across facets whose Laguerre vertices are within `tolerance` of the smallest radius.

    Labels follow the order of the cells.
    """
    parent = np.arange(vertices.shape[0], dtype=np.int32)
    for f in range(facet_cells.shape[0]):
        i = facet_cells[f, 0]
        j = facet_cells[f, 1]
        square = 0.0
        for axis in range(3):
            square += (vertices[i, axis] - vertices[j, axis]) ** 2
        radius = np.inf
        for v in range(3):
            if facet_vertices[f, v] < n:
                radius = min(radius, sizes[facet_vertices[f, v]])
        if square <= (tolerance * radius) ** 2:
            join(parent, i, j)
    count = 0
    for t in range(parent.shape[0]):  # a root comes before all that hang on it
        if parent[t] == t:
            parent[t] = count
            count += 1
        else:
            parent[t] = parent[parent[t]]
    return parent


@njit(cache=True)
def _cross(a, b):
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


@njit(cache=True)
def _dot(a, b):
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


@njit(cache=True)
def _towards(k, m, n, points):
    """From sphere k to vertex m: the vector between centres, or the outward direction of a wall."""
    if m < n:
        return points[m, 0] - points[k, 0], points[m, 1] - points[k, 1], points[m, 2] - points[k, 2]
    return points[m, 0], points[m, 1], points[m, 2]


@njit(cache=True)
def _height(k, wall, points, sizes):
    """Distance from the centre of sphere k to a wall."""
    return sizes[wall] - (
        points[wall, 0] * points[k, 0] + points[wall, 1] * points[k, 1] + points[wall, 2] * points[k, 2]
    )


@njit(cache=True)
def area_vector(a, b, c, n, points, sizes):
    """Area vector of a facet: triangle, trapezoid or rectangle."""
    s = _cross(_towards(a, b, n, points), _towards(a, c, n, points))
    if c < n:
        factor = 0.5
    elif b < n:
        factor = 0.5 * (_height(a, c, points, sizes) + _height(b, c, points, sizes))
    else:
        factor = _height(a, b, points, sizes) * _height(a, c, points, sizes)
    return factor * s[0], factor * s[1], factor * s[2]


@njit(cache=True)
def centroid(a, b, c, n, points, sizes):
    """Centroid of a facet."""
    u = _towards(a, b, n, points)
    w = _towards(a, c, n, points)
    if c < n:
        s, t = 1.0 / 3.0, 1.0 / 3.0
    elif b < n:  # a trapezoid over the edge ab, its sides ha and hb
        ha = _height(a, c, points, sizes)
        hb = _height(b, c, points, sizes)
        s = (ha + 2.0 * hb) / (3.0 * (ha + hb))
        t = (ha * ha + ha * hb + hb * hb) / (3.0 * (ha + hb))
    else:
        s = 0.5 * _height(a, b, points, sizes)
        t = 0.5 * _height(a, c, points, sizes)
    return (
        points[a, 0] + s * u[0] + t * w[0],
        points[a, 1] + s * u[1] + t * w[1],
        points[a, 2] + s * u[2] + t * w[2],
    )


@njit(cache=True, parallel=True)
def facet_sections(facet_cells, facet_vertices, vertices, n, points, sizes, normals, lengths, areas, sectors, covered):
    """Unit normal, L = (P_j - P_i)·n, area A, sector areas A^k of each facet, and whether its spheres cover it.

    They do where its radical centre, the point of equal power in its plane, lies inside of them.
    """
    for f in prange(facet_cells.shape[0]):
        abc = (facet_vertices[f, 0], facet_vertices[f, 1], facet_vertices[f, 2])
        s = area_vector(abc[0], abc[1], abc[2], n, points, sizes)
        area = np.sqrt(_dot(s, s))
        length = 0.0
        for axis in range(3):
            normals[f, axis] = s[axis] / area if area > 0.0 else 0.0
            i = facet_cells[f, 0]
            j = facet_cells[f, 1]
            length += normals[f, axis] * (vertices[j, axis] - vertices[i, axis])
        areas[f] = area
        lengths[f] = length
        k = abc[0]
        power = -sizes[k] * sizes[k]
        above = 0.0
        for axis in range(3):
            gap = points[k, axis] - vertices[facet_cells[f, 0], axis]
            power += gap * gap
            above += gap * normals[f, axis]
        covered[f] = power <= above * above
        rest = np.pi  # the angles at the spheres of a triangle or trapezoid add up to π
        for v in range(3):
            k = abc[v]
            sectors[f, v] = 0.0
            if k >= n:
                continue
            b = abc[_NEXT[v]]
            c = abc[_LAST[v]]
            u = _towards(k, b, n, points)
            w = _towards(k, c, n, points)
            if abc[1] >= n:
                angle = 0.5 * np.pi
            elif v == 2 or (v == 1 and abc[2] >= n):
                angle = rest
            else:
                x = _cross(u, w)
                angle = np.arctan2(np.sqrt(_dot(x, x)), _dot(u, w))
                rest -= angle
            sectors[f, v] = 0.5 * angle * sizes[k] * sizes[k]
            if _overlaps(k, b, u, n, points, sizes):
                sectors[f, v] -= _half_segment(k, b, u, n, points, sizes)
            if _overlaps(k, c, w, n, points, sizes):
                sectors[f, v] -= _half_segment(k, c, w, n, points, sizes)


@njit(cache=True)
def _overlaps(k, m, u, n, points, sizes):
    """Whether sphere k reaches beyond its Laguerre plane towards m."""
    if m >= n:
        return _height(k, m, points, sizes) < sizes[k]
    return _dot(u, u) < (sizes[k] + sizes[m]) * (sizes[k] + sizes[m])


@njit(cache=True)
def _plane_distance(k, m, u, n, points, sizes):
    """Distance from centre k to the Laguerre plane towards m; u is the vector (direction) to m."""
    if m >= n:
        return _height(k, m, points, sizes)
    square = _dot(u, u)
    return 0.5 * (square + (sizes[k] - sizes[m]) * (sizes[k] + sizes[m])) / np.sqrt(square)


@njit(cache=True)
def _half_segment(k, m, u, n, points, sizes):
    """Half the part of the disc of sphere k beyond the Laguerre plane towards m, which it overlaps."""
    r = sizes[k]
    d = min(max(_plane_distance(k, m, u, n, points, sizes), -r), r)
    chord = np.sqrt((r - d) * (r + d))
    return 0.5 * (r * r * np.arctan2(chord, d) - d * chord)


@njit(cache=True, parallel=True)
def facet_volumes(facet_cells, facet_vertices, vertices, n, points, sizes, volumes, surfaces):
    """Void volume φ of each throat and the solid surface γ^k of each of its vertices, walls included.

    Ω_ij is the pair of pyramids from the facet to P_i and P_j, signed; as P_i P_j is normal to the facet its volume is
    A L / 3, computed as S·(P_j - P_i) / 3 so that sums telescope exactly.
    """
    for f in prange(facet_cells.shape[0]):
        abc = (facet_vertices[f, 0], facet_vertices[f, 1], facet_vertices[f, 2])
        i = facet_cells[f, 0]
        j = facet_cells[f, 1]
        pi = (vertices[i, 0], vertices[i, 1], vertices[i, 2])
        pj = (vertices[j, 0], vertices[j, 1], vertices[j, 2])
        axis = (pj[0] - pi[0], pj[1] - pi[1], pj[2] - pi[2])
        s = area_vector(abc[0], abc[1], abc[2], n, points, sizes)
        area = np.sqrt(_dot(s, s))
        inverse = 1.0 / area if area > 0.0 else 0.0
        normal = (s[0] * inverse, s[1] * inverse, s[2] * inverse)
        length = _dot(axis, normal)
        volume = _dot(axis, s) / 3.0
        for v in range(3):
            surfaces[f, v] = 0.0
        for v in range(3):
            k = abc[v]
            if k >= n:
                # The wall's share of Ω_ij: two triangles on the trace of the facet.
                trace = _trace(abc, v, n, points, sizes)
                surfaces[f, v] += 0.5 * length * trace
                continue
            b = abc[_NEXT[v]]
            c = abc[_LAST[v]]
            u = _towards(k, b, n, points)
            w = _towards(k, c, n, points)
            qi = (pi[0] - points[k, 0], pi[1] - points[k, 1], pi[2] - points[k, 2])
            qj = (pj[0] - points[k, 0], pj[1] - points[k, 1], pj[2] - points[k, 2])
            r = sizes[k]
            omega = _solid_angle_between(u, w, qi, qj)
            surfaces[f, v] += omega * r * r
            volume -= omega * r * r * r / 3.0
            for turn in range(2):
                m = b if turn == 0 else c
                edge = u if turn == 0 else w
                if not _overlaps(k, m, edge, n, points, sizes):
                    continue
                d = min(max(_plane_distance(k, m, edge, n, points, sizes), -r), r)
                psi = _dihedral(edge, normal, qi, qj)
                if turn == 1:  # the facet lies on the other side of this edge
                    psi = _dihedral((-edge[0], -edge[1], -edge[2]), normal, qi, qj)
                h = r - d
                volume += psi * h * h * (3.0 * r - h) / 6.0
                surfaces[f, v] -= psi * r * h
                if m >= n:
                    surfaces[f, _NEXT[v] if turn == 0 else _LAST[v]] -= 0.5 * psi * (r - d) * (r + d)
        volumes[f] = volume


@njit(cache=True)
def _trace(abc, v, n, points, sizes):
    """Length of the facet's trace on its wall abc[v]."""
    wall = abc[v]
    a = abc[0]
    if abc[1] < n:
        u = _towards(a, abc[1], n, points)
        along = _dot(u, (points[wall, 0], points[wall, 1], points[wall, 2]))
        return np.sqrt(max(_dot(u, u) - along * along, 0.0))
    return _height(a, abc[3 - v], points, sizes)


@njit(cache=True)
def _tangent(u, v, w):
    """(numerator, denominator) of tan(Ω/2) for the triangle u, v, w (Van Oosterom and Strackee 1983)."""
    lu = np.sqrt(_dot(u, u))
    lv = np.sqrt(_dot(v, v))
    return _tangent_on(u, v, lu * lv + _dot(u, v), lu, lv, _cross(u, v), w)


@njit(cache=True)
def _tangent_on(u, v, base, lu, lv, normal, w):
    """The same with what depends on the edge u, v alone worked out: base = |u||v| + u·v, normal = u x v."""
    return _dot(normal, w), base * np.sqrt(_dot(w, w)) + _dot(v, w) * lu + _dot(w, u) * lv


@njit(cache=True)
def _solid_angle_between(u, v, qi, qj):
    """Signed solid angle of (u, v, qj) less that of (u, v, qi)."""
    lu = np.sqrt(_dot(u, u))
    lv = np.sqrt(_dot(v, v))
    base = lu * lv + _dot(u, v)
    normal = _cross(u, v)
    ni, di = _tangent_on(u, v, base, lu, lv, normal, qi)
    nj, dj = _tangent_on(u, v, base, lu, lv, normal, qj)
    if di > 0.0 and dj > 0.0:  # both halves within ±90°: one arctangent gives the difference
        return 2.0 * np.arctan2(nj * di - ni * dj, di * dj + ni * nj)
    return 2.0 * (np.arctan2(nj, dj) - np.arctan2(ni, di))


@njit(cache=True)
def _dihedral(edge, normal, qi, qj):
    """Angle about an edge from the half-plane of qi to that of qj, counted from the facet's own side."""
    inward = _cross(normal, edge)
    y = _dot(inward, qi) / np.sqrt(_dot(edge, edge))
    return np.arctan2(_dot(normal, qj), y) - np.arctan2(_dot(normal, qi), y)


@njit(cache=True, parallel=True)
def inscribed_circles(facet_vertices, n, points, sizes, slip):
    """Radius of the circle in each facet's plane tangent to its spheres and no-slip walls, centred on walls with slip.

    With the first centre as origin and x = X₀ + ρ X₁ the centre of the circle, its tangency to the other two is
    linear in ρ and to the first quadratic. Zero where no such circle exists.
    """
    radii = np.zeros(facet_vertices.shape[0])
    for f in prange(facet_vertices.shape[0]):
        a = facet_vertices[f, 0]
        rows = np.empty((2, 2))
        constant = np.empty(2)
        slope = np.empty(2)
        u = _towards(a, facet_vertices[f, 1], n, points)
        normal = _cross(u, _towards(a, facet_vertices[f, 2], n, points))
        e1 = _unit(u)
        e2 = _unit(_cross(normal, u))
        for i in range(2):
            m = facet_vertices[f, i + 1]
            w = _towards(a, m, n, points)
            rows[i, 0] = _dot(w, e1)
            rows[i, 1] = _dot(w, e2)
            if m < n:
                constant[i] = 0.5 * (_dot(w, w) + (sizes[a] - sizes[m]) * (sizes[a] + sizes[m]))
                slope[i] = sizes[a] - sizes[m]
            else:
                constant[i] = _height(a, m, points, sizes)
                slope[i] = 0.0 if slip[m - n] else -1.0
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
                radii[f] = qc / below
    return radii


@njit(cache=True)
def _unit(v):
    length = np.sqrt(_dot(v, v))
    return (v[0] / length, v[1] / length, v[2] / length) if length > 0.0 else v


@njit(cache=True)
def facet_centroids(facet_vertices, n, points, sizes):
    """(f, 3): centroid of each facet."""
    centres = np.empty((facet_vertices.shape[0], 3))
    for f in range(facet_vertices.shape[0]):
        x = centroid(facet_vertices[f, 0], facet_vertices[f, 1], facet_vertices[f, 2], n, points, sizes)
        for axis in range(3):
            centres[f, axis] = x[axis]
    return centres
