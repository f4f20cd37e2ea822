"""The format of a packing file: by its content, and then by its extension."""

from __future__ import annotations

import re
from pathlib import Path

from porefv.errors import InputError
from porefv.packing.files.mercury import is_mercury
from porefv.packing.files.text import AnyPath

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
    ".liggghts": "lammps",
    ".vtk": "vtk",
    ".vtp": "vtk",
    ".vtu": "vtk",
    ".pvd": "pvd",
    ".geo": "esys",
    ".xyz": "xyz",
    ".xyzd": "xyzd",
}

_BEGINNING = 20_000  # bytes in which the format shows


def extension(path: AnyPath) -> str:
    """The extension of a file in lower case, without the .gz of a compressed one."""
    name = Path(path)
    return (name.with_suffix("") if name.suffix.lower() == ".gz" else name).suffix.lower()


def detected(path: AnyPath, content: bytes) -> str:
    """The format of a file.

    Raises
    ------
    InputError
        If neither the content nor the extension tells it.
    """
    suffix = extension(path)
    if suffix == ".xyzd":  # binary, without a mark
        return "xyzd"
    found = _by_content(content[:_BEGINNING]) or EXTENSIONS.get(suffix)
    if found is None and b"\0" not in content[:_BEGINNING]:
        return "csv"  # whose reader says what it lacks
    if found is None:
        raise InputError(
            f"{path}: neither the content nor the extension '{suffix}' tells its format. Known extensions are "
            f"{' '.join(EXTENSIONS)}."
        )
    return found


def _by_content(beginning: bytes) -> str | None:
    text = beginning.decode("utf-8-sig", errors="replace").lstrip()
    if text.startswith(("<?xml", "<VTKFile")):
        return "pvd" if re.search(r"<VTKFile[^>]*type=[\"']Collection", text[:2000]) else "vtk"
    for mark, format in (("# vtk DataFile", "vtk"), ("ITEM:", "lammps"), ("LSMGeometry", "esys")):
        if text.startswith(mark):
            return format
    lines = text.splitlines()
    rows = [line.split() for line in lines[:3]]
    if len(rows) > 1:
        if re.fullmatch("[0-9]{1,15}", lines[0].strip()) and re.search(r"\b(Lattice|Properties)\s*=", lines[1], re.I):
            return "xyz"
        if is_mercury(rows[0], rows[1]):
            return "mercury"
    if any(re.fullmatch(r"[0-9]+\s+atoms", line.partition("#")[0].strip()) for line in lines[:50]):
        return "lammps"
    return None
