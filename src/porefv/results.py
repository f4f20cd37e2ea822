"""Results directories: computed, written whole or not at all, and read back.

A directory holds what was asked for of::

    summary.json   numbers of the whole sample, what was done and how long it took
    forces.csv     forces on every sphere, then on the six walls
    pores.vtu      the space-filling mesh: pressure, void volume and velocity of the pores
    spheres.vtp    centres with radii and forces
    throats.vtp    the network: flux, conductance, hydraulic radius and length of the throats
"""

from __future__ import annotations

import json
import os
from collections.abc import Collection, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from functools import cached_property
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from porefv import extras
from porefv.errors import InputError
from porefv.io.atomic import atomic_directory
from porefv.packing import WALLS
from porefv.progress import Progress
from porefv.summary import summary_json

if TYPE_CHECKING:
    import pyvista

    from porefv.flow import PoreFlow
    from porefv.mesh import PoreMesh

QUANTITIES = ("permeability", "pressure", "forces")
FILES = ("summary.json", "forces.csv", "pores.vtu", "spheres.vtp", "throats.vtp")

_PARTS = ("pressure", "viscous", "buoyancy", "total")
_COLUMNS = ("id", "x", "y", "z", "radius", *(f"{part}_{axis}" for part in _PARTS for axis in "xyz"))


# ---- computing and writing -----------------------------------------------------------------------------


def write(
    flow: PoreFlow,
    directory: str | PathLike[str],
    *,
    quantities: Collection[str] = QUANTITIES,
    vtk: bool = True,
    force: bool = False,
) -> Path:
    """Compute what is asked for, as far as it is not yet, and write a results directory.

    Parameters
    ----------
    flow : PoreFlow
    directory : path
        Made with its parents; must not exist, or be empty.
    quantities : collection of str
        Among `QUANTITIES`.
    vtk : bool
        Write pores.vtu, spheres.vtp and throats.vtp.
    force : bool
        Replace results that exist.

    Raises
    ------
    InputError
        For an unknown quantity, or if the results cannot be written: before anything is computed.
    """
    unknown = [quantity for quantity in quantities if quantity not in QUANTITIES]
    if unknown:
        raise InputError(f"unknown quantity {unknown[0]!r}; known: {', '.join(QUANTITIES)}")
    with writing(directory, force=force, vtk=vtk) as folder:
        save(folder, flow.mesh, flow, quantities=quantities, vtk=vtk)
    return Path(directory)


@contextmanager
def writing(directory: str | PathLike[str], *, force: bool, vtk: bool) -> Iterator[Path]:
    """A temporary folder that becomes the results directory if the block succeeds; see `check_target`."""
    check_target(directory, vtk=vtk)
    with atomic_directory(directory, force=force) as folder:
        yield folder


def check_target(directory: str | PathLike[str], *, vtk: bool) -> None:
    """Refuse, before anything is computed, a directory that cannot be written or replaced.

    Raises
    ------
    InputError
        If it holds results and other things besides, or its parent is not writable.
    MissingExtraError
        If `vtk` is asked for and VTK is not installed.
    """
    if vtk:
        from porefv.vtk_mesh import vtk_data_model

        vtk_data_model()
    directory = Path(directory)
    try:
        content = sorted(os.listdir(directory)) if directory.is_dir() else []
        existing = next(parent for parent in directory.absolute().parents if parent.exists())
    except OSError as error:
        raise InputError(f"cannot write {directory}: {error.strerror}.") from None
    foreign = [name for name in content if name not in FILES]
    if "summary.json" in content and foreign:
        raise InputError(
            f"{directory} holds {foreign[0]}, which is not a file of the results, and would be lost. "
            "Move it, or choose another directory."
        )
    if not (existing.is_dir() and os.access(existing, os.W_OK)):
        raise InputError(f"cannot write {directory}: {existing} is not a directory that may be written to.")


def stages(quantities: Collection[str], vtk: bool) -> tuple[str, ...]:
    """Stages of `save`, in order."""
    asked = {
        "throats": bool(quantities),
        "pressure": bool(quantities),
        "forces": "forces" in quantities,
        "velocities": vtk and "pressure" in quantities,
    }
    return ("triangulation", *(stage for stage, wanted in asked.items() if wanted), "writing")


def save(
    folder: Path,
    mesh: PoreMesh,
    flow: PoreFlow | None,
    *,
    quantities: Collection[str],
    vtk: bool,
    progress: Progress | None = None,
    scene: str | None = None,
    packing: str | None = None,
) -> None:
    """Compute, stage by stage, and write into an empty folder; without a flow, the mesh alone."""
    progress = progress or Progress(quiet=True)
    with progress.stage("triangulation"):
        mesh.n_pores  # noqa: B018 - computed here
    if flow is not None:
        with progress.stage("throats"):
            flow.conductances  # noqa: B018
        with progress.stage("pressure"):
            flow.solution  # noqa: B018
        if "forces" in quantities:
            with progress.stage("forces"):
                flow.forces  # noqa: B018
        if vtk and "pressure" in quantities:
            with progress.stage("velocities"):
                flow.pore_velocity  # noqa: B018
    with progress.stage("writing"):
        if flow is not None and "forces" in quantities:
            _write_forces(flow, folder / "forces.csv")
        if vtk:
            _write_vtk(folder, mesh, flow, quantities)
    text = summary_json(
        mesh, flow, quantities=quantities, vtk=vtk, seconds=progress.seconds, scene=scene, packing=packing
    )
    (folder / "summary.json").write_text(text, encoding="utf-8")


