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

from porefv.doubling import doubled
from porefv.kernels import njit, prange
from porefv.union_find import join


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
def tied_facets(facet_cells, cell_node, cell_pore):
    """Facets between two pores both of whose Laguerre vertices are shared by several cells."""
    cells = np.zeros(cell_node.max() + 1, np.int32)
    for t in range(cell_node.shape[0]):
        cells[cell_node[t]] += 1
    found = np.empty(64, np.int64)
    count = 0
    for f in range(facet_cells.shape[0]):
        i = facet_cells[f, 0]
        j = facet_cells[f, 1]
        if cells[cell_node[i]] > 1 and cells[cell_node[j]] > 1 and cell_pore[i] != cell_pore[j]:
            if count == found.shape[0]:
                found = doubled(found)
            found[count] = f
            count += 1
    return found[:count].copy()


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


@njit(cache=True)
def _plus(a, b):
    return a[0] + b[0], a[1] + b[1], a[2] + b[2]


@njit(cache=True)
def _minus(a, b):
    return a[0] - b[0], a[1] - b[1], a[2] - b[2]


@njit(cache=True)
def _times(factor, a):
    return factor * a[0], factor * a[1], factor * a[2]


@njit(cache=True)
def _at(i, array):
    return array[i, 0], array[i, 1], array[i, 2]


@njit(cache=True)
def _corners(f, facet_vertices, n, points):
    """Vertices a, b, c of facet f, the vectors from a to b and to c, their cross product and its length.

    The product has the facet's sense, and belongs to the angles at all three vertices.
    """
    a = facet_vertices[f, 0]
    b = facet_vertices[f, 1]
    c = facet_vertices[f, 2]
    ab = _towards(a, b, n, points)
    ac = _towards(a, c, n, points)
    cross = _cross(ab, ac)
    return a, b, c, ab, ac, cross, np.sqrt(_dot(cross, cross))


@njit(cache=True)
def _angles(b, c, n, ab, ac, twice):
    """Angles of a facet at its vertices, 0 at walls: b and c are its second and third, the rest as of `_corners`."""
    if b >= n:
        return 0.5 * np.pi, 0.0, 0.0
    at_a = np.arctan2(twice, _dot(ab, ac))
    if c >= n:
        return at_a, np.pi - at_a, 0.0
    at_b = np.arctan2(twice, _dot(_minus(ab, ac), ab))
    return at_a, at_b, np.pi - at_a - at_b


@njit(cache=True, parallel=True, error_model="numpy")
def facet_sections(facet_cells, facet_vertices, vertices, n, points, sizes, normals, lengths, fluid, sectors, covered):
    """Unit normal, L = (P_j - P_i)·n, A^f, sector areas A^k of each facet, and whether its spheres cover it.

    They do where its radical centre, the point of equal power in its plane, lies inside of them.
    """
    for f in prange(facet_cells.shape[0]):
        a, b, c, ab, ac, cross, twice = _corners(f, facet_vertices, n, points)
        normal = _times(1.0 / twice if twice > 0.0 else 0.0, cross)
        ra = sizes[a]
        angles = _angles(b, c, n, ab, ac, twice)
        sectors[f, 0] = 0.5 * angles[0] * ra * ra
        sectors[f, 1] = 0.5 * angles[1] * sizes[b] * sizes[b]
        sectors[f, 2] = 0.5 * angles[2] * sizes[c] * sizes[c]
        if c < n:
            area = 0.5 * twice
        elif b < n:
            area = 0.5 * (_height(a, c, points, sizes) + _height(b, c, points, sizes)) * twice
        else:
            area = _height(a, b, points, sizes) * _height(a, c, points, sizes)
        _cut_sectors(f, 0, 1, a, b, ab, n, points, sizes, sectors)
        if b < n:
            _cut_sectors(f, 1, 2, b, c, _minus(ac, ab) if c < n else ac, n, points, sizes, sectors)
        _cut_sectors(f, 0, 2, a, c, ac, n, points, sizes, sectors)
        fluid[f] = area - (sectors[f, 0] + sectors[f, 1] + sectors[f, 2])
        pi = _at(facet_cells[f, 0], vertices)
        lengths[f] = _dot(normal, _minus(_at(facet_cells[f, 1], vertices), pi))
        gap = _minus(_at(a, points), pi)
        above = _dot(gap, normal)
        covered[f] = _dot(gap, gap) - ra * ra <= above * above
        for axis in range(3):
            normals[f, axis] = normal[axis]


