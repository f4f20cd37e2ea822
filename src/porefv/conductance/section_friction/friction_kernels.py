"""Kernels of section friction: friction in the cross-sections of a throat, one after another from pore to pore.

The centres of a throat's spheres lie in its facet's plane. At a height s over it the spheres are discs of radius
√(r² - s²), whose arcs are wetted by the fluid, and leave it the area A^f + Σ θ min(s, r)² / 2 of the prism over
the facet. So the section opens as those of a hyperboloid do, whatever the sizes of spheres.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from porefv.mesh.facet_kernels import facet_angles, frame_of
from porefv.mesh.vectors import dot, minus, vector_at, wall_distance
from porefv.system.kernels import helper, kernel, unsigned_range

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


class Ends(NamedTuple):
    """Where throats may end: two points of each cell, from the local origin.

    Attributes
    ----------
    laguerre_vertices, centres : (m, 3) arrays
        The cell's Laguerre vertex, and the centre of its pore [m].
    """

    laguerre_vertices: np.ndarray
    centres: np.ndarray


class Necks(NamedTuple):
    """The constriction of each throat, in the plane of its facets.

    Attributes
    ----------
    lengths : (t,) array
        L of each throat [m].
    areas : (t,) array
        Fluid area A^f of its constriction [m²].
    roundness : (t,) array
        λ [-].
    portions : (t,) array
        χ, the part of the inscribed circle that lies within the throat [-].
    """

    lengths: np.ndarray
    areas: np.ndarray
    roundness: np.ndarray
    portions: np.ndarray


class Drag(NamedTuple):
    """What the friction in a section depends on besides its geometry.

    Attributes
    ----------
    friction, curvature : float
        c₁ and c₂ of `SectionFriction` [-].
    slip : (6,) bool array
        Walls of symmetry, without friction.
    """

    friction: float
    curvature: float
    slip: np.ndarray


class Sections(NamedTuple):
    """What all cross-sections of a throat have in common.

    Attributes
    ----------
    neck : float
        Fluid area A^f in the plane of the throat's facets [m²].
    on_walls : float
        Length of the perimeter on no-slip walls [m].
    radii, angles : (v,) arrays
        Radius of the sphere at each vertex of the facets and its angle θ there, 0 for walls [m, -].
    widest : float
        The largest radius [m].
    mean_radius : float
        Mean of ∛r² weighed by the angles, to the power of 3/2 [m].
    doubling_height : float
        Height at which Σ θ s² / 2 is the area of the neck [m].
    opening_factor : float
        λ^{3/2} [-].
    portion : float
        χ [-].
    friction, curvature : float
        c₁ and c₂ [-].
    """

    neck: float
    on_walls: float
    radii: np.ndarray
    angles: np.ndarray
    widest: float
    mean_radius: float
    doubling_height: float
    opening_factor: float
    portion: float
    friction: float
    curvature: float


@kernel(error_model="numpy")
def section_friction(first, last, which, throats, facets, vertices, ends, necks, drag, conductivity, beyond):
    """Fill in length over friction of some throats, and the parts of their friction beyond the Laguerre vertices.

    Parameters
    ----------
    first, last : int
        Rows to treat: first ... last - 1.
    which : (u,) int array
        The throats.
    throats : ThroatFacets
    facets : FacetPlanes
    vertices : Vertices
    ends : Ends
    necks : Necks
    drag : Drag
    conductivity : (u,) array
        0 without a fluid area [m⁴].
    beyond : (u, 2) array
        Part between the Laguerre vertex and the centre of the first pore, and of the second [-].
    """
    for row in unsigned_range(first, last):
        t = which[row]
        conductivity[row] = 0.0
        beyond[row, 0] = 0.0
        beyond[row, 1] = 0.0
        if necks.areas[t] <= 0.0:
            continue
        start = throats.starts[t]
        count = throats.starts[t + 1] - start
        radii = np.zeros(3 * count)
        angles = np.zeros(3 * count)
        on_walls = 0.0
        for i in range(count):
            f = throats.facets[start + i]
            on_walls += _discs(f, facets, vertices, drag.slip, radii[3 * i : 3 * i + 3], angles[3 * i : 3 * i + 3])
        widest = radii.max()
        total_angle = angles.sum()
        mean = 0.0
        for v in range(radii.shape[0]):
            if radii[v] > 0.0:
                mean += angles[v] * np.cbrt(radii[v] / widest) ** 2
        sections = Sections(
            neck=necks.areas[t],
            on_walls=on_walls,
            radii=radii,
            angles=angles,
            widest=widest,
            mean_radius=widest * np.sqrt(mean / total_angle) ** 3,
            doubling_height=np.sqrt(2.0 * necks.areas[t] / total_angle),
            opening_factor=necks.roundness[t] ** 1.5,
            portion=necks.portions[t],
            friction=drag.friction,
            curvature=drag.curvature,
        )
        f = throats.facets[start]
        begin, end = _span(f, facets, vertices, ends.centres, necks.lengths[t])
        first, last = _span(f, facets, vertices, ends.laguerre_vertices, necks.lengths[t])
        if end - begin < 1e-9 * max(widest, abs(begin), abs(end)):
            conductivity[row] = 1.0 / _friction(abs(end), abs(end), sections)
            continue
        total = 0.0
        if begin < 0.0:
            total += _between(max(-end, 0.0), -begin, sections)
        if end > 0.0:
            total += _between(max(begin, 0.0), end, sections)
        conductivity[row] = STRETCH * necks.lengths[t] / total
        if -begin > max(-first, -end, 0.0):
            beyond[row, 0] = _between(max(-first, -end, 0.0), -begin, sections) / total
        if end > max(last, begin, 0.0):
            beyond[row, 1] = _between(max(last, begin, 0.0), end, sections) / total


@helper
def _span(f, facets, vertices, points, length):
    """Heights over facet f, times √½, between which its throat extends: those of two points (m, 3) of its cells.

    `LEAST_SPAN` of the throat's length is left to it.
    """
    origin = vector_at(facets.vertices[f, 0], vertices.points)
    normal = vector_at(f, facets.normals)
    low = dot(minus(vector_at(facets.cells[f, 0], points), origin), normal)
    high = dot(minus(vector_at(facets.cells[f, 1], points), origin), normal)
    least = LEAST_SPAN * length
    if high - low < least:
        low, high = 0.5 * (low + high - least), 0.5 * (low + high + least)
    return STRETCH * low, STRETCH * high


@helper
def _discs(f, facets, vertices, slip, radii, angles):
    """Fill radii (3,) and angles (3,) of the spheres of facet f; returns the length of its edges on no-slip walls."""
    n = vertices.n_spheres
    frame = frame_of(f, facets, vertices)
    angles[0], angles[1], angles[2] = facet_angles(frame, n)
    radii[0] = vertices.sizes[frame.a]
    if frame.b < n:
        radii[1] = vertices.sizes[frame.b]
    if frame.c < n:
        radii[2] = vertices.sizes[frame.c]
    on_walls = 0.0
    if frame.b >= n and not slip[frame.b - n]:
        on_walls += wall_distance(frame.a, frame.c, vertices)
    if frame.c >= n and not slip[frame.c - n]:
        on_walls += frame.twice if frame.b < n else wall_distance(frame.a, frame.b, vertices)
    return on_walls


@helper(error_model="numpy")
def _friction(s, reach, sections):
    """Resistance of a unit of length at height s over the neck, on the way to a pore's centre at height `reach`."""
    growth = 0.0
    perimeter = sections.on_walls
    for v in range(sections.radii.shape[0]):
        r = sections.radii[v]
        angle = sections.angles[v]
        least = LEAST_DISC * r
        if s > r:
            least *= (r / s) ** 2
        growth += 0.5 * angle * min(s, r) ** 2
        perimeter += angle * np.sqrt(max((r - s) * (r + s), least**2))
    area = sections.neck + (1.0 - NARROWING * s / reach) * growth if reach > 0.0 else sections.neck
    width = max(np.sqrt(area / (np.pi * sections.portion)), 2.0 * area / perimeter)
    opening = sections.opening_factor * width
    c1, c2 = sections.friction, sections.curvature
    return (c1 * perimeter + 2.0 * c2 * area / sections.mean_radius) / (area * area * opening)


@helper(error_model="numpy")
def _between(low, high, sections):
    """Friction between two heights, 0 <= low < high.

    From the neck to the poles of the widest sphere in t, s = r t (3 - t²) / 2, where the perimeter has no root, and
    points are as dense as the doubling height requires. Beyond in the logarithm of s.
    """
    widest = sections.widest
    if abs(high - widest) < 1e-9 * widest:  # lattices: t has a root there, which makes much of rounding
        high = widest
    total = 0.0
    if high > widest:
        begin = np.log(max(low / widest, 1.0))
        end = np.log(high / widest)
        for i in range(_NODES.shape[0]):
            s = widest * np.exp(begin + (end - begin) * _NODES[i])
            total += (end - begin) * _WEIGHTS[i] * s * _friction(s, high, sections)
    if low >= widest:
        return total
    e = sections.doubling_height / widest
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
        s = 0.5 * widest * t * (3.0 - t * t)
        total += span * _WEIGHTS[i] * rate * _friction(s, high, sections)
    return total
