"""Vectors of three numbers as tuples, and vectors and distances between the vertices of cells (`Vertices`)."""

from __future__ import annotations

import numpy as np

from porefv.system.kernels import helper


@helper
def cross_product(a, b):
    """a × b."""
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


@helper
def dot(a, b):
    """a · b."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


@helper
def plus(a, b):
    """a + b."""
    return a[0] + b[0], a[1] + b[1], a[2] + b[2]


@helper
def minus(a, b):
    """a - b."""
    return a[0] - b[0], a[1] - b[1], a[2] - b[2]


@helper
def times(factor, a):
    """factor a."""
    return factor * a[0], factor * a[1], factor * a[2]


@helper
def unit(v):
    """v / |v|, or v where that is zero."""
    length = np.sqrt(dot(v, v))
    return (v[0] / length, v[1] / length, v[2] / length) if length > 0.0 else v


@helper
def vector_at(i, array):
    """Row i of an array (n, 3), as a tuple."""
    return array[i, 0], array[i, 1], array[i, 2]


@helper
def towards(k, m, vertices):
    """From sphere k to vertex m: the vector between centres, or the outward direction of a wall."""
    points = vertices.points
    if m < vertices.n_spheres:
        return points[m, 0] - points[k, 0], points[m, 1] - points[k, 1], points[m, 2] - points[k, 2]
    return points[m, 0], points[m, 1], points[m, 2]


@helper
def wall_distance(k, wall, vertices):
    """Distance from the centre of sphere k to a wall."""
    points = vertices.points
    return vertices.sizes[wall] - (
        points[wall, 0] * points[k, 0] + points[wall, 1] * points[k, 1] + points[wall, 2] * points[k, 2]
    )
