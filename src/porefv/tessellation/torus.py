"""TorusTriangulation: the regular triangulation of spheres that are repeated without end, one period of it.

The spheres are triangulated with images of them around the cell, in a box far away. A cell of the triangulation is one
of the periodic one if no image of a sphere is in conflict with it, and an image that may be lies within R of its power
centre P, R² = ρ² + r_max² (as in `porefv.tessellation.blocks`). Where the balls of all cells at the spheres themselves
lie within the space that holds all images, these cells are certain; where one does not, more images are taken.

Of all repetitions of a cell one is kept: that whose first vertex, in the order of spheres and then of their steps, is
inside the periodic cell. The perturbation that decides ties is the same for all repetitions, because it depends on
differences of centres alone. Images must be exact translates of their spheres for that: centres and vectors are rounded
to multiples of one power of two, so fine that they move by less than 1e-15 of the cell, and so coarse that sums and
differences of all images are exact.
"""

from __future__ import annotations

import numpy as np

from porefv.errors import ComputationError
from porefv.packing.box import Box
from porefv.packing.cell import Cell, reduced_basis
from porefv.packing.images import Images, faces_of, images_within
from porefv.packing.memory_estimate import ensure_room_for_cells
from porefv.tessellation.triangulation import RegularTriangulation

# Width of the layer of images at first, in mean distances of spheres and in largest radii, and by how much it grows.
_REACH, _REACH_RADII, _GROWTH = 1.5, 1.5, 1.5
# Relative error of the radius of a ball, as in `cells_are_certain` of the blocks.
_MARGIN = 1.000001
# The other three vertices of a facet opposite to each of a cell's vertices.
OTHERS = np.array([[1, 2, 3], [0, 2, 3], [0, 1, 3], [0, 1, 2]])


class TorusTriangulation:
    """Regular triangulation of the spheres of a periodic cell and all their images, one period of it.

    Parameters
    ----------
    centres : (n, 3) array
        A centre of each sphere: any of its images [m].
    radii : (n,) array
        Sphere radii [m].
    cell : Cell
        The periodic cell.

    Attributes
    ----------
    origin : (3,) array
        The cell's origin, from which local coordinates are measured [m].
    vectors : (3, 3) array
        Short lattice vectors of the same lattice, one a row: steps count them, not those of the cell [m].
    points : (n, 3) array
        The image of each sphere in the parallelepiped of these vectors, from the origin [m].
    cells : (m, 4) int32 array
        Spheres of each cell, positively oriented.
    steps : (m, 4, 3) int16 array
        Steps from each of these spheres to its image that is the cell's vertex.
    neighbours : (m, 4) int32 array
        Cell across the facet opposite to each vertex.
    neighbour_steps : (m, 4, 3) int16 array
        Steps from that cell to its image that is the neighbour.
    local_vertices : (m, 3) array
        Laguerre vertex (power centre) of each cell, from the origin [m].
    n_images : int
        How many images were triangulated.
    """

    def __init__(self, centres: np.ndarray, radii: np.ndarray, cell: Cell):
        self.n_spheres = len(radii)
        self.cell = cell
        self.origin = cell.origin
        reach = _REACH * (cell.volume / len(radii)) ** (1.0 / 3.0) + _REACH_RADII * float(radii.max())
        while True:
            self.vectors, self.points = _on_a_grid(centres - cell.origin, cell.vectors, reach)
            faces = faces_of(self.vectors)
            fractions = np.clip(np.linalg.solve(self.vectors.T, self.points.T).T, 0.0, 1.0)
            images = images_within(fractions, faces.heights, reach)
            ensure_room_for_cells(8 * len(images.spheres))
            centres_of_images = self.points[images.spheres] + images.steps @ self.vectors
            sizes = radii[images.spheres]
            lower, upper = centres_of_images.min(axis=0), centres_of_images.max(axis=0)
            extent = (upper - lower).max() + reach
            found = RegularTriangulation(centres_of_images, sizes, Box(lower - extent, upper + extent))
            distances = found.vertices @ faces.normals.T
            if _are_certain(found, images, centres_of_images, sizes, distances, faces.heights, reach):
                break
            reach *= _GROWTH
        self.n_images = len(sizes)
        self._keep_one_period(found, images)

    def _keep_one_period(self, found: RegularTriangulation, images: Images) -> None:
        """Fill in the cells whose first vertex is in the periodic cell, and join them."""
        k = len(images.spheres)
        # Images are in the order of spheres and steps: the first vertex is the least. Walls, which come last, are never
        # vertices of these cells.
        at_home = np.zeros(k + 6, bool)
        at_home[:k] = ~images.steps.any(axis=1)
        own = np.flatnonzero(at_home[found.cells.min(axis=1)])
        number = np.full(len(found.cells) + 1, -1, np.int32)
        number[own] = np.arange(len(own))
        cells = found.cells[own]
        self.cells = images.spheres.astype(np.int32)[cells]
        self.steps = images.steps.astype(np.int16)[cells]
        self.local_vertices = found.local_vertices[own] + found.origin
        self.neighbours = number[found.neighbours[own]]
        self.neighbour_steps = np.zeros((len(own), 4, 3), np.int16)
        # Facets that are those of images of other cells occur twice, once from each side, but for steps.
        cell, place = np.nonzero(self.neighbours < 0)
        rows = np.sort(cells[cell[:, None], OTHERS[place]], axis=1)
        spheres, steps = images.spheres[rows], images.steps[rows]
        away = steps - steps[:, :1]
        width = 4 * int(np.abs(images.steps).max(initial=0)) + 3
        codes = (away[:, 1:] @ np.array([width**2, width, 1]))[:, ::-1]
        keys = (*codes.T, *spheres.T[::-1])
        order = np.lexsort(keys)
        if len(order) % 2:
            raise ComputationError("the periodic triangulation is not closed: a facet has one side only")
        a, b = order.reshape(-1, 2).T
        repeated = [(key[a] == key[b]).all() for key in keys]
        unique = np.zeros(max(len(a) - 1, 0), bool)
        for key in keys:
            unique |= key[a[1:]] != key[a[:-1]]
        if not (all(repeated) and unique.all()):
            raise ComputationError("the periodic triangulation is not closed: a facet has not two sides")
        self.neighbours[cell[a], place[a]] = cell[b]
        self.neighbours[cell[b], place[b]] = cell[a]
        self.neighbour_steps[cell[a], place[a]] = steps[a, 0] - steps[b, 0]
        self.neighbour_steps[cell[b], place[b]] = steps[b, 0] - steps[a, 0]

    def __repr__(self) -> str:
        return f"TorusTriangulation({self.n_spheres} spheres, {len(self.cells)} cells)"


