"""Kernels that find the fluid nodes of a lattice, and what ends or mirrors each link between nodes.

The 19 directions are those of D3Q19: rest, 6 axes, 12 diagonals. A direction and its opposite follow one another.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from porefv.system.kernels import helper, kernel

DIRECTIONS = np.array(
    [[0, 0, 0], [1, 0, 0], [-1, 0, 0], [0, 1, 0], [0, -1, 0], [0, 0, 1], [0, 0, -1], [1, 1, 0], [-1, -1, 0], [1, -1, 0],
     [-1, 1, 0], [1, 0, 1], [-1, 0, -1], [1, 0, -1], [-1, 0, 1], [0, 1, 1], [0, -1, -1], [0, 1, -1], [0, -1, 1]]
)  # fmt: skip
OPPOSITE = np.array([0, *(q + 1 if q % 2 else q - 1 for q in range(1, 19))])
WEIGHTS = np.array([1 / 3] + 6 * [1 / 18] + 12 * [1 / 36])
# Kinds of walls.
NO_SLIP, SYMMETRY, OPEN = 0, 1, 2
# Spheres that may be near one node: more than touch one sphere.
_MOST_NEAR = 64
_NONE = 2.0  # further than any link is long


class Ends(NamedTuple):
    """Links that end on solids, `counts[0]` of them, and those that come from images, `counts[1]`, with their sources.

    See `porefv.resolved.lattice.Cuts` and `Images`.
    """

    cut_nodes: np.ndarray
    cut_directions: np.ndarray
    fractions: np.ndarray
    bodies: np.ndarray
    passed: np.ndarray
    image_nodes: np.ndarray
    image_directions: np.ndarray
    walls: np.ndarray
    imposed: np.ndarray
    starts: np.ndarray
    origins: np.ndarray
    origin_directions: np.ndarray
    weights: np.ndarray


def room_for(cuts: int, images: int, origins: int) -> Ends:
    """Empty arrays for so many links and sources."""
    return Ends(
        np.empty(cuts, np.int32), np.empty(cuts, np.int8), np.empty(cuts), np.empty(cuts, np.int32),
        np.empty((cuts, 3), np.int8), np.empty(images, np.int32), np.empty(images, np.int8),
        np.empty(images, np.int8), np.empty(images), np.zeros(images + 1, np.int64),
        np.empty(origins, np.int32), np.empty(origins, np.int8), np.empty(origins),
    )  # fmt: skip


@kernel
def mark_spheres(centres, radii, owner, depth):
    """The sphere in which each node lies deepest, and how deep [spacings]; -1 outside of all."""
    for s in range(radii.shape[0]):
        x, y, z = centres[s]
        r = radii[s]
        for i in range(max(0, int(np.ceil(x - r - 0.5))), min(owner.shape[0] - 1, int(np.floor(x + r - 0.5))) + 1):
            for j in range(max(0, int(np.ceil(y - r - 0.5))), min(owner.shape[1] - 1, int(np.floor(y + r - 0.5))) + 1):
                for k in range(
                    max(0, int(np.ceil(z - r - 0.5))), min(owner.shape[2] - 1, int(np.floor(z + r - 0.5))) + 1
                ):
                    d = r - np.sqrt((i + 0.5 - x) ** 2 + (j + 0.5 - y) ** 2 + (k + 0.5 - z) ** 2)
                    if d >= 0.0 and (owner[i, j, k] < 0 or d > depth[i, j, k]):
                        owner[i, j, k] = s
                        depth[i, j, k] = d


@helper
def _entry(x, step, centre, radius):
    """The first s in [0, 1] where x + s step is in a sphere, or more than 1."""
    a = b = 0.0
    d = -radius * radius
    for k in range(3):
        v = x[k] - centre[k]
        a += step[k] * step[k]
        b += v * step[k]
        d += v * v
    square = b * b - a * d
    if square <= 0.0 or b >= 0.0:
        return _NONE
    s = (-b - np.sqrt(square)) / a
    return max(s, 0.0) if s <= 1.0 else _NONE


@kernel
def classify(places, node, owner, centres, radii, kinds, beyond, sources, ends, counts, filling):
    """Where each population comes from: another node, a cut link or an image.

    Twice: at first (`filling` false) links are counted, then they are filled in.

    Parameters
    ----------
    places : (n, 3) int32 array
        Of fluid nodes.
    node, owner : int32 arrays of the shape of the lattice
        Number of each fluid node; sphere of each other node.
    centres, radii : arrays
        Of spheres [spacings].
    kinds : (6,) int8 array
    beyond : (3,) array
        Distance of the last nodes from the upper walls [spacings].
    sources : (19, n) int32 array
        Filled in; cut links as -2 - their number, images as -2 - number of cut links - their number.
    ends : Ends
    counts : (3,) int64 array
        Cut links, images, sources of images.
    """
    shape = owner.shape
    near = np.empty(_MOST_NEAR, np.int64)
    x, step, mirrored, target = np.empty(3), np.empty(3), np.empty(3), np.empty(3, np.int64)
    crossed = np.empty(3, np.int64)
    cuts = images = origins = 0
    total_cuts = counts[0]
    for i in range(places.shape[0]):
        n_near = 0
        for a in range(max(0, places[i, 0] - 1), min(shape[0], places[i, 0] + 2)):
            for b in range(max(0, places[i, 1] - 1), min(shape[1], places[i, 1] + 2)):
                for c in range(max(0, places[i, 2] - 1), min(shape[2], places[i, 2] + 2)):
                    o = owner[a, b, c]
                    if o >= 0:
                        known = False
                        for k in range(n_near):
                            if near[k] == o:
                                known = True
                        if not known and n_near < _MOST_NEAR:
                            near[n_near] = o
                            n_near += 1
        for k in range(3):
            x[k] = places[i, k] + 0.5
        for q in range(1, 19):
            back = OPPOSITE[q]
            mirror = False
            best, body, through = _NONE, -1, 0
            for k in range(3):
                step[k] = DIRECTIONS[q, k]
                target[k] = places[i, k] + DIRECTIONS[q, k]
                crossed[k] = -1
                if target[k] < 0:
                    crossed[k] = 2 * k
                elif target[k] >= shape[k]:
                    crossed[k] = 2 * k + 1
                if crossed[k] >= 0:
                    if kinds[crossed[k]] == NO_SLIP:
                        away = 0.5 if target[k] < 0 else min(beyond[k], 1.0)
                        if away < best:
                            best, body = away, radii.shape[0] + crossed[k]
                    else:
                        mirror = True
            if body >= 0:
                through = 7  # at an edge: all planes that are passed
            for m in range(n_near):
                s = near[m]
                for mask in range(8):  # the sphere, and its images in the planes that are passed
                    possible = True
                    for k in range(3):
                        mirrored[k] = centres[s, k]
                        if mask >> k & 1:
                            if crossed[k] < 0 or kinds[crossed[k]] == NO_SLIP:
                                possible = False
                            else:
                                plane = 0.0 if target[k] < 0 else shape[k] - 0.5 + beyond[k]
                                mirrored[k] = 2.0 * plane - centres[s, k]
                    if possible:
                        at = _entry(x, step, mirrored, radii[s])
                        if at < best:
                            best, body, through = at, s, mask
            if body < 0 and not mirror and node[target[0], target[1], target[2]] < 0:
                best, body = 1.0, owner[target[0], target[1], target[2]]  # by rounding
            if body >= 0:
                if filling:
                    ends.cut_nodes[cuts], ends.cut_directions[cuts] = i, q
                    ends.fractions[cuts], ends.bodies[cuts] = best, body
                    for k in range(3):
                        plane = crossed[k] >= 0 and through >> k & 1 and kinds[crossed[k]] != NO_SLIP
                        ends.passed[cuts, k] = crossed[k] if plane else -1
                    sources[back, i] = -2 - cuts
                cuts += 1
                continue
            if not mirror:
                if filling:
                    sources[back, i] = node[target[0], target[1], target[2]]
                continue
            wall = -1
            for k in range(3):
                if crossed[k] >= 0 and (wall < 0 or kinds[crossed[k]] == OPEN):
                    wall = crossed[k]
            first, total, odd = origins, 0.0, 0.0
            for mask in range(8):  # along each axis that passes a wall, one of two places between which it is linear
                weight, sign = 1.0, 1.0
                for k in range(3):
                    target[k] = places[i, k]
                    step[k] = -DIRECTIONS[q, k]
                    if crossed[k] < 0:
                        target[k] += DIRECTIONS[q, k]
                        if mask >> k & 1:
                            weight = 0.0
                        continue
                    away = 0.5 if crossed[k] == 2 * k else beyond[k]
                    second = mask >> k & 1 == 1
                    if away <= 0.5:  # the node at the wall, and the one before it
                        weight *= 1.0 - 2.0 * away if second else 2.0 * away
                        if second:
                            target[k] -= DIRECTIONS[q, k]
                    else:  # the node at the wall, and its image
                        weight *= 1.0 - 0.5 / away if second else 0.5 / away
                    if away <= 0.5 or not second:
                        step[k] = DIRECTIONS[q, k]
                        if kinds[crossed[k]] == OPEN:
                            sign = -sign
                inside = weight > 0.0
                for k in range(3):
                    inside = inside and 0 <= target[k] < shape[k]
                if not inside or node[target[0], target[1], target[2]] < 0:
                    continue
                direction = 0
                for other in range(1, 19):
                    if (
                        DIRECTIONS[other, 0] == step[0]
                        and DIRECTIONS[other, 1] == step[1]
                        and DIRECTIONS[other, 2] == step[2]
                    ):
                        direction = other
                if filling:
                    ends.origins[origins] = node[target[0], target[1], target[2]]
                    ends.origin_directions[origins], ends.weights[origins] = direction, sign * weight
                origins += 1
                total += weight
                if sign < 0.0:
                    odd += weight
            if origins == first:  # all of them are in solids
                origins, total = first + 1, 1.0
                odd = 1.0 if kinds[wall] == OPEN else 0.0
                if filling:
                    ends.origins[first], ends.origin_directions[first] = i, q
                    ends.weights[first] = -1.0 if kinds[wall] == OPEN else 1.0
            if filling:
                for k in range(first, origins):
                    ends.weights[k] /= total
                ends.image_nodes[images], ends.image_directions[images] = i, back
                ends.walls[images], ends.imposed[images] = wall, odd / total
                ends.starts[images + 1] = origins
                sources[back, i] = -2 - total_cuts - images
            images += 1
    counts[0], counts[1], counts[2] = cuts, images, origins
