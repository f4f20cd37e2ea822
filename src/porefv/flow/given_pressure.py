"""A pressure that was found elsewhere, as the pressure field of a flow."""

from __future__ import annotations

import warnings
from dataclasses import replace

import numpy as np

from porefv.errors import ImbalanceWarning, InputError, counted
from porefv.flow.flux import fluxes, net_outflows
from porefv.flow.pressure import PressureField, as_field, check_by_pore, held_pressures, reference_pressure
from porefv.flow.walls import Walls
from porefv.mesh.pore_mesh import PoreMesh
from porefv.solvers.pressure_equation import reached

# How far a given pressure may be from the imposed one of its pore, relative to the range of the imposed pressures.
GIVEN_TOLERANCE = 1e-6
# Imbalance of a given pressure, relative to the flow, up to which no warning is given.
BALANCED = 1e-3


def given_pressure(
    mesh: PoreMesh,
    conductances: np.ndarray,
    pressure: np.ndarray,
    walls: Walls,
    *,
    sources: np.ndarray | None = None,
    inside: np.ndarray | None = None,
) -> PressureField:
    """A pressure field found elsewhere, with the imbalance that it leaves.

    Parameters
    ----------
    mesh : PoreMesh
    conductances : (t,) array
        K of each throat [m³/(Pa s)].
    pressure : (n_pores,) array
        Pressure of each pore; on walls of imposed pressure the imposed one, to `GIVEN_TOLERANCE` of their range [Pa].
    walls : Walls
    sources, inside
        As of `porefv.flow.pressure.solve_pressure`.

    Raises
    ------
    InputError
        For pressures of the wrong shape, not finite, or other than those imposed.
    """
    pressure = check_by_pore(mesh, pressure)
    reference = reference_pressure(walls, inside)
    imposed = held_pressures(mesh, walls.pressures, inside)
    free = np.isnan(imposed)
    known = imposed[~free]
    span = float(np.ptp(known)) or float(np.ptp(pressure)) or abs(reference) or 1.0
    wrong = np.flatnonzero(np.abs(pressure - imposed) > GIVEN_TOLERANCE * span)  # false for free pores, which have NaN
    if len(wrong):
        raise InputError(
            f"{counted(len(wrong), 'pore')} on walls of imposed pressure have another pressure, the first of them "
            f"pore {wrong[0]}: {pressure[wrong[0]]:.6g} Pa instead of {imposed[wrong[0]]:.6g} Pa; give the pressure of "
            "every pore, those on the walls included"
        )
    isolated = ~reached(mesh.throats.pores, conductances, ~free)
    field = replace(as_field(mesh, pressure - reference), reference=reference, isolated=isolated)
    flux = fluxes(mesh, conductances, field)
    outflow = net_outflows(mesh, flux) - (0.0 if sources is None else sources)
    lost, through = float(np.abs(outflow[free]).sum()), 0.5 * float(np.abs(outflow[~free]).sum())
    imbalance = lost / (through or float(np.abs(flux).sum()) or 1.0)
    if imbalance > BALANCED:
        warnings.warn(
            f"the given pressure leaves {imbalance:.1e} of the flow out of balance: was it found with other "
            "conductances than those of this flow?",
            ImbalanceWarning,
            stacklevel=3,
        )
    report = replace(field.report, unknowns=int(np.count_nonzero(free)), imbalance=imbalance)
    return replace(field, report=report)
