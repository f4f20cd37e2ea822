"""Frames of a simulation for ParaView: those of the grains, the pores with their pressures, and the throats.

Names are those of the files of `porefv.results.writing`.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from porefv.coupling.coupling import Coupling
from porefv.dem.dem import DEM
from porefv.export.trajectories import Trajectory, write_list
from porefv.export.vtk_datasets import cells_grid, flux_data, throats_polydata
from porefv.export.vtk_files import attach_provenance, write_xml
from porefv.flow.fluid import Fluid
from porefv.flow.flux import net_outflows, wall_face_fluxes
from porefv.flow.velocity import pore_velocities
from porefv.mesh.pore_mesh import PoreMesh
from porefv.system.atomic_files import atomic_write

# Time of each frame of the pores, by its step.
PoreFrames = dict[int, float]


@dataclass(frozen=True)
class FrameContent:
    """What frames have besides the grains and walls.

    Attributes
    ----------
    contacts : bool
        The contacts.
    velocity : bool
        The velocity in the pores.
    throats : bool
        The throats.
    fluid : Fluid or None
        That of the simulation. With one, every frame has the pores and the force of the fluid, so that a view of
        them holds for the dry stages, too.
    scene : str or None
        Name of the scene file.
    """

    contacts: bool
    velocity: bool
    throats: bool
    fluid: Fluid | None
    scene: str | None


class Frames:
    """Frames in a directory, a frame for each call of `write`; the fluid's besides what `Trajectory` writes.

    With a fluid there are ``pores.pvd`` and, if asked for, ``throats.pvd``. They have the times of ``grains.pvd``. In
    dry stages pressure, velocity and flux are NaN.

    Parameters
    ----------
    directory : Path
    dem : DEM
    content : FrameContent
    pores : dict
        Time of each frame of the pores that there is already, by its step.
    """

    def __init__(self, directory: Path, dem: DEM, content: FrameContent, pores: PoreFrames):
        self.directory = directory
        self.pores = dict(pores)
        self._content = content
        self._grains = Trajectory(directory, dem, content.contacts)

    def write(self, dem: DEM, coupling: Coupling | None, slip: np.ndarray) -> None:
        """Add a frame of the grains and, where the simulation has a fluid, of the pores and throats.

        Walls with slip are `slip`, (6,) bool.
        """
        content = self._content
        provenance: dict[str, Any] = {} if content.scene is None else {"scene": content.scene}
        if content.fluid is None:
            self._grains.write(provenance=provenance)
            return
        provenance["viscosity"] = content.fluid.viscosity
        forces = np.zeros((len(dem), 3)) if coupling is None else coupling.fluid_forces
        self._grains.write(forces, None if coupling is None else coupling.wall_fluid_forces, provenance)
        provenance |= {"box_lower": dem.box.lower, "box_upper": dem.box.upper, "time": dem.time}
        for series, dataset in self._of_fluid(dem, coupling, slip).items():
            attach_provenance(dataset, provenance)
            with atomic_write(self.directory / _name(series, dem.steps)) as temporary:
                write_xml(dataset, temporary)
        self.pores[dem.steps] = dem.time
        for series in ("pores", "throats") if content.throats else ("pores",):
            frames = {_name(series, step): time for step, time in self.pores.items()}
            write_list(self.directory / f"{series}.pvd", frames)

    def _of_fluid(self, dem: DEM, coupling: Coupling | None, slip: np.ndarray) -> dict[str, Any]:
        """Datasets of the pores and, if asked for, of the throats."""
        content = self._content
        mesh = PoreMesh(dem.packing) if coupling is None else coupling.mesh
        pressure = np.full(mesh.n_pores, np.nan) if coupling is None else coupling.pressure
        pores = {"volume": mesh.pore_volumes, "walls": mesh.pore_walls, "pressure": pressure}
        if content.velocity:
            pores["velocity"] = np.full((mesh.n_pores, 3), np.nan) if coupling is None else _velocities(coupling)
        datasets: dict[str, Any] = {"pores": cells_grid(mesh, **pores)}
        if content.throats:
            throats = mesh.throats
            flux = np.full(len(throats), np.nan) if coupling is None else _flux(coupling)
            data = {"length": throats.lengths, "area": throats.areas, "fluid_area": throats.fluid_areas}
            data |= flux_data(throats, flux, slip)
            datasets["throats"] = throats_polydata(throats, {"pressure": pressure}, **data)
        return datasets


def _flux(coupling: Coupling) -> np.ndarray:
    """(t,): flux through each throat, relative to the grains around it [m³/s]."""
    i, j = coupling.mesh.throats.pores.T
    pressure = coupling.pressure
    return coupling.equation.conductances * (pressure[i] - pressure[j])


def _velocities(coupling: Coupling) -> np.ndarray:
    """(n_pores, 3): mean velocity of the fluid in each pore, relative to the grains [m/s].

    What pores lose or gain in volume is a source in them.
    """
    mesh, flux = coupling.mesh, _flux(coupling)
    held = ~np.isnan(coupling.walls.pressures)
    outflows = net_outflows(mesh, flux)
    face_flux = wall_face_fluxes(mesh, outflows, held)
    through_walls = np.bincount(mesh.cell_pore[mesh.wall_faces.cells], face_flux, mesh.n_pores)
    return pore_velocities(mesh, flux, face_flux, outflows - through_walls)


def _name(series: str, step: int) -> str:
    return f"{series}_{step:09d}.{'vtu' if series == 'pores' else 'vtp'}"
