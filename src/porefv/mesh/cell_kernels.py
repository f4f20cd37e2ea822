"""Kernels of the cells: volumes of the tetrahedra, wedges and hexahedra, and of the solid within them."""

from __future__ import annotations

import numpy as np

from porefv.mesh.facet_kernels import area_vector, centroid, spheres_first
from porefv.mesh.laguerre import crosses_laguerre_plane, laguerre_plane_distances
from porefv.mesh.vectors import cross_product, dot, towards, vector_at, wall_distance
from porefv.system.kernels import helper, kernel, unsigned_range


@helper
def _sorted_vertices(t, cells, n):
    """(4,) int32: vertices of cell t, the spheres first; and how many are spheres (vertices below n)."""
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


@kernel
def polyhedron_volumes(first, last, cells, vertices, volumes):
    """Fill the volumes (m,) of cells first ... last - 1: spheres' centres swept to walls."""
    for t in unsigned_range(first, last):
        s, ns = _sorted_vertices(t, cells, vertices.n_spheres)
        if ns == 4:
            u = cross_product(towards(s[0], s[1], vertices), towards(s[0], s[2], vertices))
            volumes[t] = abs(dot(u, towards(s[0], s[3], vertices))) / 6.0
        elif ns == 3:
            u = cross_product(towards(s[0], s[1], vertices), towards(s[0], s[2], vertices))
            base = 0.5 * abs(dot(u, vector_at(s[3], vertices.points)))
            height = 0.0
            for i in range(3):
                height += wall_distance(s[i], s[3], vertices)
            volumes[t] = base * height / 3.0
        elif ns == 2:
            u = towards(s[0], s[1], vertices)
            d = cross_product(towards(s[0], s[2], vertices), towards(s[0], s[3], vertices))
            a0 = wall_distance(s[0], s[2], vertices)
            a1 = wall_distance(s[1], s[2], vertices)
            b0 = wall_distance(s[0], s[3], vertices)
            b1 = wall_distance(s[1], s[3], vertices)
            # Both widths vary linearly along the edge.
            volumes[t] = abs(dot(u, d)) * (2.0 * a0 * b0 + 2.0 * a1 * b1 + a0 * b1 + a1 * b0) / 6.0
        else:
            volumes[t] = 1.0
            for i in range(1, 4):
                volumes[t] *= wall_distance(s[0], s[i], vertices)


@kernel
def volume_gradients(first, last, cells, vertices, gradients):
    """Fill in the derivatives (m, 4, 3) of the volumes of cells first ... last - 1 by the place of each vertex.

    A wall's place is that along its outward normal: its derivative, a vector along that, is the area of the cell's
    face on it.
    """
    for t in unsigned_range(first, last):
        s, ns = _sorted_vertices(t, cells, vertices.n_spheres)
        by = _gradients_by_vertex(s, ns, vertices)
        for i in range(4):
            for j in range(4):
                if s[j] == cells[t, i]:
                    for axis in range(3):
                        gradients[t, i, axis] = by[j, axis]


@helper
def _gradients_by_vertex(s, ns, vertices):
    """(4, 3): derivatives of one cell's volume; spheres come first in s."""
    by = np.zeros((4, 3))
    a = s[0]
    if ns == 4:
        u = towards(a, s[1], vertices)
        v = towards(a, s[2], vertices)
        w = towards(a, s[3], vertices)
        share = (1.0 if dot(cross_product(u, v), w) > 0.0 else -1.0) / 6.0
        _add_difference(by, 1, share, cross_product(v, w))
        _add_difference(by, 2, share, cross_product(w, u))
        _add_difference(by, 3, share, cross_product(u, v))
    elif ns == 3:
        d = vector_at(s[3], vertices.points)
        u = towards(a, s[1], vertices)
        v = towards(a, s[2], vertices)
        base = 0.5 * dot(cross_product(u, v), d)
        share = (1.0 if base > 0.0 else -1.0) / 3.0
        height = 0.0
        for i in range(3):
            height += wall_distance(s[i], s[3], vertices)
            _add(by, i, -share * base, d)
        _add(by, 3, 3.0 * share * base, d)
        _add_difference(by, 1, 0.5 * share * height, cross_product(v, d))
        _add_difference(by, 2, 0.5 * share * height, cross_product(d, u))
    elif ns == 2:
        d = vector_at(s[2], vertices.points)
        e = vector_at(s[3], vertices.points)
        edge = cross_product(d, e)
        length = dot(towards(a, s[1], vertices), edge)
        share = (1.0 if length > 0.0 else -1.0) / 6.0
        d0 = wall_distance(a, s[2], vertices)
        d1 = wall_distance(s[1], s[2], vertices)
        e0 = wall_distance(a, s[3], vertices)
        e1 = wall_distance(s[1], s[3], vertices)
        _add_difference(by, 1, share * (2.0 * d0 * e0 + 2.0 * d1 * e1 + d0 * e1 + d1 * e0), edge)
        by_d0 = share * length * (2.0 * e0 + e1)
        by_d1 = share * length * (2.0 * e1 + e0)
        by_e0 = share * length * (2.0 * d0 + d1)
        by_e1 = share * length * (2.0 * d1 + d0)
        _add(by, 0, -by_d0, d)
        _add(by, 0, -by_e0, e)
        _add(by, 1, -by_d1, d)
        _add(by, 1, -by_e1, e)
        _add(by, 2, by_d0 + by_d1, d)
        _add(by, 3, by_e0 + by_e1, e)
    else:
        for i in range(1, 4):
            face = 1.0
            for j in range(1, 4):
                if j != i:
                    face *= wall_distance(a, s[j], vertices)
            _add(by, i, face, vector_at(s[i], vertices.points))
            _add(by, 0, -face, vector_at(s[i], vertices.points))
    return by


