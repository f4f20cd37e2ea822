"""Objects that compute their results when they are first asked for: inputs are fixed, and arrays are read-only."""

from __future__ import annotations

from dataclasses import fields, is_dataclass
from functools import cached_property
from typing import Any, TypeVar

import numpy as np

T = TypeVar("T")


class lazy_property(cached_property[T]):  # noqa: N801  # a decorator, as its base is
    """A `cached_property` whose arrays nobody can change: other results follow from them."""

    def __get__(self, instance: Any, owner: type | None = None) -> Any:
        if instance is None:
            return self
        value = super().__get__(instance, owner)
        freeze(value)
        return value


class FixedInputs:
    """Base of an object whose results follow from its inputs: these can be set once, in `__init__`.

    An array that is set becomes read-only: give a copy.
    """

    def __setattr__(self, name: str, value: Any) -> None:
        if not name.startswith("_") and (name in vars(self) or hasattr(type(self), name)):
            kind = type(self).__name__
            raise AttributeError(f"{kind}.{name} cannot be set: results follow from it. Make a new {kind}")
        if isinstance(value, np.ndarray):
            freeze(value)
        super().__setattr__(name, value)


def freeze(value: Any) -> None:
    """Make an array read-only, and those in a tuple or a dataclass."""
    if isinstance(value, np.ndarray):
        value.flags.writeable = False
    elif isinstance(value, tuple):
        for item in value:
            freeze(item)
    elif is_dataclass(value) and not isinstance(value, type):
        for field in fields(value):
            freeze(getattr(value, field.name))
