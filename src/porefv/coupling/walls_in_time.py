"""Pressures of walls in time: constant, by a table, or a sine."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from porefv.flow.walls import Wall, Walls
from porefv.packing.box import WALLS


class PressureHistory(Protocol):
    """A pressure in time."""

    def at(self, time: float) -> float:
        """The pressure [Pa] at a time since the history was set [s]."""
        ...


@dataclass(frozen=True)
class ConstantPressure:
    """A constant pressure."""

    pressure: float

    def at(self, time: float) -> float:
        """The pressure [Pa] at a time since the history was set [s]."""
        return self.pressure


@dataclass(frozen=True)
class PressureTable:
    """Linear between given times; the first and the last pressure hold before and after them."""

    times: tuple[float, ...]
    pressures: tuple[float, ...]

    def at(self, time: float) -> float:
        """The pressure [Pa] at a time since the history was set [s]."""
        return float(np.interp(time, self.times, self.pressures))


@dataclass(frozen=True)
class SinePressure:
    """mean + amplitude sin(2π t / period)."""

    mean: float
    amplitude: float
    period: float

    def at(self, time: float) -> float:
        """The pressure [Pa] at a time since the history was set [s]."""
        return self.mean + self.amplitude * math.sin(2.0 * math.pi * time / self.period)


@dataclass(frozen=True)
class WallHistory:
    """One wall: its piezometric pressure in time, None where impervious; whether it slips, and is a free surface."""

    pressure: PressureHistory | None = None
    slip: bool = False
    free: bool = False


class WallHistories:
    """The six walls in time. The times of a history count from when it was set.

    Examples
    --------
    >>> walls = WallHistories()
    >>> walls.set({"z_max": WallHistory(PressureTable((0.0, 1.0), (0.0, 10.0)))}, time=5.0)
    >>> walls.at(5.5).z_max.pressure
    5.0
    """

    def __init__(self) -> None:
        self._set = {name: (WallHistory(), 0.0) for name in WALLS}

    def set(self, histories: Mapping[str, WallHistory], time: float) -> None:
        """Change the walls that are named, from a time on [s]."""
        self._set |= {name: (history, time) for name, history in histories.items()}

    def at(self, time: float) -> Walls:
        """What the walls are at a time [s]."""
        return Walls(
            **{
                name: Wall(
                    None if history.pressure is None else history.pressure.at(time - since),
                    history.slip,
                    free=history.free,
                )
                for name, (history, since) in self._set.items()
            }
        )

    @property
    def steady(self) -> bool:
        """Whether no pressure changes in time."""
        return all(isinstance(history.pressure, ConstantPressure | None) for history, _ in self._set.values())
