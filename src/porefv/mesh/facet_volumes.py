"""Kernel of the volumes and solid surfaces of throats, facet by facet (C12 §2.2.2), overlaps included.

Ω_ij is the pair of pyramids from the facet to the Laguerre vertices P_i and P_j of its two cells. P_i P_j is normal to
the facet, so that the volume of Ω_ij is A L / 3. In Ω_ij, the ball of sphere k has the surface and the volume

    γ^k = Ω_k r_k²,    Ω_k r_k³ / 3,

with Ω_k the solid angle of Ω_ij seen from the centre of k. Each sphere owns its ball as far as the Laguerre plane
towards each neighbour (or wall). Where balls overlap or cross a wall, the cap beyond that plane is left out of volumes
and surfaces. Around an edge the caps of its facets add up to the whole cap, so that sums stay exact for any overlap of
pairs.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from porefv.mesh.facet_kernels import area_factor, frame_of
from porefv.mesh.laguerre import crosses_laguerre_plane, laguerre_plane_distances
from porefv.mesh.vectors import cross_product, dot, minus, times, vector_at, wall_distance
from porefv.system.kernels import helper, kernel, unsigned_range


class Ends(NamedTuple):
    """The two Laguerre vertices of a facet, seen from one of its spheres.

    Attributes
    ----------
    pi, pj : vectors
        From the centre of the sphere to P_i and P_j [m].
    hi, hj : float
        Their heights over the facet's plane, times |ab × ac|: the same seen from any of its spheres [m³].
    """

    pi: tuple[float, float, float]
    pj: tuple[float, float, float]
    hi: float
    hj: float


class Caps(NamedTuple):
    """What two vertices have in Ω_ij beyond the Laguerre plane between them.

    Attributes
    ----------
    volume : float
        Of both [m³].
    of_k, of_m : float
        Surface of each [m²].
    """

    volume: float
    of_k: float
    of_m: float


@kernel(error_model="numpy")
def facet_volumes(first, last, facets, laguerre_vertices, vertices, volumes, surfaces):
    """Void volume φ of each throat and the solid surface γ^k of each of its vertices, walls included.

    Solid angles, heights and φ are signed: positive where P_j is further along the normal than P_i.

    Parameters
    ----------
    first, last : int
        Rows to treat: first ... last - 1.
    facets : FacetTopology
    laguerre_vertices : (m, 3) array
        Laguerre vertex of each cell [m].
    vertices : Vertices
    volumes, surfaces : (f,), (f, 3) arrays
        To be filled [m³, m²].
    """
    for f in unsigned_range(first, last):
        n, points, sizes = vertices
        frame = frame_of(f, facets, vertices)
        a, b, c, ab, ac, cross, twice = frame
        bc = minus(ac, ab) if c < n else ac
        pi = minus(vector_at(facets.cells[f, 0], laguerre_vertices), vector_at(a, points))
        pj = minus(vector_at(facets.cells[f, 1], laguerre_vertices), vector_at(a, points))
        from_a = Ends(pi, pj, dot(cross, pi), dot(cross, pj))
        from_b = _moved(from_a, ab)
        from_c = _moved(from_a, ac)
        # Walls, which b and c may be, have no solid angle: their surface is two triangles on an edge of the facet.
        gamma_a = _solid_angle(ab, ac, from_a) * sizes[a] * sizes[a]
        gamma_b = _solid_angle(bc, times(-1.0, ab), from_b) * sizes[b] * sizes[b] if b < n else 0.0
        gamma_c = _solid_angle(times(-1.0, ac), times(-1.0, bc), from_c) * sizes[c] * sizes[c] if c < n else 0.0
        length = (from_a.hj - from_a.hi) / twice if twice > 0.0 else 0.0
        on_b, on_c = _wall_edges(frame, vertices)
        caps_ab = _caps(a, b, ab, ab, cross, from_a, vertices)
        caps_bc = _caps(b, c, bc, bc, cross, from_b, vertices) if b < n else Caps(0.0, 0.0, 0.0)
        caps_ca = _caps(a, c, ac, times(-1.0, ac), cross, from_a, vertices)
        # A L as S·(P_j - P_i), S being the area vector, so that sums over facets telescope.
        area_times_length = area_factor(frame, vertices) * (from_a.hj - from_a.hi)
        outside_balls = (area_times_length - gamma_a * sizes[a] - gamma_b * sizes[b] - gamma_c * sizes[c]) / 3.0
        volumes[f] = outside_balls + caps_ab.volume + caps_bc.volume + caps_ca.volume
        surfaces[f, 0] = gamma_a - caps_ab.of_k - caps_ca.of_k
        surfaces[f, 1] = gamma_b + 0.5 * length * on_b - caps_ab.of_m - caps_bc.of_k
        surfaces[f, 2] = gamma_c + 0.5 * length * on_c - caps_bc.of_m - caps_ca.of_m


@helper
def _wall_edges(frame, vertices):
    """Lengths of a facet's edges on the walls that b and c may be; 0 for spheres [m]."""
    a, b, c, ab, ac, _, _ = frame
    if c < vertices.n_spheres:
        return 0.0, 0.0
    if b < vertices.n_spheres:
        along = dot(ab, ac)
        return 0.0, np.sqrt(max(dot(ab, ab) - along * along, 0.0))
    return wall_distance(a, c, vertices), wall_distance(a, b, vertices)


