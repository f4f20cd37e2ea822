"""Tables of numbers as CSV files: a column for each field of a structured array; an empty cell stands for NaN."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from porefv.errors import InputError

# Rows that are text in memory at a time.
_ROWS = 1 << 16


def write_csv(table: np.ndarray, path: Path) -> None:
    """Write a structured array (rows,) of whole numbers and doubles; NaN is an empty cell."""
    with path.open("w", encoding="utf-8", newline="\n") as file:
        file.write(f"{','.join(table.dtype.names or ())}\n")
        for first in range(0, len(table), _ROWS):
            # repr gives the shortest text that reads back to the same number.
            rows = table[first : first + _ROWS].tolist()
            file.writelines(",".join("" if x != x else repr(x) for x in row) + "\n" for row in rows)


def read_csv(path: Path, columns: dict[str, type]) -> np.ndarray:
    """The structured array of a file that `write_csv` has written.

    Parameters
    ----------
    path : Path
    columns : dict of str to type
        The columns that it must have, int or float.

    Raises
    ------
    InputError
        If the file is damaged.
    """
    try:
        header, *lines = path.read_text(encoding="utf-8").splitlines()
        if header != ",".join(columns):
            raise ValueError(f"its first line does not name the columns {', '.join(columns)}")
        rows = [tuple(_number(text, kind) for text, kind in zip(line.split(","), columns.values(), strict=True))
                for line in lines]  # fmt: skip
        return np.array(rows, dtype=list(columns.items()))
    except (OSError, ValueError, OverflowError) as error:
        raise InputError(f"{path} is damaged: {error}. Solve again.") from None


def _number(text: str, kind: type) -> float:
    return kind(text) if text or kind is int else np.nan  # type: ignore[no-any-return]
