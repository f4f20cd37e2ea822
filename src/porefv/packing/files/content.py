"""FileContent: what a reader found in a packing file, in the units of the file; and the packing made of it."""

from __future__ import annotations

import warnings
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import NoReturn

import numpy as np
from numpy.typing import NDArray

from porefv.errors import InputError, PackingFileWarning
from porefv.packing.box import Box
from porefv.packing.cell import Cell
from porefv.packing.files.options import ReadOptions
from porefv.packing.files.text import AnyPath, make_box, quoted
from porefv.packing.packing import Packing, Source
from porefv.packing.reading import Reading


@dataclass(frozen=True)
class LengthUnit:
    """A unit of lengths that a file states.

    Parameters
    ----------
    name : str
        As in the file, such as ``cgs`` or ``mm``.
    metres : float or None
        None: the size of the unit is not known.
    place : str
        Where it is stated, as the start of an error: ``a.dump, line 2``.
    clear : bool
        False: `name` is a line that names a unit or a scale, and is not understood.
    """

    name: str
    metres: float | None
    place: str
    clear: bool = True


@dataclass(frozen=True, eq=False)
class FileContent:
    """What a reader found in a packing file, in the units of the file.

    Parameters
    ----------
    format : str
        In words.
    centres : (n, 3) array
    radii : (n,) array or None
        None: the file has none, and the user gives one radius.
    corners : pair of (3,) arrays, optional
        Lower and upper corner of the box.
    lattice : (3, 3) array, optional
        Vectors of a tilted periodic cell, from the lower corner.
    box_place : str
        What states the box.
    unit : LengthUnit, optional
    lines : (n,) integer array, optional
        Line of each sphere.
    columns, frame, frames, periodicity, notes
        As in `Reading`.
    metadata : mapping of str to str
    """

    format: str
    centres: NDArray
    radii: NDArray | None
    corners: tuple[NDArray, NDArray] | None = None
    box_place: str = ""
    unit: LengthUnit | None = None
    lines: NDArray | None = None
    columns: Mapping[str, str] = field(default_factory=dict)
    frame: int = 0
    frames: int = 1
    periodicity: str = ""
    notes: tuple[str, ...] = ()
    metadata: Mapping[str, str] = field(default_factory=dict)
    lattice: NDArray | None = None

    def packing(self, path: AnyPath, options: ReadOptions, box: Box | Cell | None) -> Packing:
        """The packing in m, in the box or the periodic cell given or else in that of the file."""
        scale, notes = self._scale(path, options)
        radii = self._radii(path, options, scale)
        place = "given" if box is not None else self.box_place if self.corners is not None else ""
        with np.errstate(over="ignore"):  # what is not finite is refused below
            if box is None and self.corners is not None:
                box = self._box(path, scale)
            centres = self.centres * scale if scale != 1.0 else self.centres
        if options.periodic == "cell":
            if box is None:
                raise InputError(f"{path}: the file has no box. Give the periodic cell, as in box=Cell(vectors).")
            box = box if isinstance(box, Cell) else Cell.of(box)
        if options.radius is not None:
            notes = (*notes, f"radius of all spheres {options.radius:.9g} m, given")
        reading = Reading(
            self.format, self.unit.name if self.unit and self.unit.clear else "", scale, dict(self.columns), self.frame,
            self.frames, self.periodicity, place, (*self.notes, *notes),
        )  # fmt: skip
        return Packing(centres, radii, box, Source(path, self.lines, reading), dict(self.metadata))

    def _box(self, path: AnyPath, scale: float) -> Box | Cell:
        assert self.corners is not None
        if self.lattice is None:
            return make_box(path, *(np.asarray(corner) * scale for corner in self.corners))
        try:
            return Cell(self.lattice * scale, np.asarray(self.corners[0]) * scale)
        except InputError as error:
            raise InputError(f"{path}: {error}") from None

    def _scale(self, path: AnyPath, options: ReadOptions) -> tuple[float, tuple[str, ...]]:
        """Length of the file's unit in m, and what is to be noted about it."""
        unit = self.unit
        if options.scale is None:
            if unit is not None and not unit.clear:
                raise InputError(
                    f"{unit.place}: {quoted(unit.name)} names a unit or a scale of lengths, and is not understood. "
                    "Give the length of the unit of the file in m as scale (1 if it is the metre)."
                )
            if unit is not None and unit.metres is None:
                raise InputError(
                    f"{unit.place}: lengths are in {quoted(unit.name)}, and how long that is in m is not known. "
                    "Give the length of this unit in m as scale."
                )
            return (1.0 if unit is None or unit.metres is None else unit.metres), ()
        if unit is not None and unit.metres is not None and abs(options.scale / unit.metres - 1) > 1e-9:
            note = f"scale {options.scale:.9g} is used instead of the stated unit {unit.name}"
            warnings.warn(f"{unit.place}: {note}.", PackingFileWarning, stacklevel=2)
            return options.scale, (note,)
        return options.scale, ()

    def _radii(self, path: AnyPath, options: ReadOptions, scale: float) -> NDArray:
        """Radii, m."""
        if options.radius is None:
            if self.radii is None:
                missing_radius(path)
            with np.errstate(over="ignore", under="ignore"):
                return self.radii * scale if scale != 1.0 else self.radii
        if self.radii is not None:
            raise InputError(f"{path}: radius = {options.radius:.9g} is given, and the file has radii. Drop radius.")
        return np.full(len(self.centres), options.radius)


def warn_radius(place: str | AnyPath, name: str) -> None:
    """Warn that the radii of a file are not read, since the user gives one radius of all spheres."""
    warnings.warn(f"{place}: the radius given is used instead of {name}.", PackingFileWarning, stacklevel=2)


def missing_radius(place: str | AnyPath, found: str = "") -> NoReturn:
    """Refuse a file without radii; `found` says what it has instead, and ends in "and "."""
    raise InputError(
        f'{place}: {found}there is no radius or diameter. Name its column, as in columns = {{ radius = "..." }}, or '
        "give one radius of all spheres as radius, in m."
    )


def tilted(place: str) -> InputError:
    """The error of a box that is not aligned with the axes, and not read into a periodic cell."""
    return InputError(
        f"{place}: the box is tilted; only axis-aligned boxes are read. In Python, "
        'Packing.read(path, periodic="cell") reads a tilted periodic cell.'
    )


def periodicity(place: str, axes: str, stated: str, options: ReadOptions) -> str:
    """What is said of periodic boundaries; InputError if the user has not said how to read them.

    Parameters
    ----------
    place : str
        The file, and the line.
    axes : str
        Periodic axes, such as ``xy``; none if empty.
    stated : str
        What the file says.
    options : ReadOptions
    """
    if not axes:
        return ""
    along = ", ".join(axes)
    if options.periodic is None:
        raise InputError(
            f"{place}: the packing is periodic along {along} ({stated}). Give "
            'periodic = "ignore" to read it into a box with six walls: flow near these walls is not that of the bulk. '
            'In Python, Packing.read(path, periodic="cell") reads it into a periodic cell, for PeriodicFlow.'
        )
    if options.periodic == "cell":
        if axes != "xyz":
            raise InputError(
                f"{place}: the packing is periodic along {along} alone ({stated}), and porefv has periodic cells "
                'without walls only. Give periodic = "ignore" to read it into a box with six walls.'
            )
        return f"periodic along {along} ({stated}), read into a periodic cell"
    return (
        f"periodic along {along} ({stated}), which is ignored: the box has walls, and flow near them is not the bulk's"
    )
