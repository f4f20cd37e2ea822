"""Conductances of throats, from the conductivity that a model gives."""

from __future__ import annotations

import numpy as np

from porefv.conductance.model import ConductanceModel, ensure_model
from porefv.mesh.pore_mesh import PoreMesh
from porefv.system.number_checks import ensure_finite


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
    ComputationError
        If a conductance is not a finite number.
    """
    throats = mesh.throats
    conductivity = ensure_model(model).conductivity(throats, slip)
    lengths = viscosity * throats.effective_lengths
    with np.errstate(over="ignore", invalid="ignore"):  # what is not finite is refused below
        conductances = np.divide(conductivity, lengths, out=lengths)
    conductances[(conductivity <= 0.0) | throats.closed] = 0.0
    return ensure_finite(conductances, f"conductances of {model.name}")
