"""What the user says about a packing file, checked: columns, radius, scale, frame, periodic."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from porefv.errors import InputError
from porefv.packing.files.text import AnyPath, quoted
from porefv.system.number_checks import is_finite_number

ROLES = ("x", "y", "z", "radius", "diameter")


@dataclass(frozen=True)
class ReadOptions:
    """What the user says about a packing file.

    Parameters
    ----------
    columns : mapping of str to str
        Column of x, y, z, radius or diameter. Those not given are found by their names.
    radius : float, optional
        Radius of all spheres of a file without radii, m.
    scale : float, optional
        Factor by which lengths in the file are multiplied to be in m. Default: by the units that the file states.
    frame : int, optional
        Frame to read, counted from 0; -1 is the last. Default: the last.
    periodic : {"cell", "ignore"}, optional
        Read the packing into a periodic cell, or a periodic packing into a box with six walls. Default: refuse a
        periodic packing.
    """

    columns: Mapping[str, str] = field(default_factory=dict)
    radius: float | None = None
    scale: float | None = None
    frame: int | None = None
    periodic: str | None = None

    def check(self, path: AnyPath) -> ReadOptions:
        """These options, if each of them is possible; otherwise an InputError that names the file and the option."""
        for name in ("radius", "scale"):
            value = getattr(self, name)
            if value is not None and not (is_finite_number(value) and value > 0):
                raise InputError(f"{path}: {name} must be a positive number of m, not {value!r}.")
        if self.frame is not None and (isinstance(self.frame, bool) or not isinstance(self.frame, int | np.integer)):
            raise InputError(f"{path}: frame must be a whole number, 0 for the first and -1 for the last.")
        if self.periodic not in (None, "cell", "ignore"):
            raise InputError(f'{path}: periodic must be "cell", "ignore", or not be given; it is {self.periodic!r}.')
        for role, name in self.columns.items():
            if role not in ROLES or not isinstance(name, str):
                raise InputError(f"{path}: columns are names of {', '.join(ROLES)}, not {quoted(str(role))}: {name!r}.")
        sizes = [name for name in ("radius", "diameter") if name in self.columns]
        if len(sizes) + (self.radius is not None) > 1:
            raise InputError(f"{path}: give one of columns.radius, columns.diameter and radius.")
        return self
