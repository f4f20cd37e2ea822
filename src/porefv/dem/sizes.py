"""Distributions of the sizes of grains."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from porefv.errors import InputError
from porefv.system.number_checks import is_finite_number


class Sizes(Protocol):
    """A distribution of sizes."""

    def draw(self, n: int, rng: np.random.Generator) -> np.ndarray:
        """(n,): relative radii of n grains, in random order."""


@dataclass(frozen=True)
class UniformSizes:
    """Radii spread evenly, by number, between r_min and r_max.

    Parameters
    ----------
    ratio : float
        r_min / r_max, in (0, 1].

    Examples
    --------
    >>> sorted(UniformSizes(0.5).draw(3, np.random.default_rng(0)).tolist())
    [0.5, 0.75, 1.0]
    """

    ratio: float

    def __post_init__(self) -> None:
        if not (is_finite_number(self.ratio) and 0.0 < self.ratio <= 1.0):
            raise InputError(f"ratio, r_min over r_max, must lie in (0, 1], not {self.ratio!r}")

    def draw(self, n: int, rng: np.random.Generator) -> np.ndarray:
        """(n,): relative radii of n grains, in random order."""
        return rng.permutation(np.linspace(self.ratio, 1.0, n))


@dataclass(frozen=True)
class Grading:
    """Sizes from a grading curve: what part of the mass passes each sieve.

    Between two sieves the curve is straight over the logarithm of the diameter, as it is usually drawn; two equal
    diameters hold grains of that one size.

    Parameters
    ----------
    diameters : sequence of float
        Of the sieves, in any unit, none smaller than the one before.
    passing : sequence of float
        Fraction of the mass that passes each: from 0 at the first to 1 at the last, never falling.

    Notes
    -----
    Grains are taken at even steps of the distribution by number: as close to the curve as n grains can come.
    """

    diameters: Sequence[float]
    passing: Sequence[float]

    def __post_init__(self) -> None:
        d, f = self.diameters, self.passing
        if len(d) < 2 or not all(is_finite_number(x) and x > 0.0 for x in d) or list(d) != sorted(d):
            raise InputError(f"diameters must be two or more positive numbers, none below the one before, not {d!r}")
        if len(f) != len(d):
            raise InputError(f"passing must have a fraction for each of the {len(d)} diameters, not {len(f)}")
        if not all(is_finite_number(x) for x in f) or list(f) != sorted(f) or f[0] != 0.0 or f[-1] != 1.0:
            raise InputError(f"passing must rise from 0.0 to 1.0 (fractions of the mass, not per cent), not {f!r}")

    def draw(self, n: int, rng: np.random.Generator) -> np.ndarray:
        """(n,): relative radii of n grains, in random order."""
        d, f = np.array(self.diameters, float), np.array(self.passing, float)
        a, b = d[:-1], d[1:]
        # dm ~ d ln d between sieves, a number ~ dm / d³: its integral is (a⁻³ - b⁻³) / (3 ln b/a), or a⁻³ if a = b.
        one_size = a == b
        width = np.where(one_size, 1.0, 3.0 * np.log(b / np.where(one_size, 0.5 * b, a)))
        numbers = np.diff(f) * np.where(one_size, a**-3, (a**-3 - b**-3) / width)
        ends = np.concatenate([[0.0], np.cumsum(numbers)])
        wanted = (np.arange(n) + 0.5) / n * ends[-1]
        k = np.clip(np.searchsorted(ends, wanted, side="right") - 1, 0, len(a) - 1)
        part = (wanted - ends[k]) / numbers[k]
        diameters = (a[k] ** -3 - part * (a[k] ** -3 - b[k] ** -3)) ** (-1.0 / 3.0)
        return rng.permutation(0.5 * diameters)
