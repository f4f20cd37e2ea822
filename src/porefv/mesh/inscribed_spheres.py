"""The largest sphere that was found in the void of each pore, at or near its Laguerre vertex."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from porefv.mesh.inscribed_circles import Circles, inscribed_circles
from porefv.packing.packing import Packing
from porefv.system.threads import for_rows, thread_count

if TYPE_CHECKING:
    from porefv.mesh.pore_mesh import PoreMesh

# Cells or facets that are treated together: their arrays take some 100 MB.
_ROWS = 1 << 18
# Among so many of the nearest centres is, for most points, the nearest surface.
_NEIGHBOURS = 8


@dataclass(frozen=True, eq=False)
class InscribedSpheres:
    """A sphere in the void of each pore.

    Attributes
    ----------
    centres : (n_pores, 3) array
        Centre of each sphere [m].
    radii : (n_pores,) array
        0 where no sphere was found [m].
    """

    centres: np.ndarray
    radii: np.ndarray


def inscribed_spheres(mesh: PoreMesh) -> InscribedSpheres:
    """The largest inscribed sphere of each pore among the candidates of its cells and facets.

    The candidate of a cell has its centre where the four vertices of the cell, spheres or walls, are equally far: it is
    tangent to them (problem of Apollonius). For equal spheres, away from walls, this is the Laguerre vertex; else it is
    near. The candidates of a pore's facets have their centres at those of the inscribed circles: where a void becomes
    wider towards a neighbour, no sphere is tangent to all four. The radius is the distance from the centre to the
    nearest sphere of the packing or wall of the box, whichever they belong to, so that the sphere lies in the void. The
    centre may lie outside the pore. Walls with slip confine the sphere like others.
    """
    found = InscribedSpheres(np.zeros((mesh.n_pores, 3)), np.zeros(mesh.n_pores))
    surface = NearestSurface(mesh.packing)
    for first in range(0, mesh.n_cells, _ROWS):
        cells = slice(first, first + _ROWS)
        points = _equally_far(mesh, mesh.cells[cells])
        _keep_better(found, mesh.cell_pore[cells], points, surface.distances(points))
    facets = mesh.facets
    circles = Circles(np.empty(len(facets)), np.empty((len(facets), 3)))
    for_rows(
        inscribed_circles, len(facets), facets.vertices, mesh.cell_vertices, np.zeros(6, bool), circles
    )  # fmt: skip
    pores = mesh.cell_pore[facets.cells]
    # No sphere with its centre at that of a circle is larger than the circle.
    useful = np.flatnonzero(circles.radii > found.radii[pores].min(axis=1))
    for first in range(0, len(useful), _ROWS):
        rows = useful[first : first + _ROWS]
        points = circles.centres[rows] + mesh.triangulation.origin
        radii = surface.distances(points)
        for side in (0, 1):
            _keep_better(found, pores[rows, side], points, radii)
    without = found.radii == 0.0
    found.centres[without] = mesh.pore_centres[without]
    return found


def _keep_better(found: InscribedSpheres, pores: np.ndarray, centres: np.ndarray, radii: np.ndarray) -> None:
    """Take candidates of pores in place of what was found, where they are larger."""
    order = np.argsort(radii, kind="stable")  # of several candidates of a pore, the last one that is set is the best
    better = order[radii[order] > found.radii[pores[order]]]
    found.radii[pores[better]] = radii[better]
    found.centres[pores[better]] = centres[better]


class NearestSurface:
    """Distances of points from the nearest sphere or wall of a packing.

    Parameters
    ----------
    packing : Packing
        With a box.
    """

    def __init__(self, packing: Packing):
        from scipy.spatial import KDTree

        assert packing.walled_box is not None
        self._box = packing.walled_box
        # Spheres of similar radii together: a centre that is farther by more than their difference is not the nearest.
        classes = np.floor(np.log2(packing.radii / packing.radii.min())).astype(int)
        parts = [classes == kind for kind in np.unique(classes)]
        self._trees = [(KDTree(packing.centres[part]), packing.radii[part]) for part in parts]

    def distances(self, points: np.ndarray) -> np.ndarray:
        """(k,): distance of each point (k, 3); 0 in the solid, beyond the walls, and for NaN [m]."""
        nearest = self._box.wall_distances(points).min(axis=1)
        inside = np.flatnonzero(nearest > 0.0)
        for tree, radii in self._trees:
            left, count = inside, min(_NEIGHBOURS, len(radii))
            while len(left):
                lengths, found = tree.query(points[left], k=np.arange(1, count + 1), workers=thread_count())
                nearest[left] = np.minimum(nearest[left], (lengths - radii[found]).min(axis=1))
                left = left[(lengths[:, -1] - radii.max() < nearest[left]) & (count < len(radii))]
                count = min(4 * count, len(radii))
        return np.where(nearest > 0.0, nearest, 0.0)


def _equally_far(mesh: PoreMesh, cells: np.ndarray) -> np.ndarray:
    """(k, 3): the point equally far from the four vertices of each cell, spheres or walls; NaN where there is none [m].

    With the first sphere's centre as origin and y = Y₀ + ρ Y₁ the point at distance ρ, its tangency to the three others
    is linear in ρ, and to the first quadratic, as for the circles of `porefv.mesh.inscribed_circles`.
    """
    cells = np.sort(cells, axis=1)  # spheres come first: every cell has one
    n, points, sizes = mesh.n_spheres, mesh.local_points, mesh.sizes
    origin, r = points[cells[:, 0]], sizes[cells[:, 0]]
    rows, constants, slopes = [], [], []
    for vertex in cells[:, 1:].T:
        wall = vertex >= n
        towards = np.where(wall[:, None], points[vertex], points[vertex] - origin)
        difference = r - sizes[vertex]
        of_sphere = 0.5 * (_dot(towards, towards) + difference * (r + sizes[vertex]))
        rows.append(towards)
        constants.append(np.where(wall, sizes[vertex] - _dot(towards, origin), of_sphere))
        slopes.append(np.where(wall, -1.0, difference))
    a, b, c = rows
    normals = np.stack([np.cross(b, c), np.cross(c, a), np.cross(a, b)])
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        inverse = normals / _dot(a, normals[0])[:, None]
        y0 = (np.stack(constants)[:, :, None] * inverse).sum(axis=0)
        y1 = (np.stack(slopes)[:, :, None] * inverse).sum(axis=0)
        # |Y₀ + ρ Y₁| = r + ρ, as A ρ² + 2 B ρ + C = 0
        qa, qb, qc = _dot(y1, y1) - 1.0, _dot(y0, y1) - r, _dot(y0, y0) - r**2
        distance = qc / (np.sqrt(qb**2 - qa * qc) - qb)
        found = origin + y0 + distance[:, None] * y1
    found[~(distance > 0.0)] = np.nan
    return found + mesh.triangulation.origin


def _dot(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    return np.einsum("ij,ij->i", a, b)