@njit(cache=True)
def _cut_sectors(f, i, j, k, m, u, n, points, sizes, sectors):
    """Take from the sectors of vertices k and m of facet f what reaches beyond the Laguerre plane between them."""
    if not _overlaps(k, m, u, n, points, sizes):
        return
    d, beyond = _plane_distances(k, m, u, n, points, sizes)
    sectors[f, i] -= _half_segment(sizes[k], d)
    if m < n:
        sectors[f, j] -= _half_segment(sizes[m], beyond)


@njit(cache=True)
def _overlaps(k, m, u, n, points, sizes):
    """Whether sphere k reaches beyond its Laguerre plane towards m."""
    if m >= n:
        return _height(k, m, points, sizes) < sizes[k]
    return _dot(u, u) < (sizes[k] + sizes[m]) * (sizes[k] + sizes[m])


@njit(cache=True, error_model="numpy")
def _plane_distances(k, m, u, n, points, sizes):
    """Distances of centres k and m from the Laguerre plane between them, each within its radius.

    u leads from k to m. Of a wall, the second distance has no meaning.
    """
    r = sizes[k]
    if m >= n:
        return min(max(_height(k, m, points, sizes), -r), r), 0.0
    d, beyond = _feet(u, r, sizes[m])
    return min(max(d, -r), r), min(max(beyond, -sizes[m]), sizes[m])


@njit(cache=True, error_model="numpy")
def _feet(u, r, s):
    """Distances of the centres of two spheres of radii r and s, u apart, from the Laguerre plane between them."""
    square = _dot(u, u)
    length = np.sqrt(square)
    d = 0.5 * (square + (r - s) * (r + s)) / length
    return d, length - d


@njit(cache=True)
def _half_segment(r, d):
    """Half the part of a disc of radius r beyond a chord at distance d from its centre."""
    chord = np.sqrt((r - d) * (r + d))
    return 0.5 * (r * r * np.arctan2(chord, d) - d * chord)


