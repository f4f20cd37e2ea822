"""What a coupling with a fluid asks of a discrete element method: ours, or another program's behind an adapter."""

from __future__ import annotations

from typing import Protocol, runtime_checkable

import numpy as np

from porefv.dem.yielding_contacts import YieldingContacts
from porefv.packing.box import Box


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

    @property
    def rows(self) -> np.ndarray:
        """(n,): row of each grain in the arrays of `predict` and `correct`; 0 ... n - 1 where they are in order."""
        ...

    def predict(self) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """Take the first half of a step: contact forces, but no motion.

        Returns
        -------
        velocities (n, 3) array
            That grains would have after the step [m/s].
        wall_speeds (6,) array
            That walls would have, along their outward normals [m/s].
        mobilities (n,), wall_mobilities (6,) arrays
            What a force applied over the step adds to them: dt / m for grains, nothing for walls that move on their
            own [m/(s N)].
        """
        ...

    def correct(self, forces: np.ndarray, thrusts: np.ndarray) -> None:
        """Take the second half: motion, under forces on grains (n, 3) and walls (6,), outward, besides the others [N].

        Raises
        ------
        ComputationError
            If the motion runs away.
        """
        ...


@runtime_checkable
class SpinningGrainModel(GrainModel, Protocol):
    """A grain model whose grains turn: what pair resistance asks for besides."""

    @property
    def spins(self) -> np.ndarray:
        """(n, 3): angular velocities at time t - dt/2 [rad/s]."""
        ...

    def predict_spins(self) -> tuple[np.ndarray, np.ndarray]:
        """After `predict`: spins (n, 3) that grains would have after the step, and what a torque over it adds (n,).

        The second is dt / I [rad/(s N m)].
        """
        ...

    def correct(self, forces: np.ndarray, thrusts: np.ndarray, torques: np.ndarray | None = None) -> None:
        """As of `GrainModel`, with torques on the grains (n, 3), in the same rows [N m]."""
        ...


@runtime_checkable
class LongStepGrainModel(SpinningGrainModel, Protocol):
    """A grain model that takes steps longer than its own, in which contacts yield: what long coupled steps ask for."""

    @property
    def presses(self) -> bool:
        """Whether a wall presses with a given stress: it moves by its own law, in steps that are not long."""
        ...

    @property
    def yielding_contacts(self) -> YieldingContacts:
        """After `predict`: contacts that yield within a long step (`porefv.dem.yielding_contacts`)."""
        ...

    def predict(self, stride: int = 1) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """As of `GrainModel`, for a step as long as `stride` steps."""
        ...

    def correct(
        self,
        forces: np.ndarray,
        thrusts: np.ndarray,
        torques: np.ndarray | None = None,
        yielded: np.ndarray | None = None,
    ) -> None:
        """As of `SpinningGrainModel`, with what contacts that yield add: (n + 6, 6), grains in rows, walls [N, N m]."""
        ...
