"""RegularTriangulation: the weighted Delaunay triangulation of spheres in a box, exact in every tie."""

from __future__ import annotations

from functools import cached_property

import numpy as np

from porefv.errors import ComputationError
from porefv.packing.box import WALL_AXES, WALL_NORMALS, WALL_SENSES, Box
from porefv.system.kernels import kernel
from porefv.tessellation.blocks import triangulate
from porefv.tessellation.ordering import morton_codes
from porefv.tessellation.vertices import Vertices


class RegularTriangulation:
    """Regular triangulation of weighted points in a box whose six walls are ideal vertices.

    A wall is the limit of a sphere of infinite radius: an outward direction and an offset. Cells are
    quadruples of vertices, spheres or walls, whose common power centre is closer, in power, to no other vertex
    (C12 §2.1). All decisions are exact: ties (lattices) are broken by a symbolic perturbation
    of the radii in lexicographic order of the centres, so that cells are never flat, and the result does not depend
    on the order of the input.

    Parameters
    ----------
    centres : (n, 3) array
        Sphere centres, strictly inside the box, no two equal [m].
    radii : (n,) array
        Sphere radii [m].
    box : Box
        The box.

    Attributes
    ----------
    cells : (m, 4) int32 array
        Vertices of each cell, positively oriented: ids of spheres (< n), or n + w for wall w in the order
        x_min, x_max, y_min, y_max, z_min, z_max.
    neighbours : (m, 4) int32 array
        Cell across the facet opposite to each vertex; -1 across the facet of three walls.
    local_vertices : (m, 3) array
        Laguerre vertices (power centres) in the local frame [m].
    origin : (3,) array
        Origin of the local frame, x_local = x - origin, chosen such that the difference is exact [m].

    Notes
    -----
    Theory, method: :eq:`eq-power`, :eq:`eq-laguerre-vertex` and :eq:`eq-wall-vertex`.
    """

    def __init__(self, centres: np.ndarray, radii: np.ndarray, box: Box):
        n = len(radii)
        self.n_spheres = n
        self.box = box
        self.origin = exact_origin(box)
        scale = 2.0 ** -np.ceil(np.log2(box.size.max()))  # a power of two: scaling is exact
        points = np.empty((n + 6, 3))
        weights = np.empty(n + 6)
        np.multiply(centres - self.origin, scale, out=points[:n])
        np.multiply(radii, scale, out=weights[:n])
        points[n:] = WALL_NORMALS
        weights[n:] = wall_offsets(box, self.origin) * scale
        # Products of five coordinates must not underflow for the predicates to be exact.
        smallest = np.abs(points[:n][points[:n] != 0.0]).min(initial=1.0)
        if min(smallest, weights[:n].min()) < 2.0**-140:
            raise ComputationError(
                "coordinates or radii smaller than 1e-42 of the box cannot be triangulated exactly; "
                "move the spheres to 0 or away from it"
            )

        # Inside, spheres are numbered along a space-filling curve: near in space, near in memory.
        curve = np.argsort(morton_codes(points[:n]), kind="stable")
        points[:n] = points[curve]
        weights[:n] = weights[curve]
        vertices = Vertices(n, points, weights)
        found = triangulate(vertices, box.size * scale)
        self.neighbours = found.neighbours
        self.local_vertices = _power_centres(found, vertices, 1.0 / scale)
        self.cells = np.concatenate([curve, np.arange(n, n + 6)]).astype(np.int32)[found.vertices]

    @cached_property
    def vertices(self) -> np.ndarray:
        """(m, 3) Laguerre vertices: the power centre of each cell [m]."""
        return self.local_vertices + self.origin

    @cached_property
    def hidden(self) -> np.ndarray:
        """Ids of the spheres without a cell: each lies within the union of others."""
        present = np.zeros(self.n_spheres + 6, bool)
        present[self.cells.ravel()] = True
        return np.flatnonzero(~present[: self.n_spheres])

    def __repr__(self) -> str:
        hidden = f", {len(self.hidden)} hidden" if len(self.hidden) else ""
        return f"RegularTriangulation({self.n_spheres} spheres{hidden}, {len(self.cells)} cells)"


def wall_offsets(box: Box, origin: np.ndarray) -> np.ndarray:
    """(6,) offset of each wall along its outward normal from an origin [m]."""
    return WALL_SENSES * (box.wall_places - origin[WALL_AXES])


def exact_origin(box: Box) -> np.ndarray:
    """A point near the box from which coordinates inside the box are measured without rounding.

    Multiples of the power of two above the box's size, at or between the box and zero: numbers beyond it
    then have no finer bits than the difference can hold.
    """
    grid = 2.0 ** np.ceil(np.log2(box.size))
    origin = np.where(box.lower > 0.0, np.floor(box.lower / grid), 0.0)
    return np.where(box.upper < 0.0, np.ceil(box.upper / grid), origin) * grid


@kernel
def _power_centres(found, vertices, length):
    """(m, 3): power centre of each cell, in units of 1 / length; those of cells with walls lie on them exactly."""
    cells, _, planes = found
    n, _, sizes = vertices
    centres = np.empty((cells.shape[0], 3))
    for t in range(cells.shape[0]):
        for axis in range(3):
            centres[t, axis] = 0.5 * planes[t, axis] * length
        for i in range(4):
            wall = cells[t, i] - n
            if wall >= 0:
                centres[t, WALL_AXES[wall]] = WALL_SENSES[wall] * (sizes[n + wall] * length)
    return centres
