"""Conductances of throats, from the conductivity that a model gives."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from porefv.conductance.model import ConductanceModel, ensure_model
from porefv.errors import InputError, counted
from porefv.mesh.pore_mesh import PoreMesh
from porefv.packing.box import WALLS
from porefv.system.number_checks import check_number, ensure_finite, one_value_each


def throat_conductances(mesh: PoreMesh, model: ConductanceModel, slip: np.ndarray, viscosity: float) -> np.ndarray:
    """Conductance K of each throat, q = K (p_i - p_j), from K = g / (μ L).

    Parameters
    ----------
    mesh : PoreMesh
    model : ConductanceModel
    slip : (6,) bool array
        Walls of symmetry.
    viscosity : float
        μ of the fluid [Pa s].

    Returns
    -------
    (t,) array
        Zero where a throat is closed [m³/(Pa s)].

    Raises
    ------
    InputError
        If the model is no `ConductanceModel`, or gives an array of another shape; if the viscosity is not positive.
    ComputationError
        If a conductance is not a finite number.

    Notes
    -----
    Theory, method: :eq:`eq-conductance`.
    """
    ensure_pore_mesh(mesh)
    throats, slip = mesh.throats, one_value_each(slip, len(WALLS), "wall", "slip", bool)
    check_number(viscosity, "viscosity", "a positive number of Pa s", lambda x: x > 0.0)
    conductivity = ensure_model(model).conductivity(throats, slip)
    conductivity = one_value_each(conductivity, len(throats), "throat", f"the conductivity of the model {model.name}")
    lengths = viscosity * throats.effective_lengths
    with np.errstate(over="ignore", invalid="ignore"):  # what is not finite is refused below
        conductances = np.divide(conductivity, lengths, out=lengths)
    conductances[(conductivity <= 0.0) | throats.closed] = 0.0
    return ensure_finite(conductances, f"conductances of {model.name}")


def ensure_pore_mesh(mesh: PoreMesh) -> None:
    """InputError if a mesh has no pores and throats."""
    if not isinstance(mesh, PoreMesh):
        given = type(mesh).__name__
        raise InputError(f"mesh must be a PoreMesh, not {given}: write PoreMesh(packing)")


def check_conductances(mesh: PoreMesh, conductances: ArrayLike, unit: str = "m³/(Pa s)") -> np.ndarray:
    """(t,) float array of conductances; InputError if the shape is another, or a value is negative or not finite."""
    ensure_pore_mesh(mesh)
    found = one_value_each(conductances, len(mesh.throats), "throat", "conductances")
    wrong = np.flatnonzero(~((found >= 0.0) & np.isfinite(found)))
    if len(wrong):
        raise InputError(
            f"conductances must be finite and not negative: {counted(len(wrong), 'throat')} are not, the first of them "
            f"throat {wrong[0]} with {found[wrong[0]]:g} {unit}; zero closes a throat"
        )
    return found