@helper
def _add(by, i, factor, vector):
    for axis in range(3):
        by[i, axis] += factor * vector[axis]


@helper
def _add_difference(by, i, factor, vector):
    """Derivative by the way from the first vertex to vertex i."""
    _add(by, i, factor, vector)
    _add(by, 0, -factor, vector)


@kernel
def cell_solids(first, last, cells, vertices, solids, surfaces):
    """Fill in what cells first ... last - 1 have of the balls, each cut by its Laguerre planes.

    Parameters
    ----------
    first, last : int
        Rows to treat: first ... last - 1.
    cells : (m, 4) int32 array
    vertices : Vertices
    solids, surfaces : (m,) arrays
        Volume, and spherical surface, to be filled in [m³, m²].
    """
    for t in unsigned_range(first, last):
        total = 0.0
        surface = 0.0
        for i in range(4):
            k = cells[t, i]
            if k >= vertices.n_spheres:
                continue
            u = towards(k, cells[t, (i + 1) % 4], vertices)
            v = towards(k, cells[t, (i + 2) % 4], vertices)
            w = towards(k, cells[t, (i + 3) % 4], vertices)
            numerator, denominator = _tangent(u, v, w)
            r = vertices.sizes[k]
            seen = 2.0 * np.arctan2(abs(numerator), denominator) * r * r
            total += seen * r / 3.0
            surface += seen
            for j in range(3):
                m = cells[t, (i + 1 + j) % 4]
                edge = u if j == 0 else (v if j == 1 else w)
                if not crosses_laguerre_plane(k, m, edge, vertices):
                    continue
                d, _ = laguerre_plane_distances(k, m, edge, vertices)
                a = cross_product(edge, v if j == 0 else (w if j == 1 else u))
                b = cross_product(edge, w if j == 0 else (u if j == 1 else v))
                x = cross_product(a, b)
                psi = np.arctan2(np.sqrt(dot(x, x)), dot(a, b))
                h = r - d
                total -= psi * h * h * (3.0 * r - h) / 6.0
                surface -= psi * r * h
        solids[t] = total
        surfaces[t] = surface


@kernel
def enumerate_wall_faces(cells, vertices):
    """Face of each cell on each of its walls: the facet opposite to the wall, projected on it."""
    n = vertices.n_spheres
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
            direction = vector_at(wall, vertices.points)
            x = centroid(a, b, c, vertices)
            gap = vertices.sizes[wall] - dot(x, direction)
            face_cells[f] = t
            walls[f] = wall - n
            areas[f] = abs(dot(area_vector(a, b, c, vertices), direction))
            for axis in range(3):
                centroids[f, axis] = x[axis] + gap * direction[axis]
            f += 1
    return face_cells, walls, areas, centroids


@helper
def _tangent(u, v, w):
    """(numerator, denominator) of tan(Ω/2) for the triangle u, v, w (Van Oosterom and Strackee 1983)."""
    lu = np.sqrt(dot(u, u))
    lv = np.sqrt(dot(v, v))
    lw = np.sqrt(dot(w, w))
    return dot(cross_product(u, v), w), lu * lv * lw + dot(u, v) * lw + dot(v, w) * lu + dot(w, u) * lv
