"""Extended XYZ, as OVITO and ASE write it: frames of a line with N, a line of keys, and N lines.

``Properties=species:S:1:pos:R:3:radius:R:1`` names the columns, ``Lattice="..."`` gives the box from ``Origin="..."``
or the origin, and ``pbc="T T F"`` says along which axes it is periodic. Without pbc, a box is periodic along all axes,
as ASE reads it.
"""

from __future__ import annotations

import re

import numpy as np
from numpy.typing import NDArray

from porefv.errors import InputError
from porefv.packing.files.column_names import chosen_columns, positions, spheres
from porefv.packing.files.content import FileContent, LengthUnit, periodicity, tilted
from porefv.packing.files.frames import chosen_frame, warn_cut_off, warn_no_end
from porefv.packing.files.length_units import agreed_unit, first_clear, stated_unit
from porefv.packing.files.options import ReadOptions
from porefv.packing.files.periodic_words import periodic_axes, stated_axes
from porefv.packing.files.text import AnyPath, Corners, Rows, quoted, text_lines

_COUNT = re.compile("[0-9]{1,15}")
_KEYS = re.compile(r"(\w+)\s*=\s*(?:\"([^\"]*)\"|'([^']*)'|(\[[^\]]*\]|\S+))")
_UNIT_KEY = re.compile(r"(?:(?:length|distance)_?units?|units?_?(?:of_?)?lengths?|units?)")
_PERIODIC_KEY = re.compile(r"pbcs?|periodic(?:ity)?|boundary|boundaries|bcs?|(?:boundary|periodic)_?conditions?")
_OWN_KEYS = ("properties", "lattice", "origin")


def read(path: AnyPath, content: bytes, options: ReadOptions) -> FileContent:
    """Read a frame; errors name the file and the line."""
    lines = text_lines(path, content)
    starts, sizes, notes = _frames(path, lines)
    chosen = chosen_frame(path, len(starts), options)
    start, size = starts[chosen], sizes[chosen]
    keys = {match[1].lower(): match[2] or match[3] or match[4] or "" for match in _KEYS.finditer(lines[start + 1])}
    others = _KEYS.sub(" ", lines[start + 1]).strip()
    place = f"{path}, line {start + 2}"
    names = _names(place, keys, lines[start + 2])
    columns = chosen_columns(path, start + 2, names, options)
    rows = Rows(path, lines[start + 2 : start + 2 + size], first=start + 3)
    if len(rows.texts) != size:
        raise InputError(
            f"{path}, line {start + 1}: {size} spheres declared, and a line among them is blank or a comment."
        )
    values, numbers = rows.columns(positions(columns), len(names))
    centres, radii, unit, shown = spheres(place, columns, values, options)
    unit = agreed_unit(unit, _unit(place, keys, others, options), options)
    if numbers[-1] == len(lines) and any(column.position == len(names) - 1 for column in columns):
        notes = (*notes, warn_no_end(f"{path}, line {len(lines)}"))
    said = _periodicity(place, keys, others, options)
    corners, lattice = _cell(place, keys, options)
    return FileContent(
        "extended XYZ", centres, radii, corners, "Lattice", unit, numbers, shown, chosen, len(starts), said, notes,
        lattice=lattice,
    )  # fmt: skip


def _unit(place: str, keys: dict[str, str], others: str, options: ReadOptions) -> LengthUnit | None:
    """The unit that a key states, or the text between the keys."""
    stated: list[LengthUnit | None] = [stated_unit(place, others)]
    for key, value in keys.items():
        if _UNIT_KEY.fullmatch(key):
            stated.append(stated_unit(place, f"units = {value}") or LengthUnit(value, None, place))
        elif key not in _OWN_KEYS:
            stated.append(stated_unit(place, f"{key} = {value}"))
    return first_clear([unit for unit in stated if unit is not None], options)


def _periodicity(place: str, keys: dict[str, str], others: str, options: ReadOptions) -> str:
    stated = {key: value for key, value in keys.items() if _PERIODIC_KEY.fullmatch(key)}
    for key, value in stated.items():
        if (axes := periodic_axes(value)) is None:
            raise InputError(
                f'{place}: {key}={quoted(value)} is not understood. Write pbc="F F F" for a box with walls, or T for '
                "each axis along which it is periodic."
            )
        if axes:
            return periodicity(place, axes, f'{key}="{value[:20]}"', options)
    if axes := stated_axes(others):
        return periodicity(place, axes, quoted(others), options)
    if "lattice" in keys and not stated:
        return periodicity(place, "xyz", 'Lattice without pbc, which stands for pbc="T T T"', options)
    return ""


def _frames(path: AnyPath, lines: list[str]) -> tuple[list[int], list[int], tuple[str, ...]]:
    """Line of the number of each whole frame, counted from 0; number of its spheres; and what is to be noted."""
    starts: list[int] = []
    sizes: list[int] = []
    position, total = 0, len(lines) - (not lines[-1])
    while position < total:
        number = lines[position].strip()
        if not number and not any(line.strip() for line in lines[position:]):
            break
        if not _COUNT.fullmatch(number):
            raise InputError(f"{path}, line {position + 1}: {quoted(number)} is not a number of spheres.")
        after = position + 2 + int(number)
        if starts and (after > total or (after == total and lines[-1])):
            return starts, sizes, (warn_cut_off(f"{path}, line {total}", len(starts)),)
        if after > total or int(number) == 0:
            given = max(total - position - 2, 0)
            raise InputError(
                f"{path}, line {position + 1}: {number} spheres declared, {given} given. Was the file cut off?"
            )
        starts.append(position)
        sizes.append(int(number))
        position = after
    return starts, sizes, ()


def _names(place: str, keys: dict[str, str], row: str) -> list[str]:
    """Names of the columns; without Properties: the species, x, y, z, and others by their place."""
    if "properties" not in keys:
        cells = len(row.split())
        return ["species", "x", "y", "z", *(str(k + 1) for k in range(4, cells))][:cells]
    parts = keys["properties"].split(":")
    names: list[str] = []
    for name, count in zip(parts[0::3], parts[2::3], strict=False):
        if len(parts) % 3 or not (count.isascii() and count.isdigit() and 1 <= int(count[:4]) <= 100):
            raise InputError(f"{place}: Properties must be name:type:count groups, not {quoted(keys['properties'])}.")
        if int(count[:4]) == 1:
            names.append(name)
        elif name.lower() in ("pos", "position") and count == "3":
            names += ["x", "y", "z"]
        else:
            names += [f"{name}:{k}" for k in range(int(count[:4]))]
    return names


def _cell(place: str, keys: dict[str, str], options: ReadOptions) -> tuple[Corners | None, NDArray | None]:
    """Corners of the box, and the vectors of a tilted periodic cell."""
    if "lattice" not in keys:
        return None, None
    try:
        lattice = np.array(keys["lattice"].split(), dtype=np.float64).reshape(3, 3)
        origin = np.array(keys.get("origin", "0 0 0").split(), dtype=np.float64).reshape(3)
    except ValueError:
        raise InputError(f"{place}: Lattice must be nine numbers, and Origin three.") from None
    with np.errstate(over="ignore", invalid="ignore"):  # what is not finite is refused later
        corners = origin, origin + np.diagonal(lattice)
    if not np.count_nonzero(lattice - np.diag(np.diagonal(lattice))):
        return corners, None
    if options.periodic != "cell":
        raise tilted(place)
    return corners, lattice
