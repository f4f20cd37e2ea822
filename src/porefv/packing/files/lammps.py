"""LAMMPS: data files of atom_style sphere, and text dumps. Units are taken as SI (LAMMPS's ``units si``).

Spheres are sorted by atom id: LAMMPS writes atoms in an order that changes from step to step. Of a dump with
several frames the last is read. Periodic boundaries are not known here: the box has six walls.
"""

import re

import numpy as np
from numpy.typing import NDArray

from porefv.errors import InputError
from porefv.packing.box import Box
from porefv.packing.files.text import AnyPath, Rows, make_box, quoted, read_lines
from porefv.packing.packing import Packing, Source

_STYLES = ("", "sphere")  # what may follow "Atoms #" in a data file

# What a frame of a dump must hold; the first that occurs in a line names the item.
_ITEMS = ("NUMBER OF ATOMS", "BOX BOUNDS", "ATOMS")

_COUNT = re.compile("[0-9]{1,15}")

# Names of a coordinate in a dump: plain, unwrapped; scaled by the box, scaled and unwrapped.
_PLAIN, _SCALED = ("{}", "{}u"), ("{}s", "{}su")


def read(path: AnyPath) -> Packing:
    """Read a data file or a dump, told apart by their content; errors name the file and the line."""
    lines = read_lines(path)
    first = next((line for line in lines if line.strip()), "")
    return _read_dump(path, lines) if first.startswith("ITEM:") else _read_data(path, lines)


def _read_data(path: AnyPath, lines: list[str]) -> Packing:
    texts = [line.partition("#")[0].strip() for line in lines]
    try:
        start = texts.index("Atoms", 1)
    except ValueError:
        raise InputError(f"{path}: not a LAMMPS data file (no 'Atoms') or dump (no 'ITEM:').") from None
    style = lines[start].partition("#")[2].strip()
    if style not in _STYLES:
        raise InputError(f"{path}, line {start + 1}: atom_style {quoted(style)} is not read. Use sphere.")
    # Line 1 is a title that LAMMPS ignores, whatever it says.
    number, box = _data_header(path, texts[1:start])
    rows = Rows(path, texts[start + 1 :], first=start + 2)
    end = next((k for k, text in enumerate(rows.texts) if text[0].isalpha()), len(rows.texts))
    _check_number(path, number, end, rows.numbers[end - 1] if end else start + 1)
    del rows.texts[end:], rows.numbers[end:]
    cells = len(rows.texts[0].split())
    if cells not in (7, 10):
        raise InputError(
            f"{path}, line {rows.numbers[0]}: {cells} cells where atom_style sphere has 7 (id type diameter "
            "density x y z), or 10 with image flags."
        )
    values, numbers = rows.columns({"id": 0, "x": 4, "y": 5, "z": 6, "diameter": 2}, cells)
    values[:, 4] /= 2
    return _packing(path, values, numbers, box)


def _data_header(path: AnyPath, texts: list[str]) -> tuple[int, Box | None]:
    """Number of atoms and box."""
    number, bounds = None, {}
    for line, text in enumerate(texts, 2):
        words = text.split()
        if words[1:] == ["atoms"] and _COUNT.fullmatch(words[0]):
            number = int(words[0])
        elif match := re.fullmatch(r"(\S+)\s+(\S+)\s+([xyz])lo\s+\3hi", text):
            bounds[match[3]] = _bounds(path, line, match[1], match[2])
        elif words[3:] == ["xy", "xz", "yz"]:
            raise InputError(f"{path}, line {line}: the box is tilted; only axis-aligned boxes are read.")
    if number is None:
        raise InputError(f"{path}: the header has no line like '100 atoms'.")
    if set(bounds) != set("xyz"):
        return number, None
    return number, make_box(path, *zip(*(bounds[axis] for axis in "xyz"), strict=True))


