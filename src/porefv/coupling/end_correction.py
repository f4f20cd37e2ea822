"""End correction: the effect of the looser layer of grains at a drained wall on drainage, measured and removed.

Pores on a wall of imposed pressure have that pressure over their whole depth, half a grain and more, and the throats
behind them open into a wide void on one side. The sample then drains as if it were shorter by a depth d at each end,
and faster by (1 - 2d/h)^-2. A steady flow across the sample shows d: the line of the pressures between the taps reaches
the pressure of the wall at that distance from the wall.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from porefv.flow.pressure import held_pressures
from porefv.mesh.pore_mesh import PoreMesh
from porefv.packing.box import WALL_AXES
from porefv.packing.packing import Packing
from porefv.solvers.pressure_equation import solve_network

# Taps of the permeameter, as parts of the height, and how many cells between them make a line.
_TAPS = 0.2, 0.8
_FEWEST = 200
# Thickness of the layer at a wall that the sample must reach, in mean diameters, and how much looser it may be than the
# sample between the taps: grains at a plate are looser by up to 0.1 there.
_LAYER, _LOOSER = 2.0, 0.15
# What the flow of the permeameter may fail to conserve, relative to it.
_CLOSE = 1.0e-6


@dataclass(frozen=True)
class Permeameter:
    """Steady flow across a sample, read at taps within it and not at its ends (as in ASTM D2434).

    Attributes
    ----------
    mobility : float
        k / μ between the taps [m²/(Pa s)].
    depths : (float, float)
        Distance from the lower and the upper wall at which the line of pressures reaches that of the wall [m].
    """

    mobility: float
    depths: tuple[float, float]


def permeameter(mesh: PoreMesh, conductances: np.ndarray, axis: int) -> Permeameter | None:
    """Flow between the walls of an axis, read between 0.2 and 0.8 of its length.

    Parameters
    ----------
    mesh : PoreMesh
    conductances : (t,) array
        Of the throats [m³/(Pa s)].
    axis : int

    Returns
    -------
    Permeameter, or None with too few pores between the taps (fewer than 200) for a line.
    """
    height = mesh.box.size[axis]
    place = (mesh.vertices[:, axis] - mesh.box.lower[axis]) / height
    between = (place > _TAPS[0]) & (place < _TAPS[1])
    if np.count_nonzero(between) < _FEWEST:
        return None
    pressures = np.full(6, np.nan)
    pressures[2 * axis : 2 * axis + 2] = 1.0, 0.0
    held = held_pressures(mesh, pressures)
    pressure = solve_network(mesh.throats.pores, conductances, held, tolerance=_CLOSE).pressure
    slope, start = np.polyfit(place[between], pressure[mesh.cell_pore[between]], 1)
    i, j = mesh.throats.pores.T
    flux = conductances * (pressure[i] - pressure[j])
    through = flux[held[i] == 1.0].sum() - flux[held[j] == 1.0].sum()
    if not (slope < 0.0 and through > 0.0):
        return None
    mobility = through * height / (mesh.box.section(axis) * -slope)
    # The line start + slope s is 1 at s = (start - 1) / -slope, and 0 at s = start / -slope.
    lower, upper = (start - 1.0) / -slope * height, (1.0 - start / -slope) * height
    return Permeameter(float(mobility), (float(lower), float(upper)))


def reached_walls(packing: Packing) -> np.ndarray:
    """(6,) bool: walls that the sample reaches, for an end correction to make sense there.

    The porosity of the layer two mean diameters thick along such a wall is at most 0.15 above that between the taps.
    """
    assert packing.walled_box is not None  # a mesh has seen to it
    box, reached = packing.walled_box, np.zeros(6, bool)
    thick = 2.0 * _LAYER * float(packing.radii.mean())
    for axis in range(3):
        lower, size = box.lower[axis], box.size[axis]
        edges = lower + np.array([[0.0, thick], [size - thick, size], [_TAPS[0] * size, _TAPS[1] * size]])
        parts = [_solid_between(packing, axis, low, high) / (box.section(axis) * (high - low)) for low, high in edges]
        reached[2 * axis : 2 * axis + 2] = parts[2] - np.array(parts[:2]) <= _LOOSER
    return reached


def _solid_between(packing: Packing, axis: int, low: float, high: float) -> float:
    """Volume of the spheres between two planes, overlaps counted twice [m³]."""
    r, x = packing.radii, packing.centres[:, axis]
    a, b = (np.clip(plane - x, -r, r) for plane in (low, high))
    return float((np.pi * (r**2 * (b - a) - (b**3 - a**3) / 3.0)).sum())


def end_corrected_conductances(
    mesh: PoreMesh, conductances: np.ndarray, pressures: np.ndarray, free: np.ndarray | None = None
) -> tuple[np.ndarray, np.ndarray]:
    """Conductances with which the pressures of a steady flow reach those of the walls on the walls.

    The throats behind the pores of a wall that holds a pressure take in series the resistance that some depth has
    within the sample, μ d / k, each on its section across the flow. That depth is found from two flows, as all but
    linear in it. Conductances stay as they are where there are too few pores for the taps.

    Parameters
    ----------
    mesh : PoreMesh
    conductances : (t,) array
        Of the throats [m³/(Pa s)].
    pressures : (6,) array
        Imposed on walls, NaN where impervious [Pa].
    free : (6,) bool array, optional
        Walls that are free surfaces, which have no correction. Nor has a wall that the sample does not reach.

    Returns
    -------
    conductances : (t,) array
        [m³/(Pa s)]
    depths : (6,) array
        Depth of the sample that the throats behind the pores of each wall resist as; zero without a correction [m].
    """
    found_depths = np.zeros(6)
    corrected = ~np.isnan(pressures)
    if corrected.any():
        corrected &= reached_walls(mesh.packing)
    if free is not None:
        corrected &= ~free
    for axis in range(3):
        walls = np.arange(2 * axis, 2 * axis + 2)
        drained = corrected[walls]
        found = permeameter(mesh, conductances, axis) if drained.any() else None
        if found is None:
            continue
        short = np.where(drained, np.maximum(found.depths, 0.0), 0.0)
        tried = permeameter(mesh, _resisting(mesh, conductances, walls, short, found.mobility), axis)
        if tried is None:
            continue
        gained = short - np.where(drained, tried.depths, 0.0)
        depths = np.divide(short**2, gained, out=np.zeros(2), where=gained > 0.0)
        conductances = _resisting(mesh, conductances, walls, depths, found.mobility)
        found_depths[walls] = depths
    return conductances, found_depths


def _resisting(
    mesh: PoreMesh, conductances: np.ndarray, walls: np.ndarray, depths: np.ndarray, mobility: float
) -> np.ndarray:
    """Conductances with the throats behind each wall's pores resisting as so much depth more."""
    conductances = conductances.copy()
    faces, throats = mesh.wall_faces, mesh.throats
    for wall, depth in zip(walls, depths, strict=True):
        if depth > 0.0:
            on_wall = np.zeros(mesh.n_pores, bool)
            on_wall[mesh.cell_pore[faces.cells[faces.walls == wall]]] = True
            behind = on_wall[throats.pores].sum(axis=1) == 1
            through = mobility / depth * throats.areas[behind] * np.abs(throats.normals[behind, WALL_AXES[wall]])
            # 1 / (1/K + 1/K'), without dividing by what may be nothing.
            both = conductances[behind] + through
            series = np.divide(conductances[behind] * through, both, out=np.zeros(len(both)), where=both > 0.0)
            conductances[behind] = series
    return conductances
