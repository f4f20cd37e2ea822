"""Validity: numbers that say when flow without inertia stops to describe the fluid (C14 §2.2)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from porefv.flow.fluid import Fluid
from porefv.flow.reynolds import WARNED
from porefv.mesh.pore_mesh import PoreMesh

# Below it the inertia of the fluid matters; above `WARNED` of the Reynolds number, too.
STOKES = 1.0


@dataclass(frozen=True)
class Validity:
    """Reynolds and Stokes numbers of a step.

    Attributes
    ----------
    reynolds_max, reynolds_mean : float
        ρ_f v d / μ, largest and mean over the pores: v the largest of the mean velocities in a pore's throats relative
        to their grains, d the mean diameter [-].
    stokes_number : float
        t μ / (ρ_f l²) (C14 eq. 16): the time t in which the fastest grain moves by the mean radius, over that in which
        momentum diffuses across a throat; l is the mean radius of throats. Infinite where grains are at rest, or the
        fluid has no density [-].
    """

    reynolds_max: float
    reynolds_mean: float
    stokes_number: float

    @property
    def warning(self) -> str | None:
        """What is to be said where inertia matters; None elsewhere."""
        said = []
        if self.reynolds_max > WARNED:
            said.append(f"the Reynolds number is {self.reynolds_max:.3g} (mean {self.reynolds_mean:.3g}), above 1")
        if self.stokes_number < STOKES:
            said.append(f"the Stokes number is {self.stokes_number:.3g}, below 1")
        if not said:
            return None
        return f"{' and '.join(said)}: the inertia of the fluid matters, which this flow leaves out"


def validity(mesh: PoreMesh, fluxes: np.ndarray, velocities: np.ndarray, fluid: Fluid, slip: np.ndarray) -> Validity:
    """The numbers of a flow.

    Parameters
    ----------
    mesh : PoreMesh
    fluxes : (t,) array
        Through the throats, relative to their grains [m³/s].
    velocities : (n, 3) array
        Of the grains [m/s].
    fluid : Fluid
    slip : (6,) bool array
        Walls of symmetry.
    """
    throats, radius = mesh.throats, float(mesh.packing.radii.mean())
    areas = throats.fluid_areas
    speeds = np.divide(np.abs(fluxes), areas, out=np.zeros(len(areas)), where=areas > 0.0)
    fastest = np.zeros(mesh.n_pores)
    np.maximum.at(fastest, throats.pores.ravel(), np.repeat(speeds, 2))
    reynolds = fluid.density * fastest * 2.0 * radius / fluid.viscosity
    speed = float(np.sqrt((velocities**2).sum(axis=1).max()))
    circles = throats.inscribed_circles(slip)[0]
    width = float(circles[circles > 0.0].mean()) if (circles > 0.0).any() else 0.0
    hindered = fluid.density * width**2 * speed
    stokes = radius * fluid.viscosity / hindered if hindered > 0.0 else np.inf
    return Validity(float(reynolds.max()), float(reynolds.mean()), float(stokes))
