"""Which columns of a table hold x, y, z, radius and diameter, and their units: by the user's map, or by their names."""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from porefv.errors import InputError
from porefv.packing.files.content import LengthUnit, missing_radius, warn_radius
from porefv.packing.files.length_units import UNITS, metres
from porefv.packing.files.options import ROLES, ReadOptions
from porefv.packing.files.text import AnyPath, quoted

# The words of a name are joined, in lower case, and these are left out before and after the axis or the size.
_OWNERS = r"(?:particle|sphere|grain|bead|atom)?"
_POINTS = r"(?:position|positions|pos|point|points|coord|coords|coordinate|coordinates)"
_PLACES = rf"(?:{_POINTS}|centre|center|centroid|barycentre|barycenter|c)"
_AXIS = re.compile(rf"{_OWNERS}(?:{_PLACES}?([xyz])|([xyz]){_PLACES})")
_COMPONENT = re.compile(rf"{_OWNERS}{_POINTS}([012])")
_SIZE = re.compile(rf"{_OWNERS}(?:equivalent|equiv|eq)?(?:(r|rad|radius|radii)|(d|diam|diameter|diameters)){_OWNERS}")
_QUERY = re.compile(r"^Q\d+ ?: ?")  # of an EDEM export
_TIME = re.compile(r"\s*:\s*Time\s+[0-9.eE+-]+\s*[a-z]*(?=\s*[\[(]|$)")  # of an export of Rocky
_BRACKETS = re.compile(r"(.*?)[\s,_/]*[\(\[{<]\s*([^\)\]}>]*?)\s*[\)\]}>]")
_SUFFIX = re.compile(r"(.+?)(?:[\s_.]+in[\s_.]+|\s*[\s_/.:,\-]+\s*)([^\W\d_]+)\.?")  # x_mm, x / mm, x in mm, x.mm.
_WORD = re.compile(r"[^\W\d_]+(?: ?\d)?")

_NO_NUMBERS = {"nan", "inf", "na", "null", "none", "missing"}

# Two columns for the same thing may differ by so much of it: digits lost when they were written.
_ROUNDING = 1e-4


@dataclass(frozen=True)
class Column:
    """A column to be read.

    Parameters
    ----------
    role : {"x", "y", "z", "radius", "diameter"}
    position : int
    name : str
    unit : str
        Unit that the name states, or empty.
    """

    role: str
    position: int
    name: str
    unit: str = ""


def recognised(name: str) -> tuple[str, str] | None:
    """Role and unit of a column by its name; None if the name is none of those known.

    >>> recognised("Position X (mm)"), recognised("Points:2"), recognised("Radius"), recognised("vx")
    (('x', 'mm'), ('z', ''), ('radius', ''), None)
    """
    name = _TIME.sub("", _QUERY.sub("", name.strip().strip("\"'").strip()))
    if len(name) > 60:
        return None
    name, unit = _split_unit(name)
    joined = re.sub(r"[\s_:.\-\[\]]", "", name.lower())
    if match := _AXIS.fullmatch(joined):
        return match[1] or match[2], unit
    if match := _COMPONENT.fullmatch(joined):
        return "xyz"[int(match[1])], unit
    if match := _SIZE.fullmatch(joined):
        return ("radius" if match[1] else "diameter"), unit
    return None


def _split_unit(name: str) -> tuple[str, str]:
    """The name of a column without the unit that it states, and this unit, known or not, or an empty text."""
    if match := _BRACKETS.fullmatch(name):
        # Points[0], and otherwise a unit.
        return (name, "") if match[2].isdigit() else (match[1], match[2])
    if (match := _SUFFIX.fullmatch(name)) and match[2].lower() in UNITS:
        return match[1], match[2]
    return name, ""


def roles(names: Iterable[str], options: ReadOptions) -> set[str]:
    """What the columns of these names give: of x, y, z, radius and diameter."""
    names = [name.strip() for name in names]
    found = {known[0] for name in names if (known := recognised(name))}
    return found | {role for role, name in options.columns.items() if name in names}


