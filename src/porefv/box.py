"""The box, and the names of its six walls."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike, NDArray

from porefv.errors import InputError, vector

Floats = NDArray[np.float64]

# Wall w is normal to axis w // 2; its outward normal points down the axis if w is even, up if odd.
WALLS = ("x_min", "x_max", "y_min", "y_max", "z_min", "z_max")


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

    def section(self, axis: int) -> float:
        """Area of a section normal to an axis (0, 1 or 2), m²."""
        return float(np.prod(np.delete(self.size, axis)))

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
