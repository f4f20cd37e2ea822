"""Kernel of the volumes and solid surfaces of throats, facet by facet (C12 §2.2.2), overlaps included.

Each sphere owns its ball as far as the Laguerre plane towards each neighbour (or wall). Where balls overlap or cross a
wall, the cap beyond that plane is left out of volumes and surfaces: around an edge the caps of its facets add up to the
whole cap, so sums stay exact for any overlap of pairs.
"""

from __future__ import annotations

import numpy as np

from porefv.mesh.facet_kernels import facet_corners
from porefv.mesh.laguerre import laguerre_plane_distances
from porefv.mesh.vectors import cross_product, dot, minus, plus, times, vector_at, wall_distance
from porefv.system.kernels import njit, prange


@njit(cache=True, parallel=True, error_model="numpy")
def facet_volumes(facet_cells, facet_vertices, vertices, n, points, sizes, volumes, surfaces):
    """Void volume φ of each throat and the solid surface γ^k of each of its vertices, walls included.

    Ω_ij is the pair of pyramids from the facet to P_i and P_j, signed; as P_i P_j is normal to the facet its volume is
    A L / 3, computed as S·(P_j - P_i) / 3 so that sums telescope exactly.
    """
    for f in prange(facet_cells.shape[0]):
        a, b, c, ab, ac, cross, twice = facet_corners(f, facet_vertices, n, points)
        # P_i and P_j from the first sphere; their heights over the facet's plane, times `twice`.
        qi = minus(vector_at(facet_cells[f, 0], vertices), vector_at(a, points))
        qj = minus(vector_at(facet_cells[f, 1], vertices), vector_at(a, points))
        hi = dot(cross, qi)
        hj = dot(cross, qj)
        half_length = 0.5 * (hj - hi) / twice if twice > 0.0 else 0.0
        ra = sizes[a]
        if c < n:
            bc = minus(ac, ab)
            ba = times(-1.0, ab)
            lab = np.sqrt(dot(ab, ab))
            lbc = np.sqrt(dot(bc, bc))
            lac = np.sqrt(dot(ac, ac))
            at_a = _solid_angle(ab, lab, ac, lac, qi, hi, qj, hj)
            at_b = _solid_angle(bc, lbc, ba, lab, plus(qi, ba), hi, plus(qj, ba), hj)
            at_c = _solid_angle(ac, lac, bc, lbc, minus(ac, qi), hi, minus(ac, qj), hj)
            rb = sizes[b]
            rc = sizes[c]
            volume = (0.5 * (hj - hi) - at_a * ra * ra * ra - at_b * rb * rb * rb - at_c * rc * rc * rc) / 3.0
            surfaces[f, 0] = at_a * ra * ra
            surfaces[f, 1] = at_b * rb * rb
            surfaces[f, 2] = at_c * rc * rc
            if lab < ra + rb:
                volume += _cut_caps(f, 0, 1, a, b, ab, ab, qi, hi, qj, hj, cross, n, points, sizes, surfaces)
            if lbc < rb + rc:
                volume += _cut_caps(f, 1, 2, b, c, bc, bc, plus(qi, ba), hi, plus(qj, ba), hj, cross,
                                    n, points, sizes, surfaces)  # fmt: skip
            if lac < ra + rc:
                volume += _cut_caps(f, 0, 2, a, c, ac, times(-1.0, ac), qi, hi, qj, hj, cross,
                                    n, points, sizes, surfaces)  # fmt: skip
        elif b < n:
            ba = times(-1.0, ab)
            lab = np.sqrt(dot(ab, ab))
            bi = plus(qi, ba)
            bj = plus(qj, ba)
            at_a = _solid_angle(ab, lab, ac, 1.0, qi, hi, qj, hj)
            at_b = _solid_angle(ac, 1.0, ba, lab, bi, hi, bj, hj)
            rb = sizes[b]
            factor = 0.5 * (wall_distance(a, c, points, sizes) + wall_distance(b, c, points, sizes))
            volume = (factor * (hj - hi) - at_a * ra * ra * ra - at_b * rb * rb * rb) / 3.0
            surfaces[f, 0] = at_a * ra * ra
            surfaces[f, 1] = at_b * rb * rb
            # The wall's share of Ω_ij: two triangles on the trace of the facet.
            along = dot(ab, ac)
            surfaces[f, 2] = half_length * np.sqrt(max(dot(ab, ab) - along * along, 0.0))
            if lab < ra + rb:
                volume += _cut_caps(f, 0, 1, a, b, ab, ab, qi, hi, qj, hj, cross, n, points, sizes, surfaces)
            if wall_distance(b, c, points, sizes) < rb:
                volume += _cut_caps(f, 1, 2, b, c, ac, ac, bi, hi, bj, hj, cross, n, points, sizes, surfaces)
            if wall_distance(a, c, points, sizes) < ra:
                volume += _cut_caps(f, 0, 2, a, c, ac, times(-1.0, ac), qi, hi, qj, hj, cross,
                                    n, points, sizes, surfaces)  # fmt: skip
        else:
            at_a = _solid_angle(ab, 1.0, ac, 1.0, qi, hi, qj, hj)
            to_b = wall_distance(a, b, points, sizes)
            to_c = wall_distance(a, c, points, sizes)
            volume = (to_b * to_c * (hj - hi) - at_a * ra * ra * ra) / 3.0
            surfaces[f, 0] = at_a * ra * ra
            surfaces[f, 1] = half_length * to_c
            surfaces[f, 2] = half_length * to_b
            if to_b < ra:
                volume += _cut_caps(f, 0, 1, a, b, ab, ab, qi, hi, qj, hj, cross, n, points, sizes, surfaces)
            if to_c < ra:
                volume += _cut_caps(f, 0, 2, a, c, ac, times(-1.0, ac), qi, hi, qj, hj, cross,
                                    n, points, sizes, surfaces)  # fmt: skip
        volumes[f] = volume


@njit(cache=True)
def _solid_angle(u, lu, v, lv, qi, hi, qj, hj):
    """Signed solid angle of (u, v, qj) less that of (u, v, qi); lengths of u, v and heights (u x v)·q are given.

    tan(Ω/2) = (u x v)·q / (|u||v||q| + u·v |q| + v·q |u| + q·u |v|) (Van Oosterom and Strackee 1983).
    """
    base = lu * lv + dot(u, v)
    di = base * np.sqrt(dot(qi, qi)) + dot(v, qi) * lu + dot(u, qi) * lv
    dj = base * np.sqrt(dot(qj, qj)) + dot(v, qj) * lu + dot(u, qj) * lv
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
    inward = times(1.0 / np.sqrt(dot(edge, edge)), cross_product(cross, edge))
    psi = _turn(dot(inward, qi), hi, dot(inward, qj), hj)
    r = sizes[k]
    d, beyond = laguerre_plane_distances(k, m, u, n, points, sizes)
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
