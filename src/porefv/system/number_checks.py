"""Checks of single numbers and of arrays of numbers; an error names the value and what is wanted."""

from __future__ import annotations

import math
import sys
from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from porefv.errors import ComputationError, InputError

# Sizes of numbers such that products of several of them do not leave double precision.
LEAST, MOST = 1e-60, 1e60


def within_range(value: float) -> bool:
    """Whether a positive number can be computed with."""
    return LEAST <= value <= MOST


def is_finite_number(value: object) -> bool:
    """Whether a value is a number, not a truth value, that a double can hold."""
    if isinstance(value, bool) or not isinstance(value, (int, float, np.integer, np.floating)):
        return False
    return bool(abs(value) <= sys.float_info.max)  # type: ignore[operator]  # false for nan, and for integers that are no float


def must(holds: bool, otherwise: str) -> None:
    """ValueError with that text unless something holds."""
    if not holds:
        raise ValueError(otherwise)


def known(value: Any) -> Any:
    """The value; None for a number that is not known (NaN)."""
    return None if isinstance(value, float) and math.isnan(value) else value


def check_number(value: object, name: str, what: str, holds: Callable[[float], bool]) -> None:
    """InputError unless the value is a finite number for which that holds.

    Parameters
    ----------
    value : object
    name : str
        Of the value, for the message.
    what : str
        What the value must be, for the message.
    holds : function
        Takes the value, a finite number, and returns whether it is allowed.
    """
    if not (is_finite_number(value) and holds(value)):  # type: ignore[arg-type]
        raise InputError(f"{name} must be {what}, not {value!r}")


def three_numbers(values: ArrayLike, name: str, unit: str = "") -> NDArray[np.float64]:
    """A vector (3,) as a new array; InputError unless it is three finite numbers."""
    try:
        found = np.array(values, float)
    except (TypeError, ValueError):
        found = np.empty(0)
    if found.shape != (3,) or not np.isfinite(found).all():
        raise InputError(f"{name} must be three finite numbers{f' in {unit}' if unit else ''}, not {values!r}")
    return found


def one_value_each(values: ArrayLike, number: int, each: str, what: str, dtype: type = float) -> NDArray[Any]:
    """The values as an array (number,), one for `each` wall, pore or throat; InputError if they are not so many."""
    found: NDArray[Any] = np.asarray(values, dtype)
    if found.shape != (number,):
        raise InputError(f"{what} must have one value per {each}, ({number},), not shape {found.shape}")
    return found


def ensure_finite(values: np.ndarray, what: str) -> np.ndarray:
    """The values; a ComputationError if any of them is not finite."""
    bad = np.count_nonzero(~np.isfinite(values))
    if bad:
        raise ComputationError(
            f"{bad} of {values.size} {what} are not finite numbers; nothing can be computed from them"
        )
    return values
