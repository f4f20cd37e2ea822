"""A script that shows a results directory in ParaView."""

from __future__ import annotations

import os
from importlib.resources import files
from os import PathLike
from pathlib import Path

from porefv.errors import FORCE_OPTION, InputError
from porefv.system.atomic_files import atomic_write, locked

# What there must be of `solve`, or of `simulate`.
_SHOWN = ("spheres.vtp", "frames/grains.pvd")


def write_script(directory: str | PathLike[str], path: str | PathLike[str], *, force: bool = False) -> Path:
    """Write a script for ParaView, a macro or one for pvpython, that shows results of `solve` or `simulate`.

    Parameters
    ----------
    directory : path
        The results; the script has their place.
    path : path
        With the extension .py.
    force : bool
        Replace a file that exists.

    Raises
    ------
    InputError
        For another extension, results without files for ParaView, or a file that exists or cannot be written.
    """
    directory, path = Path(directory), Path(path)
    if path.suffix != ".py":
        raise InputError(f"cannot write {path}: files of paraview need a name that ends in .py")
    if not any((directory / name).is_file() for name in _SHOWN):
        raise InputError(
            f"{directory} has neither {_SHOWN[0]} nor {_SHOWN[1]}: set vtk = true (porefv solve), or frames (porefv "
            "simulate), in the scene's [output], and compute again"
        )
    text = files("porefv.export").joinpath("paraview", "show.py").read_text(encoding="utf-8")
    text = text.replace('RESULTS = "results"', f"RESULTS = {str(directory.absolute())!r}", 1)
    with locked(path):
        if os.path.lexists(path) and not force:
            raise InputError(f"{path} exists. Choose another place, or replace it with {FORCE_OPTION}")
        with atomic_write(path) as temporary:
            temporary.write_text(text, encoding="utf-8")
    return path
