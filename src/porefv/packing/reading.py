"""What a reader understood of a packing file: `porefv check` says it, and `summary.json` has it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from typing import Any


@dataclass(frozen=True)
class Reading:
    """What a reader understood of a packing file.

    Parameters
    ----------
    format : str
        In words, such as ``LAMMPS dump``.
    units : str
        Unit of the lengths that the file states, such as ``cgs (cm)``; empty if it states none.
    scale : float
        Factor by which the lengths in the file were multiplied to be in m.
    columns : mapping of str to str
        Column, array or position that x, y, z and radius were read from.
    frame, frames : int
        The frame that was read, counted from 0, and how many whole frames the file holds.
    periodicity : str
        What the file states, and what was made of it; empty if it states no periodic boundary.
    box : str
        Where the box comes from; empty if there is none.
    notes : tuple of str
        What else was decided, one sentence each.
    """

    format: str
    units: str = ""
    scale: float = 1.0
    columns: Mapping[str, str] = field(default_factory=dict)
    frame: int = 0
    frames: int = 1
    periodicity: str = ""
    box: str = ""
    notes: tuple[str, ...] = ()

    def __str__(self) -> str:
        """One line for people: ``LAMMPS dump; lengths in cgs (cm), multiplied by 0.01; box: BOX BOUNDS``."""
        units = f"lengths in {self.units}" if self.units else "no unit stated"
        scaled = f", multiplied by {self.scale:.9g}" if self.scale != 1.0 else "" if self.units else ", taken as m"
        columns = ", ".join(role if role == name else f"{role} from {name}" for role, name in self.columns.items())
        parts = [
            self.format,
            units + scaled,
            f"columns {columns}" if columns else "",
            f"frame {self.frame} of {self.frames} (from 0)" if self.frames > 1 else "",
            self.periodicity,
            f"box: {self.box}" if self.box else "no box",
            *self.notes,
        ]
        return "; ".join(part for part in parts if part)

    def as_data(self) -> dict[str, Any]:
        """The fields as plain data, for files."""
        return asdict(self) | {"columns": dict(self.columns), "notes": list(self.notes)}