@helper
def _moved(ends, u):
    """The ends as seen from a point of the facet's plane that is u away."""
    return Ends(minus(ends.pi, u), minus(ends.pj, u), ends.hi, ends.hj)


@helper
def _solid_angle(u, v, ends):
    """Signed solid angle of (u, v, P_j) less that of (u, v, P_i); the heights are (u × v)·P.

    tan(Ω/2) = (u × v)·p / (|u||v||p| + u·v |p| + v·p |u| + p·u |v|) (Van Oosterom and Strackee 1983).
    """
    pi, pj, hi, hj = ends
    lu, lv = np.sqrt(dot(u, u)), np.sqrt(dot(v, v))
    base = lu * lv + dot(u, v)
    di = base * np.sqrt(dot(pi, pi)) + dot(v, pi) * lu + dot(u, pi) * lv
    dj = base * np.sqrt(dot(pj, pj)) + dot(v, pj) * lu + dot(u, pj) * lv
    return 2.0 * _angle_between(di, hi, dj, hj)


@helper
def _angle_between(xi, yi, xj, yj):
    """Angle of (xj, yj) less that of (xi, yi), each within ±180°."""
    if xi > 0.0 and xj > 0.0:  # both within ±90°: one arctangent gives the difference
        return np.arctan2(yj * xi - yi * xj, xi * xj + yi * yj)
    return np.arctan2(yj, xj) - np.arctan2(yi, xi)


@helper(error_model="numpy")
def _caps(k, m, u, edge, cross, ends, vertices):
    """`Caps` of sphere k and vertex m; none where k does not reach their Laguerre plane.

    `u` leads from k to m, `edge` is the same line in the facet's cyclic sense, `cross` is along the facet's normal, and
    `ends` are seen from k. ψ is the angle about the edge from P_i to P_j, counted from the facet's own side. A cap of
    height h has the volume ψ h² (3 r - h) / 6 and the surface ψ r h.
    """
    if not crosses_laguerre_plane(k, m, u, vertices):
        return Caps(0.0, 0.0, 0.0)
    inward = times(1.0 / np.sqrt(dot(edge, edge)), cross_product(cross, edge))
    psi = _angle_between(dot(inward, ends.pi), ends.hi, dot(inward, ends.pj), ends.hj)
    d, beyond = laguerre_plane_distances(k, m, u, vertices)
    r = vertices.sizes[k]
    h = r - d
    volume, of_k = psi * h * h * (3.0 * r - h) / 6.0, psi * r * h
    if m >= vertices.n_spheres:
        return Caps(volume, of_k, 0.5 * psi * (r - d) * (r + d))
    r = vertices.sizes[m]
    h = r - beyond
    return Caps(volume + psi * h * h * (3.0 * r - h) / 6.0, of_k, psi * r * h)