def _read_dump(path: AnyPath, lines: list[str]) -> Packing:
    items: dict[str, int] = {}
    for position, line in enumerate(lines):
        if line.startswith("ITEM: TIMESTEP"):
            items = {}
        if line.startswith("ITEM:"):
            items[next((item for item in _ITEMS if item in line), line)] = position
    missing = [item for item in _ITEMS if item not in items]
    if missing:
        raise InputError(f"{path}: the last frame lacks ITEM: {missing[0]}. Was the file cut off?")
    box = _dump_box(path, lines, items["BOX BOUNDS"])
    start = items["ATOMS"]
    rows = Rows(path, lines[start + 1 :], first=start + 2)
    declared = items["NUMBER OF ATOMS"] + 1
    number = lines[declared].strip() if declared < len(lines) else ""
    if not _COUNT.fullmatch(number):
        raise InputError(f"{path}, line {declared + 1}: {quoted(number)} is not a number of atoms.")
    _check_number(path, int(number), len(rows.texts), rows.numbers[-1] if rows.numbers else start + 1)
    columns, scaled, diameters = _dump_columns(path, start + 1, lines[start].split()[2:])
    values, numbers = rows.columns(columns, len(lines[start].split()) - 2)
    if scaled:
        values[:, 1:4] = box.lower + values[:, 1:4] * box.size
    if diameters:
        values[:, 4] /= 2
    return _packing(path, values, numbers, box)


def _dump_box(path: AnyPath, lines: list[str], start: int) -> Box:
    if "xy" in lines[start] or "abc" in lines[start]:
        raise InputError(f"{path}, line {start + 1}: the box is tilted; only axis-aligned boxes are read.")
    bounds = []
    for position in range(start + 1, start + 4):
        words = lines[position].split() if position < len(lines) else []
        if len(words) != 2:
            raise InputError(f"{path}, line {position + 1}: two numbers, lower and upper, are expected.")
        bounds.append(_bounds(path, position + 1, *words))
    return make_box(path, *zip(*bounds, strict=True))


def _dump_columns(path: AnyPath, line: int, names: list[str]) -> tuple[dict[str, int], bool, bool]:
    """Positions of id, x, y, z and radius; whether coordinates are scaled; whether radii are diameters."""
    coordinates = next(
        (
            [pattern.format(axis) for axis in "xyz"]
            for pattern in _PLAIN + _SCALED
            if all(pattern.format(axis) in names for axis in "xyz")
        ),
        None,
    )
    size = next((name for name in ("radius", "diameter") if name in names), None)
    if coordinates is None or size is None or "id" not in names:
        raise InputError(
            f"{path}, line {line}: the columns {quoted(' '.join(names))} lack one of id; x y z (or xu, xs, "
            "xsu); radius or diameter. In LAMMPS: dump 1 all custom 1000 packing.dump id x y z radius"
        )
    scaled = coordinates[0] in [pattern.format("x") for pattern in _SCALED]
    columns = {name: names.index(name) for name in ("id", *coordinates, size)}
    return columns, scaled, size == "diameter"


def _bounds(path: AnyPath, line: int, lower: str, upper: str) -> tuple[float, float]:
    try:
        return float(lower), float(upper)
    except ValueError:
        raise InputError(f"{path}, line {line}: {quoted(f'{lower} {upper}')} are not two numbers.") from None


def _check_number(path: AnyPath, declared: int, found: int, last_line: int) -> None:
    if declared != found or found == 0:
        raise InputError(f"{path}, line {last_line}: {declared} atoms declared, {found} given. Was the file cut off?")


def _packing(path: AnyPath, values: NDArray, lines: NDArray, box: Box | None) -> Packing:
    """Packing from rows id, x, y, z, radius."""
    odd = np.flatnonzero(~((values[:, 0] >= 0) & (values[:, 0] < 2**53) & (values[:, 0] % 1 == 0)))
    if len(odd):
        raise InputError(f"{path}, line {lines[odd[0]]}: atom id {values[odd[0], 0]:g} is not a whole number.")
    order = np.argsort(values[:, 0], kind="stable")
    values, lines = values[order], lines[order]
    twice = np.flatnonzero(values[1:, 0] == values[:-1, 0])
    if len(twice):
        k = twice[0]
        raise InputError(f"{path}, line {lines[k + 1]}: atom id {values[k, 0]:.0f} stands on line {lines[k]} already.")
    return Packing(values[:, 1:4], values[:, 4], box, Source(path, lines))
