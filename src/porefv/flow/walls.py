"""What each wall of the box does to the fluid: holds a pressure or lets nothing pass, drags it or not."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, fields
from typing import Any

import numpy as np

from porefv.errors import InputError
from porefv.packing.box import WALLS
from porefv.system.number_checks import LEAST, MOST, is_finite_number, within_range


@dataclass(frozen=True)
class Wall:
    """Condition on one wall.

    Parameters
    ----------
    pressure : float, optional
        Imposed piezometric pressure [Pa]: fluid passes freely. Without it the wall is impervious.
    slip : bool
        False: no-slip, the wall drags the fluid. True: a plane of symmetry (C12 §3.1).
    """

    pressure: float | None = None
    slip: bool = False

    def __post_init__(self) -> None:
        if self.pressure is not None:
            if not is_finite_number(self.pressure):
                raise InputError(f"a wall's pressure must be a number in pascals, and finite, not {self.pressure!r}")
            if self.pressure != 0.0 and not within_range(abs(self.pressure)):
                raise InputError(
                    f"a wall's pressure must be 0 or of size {LEAST:g} to {MOST:g} Pa, not {self.pressure!r}"
                )
        if not isinstance(self.slip, (bool, np.bool_)):
            raise InputError(f"a wall's slip must be true or false, not {self.slip!r}")


@dataclass(frozen=True)
class Walls:
    """Conditions on the six walls; impervious and no-slip unless said otherwise.

    Examples
    --------
    >>> Walls(y_min=Wall(pressure=1.0), y_max=Wall(pressure=0.0)).axis
    1
    """

    x_min: Wall = field(default_factory=Wall)
    x_max: Wall = field(default_factory=Wall)
    y_min: Wall = field(default_factory=Wall)
    y_max: Wall = field(default_factory=Wall)
    z_min: Wall = field(default_factory=Wall)
    z_max: Wall = field(default_factory=Wall)

    def __post_init__(self) -> None:
        for name in WALLS:
            if not isinstance(getattr(self, name), Wall):
                raise InputError(f"{name} must be a Wall, such as Wall(pressure=1.0), not {getattr(self, name)!r}")

    @classmethod
    def along(cls, axis: str = "y", drop: float = 1.0, *, slip: bool = False) -> Walls:
        """Flow along an axis from pressure `drop` at its lower wall to 0 at its upper; lateral walls as `slip` says."""
        if axis not in ("x", "y", "z"):
            raise InputError(f"axis must be 'x', 'y' or 'z', not {axis!r}")
        walls = {name: Wall(slip=slip) for name in WALLS}
        walls[f"{axis}_min"] = Wall(pressure=drop)
        walls[f"{axis}_max"] = Wall(pressure=0.0)
        return cls(**walls)

    @classmethod
    def from_mapping(cls, mapping: Mapping[str, Any]) -> Walls:
        """Walls from plain data: keys are wall names or `lateral` (all walls not named), values {pressure, slip}.

        Raises
        ------
        InputError
            For an unknown wall or key, or a value of the wrong kind.
        """
        conditions = {}
        for name, value in mapping.items():
            if name not in WALLS and name != "lateral":
                raise InputError(f"unknown wall {name!r}; the walls are {', '.join(WALLS)}, and lateral for the rest")
            if not isinstance(value, Mapping):
                raise InputError(f"wall {name}: expected a table such as {{ pressure = 1.0 }}, not {value!r}")
            unknown = sorted(set(value) - {f.name for f in fields(Wall)})
            if unknown:
                raise InputError(f"wall {name}: unknown key {unknown[0]!r}; a wall has pressure and slip")
            if name == "lateral" and "pressure" in value:
                raise InputError("wall lateral: a pressure is given wall by wall (x_min, ...), not to all the rest")
            try:
                conditions[name] = Wall(**value)
            except InputError as error:
                raise InputError(f"wall {name}: {error}") from None
        lateral = conditions.pop("lateral", Wall())
        return cls(**{name: conditions.get(name, lateral) for name in WALLS})

    def __iter__(self) -> Iterator[Wall]:
        return (getattr(self, name) for name in WALLS)

    @property
    def pressures(self) -> np.ndarray:
        """(6,): imposed pressure of each wall, NaN where impervious [Pa]."""
        return np.array([np.nan if wall.pressure is None else wall.pressure for wall in self], float)

    @property
    def held(self) -> np.ndarray:
        """(6,) bool: walls of imposed pressure."""
        return ~np.isnan(self.pressures)

    @property
    def slip(self) -> np.ndarray:
        """(6,) bool: walls that do not drag the fluid."""
        return np.array([bool(wall.slip) for wall in self])

    @property
    def axis(self) -> int | None:
        """Axis of the one pair of opposite pressure walls, None where there is no such single pair."""
        held = self.held
        pairs = np.flatnonzero(held[0::2] & held[1::2])
        return int(pairs[0]) if len(pairs) == 1 and held.sum() == 2 else None
