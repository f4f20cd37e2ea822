"""Solid volume and porosity by layer: exact segments of the spheres between planes normal to an axis."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from porefv.errors import InputError
from porefv.packing.box import WALL_NORMALS, Box, Floats
from porefv.packing.overlaps import cap_volume
from porefv.packing.packing import Packing
from porefv.system.number_checks import is_finite_number

_TINY = np.finfo(float).tiny


def layer_edges(box: Box, axis: int, layers: int) -> Floats:
    """(layers + 1,) places of the planes between equally thick layers along an axis of the box, walls included, m.

    Raises
    ------
    InputError
        If the number of layers is not a whole number, 1 or more.
    """
    if not (is_finite_number(layers) and layers >= 1 and layers == int(layers)):
        raise InputError(f"layers must be a whole number, 1 or more, not {layers!r}")
    return np.linspace(box.lower[axis], box.upper[axis], int(layers) + 1)


def layer_porosities(packing: Packing, axis: int, edges: ArrayLike) -> Floats:
    """Porosity of each layer between planes normal to an axis.

    The solid below a plane is the sum of the spherical segments below it, π h² (r - h / 3) with h the height of the
    plane above the lowest point of the sphere. As in `Packing.solid_volume`, what a pair of spheres shares counts once,
    and caps beyond walls do not count. Where a plane cuts a shared lens or a cap, each side has its exact part. The
    result is exact where no point belongs to three of the spheres and walls. Where there are such points, the volume
    that they take off the sums over pairs is divided among the layers in proportion to their solid. The porosities,
    weighted with the volumes of the layers, add up to `Packing.porosity`.

    Parameters
    ----------
    packing : Packing
        With a box.
    axis : int
        0, 1 or 2.
    edges : (l + 1,) array
        Increasing places along the axis, from the lower wall to the upper [m].

    Returns
    -------
    (l,) array

    Raises
    ------
    InputError
        If the edges do not increase from wall to wall.

    Examples
    --------
    >>> ball = Packing([[0.5, 0.5, 0.5]], [0.5], Box([0, 0, 0], [1, 1, 1]))
    >>> layer_porosities(ball, 2, [0.0, 0.5, 1.0]).round(6).tolist()  # 1 - π / 6
    [0.476401, 0.476401]
    """
    box = packing.box
    if box is None:
        raise InputError("the packing has no box, and layers lie between two of its walls")
    edges = np.asarray(edges, float)
    if edges.ndim != 1 or len(edges) < 2 or not (np.diff(edges) > 0.0).all():
        raise InputError("edges of layers must be two or more increasing places")
    if edges[0] != box.lower[axis] or edges[-1] != box.upper[axis]:
        raise InputError(
            f"edges of layers must lead from wall to wall, {box.lower[axis]:.6g} to {box.upper[axis]:.6g} m, "
            f"not {edges[0]:.6g} to {edges[-1]:.6g}"
        )
    # What is counted beyond the outer walls, balls and their caps alike, cancels in the first and the last layer.
    inner = [_solid_below(packing, axis, place) for place in edges[1:-1]]
    if packing.triple_overlaps:
        whole = _solid_below(packing, axis, np.inf)
        inner = [part * packing.solid_volume / whole for part in inner]
    below = [0.0, *inner, packing.solid_volume]
    return 1.0 - np.diff(below) / (np.diff(edges) * box.section(axis))


def _solid_below(packing: Packing, axis: int, place: float) -> float:
    """Solid volume below a plane by sums over pairs, m³."""
    centres, radii, found = packing.centres, packing.radii, packing.overlaps
    heights = place - centres[:, axis]
    total = cap_volume(radii, np.maximum(heights + radii, 0.0)).sum()
    i, j = found.pairs.T
    distance = np.maximum(radii[i] + radii[j] - found.depths, _TINY)
    # The plane in which two spheres meet, at this distance from each centre, cuts their lens in two caps.
    to_plane = 0.5 * (distance + (radii[i] - radii[j]) * (radii[i] + radii[j]) / distance)
    for spheres, others, depth in ((i, j, to_plane), (j, i, distance - to_plane)):
        cut, whole = _cut_and_whole(radii[spheres], depth, heights[spheres])
        normals = centres[others[cut]] - centres[spheres[cut]]
        normals /= np.maximum(np.linalg.norm(normals, axis=1), _TINY)[:, None]
        parts = _cap_below(radii[spheres[cut]], normals, depth[cut], axis, heights[spheres[cut]])
        total -= whole + parts.sum()
    spheres = found.wall_spheres
    depth = radii[spheres] - found.wall_depths
    cut, whole = _cut_and_whole(radii[spheres], depth, heights[spheres])
    normals = WALL_NORMALS[found.wall_ids[cut]]
    parts = _cap_below(radii[spheres[cut]], normals, depth[cut], axis, heights[spheres[cut]])
    return float(total - whole - parts.sum())


def _cut_and_whole(r: Floats, d: Floats, height: Floats) -> tuple[NDArray[np.int64], float]:
    """Which caps belong to balls that a plane at a height over the centres cuts; volume of those below it, m³."""
    below = height >= r
    clipped = np.clip(d[below], -r[below], r[below])
    return np.flatnonzero(np.abs(height) < r), float(cap_volume(r[below], r[below] - clipped).sum())


def _cap_below(r: Floats, normal: Floats, d: Floats, axis: int, height: Floats) -> Floats:
    """Volume of a ball where x·n > d and x_axis < height, x from its centre, m³.

    With the planes' normals n₁ = n and n₂ = -e_axis, it is ∮ x·ν dS / 3 over the surface of the body: r / 3 times its
    area on the sphere (two spherical caps that meet: Tovchigrechko & Vakser 2001), less d_i / 3 times its area in each
    plane, a segment of a circle.
    """
    d1, d2 = np.clip(d, -r, r), np.clip(-height, -r, r)
    cosine = -normal[:, axis]
    sine = np.linalg.norm(np.delete(normal, axis, axis=1), axis=1)
    c1, c2 = d1 / r, d2 / r  # cosines of the angular radii of the caps
    s1, s2 = np.sqrt((1.0 - c1) * (1.0 + c1)), np.sqrt((1.0 - c2) * (1.0 + c2))
    first, second = _angle(c2 - cosine * c1, sine * s1), _angle(c1 - cosine * c2, sine * s2)
    on_sphere = 2.0 * r**2 * (np.pi - _angle(cosine - c1 * c2, s1 * s2) - c1 * first - c2 * second)
    return (r * on_sphere - d1 * _segment(r * s1, first) - d2 * _segment(r * s2, second)) / 3.0


def _angle(adjacent: Floats, hypotenuse: Floats) -> Floats:
    """Arc cosine of a ratio; 0 or π where circles do not meet."""
    return np.arccos(np.clip(adjacent / np.maximum(hypotenuse, _TINY), -1.0, 1.0))


def _segment(radius: Floats, half_angle: Floats) -> Floats:
    """Area of a segment of a circle, m²."""
    return radius**2 * (half_angle - np.sin(half_angle) * np.cos(half_angle))
