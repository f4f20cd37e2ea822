"""CouplingSettings: how a coupling steps, and Effort: what its steps have taken."""

from __future__ import annotations

from dataclasses import dataclass, field

from porefv.coupling.exchange import EXCHANGES
from porefv.errors import InputError
from porefv.system.number_checks import is_finite_number

SCHEMES = ("auto", "implicit-drag", "semi-implicit")
# Longest step of grains and fluid together, in steps of the grains.
MOST_STRIDE = 20
# What seconds are counted for.
PARTS = ("mesh", "grains", "pressure", "pairs", "forces")


@dataclass(frozen=True)
class CouplingSettings:
    """How a coupling steps: the parameters of `porefv.coupling.Coupling` of these names."""

    scheme: str = "auto"
    exchange: str = "facets"
    tolerance: float = 1e-2
    renewal: float = 0.02
    end_correction: bool = True
    pair_resistance: bool = False
    roughness: float = 0.02
    stride: int = 1

    def __post_init__(self) -> None:
        if self.scheme not in SCHEMES:
            raise InputError(f"unknown scheme {self.scheme!r}; known: {', '.join(SCHEMES)}")
        if self.exchange not in EXCHANGES:
            raise InputError(f"unknown exchange {self.exchange!r}; known: {', '.join(EXCHANGES)}")
        if not 0.0 < self.tolerance < 1.0:
            raise InputError(f"tolerance must lie between 0 and 1, not {self.tolerance!r}")
        if not 0.0 < self.renewal <= 1.0:
            raise InputError(f"renewal must be a part of the mean radius, in (0, 1], not {self.renewal!r}")
        if type(self.stride) is not int or not 1 <= self.stride <= MOST_STRIDE:
            raise InputError(f"stride must be a whole number of steps, 1 to {MOST_STRIDE}, not {self.stride!r}")
        if self.stride > 1 and not (self.pair_resistance and self.scheme != "semi-implicit"):
            raise InputError(
                f"a stride of {self.stride} steps is for pair_resistance = true, whose lubrication keeps contacts from "
                "bouncing, and for an implicit step: scheme = 'auto' or 'implicit-drag'"
            )
        if not 1e-6 <= self.roughness <= 0.2:
            raise InputError(f"roughness must be a part of the radius, in [1e-6, 0.2], not {self.roughness!r}")


@dataclass
class Effort:
    """What a coupled run has taken.

    Attributes
    ----------
    steps, iterations, meshes : int
        Steps, iterations for pressures, meshes made.
    seconds : dict
        Spent on `mesh`, `grains`, `pressure`, `pairs` and `forces`.
    pair_iterations : int
        Iterations for the velocities of grains that resist each other.
    """

    steps: int = 0
    iterations: int = 0
    meshes: int = 0
    seconds: dict[str, float] = field(default_factory=lambda: dict.fromkeys(PARTS, 0.0))
    pair_iterations: int = 0

    def __post_init__(self) -> None:
        counts = (self.steps, self.iterations, self.meshes, self.pair_iterations)
        if not all(type(count) is int and count >= 0 for count in counts):
            raise ValueError(f"steps, iterations and meshes are counts, not {counts}")
        if {*self.seconds} != {*PARTS}:
            raise ValueError(f"the seconds are of {', '.join(self.seconds)}")
        if not all(is_finite_number(time) for time in self.seconds.values()):
            raise ValueError("the seconds are no numbers")