def _on_a_grid(local: np.ndarray, vectors: np.ndarray, reach: float) -> tuple[np.ndarray, np.ndarray]:
    """Short lattice vectors (3, 3), and points (n, 3) in their parallelepiped, as multiples of a power of two [m]."""
    layers = 2.0 + reach / faces_of(reduced_basis(vectors)).heights
    farthest = float((np.abs(reduced_basis(vectors)) * layers[:, None]).sum(axis=0).max())
    grid = 2.0 ** (np.ceil(np.log2(4.0 * farthest)) - 52.0)
    # Whole multiples of the vectors are taken off exactly; what is far from the cell is rounded once more.
    short = reduced_basis(np.rint(vectors / grid) * grid)
    points = np.rint(local / grid) * grid
    for _ in range(2):
        points -= np.floor(np.linalg.solve(short.T, points.T).T) @ short
        points = np.rint(points / grid) * grid
    return short, points


def _are_certain(
    found: RegularTriangulation,
    images: Images,
    centres: np.ndarray,
    radii: np.ndarray,
    distances: np.ndarray,
    heights: np.ndarray,
    reach: float,
) -> bool:
    """Whether every cell at a sphere of the periodic cell keeps clear of all images that were not taken.

    `distances` (m, 3) are those of the power centres from the cell's faces at its origin, along their normals [m].
    """
    k = len(radii)
    at_home = np.zeros(k + 6, bool)
    at_home[:k] = ~images.steps.any(axis=1)
    touching = at_home[found.cells].any(axis=1)
    spheres = found.cells[touching].min(axis=1)
    away = ((centres[spheres] - found.vertices[touching]) ** 2).sum(axis=1)
    balls = _MARGIN * np.sqrt(np.maximum(away - radii[spheres] ** 2 + radii.max() ** 2, 0.0))[:, None]
    places = distances[touching]
    return bool(((places - balls >= -reach) & (places + balls < heights + reach)).all())
