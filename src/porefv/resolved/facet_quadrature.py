"""Where to ask a resolved flow about our mesh: points on the fluid part of every facet, and the cell of any point."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from porefv.mesh.facet_kernels import centroid
from porefv.system.kernels import kernel

if TYPE_CHECKING:
    from porefv.mesh.pore_mesh import PoreMesh

# Gauss points across each sector of a facet, and from the sphere outwards.
_ANGLES, _RADII = 12, 8


@dataclass(frozen=True)
class FacetPoints:
    """Quadrature on the fluid part of the facets.

    Attributes
    ----------
    facets : (q,) int array
    points : (q, 3) array
        From the mesh's local origin [m].
    weights : (q,) array
        Add up to the fluid area of each facet [m²].
    """

    facets: np.ndarray
    points: np.ndarray
    weights: np.ndarray


def facet_points(mesh: PoreMesh) -> FacetPoints:
    """Gauss points on every facet outside of its own spheres.

    Each point of a facet belongs to the sphere to which it is nearest in power; about that sphere, coordinates are
    polar: smooth up to the solid, so that few points give many digits.
    """
    facets, points, weights = [], [], []
    angle_rule, radius_rule = (np.polynomial.legendre.leggauss(m) for m in (_ANGLES, _RADII))
    for f, vertices in enumerate(mesh.facets.vertices):
        corners, spheres = _polygon(vertices, mesh)
        e1 = corners[1] - corners[0]
        e1 /= np.linalg.norm(e1)
        normal = np.cross(e1, corners[-1] - corners[0])
        frame = np.array([e1, np.cross(normal / np.linalg.norm(normal), e1)])
        flat = (corners - corners[0]) @ frame.T
        for k in range(len(spheres)):
            centre, radius = flat[k], mesh.sizes[spheres[k]]
            region = flat
            for m in range(len(spheres)):
                if m != k:
                    region = _nearer(region, centre, radius, flat[m], mesh.sizes[spheres[m]])
            for x, w in _polar(region - centre, radius, angle_rule, radius_rule):
                points.append(corners[0] + (centre + x) @ frame)
                weights.append(w)
                facets.append(np.full(len(w), f))
    return FacetPoints(np.concatenate(facets), np.concatenate(points), np.concatenate(weights))


def _polygon(vertices: np.ndarray, mesh: PoreMesh) -> tuple[np.ndarray, list[int]]:
    """Corners of a facet in order, its spheres' centres first, and those spheres."""
    n, points, sizes = mesh.n_spheres, mesh.local_points, mesh.sizes
    a, b, c = (int(v) for v in vertices)

    def foot(k: int, wall: int) -> np.ndarray:
        return (sizes[wall] - points[wall] @ points[k]) * points[wall]

    if c < n:
        return points[[a, b, c]], [a, b, c]
    if b < n:
        return np.array([points[a], points[b], points[b] + foot(b, c), points[a] + foot(a, c)]), [a, b]
    to_b, to_c = foot(a, b), foot(a, c)
    return np.array([points[a], points[a] + to_b, points[a] + to_b + to_c, points[a] + to_c]), [a]


def _nearer(
    region: np.ndarray, centre: np.ndarray, radius: float, other: np.ndarray, other_radius: float
) -> np.ndarray:
    """The part of a convex polygon nearer in power to one circle than to another."""
    towards = other - centre
    limit = 0.5 * (towards @ towards + radius**2 - other_radius**2)
    above = (region - centre) @ towards - limit
    kept = []
    for k in range(len(region)):
        x, y = region[k - 1], region[k]
        if (above[k - 1] > 0.0) != (above[k] > 0.0):
            kept.append(x + above[k - 1] / (above[k - 1] - above[k]) * (y - x))
        if above[k] <= 0.0:
            kept.append(y)
    return np.array(kept).reshape(-1, 2)


def _polar(
    region: np.ndarray,
    radius: float,
    angle_rule: tuple[np.ndarray, np.ndarray],
    radius_rule: tuple[np.ndarray, np.ndarray],
) -> Iterator[tuple[np.ndarray, np.ndarray]]:
    """Points and weights on the part of a convex polygon beyond a circle about the origin, one of its corners."""
    for k in range(len(region)):
        x, y = region[k - 1], region[k]
        twice = x[0] * y[1] - x[1] * y[0]
        length = np.linalg.norm(y - x)
        height = abs(twice) / length if length > 0.0 else 0.0
        if height <= 1e-9 * radius:
            continue
        # Angles from the foot of the side's perpendicular: the side is at height / cos(angle).
        foot = x - (x @ (y - x)) / length**2 * (y - x)
        along = (y - x) / length
        begin, end = (np.arctan2((z - foot) @ along, height) for z in (x, y))
        angles = begin + (end - begin) * 0.5 * (angle_rule[0] + 1.0)
        across = 0.5 * abs(end - begin) * angle_rule[1]
        reach = height / np.cos(angles)
        span = np.maximum(reach - radius, 0.0)
        r = radius + span[:, None] * 0.5 * (radius_rule[0] + 1.0)
        weights = (across * span)[:, None] * 0.5 * radius_rule[1] * r
        directions = np.cos(angles)[:, None] * foot / height + np.sin(angles)[:, None] * along
        points = r[:, :, None] * directions[:, None, :]
        kept = weights.ravel() > 0.0
        yield points.reshape(-1, 2)[kept], weights.ravel()[kept]


def cells_of(mesh: PoreMesh, points: np.ndarray) -> np.ndarray:
    """(q,) int: the cell in which each point (q, 3) lies, from the mesh's local origin [m]."""
    return _locate(np.ascontiguousarray(points), _planes(mesh))


def _planes(mesh: PoreMesh) -> np.ndarray:
    """(m, 4, 4): outward unit normal and offset of each cell's facets; zero where there is none."""
    planes = np.zeros((mesh.n_cells, 4, 4))
    count = np.zeros(mesh.n_cells, int)
    normals = mesh.facets.normals
    for f, (first, second) in enumerate(mesh.facets.cells):
        a, b, c = mesh.facets.vertices[f]
        offset = normals[f] @ np.array(centroid(a, b, c, mesh.cell_vertices))
        for cell, sense in ((first, 1.0), (second, -1.0)):
            planes[cell, count[cell], :3] = sense * normals[f]
            planes[cell, count[cell], 3] = sense * offset
            count[cell] += 1
    return planes


@kernel
def _locate(points, planes):
    """The cell outside of which each point lies least."""
    found = np.empty(points.shape[0], np.int64)
    for q in range(points.shape[0]):
        least = np.inf
        for t in range(planes.shape[0]):
            beyond = -np.inf
            for i in range(4):
                above = -planes[t, i, 3]
                for axis in range(3):
                    above += planes[t, i, axis] * points[q, axis]
                if planes[t, i, 0] == 0.0 and planes[t, i, 1] == 0.0 and planes[t, i, 2] == 0.0:
                    continue
                beyond = max(beyond, above)
                if beyond >= least:
                    break
            if beyond < least:
                least = beyond
                found[q] = t
                if least <= 0.0:
                    break
    return found
