"""Numbers, paths and walls in words, as several commands print them."""

from __future__ import annotations

import os
import sys
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from porefv.errors import PorefvError, printable

# Most characters of a value that a file says.
_MOST = 300


def say(text: str) -> None:
    """Print a text on standard output. What is not printable in it, or not known to the output's encoding, is escaped.

    Texts hold names of files, and what files say.

    Raises
    ------
    PorefvError
        If the output cannot be written to.
    BrokenPipeError
        If whoever read it has gone.
    """
    if sys.stdout is None:
        raise _no_output("it is closed")
    encoding = sys.stdout.encoding or "utf-8"
    with _errors_of_output():
        print(printable(text).encode(encoding, "backslashreplace").decode(encoding), flush=True)


def flush() -> None:
    """Write what is still to be written on standard output; errors as `say`."""
    if sys.stdout is not None:
        with _errors_of_output():
            sys.stdout.flush()


@contextmanager
def _errors_of_output() -> Iterator[None]:
    """Turn errors of standard output into those of `say`."""
    try:
        yield
    except OSError as error:
        # What is still to be written goes nowhere, so that it is not tried again when the process ends.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        raise error if isinstance(error, BrokenPipeError) else _no_output(error.strerror) from None


def _no_output(reason: str | None) -> PorefvError:
    return PorefvError(f"cannot write to standard output: {reason}. Files that were to be written are complete")


def walls_text(walls: Mapping[str, Mapping[str, Any]]) -> str:
    """Walls that have the same condition together."""
    from porefv.flow.walls import condition_text

    groups: dict[str, list[str]] = {}
    for name, wall in walls.items():
        groups.setdefault(f"{condition_text(wall)}, {'slip' if wall['slip'] else 'no-slip'}", []).append(name)
    return "; ".join(f"{' '.join(names)}: {kind}" for kind, names in groups.items())


def rows_text(rows: Iterable[tuple[str, Any]]) -> list[str]:
    """Rows of a name and a value, aligned; rows whose value is None are left out."""
    rows = [(name, value) for name, value in rows if value is not None]
    width = max(len(name) for name, _ in rows)
    return [f"  {name:{width}}  {printable(str(value), _MOST)}" for name, value in rows]


def count_text(number: int) -> str:
    """A number with its thousands apart: ``12 627``."""
    return f"{number:,}".replace(",", " ")


def range_text(values: Iterable[float]) -> str:
    """The least and the largest of some values, or their one value."""
    lowest, highest = min(values), max(values)
    return f"{lowest:.4g}" if lowest == highest else f"{lowest:.4g} to {highest:.4g}"


def vector_text(values: Iterable[float]) -> str:
    """Numbers with commas between them."""
    return ", ".join(f"{value:.6g}" for value in values)


def axes_text(values: Mapping[str, float]) -> str:
    """Values along x, y and z."""
    return ", ".join(f"{axis} {values[axis]:.6g}" for axis in "xyz")


def path_text(path: str | os.PathLike[str]) -> str:
    """A path without redundant parts."""
    return printable(str(Path(os.path.normpath(path))), _MOST)
