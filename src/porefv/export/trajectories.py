"""Frames of a run for ParaView: grains, walls and contacts at times, listed in .pvd files.

A directory holds::

    grains.pvd     frames grains_000012000.vtp: centres with radii, velocities, spins and forces, and the box
    walls.pvd      frames walls_000012000.vtp: the six sides of the box with their velocities and forces
    contacts.pvd   frames contacts_000012000.vtp: a line per contact with its force

Numbers are those of steps, times in a .pvd are seconds. `Packing.read` reads grains.pvd and its frames.
"""

from __future__ import annotations

import os
import re
from collections.abc import Mapping
from contextlib import suppress
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Any
from xml.etree import ElementTree

import numpy as np

from porefv.dem.dem import DEM
from porefv.dem.measurements import Contacts
from porefv.errors import InputError, counted
from porefv.export.vtk_datasets import spheres_polydata
from porefv.export.vtk_files import attach, attach_provenance, cell_array, vtk_data_model, vtk_points, write_xml
from porefv.system.atomic_files import atomic_write

if TYPE_CHECKING:
    from vtkmodules.vtkCommonDataModel import vtkPolyData

SERIES = ("grains", "walls", "contacts")

# Corners of the box, numbered x + 2 y + 4 z, around each wall, counterclockwise seen from outside.
_SIDES = np.array([[0, 4, 6, 2], [1, 3, 7, 5], [0, 1, 5, 4], [2, 6, 7, 3], [0, 2, 3, 1], [4, 5, 7, 6]])


class Trajectory:
    """Frames of a run, a frame for each call of `write`.

    Each .pvd is replaced once its new frame is complete: ParaView can open it while the run goes on. A run that goes
    on from a checkpoint adds to the frames it finds; those of later steps, which it will take again, are dropped when
    it writes its first.

    Parameters
    ----------
    directory : path
        Made with its parents. It may hold earlier frames of this run.
    dem : DEM
    contacts : bool
        Write contacts, too.

    Raises
    ------
    InputError
        If the directory cannot be written, a .pvd in it cannot be read, or a run that has taken no step finds frames.
    MissingExtraError
        If VTK is not installed.

    Examples
    --------
    >>> from porefv.dem import DEM
    >>> dem = DEM(Packing.read("data/packings/n25_s1.csv"), gravity=(0.0, 0.0, -9.81))
    >>> trajectory = Trajectory("frames", dem)
    >>> for _ in range(3):
    ...     dem.run(10)
    ...     trajectory.write()
    >>> len(trajectory)
    3
    """

    def __init__(self, directory: str | PathLike[str], dem: DEM, contacts: bool = False):
        vtk_data_model()  # that it is there is known before a long run, not after it
        self.directory = Path(directory)
        self.dem = dem
        self.contacts = contacts
        try:
            self.directory.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise InputError(f"cannot make the directory {directory}: {error.strerror}. Choose another") from None
        if not os.access(self.directory, os.W_OK):
            raise InputError(f"cannot write in {directory}: it is write-protected. Choose another directory")
        # Time of each frame by its step.
        self._frames = {series: _read_pvd(self.directory, series) for series in SERIES}
        if dem.steps == 0 and len(self):
            raise InputError(
                f"{directory} holds a trajectory of {counted(len(self), 'frame')}, and this run is at its start. "
                "Choose another directory, or remove that one; to go on with it, load a checkpoint"
            )
        # Frames of steps to be taken again, to be dropped once there is something new.
        self._stale = [(series, step) for series, frames in self._frames.items() for step in frames if step > dem.steps]
        for series, step in self._stale:
            del self._frames[series][step]

    def write(
        self,
        fluid_forces: np.ndarray | None = None,
        wall_fluid_forces: np.ndarray | None = None,
        provenance: Mapping[str, Any] | None = None,
    ) -> None:
        """Add a frame of the grains as they are now, in place of one of the same step.

        Parameters
        ----------
        fluid_forces : (n, 3) array, optional
            Force of a fluid on each grain, besides `dem.applied`. With them grains and walls have `fluid_force` [N].
        wall_fluid_forces : (6, 3) array, optional
            Of the fluid on each wall [N].
        provenance : mapping, optional
            Further field data of the files, see `attach_provenance`.

        Raises
        ------
        InputError
            If a file cannot be written.
        """
        dem = self.dem
        contacts = dem.contacts
        n, of_contacts = len(dem), _contact_forces(dem, contacts)
        grains = {"contact_force": of_contacts[:n]}
        walls = {"contact_force": of_contacts[n:]}
        if fluid_forces is not None:
            # Buoyancy by the hydrostatic pressure, which the piezometric one leaves out, is what is applied.
            grains["fluid_force"] = dem.applied + fluid_forces
            walls["fluid_force"] = np.zeros((6, 3)) if wall_fluid_forces is None else wall_fluid_forces
        outside = grains.get("fluid_force", dem.applied)
        grains["force"] = grains["contact_force"] + outside + dem.masses[:, None] * dem.gravity
        walls["force"] = np.sum(list(walls.values()), axis=0)
        datasets = {"grains": _grains(dem, grains), "walls": _walls(dem, walls)}
        if self.contacts:
            datasets["contacts"] = _lines(dem, contacts)
        for series, dataset in datasets.items():
            box = {"box_lower": dem.box.lower, "box_upper": dem.box.upper}
            attach_provenance(dataset, {**box, "time": dem.time, **(provenance or {})})
            with atomic_write(self.directory / _name(series, dem.steps)) as temporary:
                write_xml(dataset, temporary)
            self._frames[series][dem.steps] = dem.time
        for series in {*datasets, *(series for series, _ in self._stale)}:
            _write_pvd(self.directory, series, self._frames[series])
        for series, step in self._stale:
            if step not in self._frames[series]:
                with suppress(OSError):
                    (self.directory / _name(series, step)).unlink()
        self._stale = []

    @property
    def times(self) -> list[float]:
        """Times of the frames [s]."""
        return [time for _, time in sorted(self._frames["grains"].items())]

    def __len__(self) -> int:
        return len(self._frames["grains"])

    def __repr__(self) -> str:
        last = f", to {self.times[-1]:.4g} s" if len(self) else ""
        return f"Trajectory({self.directory}, {counted(len(self), 'frame')}{last})"


