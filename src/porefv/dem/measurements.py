"""What is measured of a sample of grains: its contacts and its energies."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True, eq=False)
class Contacts:
    """Contacts at this moment: forces on grains from others and from walls.

    Attributes
    ----------
    grains : (c, 2) int array
        Grains i, j of each contact; j = n + w for wall w.
    normals : (c, 3) array
        Unit vector from i to j.
    points : (c, 3) array
        Middle of the overlap; on the wall, for walls [m].
    forces : (c, 3) array
        Force on i [N].
    overlaps : (c,) array
        u_n [m].
    """

    grains: np.ndarray
    normals: np.ndarray
    points: np.ndarray
    forces: np.ndarray
    overlaps: np.ndarray

    def __len__(self) -> int:
        return len(self.grains)


@dataclass(frozen=True)
class Energies:
    """Energies [J]: what there is, and what has come and gone since the start.

    Kinetic energy is ½ m v(t - dt/2)·v(t + dt/2) and the like for spins: with it the total is conserved exactly by the
    leapfrog on linear contacts that neither open nor close, without damping.
    """

    kinetic: float
    elastic: float
    potential: float
    sliding: float
    damping: float
    walls: float
    applied: float

    @property
    def stored(self) -> float:
        """Kinetic, elastic and potential energy."""
        return self.kinetic + self.elastic + self.potential

    @property
    def balance(self) -> float:
        """Stored and dissipated energy less work done on the grains: constant, but for the error of the steps."""
        return self.stored + self.sliding + self.damping - self.walls - self.applied
