"""MercuryDPM .data: frames of a line ``N t xmin ymin zmin xmax ymax zmax`` and N lines ``x y z vx vy vz r ...``."""

from __future__ import annotations

import re

import numpy as np

from porefv.errors import InputError
from porefv.packing.files.content import FileContent, warn_radius
from porefv.packing.files.frames import chosen_frame, warn_cut_off
from porefv.packing.files.options import ReadOptions
from porefv.packing.files.text import AnyPath, Rows, quoted, text_lines

_COUNT = re.compile("[0-9]{1,15}")
_HEADER, _ROW = 8, 14  # cells


def is_mercury(first: list[str], second: list[str]) -> bool:
    """Whether the cells of the first two lines are those of a MercuryDPM file, of two or three dimensions."""
    return len(first) in (6, _HEADER) and _COUNT.fullmatch(first[0]) is not None and len(second) in (8, _ROW)


def read(path: AnyPath, content: bytes, options: ReadOptions) -> FileContent:
    """Read a frame; errors name the file and the line."""
    lines = text_lines(path, content)
    rows = Rows(path, lines)
    starts, sizes, notes = _frames(path, rows, whole_lines=not lines[-1])
    chosen = chosen_frame(path, len(starts), options)
    start, size = starts[chosen], sizes[chosen]
    line, header = rows.numbers[start], rows.texts[start].split()
    try:
        corners = np.array(header[2:], dtype=np.float64).reshape(2, 3)
    except ValueError:
        raise InputError(f"{path}, line {line}: {quoted(rows.texts[start])} has a word that is no number.") from None
    del rows.texts[start + size + 1 :], rows.numbers[start + size + 1 :]
    if size == 0:
        raise InputError(f"{path}, line {line}: frame {chosen} has no spheres. Choose another as frame.")
    cells = len(rows.texts[start + 1].split())
    if cells < 7 or options.columns:
        what = "fewer than 7 cells: x y z vx vy vz radius" if cells < 7 else "columns of its own. Drop columns"
        raise InputError(f"{path}, line {line + 1}: a MercuryDPM file of three dimensions has {what}.")
    if options.radius is not None:
        warn_radius(path, "the radii of the file")
    columns = {"x": 0, "y": 1, "z": 2} | ({"radius": 6} if options.radius is None else {})
    values, numbers = rows.columns(columns, cells, skip=start + 1)
    return FileContent(
        "MercuryDPM data", values[:, :3], values[:, 3] if options.radius is None else None, (corners[0], corners[1]),
        f"line {line}", None, numbers, {name: name for name in columns}, chosen, len(starts), "", notes,
    )  # fmt: skip


def _frames(path: AnyPath, rows: Rows, whole_lines: bool) -> tuple[list[int], list[int], tuple[str, ...]]:
    """Row of the header of each whole frame, number of its spheres, and what is to be noted."""
    starts: list[int] = []
    sizes: list[int] = []
    row, total = 0, len(rows.texts)
    while row < total:
        words = rows.texts[row].split()
        if len(words) == 6 and _COUNT.fullmatch(words[0]):
            raise InputError(f"{path}, line {rows.numbers[row]}: the file is of two dimensions. Only spheres are read.")
        if starts and len(words) > _HEADER:
            raise InputError(
                f"{path}, line {rows.numbers[row]}: a row of a sphere where the frame ends. Its header, line "
                f"{rows.numbers[starts[-1]]}, declares {sizes[-1]} spheres. Correct this number, or remove the row."
            )
        last = row == total - 1 and bool(starts)
        if not last and (len(words) != _HEADER or not _COUNT.fullmatch(words[0])):
            raise InputError(
                f"{path}, line {rows.numbers[row]}: {quoted(rows.texts[row])} is not the header of a frame, "
                "N t xmin ymin zmin xmax ymax zmax."
            )
        size = int(words[0]) if _COUNT.fullmatch(words[0]) else 0
        after = row + 1 + size
        if starts and (after > total or (after == total and not whole_lines) or len(words) != _HEADER):
            return starts, sizes, (warn_cut_off(f"{path}, line {rows.numbers[-1]}", len(starts)),)
        if after > total:
            raise InputError(
                f"{path}, line {rows.numbers[-1]}: {size} spheres declared, {total - row - 1} given. "
                "Was the file cut off?"
            )
        starts.append(row)
        sizes.append(size)
        row = after
    return starts, sizes, ()
