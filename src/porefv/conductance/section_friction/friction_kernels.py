"""Kernels of section friction: friction in the cross-sections of a throat, one after another from pore to pore.

The centres of a throat's spheres lie in its facet's plane. At a height s over it the spheres are discs of radius
√(r² - s²), whose arcs are wetted by the fluid, and leave it the area A^f + Σ θ min(s, r)² / 2 of the prism over
the facet. So the section opens as those of a hyperboloid do, whatever the sizes of spheres.
"""

from __future__ import annotations

import numpy as np

from porefv.mesh.facet_kernels import facet_angles, facet_corners
from porefv.mesh.vectors import dot, minus, vector_at, wall_distance
from porefv.system.kernels import njit, prange

# A hyperboloid as wide at its neck as it is long, which four spheres make, loses pressure over √2 times that length.
STRETCH = np.sqrt(0.5)
# The part of its growth that a section loses to other throats, on the way to the pore's centre where they all meet.
NARROWING = 2.0 / 3.0
# The part of its length that a throat keeps, should the centres of its pores have come closer than their vertices.
LEAST_SPAN = 0.1
# Beyond its poles a sphere still slows the fluid down: at s > r as a disc of this part of its radius times (r / s)².
LEAST_DISC = 0.3
# Four points in either half of a throat integrate its friction within some 0.3 %.
_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(4)
_NODES, _WEIGHTS = 0.5 * (_NODES + 1.0), 0.5 * _WEIGHTS


@njit(cache=True, parallel=True, error_model="numpy")
def section_friction(
    which, facets, starts, facet_vertices, facet_cells, n, points, sizes, vertices, centres, normals, lengths, areas,
    roundness, portions, slip, c1, c2, conductivity, beyond,
):  # fmt: skip
    """Length over friction of each throat, 0 without a fluid area, and the parts of its friction beyond vertices."""
    for row in prange(which.shape[0]):
        t = which[row]
        conductivity[row] = 0.0
        beyond[row] = 0.0
        if areas[t] <= 0.0:
            continue
        f = facets[starts[t]]
        count = starts[t + 1] - starts[t]
        radii = np.zeros(3 * count)
        angles = np.zeros(3 * count)
        wall = 0.0
        for i in range(count):
            wall += _discs(
                facets[starts[t] + i], facet_vertices, n, points, sizes, slip,
                radii[3 * i : 3 * i + 3], angles[3 * i : 3 * i + 3],
            )  # fmt: skip
        turn = angles.sum()
        widest = radii.max()
        radius = 0.0
        for v in range(radii.shape[0]):
            if radii[v] > 0.0:
                radius += angles[v] * np.cbrt(radii[v] / widest) ** 2
        radius = widest * np.sqrt(radius / turn) ** 3
        shape = areas[t], wall, radii, angles, portions[t], roundness[t] ** 1.5, radius, c1, c2
        neck = np.sqrt(2.0 * areas[t] / turn)
        begin, end = _span(f, facet_cells, facet_vertices, points, centres, normals, lengths[t])
        first, last = _span(f, facet_cells, facet_vertices, points, vertices, normals, lengths[t])
        if end - begin < 1e-9 * max(widest, abs(begin), abs(end)):
            conductivity[row] = 1.0 / _friction(abs(end), abs(end), shape)
            continue
        total = 0.0
        if begin < 0.0:
            total += _between(max(-end, 0.0), -begin, widest, neck, shape)
        if end > 0.0:
            total += _between(max(begin, 0.0), end, widest, neck, shape)
        conductivity[row] = STRETCH * lengths[t] / total
        if -begin > max(-first, -end, 0.0):
            beyond[row, 0] = _between(max(-first, -end, 0.0), -begin, widest, neck, shape) / total
        if end > max(last, begin, 0.0):
            beyond[row, 1] = _between(max(last, begin, 0.0), end, widest, neck, shape) / total


