"""Conductance by effective radius, the second model of C12."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from porefv.conductance.model import ConductanceModel
from porefv.mesh.throats import Throats


@dataclass(frozen=True)
class EffectiveRadius(ConductanceModel):
    """C12 eq. 10 (Bryant and Blunt 1992): g = 2π r_eff⁴, r_eff = (r_eq + r_inscr) / 4.

    r_eq is the radius of the disc of area A^f, r_inscr that of the circle in the facet's plane tangent to its
    spheres and walls. A wall of symmetry doubles the throat by its mirror image: the circle then stands on the wall,
    and the throat is half (a quarter, for two such walls) of the whole.

    Theory, method: :eq:`eq-effective-radius`.
    """

    name = "effective-radius"

    def conductivity(self, throats: Throats, slip: np.ndarray) -> np.ndarray:
        """(t,): conductivity g of each throat [m⁴]; `slip` (6,) bool marks the walls of symmetry."""
        images = throats.mirror_images(slip)
        equivalent = np.sqrt(images * np.maximum(throats.fluid_areas, 0.0) / np.pi)
        radii = 0.25 * (equivalent + throats.inscribed_radii(slip))
        return np.where(radii > 0.0, 2.0 * np.pi * radii**4 / images, 0.0)
