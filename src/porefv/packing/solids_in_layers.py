"""Kernel of the solid between planes normal to an axis: exact for any overlap.

The union of balls is the sum of the parts of the balls in their Laguerre cells. A neighbour or a wall cuts a ball with
one plane; the two planes of a layer cut it likewise. What is left is the ball within a convex polyhedron. Where no two
of these planes meet in the ball, it is the ball less one cap for each plane. Otherwise it is a signed sum of
orthoschemes,

    centre of the ball,  foot F_1 on a face,  foot F_2 on an edge of that face,  end of that edge,

two for each edge of each face. A ball within an orthoscheme has a closed form. Lengths are relative to the radius of
the ball.
"""

from __future__ import annotations

import numpy as np

from porefv.packing.orthoschemes import ball_in_orthoscheme
from porefv.system.kernels import helper, kernel

# Distance of planes that stand for absent walls and bound the polyhedron: beyond the ball, whose radius is 1. Faces are
# cut out of squares that hold any face of such a cube.
_BEYOND, _SQUARE = 1.5, 3.0

# Sine of the angle below which planes count as parallel. Their line of intersection has an error of rounding over it.
_PARALLEL = 1e-8


@kernel(error_model="numpy")
def solids_in_layers(centres, radii, lower, upper, starts, others, axis, edges, solids):
    """Fill in the solid volume of each layer.

    Parameters
    ----------
    centres, radii : (n, 3), (n,) arrays
        Spheres [m].
    lower, upper : (3,) arrays
        Corners of the box [m].
    starts, others : (n + 1,), (k,) int arrays
        Spheres that overlap sphere i: others[starts[i]] ... others[starts[i + 1] - 1].
    axis : int
        0, 1 or 2.
    edges : (l + 1,) array
        Increasing places of the planes between layers along the axis, from the lower wall to the upper [m].
    solids : (l,) array
        To be filled [m³].
    """
    most = 6
    for i in range(len(radii)):
        most = max(most, 6 + starts[i + 1] - starts[i])
    normals, distances = np.empty((most, 3)), np.empty(most)
    polygon, cut = np.empty((most + 4, 2)), np.empty((most + 4, 2))
    solids[:] = 0.0
    for i in range(len(radii)):
        r = radii[i]
        count = _planes(i, centres, radii, lower, upper, starts, others, normals, distances)
        below, above = distances[2 * axis], distances[2 * axis + 1]
        layer = _layer_of(centres[i, axis] - r, edges)
        while count > 0 and layer < len(solids) and edges[layer] < centres[i, axis] + r:
            distances[2 * axis] = min(below, (centres[i, axis] - edges[layer]) / r)
            distances[2 * axis + 1] = min(above, (edges[layer + 1] - centres[i, axis]) / r)
            solids[layer] += _ball_in_polyhedron(count, normals, distances, polygon, cut) * r * r * r
            layer += 1


@helper
def _layer_of(place, edges):
    """Layer of a place, the first for those below all edges: numba's searchsorted makes loading the kernel slow."""
    low, high = 0, len(edges)
    while high - low > 1:
        middle = (low + high) // 2
        if edges[middle] <= place:
            low = middle
        else:
            high = middle
    return low


@helper
def _planes(i, centres, radii, lower, upper, starts, others, normals, distances):
    """Planes around ball i: outward normals and distances from its centre, over its radius; how many, 0 if it is lost.

    First come the six walls, then the neighbours whose planes cut the ball. A ball is lost where its Laguerre cell has
    no point of it: within another ball, or beyond a wall.
    """
    r = radii[i]
    for wall in range(6):
        along = wall // 2
        normals[wall, 0] = normals[wall, 1] = normals[wall, 2] = 0.0
        normals[wall, along] = 2.0 * (wall % 2) - 1.0
        distance = centres[i, along] - lower[along] if wall % 2 == 0 else upper[along] - centres[i, along]
        distances[wall] = min(distance / r, _BEYOND)
        if distances[wall] <= -1.0:
            return 0
    count = 6
    for place in range(starts[i], starts[i + 1]):
        j = others[place]
        x, y, z = centres[j, 0] - centres[i, 0], centres[j, 1] - centres[i, 1], centres[j, 2] - centres[i, 2]
        distance = np.sqrt(x * x + y * y + z * z)
        if distance == 0.0:  # at one place: the larger ball, or the first of equal ones, has it all
            if radii[j] > r or (radii[j] == r and j < i):
                return 0
            continue
        to_plane = 0.5 * (distance + (r - radii[j]) * (r + radii[j]) / distance) / r
        if to_plane <= -1.0:
            return 0
        if to_plane < 1.0:
            normals[count, 0], normals[count, 1], normals[count, 2] = x / distance, y / distance, z / distance
            distances[count] = to_plane
            count += 1
    return count


@helper
def _cosine(p, q, normals):
    """Of the angle between two planes."""
    return normals[p, 0] * normals[q, 0] + normals[p, 1] * normals[q, 1] + normals[p, 2] * normals[q, 2]


