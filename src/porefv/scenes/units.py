"""Numbers of scenes that are written with a unit, such as "1 cP": converted to the unit of their key by pint."""

from __future__ import annotations

import re
from functools import cache
from typing import Any

# A number, and a unit after it.
_WRITTEN = re.compile(r"\s*([-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?)\s*(\S.*?)\s*", re.DOTALL)
# What a unit is written with: names, powers, products and quotients. Longer texts are no unit.
_UNIT = re.compile(r"[^\W\d_]\w*(?:[\w\s°*/^()⁻-]*[\w)])?|°")
# Powers of numbers, and numbers of three digits: their values could be of any length.
_TOO_LARGE = re.compile(r"[\d⁰¹²³⁴⁵⁶⁷⁸⁹)]\s*(?:\*\*|\^)|[\d⁰¹²³⁴⁵⁶⁷⁸⁹]{3}")
_LONGEST = 60
# One of each unit of keys, for messages.
_EXAMPLES = {
    "Pa s": "1 cP", "Pa": "1 kPa", "m": "1 mm", "s": "1 ms", "kg/m³": "1 g/cm³", "m/s": "1 mm/s", "m/s²": "1 m/s²",
    "m³/s": "1 mL/s", "degrees": "0.5 rad",
}  # fmt: skip


def has_text(value: Any) -> bool:
    """Whether a value is a text, or a list with a text in it."""
    return isinstance(value, str) or (isinstance(value, list | tuple) and any(isinstance(item, str) for item in value))


def in_unit(value: Any, unit: str) -> Any:
    """A value with the texts in it, such as "1 cP", as numbers in a unit.

    Parameters
    ----------
    value
        A text, or a list of texts and numbers. All else is returned as it is.
    unit : str
        Unit of the key, as the documentation writes it.

    Raises
    ------
    ValueError
        For a text that is no number with a unit of this dimension; the message says what is expected.
    """
    if isinstance(value, str):
        return _converted(value, unit)
    if isinstance(value, list | tuple):
        return [_converted(item, unit) if isinstance(item, str) else item for item in value]
    return value


def _converted(text: str, unit: str) -> float:
    expected = f'a finite number of {unit}, or a text with its unit such as "{_EXAMPLES[unit]}"'
    shown = repr(text) if len(text) <= _LONGEST else f"{text[:_LONGEST]!r}..."
    found = _WRITTEN.fullmatch(text.replace("·", "*"))
    if found is None or not _UNIT.fullmatch(found[2]) or _TOO_LARGE.search(found[2]) or len(text) > _LONGEST:
        raise ValueError(f"expected {expected}, not {shown}")
    number, name = float(found[1]), found[2]
    import pint

    registry = _registry()
    try:
        given = registry.parse_units(name)
        offset = registry.Quantity(0.0, given).to_root_units().magnitude != 0.0
    except pint.OffsetUnitCalculusError:
        offset = True
    except pint.UndefinedUnitError:
        raise ValueError(
            f"the unit of {shown} is unknown; expected {expected}. Powers are written m³ or m**3"
        ) from None
    except Exception:  # what pint raises for texts that are no units differs from version to version
        raise ValueError(f"the unit of {shown} cannot be read; expected {expected}") from None
    if offset:
        raise ValueError(f"the unit of {shown} does not begin at zero, as a unit must here; expected {expected}")
    try:
        converted = registry.Quantity(number, given).to(registry.parse_units(unit)).magnitude
    except pint.DimensionalityError:
        raise ValueError(f"{shown} is not of the dimension of {unit}; expected {expected}") from None
    except (ArithmeticError, ValueError):
        raise ValueError(f"{shown} cannot be converted to {unit}; expected {expected}") from None
    return float(converted)


@cache
def _registry() -> Any:
    """The units that pint knows."""
    import pint

    return pint.UnitRegistry(cache_folder=None)
