"""The inside of a sample, away from walls and free space: its porosity and its permeability."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from porefv.mesh.pore_mesh import PoreMesh
from porefv.packing.box import Box

# Distance from the walls, and from the outermost spheres, in mean diameters; and least number of cells inside.
_AWAY, _LEAST = 2.0, 100


@dataclass(frozen=True)
class Interior:
    """The inside of a sample: the cells whose Laguerre vertices are two mean diameters away from walls and free space.

    Attributes
    ----------
    porosity : float
        Void over volume of these cells.
    permeability : float
        Along the axis of flow: mean flux over mean pressure gradient, times viscosity [m²].
    cells : int
        How many there are.
    """

    porosity: float
    permeability: float
    cells: int


def interior(
    mesh: PoreMesh, pressure: np.ndarray, velocity: np.ndarray, axis: int, viscosity: float
) -> Interior | None:
    """Porosity and permeability of the inside; None if it has fewer than 100 cells.

    Parameters
    ----------
    mesh : PoreMesh
    pressure : (n_pores,) array
        [Pa]
    velocity : (n_pores, 3) array
        Mean velocity of the fluid in each pore [m/s].
    axis : int
        Of flow.
    viscosity : float
        [Pa s]
    """
    around, box = Box.around(mesh.packing), mesh.box
    away = _AWAY * 2.0 * float(mesh.packing.radii.mean())
    lower, upper = np.maximum(around.lower, box.lower) + away, np.minimum(around.upper, box.upper) - away
    chosen = ((mesh.vertices > lower) & (mesh.vertices < upper)).all(axis=1)
    if np.count_nonzero(chosen) < _LEAST:
        return None
    return of_cells(mesh, chosen, pressure, velocity, axis, viscosity)


def of_cells(
    mesh: PoreMesh, chosen: np.ndarray, pressure: np.ndarray, velocity: np.ndarray, axis: int, viscosity: float
) -> Interior:
    """Porosity and permeability of some cells, `chosen` (m,) bool; other arguments as of `interior`."""
    cells = int(np.count_nonzero(chosen))
    volumes, voids, pores = mesh.cell_volumes[chosen], mesh.cell_void_volumes[chosen], mesh.cell_pore[chosen]
    flux = voids @ velocity[pores, axis] / volumes.sum()
    # The plane that fits the pressures of the cells best, by volume.
    weight = np.sqrt(volumes)
    places = np.column_stack([mesh.vertices[chosen] - mesh.vertices[chosen].mean(axis=0), np.ones(cells)])
    relative = pressure[pores] - pressure[pores].mean()
    gradient = np.linalg.lstsq(weight[:, None] * places, weight * relative, rcond=None)[0][axis]
    permeability = float(viscosity * flux / -gradient) if gradient != 0.0 else float("nan")
    return Interior(float(voids.sum() / volumes.sum()), permeability, cells)
