"""LAMMPS and LIGGGHTS: data files of atom_style sphere (granular), and text dumps.

Spheres are sorted by atom id where there are ids: LAMMPS writes atoms in an order that changes from step to step.
A dump may hold several frames. The units come from ``ITEM: UNITS`` of a dump, or ``units = cgs`` in the title of a
data file.
"""

from __future__ import annotations

import re
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from porefv.errors import InputError
from porefv.packing.files.column_names import Column, chosen_columns, positions, recognised, spheres
from porefv.packing.files.content import FileContent, LengthUnit, periodicity, tilted
from porefv.packing.files.frames import chosen_frame, warn_cut_off, warn_no_end
from porefv.packing.files.length_units import agreed_unit, metres, stated_unit
from porefv.packing.files.options import ReadOptions
from porefv.packing.files.text import AnyPath, Corners, Rows, quoted, text_lines

# Unit of length, and its size in m, by the name of LAMMPS's system of units.
UNITS = {
    "si": ("m", 1.0), "cgs": ("cm", 1e-2), "micro": ("µm", 1e-6), "nano": ("nm", 1e-9), "metal": ("Å", 1e-10),
    "real": ("Å", 1e-10), "electron": ("Bohr", 5.29177210903e-11), "lj": ("sigma", None),
}  # fmt: skip

_STYLES = ("", "sphere", "granular")  # what may follow "Atoms #" in a data file

# What a frame of a dump must hold; the first that occurs in a line names the item.
_ITEMS = ("NUMBER OF ATOMS", "BOX BOUNDS", "ATOMS")

# Units in a title: "units = cgs", "units cgs", "unit: cgs", or "cgs units".
_SYSTEM = "|".join(UNITS)
_UNITS_IN_WORDS = re.compile(rf"(?i:\bunits?\s*[:=]?\s*({_SYSTEM})\b|\b({_SYSTEM})\s+units?\b)")
_UNITS_KEY = re.compile(r"\bunits\s*=\s*(\w+)")  # as LAMMPS writes it

_FLAGS = ("ix", "iy", "iz")

_COUNT = re.compile("[0-9]{1,15}")

# Names of a coordinate in a dump: plain, unwrapped; scaled by the box, scaled and unwrapped.
_PLAIN, _SCALED = ("{}", "{}u"), ("{}s", "{}su")


def read(path: AnyPath, content: bytes, options: ReadOptions) -> FileContent:
    """Read a data file or a dump, told apart by their content; errors name the file and the line."""
    lines = text_lines(path, content)
    first = next((line for line in lines if line.strip()), "")
    return _read_dump(path, lines, options) if first.startswith("ITEM:") else _read_data(path, lines, options)


def _unit(path: AnyPath, line: int, name: str) -> LengthUnit:
    unit, size = UNITS.get(name, ("", metres(name)))
    return LengthUnit(f"{name} ({unit})" if unit and size is not None else name, size, f"{path}, line {line}")


def _title_unit(path: AnyPath, title: str) -> LengthUnit | None:
    """The unit that the title of a data file, its first line, states."""
    if match := _UNITS_IN_WORDS.search(title):
        return _unit(path, 1, (match[1] or match[2]).lower())
    if match := _UNITS_KEY.search(title):
        return _unit(path, 1, match[1])
    return stated_unit(f"{path}, line 1", title)


def _crossed(path: AnyPath, line: int, flags: NDArray, options: ReadOptions) -> str:
    """What is said of image flags other than 0: an atom has one once it has crossed a periodic boundary."""
    axes = "".join(axis for axis, flag in zip("xyz", flags.T, strict=False) if flag.any())
    if axes and options.periodic == "cell":
        return f"periodic by image flags along {', '.join(axes)} that are not 0, read into a periodic cell"
    return periodicity(f"{path}, line {line}", axes, "image flags that are not 0", options)


