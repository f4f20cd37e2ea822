"""Sizes of pores and of constrictions, and their distributions."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from porefv.errors import InputError
from porefv.mesh.pore_mesh import PoreMesh


@dataclass(frozen=True, eq=False)
class Distribution:
    """A weighted distribution of sizes.

    Attributes
    ----------
    values : (k,) array
        Increasing.
    fractions : (k,) array
        Part of the weight that has this value or a smaller one; the last is 1.
    mean : float
        Σ w v / Σ w; NaN without any weight.
    """

    values: np.ndarray
    fractions: np.ndarray
    mean: float

    @classmethod
    def of(cls, values: ArrayLike, weights: ArrayLike | None = None) -> Distribution:
        """The distribution of values (k,) with weights (k,), equal ones by default. What has no weight is left out.

        Raises
        ------
        InputError
            For values and weights that are not equally many, or weights below zero.
        """
        values = np.asarray(values, float)
        weights = np.ones(values.shape) if weights is None else np.asarray(weights, float)
        if values.ndim != 1 or weights.shape != values.shape or not (weights >= 0.0).all():
            raise InputError("values and weights must be equally many, and weights zero or more")
        order = np.argsort(values, kind="stable")
        order = order[weights[order] > 0.0]
        if len(order) == 0:
            return cls(np.empty(0), np.empty(0), np.nan)
        parts = weights[order] / weights.max()  # so that no sum overflows, or underflows
        sums = np.cumsum(parts)
        return cls(values[order], sums / sums[-1], float(np.dot(parts, values[order]) / sums[-1]))

    def quantile(self, fraction: float) -> float:
        """The smallest value that is not exceeded by this fraction of the weight; NaN without any weight.

        >>> Distribution.of([1.0, 2.0, 3.0, 4.0]).quantile(0.5)
        2.0
        """
        if not 0.0 <= fraction <= 1.0:
            raise InputError(f"a fraction must lie between 0 and 1, not {fraction!r}")
        if len(self.values) == 0:
            return np.nan
        return float(self.values[np.searchsorted(self.fractions, fraction)])


@dataclass(frozen=True, eq=False)
class PoreSizes:
    """Size of each pore.

    Attributes
    ----------
    void_volumes : (n_pores,) array
        Volume outside the spheres [m³].
    centres, radii : (n_pores, 3) and (n_pores,) arrays
        The largest inscribed sphere (`porefv.mesh.inscribed_spheres`); a radius of 0 where there is none [m].
    """

    void_volumes: np.ndarray
    centres: np.ndarray
    radii: np.ndarray

    @property
    def by_number(self) -> Distribution:
        """Distribution of the radii of the inscribed spheres; each pore that has one counts once."""
        return Distribution.of(self.radii, self.radii > 0.0)

    @property
    def by_volume(self) -> Distribution:
        """Distribution of the same radii, weighted with the void volumes."""
        return Distribution.of(self.radii, np.where(self.radii > 0.0, np.maximum(self.void_volumes, 0.0), 0.0))


def pore_sizes(mesh: PoreMesh) -> PoreSizes:
    """Void volume and largest inscribed sphere of each pore."""
    spheres = mesh.inscribed_spheres
    return PoreSizes(mesh.pore_volumes, spheres.centres, spheres.radii)


@dataclass(frozen=True, eq=False)
class ConstrictionSizes:
    """Size of the constriction of each throat, and how much flows through it.

    Attributes
    ----------
    radii : (t,) array
        Radius of the largest inscribed circle; 0 where there is none [m].
    flux : (t,) array
        Size of the flux through each throat [m³/s].
    """

    radii: np.ndarray
    flux: np.ndarray

    @property
    def by_number(self) -> Distribution:
        """Distribution of the radii; each throat that has a circle counts once."""
        return Distribution.of(self.radii, self.radii > 0.0)

    @property
    def by_flux(self) -> Distribution:
        """Distribution of the radii of the same throats, weighted with the sizes of their fluxes."""
        return Distribution.of(self.radii, np.where(self.radii > 0.0, self.flux, 0.0))


def constriction_sizes(mesh: PoreMesh, flux: np.ndarray, slip: np.ndarray) -> ConstrictionSizes:
    """Radius of the inscribed circle of each throat, with the fluxes as weights.

    Parameters
    ----------
    mesh : PoreMesh
    flux : (t,) array
        Flux of each throat [m³/s].
    slip : (6,) bool array
        Walls with slip: a circle on one has its centre on the wall. Closed throats have a radius of 0.
    """
    radii = np.where(mesh.throats.closed, 0.0, mesh.throats.inscribed_radii(slip))
    return ConstrictionSizes(radii, np.abs(flux))
