"""A sample cut by a plane: grains are discs, cells are convex polygons, both exact."""

from __future__ import annotations

from dataclasses import dataclass
from numbers import Real

import numpy as np

from porefv.errors import InputError
from porefv.mesh.polyhedra import HEXAHEDRON, TETRA, WEDGE, Polyhedra
from porefv.packing.box import Box

# Edges of VTK's cells, as pairs of their nodes.
_EDGES = {
    TETRA: [(0, 1), (1, 2), (2, 0), (0, 3), (1, 3), (2, 3)],
    WEDGE: [(0, 1), (1, 2), (2, 0), (3, 4), (4, 5), (5, 3), (0, 3), (1, 4), (2, 5)],
    HEXAHEDRON: [(0, 1), (1, 2), (2, 3), (3, 0), (4, 5), (5, 6), (6, 7), (7, 4), (0, 4), (1, 5), (2, 6), (3, 7)],
}


@dataclass(frozen=True)
class Plane:
    """A plane normal to an axis.

    Attributes
    ----------
    normal : int
        Axis to which the plane is normal: 0, 1, 2.
    at : float
        Its place along this axis [m].
    across, up : int
        Axes that a picture of it shows from left to right, and upwards.
    """

    normal: int
    at: float
    across: int
    up: int

    @classmethod
    def through(cls, box: Box, axis: str | None = None, at: float | None = None, upright: int | None = None) -> Plane:
        """The plane normal to an axis, at a place.

        Parameters
        ----------
        box : Box
        axis : {"x", "y", "z"}, optional
            By default one that leaves the upright axis in the plane.
        at : float, optional
            The middle of the box by default [m].
        upright : int, optional
            Axis that points up in the picture, if it lies in the plane; z by default.

        Raises
        ------
        InputError
            If the plane does not pass through the inside of the box.
        """
        upright = 2 if upright is None else upright
        if axis is not None and axis not in ("x", "y", "z"):
            raise InputError(f"the axis of a section must be x, y or z, not {axis!r}")
        normal = {2: 1, 1: 2, 0: 2}[upright] if axis is None else "xyz".index(axis)
        low, high = box.lower[normal], box.upper[normal]
        if at is not None and (isinstance(at, bool) or not isinstance(at, Real)):
            raise InputError(f"the place of a section must be a number of metres, not {at!r}")
        at = 0.5 * (low + high) if at is None else float(at)
        if not low < at < high:
            raise InputError(
                f"a section normal to {'xyz'[normal]} must lie within the box, between {low:.6g} and {high:.6g} m, "
                f"not at {at:.6g} m"
            )
        others = [k for k in range(3) if k != normal]
        up = upright if upright != normal else others[1]
        return cls(normal, at, next(k for k in others if k != up), up)

    def project(self, points: np.ndarray) -> np.ndarray:
        """(p, 2): points (p, 3) in the coordinates of the picture."""
        return points[:, [self.across, self.up]]


@dataclass(frozen=True, eq=False)
class Discs:
    """Grains cut by a plane: their ids (k,), centres (k, 2) and radii (k,) in it [m]."""

    spheres: np.ndarray
    centres: np.ndarray
    radii: np.ndarray


def cut_spheres(centres: np.ndarray, radii: np.ndarray, plane: Plane) -> Discs:
    """The discs of the spheres that a plane cuts."""
    heights = centres[:, plane.normal] - plane.at
    cut = np.flatnonzero(np.abs(heights) < radii)
    # (r - h)(r + h) loses fewer digits than r² - h².
    half_chords = np.sqrt((radii[cut] - heights[cut]) * (radii[cut] + heights[cut]))
    return Discs(cut, plane.project(centres[cut]), half_chords)


@dataclass(frozen=True, eq=False)
class Polygons:
    """Cells cut by a plane.

    Attributes
    ----------
    cells : (k,) int array
        Cell of each polygon.
    corners : list of (c, 2) arrays
        In order around each polygon [m].
    """

    cells: np.ndarray
    corners: list[np.ndarray]

    @property
    def areas(self) -> np.ndarray:
        """(k,): area of each polygon [m²]."""
        return np.array([_area(corners) for corners in self.corners])

    @property
    def centroids(self) -> np.ndarray:
        """(k, 2): mean of the corners of each polygon [m]."""
        return np.array([corners.mean(axis=0) for corners in self.corners]).reshape(-1, 2)


def cut_cells(polyhedra: Polyhedra, plane: Plane) -> Polygons:
    """The polygons of the cells that a plane cuts; a node on the plane counts as above it.

    Cells are convex, so that a polygon's corners are in the order of their angles about its middle. Polygons tile the
    section of the box.
    """
    heights = polyhedra.points[:, plane.normal] - plane.at
    above = heights >= 0.0
    cells: list[np.ndarray] = []
    corners: list[np.ndarray] = []
    for kind, edges in _EDGES.items():
        ids, nodes = polyhedra.of_type(kind)
        cut = above[nodes].any(axis=1) & ~above[nodes].all(axis=1)
        ids, nodes = ids[cut], nodes[cut]
        first, second = (nodes[:, list(ends)] for ends in zip(*edges, strict=True))
        crosses = above[first] != above[second]
        drop = np.where(crosses, heights[first] - heights[second], 1.0)
        part = np.where(crosses, heights[first] / drop, 0.0)[..., None]
        flat = [plane.project(polyhedra.points[ends.ravel()]).reshape(*ends.shape, 2) for ends in (first, second)]
        points = (1.0 - part) * flat[0] + part * flat[1]
        for found, crossing in zip(points, crosses, strict=True):
            corner = found[crossing]
            out = corner - corner.mean(axis=0)
            corners.append(corner[np.argsort(np.arctan2(out[:, 1], out[:, 0]))])
        cells.append(ids)
    return Polygons(np.concatenate(cells), corners)


def _area(corners: np.ndarray) -> float:
    x, y = (corners - corners[0]).T
    return float(0.5 * (x * np.roll(y, -1) - np.roll(x, -1) * y).sum())


def open_points(polygons: Polygons, discs: Discs) -> tuple[np.ndarray, np.ndarray]:
    """A point of each polygon far from the discs: points (k, 2), and their distance (k,) from the nearest disc [m].

    It is the best of the polygon's middle and points between it, its corners and the middles of its sides. The
    distance is negative where all of these are inside discs.
    """
    points, distances = np.empty((len(polygons.corners), 2)), np.empty(len(polygons.corners))
    for k, corners in enumerate(polygons.corners):
        middle = corners.mean(axis=0)
        rim = np.concatenate([corners, 0.5 * (corners + np.roll(corners, -1, axis=0))])
        candidates = np.concatenate([middle[None], 0.5 * (middle + rim), 0.1 * middle + 0.9 * rim])
        if len(discs.radii):
            gaps = (np.linalg.norm(candidates[:, None] - discs.centres, axis=2) - discs.radii).min(axis=1)
        else:
            gaps = np.full(len(candidates), np.inf)
        points[k], distances[k] = candidates[gaps.argmax()], gaps.max()
    return points, distances