def _write_forces(flow: PoreFlow, path: Path) -> None:
    packing, box, forces = flow.mesh.packing, flow.mesh.box, flow.forces
    middle = 0.5 * (box.lower + box.upper)
    positions = np.tile(middle, (6, 1))
    for wall in range(6):
        positions[wall, wall // 2] = (box.upper if wall % 2 else box.lower)[wall // 2]
    on_spheres = np.column_stack([packing.centres, packing.radii, *(getattr(forces, part) for part in _PARTS)]) + 0.0
    on_walls = np.column_stack([positions, *(getattr(forces, f"wall_{part}") for part in _PARTS)]) + 0.0  # no -0.0
    with path.open("w", encoding="utf-8") as file:
        file.write(",".join(_COLUMNS) + "\n")
        # repr gives the shortest text that reads back to the same number.
        file.writelines(f"{k},{','.join(map(repr, row))}\n" for k, row in enumerate(on_spheres.tolist()))
        for name, row in zip(WALLS, on_walls.tolist(), strict=True):
            file.write(",".join([name, *map(repr, row[:3]), "", *map(repr, row[3:])]) + "\n")


def _write_vtk(folder: Path, mesh: PoreMesh, flow: PoreFlow | None, quantities: Collection[str]) -> None:
    from porefv.vtk_mesh import cells_grid, spheres_polydata, throats_polydata, write_xml

    pores = {"volume": mesh.pore_volumes}
    throats = {
        "length": mesh.throats.lengths,
        "area": mesh.throats.areas,
        "fluid_area": mesh.throats.fluid_areas,
    }
    spheres = {}
    if flow is not None:
        surfaces = mesh.throats.wetted_surfaces(flow.walls.slip)
        throats["hydraulic_radius"] = np.divide(
            mesh.throats.volumes, surfaces, out=np.zeros(len(surfaces)), where=surfaces > 0.0
        )
        throats["conductance"] = flow.conductances
        throats["flux"] = flow.flux
        if "pressure" in quantities:
            pores["pressure"] = flow.pressure
            pores["velocity"] = flow.pore_velocity
        if "forces" in quantities:
            spheres = {f"{part}_force": getattr(flow.forces, part) for part in _PARTS}
    write_xml(cells_grid(mesh, **pores), folder / "pores.vtu")
    write_xml(spheres_polydata(mesh.packing, **spheres), folder / "spheres.vtp")
    write_xml(throats_polydata(mesh.throats, **throats), folder / "throats.vtp")


# ---- reading -------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Results:
    """A results directory.

    Attributes
    ----------
    directory : Path
    summary : dict
        The content of summary.json.
    """

    directory: Path
    summary: dict[str, Any]

    @cached_property
    def forces(self) -> np.ndarray:
        """Structured array of forces.csv: a row per sphere, then per wall, whose radius is NaN.

        Raises
        ------
        InputError
            If forces were not asked for.
        """
        path = self._file("forces.csv", 'add "forces" to the quantities')
        try:
            header, *lines = path.read_text(encoding="utf-8").splitlines()
            if header != ",".join(_COLUMNS):
                raise ValueError("its first line does not name the columns")
            rows = [_force_row(number, line) for number, line in enumerate(lines, 2)]
            if [row[0] for row in rows[-6:]] != list(WALLS):
                raise ValueError("it does not end with the six walls")
        except (OSError, ValueError) as error:
            raise InputError(f"{path} is damaged: {error}. Solve again.") from None
        return np.array(rows, dtype=[("id", "U16"), *((name, float) for name in _COLUMNS[1:])])

    @cached_property
    def pores(self) -> pyvista.UnstructuredGrid:
        """The mesh of pores.vtu; InputError without VTK files, as for `spheres` and `throats`."""
        return self._read_vtk("pores.vtu")

    @cached_property
    def spheres(self) -> pyvista.PolyData:
        """The points of spheres.vtp."""
        return self._read_vtk("spheres.vtp")

    @cached_property
    def throats(self) -> pyvista.PolyData:
        """The network of throats.vtp."""
        return self._read_vtk("throats.vtp")

    def _file(self, name: str, remedy: str) -> Path:
        path = self.directory / name
        if not path.is_file():
            raise InputError(f"{self.directory} has no {name}: {remedy} in the scene's [output], and solve again.")
        return path

    def _read_vtk(self, name: str) -> Any:
        path = self._file(name, "set vtk = true")
        return extras.load("pyvista", f"Reading {name}").read(path)


def _force_row(number: int, line: str) -> tuple[Any, ...]:
    """A line of forces.csv: name and numbers."""
    name, *cells = line.split(",")
    if name in WALLS and len(cells) > 3 and cells[3] == "":
        cells[3] = "nan"
    elif "nan" in cells:
        raise ValueError(f"line {number} lacks a number")
    if len(cells) != len(_COLUMNS) - 1:
        raise ValueError(f"line {number} has {len(cells) + 1} cells instead of {len(_COLUMNS)}")
    return name, *map(float, cells)


def read(directory: str | PathLike[str]) -> Results:
    """Read a results directory: its summary now, the rest when asked for.

    Raises
    ------
    InputError
        If it is not a results directory, or its summary is damaged.
    """
    directory = Path(directory)
    path = directory / "summary.json"
    try:
        summary = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError, RecursionError) as error:
        reason = error.strerror if isinstance(error, OSError) else f"summary.json is damaged ({error})"
        raise InputError(f"{directory} holds no results of porefv solve: {reason}") from None
    if not isinstance(summary, dict) or "packing" not in summary:
        raise InputError(f"{directory} holds no results of porefv solve: its summary.json is another program's")
    return Results(directory, summary)
