"""Tables of walls whose pressures vary in time."""

from __future__ import annotations

import itertools
from collections.abc import Mapping, Sequence
from typing import Annotated, Any

from pydantic import AfterValidator

from porefv.coupling.walls_in_time import ConstantPressure, PressureHistory, PressureTable, SinePressure, WallHistory
from porefv.flow.walls import Wall
from porefv.packing.box import WALLS
from porefv.scenes.errors import refused
from porefv.scenes.shared_tables import LateralTable, SixWalls
from porefv.scenes.table import MadeFrom, OneOf, Table
from porefv.scenes.values import Numbers, Seconds, key


def increase_from_zero(times: Sequence[float]) -> bool:
    """Whether times are increasing, and none before 0."""
    return len(times) > 0 and times[0] >= 0.0 and all(a < b for a, b in itertools.pairwise(times))


def _pressure(value: float) -> float:
    Wall(value)  # refuses what cannot be computed with
    return value


Times = Annotated[tuple[float, ...], Numbers("increasing times in s, from 0 on", holds=increase_from_zero)]
Pressure = Annotated[float, AfterValidator(_pressure)]


class PressureTableTable(Table):
    """A pressure that is linear between given times; the first and the last pressure hold before and after them."""

    times: Times = key("increasing times since the start of the stage that sets the pressure", unit="s")
    pressures: Annotated[tuple[float, ...], Numbers("a list of finite numbers such as [0.0, 1.0]")] = key(
        "pressures at these times", unit="Pa"
    )

    def make(self) -> PressureTable:
        if len(self.times) != len(self.pressures):
            raise refused(f"{len(self.times)} times need as many pressures, not {len(self.pressures)}", "pressures")
        return PressureTable(self.times, tuple(map(_pressure, self.pressures)))


class SinePressureTable(Table):
    """The pressure mean + amplitude sin(2π t / period)."""

    mean: Pressure = key("mean pressure", 0.0, unit="Pa")
    amplitude: Pressure = key("amplitude of the sine", unit="Pa")
    period: Seconds = key("period of the sine", unit="s")

    def make(self) -> SinePressure:
        return SinePressure(self.mean, self.amplitude, self.period)


def _kind_of_pressure(value: Any) -> str:
    if not isinstance(value, Mapping):
        return "constant"
    return "sine" if {"mean", "amplitude", "period"} & set(value) else "table"


AnyPressure = Annotated[
    PressureHistory,
    OneOf(
        _kind_of_pressure,
        constant=Annotated[Pressure, AfterValidator(ConstantPressure)],
        table=Annotated[PressureTable, MadeFrom(PressureTableTable)],
        sine=Annotated[SinePressure, MadeFrom(SinePressureTable)],
    ),
]


class WallInTimeTable(Table):
    """What a wall does to the fluid."""

    pressure: AnyPressure | None = key(
        "imposed piezometric pressure: a number, or a table of a pressure that varies in time. Without it the wall is "
        "impervious. Not for `lateral`",
        None,
        unit="Pa",
    )
    slip: bool = key(
        "whether the fluid slips along the wall, as along a plane of symmetry. If not, the wall drags it", False
    )
    free: bool = key(
        "whether the wall is a [free surface](coupling.md#free-surface): clear fluid between it and the grains has its "
        "pressure, which is then required. Not for `lateral`",
        False,
    )

    def make(self) -> WallHistory:
        if self.free and self.pressure is None:
            raise refused("a free surface needs a pressure, which the clear fluid before it has", "free")
        return WallHistory(self.pressure, self.slip, self.free)


class StageWallsTable(SixWalls[Annotated[WallHistory, MadeFrom(WallInTimeTable)]]):
    """What the walls do to the fluid from the start of a stage on."""

    def make(self) -> dict[str, WallHistory]:
        return self.named()


class FirstWallsTable(SixWalls[Annotated[WallHistory, MadeFrom(WallInTimeTable)]]):
    """What the walls do to the fluid at the start."""

    lateral: LateralTable = key("all walls that are not named", {})

    def make(self) -> dict[str, WallHistory]:
        return dict.fromkeys(WALLS, WallHistory(slip=self.lateral.slip)) | self.named()
