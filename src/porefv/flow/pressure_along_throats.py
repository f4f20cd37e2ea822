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
from porefv.mesh.vectors import cross_product, dot, minus, plus, times, towards, vector_at
from porefv.system.kernels import helper, kernel

# Points on each triangle, towards its pore's vertex and across: 3 % of what they move, in the mean square.
_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(2)
_NODES, _WEIGHTS = 0.5 * (_NODES + 1.0), 0.5 * _WEIGHTS
_ACROSS, _ACROSS_WEIGHTS = np.polynomial.legendre.leggauss(3)
_ACROSS, _ACROSS_WEIGHTS = 0.5 * (_ACROSS + 1.0), 0.5 * _ACROSS_WEIGHTS


class ThroatDrops(NamedTuple):
    """How the pressure falls along throats.

    Attributes
    ----------
    doubling_heights : (f,) array
        e, the height at which the section of each facet's throat is twice its neck's; not positive: left out [m].
    drag_fractions : (m, 3) array
        Of the drag on the throat's solid, for the vertices of the facets that are treated [-].
    """

    doubling_heights: np.ndarray
    drag_fractions: np.ndarray


class Patches(NamedTuple):
    """Patches of one throat after another, in groups of `_LANES`, whose integrals are worked out side by side.

    Attributes
    ----------
    fields : (g * _FIELDS * _LANES,) array
        Group after group, and in a group place after place, `_A` to `_DROP`: what a patch is given by. The first three
        are its force, once that is integrated [m²].
    senses : (g * _LANES,) array
        1 or -1: the sense of the facet in its throat.
    rows, places : (g * _LANES,) int64 arrays
        Row of the facet among those that are treated, and place of the sphere in the facet.
    """

    fields: np.ndarray
    senses: np.ndarray
    rows: np.ndarray
    places: np.ndarray


# Eight numbers are two vectors of AVX2, or one of AVX-512.
_LANES = 8
# So many groups, 40 kB, are integrated at a time.
_GROUPS = 32
# Places in `Patches.fields`: vectors from the sphere's centre to its two neighbours in the neck, its radius; and on
# either side, three places apart or one, the vector to the pore's Laguerre vertex, the height of that over the neck
# times β / e, Φ there, and the part of the throat's pressure drop.
_A, _B, _RADIUS, _C, _TOP, _END, _DROP, _FIELDS = 0, 3, 6, 7, 13, 15, 17, 19


