"""Breakthrough, age of the fluid, residence time, and longitudinal dispersion.

The age a of the fluid in each pore solves the steady equation of a solute with its volume as source, without reactions:
Σ q (a - a_up) - Σ D g (a_j - a) = V. The second moment m of the age has 2 V a as source, and the variance of the age of
the fluid that leaves is m - a² there (Danckwerts 1953). These moments have no steps of time.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from porefv.errors import InputError
from porefv.flow.pore_flow import PoreFlow
from porefv.transport.solute import Solute


@dataclass(frozen=True, eq=False)
class Residence:
    """How long the fluid stays.

    Attributes
    ----------
    age : (n_pores,) array
        Mean age of the fluid in each pore since it entered; NaN in pores that it does not reach [s].
    mean : float
        Mean age of the fluid that leaves: `volume` / flow [s].
    variance : float
        Of the age of the fluid that leaves [s²].
    volume : float
        Of the pores that the fluid reaches, by flow or diffusion [m³].
    not_reached : (n_pores,) bool array
        Isolated pores, and dead branches if nothing diffuses.
    """

    age: np.ndarray
    mean: float
    variance: float
    volume: float
    not_reached: np.ndarray

    @property
    def relative_variance(self) -> float:
        """σ² / τ² of the age of the fluid that leaves [-]."""
        return self.variance / self.mean**2

    @property
    def peclet(self) -> float:
        """U L / D_L of the vessel of plug flow with dispersion, closed at both ends, of this relative variance.

        σ² / τ² = 2 / Pe - 2 (1 - e^-Pe) / Pe² (van der Laan 1958).

        Raises
        ------
        InputError
            If the relative variance is 1 or more: no such vessel has it.

        References
        ----------
        E. T. van der Laan: Notes on the diffusion-type model for the longitudinal mixing in flow. Chem. Eng. Sci. 7,
        187-191 (1958).
        """
        return vessel_peclet(self.relative_variance)


def vessel_peclet(relative_variance: float) -> float:
    """Pe of a closed vessel with σ² / τ², in (0, 1) (`Residence.peclet`)."""
    from scipy.optimize import brentq

    if not 0.0 < relative_variance < 1.0:
        raise InputError(f"a closed vessel has σ²/τ² between 0 and 1, not {relative_variance!r}")

    def excess(logarithm: float) -> float:
        peclet = np.exp(logarithm)
        return 2.0 / peclet + 2.0 * np.expm1(-peclet) / peclet**2 - relative_variance

    return float(np.exp(brentq(excess, np.log(1e-3), np.log(4.0 / relative_variance), xtol=1e-14)))


def residence_time(flow: PoreFlow, diffusivity: ArrayLike = 0.0) -> Residence:
    """Age and residence time of the fluid, by steady equations.

    Parameters
    ----------
    flow : PoreFlow
    diffusivity : float or (t,) array
        D of what marks the fluid [m²/s].

    Raises
    ------
    InputError, ComputationError
        As of `Solute`.

    Examples
    --------
    >>> from porefv import Fluid, Packing, PoreFlow, Walls
    >>> flow = PoreFlow(Packing.read("data/packings/n25_s1.csv"), Walls.along("y"), Fluid(viscosity=10.0))
    >>> found = residence_time(flow)
    >>> bool(abs(found.mean * flow.inflow / found.volume - 1.0) < 1e-10)
    True
    """
    solute = Solute(flow, diffusivity)
    reached = solute.reached
    held = np.where(reached, np.nan, 0.0)
    age = solute.steady_with(solute.volumes, held)
    second = solute.steady_with(2.0 * solute.volumes * age, held)
    leaving = solute.leaving / solute.leaving.sum()
    mean = float(leaving @ age)
    # About the mean, so that no two large numbers are subtracted where the variance is small.
    variance = float(leaving @ (second - 2.0 * mean * age)) + mean**2
    return Residence(
        np.where(reached, age, np.nan), mean, variance, float(solute.volumes[reached].sum()), ~reached
    )  # fmt: skip


def breakthrough(flow: PoreFlow, dt: float, steps: int, diffusivity: ArrayLike = 0.0) -> tuple[np.ndarray, np.ndarray]:
    """Concentration of the fluid that leaves, from when fluid of concentration 1 begins to enter.

    Implicit steps add some dt / τ to the relative variance; `residence_time` has none of that.

    Parameters
    ----------
    flow : PoreFlow
    dt, steps
        As of `Solute.advance`.
    diffusivity : float or (t,) array
        [m²/s].

    Returns
    -------
    times, concentrations : (steps,) arrays
        [s], [-].
    """
    leaving = Solute(flow, diffusivity).advance(dt, steps)
    return dt * np.arange(1, steps + 1), leaving
