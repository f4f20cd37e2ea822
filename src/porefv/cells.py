"""Kernels of the cells: volumes of the tetrahedra, wedges and hexahedra, and of the solid within them."""

from __future__ import annotations

import numpy as np
from numba import njit, prange

from porefv.facets import (
    _at,
    _cross,
    _dot,
    _height,
    _minus,
    _overlaps,
    _plane_distances,
    _towards,
    area_vector,
    centroid,
    spheres_first,
)


@njit(cache=True)
def _sorted_vertices(t, cells, n):
    """Vertices of cell t, spheres first, and how many are spheres."""
    s = np.empty(4, np.int32)
    ns = 0
    for i in range(4):
        if cells[t, i] < n:
            s[ns] = cells[t, i]
            ns += 1
    nw = ns
    for i in range(4):
        if cells[t, i] >= n:
            s[nw] = cells[t, i]
            nw += 1
    return s, ns


@njit(cache=True, parallel=True)
def polyhedron_volumes(cells, n, points, sizes):
    """Volume of each cell: its spheres' centres swept to its walls."""
    volumes = np.empty(cells.shape[0])
    for t in prange(cells.shape[0]):
        s, ns = _sorted_vertices(t, cells, n)
        if ns == 4:
            u = _cross(_towards(s[0], s[1], n, points), _towards(s[0], s[2], n, points))
            volumes[t] = abs(_dot(u, _towards(s[0], s[3], n, points))) / 6.0
        elif ns == 3:
            u = _cross(_towards(s[0], s[1], n, points), _towards(s[0], s[2], n, points))
            base = 0.5 * abs(_dot(u, (points[s[3], 0], points[s[3], 1], points[s[3], 2])))
            height = 0.0
            for i in range(3):
                height += _height(s[i], s[3], points, sizes)
            volumes[t] = base * height / 3.0
        elif ns == 2:
            u = _towards(s[0], s[1], n, points)
            d = _cross(_towards(s[0], s[2], n, points), _towards(s[0], s[3], n, points))
            a0 = _height(s[0], s[2], points, sizes)
            a1 = _height(s[1], s[2], points, sizes)
            b0 = _height(s[0], s[3], points, sizes)
            b1 = _height(s[1], s[3], points, sizes)
            # Both widths vary linearly along the edge.
            volumes[t] = abs(_dot(u, d)) * (2.0 * a0 * b0 + 2.0 * a1 * b1 + a0 * b1 + a1 * b0) / 6.0
        else:
            volumes[t] = 1.0
            for i in range(1, 4):
                volumes[t] *= _height(s[0], s[i], points, sizes)
    return volumes


@njit(cache=True, parallel=True)
def volume_rates(cells, n, points, sizes, velocities, speeds):
    """Rate of the volume of each cell: the exact derivative of `polyhedron_volumes`, linear in the velocities.

    velocities (n, 3) are those of the spheres' centres, speeds (6,) those of the walls along their outward normals.
    """
    rates = np.empty(cells.shape[0])
    for t in prange(cells.shape[0]):
        s, ns = _sorted_vertices(t, cells, n)
        a = s[0]
        if ns == 4:
            u = _towards(a, s[1], n, points)
            v = _towards(a, s[2], n, points)
            w = _towards(a, s[3], n, points)
            du = _minus(_at(s[1], velocities), _at(a, velocities))
            dv = _minus(_at(s[2], velocities), _at(a, velocities))
            dw = _minus(_at(s[3], velocities), _at(a, velocities))
            sense = 1.0 if _dot(_cross(u, v), w) > 0.0 else -1.0
            rate = _dot(_cross(v, w), du) + _dot(_cross(w, u), dv) + _dot(_cross(u, v), dw)
            rates[t] = sense * rate / 6.0
        elif ns == 3:
            d = _at(s[3], points)
            u = _towards(a, s[1], n, points)
            v = _towards(a, s[2], n, points)
            du = _minus(_at(s[1], velocities), _at(a, velocities))
            dv = _minus(_at(s[2], velocities), _at(a, velocities))
            base = 0.5 * _dot(_cross(u, v), d)
            base_rate = 0.5 * (_dot(_cross(du, v), d) + _dot(_cross(u, dv), d))
            height = 0.0
            height_rate = 0.0
            for i in range(3):
                height += _height(s[i], s[3], points, sizes)
                height_rate += speeds[s[3] - n] - _dot(_at(s[i], velocities), d)
            sense = 1.0 if base > 0.0 else -1.0
            rates[t] = sense * (base_rate * height + base * height_rate) / 3.0
        elif ns == 2:
            b = s[1]
            d1 = _at(s[2], points)
            d2 = _at(s[3], points)
            edge = _cross(d1, d2)
            u = _dot(_towards(a, b, n, points), edge)
            du = _dot(_minus(_at(b, velocities), _at(a, velocities)), edge)
            a0 = _height(a, s[2], points, sizes)
            a1 = _height(b, s[2], points, sizes)
            b0 = _height(a, s[3], points, sizes)
            b1 = _height(b, s[3], points, sizes)
            da0 = speeds[s[2] - n] - _dot(_at(a, velocities), d1)
            da1 = speeds[s[2] - n] - _dot(_at(b, velocities), d1)
            db0 = speeds[s[3] - n] - _dot(_at(a, velocities), d2)
            db1 = speeds[s[3] - n] - _dot(_at(b, velocities), d2)
            section = 2.0 * a0 * b0 + 2.0 * a1 * b1 + a0 * b1 + a1 * b0
            section_rate = 2.0 * (da0 * b0 + a0 * db0 + da1 * b1 + a1 * db1) + da0 * b1 + a0 * db1 + da1 * b0 + a1 * db0
            sense = 1.0 if u > 0.0 else -1.0
            rates[t] = sense * (du * section + u * section_rate) / 6.0
        else:
            rates[t] = 0.0
            for i in range(1, 4):
                rate = speeds[s[i] - n] - _dot(_at(a, velocities), _at(s[i], points))
                for j in range(1, 4):
                    if j != i:
                        rate *= _height(a, s[j], points, sizes)
                rates[t] += rate
    return rates