def _read_data(path: AnyPath, lines: list[str], options: ReadOptions) -> FileContent:
    texts = [line.partition("#")[0].strip() for line in lines]
    try:
        start = texts.index("Atoms", 1)
    except ValueError:
        raise InputError(f"{path}: not a LAMMPS data file (no 'Atoms') or dump (no 'ITEM:').") from None
    style = lines[start].partition("#")[2].strip()
    if style not in _STYLES:
        raise InputError(f"{path}, line {start + 1}: atom_style {quoted(style)} is not read. Use sphere.")
    chosen_frame(path, 1, options)
    if options.columns or options.radius is not None:
        raise InputError(f"{path}: a LAMMPS data file has columns of its own. Drop columns and radius.")
    if not style and "Masses" in texts:
        raise InputError(
            f"{path}, line {start + 1}: no atom_style stands after Atoms, and with Masses it is not sphere, in which "
            "each atom has a density. If it is, write 'Atoms # sphere'."
        )
    number, corners, lattice = _data_header(path, texts[1:start], options)
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
    columns = {"id": 0, "x": 4, "y": 5, "z": 6, "diameter": 2, "density": 3}
    columns |= dict(zip(_FLAGS, range(7, cells), strict=False))
    values, numbers = rows.columns(columns, cells)
    if not style and not (values[:, 5] > 0).all():
        raise InputError(
            f"{path}, line {numbers[np.argmin(values[:, 5])]}: no atom_style stands after Atoms, and the density of "
            "atom_style sphere, the fourth cell, is not positive. If it is this style, write 'Atoms # sphere'."
        )
    said = _crossed(path, start + 1, values[:, 6:], options)
    order = _by_id(path, values[:, 0], numbers)
    values = values[order]
    notes = () if style else ("no style after Atoms, read as atom_style sphere",)
    if cells == 7 and numbers[-1] == len(lines):
        notes = (*notes, warn_no_end(f"{path}, line {len(lines)}"))
    return FileContent(
        "LAMMPS data file, atom_style sphere", values[:, 1:4], values[:, 4] / 2, corners, "xlo xhi, ylo yhi, zlo zhi",
        _title_unit(path, lines[0]), numbers[order],
        {"x": "x", "y": "y", "z": "z", "radius": "diameter (halved)"}, periodicity=said, notes=notes, lattice=lattice,
    )  # fmt: skip


def _data_header(path: AnyPath, texts: list[str], options: ReadOptions) -> tuple[int, Corners | None, NDArray | None]:
    """Number of atoms, corners of the box, and the vectors of a tilted periodic cell."""
    number, bounds = None, {}
    tilts = [0.0, 0.0, 0.0]
    for line, text in enumerate(texts, 2):
        words = text.split()
        if words[1:] == ["atoms"] and _COUNT.fullmatch(words[0]):
            number = int(words[0])
        elif match := re.fullmatch(r"(\S+)\s+(\S+)\s+([xyz])lo\s+\3hi", text):
            bounds[match[3]] = _numbers(path, line, match[1], match[2])
        elif words[3:] == ["xy", "xz", "yz"]:
            tilts = _numbers(path, line, *words[:3])
            if any(tilts) and options.periodic != "cell":
                raise tilted(f"{path}, line {line}")
    if number is None:
        raise InputError(f"{path}: the header has no line like '100 atoms'.")
    if set(bounds) != set("xyz"):
        return number, None, None
    lower, upper = zip(*(bounds[axis] for axis in "xyz"), strict=True)
    corners = np.array(lower), np.array(upper)
    return number, corners, _lattice(corners, tilts) if any(tilts) else None


def _lattice(corners: Corners, tilts: list[float]) -> NDArray:
    """(3, 3): lattice vectors of a tilted box with the tilts xy, xz, yz."""
    x, y, z = corners[1] - corners[0]
    xy, xz, yz = tilts
    return np.array([[x, 0.0, 0.0], [xy, y, 0.0], [xz, yz, z]])


# ---- dumps -------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class _Frame:
    """Lines of the items of a frame, counted from 0, and the line after its last."""

    items: dict[str, int]
    end: int
    unit: LengthUnit | None

    @property
    def missing(self) -> str | None:
        """The first item that the frame lacks."""
        return next((item for item in _ITEMS if item not in self.items), None)


