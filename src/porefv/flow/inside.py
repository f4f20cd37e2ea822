"""What is imposed inside a packing: flows and pressures in the pores of regions."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from porefv.errors import ComputationError, InputError, vector
from porefv.flow.regions import Region, check_region, pores_in, region_text
from porefv.flow.walls import Walls
from porefv.mesh.pore_mesh import PoreMesh
from porefv.packing.box import WALLS, Box
from porefv.system.number_checks import LEAST, MOST, check_number, within_range

# The sum of flows, relative to the largest of them, up to which they count as in balance.
FLOW_BALANCE = 1e-9


@dataclass(frozen=True)
class FlowSource:
    """A flow into the pores of a region, divided among them in proportion to their void volumes.

    Parameters
    ----------
    region : Point, Sphere or Box
    flow : float
        Volume injected per unit time, negative if it is withdrawn [m³/s].
    """

    region: Region
    flow: float

    def __post_init__(self) -> None:
        _check_size(self.flow, "a source's flow", "m³/s")


@dataclass(frozen=True)
class FixedPressure:
    """A pressure of all pores of a region, through which fluid enters or leaves the sample.

    Parameters
    ----------
    region : Point, Sphere or Box
    pressure : float
        Imposed piezometric pressure [Pa].
    """

    region: Region
    pressure: float

    def __post_init__(self) -> None:
        _check_size(self.pressure, "a fixed pressure", "Pa")


@dataclass(frozen=True, eq=False)
class ImposedInside:
    """What regions impose on each pore.

    Attributes
    ----------
    sources : (n_pores,) array
        Volume injected per unit time; zero in most pores [m³/s].
    pressures : (n_pores,) array
        Imposed pressure, NaN where there is none [Pa].
    number : (n_pores,) int array
        Which of the fixed pressures that is, -1 where there is none.
    """

    sources: np.ndarray
    pressures: np.ndarray
    number: np.ndarray


def _check_size(value: float, name: str, unit: str) -> None:
    check_number(value, name, f"0 or of size {LEAST:g} to {MOST:g} {unit}", lambda x: x == 0.0 or within_range(abs(x)))


def check_imposed(
    walls: Walls, box: Box, sources: Sequence[FlowSource], fixed_pressures: Sequence[FixedPressure]
) -> None:
    """InputError if what is imposed on walls and regions contradicts itself, or leaves the pressure open.

    Parameters
    ----------
    walls : Walls
    box : Box
    sources : sequence of FlowSource
    fixed_pressures : sequence of FixedPressure
    """
    for kind, given, name in ((FlowSource, sources, "sources"), (FixedPressure, fixed_pressures, "fixed_pressures")):
        for item in given:
            if not isinstance(item, kind):
                raise InputError(f"{name} must be a list of {kind.__name__}, not of {item!r}")
            check_region(item.region, box)
    if walls.held.any() or fixed_pressures:
        return
    if not walls.imposes_flow.any():
        raise InputError("no wall has a pressure: give at least one, for instance y_min = { pressure = 1.0 }")
    flows = [*walls.imposed_flows(box)[walls.imposes_flow], *(source.flow for source in sources)]
    if abs(sum(flows)) > FLOW_BALANCE * max(map(abs, flows)):
        raise InputError(
            f"only flows are imposed, and their sum is {sum(flows):.6g} m³/s instead of 0: as much must leave as "
            "enters. Change one of them, or give a wall a pressure, through which the rest leaves"
        )


def imposed_inside(
    mesh: PoreMesh, walls: Walls, sources: Sequence[FlowSource], fixed_pressures: Sequence[FixedPressure]
) -> ImposedInside:
    """What sources and fixed pressures impose on each pore.

    Parameters
    ----------
    mesh : PoreMesh
    walls : Walls
    sources : sequence of FlowSource
    fixed_pressures : sequence of FixedPressure

    Raises
    ------
    InputError
        If a region has no pores, or a pore would have two pressures.
    """
    flows = np.zeros(mesh.n_pores)
    for source in sources:
        pores = pores_in(mesh, source.region)
        volumes = np.maximum(mesh.pore_volumes[pores], 0.0)
        shares = volumes / volumes.sum() if volumes.any() else np.full(len(pores), 1.0 / len(pores))
        flows[pores] += source.flow * shares
    pressures, number = np.full(mesh.n_pores, np.nan), np.full(mesh.n_pores, -1)
    for k, fixed in enumerate(fixed_pressures):
        pores = pores_in(mesh, fixed.region)
        other = pores[(number[pores] >= 0) & (pressures[pores] != fixed.pressure)]
        if len(other):
            first = region_text(fixed_pressures[number[other[0]]].region)
            raise InputError(
                f"pore {other[0]} lies in {first} and in {region_text(fixed.region)}: it has two pressures"
            )
        new = pores[number[pores] < 0]
        number[new], pressures[new] = k, fixed.pressure
    _refuse_pores_on_walls(mesh, walls, pressures, fixed_pressures, number)
    return ImposedInside(flows, pressures, number)


def _refuse_pores_on_walls(
    mesh: PoreMesh,
    walls: Walls,
    pressures: np.ndarray,
    fixed_pressures: Sequence[FixedPressure],
    number: np.ndarray,
) -> None:
    """InputError if a pore of fixed pressure lies on a wall of another pressure, or of imposed flow."""
    faces = mesh.wall_faces
    pores = mesh.cell_pore[faces.cells]
    on_wall = walls.pressures[faces.walls]
    differs = ~np.isnan(on_wall) & (on_wall != pressures[pores])
    wrong = np.flatnonzero((number[pores] >= 0) & (differs | walls.imposes_flow[faces.walls]))
    if len(wrong):
        wall, pore = faces.walls[wrong[0]], pores[wrong[0]]
        what = "an imposed flow" if walls.imposes_flow[wall] else f"the pressure {on_wall[wrong[0]]:g} Pa"
        raise InputError(
            f"pore {pore} lies in {region_text(fixed_pressures[number[pore]].region)} and on {WALLS[wall]}, which has "
            f"{what}; choose a region away from the wall"
        )


def refuse_sources_without_outlet(mesh: PoreMesh, sources: np.ndarray, connected: np.ndarray) -> None:
    """ComputationError if a pore that is not connected, (n_pores,) bool, has a source, (n_pores,) [m³/s]."""
    wrong = np.flatnonzero((sources != 0.0) & ~connected)
    if len(wrong):
        pore = int(wrong[0])
        raise ComputationError(
            f"pore {pore} at {vector(mesh.pore_centres[pore])} m has a source of {sources[pore]:.6g} m³/s, and no "
            "open path leads from it to an imposed pressure"
        )