@njit(cache=True)
def _span(f, facet_cells, facet_vertices, points, ends, normals, length):
    """Heights over facet f, times √½, between which its throat extends: of the ends of its two pores.

    `LEAST_SPAN` of the throat's length is left to it.
    """
    first = vector_at(facet_vertices[f, 0], points)
    low = dot(minus(vector_at(facet_cells[f, 0], ends), first), vector_at(f, normals))
    high = dot(minus(vector_at(facet_cells[f, 1], ends), first), vector_at(f, normals))
    least = LEAST_SPAN * length
    if high - low < least:
        low, high = 0.5 * (low + high - least), 0.5 * (low + high + least)
    return STRETCH * low, STRETCH * high


@njit(cache=True)
def _discs(f, facet_vertices, n, points, sizes, slip, radii, angles):
    """Radii of the spheres of facet f and its angles there; returns the length of its edges on no-slip walls."""
    a, b, c, ab, ac, _, twice = facet_corners(f, facet_vertices, n, points)
    angles[0], angles[1], angles[2] = facet_angles(b, c, n, ab, ac, twice)
    radii[0] = sizes[a]
    if b < n:
        radii[1] = sizes[b]
    if c < n:
        radii[2] = sizes[c]
        return 0.0
    on_c = 0.0 if slip[c - n] else (twice if b < n else wall_distance(a, b, points, sizes))
    on_b = 0.0 if b < n or slip[b - n] else wall_distance(a, c, points, sizes)
    return on_b + on_c


@njit(cache=True, error_model="numpy")
def _friction(s, reach, shape):
    """Resistance of a unit of length at height s over the neck, on the way to a pore's centre at height `reach`."""
    neck, perimeter, radii, angles, portion, roundness, radius, c1, c2 = shape
    growth = 0.0
    for v in range(radii.shape[0]):
        r = radii[v]
        least = LEAST_DISC * r
        if s > r:
            least *= (r / s) ** 2
        growth += 0.5 * angles[v] * min(s, r) ** 2
        perimeter += angles[v] * np.sqrt(max((r - s) * (r + s), least**2))
    area = neck + (1.0 - NARROWING * s / reach) * growth if reach > 0.0 else neck
    opening = roundness * max(np.sqrt(area / (np.pi * portion)), 2.0 * area / perimeter)
    return (c1 * perimeter + 2.0 * c2 * area / radius) / (area * area * opening)


@njit(cache=True, error_model="numpy")
def _between(low, high, widest, neck, shape):
    """Friction between two heights, 0 <= low < high.

    From the neck to the poles of the widest sphere in t, s = r t (3 - t²) / 2, where the perimeter has no root, and
    points are as dense as the neck, of the length given, asks for. Beyond in the logarithm of s.
    """
    if abs(high - widest) < 1e-9 * widest:  # lattices: t has a root there, which makes much of rounding
        high = widest
    total = 0.0
    if high > widest:
        begin = np.log(max(low / widest, 1.0))
        end = np.log(high / widest)
        for i in range(_NODES.shape[0]):
            s = widest * np.exp(begin + (end - begin) * _NODES[i])
            total += (end - begin) * _WEIGHTS[i] * s * _friction(s, high, shape)
    if low >= widest:
        return total
    e = neck / widest
    begin = 2.0 * np.sin(np.arcsin(low / widest) / 3.0)
    end = 2.0 * np.sin(np.arcsin(min(high / widest, 1.0)) / 3.0)
    # v = t / √(t² + e²), its differences and 1 - v without cancellation: far from a narrow neck v is nearly 1.
    at_begin, at_end = np.hypot(begin, e), np.hypot(end, e)
    first, last = begin / at_begin, end / at_end
    span = (end - begin) * (end + begin) * (e / at_begin / at_end) ** 2 / (first + last)
    left = e / at_begin * (e / (at_begin + begin))
    for i in range(_NODES.shape[0]):
        v = first + span * _NODES[i]
        root = np.sqrt((left - span * _NODES[i]) * (1.0 + v))
        t = e * v / root
        rate = 1.5 * widest * (1.0 - t * t) * e / root**3
        total += span * _WEIGHTS[i] * rate * _friction(0.5 * widest * t * (3.0 - t * t), high, shape)
    return total
