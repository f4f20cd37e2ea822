"""The box, and its six walls: their names, axes, senses and normals, which the whole package takes from here."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike, NDArray

from porefv.errors import InputError, vector

if TYPE_CHECKING:
    from porefv.packing.packing import Packing

Floats = NDArray[np.float64]

# The walls, in the order of every array with a row for each. Wall w is normal to axis WALL_AXES[w]; its outward normal
# points along that axis in the sense WALL_SENSES[w].
WALLS = ("x_min", "x_max", "y_min", "y_max", "z_min", "z_max")
WALL_AXES = np.array([0, 0, 1, 1, 2, 2])
WALL_SENSES = np.array([-1.0, 1.0, -1.0, 1.0, -1.0, 1.0])
# (6, 3): outward unit normal of each wall.
WALL_NORMALS = np.zeros((6, 3))
WALL_NORMALS[np.arange(6), WALL_AXES] = WALL_SENSES
for _constant in (WALL_AXES, WALL_SENSES, WALL_NORMALS):
    _constant.flags.writeable = False


@dataclass(frozen=True, eq=False, repr=False, init=False)
class Box:
    """Axis-aligned box.

    Parameters
    ----------
    lower, upper : (3,) arrays, m
        Opposite corners, ``lower < upper`` along each axis.

    Raises
    ------
    InputError
        If a corner is not three finite numbers, or a side is zero or negative.

    Examples
    --------
    >>> Box(lower=[0, 0, 0], upper=[1, 2, 1]).section(axis=1)
    1.0
    """

    lower: Floats
    upper: Floats

    def __init__(self, lower: ArrayLike, upper: ArrayLike):
        for name, values in (("lower", lower), ("upper", upper)):
            corner = read_only(values, f"box {name}")
            if corner.shape != (3,) or not np.isfinite(corner).all():
                raise InputError(f"box {name} must be three finite numbers, not {values!r}.")
            object.__setattr__(self, name, corner)
        for axis, size in zip("xyz", self.size, strict=True):
            if size <= 0:
                raise InputError(
                    f"the box has size {size:.6g} m along {axis}: lower is {vector(self.lower)}, "
                    f"upper is {vector(self.upper)}. Give upper > lower along each axis."
                )
        if not 0 < self.volume < np.inf:
            raise InputError(f"the box of sides {vector(self.size)} m has no volume a number can hold.")

    @cached_property
    def size(self) -> Floats:
        """(3,) lengths of the sides, m."""
        with np.errstate(over="ignore"):
            return self.upper - self.lower

    @cached_property
    def volume(self) -> float:
        """Volume, m³."""
        with np.errstate(over="ignore", under="ignore"):
            return float(np.prod(self.size))

    def scaled(self, factor: float) -> Box:
        """The box with all lengths multiplied by a factor."""
        return Box(self.lower * factor, self.upper * factor)

    def section(self, axis: int) -> float:
        """Area of a section normal to an axis (0, 1 or 2), m²."""
        return float(np.prod(np.delete(self.size, axis)))

    @property
    def wall_areas(self) -> Floats:
        """(6,) area of each wall, m²."""
        return np.array([self.section(axis) for axis in WALL_AXES])

    @property
    def wall_places(self) -> Floats:
        """(6,) coordinate of each wall along the axis it is normal to, m."""
        return np.stack([self.lower, self.upper], axis=1).ravel()

    @classmethod
    def between(cls, places: ArrayLike) -> Box:
        """The box whose walls are at these coordinates, (6,), each along its axis, m."""
        places = np.asarray(places, dtype=np.float64)
        return cls(places[0::2], places[1::2])

    @classmethod
    def around(cls, packing: Packing) -> Box:
        """The smallest box that holds every sphere of a packing: each wall touches one."""
        radii = packing.radii[:, None]
        return cls((packing.centres - radii).min(axis=0), (packing.centres + radii).max(axis=0))

    def wall_distances(self, points: Floats) -> Floats:
        """(n, 6) distance of each point (n, 3) from each wall, m; positive inside."""
        distances = np.empty((len(points), 6))
        distances[:, 0::2] = points - self.lower
        distances[:, 1::2] = self.upper - points
        return distances

    def __repr__(self) -> str:
        return f"Box({self.sides}, lower ({vector(self.lower)}))"

    @property
    def sides(self) -> str:
        """Lengths of the sides as text, ``1×2×1 m``."""
        return "×".join(f"{side:.6g}" for side in self.size) + " m"


def read_only(values: ArrayLike, name: str) -> Floats:
    """A read-only float64 copy, or the array itself if it is one already."""
    if isinstance(values, np.ndarray) and values.dtype == np.float64 and values.flags.c_contiguous:
        if not values.flags.writeable and values.base is None:
            return values
    try:
        array = np.array(values, dtype=np.float64, order="C")
    except (TypeError, ValueError) as error:
        raise InputError(f"{name} must be numbers: {error}.") from None
    array.flags.writeable = False
    return array
