"""One-dimensional consolidation by Terzaghi, and coefficients of saturated grains (C14 §2.4, §5)."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from porefv.errors import InputError

# Terms after which a series of Terzaghi's has converged to 1e-16 at T >= 1e-4.
_TERMS = np.arange(400)


def terzaghi_pressure(depth: ArrayLike, time_factor: ArrayLike) -> np.ndarray:
    """Excess pressure over the load, p / Δσ, in one-dimensional consolidation (Terzaghi; C14 eq. 36).

    Parameters
    ----------
    depth : array
        z / H: distance from the drained end over the longest drainage path, 0 to 1 (0 to 2 across a sample that
        is drained at both ends).
    time_factor : array
        T = C_v t / H², 0 or more, broadcast against `depth`. At T = 0 the pressure is 1, but for the drained ends.

    Returns
    -------
    array of the broadcast shape

    Raises
    ------
    InputError
        For a negative time factor.
    """
    z, t = np.broadcast_arrays(np.asarray(depth, float), _time_factor(time_factor))
    m = 0.5 * np.pi * (2 * _TERMS + 1)
    series = (2.0 / m * np.sin(m * z[..., None]) * np.exp(-(m**2) * t[..., None])).sum(axis=-1)
    at_once = np.where((z > 0.0) & (z < 2.0), 1.0, 0.0)
    # Before T = 1e-4 the ends have not felt each other: the solution of the half-space is exact to 1e-16.
    near = np.minimum(z, 2.0 - z)
    early = _erf(near / (2.0 * np.sqrt(np.maximum(t, 1e-300))))
    return np.where(t == 0.0, at_once, np.where(t < 1e-4, early, series))


def terzaghi_settlement(time_factor: ArrayLike) -> np.ndarray:
    """Degree of consolidation U: settlement over the final one (Terzaghi).

    Parameters
    ----------
    time_factor : array
        T = C_v t / H², 0 or more.

    Raises
    ------
    InputError
        For a negative time factor.
    """
    t = _time_factor(time_factor)
    m = 0.5 * np.pi * (2 * _TERMS + 1)
    series = 1.0 - (2.0 / m**2 * np.exp(-(m**2) * t[..., None])).sum(axis=-1)
    return np.where(t < 1e-3, 2.0 * np.sqrt(t / np.pi), series)


def consolidation_coefficient(permeability: float, modulus: float, viscosity: float) -> float:
    """C_v = k E_oed / μ, from permeability [m²], oedometric modulus [Pa] and viscosity [Pa s], in m²/s."""
    return permeability * modulus / viscosity


def critical_gradient(porosity: float, solid_density: float, fluid_density: float) -> float:
    """Hydraulic gradient i_c = (1 - n)(ρ_s - ρ_f) / ρ_f at which upward flow carries the grains (C14 eq. 42)."""
    return (1.0 - porosity) * (solid_density - fluid_density) / fluid_density


def _time_factor(values: ArrayLike) -> np.ndarray:
    t = np.asarray(values, float)
    if not (t >= 0.0).all():
        raise InputError(f"a time factor must be zero or more, not {t.min():g}")
    return t


def _erf(x: np.ndarray) -> np.ndarray:
    from scipy.special import erf

    return erf(x)
