"""Routes through the void: from the middle of a pore to its necks and its faces on walls, outside every sphere.

A point on a Laguerre edge has the same power to the three spheres of the edge, and none less to any other sphere. Where
that power is positive, which is so all along the edge of a throat that its spheres do not cover, the point is
outside all spheres. Laguerre vertices and edges are therefore a way round where a straight line cuts a sphere.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from porefv.mesh.pore_mesh import PoreMesh
from porefv.packing.box import WALL_AXES
from porefv.packing.packing import Packing
from porefv.system.threads import thread_count

# Among so many of the nearest centres are, for most lines, all spheres that they may cut.
_NEIGHBOURS = 16
# Segments that are treated together: their arrays take some 100 MB.
_ROWS = 1 << 16
# Depth of a line in a sphere, over the sphere's radius, that is rounding.
_ROUNDING = 1e-12


class Routes(NamedTuple):
    """Lines of three points, of which the second is the last where two points suffice.

    Attributes
    ----------
    points : (k, 3, 3) array
        Points of each line [m].
    cut : (k,) bool array
        Lines that cut a sphere, as no line that was tried does not.
    """

    points: np.ndarray
    cut: np.ndarray


class SpheresOnLines:
    """How deep straight lines lie in the spheres of a packing.

    Parameters
    ----------
    packing : Packing
    """

    def __init__(self, packing: Packing):
        from scipy.spatial import KDTree

        # Spheres of similar radii together, so that the reach of the largest is not that of the others.
        classes = np.floor(np.log2(packing.radii / packing.radii.min())).astype(int)
        parts = [classes == kind for kind in np.unique(classes)]
        self._parts = [(KDTree(packing.centres[part]), packing.centres[part], packing.radii[part]) for part in parts]

    def cut(self, begin: np.ndarray, end: np.ndarray) -> np.ndarray:
        """(k,) bool: whether a point of the line from begin (k, 3) to end (k, 3) is inside a sphere; true for NaN."""
        found = np.empty(len(begin), bool)
        for first in range(0, len(begin), _ROWS):
            rows = slice(first, first + _ROWS)
            found[rows] = self._cut(begin[rows], end[rows])
        return found

    def _cut(self, begin: np.ndarray, end: np.ndarray) -> np.ndarray:
        found = ~(np.isfinite(begin) & np.isfinite(end)).all(axis=1)
        along = end - begin
        squares = (along**2).sum(axis=1)
        for tree, centres, radii in self._parts:
            left, count = np.flatnonzero(~found), min(_NEIGHBOURS, len(radii))
            while len(left):
                a, u, uu = begin[left], along[left], squares[left]
                lengths, near = tree.query(a + 0.5 * u, k=np.arange(1, count + 1), workers=thread_count())
                towards = centres[near] - a[:, None]
                places = np.einsum("kni,ki->kn", towards, u) / np.where(uu > 0.0, uu, 1.0)[:, None]
                nearest = towards - np.clip(places, 0.0, 1.0)[:, :, None] * u[:, None]
                inside = np.sqrt((nearest**2).sum(axis=2)) < (1.0 - _ROUNDING) * radii[near]
                found[left] |= inside.any(axis=1)
                farther = lengths[:, -1] < 0.5 * np.sqrt(uu) + radii.max()
                left = left[farther & ~found[left] & (count < len(radii))]
                count = min(4 * count, len(radii))
        return found


def routes_to_necks(mesh: PoreMesh, throats: np.ndarray, slip: np.ndarray) -> tuple[Routes, Routes]:
    """Routes from the neck of each throat to the middles of its first and of its second pore.

    The neck is the centre of the throat's inscribed circle; the middle of a pore that of its inscribed sphere. Between
    them leads a straight line or, where it cuts a sphere, one by the Laguerre vertex. Where both do, or the circle's
    centre is outside the box, the neck is the point of the Laguerre edge that is nearest to the plane of the facet.

    Parameters
    ----------
    mesh : PoreMesh
    throats : (k,) int array
    slip : (6,) bool array
        Walls of symmetry: circles have their centres on them.

    Returns
    -------
    (Routes, Routes)
        A row for each of the throats.
    """
    spheres = SpheresOnLines(mesh.packing)
    facets = mesh.throats.first_facets[throats]
    vertices = mesh.vertices[mesh.facets.cells[facets]]
    middles = mesh.inscribed_spheres.centres[mesh.throats.pores[throats]]
    necks = mesh.throats.inscribed_centres(slip)[throats]
    necks[(mesh.box.wall_distances(necks) < 0.0).any(axis=1)] = np.nan
    sides = [_around(spheres, necks, vertices[:, side], middles[:, side]) for side in (0, 1)]
    bad = np.flatnonzero(sides[0].cut | sides[1].cut)
    if len(bad):
        on_edges = _on_laguerre_edges(mesh, facets[bad], vertices[bad])
        for side in (0, 1):
            other = _around(spheres, on_edges, vertices[bad, side], middles[bad, side])
            sides[side].points[bad], sides[side].cut[bad] = other
    return sides[0], sides[1]


def routes_to_walls(mesh: PoreMesh, faces: np.ndarray) -> Routes:
    """Routes from wall faces to the middles of their pores: straight from the wall, or by the Laguerre vertex on it.

    Parameters
    ----------
    mesh : PoreMesh
    faces : (k,) int array
        Of `mesh.wall_faces`.

    Returns
    -------
    Routes
        A row for each of the faces.
    """
    cells, walls = mesh.wall_faces.cells[faces], mesh.wall_faces.walls[faces]
    middles = mesh.inscribed_spheres.centres[mesh.cell_pore[cells]]
    rows = np.arange(len(faces))
    begin = middles.copy()
    begin[rows, WALL_AXES[walls]] = mesh.box.wall_places[walls]
    on_walls = mesh.vertices[cells]
    spheres = SpheresOnLines(mesh.packing)
    found = _around(spheres, begin, on_walls, middles)
    bad = np.flatnonzero(found.cut)
    other = _around(spheres, on_walls[bad], on_walls[bad], middles[bad])
    found.points[bad], found.cut[bad] = other
    return found


def _around(spheres: SpheresOnLines, begin: np.ndarray, by: np.ndarray, end: np.ndarray) -> Routes:
    """Straight lines from begin to end, (k, 3) each, or by other points where those cut a sphere."""
    points = np.stack([begin, end, end], axis=1)
    cut = spheres.cut(begin, end)
    bad = np.flatnonzero(cut)
    cut[bad] = spheres.cut(begin[bad], by[bad]) | spheres.cut(by[bad], end[bad])
    points[bad, 1] = by[bad]
    return Routes(points, cut)


def _on_laguerre_edges(mesh: PoreMesh, facets: np.ndarray, vertices: np.ndarray) -> np.ndarray:
    """(k, 3): the point between the Laguerre vertices (k, 2, 3) of each facet that is nearest to its plane [m]."""
    begin, along = vertices[:, 0], vertices[:, 1] - vertices[:, 0]
    normals = mesh.facets.normals[facets]
    corner = mesh.packing.centres[mesh.facets.vertices[facets, 0]]  # spheres come first
    height = np.einsum("ki,ki->k", corner - begin, normals)
    length = np.einsum("ki,ki->k", along, normals)
    places = np.clip(np.divide(height, length, out=np.zeros(len(facets)), where=length > 0.0), 0.0, 1.0)
    return begin + places[:, None] * along
