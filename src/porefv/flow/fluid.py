"""Fluid: the viscosity and the density of what fills the pores."""

from __future__ import annotations

from dataclasses import dataclass

from porefv.errors import InputError
from porefv.system.number_checks import LEAST, MOST, is_finite_number, within_range


class AssumedDensity(float):
    """A density that stands in for one that was not given [kg/m³]."""


@dataclass(frozen=True)
class Fluid:
    """A viscous, incompressible fluid.

    Parameters
    ----------
    viscosity : float
        Dynamic viscosity μ [Pa s].
    density : float
        Density ρ [kg/m³]. Without one, that of water counts for the hydraulic conductivity and for buoyancy, and no
        Reynolds number is told.
    """

    viscosity: float = 1.0e-3
    density: float = AssumedDensity(1000.0)

    def __post_init__(self) -> None:
        if not (is_finite_number(self.viscosity) and self.viscosity > 0.0):
            raise InputError(f"viscosity must be a positive number of Pa s, not {self.viscosity!r}")
        if not within_range(self.viscosity):
            raise InputError(f"viscosity must lie between {LEAST:g} and {MOST:g} Pa s, not {self.viscosity!r}")
        if not (is_finite_number(self.density) and self.density >= 0.0):
            raise InputError(f"density must be a number of kg/m³, zero or more, not {self.density!r}")
        if self.density > MOST:
            raise InputError(f"density must be at most {MOST:g} kg/m³, not {self.density!r}")

    @property
    def density_given(self) -> bool:
        """Whether the density was given, and is not that of water for want of another."""
        return not isinstance(self.density, AssumedDensity)
