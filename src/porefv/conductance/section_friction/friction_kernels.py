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
_POINTS = 4
_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(_POINTS)
_NODES, _WEIGHTS = 0.5 * (_NODES + 1.0), 0.5 * _WEIGHTS
# The points of both halves are worked out side by side, in vectors.
_LANES = 2 * _POINTS
# What is known of each point: its height s, the height of the pore's centre on its side, the weight of its friction in
# the integral; v and 1 - v of `_list_to_poles`.
_HEIGHT, _REACH, _WEIGHT, _V, _LEFT, _FIELDS = 0, 1, 2, 3, 4, 5


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
    powers : (n,) array
        ∛r² of each sphere [m^⅔].
    """

    friction: float
    curvature: float
    slip: np.ndarray
    powers: np.ndarray


class Sections(NamedTuple):
    """What all cross-sections of a throat have in common.

    Attributes
    ----------
    neck : float
        Fluid area A^f in the plane of the throat's facets [m²].
    on_walls : float
        Length of the perimeter on no-slip walls [m].
    radii, angles : (v,) arrays
        Radius of the sphere at each vertex of the facets and its angle θ there; three at least, the rest with θ = 0
        [m, -].
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
        Part between the Laguerre vertex and the centre of the first pore, and of the second [-]; without rows, it is
        not worked out.
    """
    most = 0
    for row in range(first, last):
        most = max(most, throats.starts[which[row] + 1] - throats.starts[which[row]])
    radii = np.empty(3 * most)
    angles = np.empty(3 * most)
    points = np.ones(_FIELDS * _LANES)
    for row in unsigned_range(first, last):
        t = which[row]
        conductivity[row] = 0.0
        if beyond.shape[0] > 0:
            beyond[row, 0] = 0.0
            beyond[row, 1] = 0.0
        if necks.areas[t] <= 0.0:
            continue
        sections = _sections(t, throats, facets, vertices, necks, drag, radii, angles)
        f = throats.facets[throats.starts[t]]
        begin, end = _span(f, facets, vertices, ends.centres, necks.lengths[t])
        if end - begin < 1e-9 * max(sections.widest, abs(begin), abs(end)):
            conductivity[row] = 1.0 / _friction(abs(end), abs(end), sections, points)
            continue
        down, up = _both_halves(max(-end, 0.0), -begin, max(begin, 0.0), end, sections, points)
        total = down + up
        conductivity[row] = STRETCH * necks.lengths[t] / total
        if beyond.shape[0] > 0:
            low, high = _span(f, facets, vertices, ends.laguerre_vertices, necks.lengths[t])
            down, up = _both_halves(max(-low, -end, 0.0), -begin, max(high, begin, 0.0), end, sections, points)
            beyond[row, 0] = down / total
            beyond[row, 1] = up / total


@helper
def _sections(t, throats, facets, vertices, necks, drag, radii, angles):
    """`Sections` of throat t; `radii` and `angles` are room for its discs."""
    start = throats.starts[t]
    count = throats.starts[t + 1] - start
    n_discs = 0
    on_walls = 0.0
    widest = 0.0
    total_angle = 0.0
    mean = 0.0
    for i in range(count):
        f = throats.facets[start + i]
        frame = frame_of(f, facets, vertices)
        of_vertices = facet_angles(frame, vertices.n_spheres)
        on_walls += _edges_on_walls(frame, vertices, drag.slip)
        for v in range(3):
            k = facets.vertices[f, v]
            if k < vertices.n_spheres:
                radii[n_discs] = vertices.sizes[k]
                angles[n_discs] = of_vertices[v]
                n_discs += 1
                widest = max(widest, vertices.sizes[k])
                total_angle += of_vertices[v]
                mean += of_vertices[v] * drag.powers[k]
    mean /= total_angle
    while n_discs < 3:  # walls take the place of a disc without an arc
        radii[n_discs] = widest
        angles[n_discs] = 0.0
        n_discs += 1
    roundness = necks.roundness[t]
    return Sections(
        neck=necks.areas[t],
        on_walls=on_walls,
        radii=radii[:n_discs],
        angles=angles[:n_discs],
        widest=widest,
        mean_radius=mean * np.sqrt(mean),
        doubling_height=np.sqrt(2.0 * necks.areas[t] / total_angle),
        opening_factor=roundness * np.sqrt(roundness),
        portion=necks.portions[t],
        friction=drag.friction,
        curvature=drag.curvature,
    )


@kernel
def centres_beyond_vertices(first, last, first_facets, facets, ends, beyond):
    """Fill in, of throats first ... last - 1, whether a pore's centre is further from its neck than the vertex is.

    Parameters
    ----------
    first, last : int
        Rows to treat: first ... last - 1.
    first_facets : (t,) int array
        A facet of each throat.
    facets : FacetPlanes
    ends : Ends
    beyond : (t,) bool array
        To be filled in.
    """
    for t in unsigned_range(first, last):
        f = first_facets[t]
        normal = vector_at(f, facets.normals)
        i = facets.cells[f, 0]
        j = facets.cells[f, 1]
        up_i = dot(minus(vector_at(i, ends.centres), vector_at(i, ends.laguerre_vertices)), normal)
        up_j = dot(minus(vector_at(j, ends.centres), vector_at(j, ends.laguerre_vertices)), normal)
        beyond[t] = up_i < 0.0 or up_j > 0.0


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
def _edges_on_walls(frame, vertices, slip):
    """Length of a facet's edges on no-slip walls [m]."""
    n = vertices.n_spheres
    on_walls = 0.0
    if frame.b >= n and not slip[frame.b - n]:
        on_walls += wall_distance(frame.a, frame.c, vertices)
    if frame.c >= n and not slip[frame.c - n]:
        on_walls += frame.twice if frame.b < n else wall_distance(frame.a, frame.b, vertices)
    return on_walls


