"""Tables of several times: the rows of one frame, by a column of times; and ids that occur twice."""

from __future__ import annotations

import re
from collections.abc import Sequence
from itertools import pairwise

from porefv.errors import InputError
from porefv.packing.files.frames import chosen_frame
from porefv.packing.files.options import ReadOptions
from porefv.packing.files.text import AnyPath, Rows, quoted, split

_TIME = re.compile(
    r"(?:sim(?:ulation)?|current|elapsed|physical|frame|output|dump)?(?:t|time|timestep|tstep|timestamp|step|frame|"
    r"iteration|iter|cycle|snapshot|dump|output|elapsed|run|file|date)s?(?:index|idx|number|num|no|id|value)?"
)
_OWNER = "(?:particle|sphere|grain|bead|atom|ball)"
_ID = re.compile(rf"{_OWNER}?(?:id|ids|index)|{_OWNER}(?:number|num|no|idx)")
_WHOLE = re.compile(_OWNER)  # ids if they are whole numbers
# A unit at the end of a name: time [s], time_ms, time / s, time in s.
_UNIT = re.compile(
    r"[\s,_/]*[\(\[{<].*|(?:\s+in\s+|\s*[\s_/.:,]\s*)(?:s|sec|secs|second|seconds|ms|us|µs|ns|min|minutes|h|hours)$",
    re.IGNORECASE,
)
_NUMBER = re.compile(r"[+-]?(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][+-]?[0-9]+)?")
_ONE_FRAME = "Does the table hold several frames? Keep the rows of one"
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
    joined = [_joined(name) for name in names]
    times = [k for k, name in enumerate(joined) if _TIME.fullmatch(name)]
    ids = [k for k, name in enumerate(joined) if _ID.fullmatch(name)]
    owners = [k for k, name in enumerate(joined) if _WHOLE.fullmatch(name)]
    if not times and not ids and not owners:
        return chosen_frame(path, 1, options), 1
    cells = [split(text, delimiter) for text in rows.texts[skip:]]
    if any(len(row) != len(names) for row in cells):
        return chosen_frame(path, 1, options), 1  # an error that names the line follows
    ids += [k for k in owners if all(re.fullmatch("[0-9]+", row[k].strip()) for row in cells)]
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


def refuse_blocks(path: AnyPath, lines: Sequence[str], rows: Rows, skip: int) -> None:
    """Refuse rows that are divided into blocks, as frames are: by blank lines, or by comments that repeat.

    Parameters
    ----------
    path : path
    lines : sequence of str
        All lines of the file.
    rows : Rows
    skip : int
        Rows before the spheres.
    """
    numbers = rows.numbers[skip:]
    seen: dict[str, int] = {}
    for line, comment in rows.comments:
        outline = _NUMBER.sub("0", comment)
        if not re.search(r"[^\W\d_]", outline):
            continue  # such as a row that is left out
        first = seen.setdefault(outline, line)
        within = bool(numbers) and numbers[0] < line < numbers[-1]
        time = re.match(r"[^\W_]+", comment.lstrip(" #"))
        if within and (first != line or (time and _TIME.fullmatch(time[0].lower()))):
            like = f" like that on line {first}" if first != line else ""
            raise InputError(
                f"{path}, line {line}: a comment {quoted(comment)}{like} stands between spheres. {_ONE_FRAME}; or "
                "remove the comment if the rows are spheres of one packing."
            )
    divided = [
        after
        for before, after in pairwise(numbers)
        if after > before + 1 and any(not text.strip() for text in lines[before : after - 1])
    ]
    # Rows of which each has a blank line before it are no blocks.
    if divided and len(divided) + 1 < len(numbers):
        raise InputError(
            f"{path}, line {divided[0] - 1}: a blank line stands between spheres. {_ONE_FRAME}; or remove the blank "
            "lines if the rows are spheres of one packing."
        )


def _joined(name: str) -> str:
    """The name of a column in lower case, without its unit, and without what is no letter or digit."""
    return re.sub(r"[\W_]", "", _UNIT.sub("", name.strip().strip("\"'").strip()).lower())


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
                    f"{path}, line {line}: {names[column]} {quoted(row[column])} stands on line {first} already. "
                    f"{_ONE_FRAME}; or rename the column if it is no id of spheres."
                )
