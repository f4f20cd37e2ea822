"""The line that tells how far a simulation is."""

from __future__ import annotations

import math
import time
from dataclasses import dataclass

from porefv.system.progress import Progress


@dataclass(frozen=True)
class RunState:
    """State of a run.

    Attributes
    ----------
    time, total : float
        Now, and when the stage ends (None: at rest) [s].
    kinetic : float
        Energy, relative to what is stored.
    imbalance : float
        Of the fluid's power, without a fluid of momentum; relative. NaN: not known.
    unbalanced : float
        As `DEM.unbalanced`.
    """

    time: float
    total: float | None
    kinetic: float
    imbalance: float
    unbalanced: float


class SimulationProgress(Progress):
    """Progress that shows simulated time, what remains by the clock, energy and imbalance."""

    state: RunState | None = None
    _start: tuple[float, float] | None = None

    @property
    def draws(self) -> bool:
        """Whether anything is drawn."""
        return self._draws

    def begin(self) -> None:
        """A stage begins: time that remains is told from what it takes."""
        self.state = self._start = None

    def show(self, state: RunState) -> None:
        """Take a state to be drawn."""
        if self._start is None:
            self._start = (time.perf_counter(), state.time)
        self.state = state

    def line(self, name: str, seconds: float) -> str:
        now = self.state
        if now is None or self._start is None:
            return super().line(name, seconds)
        # Not above 80 columns: what is beyond is cut off.
        if now.total is None:
            course = f"{now.time:.4g} s, unbalanced {now.unbalanced:.0e}"
        else:
            course = f"{now.time:.4g} of {now.total:.4g} s"
            done = now.time - self._start[1]
            if done > 0.0:
                course += f", {duration((now.total - now.time) / done * (time.perf_counter() - self._start[0]))} left"
        imbalance = "" if math.isnan(now.imbalance) else f"  imbalance {now.imbalance:.0e}"
        return f"porefv: {name}  {course}  kinetic {now.kinetic:.0e}{imbalance}"


def duration(seconds: float) -> str:
    """A time by the clock: ``42 s``, ``3 min``, ``2.5 h``."""
    if seconds < 100.0:
        return f"{seconds:.0f} s"
    return f"{seconds / 60.0:.0f} min" if seconds < 6000.0 else f"{seconds / 3600.0:.1f} h"