@njit(cache=True, parallel=True, error_model="numpy")
def facet_volumes(facet_cells, facet_vertices, vertices, n, points, sizes, volumes, surfaces):
    """Void volume φ of each throat and the solid surface γ^k of each of its vertices, walls included.

    Ω_ij is the pair of pyramids from the facet to P_i and P_j, signed; as P_i P_j is normal to the facet its volume is
    A L / 3, computed as S·(P_j - P_i) / 3 so that sums telescope exactly.
    """
    for f in prange(facet_cells.shape[0]):
        a, b, c, ab, ac, cross, twice = _corners(f, facet_vertices, n, points)
        # P_i and P_j from the first sphere; their heights over the facet's plane, times `twice`.
        qi = _minus(_at(facet_cells[f, 0], vertices), _at(a, points))
        qj = _minus(_at(facet_cells[f, 1], vertices), _at(a, points))
        hi = _dot(cross, qi)
        hj = _dot(cross, qj)
        half_length = 0.5 * (hj - hi) / twice if twice > 0.0 else 0.0
        ra = sizes[a]
        if c < n:
            bc = _minus(ac, ab)
            ba = _times(-1.0, ab)
            lab = np.sqrt(_dot(ab, ab))
            lbc = np.sqrt(_dot(bc, bc))
            lac = np.sqrt(_dot(ac, ac))
            at_a = _solid_angle(ab, lab, ac, lac, qi, hi, qj, hj)
            at_b = _solid_angle(bc, lbc, ba, lab, _plus(qi, ba), hi, _plus(qj, ba), hj)
            at_c = _solid_angle(ac, lac, bc, lbc, _minus(ac, qi), hi, _minus(ac, qj), hj)
            rb = sizes[b]
            rc = sizes[c]
            volume = (0.5 * (hj - hi) - at_a * ra * ra * ra - at_b * rb * rb * rb - at_c * rc * rc * rc) / 3.0
            surfaces[f, 0] = at_a * ra * ra
            surfaces[f, 1] = at_b * rb * rb
            surfaces[f, 2] = at_c * rc * rc
            if lab < ra + rb:
                volume += _cut_caps(f, 0, 1, a, b, ab, ab, qi, hi, qj, hj, cross, n, points, sizes, surfaces)
            if lbc < rb + rc:
                volume += _cut_caps(f, 1, 2, b, c, bc, bc, _plus(qi, ba), hi, _plus(qj, ba), hj, cross,
                                    n, points, sizes, surfaces)  # fmt: skip
            if lac < ra + rc:
                volume += _cut_caps(f, 0, 2, a, c, ac, _times(-1.0, ac), qi, hi, qj, hj, cross,
                                    n, points, sizes, surfaces)  # fmt: skip
        elif b < n:
            ba = _times(-1.0, ab)
            lab = np.sqrt(_dot(ab, ab))
            bi = _plus(qi, ba)
            bj = _plus(qj, ba)
            at_a = _solid_angle(ab, lab, ac, 1.0, qi, hi, qj, hj)
            at_b = _solid_angle(ac, 1.0, ba, lab, bi, hi, bj, hj)
            rb = sizes[b]
            factor = 0.5 * (_height(a, c, points, sizes) + _height(b, c, points, sizes))
            volume = (factor * (hj - hi) - at_a * ra * ra * ra - at_b * rb * rb * rb) / 3.0
            surfaces[f, 0] = at_a * ra * ra
            surfaces[f, 1] = at_b * rb * rb
            # The wall's share of Ω_ij: two triangles on the trace of the facet.
            along = _dot(ab, ac)
            surfaces[f, 2] = half_length * np.sqrt(max(_dot(ab, ab) - along * along, 0.0))
            if lab < ra + rb:
                volume += _cut_caps(f, 0, 1, a, b, ab, ab, qi, hi, qj, hj, cross, n, points, sizes, surfaces)
            if _height(b, c, points, sizes) < rb:
                volume += _cut_caps(f, 1, 2, b, c, ac, ac, bi, hi, bj, hj, cross, n, points, sizes, surfaces)
            if _height(a, c, points, sizes) < ra:
                volume += _cut_caps(f, 0, 2, a, c, ac, _times(-1.0, ac), qi, hi, qj, hj, cross,
                                    n, points, sizes, surfaces)  # fmt: skip
        else:
            at_a = _solid_angle(ab, 1.0, ac, 1.0, qi, hi, qj, hj)
            to_b = _height(a, b, points, sizes)
            to_c = _height(a, c, points, sizes)
            volume = (to_b * to_c * (hj - hi) - at_a * ra * ra * ra) / 3.0
            surfaces[f, 0] = at_a * ra * ra
            surfaces[f, 1] = half_length * to_c
            surfaces[f, 2] = half_length * to_b
            if to_b < ra:
                volume += _cut_caps(f, 0, 1, a, b, ab, ab, qi, hi, qj, hj, cross, n, points, sizes, surfaces)
            if to_c < ra:
                volume += _cut_caps(f, 0, 2, a, c, ac, _times(-1.0, ac), qi, hi, qj, hj, cross,
                                    n, points, sizes, surfaces)  # fmt: skip
        volumes[f] = volume