def chosen_columns(
    path: AnyPath, line: int, names: Sequence[str], options: ReadOptions, wanted: Sequence[str] = ROLES
) -> list[Column]:
    """The columns to read, in the order x, y, z, radius, diameter; of each one or more, which must then agree.

    Parameters
    ----------
    path : path
    line : int
        Of the header; 0 if there is none.
    names : sequence of str
        Of all columns.
    options : ReadOptions
    wanted : sequence of str
        Which of x, y, z, radius and diameter the columns have to give.

    Raises
    ------
    InputError
        Names what is missing, and no more.
    """
    place = f"{path}, line {line}" if line else f"{path}"
    names = [name.strip().strip("\"'").strip() for name in names]
    found: list[Column] = []
    colour = _colour(names)
    sized = any(role in options.columns for role in ("radius", "diameter"))
    for role in wanted:
        if role in options.columns:
            found.append(_mapped(place, role, names, options.columns[role]))
        elif role in ("x", "y", "z") or not (sized or options.radius is not None):
            found += [
                Column(role, position, name, known[1])
                for position, name in enumerate(names)
                if (known := recognised(name)) and known[0] == role and position != colour
            ]
    sized_names = [name for position, name in enumerate(names) if position != colour]
    if colour is not None and options.radius is None and not roles(sized_names, options) & {"radius", "diameter"}:
        if names[colour] not in options.columns.values():
            raise InputError(
                f"{place}: {quoted(names[colour])} beside columns g and b may be a colour or the radius. Map the "
                f'radius, as in columns = {{ radius = "{names[colour]}" }}, or give one radius of '
                "all spheres as radius, in m."
            )
    if options.radius is not None and (sizes := roles(sized_names, options) & {"radius", "diameter"}):
        warn_radius(place, f"the column of {' and '.join(sorted(sizes))}")
    mapped: dict[int, str] = {}
    for column in found:
        if column.role in options.columns:
            other = mapped.setdefault(column.position, column.role)
            if other != column.role:
                raise InputError(
                    f"{place}: columns maps {quoted(column.name)} to both {other} and {column.role}. Give "
                    "each a column of its own."
                )
    given = {column.role for column in found}
    missing = [role for role in ("x", "y", "z") if role in wanted and role not in given]
    if options.radius is None and not given & {"radius", "diameter"}:
        missing.append("radius (or diameter)")
    if missing == ["radius (or diameter)"]:
        missing_radius(place, f"the columns are {quoted(','.join(names))}, and ")
    if missing:
        raise InputError(
            f"{place}: the header {quoted(','.join(names))} lacks {', '.join(missing)}. Name the "
            "columns x, y, z and radius in the file, or map them: "
            'columns = { x = "...", y = "...", z = "...", radius = "..." }.'
        )
    return found


def _colour(names: Sequence[str]) -> int | None:
    """Position of a column r that may be the red of a colour: there are columns g and b, too."""
    lower = [name.lower() for name in names]
    return lower.index("r") if {"r", "g", "b"} <= set(lower) else None


def _mapped(place: str, role: str, names: list[str], wanted: str) -> Column:
    """The column that the user gives for a role."""
    places = [k for k, name in enumerate(names) if name == wanted.strip()]
    places = places or [k for k, name in enumerate(names) if name.lower() == wanted.strip().lower()]
    if len(places) != 1:
        how = "is no column" if not places else f"names {len(places)} columns"
        shown = ", ".join(map(quoted, names[:12])) + (", ..." if len(names) > 12 else "")
        raise InputError(f"{place}: {quoted(wanted)}, given for {role}, {how}. Columns: {shown}.")
    return Column(role, places[0], names[places[0]], _split_unit(names[places[0]])[1])


def positions(columns: Sequence[Column]) -> dict[str, int]:
    """Position of each column by a name for errors: its role, or its own name if the role has several."""
    found: dict[str, int] = {}
    for column in columns:
        name = column.role if column.role not in found else column.name
        found[name if name not in found else f"{name} (column {column.position + 1})"] = column.position
    return found


