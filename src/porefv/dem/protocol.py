"""What a coupling with a fluid asks of a discrete element method: ours, or another program's behind an adapter."""

from __future__ import annotations

from typing import Protocol, runtime_checkable

import numpy as np

from porefv.packing import Box


@runtime_checkable
class GrainModel(Protocol):
    """Grains between six walls, moved by explicit steps.

    Grain ids are positions in the arrays, the same through a run; walls are in the order of `porefv.WALLS`. At time
    t, after a whole number of steps, positions are those at t, velocities those half a step before:
    x(t) = x(t - dt) + dt v(t - dt/2). What is read may be a copy or a view: it is read again after each `run`, and
    never written to.
    """

    @property
    def positions(self) -> np.ndarray:
        """(n, 3): centres at time t [m]."""
        ...

    @property
    def velocities(self) -> np.ndarray:
        """(n, 3): velocities of the centres at time t - dt/2 [m/s]."""
        ...

    @property
    def radii(self) -> np.ndarray:
        """(n,): radii [m]."""
        ...

    @property
    def masses(self) -> np.ndarray:
        """(n,): masses [kg]."""
        ...

    @property
    def box(self) -> Box:
        """The box that the walls make at time t."""
        ...

    @property
    def wall_velocities(self) -> np.ndarray:
        """(6, 3): velocities of the walls over the last step, from t - dt to t [m/s]."""
        ...

    @property
    def step(self) -> float:
        """dt [s]."""
        ...

    def apply(self, forces: np.ndarray) -> None:
        """Forces (n, 3) on the grains besides contacts and weight, from the next step on until changed [N]."""
        ...

    def run(self, steps: int) -> None:
        """Take so many steps.

        Raises
        ------
        ComputationError
            If the motion runs away.
        """
        ...
