"""Pressure on the parts of spheres that bound a throat (patches), which falls along the throat from pore to pore.

A pore's part of a throat is the pyramid from the throat's facet to the pore's Laguerre vertex. It cuts a patch from
each of the facet's spheres, a spherical triangle. One pressure for all of a pore (C12 eq. 14) leaves the whole of the
fall in the facet's plane; here pressure depends on the height s over that plane, as friction in the sections of a
hyperboloid has it: what is left of the drop from the vertex at height h to the neck is

    1 - Φ(s) / Φ(h),    Φ(s) = t - t³/3,    t = x / √(1 + x²),    x = β s / e,

for dΦ/dx = (1 + x²)^{-5/2}, as A^{-5/2} of a section A = A^f (1 + s² / e²).
"""

from __future__ import annotations

import numpy as np

from porefv.conductance.section_friction.friction_kernels import STRETCH
from porefv.mesh.vectors import cross_product, dot, minus, towards, unit, vector_at
from porefv.system.kernels import njit, prange

# Points on each triangle, towards its pore's vertex and across: 3 % of what they move, in the mean square.
_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(2)
_NODES, _WEIGHTS = 0.5 * (_NODES + 1.0), 0.5 * _WEIGHTS
_ACROSS, _ACROSS_WEIGHTS = np.polynomial.legendre.leggauss(3)
_ACROSS, _ACROSS_WEIGHTS = 0.5 * (_ACROSS + 1.0), 0.5 * _ACROSS_WEIGHTS


@njit(cache=True, parallel=True, error_model="numpy")
def apply_pressure_along_throats(
    throats, starts, facets, facet_cells, facet_vertices, n, points, sizes, vertices, normals, necks, fractions,
    pressure, drag,
):  # fmt: skip
    """Move the part of the drag that is pressure along the throats from `drag` to `pressure`, for unit drops.

    Parameters
    ----------
    throats : (t,) array
        Throats to treat; throat t has the facets starts[t] to starts[t + 1] of `facets`.
    necks : (f,) array
        e, the height at which the section of each facet's throat is twice its neck's; not positive: left out [m].
    fractions : (f, 3) array
        Of the drag, among the vertices of all facets of a throat.
    pressure, drag : (m, 3, 3) arrays
        Forces on the vertices of the facets of `throats`, one after another, added to in place [m²]. Their sum stays.
    """
    for i in prange(throats.shape[0]):
        start = starts[throats[i]]
        stop = starts[throats[i] + 1]
        row = start - starts[throats[0]]
        f = facets[start]
        if not necks[f] > 0.0:
            continue
        scale = STRETCH / necks[f]
        normal = vector_at(f, normals)
        first = vector_at(facet_vertices[f, 0], points)
        # The vertex of a pore beyond the facet's plane leaves no part of the throat to that pore.
        low = min(_fall(scale * dot(minus(vector_at(facet_cells[f, 0], vertices), first), normal), 1.0), 0.0)
        high = max(_fall(scale * dot(minus(vector_at(facet_cells[f, 1], vertices), first), normal), 1.0), 0.0)
        if not high - low > 0.0:
            continue
        moved = np.zeros(3)
        for j in range(start, stop):
            for v in range(3):
                k = facet_vertices[facets[j], v]
                if k >= n:
                    continue
                after, before = facet_vertices[f, (v + 1) % 3], facet_vertices[f, (v + 2) % 3]
                if stop - start > 1:
                    after, before = _neighbours(k, facets[start:stop], j - start, facet_vertices, normals)
                    if after < 0:
                        continue
                a = unit(towards(k, after, n, points))
                b = unit(towards(k, before, n, points))
                for side in range(2):
                    end = high if side == 1 else low
                    drop = abs(end) / (high - low)
                    if drop > 0.0:
                        to_vertex = minus(vector_at(facet_cells[f, side], vertices), vector_at(k, points))
                        patch = _patch(a, b, to_vertex, sizes[k], normal, scale, end, drop)
                        sense = 1.0 if dot(normal, vector_at(facets[j], normals)) > 0.0 else -1.0
                        for axis in range(3):
                            pressure[row + j - start, v, axis] += sense * patch[axis]
                            moved[axis] += patch[axis]
        for axis in range(3):
            on_wall = _wall_across(axis, facets[start:stop], facet_vertices, n, points)
            for j in range(start, stop):
                sense = 1.0 if dot(normal, vector_at(facets[j], normals)) > 0.0 else -1.0
                for v in range(3):
                    if on_wall == 0:
                        drag[row + j - start, v, axis] -= sense * fractions[facets[j], v] * moved[axis]
                    elif facet_vertices[facets[j], v] >= n and points[facet_vertices[facets[j], v], axis] != 0.0:
                        pressure[row + j - start, v, axis] -= sense * moved[axis] / on_wall


@njit(cache=True)
def _wall_across(axis, facets, facet_vertices, n, points):
    """How many of a throat's facets stand on a wall across an axis.

    Its pressure falls along the throat, too, and takes up what spheres bear along the axis: with the throat's image
    behind the wall they would bear nothing.
    """
    count = 0
    for j in range(facets.shape[0]):
        for v in range(3):
            k = facet_vertices[facets[j], v]
            if k >= n and points[k, axis] != 0.0:
                count += 1
    return count


@njit(cache=True)
def _neighbours(k, facets, which, facet_vertices, normals):
    """The vertices before and after k around a throat, in the sense of its first facet; -1, -1 but for k's first facet.

    Where a tie has cut the throat in several facets, those that k has in common with one facet alone.
    """
    after = before = -1
    for j in range(facets.shape[0]):
        v = _place(k, facets[j], facet_vertices)
        if v < 0:
            continue
        if j < which:
            return -1, -1
        following, leading = _around(v, facets[j], facets[0], facet_vertices, normals)
        inner_a = inner_b = False
        for m in range(facets.shape[0]):
            u = _place(k, facets[m], facet_vertices)
            if m != j and u >= 0:
                other_a, other_b = _around(u, facets[m], facets[0], facet_vertices, normals)
                inner_a |= other_b == following
                inner_b |= other_a == leading
        if not inner_a:
            after = following
        if not inner_b:
            before = leading
    return (after, before) if after >= 0 and before >= 0 else (-1, -1)


@njit(cache=True)
def _place(k, f, facet_vertices):
    for v in range(3):
        if facet_vertices[f, v] == k:
            return v
    return -1


@njit(cache=True)
def _around(v, f, first, facet_vertices, normals):
    """The other two vertices of facet f, after and before its vertex v in the sense of facet `first`."""
    following = facet_vertices[f, (v + 1) % 3]
    leading = facet_vertices[f, (v + 2) % 3]
    if dot(vector_at(f, normals), vector_at(first, normals)) > 0.0:
        return following, leading
    return leading, following


@njit(cache=True, error_model="numpy")
def _fall(x, square):
    """Φ: friction from the neck to a height over it, of x / √square."""
    t = x / np.sqrt(square + x * x)
    return t - t * t * t / 3.0


@njit(cache=True, error_model="numpy")
def _patch(a, b, to_vertex, radius, normal, scale, end, drop):
    """Force on a sphere's patch by the pressure's fall between a pore's vertex and the neck, `drop` in all.

    The patch spans from a to b, unit vectors in the neck, and the vertex, where Φ is `end`. There is none where points
    on the flat triangle come next to the sphere's centre, and would see more of it than a half: in a facet's corner of
    nearly 180° with the vertex opposite in its plane.
    """
    c = unit(to_vertex)
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
