"""CSV: a header that names x, y, z and radius in any order, then one sphere a line.

Other columns are allowed and not read. The delimiter is a comma, semicolon or tab, whichever the header uses.
Lines that start with # are comments; ``# box_lower = 0 0 0`` and ``# box_upper = 1 1 1`` give the box.
"""

from itertools import chain

from porefv.errors import InputError
from porefv.packing.files.text import (
    AnyPath,
    Rows,
    format_rows,
    metadata_comments,
    quoted,
    read_lines,
    read_metadata,
    split,
    write_lines,
)
from porefv.packing.packing import Packing, Source

_NAMES = {"x": "x", "y": "y", "z": "z", "radius": "radius", "r": "radius"}


def read(path: AnyPath) -> Packing:
    """Read a CSV file; errors name the file and the line."""
    rows = Rows(path, read_lines(path))
    if not rows.texts:
        raise InputError(f"{path}: only comments. Give a header x,y,z,radius, then one sphere a line.")
    header, line = rows.texts[0], rows.numbers[0]
    delimiter = next((mark for mark in ",;\t" if mark in header), ",")
    names = [name.strip().lower() for name in split(header, delimiter)]
    values, lines = rows.columns(_columns(path, line, names), len(names), delimiter, skip=1)
    box, metadata = read_metadata(path, rows.comments)
    return Packing(values[:, :3], values[:, 3], box, Source(path, lines), metadata)


def write(packing: Packing, path: AnyPath) -> None:
    """Write a CSV file with the box and the metadata as comments; it reads back to the same numbers."""
    write_lines(path, chain(metadata_comments(packing), ["x,y,z,radius"], format_rows(packing, ",")))


def _columns(path: AnyPath, line: int, names: list[str]) -> dict[str, int]:
    """Position of x, y, z and radius, in this order."""
    found: dict[str, int] = {}
    for position, name in enumerate(names):
        if name in _NAMES:
            if _NAMES[name] in found:
                raise InputError(f"{path}, line {line}: the header has two columns for {_NAMES[name]}.")
            found[_NAMES[name]] = position
    missing = [name for name in ("x", "y", "z", "radius") if name not in found]
    if missing:
        raise InputError(
            f"{path}, line {line}: the header {quoted(','.join(names))} lacks {', '.join(missing)}. "
            "The first line that is not a comment must name the columns x,y,z,radius (any order, without #)."
        )
    return {name: found[name] for name in ("x", "y", "z", "radius")}
