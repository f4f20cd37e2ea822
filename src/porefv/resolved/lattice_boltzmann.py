"""StokesLattice: Stokes flow on a lattice, by a lattice-Boltzmann method with two relaxation times, stepped to rest."""

from __future__ import annotations

import numpy as np

from porefv.resolved.lattice import Lattice
from porefv.resolved.lattice_kernels import fill_cuts, fill_images, moments, move_and_collide
from porefv.resolved.lattice_links import DIRECTIONS, OPEN, OPPOSITE, WEIGHTS
from porefv.system.threads import for_rows

# Λ, the product of the two relaxation times less 1/2 each: with it the flow between walls halfway between nodes is
# exact (d'Humières and Ginzburg 2009). Smaller values make lattices of spheres too tight, larger ones too open.
LAMBDA = 3.0 / 16.0
# Relaxation time of the stress, less 1/2: three times the viscosity. The flow at rest does not depend on it. From the
# pressures of the pores, 25 spheres in 40 spacings come to within 1e-4 of the flow at rest in 1600 (0.15), 560 (0.3),
# 550 (0.5) and 1200 (1) steps: small values let sound ring, large ones even out the pressure slowly.
STRESS_TIME = 0.3
# Nodes of a block of work.
_BLOCK = 8192


class StokesLattice:
    """Stokes flow on a lattice.

    Pressures are 0 to 1, momenta in lattice units: a velocity is `velocity_scale` times a momentum, times the pressure
    difference and the spacing, over the viscosity.

    Parameters
    ----------
    lattice : Lattice
    pressures : (6,) array
        Of open walls, 0 to 1; others are not looked at.
    """

    velocity_scale = STRESS_TIME

    def __init__(self, lattice: Lattice, pressures: np.ndarray):
        self.lattice, self.pressures = lattice, np.nan_to_num(np.asarray(pressures, float))
        images = lattice.images
        self._constants = images.imposed * 2.0 * WEIGHTS[images.directions] * self.pressures[images.walls]
        self.f = np.zeros((19, len(lattice) + lattice.slots))
        self._new = np.zeros_like(self.f)

    def start_from(self, pressure: np.ndarray, momentum: np.ndarray | None = None) -> None:
        """Populations of equilibrium with (n,) pressures and (n, 3) momenta."""
        n = len(self.lattice)
        for q, (c, w) in enumerate(zip(DIRECTIONS, WEIGHTS, strict=True)):
            self.f[q, :n] = w * pressure
            if momentum is not None:
                self.f[q, :n] += 3.0 * w * (momentum @ c)

    def step(self) -> None:
        """Move populations along their links, and let them collide."""
        self.send_back()
        for_rows(
            move_and_collide, len(self.lattice), self.lattice.sources, self.f, self._new,
            1.0 / (STRESS_TIME + 0.5), 1.0 / (LAMBDA / STRESS_TIME + 0.5), least=_BLOCK,
        )  # fmt: skip
        self.f, self._new = self._new, self.f

    def send_back(self) -> None:
        """Fill in what solids and walls send back: what is read off below takes it from there."""
        cuts, images = self.lattice.cuts, self.lattice.images
        fill_images(
            self.f, images.directions, images.slots, images.starts, images.origins, images.origin_directions,
            images.weights, self._constants,
        )  # fmt: skip
        fill_cuts(self.f, cuts.nodes, cuts.directions, cuts.slots, cuts.weights, self.lattice.sources)

    def image_flux(self) -> np.ndarray:
        """(k,): net flux into the sample of each link from an image, after `send_back`."""
        images = self.lattice.images
        return self.f[images.directions, images.slots] - self.f[OPPOSITE[images.directions], images.nodes]

    def wall_flux(self) -> np.ndarray:
        """(6,): flux into the sample through each open wall, after `send_back`."""
        walls = self.lattice.images.walls
        flux = np.bincount(walls, self.image_flux(), 6)
        return np.where(self.lattice.kinds == OPEN, flux, 0.0)

    def moments(self) -> tuple[np.ndarray, np.ndarray]:
        """(n,) pressure and (n, 3) momentum, after `send_back`."""
        pressure, momentum = np.empty(len(self.lattice)), np.empty((len(self.lattice), 3))
        for_rows(moments, len(self.lattice), self.lattice.sources, self.f, pressure, momentum, least=_BLOCK)
        return pressure, momentum
