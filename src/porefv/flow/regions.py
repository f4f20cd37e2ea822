"""Regions of a packing: a point, a sphere or a box, and the pores that lie in them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TypeAlias

import numpy as np
from numpy.typing import ArrayLike

from porefv.errors import InputError, vector
from porefv.mesh.pore_mesh import PoreMesh
from porefv.packing.box import Box
from porefv.system.number_checks import check_number, three_numbers, within_range


@dataclass(frozen=True, init=False)
class Point:
    """A point, which stands for one pore.

    In the void this is the pore whose cell contains the point. In a grain it is the pore whose Laguerre vertex is
    nearest to the point.

    Parameters
    ----------
    position : (3,) array
        [m]
    """

    position: tuple[float, float, float]

    def __init__(self, position: ArrayLike):
        x, y, z = three_numbers(position, "a point", "m").tolist()
        object.__setattr__(self, "position", (x, y, z))

    def __str__(self) -> str:
        return f"the point {vector(self.position)}"


@dataclass(frozen=True, init=False)
class Sphere:
    """A spherical region, which stands for the pores whose Laguerre vertices it contains.

    Parameters
    ----------
    centre : (3,) array
        [m]
    radius : float
        [m]
    """

    centre: tuple[float, float, float]
    radius: float

    def __init__(self, centre: ArrayLike, radius: float):
        x, y, z = three_numbers(centre, "the centre of a sphere", "m").tolist()
        check_number(radius, "the radius of a sphere", "a positive number of m", lambda r: r > 0.0 and within_range(r))
        object.__setattr__(self, "centre", (x, y, z))
        object.__setattr__(self, "radius", float(radius))

    def __str__(self) -> str:
        return f"the sphere of radius {self.radius:.6g} m at {vector(self.centre)}"


# A box stands for the pores whose Laguerre vertices it contains, its surface included.
Region: TypeAlias = Point | Sphere | Box
REGIONS = (Point, Sphere, Box)


def region_text(region: Region) -> str:
    """A region in words, for messages."""
    return f"the box from {vector(region.lower)} to {vector(region.upper)}" if isinstance(region, Box) else str(region)


def check_region(region: Region, box: Box) -> None:
    """InputError for what is no region, or for a point outside the box of the packing."""
    if not isinstance(region, REGIONS):
        raise InputError(f"a region must be a Point, a Sphere or a Box, not {region!r}")
    if isinstance(region, Point) and (box.wall_distances(np.array([region.position])) < 0.0).any():
        raise InputError(
            f"{region_text(region)} lies outside the box of the packing, from {vector(box.lower)} to "
            f"{vector(box.upper)}"
        )


def pores_in(mesh: PoreMesh, region: Region) -> np.ndarray:
    """(k,) int array: the pores that a region stands for, in increasing order.

    The Laguerre vertex of a pore of several cells is the mean of those of its cells.

    Raises
    ------
    InputError
        If there are none.
    """
    if isinstance(region, Point):
        return np.array([pore_at(mesh, np.array(region.position))])
    vertices = mesh.pore_centres
    if isinstance(region, Sphere):
        inside = np.linalg.norm(vertices - region.centre, axis=1) <= region.radius
    else:
        inside = ((vertices >= region.lower) & (vertices <= region.upper)).all(axis=1)
    if not inside.any():
        raise InputError(
            f"no pore has its Laguerre vertex in {region_text(region)}; give a larger region, or a point, which stands "
            "for the one pore that contains it"
        )
    return np.flatnonzero(inside)


def pore_at(mesh: PoreMesh, position: np.ndarray) -> int:
    """The pore that a point (3,) of the box stands for [m]; see `Point`."""
    distances = np.linalg.norm(mesh.packing.centres - position, axis=1)
    if (distances < mesh.packing.radii).any():
        return int(np.argmin(np.linalg.norm(mesh.pore_centres - position, axis=1)))
    # Cells are convex: a point is in the cell whose facets it is all behind.
    facets = mesh.facets
    local = position - mesh.triangulation.origin
    beyond = np.nan_to_num(np.einsum("fa,fa->f", facets.normals, local - facets.centroids))  # of facets without area
    farthest = np.full(mesh.n_cells, -np.inf)
    np.maximum.at(farthest, facets.cells[:, 0], beyond)
    np.maximum.at(farthest, facets.cells[:, 1], -beyond)
    return int(mesh.cell_pore[np.argmin(farthest)])
