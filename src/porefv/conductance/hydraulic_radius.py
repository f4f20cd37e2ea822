"""Conductance by hydraulic radius, the model of C12."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from porefv.conductance.model import ConductanceModel
from porefv.errors import InputError
from porefv.mesh.throats import Throats
from porefv.system.kernels import kernel
from porefv.system.number_checks import LEAST, MOST, within_range
from porefv.system.threads import for_rows


@dataclass(frozen=True)
class HydraulicRadius(ConductanceModel):
    """C12 eq. 8-9: g = α A^f R_h², R_h = φ / Σγ.

    Parameters
    ----------
    alpha : float
        Shape factor, 1/2 for a circular duct of radius 2 R_h (C12's choice).

    Notes
    -----
    Theory, method: :eq:`eq-hydraulic-radius`.
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
        found = np.empty(len(throats))
        surfaces = throats.wetted_surfaces(slip)
        for_rows(
            _hydraulic_radius, len(found), float(self.alpha), throats.fluid_areas, throats.volumes, surfaces, found,
            least=1 << 16,
        )  # fmt: skip
        return found


@kernel
def _hydraulic_radius(first, last, alpha, areas, volumes, surfaces, conductivity):
    """Fill in α A^f (φ / Σγ)² of throats first ... last - 1, zero where φ or Σγ is not positive."""
    for t in range(first, last):
        conductivity[t] = 0.0
        if volumes[t] > 0.0 and surfaces[t] > 0.0:
            conductivity[t] = alpha * areas[t] * (volumes[t] / surfaces[t]) ** 2
