"""Which laboratory test a stage of a simulation is, and what theory and practice draw of it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from porefv.coupling.consolidation import consolidation_coefficient, terzaghi_pressure, terzaghi_settlement
from porefv.coupling.walls_in_time import WallHistories
from porefv.dem.plate import Plate
from porefv.packing.box import WALL_AXES, WALLS
from porefv.scenes.simulation_scene import AXES, SimulationScene
from porefv.simulation.run_record import RunRecord

# The largest part of the load that pores may still bear where a settlement counts as final.
_CONSOLIDATED = 0.05


@dataclass(frozen=True)
class Oedometer:
    """A stage of one-dimensional consolidation, and Terzaghi's solution for it, with nothing fitted.

    The permeability is the one that was measured last up to the begin of the stage, along the axis of the load. The
    modulus is the load over the strain that the stage ends with.

    Attributes
    ----------
    stage : int
        Its number, from 1 on.
    axis : int
        Of the load.
    begin : float
        Of the stage [s].
    load : float
        Change of the total stress Δσ [Pa].
    base : float
        Pressure of the drained walls [Pa].
    first, last : float
        Strain along the axis at the begin and at the end.
    coefficient : float
        Of consolidation, C_v [m²/s].
    drained : (bool, bool)
        Whether the lower and the upper wall are drained; one is at least.
    drainage : float
        The longest path to a drained wall, H [m].
    """

    stage: int
    axis: int
    begin: float
    load: float
    base: float
    first: float
    last: float
    coefficient: float
    drained: tuple[bool, bool]
    drainage: float

    def time_factor(self, time: np.ndarray) -> np.ndarray:
        """T = C_v t / H² at times of the simulation [s]."""
        return np.maximum(np.asarray(time, float) - self.begin, 0.0) * self.coefficient / self.drainage**2

    def mean_pressure(self, time: np.ndarray) -> np.ndarray:
        """Mean pressure [Pa] by Terzaghi."""
        return self.base + self.load * (1.0 - terzaghi_settlement(self.time_factor(time)))

    def strain(self, time: np.ndarray) -> np.ndarray:
        """Strain along the axis by Terzaghi."""
        return self.first + (self.last - self.first) * terzaghi_settlement(self.time_factor(time))

    def pressure(self, depth: np.ndarray, time: float) -> np.ndarray:
        """Pressure [Pa] by Terzaghi at places across the sample, 0 at its lower and 1 at its upper wall."""
        lower, upper = self.drained
        # Depths count from a drained wall, in drainage paths: two of them where both are drained.
        depths = 2.0 * depth if lower and upper else depth if lower else 1.0 - depth
        return self.base + self.load * terzaghi_pressure(depths, self.time_factor(np.asarray(time)))


@dataclass(frozen=True)
class Triaxial:
    """A triaxial test: two pairs of walls press, while the third moves, or presses with another stress.

    Attributes
    ----------
    stage : int
        Number of the first stage that shears, from 1 on. The test goes on to the end.
    axis : int
        Of the axial stress.
    """

    stage: int
    axis: int

    def curves(self, series: np.ndarray) -> dict[str, np.ndarray]:
        """What is drawn of the rows of the test.

        Parameters
        ----------
        series : structured array
            Of the whole run.

        Returns
        -------
        dict
            `stage` of each row; `axial` and `volume`: strains since the test began, positive in compression;
            `deviator`: q = σ_a - (σ_b + σ_c) / 2 of contacts; `effective` and `total`: mean stress of contacts, and of
            contacts and fluid [Pa]. Stresses are means of opposite walls; `total` is NaN in dry stages.
        """
        rows = series[series["stage"] >= self.stage]
        before = series[series["stage"] < self.stage]
        start = before[-1] if len(before) else rows[0]
        sides = {axis: (1.0 - rows[f"strain_{axis}"]) / (1.0 - start[f"strain_{axis}"]) for axis in AXES}
        contacts, totals = _mean_stresses(rows, "contact_stress"), _mean_stresses(rows, "total_stress")
        others = [contacts[k] for k in range(3) if k != self.axis]
        return {
            "stage": rows["stage"],
            "axial": 1.0 - sides[AXES[self.axis]],
            "volume": 1.0 - sides["x"] * sides["y"] * sides["z"],
            "deviator": contacts[self.axis] - 0.5 * (others[0] + others[1]),
            "effective": contacts.mean(axis=0),
            "total": totals.mean(axis=0),
        }


class LaboratoryTests:
    """What the stages of a run are.

    Parameters
    ----------
    scene : SimulationScene
    record : RunRecord
        Of its run.

    Attributes
    ----------
    dry : list of bool
        Whether each stage that has begun has no fluid.
    """

    def __init__(self, scene: SimulationScene, record: RunRecord):
        self._scene, self._record = scene, record
        self.dry = [not stage.fluid for stage in scene.stages[: len(record.spans)]]
        self._plates = []
        plates = dict.fromkeys(WALLS, Plate())
        for stage in scene.stages[: len(record.spans)]:
            plates = plates | dict(stage.plates)
            self._plates.append(plates)

    def wall_pressures(self, time: float) -> dict[str, float]:
        """Pressure [Pa] of each wall that holds one at a time [s]."""
        found = zip(WALLS, self._walls(time).at(time).pressures.tolist(), strict=True)
        return {wall: pressure for wall, pressure in found if not np.isnan(pressure)}

    def _walls(self, time: float) -> WallHistories:
        """The walls as they are in the stage of a time [s]."""
        return self._scene.walls_in_time(span.begin for span in self._record.spans if span.begin <= time)

    def oedometers(self, series: np.ndarray) -> list[Oedometer]:
        """The wet stages that consolidate along one axis, for which Terzaghi's solution is known.

        Left out are stages without a measured permeability, stages that have not ended consolidated, and stages whose
        walls hold different or changing pressures.

        Parameters
        ----------
        series : structured array
            Of the whole run.
        """
        found = (self._oedometer(k, series) for k in range(len(self._record.spans)))
        return [each for each in found if each is not None]

    def _oedometer(self, k: int, series: np.ndarray) -> Oedometer | None:
        span, fluid, plates = self._record.spans[k], self._scene.fluid, self._plates[k]
        pressed = _pressed_axes(plates)
        if self.dry[k] or fluid is None or span.end is None or len(pressed) != 1 or _moving_axes(plates):
            return None
        (axis,) = pressed
        ends = (f"{AXES[axis]}_min", f"{AXES[axis]}_max")
        known = [each for each in self._record.permeability if each.time <= span.begin and each.axis == AXES[axis]]
        pressures = self.wall_pressures(span.begin)
        before, rows = series[series["stage"] <= k], series[series["stage"] == k + 1]
        one_base = len(set(pressures.values())) == 1 and set(pressures) <= set(ends) and self._walls(span.begin).steady
        if not known or not one_base or not len(before) or not len(rows):
            return None
        start, end, base = before[-1], rows[-1], next(iter(pressures.values()))
        plate = next(wall for wall in ends if plates[wall].stress is not None)
        # The effective stress is to rise by the load, which pores bear at first.
        load = float(plates[plate].stress or 0.0) - base - float(start[f"contact_stress_{plate}"])
        first, last = (float(row[f"strain_{AXES[axis]}"]) for row in (start, end))
        borne = [abs(float(row["mean_pressure"]) - base) for row in (start, end) if not np.isnan(row["mean_pressure"])]
        if not load > 0.0 or not last > first or max(borne) > _CONSOLIDATED * load:
            return None
        lower, upper = (wall in pressures for wall in ends)
        height = self._record.box[axis] * (1.0 - first)
        modulus = load * (1.0 - first) / (last - first)
        coefficient = consolidation_coefficient(known[-1].permeability, modulus, fluid.viscosity)
        drainage = 0.5 * height if lower and upper else height
        return Oedometer(k + 1, axis, span.begin, load, base, first, last, coefficient, (lower, upper), drainage)

    def triaxial(self) -> Triaxial | None:
        """The first triaxial test of the run; None if there is none."""
        for k, plates in enumerate(self._plates):
            pressed = _pressed_axes(plates)
            stress = {wall[0]: plate.stress for wall, plate in plates.items() if plate.stress is not None}
            moving = _moving_axes(plates)
            if len(pressed) == 2 and len(moving) == 1 and not set(moving) & set(pressed):
                return Triaxial(k + 1, moving[0])
            if len(pressed) == 3 and len(set(stress.values())) == 2:
                values = [stress[axis] for axis in AXES]
                return Triaxial(k + 1, next(a for a in range(3) if values.count(values[a]) == 1))
        return None


def _pressed_axes(plates: dict[str, Plate]) -> list[int]:
    """Axes along which a wall presses with a given stress."""
    return sorted({AXES.index(wall[0]) for wall, plate in plates.items() if plate.stress is not None})


def _moving_axes(plates: dict[str, Plate]) -> list[int]:
    """Axes along which a wall moves at a given speed."""
    normal = zip(plates.values(), WALL_AXES, strict=True)
    return sorted({int(axis) for plate, axis in normal if plate.stress is None and plate.velocity[axis] != 0.0})


def _mean_stresses(rows: np.ndarray, name: str) -> np.ndarray:
    """(3, R): mean of opposite walls [Pa] along each axis; NaN where a run has no such columns."""
    if f"{name}_x_min" not in (rows.dtype.names or ()):
        return np.full((3, len(rows)), np.nan)
    return np.array([0.5 * (rows[f"{name}_{axis}_min"] + rows[f"{name}_{axis}_max"]) for axis in AXES])
