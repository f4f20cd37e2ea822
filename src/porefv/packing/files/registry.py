"""Which format a packing file has, and who reads and writes it."""

from os import PathLike
from pathlib import Path

from porefv.errors import InputError
from porefv.packing.box import Box
from porefv.packing.files import csv, lammps, vtk, yade
from porefv.packing.packing import Packing

_READERS = {"csv": csv.read, "yade": yade.read, "lammps": lammps.read, "vtk": vtk.read}
_WRITERS = {"csv": csv.write, "yade": yade.write, "vtk": vtk.write}

# Format of each file extension.
EXTENSIONS = {
    ".csv": "csv",
    ".txt": "yade",
    ".spheres": "yade",
    ".yade": "yade",
    ".lammps": "lammps",
    ".lmp": "lammps",
    ".data": "lammps",
    ".dump": "lammps",
    ".lammpstrj": "lammps",
    ".vtk": "vtk",
    ".vtp": "vtk",
    ".vtu": "vtk",
}


def read_packing(path: str | PathLike[str], format: str | None = None, box: Box | None = None) -> Packing:
    """Read a packing file.

    Parameters
    ----------
    path : path
    format : {"csv", "yade", "lammps", "vtk"}, optional
        Default: by the extension of the file (`EXTENSIONS`).
    box : Box, optional
        Box to use instead of the one in the file.

    Returns
    -------
    Packing
        Its values are finite and its radii positive; `Packing.validate` checks the rest.

    Raises
    ------
    InputError
        If the file cannot be read; names the file and the line.
    MissingExtraError
        If the format needs a package that is not installed.
    """
    packing = _READERS[_format(path, format, _READERS, "read")](path)
    return packing if box is None else packing.with_box(box)


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
    _WRITERS[_format(path, format, _WRITERS, "written")](packing, path)


def _format(path: str | PathLike[str], format: str | None, known: dict, done: str) -> str:
    if format is None:
        suffix = Path(path).suffix.lower()
        if EXTENSIONS.get(suffix) not in known:
            extensions = " ".join(suffix for suffix, name in EXTENSIONS.items() if name in known)
            raise InputError(
                f"{path}: the extension '{suffix}' tells no format that can be {done}. "
                f"Use one of {extensions}, or give format as one of {', '.join(known)}."
            )
        return EXTENSIONS[suffix]
    if format not in known:
        raise InputError(f"{path}: format '{format}' cannot be {done}. Give one of {', '.join(known)}.")
    return format
