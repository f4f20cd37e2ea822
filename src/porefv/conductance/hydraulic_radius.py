"""Conductance by hydraulic radius, the model of C12."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from porefv.conductance.model import ConductanceModel
from porefv.errors import InputError
from porefv.mesh.throats import Throats
from porefv.system.kernels import njit, prange
from porefv.system.number_checks import LEAST, MOST, within_range


@dataclass(frozen=True)
class HydraulicRadius(ConductanceModel):
    """C12 eq. 8-9: g = α A^f R_h², R_h = φ / Σγ.

    Parameters
    ----------
    alpha : float
        Shape factor, 1/2 for a circular duct of radius 2 R_h (C12's choice).
    """

    alpha: float = 0.5
    name = "hydraulic-radius"

    def __post_init__(self) -> None:
        if not (isinstance(self.alpha, (int, float)) and 0.0 < self.alpha < np.inf):
            raise InputError(f"alpha must be a positive number, not {self.alpha!r}")
        if not within_range(self.alpha):
            raise InputError(f"alpha must lie between {LEAST:g} and {MOST:g}, not {self.alpha!r}")

    def conductivity(self, throats: Throats, slip: np.ndarray) -> np.ndarray:
        """(t,): conductivity g of each throat [m⁴]; `slip` (6,) bool marks the walls of symmetry."""
        return _hydraulic_radius(self.alpha, throats.fluid_areas, throats.volumes, throats.wetted_surfaces(slip))


@njit(cache=True, parallel=True)
def _hydraulic_radius(alpha: float, areas: np.ndarray, volumes: np.ndarray, surfaces: np.ndarray) -> np.ndarray:
    """α A^f (φ / Σγ)², zero where φ or Σγ is not positive."""
    conductivity = np.zeros_like(areas)
    for t in prange(areas.shape[0]):
        if volumes[t] > 0.0 and surfaces[t] > 0.0:
            conductivity[t] = alpha * areas[t] * (volumes[t] / surfaces[t]) ** 2
    return conductivity
