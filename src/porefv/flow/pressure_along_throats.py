"""Pressure on the parts of spheres that bound a throat (patches), which falls along the throat from pore to pore.

A pore's part of a throat is the pyramid from the throat's facet to the pore's Laguerre vertex. It cuts a patch from
each of the facet's spheres, a spherical triangle. One pressure for all of a pore (C12 eq. 14) leaves the whole of the
fall in the facet's plane. Here the pressure depends on the height s over that plane, as friction in the sections of a
hyperboloid has it. Of the drop between the vertex, at height h, and the neck, at height 0, the part that is lost above
the height s is

    1 - Φ(s) / Φ(h),    Φ(s) = t - t³/3,    t = x / √(1 + x²),    x = β s / e,

for dΦ/dx = (1 + x²)^{-5/2}, as A^{-5/2} of a section A = A^f (1 + s² / e²).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from porefv.conductance.section_friction.friction_kernels import STRETCH
from porefv.mesh.vectors import cross_product, dot, minus, towards, unit, vector_at
from porefv.system.kernels import helper, kernel, unsigned_range

# Points on each triangle, towards its pore's vertex and across: 3 % of what they move, in the mean square.
_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(2)
_NODES, _WEIGHTS = 0.5 * (_NODES + 1.0), 0.5 * _WEIGHTS
_ACROSS, _ACROSS_WEIGHTS = np.polynomial.legendre.leggauss(3)
_ACROSS, _ACROSS_WEIGHTS = 0.5 * (_ACROSS + 1.0), 0.5 * _ACROSS_WEIGHTS


class ThroatDrops(NamedTuple):
    """How the pressure falls along each throat, by facet.

    Attributes
    ----------
    doubling_heights : (f,) array
        e, the height at which the section of the facet's throat is twice its neck's; not positive: left out [m].
    drag_fractions : (f, 3) array
        Of the drag on the throat's solid, among the vertices of all its facets [-].
    """

    doubling_heights: np.ndarray
    drag_fractions: np.ndarray


class Fall(NamedTuple):
    """Fall of the pressure along a throat on one side of its neck.

    Attributes
    ----------
    scale : float
        β / e [1/m].
    end : float
        Φ at the pore's Laguerre vertex, negative on the first side [-].
    drop : float
        Part of the throat's pressure drop on this side [-].
    """

    scale: float
    end: float
    drop: float


@kernel(error_model="numpy")
def apply_pressure_along_throats(
    first, last, which, throats, facets, vertices, laguerre_vertices, drops, pressure, drag
):
    """Move the part of the drag that is pressure along the throats from `drag` to `pressure`.

    Parameters
    ----------
    first, last : int
        Rows to treat: first ... last - 1.
    which : (u,) int array
        Consecutive throats to treat.
    throats : ThroatFacets
    facets : FacetPlanes
    vertices : Vertices
    laguerre_vertices : (m, 3) array
        Of the cells [m].
    drops : ThroatDrops
    pressure, drag : (m, 3, 3) arrays
        Forces on the vertices of the facets of the throats to treat, one after another, for a unit pressure drop, added
        to in place [m²]. Their sum stays.
    """
    n, points, _ = vertices
    for i in unsigned_range(first, last):
        start = throats.starts[which[i]]
        own = throats.facets[start : throats.starts[which[i] + 1]]
        row = start - throats.starts[which[0]]
        f = own[0]
        height = drops.doubling_heights[f]
        if not height > 0.0:
            continue
        scale = STRETCH / height
        normal = vector_at(f, facets.normals)
        origin = vector_at(facets.vertices[f, 0], points)
        # The vertex of a pore beyond the facet's plane leaves no part of the throat to that pore.
        pi = vector_at(facets.cells[f, 0], laguerre_vertices)
        pj = vector_at(facets.cells[f, 1], laguerre_vertices)
        low = min(_fall(scale * dot(minus(pi, origin), normal), 1.0), 0.0)
        high = max(_fall(scale * dot(minus(pj, origin), normal), 1.0), 0.0)
        if not high - low > 0.0:
            continue
        moved = np.zeros(3)
        for j in range(own.shape[0]):
            sense = _sense(own[j], f, facets)
            for v in range(3):
                k = facets.vertices[own[j], v]
                if k >= n:
                    continue
                after, before = facets.vertices[f, (v + 1) % 3], facets.vertices[f, (v + 2) % 3]
                if own.shape[0] > 1:
                    after, before = _neighbours(k, j, own, facets)
                    if after < 0:
                        continue
                a = unit(towards(k, after, vertices))
                b = unit(towards(k, before, vertices))
                centre = vector_at(k, points)
                for side in range(2):
                    end = high if side == 1 else low
                    drop = abs(end) / (high - low)
                    if drop > 0.0:
                        c = unit(minus(pj if side == 1 else pi, centre))
                        patch = _patch(a, b, c, vertices.sizes[k], normal, Fall(scale, end, drop))
                        for axis in range(3):
                            pressure[row + j, v, axis] += sense * patch[axis]
                            moved[axis] += patch[axis]
        for axis in range(3):
            on_wall = _wall_across(axis, own, facets, vertices)
            for j in range(own.shape[0]):
                sense = _sense(own[j], f, facets)
                for v in range(3):
                    k = facets.vertices[own[j], v]
                    if on_wall == 0:
                        drag[row + j, v, axis] -= sense * drops.drag_fractions[own[j], v] * moved[axis]
                    elif k >= n and points[k, axis] != 0.0:
                        pressure[row + j, v, axis] -= sense * moved[axis] / on_wall


@helper
def _sense(f, first, facets):
    """1 where facet f has the sense of facet `first`, else -1."""
    return 1.0 if dot(vector_at(first, facets.normals), vector_at(f, facets.normals)) > 0.0 else -1.0


@helper
def _wall_across(axis, own, facets, vertices):
    """How many of a throat's own facets stand on a wall across an axis.

    Its pressure falls along the throat, too, and takes up what spheres bear along the axis: with the throat's image
    behind the wall they would bear nothing.
    """
    count = 0
    for j in range(own.shape[0]):
        for v in range(3):
            k = facets.vertices[own[j], v]
            if k >= vertices.n_spheres and vertices.points[k, axis] != 0.0:
                count += 1
    return count


@helper
def _neighbours(k, which, own, facets):
    """The vertices before and after k around a throat, in the sense of its first facet; -1, -1 but for k's first facet.

    `own` are the throat's facets, of which the one in place `which` is treated. Where a tie has cut the throat in
    several facets, the neighbours are those that k has in common with one facet alone.
    """
    after = before = -1
    for j in range(own.shape[0]):
        v = _place(k, own[j], facets)
        if v < 0:
            continue
        if j < which:
            return -1, -1
        following, leading = _around(v, own[j], own[0], facets)
        inner_a = inner_b = False
        for m in range(own.shape[0]):
            u = _place(k, own[m], facets)
            if m != j and u >= 0:
                other_a, other_b = _around(u, own[m], own[0], facets)
                inner_a |= other_b == following
                inner_b |= other_a == leading
        if not inner_a:
            after = following
        if not inner_b:
            before = leading
    return (after, before) if after >= 0 and before >= 0 else (-1, -1)


@helper
def _place(k, f, facets):
    """Place of vertex k in facet f, -1 if it is none of its vertices."""
    for v in range(3):
        if facets.vertices[f, v] == k:
            return v
    return -1


@helper
def _around(v, f, first, facets):
    """The other two vertices of facet f, after and before its vertex v in the sense of facet `first`."""
    following = facets.vertices[f, (v + 1) % 3]
    leading = facets.vertices[f, (v + 2) % 3]
    if _sense(f, first, facets) > 0.0:
        return following, leading
    return leading, following


@helper(error_model="numpy")
def _fall(x, square):
    """Φ: friction from the neck to a height over it, of x / √square."""
    t = x / np.sqrt(square + x * x)
    return t - t * t * t / 3.0


@helper(error_model="numpy")
def _patch(a, b, c, radius, normal, fall):
    """Force on a sphere's patch by the pressure's fall (`Fall`) between a pore's Laguerre vertex and the neck.

    The patch spans between three unit vectors from the sphere's centre: a and b in the neck, c to the vertex. There is
    none where points on the flat triangle come next to the sphere's centre, and would see more of it than a half: in a
    facet's corner of nearly 180° with the vertex opposite in its plane.
    """
    scale, end, drop = fall
    steep = dot(c, normal)
    # Positive along the facet's normal, where pressure is lower than at the neck, negative on the other side of it.
    volume = dot(cross_product(a, b), c)
    seen = 0.0
    x = 0.0
    y = 0.0
    z = 0.0
    for i in range(_NODES.shape[0]):
        wc = _NODES[i]
        height = scale * radius * wc * steep  # over e / β, times the point's distance
        for j in range(_ACROSS.shape[0]):
            wb = (1.0 - wc) * _ACROSS[j]
            wa = 1.0 - wc - wb
            u = wa * a[0] + wb * b[0] + wc * c[0]
            w = wa * a[1] + wb * b[1] + wc * c[1]
            q = wa * a[2] + wb * b[2] + wc * c[2]
            far = u * u + w * w + q * q
            left = min(max(1.0 - _fall(height, far) / end, 0.0), 1.0)
            # dA of a point of the flat triangle abc, seen from the centre: volume / distance³; and its unit vector.
            solid = _WEIGHTS[i] * _ACROSS_WEIGHTS[j] * (1.0 - wc) * volume / (far * far)
            seen += abs(solid) * np.sqrt(far)
            weight = left * solid
            x += weight * u
            y += weight * w
            z += weight * q
    if not seen <= 2.0 * np.pi:
        return 0.0, 0.0, 0.0
    factor = -drop * radius * radius
    return factor * x, factor * y, factor * z
