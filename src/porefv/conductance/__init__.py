"""Conductance models: what flows through a throat per unit of pressure gradient.

A model is an object with a `name` and one method, so that a new one takes ten lines::

    class Slits:
        name = "slits"

        def conductivity(self, throats, slip):
            return throats.fluid_areas * (throats.volumes / throats.wetted_surfaces(slip)) ** 2 / 3
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np

from porefv.boundary import LEAST, MOST, within_range
from porefv.conductance.sections import SectionFriction
from porefv.errors import InputError
from porefv.kernels import njit, prange
from porefv.throats import Throats


class ConductanceModel(Protocol):
    """What the flow asks of a conductance model."""

    name: str

    def conductivity(self, throats: Throats, slip: np.ndarray) -> np.ndarray:
        """(t,): μ g of each throat [m⁴], such that q = g (p_i - p_j) / L.

        `slip`, (6,) bool, marks the walls of symmetry. Values that are not positive mean a closed throat.
        """
        ...


@dataclass(frozen=True)
class HydraulicRadius:
    """C12 eq. 8-9: μ g = α A^f R_h², R_h = φ / Σγ.

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
        return _hydraulic_radius(self.alpha, throats.fluid_areas, throats.volumes, throats.wetted_surfaces(slip))


@dataclass(frozen=True)
class EffectiveRadius:
    """C12 eq. 10 (Bryant and Blunt 1992): μ g = 2π r_eff⁴, r_eff = (r_eq + r_inscr) / 4.

    r_eq is the radius of the disc of area A^f, r_inscr that of the circle in the facet's plane tangent to its
    spheres and walls. A wall of symmetry doubles the throat by its mirror image: the circle then stands on the wall,
    and the throat is half (a quarter, for two such walls) of the whole.
    """

    name = "effective-radius"

    def conductivity(self, throats: Throats, slip: np.ndarray) -> np.ndarray:
        images = throats.mirror_images(slip)
        equivalent = np.sqrt(images * np.maximum(throats.fluid_areas, 0.0) / np.pi)
        radii = 0.25 * (equivalent + throats.inscribed_radii(slip))
        return np.where(radii > 0.0, 2.0 * np.pi * radii**4 / images, 0.0)


@njit(cache=True, parallel=True)
def _hydraulic_radius(alpha, areas, volumes, surfaces):
    """α A^f (φ / Σγ)², zero where φ or Σγ is not positive."""
    conductivity = np.zeros_like(areas)
    for t in prange(areas.shape[0]):
        if volumes[t] > 0.0 and surfaces[t] > 0.0:
            conductivity[t] = alpha * areas[t] * (volumes[t] / surfaces[t]) ** 2
    return conductivity


MODELS = {model.name: model for model in (HydraulicRadius, EffectiveRadius, SectionFriction)}
# Closest to resolved flow in every case there is (docs/accuracy.md).
AUTO = SectionFriction


def conductance_model(name: str, **parameters: float) -> ConductanceModel:
    """The model of that name: `hydraulic-radius`, `effective-radius` or `section-friction`, which is `auto`.

    Raises
    ------
    InputError
        For an unknown name or parameter.
    """
    if name != "auto" and name not in MODELS:
        raise InputError(f"unknown conductance {name!r}; known: auto, {', '.join(MODELS)}")
    model = AUTO if name == "auto" else MODELS[name]
    unknown = [parameter for parameter in parameters if parameter not in model.__dataclass_fields__]
    if unknown:
        with_it = [other for other in MODELS if set(unknown) <= set(MODELS[other].__dataclass_fields__)]
        hint = f"; {' and '.join(with_it)} does" if with_it else ""
        raise InputError(f"conductance {name!r} takes no parameter {', '.join(unknown)}{hint}")
    return model(**parameters)
