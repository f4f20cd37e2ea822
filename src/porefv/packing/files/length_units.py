"""Units of length: their sizes in m, and how lines of text in packing files state them."""

from __future__ import annotations

import re

from porefv.errors import InputError
from porefv.packing.files.content import LengthUnit
from porefv.packing.files.options import ReadOptions
from porefv.packing.files.text import quoted

_PREFIXES = {"": 1.0, "deci": 1e-1, "centi": 1e-2, "milli": 1e-3, "micro": 1e-6, "nano": 1e-9, "kilo": 1e3}
_IN_FULL = {f"{prefix}{word}": size for prefix, size in _PREFIXES.items() for word in ("metre", "meter")}

# Metres in units of length that files state.
UNITS = {
    "m": 1.0, "dm": 1e-1, "cm": 1e-2, "mm": 1e-3, "um": 1e-6, "µm": 1e-6, "μm": 1e-6, "micron": 1e-6, "microns": 1e-6,
    "nm": 1e-9, "km": 1e3, "in": 0.0254, "inch": 0.0254, "inches": 0.0254, "ft": 0.3048, "foot": 0.3048,
    "feet": 0.3048, "å": 1e-10, "angstrom": 1e-10, "angstroms": 1e-10, "ångström": 1e-10,
    **_IN_FULL, **{f"{word}s": size for word, size in _IN_FULL.items()},
}  # fmt: skip

# Systems of units, by the size of their unit of length in m.
_SYSTEMS = {"si": 1.0, "mks": 1.0, "cgs": 1e-2}

# Words beside a unit that change nothing about it, and units of other things than length, all in lower case.
_BESIDE = {
    "unit", "units", "of", "length", "lengths", "distance", "distances", "dimension", "dimensions", "all", "are", "is",
    "in", "the", "given", "expressed", "measured", "and", "file", "system", "mass", "time", "force", "pressure",
    "stress", "kg", "g", "mg", "t", "tonne", "s", "ms", "sec", "seconds", "min", "h", "n", "kn", "mn", "pa", "kpa",
    "mpa", "gpa", "j", "k", "c", "rad", "deg",
}  # fmt: skip
# Words whose unit is not that of all lengths.
_PARTIAL = {
    "radius", "radii", "diameter", "diameters", "size", "sizes", "position", "positions", "coordinate", "coordinates",
    "velocity", "mass", "time", "force", "stress", "pressure", "energy", "volume", "area", "angle", "density",
}  # fmt: skip
# Words of files of images, whose lengths may be in voxels.
_VOXELS = {"voxel", "voxels", "vox", "pixel", "pixels", "px"}
# Units that are also words or letters of other meanings: in running text they say nothing.
_OTHER_MEANINGS = {"m", "in", "si", "mks"}

_WORD = re.compile(r"(?<![^\W_])[^\W\d_]+(?![^\W_]|\^|\*\*)")
_GLUED = re.compile(r"(?<=\d)[^\W\d_]+(?![^\W_]|\^|\*\*)")  # 5um
_JOINED = re.compile(r"\b(length|units?)(?=(?:length|unit)s?\b)", re.IGNORECASE)  # UnitLength
_EXPLICIT = re.compile(
    r"(?:(?<![^\W_])(?:([^\W\d_]+)[\s_]+)?units?[\"']?\s*[:=]\s*(?:in\s+(?=\w))?[\"'(\[{]?"
    r"|\b(?:lengths|distances|dimensions)\s+(?:are\s+)?(?:given\s+)?in\s+)"
    r"([^\W\d_]+)(?![\w/^*])",
    re.IGNORECASE,
)
_ONLY = re.compile(
    r"(?:(?:length|distance)s?[\s_]*)?units?(?:[\s_]*(?:of[\s_]*)?(?:length|distance)s?)?\s*[:=]\s*"
    r"[\"'(\[{]?(\S{1,40}?)[\"')\]}.,;]*",
    re.IGNORECASE,
)
_SCALES = re.compile(
    r"\b(?:voxel|pixel)[\s_-]*(?:size|length|edge|width|spacing)|\bspacing\s*[:=]"
    r"|\b(?:length[\s_-]*)?(?:scale|scaling)(?:[\s_-]*factor)?(?:\s*[:=]|\s+[0-9.])|\bin units of\b",
    re.IGNORECASE,
)


