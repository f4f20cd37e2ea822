"""The fluxes of a flow, balanced in each pore to rounding, as the conservation of a solute needs them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from porefv.errors import InputError
from porefv.flow.flux import net_outflows, wall_face_fluxes
from porefv.flow.pore_flow import PoreFlow
from porefv.solvers.pressure_equation import solve_network

# A pore whose fluxes differ by more than this part of them has fluxes of rounding: at the end of a dead branch.
STAGNANT = 1e-6


@dataclass(frozen=True, eq=False)
class BalancedFlow:
    """Fluxes of a flow that each pore passes on.

    Attributes
    ----------
    flux : (t,) array
        Through each throat, from its first pore to its second; zero beside stagnant pores [m³/s].
    face_flux : (w,) array
        Into the sample through each wall face [m³/s].
    sources, fixed : (n_pores,) arrays
        Into the sample with sources, and at fixed pressures [m³/s].
    stagnant : (n_pores,) bool array
        Pores that no fluid passes: isolated ones, and those of dead branches.
    """

    flux: np.ndarray
    face_flux: np.ndarray
    sources: np.ndarray
    fixed: np.ndarray
    stagnant: np.ndarray


def balanced_flow(flow: PoreFlow) -> BalancedFlow:
    """The fluxes of a flow, with the correction that balances them to rounding.

    The solver of the flow leaves some 1e-10 of it out of balance in the pores. The same equation is solved once more
    for what is left over.

    Raises
    ------
    InputError
        If nothing flows in.
    """
    mesh, flux, sources = flow.mesh, flow.flux, flow.flow_of_sources
    pairs, conductances = mesh.throats.pores, flow.conductances
    held = ~np.isnan(flow.imposed_pressures)
    passed = flow.walls_at_pressures.held
    if not flow.inflow > 0.0:
        raise InputError("no fluid enters the sample: a solute is carried by a flow, and needs different pressures")
    left_over = np.where(held | flow.solution.isolated, 0.0, sources - net_outflows(mesh, flux))
    if left_over.any():
        found = solve_network(pairs, conductances, np.where(held, 0.0, np.nan), sources=left_over)
        drops = found.pressure[pairs] + found.rest[pairs]
        flux = flux + conductances * (drops[:, 0] - drops[:, 1])
    faces = mesh.wall_faces
    beside = mesh.cell_pore[faces.cells]
    on_walls = np.bincount(beside, np.where(passed[faces.walls], faces.areas, 0.0), mesh.n_pores) > 0.0
    free = ~held
    flux, stagnant = _without_stagnant(pairs, flux, sources, free)
    given = net_outflows(mesh, flux) - sources
    return BalancedFlow(
        flux, wall_face_fluxes(mesh, given, passed), sources, np.where(free | on_walls, 0.0, given), stagnant
    )


def _without_stagnant(
    pairs: np.ndarray, flux: np.ndarray, sources: np.ndarray, free: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """The fluxes (t,) without those of rounding, and the pores that nothing passes."""
    n = len(free)
    i, j = pairs.T
    while True:
        surplus = np.bincount(i, flux, n) - np.bincount(j, flux, n) - sources
        size = np.bincount(i, np.abs(flux), n) + np.bincount(j, np.abs(flux), n)
        lame = free & (np.abs(surplus) > STAGNANT * size) & (sources == 0.0)
        if not lame.any():
            return flux, size + np.abs(sources) == 0.0
        flux = np.where(lame[pairs].any(axis=1), 0.0, flux)