def _read_dump(path: AnyPath, lines: list[str], options: ReadOptions) -> FileContent:
    frames = _frames(path, lines)
    notes: tuple[str, ...] = ()
    if len(frames) > 1 and _cut_off(lines, frames[-1]):
        notes = (warn_cut_off(f"{path}, line {len(lines)}", len(frames) - 1),)
        del frames[-1]
    chosen = chosen_frame(path, len(frames), options)
    frame = frames[chosen]
    if frame.missing:
        which = "the last frame" if chosen == len(frames) - 1 else f"frame {chosen}"
        raise InputError(f"{path}: {which} lacks ITEM: {frame.missing}. Was the file cut off?")
    corners, axes, lattice = _dump_box(path, lines, frame.items["BOX BOUNDS"], options)
    line = frame.items["BOX BOUNDS"] + 1
    said = periodicity(f"{path}, line {line}", axes, lines[line - 1].removeprefix("ITEM:").strip(), options)
    start = frame.items["ATOMS"]
    rows = Rows(path, lines[start + 1 : frame.end], first=start + 2)
    declared = _declared(path, lines, frame)
    if declared == 0:
        choice = " Choose another as frame." if len(frames) > 1 else ""
        raise InputError(
            f"{path}, line {frame.items['NUMBER OF ATOMS'] + 2}: frame {chosen} of {len(frames)} (from 0) has no atoms."
            f"{choice}"
        )
    _check_number(path, declared, len(rows.texts), rows.numbers[-1] if rows.numbers else start + 1)
    names = lines[start].split()[2:]
    columns, scaled = _dump_columns(path, start + 1, names, options)
    wanted = positions(columns)
    if rows.numbers[-1] == len(lines) and len(names) - 1 in wanted.values():
        notes = (*notes, warn_no_end(f"{path}, line {len(lines)}"))
    wanted |= {f"image flag {name}": names.index(name) for name in _FLAGS if set(_FLAGS) <= set(names)}
    if "id" in names:
        wanted["atom id"] = names.index("id")
    values, numbers = rows.columns(wanted, len(names))
    if "id" in names:
        order = _by_id(path, values[:, -1], numbers)
        values, numbers = values[order, :-1], numbers[order]
    values, flags = np.split(values, [len(columns)], axis=1)
    said = said or _crossed(path, start + 1, flags, options)
    if scaled and lattice is not None and len(scaled) < 3:
        raise InputError(f"{path}, line {start + 1}: all of xs ys zs are needed in a tilted box, or none.")
    with np.errstate(over="ignore", invalid="ignore"):
        vectors = np.diag(corners[1] - corners[0]) if lattice is None else lattice
        places, own = list(scaled), list(scaled.values())
        values[:, places] = corners[0][own] + values[:, places] @ vectors[np.ix_(own, own)]
    centres, radii, unit, shown = spheres(f"{path}, line {start + 1}", columns, values, options)
    return FileContent(
        "LAMMPS dump", centres, radii, corners, "BOX BOUNDS", agreed_unit(unit, frame.unit, options), numbers, shown,
        chosen, len(frames), said, notes, lattice=lattice,
    )  # fmt: skip


def _frames(path: AnyPath, lines: list[str]) -> list[_Frame]:
    """Frames, in the order of the file; a TIMESTEP, or the UNITS and the TIME before it, begins one."""
    frames: list[_Frame] = []
    items: dict[str, int] = {}
    unit = None
    last = len(lines) - 1
    cut = bool(lines[last]) and ("ITEM:".startswith(lines[last]) or lines[last].startswith("ITEM:"))
    for position in [k for k, line in enumerate(lines) if line.startswith("ITEM:") or (cut and k == last)]:
        line = lines[position]
        name = next((item for item in _ITEMS if item in line), line.removeprefix("ITEM:").strip())
        if name in items or (
            "ATOMS" in items and (name in ("UNITS", "TIME", "TIMESTEP") or (cut and position == last))
        ):
            frames.append(_Frame(items, position, unit))
            items = {}
        if name == "UNITS":
            stated = lines[position + 1].strip() if position + 1 < len(lines) else ""
            unit = _unit(path, position + 2, stated)
        items[name] = position
    return [*frames, _Frame(items, len(lines), unit)]


def _cut_off(lines: list[str], frame: _Frame) -> bool:
    """Whether the last frame of a file is not whole."""
    if frame.missing:
        return True
    start, declared = frame.items["ATOMS"], frame.items["NUMBER OF ATOMS"] + 1
    number = lines[declared].strip() if declared < len(lines) else ""
    rows = [line for line in lines[start + 1 : frame.end] if line.strip()]
    if not _COUNT.fullmatch(number) or int(number) < len(rows):
        return False  # wrong in another way, which is an error
    # LAMMPS ends each line: without an end, the last number may have lost digits.
    return int(number) > len(rows) or bool(lines[-1])


def _declared(path: AnyPath, lines: list[str], frame: _Frame) -> int:
    position = frame.items["NUMBER OF ATOMS"] + 1
    number = lines[position].strip() if position < len(lines) else ""
    if not _COUNT.fullmatch(number):
        raise InputError(f"{path}, line {position + 1}: {quoted(number)} is not a number of atoms.")
    return int(number)


