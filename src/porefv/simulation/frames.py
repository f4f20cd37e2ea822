"""Frames of a simulation for ParaView: those of the grains, and the pores with their pressures."""

from __future__ import annotations

from pathlib import Path

from porefv.coupling.coupling import Coupling
from porefv.dem.dem import DEM
from porefv.export.trajectories import Trajectory, write_list
from porefv.export.vtk_datasets import cells_grid
from porefv.export.vtk_files import write_xml
from porefv.system.atomic_files import atomic_write

# Time of each frame of the pores, by its step.
PoreFrames = dict[int, float]


class Frames:
    """Frames in a directory, a frame for each call of `write`; pores.pvd besides what `Trajectory` writes.

    Parameters
    ----------
    directory : Path
    dem : DEM
    contacts : bool
    pores : dict
        Time of each frame of the pores that there is already, by its step.
    """

    def __init__(self, directory: Path, dem: DEM, contacts: bool, pores: PoreFrames):
        self.directory = directory
        self.pores = dict(pores)
        self._grains = Trajectory(directory, dem, contacts)

    def write(self, dem: DEM, coupling: Coupling | None) -> None:
        """Add a frame of the grains, and of the pores where there is a fluid."""
        self._grains.write()
        if coupling is not None:
            mesh = coupling.mesh
            grid = cells_grid(mesh, volume=mesh.pore_volumes, pressure=coupling.pressure)
            with atomic_write(self.directory / _name(dem.steps)) as temporary:
                write_xml(grid, temporary)
            self.pores[dem.steps] = dem.time
            write_list(self.directory / "pores.pvd", {_name(step): time for step, time in self.pores.items()})


def _name(step: int) -> str:
    return f"pores_{step:09d}.vtu"
