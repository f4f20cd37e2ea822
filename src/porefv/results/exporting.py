"""Results for other programs: the network as a dictionary of OpenPNM or as CSV files, the mesh of the pores by meshio.

Everything is taken from the results directory, which must have VTK files.
"""

from __future__ import annotations

import os
from collections.abc import Callable
from contextlib import ExitStack
from os import PathLike
from pathlib import Path
from typing import Any

import numpy as np

from porefv.errors import FORCE_OPTION, InputError
from porefv.export.meshio_mesh import meshio_from_vtk, mirror_wedges
from porefv.export.openpnm_network import openpnm_network
from porefv.flow.walls import Walls
from porefv.packing.box import WALLS
from porefv.results.csv_table import write_csv
from porefv.results.reading import Results
from porefv.system.atomic_files import atomic_write, finished_name, locked

# meshio's name of the format for each extension: formats that are one file and have all cells.
# In version 5.1 of .vtk meshio calls integers of 32 bits by a name that VTK does not read, which loses all fields.
MESH_FORMATS = {
    "inp": "abaqus", "mesh": "medit", "msh": "gmsh22", "nas": "nastran", "vtk": "vtk42", "vtu": "vtu",
}  # fmt: skip
# VTK files get the fields. The others get the number of the pore, which some write as a label of the cells. Gmsh wants
# labels of its own, and meshio cannot read files of Gmsh that have both these and fields.
_VTK_FILES = ("vtk", "vtu")
_GMSH_LABELS = ("gmsh:physical", "gmsh:geometrical")
FORMATS = ("openpnm", "csv", *MESH_FORMATS)


def export(results: Results, path: str | PathLike[str], to: str, *, force: bool = False) -> list[Path]:
    """Write results for another program.

    Parameters
    ----------
    results : Results
        With VTK files.
    path : path
        For "openpnm" a file .npz, for "csv" a directory, which is made if there is none; else a file with the extension
        of the format.
    to : str
        One of `FORMATS`. "openpnm": the arrays of `openpnm_network`, by name. "csv": pores.csv and throats.csv. Others:
        the mesh of the pores, written by meshio; "vtk" and "vtu" have its fields as cell data.
    force : bool
        Replace files that exist.

    Returns
    -------
    list of Path
        The files. Each appears when it is complete, or not at all.

    Raises
    ------
    InputError
        For an unknown format or an extension that is not the format's, results without what is needed, or a file that
        exists or cannot be written.
    MissingExtraError
        If meshio or pyvista is needed, and not installed.
    """
    path = Path(path)
    writers = _writers(results, path, to)
    with locked(path):
        existing = [target for target in writers if os.path.lexists(target)]
        if existing and not force:
            raise InputError(f"{existing[0]} exists. Choose another place, or replace it with {FORCE_OPTION}")
        if to == "csv":
            try:
                path.mkdir(parents=True, exist_ok=True)
                for name in os.listdir(path):  # what a process that was killed has left
                    if (finished := finished_name(name)) is not None and path / finished in writers:
                        (path / name).unlink()
            except OSError as error:
                raise InputError(f"cannot write {path}: {error.strerror}.") from None
        with ExitStack() as stack:  # all are complete before the first is in its place
            for target, write in writers.items():
                write(stack.enter_context(atomic_write(target)))
    return list(writers)


def pore_arrays(results: Results) -> dict[str, np.ndarray]:
    """Arrays of pores.vtu with a row per pore: volume, walls and, if asked for, pressure and velocity."""
    data = results.pores.cell_data
    _check(results, data, "walls", "pores.vtu")
    _, cell = np.unique(data["pore"], return_index=True)  # a cell of each pore
    return {name: np.asarray(data[name])[cell] for name in data if name != "pore"}