def spheres(
    place: str, columns: Sequence[Column], values: NDArray, options: ReadOptions
) -> tuple[NDArray, NDArray | None, LengthUnit | None, dict[str, str]]:
    """Centres (n, 3), radii (n,) or None, their unit, and the names of the columns that they are from.

    All are in the unit of x. Columns of the same meaning are compared, and the first of them is taken.

    Parameters
    ----------
    place : str
        The file and the line of the header.
    columns : sequence of Column
    values : (n, number of columns) array
    options : ReadOptions

    Raises
    ------
    InputError
        If units are not known, or columns disagree.
    """
    unit = _unit(place, columns, options)
    sizes = [metres(column.unit) for column in columns]
    factors = [size / sizes[0] if unit and unit.metres and size and sizes[0] else 1.0 for size in sizes]
    found: dict[str, tuple[NDArray, str]] = {}
    for column, factor, column_values in zip(columns, factors, values.T, strict=True):
        role = "radius" if column.role == "diameter" else column.role
        factor /= 1 + (column.role == "diameter")
        with np.errstate(over="ignore"):
            numbers = column_values * factor if factor != 1.0 else column_values
        if role not in found:
            shown = f"{column.name} (halved)" if column.role == "diameter" else column.name
            found[role] = numbers, shown if factor not in (1.0,) or shown != role else role
            continue
        first, name = found[role]
        if not _agree(first, numbers):
            raise InputError(
                f"{place}: the columns {quoted(name.removesuffix(' (halved)'))} and {quoted(column.name)} disagree "
                f'about {role}. Say which to read, as in columns = {{ {column.role} = "{column.name}" }}.'
            )
    centres = np.column_stack([found[axis][0] for axis in "xyz"])
    radii = found["radius"][0] if "radius" in found else None
    return centres, radii, unit, {role: name for role, (_, name) in found.items()}


def units_below(place: str, columns: Sequence[Column], cells: Sequence[str]) -> list[Column] | None:
    """The columns with the units that a row under the header states; None if the row is none of units."""
    if any(column.position >= len(cells) for column in columns):
        return None
    units = [cells[column.position].strip().strip("[](){}<>\"'").strip() for column in columns]
    known = [metres(unit) is not None for unit in units]
    # Words that are no known units may be such, unless they are names, or say that a number is missing.
    words = all(_WORD.fullmatch(unit) and not recognised(unit) and unit.lower() not in _NO_NUMBERS for unit in units)
    if not all(known) and not (words and (any(known) or len(set(units)) == 1)):
        return None
    for column, unit in zip(columns, units, strict=True):
        if column.unit and metres(column.unit) != metres(unit):
            raise InputError(
                f"{place}: the unit under {quoted(column.name)} is {quoted(unit)}. Correct the name or the unit."
            )
    return [replace(column, unit=unit) for column, unit in zip(columns, units, strict=True)]


def _agree(first: NDArray, second: NDArray) -> bool:
    with np.errstate(invalid="ignore", over="ignore"):
        scale = np.abs(first).max()
        # Values that are not finite are refused by their line later.
        return bool(not np.isfinite(scale) or (np.abs(first - second) <= _ROUNDING * scale).all())


def _unit(place: str, columns: Sequence[Column], options: ReadOptions) -> LengthUnit | None:
    """The unit of the columns; None if they state none."""
    stated = {column.unit for column in columns}
    if stated == {""}:
        return None
    if "" in stated and options.scale is None:
        without = next(column for column in columns if not column.unit)
        with_unit = next(column for column in columns if column.unit)
        raise InputError(
            f"{place}: {quoted(with_unit.name)} states a unit, and {quoted(without.name)} states none. Give the length "
            "of the unit of all columns in m as scale."
        )
    unknown = sorted(unit for unit in stated if unit and metres(unit) is None)
    if unknown or "" in stated:
        if len(stated) > 1 and len(stated - {""}) > 1:
            raise InputError(
                f"{place}: the columns have different units ({', '.join(sorted(stated))}), not all known. Write all "
                "lengths in one unit."
            )
        return LengthUnit(next(iter(unknown), next(iter(stated - {""}))), None, place)
    name = "columns' units (" + ", ".join(sorted(stated)) + ")" if len(stated) > 1 else next(iter(stated))
    return LengthUnit(name, metres(columns[0].unit), place)