@kernel(error_model="numpy")
def apply_pressure_along_throats(
    first, last, begin, throats, facets, vertices, laguerre_vertices, drops, pressure, drag
):
    """Move the part of the drag that is pressure along the throats from `drag` to `pressure`.

    Parameters
    ----------
    first, last : int
        Throats to treat, first ... last - 1, counted from `begin` on.
    begin : int
        The throat whose first facet is in row 0 of `pressure` and `drag`.
    throats : ThroatFacets
    facets : FacetPlanes
    vertices : Vertices
    laguerre_vertices : (m, 3) array
        Of the cells [m].
    drops : ThroatDrops
    pressure, drag : (m, 3, 3) arrays
        Forces on the vertices of the facets of throats from `begin` on, one after another, for a unit pressure drop,
        added to in place [m²]. Their sum stays.
    """
    most = 0
    for t in range(begin + first, begin + last):
        most = max(most, throats.starts[t + 1] - throats.starts[t])
    groups = _GROUPS + 1 + 3 * most // _LANES
    room = groups * _LANES
    # Lanes that are not filled hold ones.
    patches = Patches(np.ones(room * _FIELDS), np.empty(room), np.empty(room, np.int64), np.empty(room, np.int64))
    ends = np.empty(room, np.int64)  # of the patches of each throat that has any
    listed = np.empty(room, np.int64)  # that throat
    count = 0
    n_listed = 0
    for t in range(begin + first, begin + last):
        before = count
        count = _list_patches(t, count, begin, throats, facets, vertices, laguerre_vertices, drops, patches)
        if count > before:
            listed[n_listed] = t
            ends[n_listed] = count
            n_listed += 1
        if count >= _GROUPS * _LANES or t == begin + last - 1:
            for group in range((count + _LANES - 1) // _LANES):
                _integrate(group, patches.fields)
            p = 0
            for k in range(n_listed):
                _move(listed[k], p, ends[k], begin, throats, facets, vertices, drops, patches, pressure, drag)
                p = ends[k]
            count = 0
            n_listed = 0


@helper(error_model="numpy")
def _list_patches(t, count, begin, throats, facets, vertices, laguerre_vertices, drops, patches):
    """Add the patches of throat t to those that are listed; returns how many there are then."""
    start = throats.starts[t]
    n_facets = throats.starts[t + 1] - start
    f = throats.facets[start]
    height = drops.doubling_heights[f]
    if not height > 0.0:
        return count
    normal = vector_at(f, facets.normals)
    origin = vector_at(facets.vertices[f, 0], vertices.points)
    pi = vector_at(facets.cells[f, 0], laguerre_vertices)
    pj = vector_at(facets.cells[f, 1], laguerre_vertices)
    # The vertex of a pore beyond the facet's plane leaves no part of the throat to that pore.
    top_i = STRETCH / height * dot(minus(pi, origin), normal)
    top_j = STRETCH / height * dot(minus(pj, origin), normal)
    low = min(_fall(top_i, 1.0), 0.0)
    high = max(_fall(top_j, 1.0), 0.0)
    if not high - low > 0.0:
        return count
    row = start - throats.starts[begin]
    for j in range(n_facets):
        own = throats.facets[start + j]
        sense = _sense(own, f, facets) if j > 0 else 1.0
        for v in range(3):
            k = facets.vertices[own, v]
            if k >= vertices.n_spheres:
                continue
            after, before = facets.vertices[f, (v + 1) % 3], facets.vertices[f, (v + 2) % 3]
            if n_facets > 1:
                after, before = _neighbours(k, j, throats.facets[start : start + n_facets], facets)
                if after < 0:
                    continue
            a = towards(k, after, vertices)
            b = towards(k, before, vertices)
            centre = vector_at(k, vertices.points)
            patches.rows[count] = row + j
            patches.places[count] = v
            patches.senses[count] = sense
            lane = _lane(count)
            _set_vector(patches.fields, lane, _A, a)
            _set_vector(patches.fields, lane, _B, b)
            _set(patches.fields, lane, _RADIUS, vertices.sizes[k])
            _set_side(patches.fields, lane, 0, minus(pi, centre), top_i, low, -low / (high - low))
            _set_side(patches.fields, lane, 1, minus(pj, centre), top_j, high, high / (high - low))
            count += 1
    return count


@helper
def _lane(patch):
    """Index of the first field of a patch: numbers without sign, between whose distances are constants."""
    return np.uint64(patch // _LANES) * np.uint64(_FIELDS * _LANES) + np.uint64(patch % _LANES)


@helper
def _get(fields, lane, place):
    return fields[lane + np.uint64(place * _LANES)]


@helper
def _set(fields, lane, place, value):
    fields[lane + np.uint64(place * _LANES)] = value


@helper
def _get_vector(fields, lane, place):
    return _get(fields, lane, place), _get(fields, lane, place + 1), _get(fields, lane, place + 2)


@helper
def _set_vector(fields, lane, place, vector):
    _set(fields, lane, place, vector[0])
    _set(fields, lane, place + 1, vector[1])
    _set(fields, lane, place + 2, vector[2])


@helper
def _move(t, first, last, begin, throats, facets, vertices, drops, patches, pressure, drag):
    """Add the forces of a throat's patches first ... last - 1 to `pressure`, and take their sum from `drag`."""
    start = throats.starts[t]
    n_facets = throats.starts[t + 1] - start
    row = start - throats.starts[begin]
    x = y = z = 0.0
    for p in range(first, last):
        row_of, v, sense = patches.rows[p], patches.places[p], patches.senses[p]
        fx, fy, fz = _get_vector(patches.fields, _lane(p), 0)
        pressure[row_of, v, 0] += sense * fx
        pressure[row_of, v, 1] += sense * fy
        pressure[row_of, v, 2] += sense * fz
        x += fx
        y += fy
        z += fz
    # A pressure on a wall falls along the throat, too. It takes up what spheres bear along the wall's normal: with the
    # throat's image behind the wall they would bear nothing.
    on_walls = 0
    for j in range(n_facets):
        own = throats.facets[start + j]
        sense = _sense(own, throats.facets[start], facets) if j > 0 else 1.0
        for v in range(3):
            part = sense * drops.drag_fractions[row + j, v]
            drag[row + j, v, 0] -= part * x
            drag[row + j, v, 1] -= part * y
            drag[row + j, v, 2] -= part * z
            on_walls += facets.vertices[own, v] >= vertices.n_spheres
    if on_walls > 0:
        own = throats.facets[start : start + n_facets]
        _move_to_walls((x, y, z), row, own, facets, vertices, drops, pressure, drag)


@helper
def _move_to_walls(moved, row, own, facets, vertices, drops, pressure, drag):
    """Take the components across walls from the pressure on these, instead of from the drag."""
    for axis in range(3):
        on_wall = _wall_across(axis, own, facets, vertices)
        if on_wall == 0:
            continue
        for j in range(own.shape[0]):
            sense = _sense(own[j], own[0], facets)
            for v in range(3):
                k = facets.vertices[own[j], v]
                drag[row + j, v, axis] += sense * drops.drag_fractions[row + j, v] * moved[axis]
                if k >= vertices.n_spheres and vertices.points[k, axis] != 0.0:
                    pressure[row + j, v, axis] -= sense * moved[axis] / on_wall


@helper
def _sense(f, first, facets):
    """1 where facet f has the sense of facet `first`, else -1."""
    return 1.0 if dot(vector_at(first, facets.normals), vector_at(f, facets.normals)) > 0.0 else -1.0


@helper
def _wall_across(axis, own, facets, vertices):
    """How many of a throat's own facets stand on a wall across an axis."""
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


@helper
def _set_side(fields, lane, side, c, top, end, drop):
    """What is known of one side; without a drop there, numbers that leave none."""
    _set_vector(fields, lane, _C + 3 * side, c)
    _set(fields, lane, _TOP + side, top if drop > 0.0 else 0.0)
    _set(fields, lane, _END + side, end if drop > 0.0 else 1.0)
    _set(fields, lane, _DROP + side, drop)


@helper(error_model="numpy", fastmath={"contract"})
def _integrate(group, fields):
    """Force on the patches of a group by the pressure's fall between the pores' Laguerre vertices and the neck.

    All patches of the group do the same, for the loop over them to be done in vectors: the loops over points are
    unrolled. Products and sums are fused where the processor can.
    """
    begin = _lane(group * _LANES)
    for i in range(np.uint64(_LANES)):
        lane = begin + i
        a = _direction(_get_vector(fields, lane, _A))
        b = _direction(_get_vector(fields, lane, _B))
        normal = cross_product(a, b)
        radius = _get(fields, lane, _RADIUS)
        on_i = _patch(a, b, normal, radius, lane, 0, fields)
        on_j = _patch(a, b, normal, radius, lane, 1, fields)
        _set_vector(fields, lane, 0, plus(on_i, on_j))


@helper(error_model="numpy", fastmath={"contract"})
def _patch(a, b, normal, radius, lane, side, fields):
    """Force on a sphere's patch on one side of the neck.

    The patch spans between three unit vectors from the sphere's centre: a and b in the neck, c to the vertex. There is
    none where points on the flat triangle come next to the sphere's centre, and would see more of it than a half: in a
    facet's corner of nearly 180° with the vertex opposite in its plane.
    """
    to_vertex = _get_vector(fields, lane, _C + 3 * side)
    square = dot(to_vertex, to_vertex)
    inverse = 1.0 / np.sqrt(square if square > 0.0 else 1.0)
    c = times(inverse, to_vertex)
    top = radius * inverse * _get(fields, lane, _TOP + side)  # of c, over e / β
    inverse_end = 1.0 / _get(fields, lane, _END + side)
    # Positive along the facet's normal, where pressure is lower than at the neck, negative on the other side of it.
    volume = dot(normal, c)
    seen = 0.0
    x = 0.0
    y = 0.0
    z = 0.0
    for p in range(2):
        wc = _NODES[p]
        for q in range(3):
            wb = (1.0 - wc) * _ACROSS[q]
            wa = 1.0 - wc - wb
            u = wa * a[0] + wb * b[0] + wc * c[0]
            v = wa * a[1] + wb * b[1] + wc * c[1]
            w = wa * a[2] + wb * b[2] + wc * c[2]
            far = u * u + v * v + w * w
            left = min(max(1.0 - _fall(top * wc, far) * inverse_end, 0.0), 1.0)
            # dA of a point of the flat triangle abc, seen from the centre: volume / distance³; and its unit vector.
            solid = (_WEIGHTS[p] * _ACROSS_WEIGHTS[q] * (1.0 - wc)) * volume / (far * far)
            seen += abs(solid) * np.sqrt(far)
            weight = left * solid
            x += weight * u
            y += weight * v
            z += weight * w
    factor = -_get(fields, lane, _DROP + side) * radius * radius if seen <= 2.0 * np.pi else 0.0
    return factor * x, factor * y, factor * z


@helper(error_model="numpy")
def _direction(v):
    """v / |v|, or v where that is zero, without a branch."""
    square = dot(v, v)
    factor = 1.0 / np.sqrt(square if square > 0.0 else 1.0)
    return factor * v[0], factor * v[1], factor * v[2]
