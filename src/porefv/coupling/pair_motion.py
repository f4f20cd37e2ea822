"""PairMotion: the resistance of pairs within the steps of a coupling, by grains and walls whose forces are known."""

from __future__ import annotations

from typing import cast

import numpy as np

from porefv.coupling.coupling_state import CouplingState
from porefv.coupling.pair_resistance import PairResistance, Pairs
from porefv.dem.grain_model import GrainModel, LongStepGrainModel, SpinningGrainModel
from porefv.packing.box import WALL_AXES

# The rows of the walls in arrays of grains and walls.
_WALL_ROWS = np.arange(-6, 0)


class PairMotion:
    """Velocities after a step in which pairs resist, and the forces and torques with which they do.

    Parameters
    ----------
    resistance : PairResistance

    Attributes
    ----------
    forces : (n + 6, 6) array
        Forces and torques of the pairs on grains and walls, by row, over the last step [N, N m].
    yielded : (n + 6, 6) array
        The same of contacts that have yielded in it; zero in a step that is not a long one.
    """

    def __init__(self, resistance: PairResistance):
        self.resistance = resistance
        self._free, self._mobilities, self.forces, self.yielded = np.zeros((4, resistance.n_rows, 6))
        self._contacts: Pairs | None = None

    def look(self, grains: GrainModel, state: CouplingState) -> None:
        """Work out the coefficients for grains and walls where they are, and note these places."""
        state.pair_centres, state.pair_places = np.array(grains.positions), np.array(grains.box.wall_places)
        self.resistance.set_positions(state.pair_centres, grains.radii, state.pair_places)

    def restore(self, state: CouplingState) -> None:
        """Go on from a state: its coefficients, and the forces of its last step."""
        self.resistance.set_positions(state.pair_centres, state.mesh_radii, state.pair_places)
        self.forces = -self.resistance.multiply(state.pair_velocities)

    def begin(
        self,
        grains: GrainModel,
        moves: np.ndarray,
        mobilities: np.ndarray,
        wall_mobilities: np.ndarray,
        stride: int,
    ) -> None:
        """Take in what grains and walls would do in a step without the fluid: see `GrainModel.predict`."""
        spins, turning = cast(SpinningGrainModel, grains).predict_spins()
        self._free[:, :3], self._free[:-6, 3:] = moves, spins
        self._mobilities[:-6, :3], self._mobilities[:-6, 3:] = mobilities[:, None], turning[:, None]
        self._mobilities[_WALL_ROWS, WALL_AXES] = wall_mobilities
        self._contacts = None
        if stride > 1:
            self._contacts = Pairs(*cast(LongStepGrainModel, grains).yielding_contacts)

    def resist(self, forces: np.ndarray, tolerance: float, state: CouplingState) -> int:
        """Find the forces of pairs where the fluid presses with forces (n + 6, 3); returns the number of iterations."""
        without = self._free.copy()
        without[:, :3] += self._mobilities[:, :3] * forces
        guess = state.pair_velocities - without
        state.pair_velocities, self.forces, self.yielded, iterations = self.resistance.solve(
            without, self._mobilities, guess, tolerance, self._contacts
        )
        return iterations

    def mismatch(self, forces: np.ndarray, state: CouplingState) -> float:
        """Error of the power of pairs, over that of the fluid on grains and walls.

        Pairs resist velocities that are not quite those of the step, where the fluid presses with forces (n + 6, 3).
        """
        own = self.forces[:, :3]
        velocities = self._free[:, :3] + self._mobilities[:, :3] * (forces + own + self.yielded[:, :3])
        whole = abs(float(np.vdot(forces + own, velocities)))
        wrong = abs(float(np.vdot(own, velocities - state.pair_velocities[:, :3])))
        return wrong / whole if whole > 0.0 else 0.0

    @property
    def changes(self) -> np.ndarray:
        """(n + 6, 6): what pairs, and contacts that yield, add to velocities and spins of the step [m/s, rad/s]."""
        return self._mobilities * (self.forces + self.yielded)

    def power(self, velocities: np.ndarray, spins: np.ndarray, state: CouplingState) -> tuple[float, float, float]:
        """Work of the pairs on grains and on walls, and what they dissipate, a second [W].

        Parameters
        ----------
        velocities : (n + 6, 3) array
            Of grains, by row, and walls over the last step [m/s].
        spins : (n, 3) array
            Of grains, by row [rad/s].
        state : CouplingState
            After the step.
        """
        work = (self.forces[:, :3] * velocities).sum(axis=1)
        turning = float((self.forces[:-6, 3:] * spins).sum())
        dissipated = -float((self.forces * state.pair_velocities).sum())
        return float(work[:-6].sum()) + turning, float(work[-6:].sum()), dissipated
