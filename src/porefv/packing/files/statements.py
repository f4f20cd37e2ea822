"""What lines of text in a table state about units and periodic boundaries: comments, and lines before the header."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from porefv.errors import InputError
from porefv.packing.files.content import LengthUnit, periodicity
from porefv.packing.files.length_units import first_clear, stated_unit
from porefv.packing.files.options import ReadOptions
from porefv.packing.files.periodic_words import stated_axes
from porefv.packing.files.text import AnyPath, Corners, quoted

_PERIODIC_CELL = re.compile(r"#?\s*PERIODIC::\s*(.*)")  # of SpherePack.save, after the # of a comment


def is_periodic_cell(comment: str) -> bool:
    """Whether a comment gives the periodic cell of a SpherePack file."""
    return _PERIODIC_CELL.fullmatch(comment) is not None


@dataclass(frozen=True)
class Statements:
    """What lines of text state.

    Parameters
    ----------
    unit : LengthUnit or None
    cell : pair of (3,) arrays, or None
        Corners of the periodic cell of a SpherePack file, from the origin.
    periodicity : str
        As in `Reading`.
    lines : frozenset of int
        Numbers of the lines that state something.
    """

    unit: LengthUnit | None
    cell: Corners | None
    periodicity: str
    lines: frozenset[int]

    @classmethod
    def of(cls, path: AnyPath, texts: Sequence[tuple[int, str]], options: ReadOptions) -> Statements:
        """What lines state, given by number and text.

        Raises
        ------
        InputError
            If lines state different units without a scale, or periodic boundaries that are not ignored.
        """
        units: list[LengthUnit] = []
        lines: set[int] = set()
        cell, said = None, ""
        for line, text in texts:
            place = f"{path}, line {line}"
            if match := _PERIODIC_CELL.fullmatch(text):
                cell = _cell(place, match[1])
                said = periodicity(place, "xyz", "##PERIODIC::", options)
                lines.add(line)
            elif axes := stated_axes(text):
                said = said or periodicity(place, axes, quoted(text), options)
                lines.add(line)
            elif (unit := stated_unit(place, text)) is not None:
                units.append(unit)
                lines.add(line)
        return cls(first_clear(units, options), cell, said, frozenset(lines))


def _cell(place: str, text: str) -> Corners:
    try:
        size = np.array([float(word) for word in text.split()])
    except ValueError:
        size = np.empty(0)
    if size.shape != (3,):
        raise InputError(f"{place}: ##PERIODIC:: must be followed by three numbers, not {quoted(text)}.")
    return np.zeros(3), size
