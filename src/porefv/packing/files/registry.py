"""Who reads and writes each format of packing files."""

import warnings
from collections.abc import Mapping
from dataclasses import replace
from os import PathLike

from porefv.errors import InputError, PackingFileWarning, counted
from porefv.packing.box import Box
from porefv.packing.cell import Cell
from porefv.packing.files import csv, esys, lammps, mercury, pvd, table, vtk, xyz, xyzd, yade
from porefv.packing.files.content import FileContent
from porefv.packing.files.detection import EXTENSIONS, detected, extension
from porefv.packing.files.options import ReadOptions
from porefv.packing.files.text import CutOffError, read_bytes
from porefv.packing.packing import Packing

_READERS = {
    "csv": table.read,
    "yade": table.read,
    "lammps": lammps.read,
    "vtk": vtk.read,
    "pvd": pvd.read,
    "mercury": mercury.read,
    "esys": esys.read,
    "xyz": xyz.read,
    "xyzd": xyzd.read,
}
_WITH_FRAMES = ("lammps", "mercury", "xyz")  # whose readers tell a whole frame from one that is cut off
_WRITERS = {"csv": csv.write, "yade": yade.write, "vtk": vtk.write}

FORMATS = tuple(_READERS)


def read_packing(
    path: str | PathLike[str],
    format: str | None = None,
    box: Box | Cell | None = None,
    *,
    columns: Mapping[str, str] | None = None,
    radius: float | None = None,
    scale: float | None = None,
    frame: int | None = None,
    periodic: str | None = None,
) -> Packing:
    """Read a packing file, of text also compressed by gzip.

    Parameters
    ----------
    path : path
    format : {"csv", "yade", "lammps", "vtk", "pvd", "mercury", "esys", "xyz", "xyzd"}, optional
        Default: by the content of the file, and then by its extension (`EXTENSIONS`).
    box : Box or Cell, optional
        Box to use instead of the one in the file, m. A periodic `Cell` stands for `periodic="cell"`, too.
    columns : mapping of str to str, optional
        Name of the column of x, y, z, radius or diameter; without a header, its place counted from 1, such as "4".
        Default: by the usual names.
    radius : float, optional
        Radius of all spheres of a file without radii, m.
    scale : float, optional
        Factor by which lengths in the file, its box included, are multiplied to be in m. Default: by the unit that
        the file states, or 1.
    frame : int, optional
        Frame to read, counted from 0; -1 is the last. Default: the last.
    periodic : {"cell", "ignore"}, optional
        "cell": read the packing into a periodic cell, tilted or not, whether or not the file states that it is
        periodic. "ignore": read a periodic packing into a box with six walls; flow near these walls is not that of the
        bulk. Default: refuse a periodic packing.

    Returns
    -------
    Packing
        Its values are finite and its radii positive; `Packing.validate` checks the rest. `Packing.reading` says what
        was understood of the file.

    Raises
    ------
    InputError
        If the file cannot be read; names the file and the line.
    MissingExtraError
        If the format needs a package that is not installed.
    """
    if isinstance(box, Cell) and periodic is None:
        periodic = "cell"
    options = ReadOptions(columns or {}, radius, scale, frame, periodic).check(path)
    if format is not None and format not in _READERS:
        raise InputError(f"{path}: format '{format}' cannot be read. Give one of {', '.join(_READERS)}.")
    try:
        content = read_bytes(path)
    except CutOffError as error:
        return _beginning(path, format, error, options).packing(path, options, box)
    return _READERS[format or detected(path, content)](path, content, options).packing(path, options, box)


def _beginning(path: str | PathLike[str], format: str | None, error: CutOffError, options: ReadOptions) -> FileContent:
    """The whole frames in the beginning of a gzip file that is cut off, as a program leaves it that was stopped."""
    found = format or (detected(path, error.beginning) if error.beginning.strip() else "")
    if found not in _WITH_FRAMES:
        raise error
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # about the end, which is said below
            content = _READERS[found](path, error.beginning, options)
    except InputError:
        raise error from None
    note = f"the gzip file is cut off, and only its beginning is read: {counted(content.frames, 'whole frame')}"
    warnings.warn(f"{path}: {note}.", PackingFileWarning, stacklevel=3)
    return replace(content, notes=(*content.notes, note))


def write_packing(packing: Packing, path: str | PathLike[str], format: str | None = None) -> None:
    """Write a packing to a file, all of it or nothing. CSV and Yade text read back to the same numbers.

    Parameters
    ----------
    packing : Packing
    path : path
    format : {"csv", "yade", "vtk"}, optional
        Default: by the extension of the file (`EXTENSIONS`).

    Raises
    ------
    InputError
        If the file cannot be written.
    """
    if format is not None and format not in _WRITERS:
        raise InputError(f"{path}: format '{format}' cannot be written. Give one of {', '.join(_WRITERS)}.")
    found = format or EXTENSIONS.get(extension(path))
    if found not in _WRITERS or str(path).lower().endswith(".gz"):
        extensions = " ".join(suffix for suffix, name in EXTENSIONS.items() if name in _WRITERS)
        raise InputError(
            f"{path}: the extension tells no format that can be written. Use one of {extensions}, or give format as "
            f"one of {', '.join(_WRITERS)}."
        )
    _WRITERS[found](packing, path)