@helper(error_model="numpy")
def _friction(s, reach, sections, points):
    """Resistance of a unit of length at height s over the neck, on the way to a pore's centre at height `reach`."""
    _set(points, 0, _HEIGHT, s)
    _set(points, 0, _REACH, reach)
    _set(points, 0, _WEIGHT, 1.0)
    _weigh(False, sections, points)
    return _get(points, 0, _WEIGHT)


@helper(error_model="numpy")
def _both_halves(low_a, high_a, low_b, high_b, sections, points):
    """Friction between two heights, 0 <= low < high, in either half of a throat; nothing where low is not below high.

    From the neck to the poles of the widest sphere and beyond them, points are placed differently.
    """
    widest = sections.widest
    # Lattices: points to the poles have a root there, which makes much of rounding.
    if abs(high_a - widest) < 1e-9 * widest:
        high_a = widest
    if abs(high_b - widest) < 1e-9 * widest:
        high_b = widest
    down = 0.0
    up = 0.0
    if min(low_a, low_b) < widest:
        _list_to_poles(0, low_a, high_a, sections, points)
        _list_to_poles(1, low_b, high_b, sections, points)
        _weigh(True, sections, points)
        down += _sum_of_half(0, points)
        up += _sum_of_half(1, points)
    if max(high_a, high_b) > widest:
        _list_beyond_poles(0, low_a, high_a, sections, points)
        _list_beyond_poles(1, low_b, high_b, sections, points)
        _weigh(False, sections, points)
        down += _sum_of_half(0, points)
        up += _sum_of_half(1, points)
    return down, up


@helper(error_model="numpy")
def _list_to_poles(half, low, high, sections, points):
    """Points of a half between two heights, up to the poles of the widest sphere.

    In t, s = r t (3 - t²) / 2, where the perimeter has no root; and in v = t / √(t² + e²), where points are as dense as
    the doubling height requires. v, its differences and 1 - v are without cancellation: far from a narrow neck v is
    nearly 1.
    """
    first = 0.0
    span = 0.0
    left = 1.0
    if low < min(high, sections.widest):
        e = sections.doubling_height / sections.widest
        begin = _pole_part(low / sections.widest)
        end = _pole_part(min(high / sections.widest, 1.0))
        at_begin, at_end = np.hypot(begin, e), np.hypot(end, e)
        first, last = begin / at_begin, end / at_end
        span = (end - begin) * (end + begin) * (e / at_begin / at_end) ** 2 / (first + last)
        left = e / at_begin * (e / (at_begin + begin))
    for i in range(_POINTS):
        lane = half * _POINTS + i
        _set(points, lane, _V, first + span * _NODES[i])
        _set(points, lane, _LEFT, left - span * _NODES[i])
        _set(points, lane, _WEIGHT, span * _WEIGHTS[i])
        _set(points, lane, _REACH, high if span > 0.0 else sections.widest)


@helper
def _pole_part(height):
    """t of a height over the largest radius: t (3 - t²) / 2 is that."""
    return 2.0 * np.sin(np.arcsin(height) / 3.0) if height > 0.0 else 0.0