@njit(cache=True)
def _solid_angle(u, lu, v, lv, qi, hi, qj, hj):
    """Signed solid angle of (u, v, qj) less that of (u, v, qi); lengths of u, v and heights (u x v)·q are given.

    tan(Ω/2) = (u x v)·q / (|u||v||q| + u·v |q| + v·q |u| + q·u |v|) (Van Oosterom and Strackee 1983).
    """
    base = lu * lv + _dot(u, v)
    di = base * np.sqrt(_dot(qi, qi)) + _dot(v, qi) * lu + _dot(u, qi) * lv
    dj = base * np.sqrt(_dot(qj, qj)) + _dot(v, qj) * lu + _dot(u, qj) * lv
    return 2.0 * _turn(di, hi, dj, hj)


@njit(cache=True)
def _turn(xi, yi, xj, yj):
    """Angle of (xj, yj) less that of (xi, yi), each within ±180°."""
    if xi > 0.0 and xj > 0.0:  # both within ±90°: one arctangent gives the difference
        return np.arctan2(yj * xi - yi * xj, xi * xj + yi * yj)
    return np.arctan2(yj, xj) - np.arctan2(yi, xi)


@njit(cache=True, error_model="numpy")
def _cut_caps(f, i, j, k, m, u, edge, qi, hi, qj, hj, cross, n, points, sizes, surfaces):
    """Take the caps of k and m beyond their Laguerre plane from the surfaces; returns their volume in Ω_ij.

    `u` leads from k to m, `edge` is the same line in the facet's cyclic sense, qi and qj are P_i, P_j from a point on
    it. ψ is the angle about the edge from P_i to P_j, counted from the facet's own side.
    """
    inward = _times(1.0 / np.sqrt(_dot(edge, edge)), _cross(cross, edge))
    psi = _turn(_dot(inward, qi), hi, _dot(inward, qj), hj)
    r = sizes[k]
    d, beyond = _plane_distances(k, m, u, n, points, sizes)
    h = r - d
    volume = psi * h * h * (3.0 * r - h) / 6.0
    surfaces[f, i] -= psi * r * h
    if m >= n:
        surfaces[f, j] -= 0.5 * psi * (r - d) * (r + d)
        return volume
    r = sizes[m]
    h = r - beyond
    surfaces[f, j] -= psi * r * h
    return volume + psi * h * h * (3.0 * r - h) / 6.0


@njit(cache=True, error_model="numpy")
def laguerre_volumes(facet_cells, facet_vertices, vertices, n, points, sizes):
    """(n,): volume of the Laguerre cell of each sphere.

    The face between spheres k and m is a polygon with a corner P_i for each cell around the edge km. A facet with that
    edge owns the triangle from P_i to P_j and the face's foot, d from centre k, and a pyramid d h L / 6 under it: h is
    from the foot to the line of the P's, towards the facet's own side, and all are signed.
    """
    volumes = np.zeros(n)
    for f in range(facet_cells.shape[0]):
        a, b, c, ab, ac, cross, twice = _corners(f, facet_vertices, n, points)
        if twice == 0.0:
            continue
        pi = _at(facet_cells[f, 0], vertices)
        length = _dot(cross, _minus(_at(facet_cells[f, 1], vertices), pi)) / twice
        for side in range(3):
            k = a if side != 1 else b
            m = b if side == 0 else c
            if k >= n:
                continue
            # Along the edge from k to m, in the facet's cyclic sense and unit.
            u = _towards(k, m, n, points)
            edge = _unit(u)
            inward = _cross(cross, edge if side != 2 else _times(-1.0, edge))
            h = _dot(inward, _minus(pi, _at(k, points))) / twice
            if m >= n:
                volumes[k] += _height(k, m, points, sizes) * h * length / 6.0
                continue
            d, beyond = _feet(u, sizes[k], sizes[m])
            volumes[k] += d * h * length / 6.0
            volumes[m] += beyond * h * length / 6.0
    return volumes


@njit(cache=True, parallel=True)
def row_sums(values):
    """(f,): sum of the three values of each row."""
    sums = np.empty(values.shape[0])
    for f in prange(values.shape[0]):
        sums[f] = values[f, 0] + values[f, 1] + values[f, 2]
    return sums


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