@njit(cache=True, parallel=True)
def cell_solids(cells, n, points, sizes):
    """Volume of the balls, each cut by its Laguerre planes, within each cell."""
    solids = np.zeros(cells.shape[0])
    for t in prange(cells.shape[0]):
        total = 0.0
        for i in range(4):
            k = cells[t, i]
            if k >= n:
                continue
            u = _towards(k, cells[t, (i + 1) % 4], n, points)
            v = _towards(k, cells[t, (i + 2) % 4], n, points)
            w = _towards(k, cells[t, (i + 3) % 4], n, points)
            numerator, denominator = _tangent(u, v, w)
            r = sizes[k]
            total += 2.0 * np.arctan2(abs(numerator), denominator) * r * r * r / 3.0
            for j in range(3):
                m = cells[t, (i + 1 + j) % 4]
                edge = u if j == 0 else (v if j == 1 else w)
                if not _overlaps(k, m, edge, n, points, sizes):
                    continue
                d, _ = _plane_distances(k, m, edge, n, points, sizes)
                a = _cross(edge, v if j == 0 else (w if j == 1 else u))
                b = _cross(edge, w if j == 0 else (u if j == 1 else v))
                x = _cross(a, b)
                psi = np.arctan2(np.sqrt(_dot(x, x)), _dot(a, b))
                h = r - d
                total -= psi * h * h * (3.0 * r - h) / 6.0
        solids[t] = total
    return solids


@njit(cache=True)
def enumerate_wall_faces(cells, n, points, sizes):
    """Face of each cell on each of its walls: the facet opposite to the wall, projected on it."""
    count = 0
    for t in range(cells.shape[0]):
        for i in range(4):
            if cells[t, i] >= n:
                count += 1
    face_cells = np.empty(count, np.int32)
    walls = np.empty(count, np.int32)
    areas = np.empty(count)
    centroids = np.empty((count, 3))
    f = 0
    for t in range(cells.shape[0]):
        for i in range(4):
            wall = cells[t, i]
            if wall < n:
                continue
            a, b, c = spheres_first(cells[t, (i + 1) % 4], cells[t, (i + 2) % 4], cells[t, (i + 3) % 4], n)
            direction = (points[wall, 0], points[wall, 1], points[wall, 2])
            x = centroid(a, b, c, n, points, sizes)
            gap = sizes[wall] - _dot(x, direction)
            face_cells[f] = t
            walls[f] = wall - n
            areas[f] = abs(_dot(area_vector(a, b, c, n, points, sizes), direction))
            for axis in range(3):
                centroids[f, axis] = x[axis] + gap * direction[axis]
            f += 1
    return face_cells, walls, areas, centroids


@njit(cache=True)
def _tangent(u, v, w):
    """(numerator, denominator) of tan(Ω/2) for the triangle u, v, w (Van Oosterom and Strackee 1983)."""
    lu = np.sqrt(_dot(u, u))
    lv = np.sqrt(_dot(v, v))
    lw = np.sqrt(_dot(w, w))
    return _dot(_cross(u, v), w), lu * lv * lw + _dot(u, v) * lw + _dot(v, w) * lu + _dot(w, u) * lv