@helper(error_model="numpy", fastmath={"contract"})
def _place_to_poles(lane, sections, points):
    """Height and weight of a point that `_list_to_poles` has listed."""
    widest = sections.widest
    e = sections.doubling_height / widest
    v = _get(points, lane, _V)
    root = np.sqrt(_get(points, lane, _LEFT) * (1.0 + v))
    t = e * v / root
    rate = 1.5 * widest * (1.0 - t * t) * e / (root * root * root)
    _set(points, lane, _HEIGHT, 0.5 * widest * t * (3.0 - t * t))
    _set(points, lane, _WEIGHT, rate * _get(points, lane, _WEIGHT))


@helper(error_model="numpy")
def _list_beyond_poles(half, low, high, sections, points):
    """Points of a half between two heights, as far as they are beyond the poles of the widest sphere: in log s."""
    widest = sections.widest
    begin = 0.0
    span = 0.0
    if high > max(low, widest):
        begin = np.log(max(low / widest, 1.0))
        span = np.log(high / widest) - begin
    for i in range(_POINTS):
        lane = half * _POINTS + i
        s = widest * np.exp(begin + span * _NODES[i])
        _set(points, lane, _HEIGHT, s)
        _set(points, lane, _WEIGHT, span * _WEIGHTS[i] * s)
        _set(points, lane, _REACH, high if span > 0.0 else s)


@helper(error_model="numpy", fastmath={"contract"})
def _weigh(to_poles, sections, points):
    """Multiply the weight of each point by the resistance of a unit of length at its height.

    `to_poles` says that points are as `_list_to_poles` lists them, and heights are still to be worked out.
    With three discs, as but for ties, the loop has no other one in it, and is done in vectors. Products and sums are
    fused where the processor can.
    """
    radii, angles = sections.radii, sections.angles
    if radii.shape[0] == 3:
        # Outside of the loop: there an array might be written to.
        radius_a, radius_b, radius_c = radii[0], radii[1], radii[2]
        angle_a, angle_b, angle_c = angles[0], angles[1], angles[2]
        for lane in range(np.uint64(_LANES)):
            if to_poles:
                _place_to_poles(lane, sections, points)
            s = _get(points, lane, _HEIGHT)
            growth_a, arc_a = _disc(s, radius_a, angle_a)
            growth_b, arc_b = _disc(s, radius_b, angle_b)
            growth_c, arc_c = _disc(s, radius_c, angle_c)
            _multiply_weight(lane, growth_a + growth_b + growth_c, arc_a + arc_b + arc_c, sections, points)
        return
    for lane in range(np.uint64(_LANES)):
        if to_poles:
            _place_to_poles(lane, sections, points)
        growth = 0.0
        arcs = 0.0
        for v in range(radii.shape[0]):
            more, arc = _disc(_get(points, lane, _HEIGHT), radii[v], angles[v])
            growth += more
            arcs += arc
        _multiply_weight(lane, growth, arcs, sections, points)


@helper(error_model="numpy", fastmath={"contract"})
def _disc(s, r, angle):
    """What a disc at height s has given to the section since the neck, and the arc that is wetted [m², m]."""
    within = min(s, r)
    part = r / max(s, r)
    least = LEAST_DISC * r * part * part
    return 0.5 * angle * within * within, angle * np.sqrt(max((r - s) * (r + s), least * least))


@helper(error_model="numpy", fastmath={"contract"})
def _multiply_weight(lane, growth, arcs, sections, points):
    """Multiply the weight of a point by the resistance of its section."""
    perimeter = sections.on_walls + arcs
    reach = _get(points, lane, _REACH)
    kept = 1.0 - NARROWING * _get(points, lane, _HEIGHT) / (reach if reach > 0.0 else 1.0)
    area = sections.neck + (kept * growth if reach > 0.0 else 0.0)
    width = max(np.sqrt(area / (np.pi * sections.portion)), 2.0 * area / perimeter)
    friction = sections.friction * perimeter + 2.0 * sections.curvature / sections.mean_radius * area
    resistance = friction / (area * area * (sections.opening_factor * width))
    _set(points, lane, _WEIGHT, resistance * _get(points, lane, _WEIGHT))


@helper
def _sum_of_half(half, points):
    total = 0.0
    for i in range(_POINTS):
        total += _get(points, half * _POINTS + i, _WEIGHT)
    return total


@helper
def _get(points, lane, field):
    return points[np.uint64(field * _LANES) + np.uint64(lane)]


@helper
def _set(points, lane, field, value):
    points[np.uint64(field * _LANES) + np.uint64(lane)] = value
