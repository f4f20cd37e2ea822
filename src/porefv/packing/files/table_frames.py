"""Tables of several times: the rows of one frame, by a column of times; and ids that occur twice."""

from __future__ import annotations

import re
from collections.abc import Sequence

from porefv.errors import InputError
from porefv.packing.files.frames import chosen_frame
from porefv.packing.files.options import ReadOptions
from porefv.packing.files.text import AnyPath, Rows, quoted, split

_TIME = re.compile(r"(?:sim(?:ulation)?)?(?:t|time|times|timestep|step|frame|iteration)(?:index|number|no|id)?")
_ID = re.compile(r"(?:particle|sphere|grain|bead|atom)?(?:id|ids)")
_UNIT = re.compile(r"[\s,_/]*[\(\[].*")  # a unit in brackets at the end of a name
_MOST_SHOWN = 4


def keep_frame(
    path: AnyPath, rows: Rows, names: Sequence[str], skip: int, delimiter: str | None, options: ReadOptions
) -> tuple[int, int]:
    """Leave the rows of one frame in `rows`; the frame, and how many there are.

    A frame is the rows of one value in a column such as ``time``. Such a column may also be a property of each
    sphere. Therefore no frame is taken unless the user gives one.

    Raises
    ------
    InputError
        If there are several frames and none is chosen, or an id occurs twice in a frame.
    """
    joined = [re.sub(r"[\s_:.\-]", "", _UNIT.sub("", name).lower()) for name in names]
    times = [k for k, name in enumerate(joined) if _TIME.fullmatch(name)]
    ids = [k for k, name in enumerate(joined) if _ID.fullmatch(name)]
    if not times and not ids:
        return chosen_frame(path, 1, options), 1
    cells = [split(text, delimiter) for text in rows.texts[skip:]]
    if any(len(row) != len(names) for row in cells):
        return chosen_frame(path, 1, options), 1  # an error that names the line follows
    for column in times:
        values = [_value(row[column]) for row in cells]
        frames = list(dict.fromkeys(values))
        if len(frames) == 1:
            continue
        if options.frame is None:
            shown = ", ".join(map(str, frames[:_MOST_SHOWN])) + (", ..." if len(frames) > _MOST_SHOWN else "")
            raise InputError(
                f"{path}: the column {quoted(names[column])} has {len(frames)} values ({shown}), as if the table held "
                f"several frames. Give frame, 0 to {len(frames) - 1} in this order (-1 is the last), to read the rows "
                "of one value; or remove the column if the rows are spheres of one packing."
            )
        chosen = chosen_frame(path, len(frames), options)
        kept = [k for k, value in enumerate(values) if value == frames[chosen]]
        rows.texts[skip:] = [rows.texts[skip + k] for k in kept]
        rows.numbers[skip:] = [rows.numbers[skip + k] for k in kept]
        _refuse_repeated(path, rows.numbers[skip:], [cells[k] for k in kept], names, ids)
        return chosen, len(frames)
    _refuse_repeated(path, rows.numbers[skip:], cells, names, ids)
    return chosen_frame(path, 1, options), 1


def _value(cell: str) -> float | str:
    try:
        return float(cell)
    except ValueError:
        return cell


def _refuse_repeated(
    path: AnyPath, lines: Sequence[int], cells: Sequence[Sequence[str]], names: Sequence[str], ids: Sequence[int]
) -> None:
    for column in ids:
        seen: dict[float | str, int] = {}
        for line, row in zip(lines, cells, strict=True):
            first = seen.setdefault(_value(row[column]), line)
            if first != line:
                raise InputError(
                    f"{path}, line {line}: {names[column]} {quoted(row[column])} stands on line {first} already. Does "
                    "the table hold several frames? Keep the rows of one; or rename the column if it is no id of "
                    "spheres."
                )