def throat_arrays(results: Results) -> tuple[np.ndarray, dict[str, np.ndarray]]:
    """Pores (t, 2) of each throat of throats.vtp, and its arrays with a row per throat."""
    data = results.throats.cell_data
    pairs = np.asarray(results.throats.lines).reshape(-1, 3)[:, 1:]
    return pairs, {name: np.asarray(data[name]) for name in data}


def to_openpnm(results: Results) -> dict[str, np.ndarray]:
    """The network of a results directory, as `PoreFlow.to_openpnm` returns it.

    Pressures are left out if the quantities do not have them.

    Raises
    ------
    InputError
        If the results have no VTK files, or those of the pores alone.
    """
    pairs, throat_data = throat_arrays(results)
    _check(results, throat_data, "conductance", "throats.vtp")
    walls = Walls.from_mapping(results.summary["walls"])
    points = np.asarray(results.throats.points)
    return openpnm_network(points, pairs, pore_data=pore_arrays(results), throat_data=throat_data, walls=walls)


def pore_table(results: Results) -> np.ndarray:
    """Structured array with a row per pore: its place, its volume, 1 for each wall that it touches, and the fields."""
    arrays = pore_arrays(results)
    walls = arrays.pop("walls").astype(int)
    x, y, z = np.asarray(results.throats.points).T
    columns = {"pore": np.arange(len(walls)), "x": x, "y": y, "z": z}
    columns |= {wall: (walls >> w) & 1 for w, wall in enumerate(WALLS)}
    return _table(columns | arrays)


def throat_table(results: Results) -> np.ndarray:
    """Structured array with a row per throat: its two pores, its geometry, and of a flow conductance and flux."""
    pairs, arrays = throat_arrays(results)
    first, second = pairs.T
    return _table({"throat": np.arange(len(pairs)), "first_pore": first, "second_pore": second} | arrays)


def _writers(results: Results, path: Path, to: str) -> dict[Path, Callable[[Path], Any]]:
    """What writes each file that is wanted."""
    if to not in FORMATS:
        raise InputError(f"unknown format {to!r}; known: {', '.join(FORMATS)}")
    if to == "csv":
        if path.exists() and not path.is_dir():
            raise InputError(f"cannot write {path}: csv needs a directory, for pores.csv and throats.csv")
        pores, throats = pore_table(results), throat_table(results)
        return {
            path / "pores.csv": lambda temporary: write_csv(pores, temporary),
            path / "throats.csv": lambda temporary: write_csv(throats, temporary),
        }
    extension = "npz" if to == "openpnm" else to
    if path.suffix != f".{extension}":
        raise InputError(f"cannot write {path}: files of {to} need a name that ends in .{extension}")
    if to == "openpnm":
        network: dict[str, Any] = to_openpnm(results)
        return {path: lambda temporary: np.savez_compressed(temporary, **network)}
    mesh = meshio_from_vtk(results.pores)
    if to in _VTK_FILES:
        mirror_wedges(mesh)
    else:
        mesh.cell_data = {"pore": mesh.cell_data["pore"]}
    if to == "msh":
        mesh.cell_data = {key: [np.ones(len(block.data), int) for block in mesh.cells] for key in _GMSH_LABELS}
    return {path: lambda temporary: mesh.write(temporary, file_format=MESH_FORMATS[to])}


def _check(results: Results, arrays: Any, name: str, file: str) -> None:
    if name not in arrays:
        raise InputError(f"{file} of {results.directory} has no {name}, which is needed here. Solve again.")


def _table(columns: dict[str, np.ndarray]) -> np.ndarray:
    """Structured array of columns; a vector (rows, 3) is three of them."""
    single: dict[str, np.ndarray] = {}
    for name, values in columns.items():
        single |= {name: values} if values.ndim == 1 else {f"{name}_{x}": values[:, k] for k, x in enumerate("xyz")}
    kinds = {name: int if values.dtype.kind in "iu" else float for name, values in single.items()}
    table = np.empty(len(next(iter(single.values()))), dtype=list(kinds.items()))
    for name, values in single.items():
        table[name] = values
    return table