@helper
def _ball_in_polyhedron(count, normals, distances, polygon, cut):
    """Volume of a ball of radius 1 within planes; `polygon` and `cut` are arrays to work in."""
    volume = 4.0 / 3.0 * np.pi
    for p in range(count):
        d = distances[p]
        if d <= -1.0:
            return 0.0
        if d >= 1.0:
            continue
        volume -= np.pi * (1.0 - d) * (1.0 - d) * (2.0 + d) / 3.0
        for q in range(p):
            e = distances[q]
            # Caps meet where the angle between their normals is less than the sum of their angular radii.
            if e < 1.0 and (
                d + e < 0.0 or _cosine(p, q, normals) > d * e - np.sqrt((1.0 - d) * (1.0 + d) * (1.0 - e) * (1.0 + e))
            ):
                return _sum_of_orthoschemes(count, normals, distances, polygon, cut)
    return volume


@helper
def _sum_of_orthoschemes(count, normals, distances, polygon, cut):
    """Volume of a ball of radius 1 within planes, of which any may meet in it."""
    volume = 0.0
    for p in range(count):
        x, y = _in_plane(p, normals)
        corners = _face(p, x, y, count, normals, distances, polygon, cut)
        for a in range(corners):
            b = a + 1 if a + 1 < corners else 0
            along_x, along_y = polygon[b, 0] - polygon[a, 0], polygon[b, 1] - polygon[a, 1]
            length = np.sqrt(along_x * along_x + along_y * along_y)
            if length == 0.0:
                continue
            along_x, along_y = along_x / length, along_y / length
            across = polygon[a, 0] * along_y - polygon[a, 1] * along_x
            low = polygon[a, 0] * along_x + polygon[a, 1] * along_y
            high = polygon[b, 0] * along_x + polygon[b, 1] * along_y
            d = distances[p]
            sense = -1.0 if (d < 0.0) != (across < 0.0) else 1.0
            before, _, _ = ball_in_orthoscheme(1.0, abs(d), abs(across), abs(low))
            after, _, _ = ball_in_orthoscheme(1.0, abs(d), abs(across), abs(high))
            volume += sense * ((-after if high < 0.0 else after) - (-before if low < 0.0 else before))
    return volume


@helper
def _in_plane(p, normals):
    """Two unit vectors in a plane that make a right-handed system with its normal."""
    n = (normals[p, 0], normals[p, 1], normals[p, 2])
    if abs(n[0]) < 0.6:
        length = np.sqrt(n[1] * n[1] + n[2] * n[2])
        x = (0.0, -n[2] / length, n[1] / length)
    else:
        length = np.sqrt(n[0] * n[0] + n[1] * n[1])
        x = (-n[1] / length, n[0] / length, 0.0)
    y = (n[1] * x[2] - n[2] * x[1], n[2] * x[0] - n[0] * x[2], n[0] * x[1] - n[1] * x[0])
    return x, y


@helper
def _face(p, x, y, count, normals, distances, polygon, cut):
    """Face of a polyhedron in its plane p, cut out of a square by the others, anticlockwise: how many corners."""
    for corner in range(4):
        polygon[corner, 0] = _SQUARE if corner == 1 or corner == 2 else -_SQUARE
        polygon[corner, 1] = _SQUARE if corner >= 2 else -_SQUARE
    corners = 4
    for q in range(count):
        if q == p:
            continue
        cosine = _cosine(p, q, normals)
        u = normals[q, 0] * x[0] + normals[q, 1] * x[1] + normals[q, 2] * x[2]
        v = normals[q, 0] * y[0] + normals[q, 1] * y[1] + normals[q, 2] * y[2]
        if u * u + v * v < _PARALLEL * _PARALLEL:
            # Of planes that face alike the nearer one has the face, or the first of equal ones.
            if cosine > 0.0:
                hidden = distances[q] < distances[p] or (distances[q] == distances[p] and q < p)
            else:
                hidden = distances[p] + distances[q] < 0.0
            if hidden:
                return 0
            continue
        offset = distances[q] - distances[p] * cosine
        left = 0
        for a in range(corners):
            b = a + 1 if a + 1 < corners else 0
            at_a = u * polygon[a, 0] + v * polygon[a, 1] - offset
            at_b = u * polygon[b, 0] + v * polygon[b, 1] - offset
            if at_a <= 0.0:
                cut[left, 0], cut[left, 1] = polygon[a, 0], polygon[a, 1]
                left += 1
            if (at_a <= 0.0) != (at_b <= 0.0):
                part = at_a / (at_a - at_b)
                cut[left, 0] = polygon[a, 0] + part * (polygon[b, 0] - polygon[a, 0])
                cut[left, 1] = polygon[a, 1] + part * (polygon[b, 1] - polygon[a, 1])
                left += 1
        corners = left
        if corners == 0:
            return 0
        for a in range(corners):
            polygon[a, 0], polygon[a, 1] = cut[a, 0], cut[a, 1]
    return corners
