"""What words of packing files state about periodic boundaries."""

from __future__ import annotations

import re

_YES = {"t", "true", "1", "yes", "on", "periodic"}
_NO = {"f", "false", "0", "no", "off", "none", "not", "fixed", "wall", "walls", "rigid", "free", "open", "nonperiodic"}

_KEY = re.compile(
    r"(?:box|cell)?[\s_]*(?:periodic(?:ity)?(?:[\s_]*(?:boundary|boundaries|box|cell|bcs?|axes))?|boundary|boundaries|pbcs?|bcs?)"
    r"(?:[\s_]*conditions?)?\s*(?::{1,2}|=|\s)\s*(.*)",
    re.IGNORECASE,
)
_ONE_AXIS = re.compile(r"(?:([xyz])[\s_]*)?(?:is[\s_]*)?periodic(?:[\s_]*([xyz]))?\s*[:=]\s*(\w+)", re.IGNORECASE)
_SAID = re.compile(r"(?<![^\W_])(?:periodic|pbcs?)(?![^\W_])", re.IGNORECASE)
_DENIED = re.compile(r"(?<![^\W_])(?:non|not|no|without)[\s_-]*(?:periodic|pbcs?)(?![^\W_])", re.IGNORECASE)


def periodic_axes(value: str) -> str | None:
    """Periodic axes by the value of a key: ``T T F``, ``1 1 1``, ``pp pp ff``, ``true``, ``xy``; None if it is no such.

    >>> periodic_axes("T T F"), periodic_axes("[true, true, true]"), periodic_axes("none"), periodic_axes("2.5")
    ('xy', 'xyz', '', None)
    """
    words = re.findall(r"[a-z0-9.]+", value.lower().replace("non-periodic", "nonperiodic"))
    if words and all(re.fullmatch("[xyz]{1,3}", word) for word in words if word not in ("and", "in", "along")):
        return "".join(axis for axis in "xyz" if any(axis in word for word in words if word not in ("and", "in")))
    flags = [_flag(word) for word in words]
    if None in flags or len(flags) not in (1, 3):
        return None
    return "".join(axis for axis, flag in zip("xyz", flags if len(flags) == 3 else 3 * flags, strict=True) if flag)


def stated_axes(text: str) -> str | None:
    """Periodic axes that a line of text states, all where it names none; None if it says nothing of boundaries.

    >>> stated_axes("pbc = T T F"), stated_axes("a periodic packing"), stated_axes("boundary layer")
    ('xy', 'xyz', None)
    """
    text = re.sub(r"(?<=[a-z])(?=[A-Z])", "_", text.strip(" \t#%!;/\"'"))  # isPeriodic
    if (match := _ONE_AXIS.fullmatch(text)) and (flag := _flag(match[3].lower())) is not None:
        return (match[1] or match[2] or "xyz").lower() if flag else ""
    if (match := _KEY.fullmatch(text)) and (axes := periodic_axes(match[1])) is not None:
        return axes
    return "xyz" if _SAID.search(text) and not _DENIED.search(text) else None


def _flag(word: str) -> bool | None:
    """Whether a word says that an axis is periodic; None if it says nothing of it."""
    if word in _YES or word in _NO:
        return word in _YES
    return "p" in word if re.fullmatch("[pfsm]{1,2}", word) else None
