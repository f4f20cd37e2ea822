"""What each wall of the box does to the fluid: it imposes a pressure, a flow or neither, and drags it or not."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, fields
from typing import Any

import numpy as np

from porefv.errors import InputError
from porefv.packing.box import WALLS, Box
from porefv.system.number_checks import LEAST, MOST, is_finite_number, within_range

# What can be imposed on a wall: the name, the unit in words, the unit.
_IMPOSED = (
    ("pressure", "pascals", "Pa"),
    ("inflow", "cubic metres per second", "m³/s"),
    ("velocity", "metres per second", "m/s"),
)


def condition_text(wall: Mapping[str, Any]) -> str:
    """What a wall, as plain data, imposes on the flow: ``1 Pa``, ``1e-09 m³/s`` or ``no-flux``."""
    imposed = [f"{wall[name]:g} {unit}" for name, _, unit in _IMPOSED if wall.get(name) is not None]
    return imposed[0] if imposed else "no-flux"


@dataclass(frozen=True)
class Wall:
    """Condition on one wall.

    Parameters
    ----------
    pressure : float, optional
        Imposed piezometric pressure [Pa]: fluid passes freely.
    slip : bool
        False: no-slip, the wall drags the fluid. True: a plane of symmetry (C12 §3.1).
    inflow : float, optional
        Imposed flow into the sample [m³/s], negative out of it. The wall has one pressure, which is found: it is
        that of a porous plate.
    velocity : float, optional
        Imposed Darcy velocity into the sample [m/s]: the flow is that times the area of the wall.
    free : bool
        Whether the wall is a free surface: clear fluid between it and the grains has its pressure, which it needs. For
        grains that move (`porefv.coupling.Coupling`).

    Notes
    -----
    At most one of `pressure`, `inflow` and `velocity` can be given. A wall without any is impervious.
    """

    pressure: float | None = None
    slip: bool = False
    inflow: float | None = None
    velocity: float | None = None
    free: bool = False

    def __post_init__(self) -> None:
        given = []
        for name, words, unit in _IMPOSED:
            value = getattr(self, name)
            if value is None:
                continue
            given.append(name)
            if not is_finite_number(value):
                raise InputError(f"a wall's {name} must be a number in {words}, and finite, not {value!r}")
            if value != 0.0 and not within_range(abs(value)):
                raise InputError(f"a wall's {name} must be 0 or of size {LEAST:g} to {MOST:g} {unit}, not {value!r}")
        if len(given) > 1:
            raise InputError(f"{given[1]} and {given[0]} exclude each other: impose one of them on a wall")
        if not isinstance(self.slip, (bool, np.bool_)):
            raise InputError(f"a wall's slip must be true or false, not {self.slip!r}")
        if not isinstance(self.free, (bool, np.bool_)):
            raise InputError(f"a wall's free must be true or false, not {self.free!r}")
        if self.free and self.pressure is None:
            raise InputError("a wall that is a free surface needs a pressure, which the clear fluid before it has")

    @property
    def imposes_flow(self) -> bool:
        """Whether the flow through the wall is imposed."""
        return self.inflow is not None or self.velocity is not None


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
        """Walls from plain data: keys are wall names or `lateral` (all walls not named), values the fields of `Wall`.

        Raises
        ------
        InputError
            For an unknown wall or key, or a value of the wrong kind.
        """
        conditions, known = {}, [f.name for f in fields(Wall)]
        for name, value in mapping.items():
            if name not in WALLS and name != "lateral":
                raise InputError(f"unknown wall {name!r}; the walls are {', '.join(WALLS)}, and lateral for the rest")
            if not isinstance(value, Mapping):
                raise InputError(f"wall {name}: expected a table such as {{ pressure = 1.0 }}, not {value!r}")
            unknown = sorted(set(value) - set(known))
            if unknown:
                raise InputError(f"wall {name}: unknown key {unknown[0]!r}; a wall has {', '.join(known)}")
            for key, _, _ in _IMPOSED:
                if name == "lateral" and key in value:
                    raise InputError(f"wall lateral: a {key} is given wall by wall (x_min, ...), not to all the rest")
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
        """(6,): imposed pressure of each wall, NaN where it has none [Pa]."""
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
    def free(self) -> np.ndarray:
        """(6,) bool: walls that are free surfaces."""
        return np.array([bool(wall.free) for wall in self])

    @property
    def imposes_flow(self) -> np.ndarray:
        """(6,) bool: walls of imposed flow."""
        return np.array([wall.imposes_flow for wall in self])

    def imposed_flows(self, box: Box) -> np.ndarray:
        """(6,): imposed flow into the sample through each wall of a box, NaN where none is imposed [m³/s]."""
        flows = np.full(6, np.nan)
        for w, wall in enumerate(self):
            if wall.inflow is not None:
                flows[w] = wall.inflow
            elif wall.velocity is not None:
                flows[w] = wall.velocity * box.wall_areas[w]
        return flows

    def with_pressures(self, pressures: np.ndarray) -> Walls:
        """The same walls with other imposed pressures (6,) [Pa] and no imposed flow; NaN: an impervious wall."""
        return Walls(
            **{
                name: Wall(None if np.isnan(pressure) else float(pressure), wall.slip)
                for name, wall, pressure in zip(WALLS, self, pressures, strict=True)
            }
        )

    @property
    def axis(self) -> int | None:
        """Axis of the one pair of opposite walls that fluid passes, None where there is no such single pair."""
        passed = self.held | self.imposes_flow
        pairs = np.flatnonzero(passed[0::2] & passed[1::2])
        return int(pairs[0]) if len(pairs) == 1 and passed.sum() == 2 else None


def ensure_no_imposed_flow(walls: Walls) -> None:
    """InputError if a wall has an imposed flow, where the pressures of all walls are needed."""
    if walls.imposes_flow.any():
        name = WALLS[int(np.argmax(walls.imposes_flow))]
        raise InputError(
            f"{name} has an imposed flow, and its pressure is not known yet: find it with "
            "porefv.flow.solve_imposed_flow, or with PoreFlow, whose walls_at_pressures has it"
        )


def ensure_no_free_surface(walls: Walls) -> None:
    """InputError if a wall is a free surface, where grains do not move."""
    if walls.free.any():
        name = WALLS[int(np.argmax(walls.free))]
        raise InputError(
            f"{name} is a free surface, which is for grains that move (porefv simulate): give it a pressure alone, or "
            "place the wall at the grains"
        )
