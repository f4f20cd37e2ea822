"""StridedRun: a run in strides while a packing is made, with reports, and an end if the grains do not come to rest."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from porefv.dem.dem import DEM
from porefv.errors import ComputationError, InputError
from porefv.system import locks
from porefv.system.number_checks import is_finite_number

# Steps of a stride.
STRIDE = 50
# A packing that is not at rest after so many steps will not be.
MOST_STEPS = 2_000_000


@dataclass(frozen=True)
class PackingState:
    """How far the making of a packing has come.

    Attributes
    ----------
    stage : str
        What is being done.
    steps : int
        Steps taken.
    stress : float
        Mean stress [Pa].
    porosity : float
    unbalanced : float
        As `DEM.unbalanced`; infinite without contacts.
    """

    stage: str
    steps: int
    stress: float
    porosity: float
    unbalanced: float


Report = Callable[[PackingState], None]


class StridedRun:
    """Counts the strides of a run, reports the state of the grains, and ends a run that takes too many steps."""

    def __init__(self, dem: DEM, report: Report | None, most: int = MOST_STEPS):
        self.dem, self.report, self.most = dem, report, most
        self.strides = 0

    def stride(self, stage: str, steps: int = STRIDE) -> float:
        """Take some steps; the mean stress after them [Pa]."""
        dem = self.dem
        dem.run(steps)
        locks.touch()
        self.strides += 1
        stress = mean_stress(dem)
        if self.report is not None and self.strides % 20 == 0:
            self.report(PackingState(stage, dem.steps, stress, dem.porosity, dem.unbalanced))
        if dem.steps > self.most:
            raise ComputationError(
                f"the packing is not at rest after {dem.steps} steps: mean stress {stress:.4g} Pa, porosity "
                f"{dem.porosity:.4f}, unbalanced force {dem.unbalanced:.3g}. More grains, or a higher stress, settle "
                "sooner"
            )
        return stress


def mean_stress(dem: DEM) -> float:
    """A third of the trace of the stress of the grains, positive in compression [Pa]."""
    return float(np.trace(dem.stress)) / 3.0


def check_unbalanced(unbalanced: object) -> None:
    """InputError unless the bound on the unbalanced force is a number in [1e-8, 1)."""
    if not (is_finite_number(unbalanced) and 1.0e-8 <= unbalanced < 1.0):  # type: ignore[operator]
        raise InputError(f"unbalanced must lie between 1e-8 and 1, not {unbalanced!r}")
