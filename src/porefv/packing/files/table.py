"""Tables of spheres in text: one sphere a line, with or without a header.

Cells are separated by commas, semicolons, tabs or blanks. The columns are found

* by the names in a header, which may stand after other lines, or in a comment (numpy.savetxt);
* by a comment ``#format x_y_z_r_matId``, as Yade's export.textExt writes it;
* by their places, without a header: ``x y z r`` (Yade's export.text); ``x y z r clump`` (SpherePack.save);
  ``id x y z r`` (Voro++). A line with the number of spheres may stand before them.

Lines that start with # are comments; ``# box_lower = 0 0 0`` and ``# box_upper = 1 1 1`` give the box, and
``##PERIODIC:: 1 1 1`` that of a periodic cell.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from porefv.errors import InputError
from porefv.packing.files.column_names import (
    Column,
    chosen_columns,
    positions,
    recognised,
    roles,
    spheres,
    units_below,
)
from porefv.packing.files.content import FileContent, warn_radius
from porefv.packing.files.frames import chosen_frame, warn_no_end
from porefv.packing.files.length_units import UNITS, agreed_unit
from porefv.packing.files.metadata import read_metadata
from porefv.packing.files.options import ReadOptions
from porefv.packing.files.statements import Statements, is_periodic_cell
from porefv.packing.files.table_frames import keep_frame, refuse_blocks
from porefv.packing.files.text import AnyPath, Rows, quoted, split, text_lines

_DELIMITERS = (";", "\t", ",", None)
_MOST_BEFORE = 100  # rows among which the header is looked for

# A number with a decimal point or comma, and an exponent with E or, of Fortran, D.
_WRITTEN_OTHERWISE = re.compile(r"[+-]?(?:[0-9]+[.,]?[0-9]*|[.,][0-9]+)(?:[eEdD][+-]?[0-9]+)?")

# A name in a header separated by blanks: with a unit behind it, as in x [mm], x {mm}, x / mm, x in mm.
_BETWEEN_BLANKS = re.compile(rf"\S+(?:\s+(?:[\[({{<][^\s\])}}>]*[\])}}>]|/\s+\S+|in\s+(?:{'|'.join(UNITS)})\b))?")

_SPHERE_PACK = "SpherePack text (x y z radius clump)"

_HEADERLESS = (
    'Give a header line such as x,y,z,radius, or the places of the columns, as in columns = { x = "1", y = "2", '
    'z = "3", radius = "4" }.'
)


@dataclass(frozen=True)
class _Header:
    """The names of the columns, and where the rows start."""

    names: list[str]
    line: int  # 0: there is none
    skip: int
    delimiter: str | None
    format: str


def read(path: AnyPath, content: bytes, options: ReadOptions) -> FileContent:
    """Read a table; errors name the file and the line."""
    all_lines = text_lines(path, content)
    rows = Rows(path, all_lines)
    comments = list(rows.comments)
    if not rows.texts:
        raise InputError(f"{path}: only comments. Give a header x,y,z,radius, then one sphere a line.")
    header = _header(path, rows, options)
    comments += zip(rows.numbers[: header.skip], rows.texts[: header.skip], strict=True)
    said = Statements.of(path, [(line, text) for line, text in comments if line != header.line], options)
    cells = len(header.names)
    if header.line:
        columns = chosen_columns(path, header.line, header.names, options)
        header, columns = _with_units(path, rows, header, columns)
        frame, frames = keep_frame(path, rows, header.names, header.skip, header.delimiter, options)
        values, lines = _values(rows, columns, cells, header)
    else:
        frame, frames = chosen_frame(path, 1, options), 1
        header, columns, values, lines = _without_names(path, rows, header, options)
    refuse_blocks(path, all_lines, rows, header.skip)
    place = f"{path}, line {header.line}" if header.line else f"{path}"
    centres, radii, unit, names = spheres(place, columns, values, options)
    unit = agreed_unit(unit, said.unit, options)
    # A last line of a comment, or in another frame, or whose last cell is not read, cannot lose digits that matter.
    last_read = any(column.position == cells - 1 for column in columns)
    notes = (warn_no_end(f"{path}, line {lines[-1]}"),) if last_read and lines[-1] == len(all_lines) else ()
    corners, metadata = read_metadata(path, (comment for comment in rows.comments if comment[0] not in said.lines))
    box_place = "comments box_lower, box_upper"
    if said.cell is not None:
        corners, box_place = said.cell, "##PERIODIC::"
    return FileContent(
        header.format,
        centres,
        radii,
        corners,
        box_place,
        unit,
        lines,
        names,
        frame,
        frames,
        periodicity=said.periodicity,
        notes=notes,
        metadata=metadata,
    )


def _with_units(path: AnyPath, rows: Rows, header: _Header, columns: list[Column]) -> tuple[_Header, list[Column]]:
    """The header and the columns with the units that a row under the names may state."""
    in_comment = header.skip == 0 or rows.numbers[header.skip - 1] != header.line
    row = header.skip - (in_comment and header.skip > 0)  # a header in a comment skips all rows before the numbers
    if row < len(rows.texts):
        place = f"{path}, line {rows.numbers[row]}"
        found = units_below(place, columns, split(rows.texts[row], header.delimiter))
        if found is not None:
            return replace(header, skip=row + 1), found
    return header, columns


def _values(rows: Rows, columns: list[Column], cells: int, header: _Header) -> tuple[NDArray, NDArray]:
    """(n, number of columns) numbers, and the lines."""
    return rows.columns(positions(columns), cells, header.delimiter, header.skip)


def _header(path: AnyPath, rows: Rows, options: ReadOptions) -> _Header:
    for line, comment in rows.comments:
        words = comment.split()
        if len(words) == 2 and words[0] == "format":
            return _yade_format(path, line, words[1], rows)
    first = next((k for k, text in enumerate(rows.texts[:_MOST_BEFORE]) if _is_numbers(text)), None)
    delimiter = _delimiter(rows.texts[first]) if first is not None else None
    cells = len(split(rows.texts[first], delimiter)) if first is not None else 0
    before = rows.texts[: _MOST_BEFORE if first is None else first]
    found = [
        _Header(names, rows.numbers[k], k + 1, mark, _with_header(mark))
        for k, text in enumerate(before)
        for mark, names in _cells_of_header(text)
    ]
    # A header in a comment may be separated in another way than the rows. Other comments have other numbers of words.
    found += [
        _Header(names, line, first or 0, delimiter, _with_header(delimiter))
        for line, text in rows.comments[:_MOST_BEFORE]
        for _, names in _cells_of_header(text)
        if len(names) == cells
    ]
    found = [_with_row_names(header, rows.texts[first or 0], cells) for header in found]
    known = [len(roles(header.names, options) & {"x", "y", "z"}) for header in found]
    known = [
        0 if number == 1 and len(header.names) < 3 else number for number, header in zip(known, found, strict=True)
    ]
    if any(known):
        # Of several ways to split a header, the one that splits the rows into as many cells comes first.
        fits = [header.delimiter == delimiter and len(header.names) == cells for header in found]
        scores = [number + 3 * (fit and number > 0) for number, fit in zip(known, fits, strict=True)]
        return found[scores.index(max(scores))]
    if first == 0 or (first == 1 and _is_count(path, rows)):
        return _Header([str(k + 1) for k in range(cells)], 0, first, delimiter, "table without header")
    if before and (what := _other_numbers(before[0])):
        raise InputError(f"{path}, line {rows.numbers[0]}: {quoted(before[0])} has {what}.")
    last = len(before) - 1 if first else 0
    mark, names = next((mark, names) for mark, names in _cells_of_header(before[last]))
    return _Header(names, rows.numbers[last], last + 1, mark, _with_header(mark))


def _with_row_names(header: _Header, row: str, cells: int) -> _Header:
    """The header with a name for a first column without one, of quoted names of rows, as R writes them."""
    if len(header.names) + 1 == cells and row.lstrip().startswith('"'):
        return replace(header, names=["", *header.names])
    return header


def _cells_of_header(text: str) -> Iterator[tuple[str | None, list[str]]]:
    """The names in a line, for each delimiter that the line has; units in brackets belong to the name before them."""
    text = re.sub(r"^\s*(?:[%!]|//|;\s)\s*", "", text)  # marks of comments in other programs
    text = re.sub(r"^(?:columns|fields)\s*:\s*", "", text, flags=re.IGNORECASE)
    for mark in _DELIMITERS:
        if mark is None:
            yield mark, _BETWEEN_BLANKS.findall(text)
        elif mark in text:
            yield mark, [name.strip() for name in split(text, mark)]


def _other_numbers(text: str) -> str:
    """How a row of numbers is written that cannot be read; empty for any other row."""
    for cells in (text.split(), text.split(";"), text.split("\t"), text.split(",")):
        cells = [cell.strip() for cell in cells]
        if len(cells) < 3 or not all(map(_WRITTEN_OTHERWISE.fullmatch, cells)):
            continue
        if any("," in cell for cell in cells):
            return "decimal commas. Write decimals with a point"
        if any("d" in cell.lower() for cell in cells):
            return "exponents of Fortran with D. Write them with E, as in 1.0E-3"
    return ""


def _is_count(path: AnyPath, rows: Rows) -> bool:
    """Whether the first row is the number of the others; InputError if it is another number."""
    text, given = rows.texts[0].strip(), len(rows.texts) - 1
    if not re.fullmatch("[0-9]{1,15}", text):
        return False
    if int(text) != given:
        raise InputError(
            f"{path}, line {rows.numbers[0]}: {text} spheres declared, {given} given. Was the file cut off?"
        )
    return True


def _with_header(delimiter: str | None) -> str:
    kind = {",": "commas", ";": "semicolons", "\t": "tabs", None: "blanks"}[delimiter]
    return f"table with header, separated by {kind}"


def _yade_format(path: AnyPath, line: int, text: str, rows: Rows) -> _Header:
    names = text.split("_")
    if not {"x", "y", "z", "r"} <= set(names):
        raise InputError(f"{path}, line {line}: the format {quoted(text)} lacks one of x, y, z, r.")
    if names[-1] == "attrs":
        names += [""] * (len(rows.texts[0].split()) - len(names))
    return _Header(names, line, 0, None, "Yade text (#format)")


def _is_numbers(text: str) -> bool:
    """Whether a line is a row of spheres: three numbers or more. Between blanks also words of a header may be such."""
    delimiter = _delimiter(text)
    cells = split(text, delimiter)
    return sum(map(_is_number, cells)) >= max(3, len(cells) / 3 if delimiter is None else 0)


def _is_number(cell: str) -> bool:
    try:
        float(cell)
    except ValueError:
        return False
    return True


def _delimiter(row: str) -> str | None:
    """What separates the cells of a row of numbers."""
    return max(_DELIMITERS, key=lambda mark: (sum(map(_is_number, split(row, mark))), mark is None))


def _without_names(
    path: AnyPath, rows: Rows, header: _Header, options: ReadOptions
) -> tuple[_Header, list[Column], NDArray, NDArray]:
    """Columns by their places, the format that these tell, and all values."""
    cells, line = len(header.names), rows.numbers[header.skip]
    if header.skip == 0:
        _refuse_number_and_box(path, rows, header.delimiter)
    if options.columns:
        columns = chosen_columns(path, line, header.names, options)
        return header, columns, *_values(rows, columns, cells, header)
    sized = options.radius is None
    if cells not in (3 + sized, 5):
        raise InputError(
            f"{path}, line {line}: {cells} columns without names{'' if cells != 3 else ' and no radius'}. {_HEADERLESS}"
        )
    places = dict(zip(("x", "y", "z", "radius"), range(4), strict=True))
    everything = {name: k for k, name in enumerate(("x", "y", "z", "radius", "column 5")[:cells])}
    values, lines = rows.columns(everything, cells, header.delimiter, header.skip)
    numbered = _is_numbering(values[:, 0])
    format = "table without header, x y z radius"
    if cells == 4 and numbered and len(values) > 3 and values[:, 3].min() != values[:, 3].max():
        raise InputError(
            f"{path}, line {line}: the first of 4 columns without names numbers the spheres, and would be read "
            f"as x. {_HEADERLESS}"
        )
    if cells == 5 and any(is_periodic_cell(comment) for _, comment in rows.comments):
        format = _SPHERE_PACK
    elif cells == 5:
        whole = bool((np.trunc(values[:, 4]) == values[:, 4]).all())
        if numbered == whole:
            raise InputError(
                f"{path}, line {line}: 5 columns without names are neither clearly id x y z radius (Voro++) nor "
                f"x y z radius clump (SpherePack). {_HEADERLESS}"
            )
        format = "Voro++ text (id x y z radius)" if numbered else _SPHERE_PACK
        places = {role: place + numbered for role, place in places.items()}
    _refuse_other_names(path, rows, list(places))
    if not sized:
        if cells == 5:
            warn_radius(path, f"place {places['radius'] + 1}")
        del places["radius"]
        format = "table without header, x y z" if cells == 3 else format
    columns = [Column(role, place, str(place + 1)) for role, place in places.items()]
    return (
        _Header(header.names, 0, header.skip, header.delimiter, format),
        columns,
        values[:, list(places.values())],
        lines,
    )


def _is_numbering(values: NDArray) -> bool:
    """Whether values are n consecutive whole numbers, from 0 or 1, in any order."""
    if not (np.isfinite(values).all() and values.min() in (0.0, 1.0)):
        return False
    return bool((np.sort(values) == np.arange(len(values)) + values.min()).all())


def _refuse_number_and_box(path: AnyPath, rows: Rows, delimiter: str | None) -> None:
    """Refuse a first row that may be the number of the others and a box: N Lx Ly Lz."""
    first, *others = [split(text, delimiter)[0] for text in rows.texts]
    if not _is_number(first) or float(first) != len(others):
        return
    # Where all rows begin with whole numbers, the first is one of them.
    if not all(_is_number(other) and float(other).is_integer() for other in others):
        raise InputError(
            f"{path}, line {rows.numbers[0]}: {quoted(rows.texts[0])} may be the number of the rows after it and the "
            "sides of a box, or a sphere. Remove the line, and give the box; or name the columns in a header."
        )


def _refuse_other_names(path: AnyPath, rows: Rows, places: list[str]) -> None:
    """Refuse a comment that names other columns, or in another order, than those that are read."""
    for line, comment in rows.comments:
        named = _named(comment)
        if not (set("xyz") <= set(named) or (named and re.search(r"\bcolumns?\b", comment, re.IGNORECASE))):
            continue
        expected = iter(places)
        if not all(role in expected for role in named):
            raise InputError(
                f"{path}, line {line}: the comment {quoted(comment)} names {', '.join(named)}, and does not fit as a "
                f"header of columns that would be read as {', '.join(places)}. {_HEADERLESS}"
            )


def _named(text: str) -> list[str]:
    """Of x, y, z, radius and diameter, those that a text names, in its order."""
    words = [word.lower() for word in re.findall(r"(?<![^\W_])[^\W\d_]+(?![^\W_])", text)]
    letters = [letter for word in words for letter in (word if re.fullmatch("xyz[rd]?", word) else [word])]
    found = [known[0] for word in letters if (known := recognised(word))]
    return found
