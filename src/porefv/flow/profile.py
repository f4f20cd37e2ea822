"""Porosity and pressure by layer, and the flux through planes, along an axis of the box."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import ArrayLike

from porefv.errors import InputError
from porefv.flow.walls import Walls
from porefv.mesh.polyhedra import polyhedra
from porefv.mesh.pore_mesh import PoreMesh
from porefv.packing.box import WALL_AXES
from porefv.packing.layers import layer_edges, layer_porosities


@dataclass(frozen=True, eq=False)
class Profile:
    """Porosity and mean pressure of each layer between planes normal to an axis.

    Attributes
    ----------
    axis : int
        0, 1 or 2.
    edges : (l + 1,) array
        Places of the planes along the axis, from wall to wall [m].
    porosity : (l,) array
        See `porefv.packing.layers.layer_porosities`.
    pressure : (l,) array
        See `layer_pressures` [Pa].
    """

    axis: int
    edges: np.ndarray
    porosity: np.ndarray
    pressure: np.ndarray


def axis_number(axis: str | None, walls: Walls) -> int:
    """0, 1 or 2 for an axis "x", "y" or "z"; for None, that of the pair of opposite pressure walls.

    Raises
    ------
    InputError
        If the axis is unknown, or none is given and there is no single pair.
    """
    if axis is None:
        if walls.axis is None:
            raise InputError('the pressure walls are not one pair of opposite walls: give an axis "x", "y" or "z"')
        return walls.axis
    if axis not in ("x", "y", "z"):
        raise InputError(f"axis must be 'x', 'y' or 'z', not {axis!r}")
    return "xyz".index(axis)


def profile(mesh: PoreMesh, pressure: np.ndarray, axis: int, layers: int = 10) -> Profile:
    """Porosity and mean pressure of equally thick layers along an axis.

    Parameters
    ----------
    mesh : PoreMesh
    pressure : (n_pores,) array
        Piezometric pressure of each pore [Pa].
    axis : int
        0, 1 or 2.
    layers : int
        Number of layers.
    """
    edges = layer_edges(mesh.box, axis, layers)
    porosity = layer_porosities(mesh.packing, axis, edges)
    return Profile(axis, edges, porosity, layer_pressures(mesh, pressure, axis, edges))


def layer_pressures(mesh: PoreMesh, pressure: np.ndarray, axis: int, edges: np.ndarray) -> np.ndarray:
    """(l,): mean pressure of the void of each layer, Σ V p / Σ V over the parts of the cells that lie in it [Pa].

    V is the void volume of a cell times the part of the cell's extent along the axis that lies in the layer: the
    volume counts as evenly spread over the extent. A layer without void has NaN.
    """
    solids = polyhedra(mesh)
    corners, first = solids.points[solids.connectivity, axis], solids.offsets[:-1]
    begin, end = np.minimum.reduceat(corners, first), np.maximum.reduceat(corners, first)
    per_length = np.maximum(mesh.cell_void_volumes, 0.0) / np.maximum(end - begin, np.finfo(float).tiny)
    # Above the lowest pressure, so that a small drop on a large pressure keeps its digits.
    lowest = pressure.min()
    excess = (pressure - lowest)[mesh.cell_pore]
    means = np.full(len(edges) - 1, np.nan)
    for layer, (lower, upper) in enumerate(pairwise(edges)):
        volumes = per_length * np.maximum(np.minimum(end, upper) - np.maximum(begin, lower), 0.0)
        total = volumes.sum()
        if total > 0.0:
            means[layer] = lowest + (volumes * excess).sum() / total
    return means


def plane_fluxes(mesh: PoreMesh, flux: np.ndarray, face_flux: np.ndarray, axis: int, places: ArrayLike) -> np.ndarray:
    """Flux through planes normal to an axis, in the sense of the axis.

    A pore lies on the side of a plane on which its Laguerre vertex does; what passes between pores on two sides passes
    the plane, and so does what passes between a wall face and a pore on two sides. In a steady flow between two
    opposite walls, every plane has the flux of the walls.

    Parameters
    ----------
    mesh : PoreMesh
    flux : (t,) array
        Flux of each throat, from its first pore to its second [m³/s].
    face_flux : (w,) array
        Flux into the sample through each wall face [m³/s].
    axis : int
        0, 1 or 2.
    places : (p,) array
        Along the axis, inside the box [m].

    Returns
    -------
    (p,) array [m³/s]

    Raises
    ------
    InputError
        For a place that is not inside the box.
    """
    places = np.asarray(places, float)
    lower, upper = mesh.box.lower[axis], mesh.box.upper[axis]
    if places.ndim != 1 or not ((places > lower) & (places < upper)).all():
        raise InputError(f"planes must be places between {lower:.6g} and {upper:.6g} m, not {places.tolist()}")
    faces = mesh.wall_faces
    of_pores = mesh.pore_centres[:, axis]
    of_faces = faces.centroids[:, axis] + mesh.triangulation.origin[axis]
    of_faces = np.where(WALL_AXES[faces.walls] == axis, mesh.box.wall_places[faces.walls], of_faces)
    begin = np.concatenate([of_pores[mesh.throats.pores[:, 0]], of_faces])
    end = np.concatenate([of_pores[mesh.throats.pores[:, 1]], of_pores[mesh.cell_pore[faces.cells]]])
    through = np.concatenate([flux, face_flux])
    return np.array([through[(begin < z) & (end >= z)].sum() - through[(end < z) & (begin >= z)].sum() for z in places])
