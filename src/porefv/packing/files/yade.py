"""Yade text: one sphere a line, ``x y z r`` separated by white space, as Yade's export.text writes it.

A comment ``#format x_y_z_r_matId``, as export.textExt writes it, names further columns, which are not read.
Other lines that start with # are comments; ``# box_lower = 0 0 0`` and ``# box_upper = 1 1 1`` give the box.
"""

from itertools import chain

from porefv.errors import InputError
from porefv.packing.files.text import (
    AnyPath,
    Rows,
    format_rows,
    metadata_comments,
    read_lines,
    read_metadata,
    write_lines,
)
from porefv.packing.packing import Packing, Source


def read(path: AnyPath) -> Packing:
    """Read a Yade text file; errors name the file and the line."""
    rows = Rows(path, read_lines(path))
    if not rows.texts:
        raise InputError(f"{path}: only comments. Give one sphere a line: x y z r.")
    names = _format(path, rows.comments)
    if rows.texts[0].count(",") >= 3:
        raise InputError(
            f"{path}, line {rows.numbers[0]}: Yade text has columns x y z r separated by spaces, not commas. "
            "If this is a CSV file, give format 'csv'."
        )
    cells = len(names) if names[-1] != "attrs" else len(rows.texts[0].split())
    values, lines = rows.columns({name: names.index(name) for name in ("x", "y", "z", "r")}, cells)
    box, metadata = read_metadata(path, rows.comments)
    return Packing(values[:, :3], values[:, 3], box, Source(path, lines), metadata)


def write(packing: Packing, path: AnyPath) -> None:
    """Write a file that Yade's ymport.textExt reads; it reads back here to the same numbers."""
    write_lines(path, chain(["#format x_y_z_r"], metadata_comments(packing), format_rows(packing, "\t")))


def _format(path: AnyPath, comments: list[tuple[int, str]]) -> list[str]:
    """Names of the columns."""
    for line, comment in comments:
        words = comment.split()
        if len(words) == 2 and words[0] == "format":
            names = words[1].split("_")
            if not {"x", "y", "z", "r"} <= set(names):
                raise InputError(f"{path}, line {line}: the format {words[1]} lacks one of x, y, z, r.")
            return names
    return ["x", "y", "z", "r"]