# ---- frames ------------------------------------------------------------------------------------------------


def _contact_forces(dem: DEM, contacts: Contacts) -> np.ndarray:
    """(n + 6, 3): contact forces on each grain, then on each wall [N]."""
    i, j = contacts.grains.T
    n = len(dem)
    total = np.zeros((n + 6, 3))
    np.add.at(total, i, contacts.forces)
    np.subtract.at(total, j, contacts.forces)
    return total


def _grains(dem: DEM, forces: dict[str, np.ndarray]) -> vtkPolyData:
    return spheres_polydata(dem.packing, velocity=dem.velocities, spin=dem.spins, **forces)


def _walls(dem: DEM, forces: dict[str, np.ndarray]) -> vtkPolyData:
    corners = np.array([[dem.places[2 * axis + (k >> axis & 1)] for axis in range(3)] for k in range(8)])
    return _polydata(corners, {"wall": np.arange(6), "velocity": dem.wall_velocities, **forces}, polygons=_SIDES)


def _lines(dem: DEM, contacts: Contacts) -> vtkPolyData:
    """A line per contact, from the first grain's centre to the second's, or to the wall."""
    n = len(dem)
    i, j = contacts.grains.T
    walled = j >= n
    points = np.concatenate([dem.positions, contacts.points[walled]])
    ends = np.where(walled, n + np.cumsum(walled) - 1, j)
    data = {
        "grains": contacts.grains,
        "force": contacts.forces,
        "normal_force": -(contacts.forces * contacts.normals).sum(axis=1),
    }
    return _polydata(points, data, lines=np.stack([i, ends], axis=1))


def _polydata(
    points: np.ndarray, data: dict[str, np.ndarray], lines: np.ndarray | None = None, polygons: np.ndarray | None = None
) -> vtkPolyData:
    """Points, with lines or polygons that have data; there may be none, and the data then is empty, too."""
    polydata = vtk_data_model().vtkPolyData()
    polydata.SetPoints(vtk_points(points))
    if lines is not None:
        polydata.SetLines(cell_array(lines))
    if polygons is not None:
        polydata.SetPolys(cell_array(polygons))
    attach(polydata.GetCellData(), data, polydata.GetNumberOfCells())
    return polydata


# ---- lists of frames ---------------------------------------------------------------------------------------


def _name(series: str, step: int) -> str:
    return f"{series}_{step:09d}.vtp"


def _read_pvd(directory: Path, series: str) -> dict[int, float]:
    """Time of each frame by its step; empty if there is no such file."""
    path = directory / f"{series}.pvd"
    if not path.exists():
        return {}
    try:
        frames = {}
        for entry in ElementTree.parse(path).iter("DataSet"):
            name, time = entry.attrib["file"], float(entry.attrib["timestep"])
            match = re.fullmatch(rf"{series}_(\d+)\.vtp", name)
            if match is None:
                raise ValueError(f"{name} is not a frame of porefv")
            frames[int(match[1])] = time
        return frames
    except (OSError, ElementTree.ParseError, KeyError, ValueError) as error:
        raise InputError(
            f"{path} is not a list of frames of porefv, or it is damaged ({error}). Move it away, or choose another "
            "directory"
        ) from None


def _write_pvd(directory: Path, series: str, frames: dict[int, float]) -> None:
    write_list(directory / f"{series}.pvd", {_name(series, step): time for step, time in frames.items()})


def write_list(path: Path, frames: Mapping[str, float]) -> None:
    """Write a .pvd: the time of each file beside it [s]."""
    with atomic_write(path) as temporary, temporary.open("w", encoding="utf-8") as file:
        file.write('<?xml version="1.0"?>\n<VTKFile type="Collection" version="0.1">\n<Collection>\n')
        file.writelines(
            f'<DataSet timestep="{time!r}" part="0" file="{name}"/>\n' for name, time in sorted(frames.items())
        )
        file.write("</Collection>\n</VTKFile>\n")
