"""What walls are to the fluid, in time: pressures that stay, follow a table, or swing."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from porefv.boundary import Wall, Walls
from porefv.packing import WALLS


class Course(Protocol):
    """A pressure in time."""

    def at(self, time: float) -> float:
        """The pressure [Pa] so long after the stage began that set it [s]."""
        ...


@dataclass(frozen=True)
class Steady:
    """A pressure that stays."""

    pressure: float

    def at(self, time: float) -> float:
        return self.pressure


@dataclass(frozen=True)
class Polyline:
    """Straight between given moments; the first and the last pressure hold before and after them."""

    times: tuple[float, ...]
    pressures: tuple[float, ...]

    def at(self, time: float) -> float:
        return float(np.interp(time, self.times, self.pressures))


@dataclass(frozen=True)
class Sine:
    """mean + amplitude sin(2π t / period)."""

    mean: float
    amplitude: float
    period: float

    def at(self, time: float) -> float:
        return self.mean + self.amplitude * math.sin(2.0 * math.pi * time / self.period)


@dataclass(frozen=True)
class Drainage:
    """One wall: its piezometric pressure in time, None where it is impervious, and whether it lets the fluid slip."""

    course: Course | None = None
    slip: bool = False


class Drainages:
    """The six walls in time. Times of a course count from when it was set.

    Examples
    --------
    >>> walls = Drainages()
    >>> walls.set({"z_max": Drainage(Polyline((0.0, 1.0), (0.0, 10.0)))}, time=5.0)
    >>> walls.at(5.5).z_max.pressure
    5.0
    """

    def __init__(self) -> None:
        self._set = {name: (Drainage(), 0.0) for name in WALLS}

    def set(self, drainages: Mapping[str, Drainage], time: float) -> None:
        """Change the walls that are named, from a time on [s]."""
        self._set |= {name: (drainage, time) for name, drainage in drainages.items()}

    def at(self, time: float) -> Walls:
        """What the walls are at a time [s]."""
        return Walls(
            **{
                name: Wall(None if drainage.course is None else drainage.course.at(time - since), drainage.slip)
                for name, (drainage, since) in self._set.items()
            }
        )

    @property
    def steady(self) -> bool:
        """Whether no pressure changes in time."""
        return all(drainage.course is None or isinstance(drainage.course, Steady) for drainage, _ in self._set.values())