def metres(name: str) -> float | None:
    """Length of a unit in m; None if it is not known.

    A symbol may be in capitals as a whole. Otherwise its case matters: ``Mm`` is no ``mm``. That of a word does not.

    >>> metres("mm"), metres("MM"), metres("Mm"), metres("Inch")
    (0.001, 0.001, None, 0.0254)
    """
    if name in UNITS:
        return UNITS[name]
    return UNITS.get(name.lower()) if name.isupper() or len(name) > 3 else None


def stated_unit(place: str, text: str) -> LengthUnit | None:
    """The unit of lengths that a line of text states, such as a comment or a title.

    Parameters
    ----------
    place : str
        The file and the line, as the start of an error.
    text : str

    Returns
    -------
    LengthUnit or None
        None: the line says nothing of lengths. A unit that is not `clear`: it names one, or a scale, in a way that is
        not understood.

    >>> stated_unit("a.csv, line 1", "all lengths are in mm").metres
    0.001
    >>> stated_unit("a.csv, line 1", "voxel size = 5 um").clear
    False
    """
    text = _JOINED.sub(r"\1 ", text).strip(" \t#%!;/\"'")
    words = _WORD.findall(text)
    units = [word for word in words if word.lower() in UNITS.keys() - {"in"} or word.lower() in _SYSTEMS]
    sizes = {_size(word) for word in units}
    explicit = _EXPLICIT.search(text)
    partial = explicit is not None and explicit[1] is not None and explicit[1].lower() in _PARTIAL
    if explicit and not partial and (size := _size(explicit[2])) is not None and sizes | {size} == {size}:
        return LengthUnit(explicit[2], size, place)
    if match := _ONLY.fullmatch(text):
        return LengthUnit(match[1], _size(match[1]), place)
    beside = all(word.lower() in _BESIDE or word in units for word in words)
    if len(sizes) == 1 and None not in sizes and beside and not re.search(r"\d", text):
        return LengthUnit(units[0], sizes.pop(), place)
    named = {word.lower() for word in words + _GLUED.findall(text)}
    if named & ((UNITS.keys() | _SYSTEMS.keys() | _VOXELS) - _OTHER_MEANINGS) or _SCALES.search(text):
        return LengthUnit(text, None, place, clear=False)
    return None


def agreed_unit(unit: LengthUnit | None, stated: LengthUnit | None, options: ReadOptions) -> LengthUnit | None:
    """The unit of the names of columns, or else that stated elsewhere in the file; InputError if they differ."""
    if unit and stated and not stated.clear:
        return unit
    if unit and stated and unit.metres != stated.metres and options.scale is None:
        raise different_units(stated, "the names of columns state", unit)
    return unit or stated


def first_clear(stated: list[LengthUnit], options: ReadOptions) -> LengthUnit | None:
    """Of the units that lines of a file state, the first clear one; InputError if clear ones differ."""
    clear = [unit for unit in stated if unit.clear]
    for unit in clear[1:]:
        if unit.metres != clear[0].metres and options.scale is None:
            raise different_units(unit, f"{clear[0].place} states", clear[0])
    return next(iter(clear or stated), None)


def different_units(unit: LengthUnit, elsewhere: str, other: LengthUnit) -> InputError:
    """The error of a file that states two units."""
    return InputError(
        f"{unit.place}: the unit is {quoted(unit.name)}, and {elsewhere} {quoted(other.name)}. "
        "Give the length of the unit in m as scale."
    )


def _size(name: str) -> float | None:
    return _SYSTEMS[name.lower()] if name.lower() in _SYSTEMS else metres(name)