def _dump_box(path: AnyPath, lines: list[str], start: int, options: ReadOptions) -> tuple[Corners, str, NDArray | None]:
    """Corners of the box, the axes along which it is periodic, and the vectors of a tilted periodic cell."""
    words = lines[start].removeprefix("ITEM: BOX BOUNDS").split()
    if "abc" in words:
        raise InputError(f"{path}, line {start + 1}: the box is tilted by three free vectors; only tilts are read.")
    with_tilts = "xy" in words
    bounds, tilts = [], []
    for position in range(start + 1, start + 4):
        cells = lines[position].split() if position < len(lines) else []
        if len(cells) != 2 + with_tilts:
            count = "three numbers, lower, upper and tilt" if with_tilts else "two numbers, lower and upper"
            raise InputError(f"{path}, line {position + 1}: {count}, are expected.")
        found = _numbers(path, position + 1, *cells)
        if with_tilts and found[2] != 0 and options.periodic != "cell":
            raise tilted(f"{path}, line {position + 1}")
        bounds.append(found[:2])
        tilts += found[2:]
    flags = [word for word in words if re.fullmatch("[pfsm]{2}", word)]
    axes = "".join(axis for axis, flag in zip("xyz", flags, strict=False) if "p" in flag)
    lower, upper = zip(*bounds, strict=True)
    corners = np.array(lower), np.array(upper)
    if not any(tilts):
        return corners, axes, None
    # LAMMPS gives the bounds of what the tilted box spans: they are further out than its own by what it leans over.
    xy, xz, yz = tilts
    corners[0][:2] -= min(0.0, xy, xz, xy + xz), min(0.0, yz)
    corners[1][:2] -= max(0.0, xy, xz, xy + xz), max(0.0, yz)
    return corners, axes, _lattice(corners, tilts)


def _dump_columns(
    path: AnyPath, line: int, names: list[str], options: ReadOptions
) -> tuple[list[Column], dict[int, int]]:
    """The columns to read, and the axis of each that is scaled by the box."""
    patterns = next(
        (pattern for pattern in _PLAIN + _SCALED if all(pattern.format(axis) in names for axis in "xyz")), None
    )
    coordinates = [options.columns.get(axis) or (patterns.format(axis) if patterns else None) for axis in "xyz"]
    sizes = {known[0] for name in names if (known := recognised(name))} & {"radius", "diameter"}
    sized = bool(sizes) or options.radius is not None or options.columns.keys() & {"radius", "diameter"}
    missing = ["x y z (or xu, xs, xsu)"] * (None in coordinates) + ["radius (or diameter)"] * (not sized)
    if missing:
        raise InputError(
            f"{path}, line {line}: the columns {quoted(' '.join(names))} lack {' and '.join(missing)}. In LAMMPS: "
            'dump 1 all custom 1000 packing.dump id x y z radius. Or map them: columns = { radius = "..." }, or give '
            "one radius of all spheres as radius, in m."
        )
    mapped = dict(zip("xyz", map(str, coordinates), strict=True)) | dict(options.columns)
    columns = chosen_columns(
        path, line, names, ReadOptions(mapped, options.radius, options.scale, options.frame, options.periodic)
    )
    patterned = {pattern.format(axis): k for pattern in _SCALED for k, axis in enumerate("xyz")}
    return columns, {k: patterned[column.name] for k, column in enumerate(columns) if column.name in patterned}


# ---- both --------------------------------------------------------------------------------------------------


def _numbers(path: AnyPath, line: int, *words: str) -> list[float]:
    try:
        return [float(word) for word in words]
    except ValueError:
        count = {2: "two", 3: "three"}[len(words)]
        raise InputError(f"{path}, line {line}: {quoted(' '.join(words))} are not {count} numbers.") from None


def _check_number(path: AnyPath, declared: int, found: int, last_line: int) -> None:
    if declared != found or found == 0:
        raise InputError(f"{path}, line {last_line}: {declared} atoms declared, {found} given. Was the file cut off?")


def _by_id(path: AnyPath, ids: NDArray, lines: NDArray) -> NDArray:
    """The order of the rows by atom id."""
    odd = np.flatnonzero(~((ids >= 0) & (ids < 2**53) & (np.trunc(ids) == ids)))
    if len(odd):
        raise InputError(f"{path}, line {lines[odd[0]]}: atom id {ids[odd[0]]:g} is not a whole number.")
    order = np.argsort(ids, kind="stable")
    twice = np.flatnonzero(ids[order][1:] == ids[order][:-1])
    if len(twice):
        first, second = order[twice[0]], order[twice[0] + 1]
        raise InputError(
            f"{path}, line {lines[second]}: atom id {ids[second]:.0f} stands on line {lines[first]} already."
        )
    return order
