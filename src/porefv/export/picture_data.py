"""What pictures are drawn from: plain arrays of grains, cells, pores and throats."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from porefv.errors import InputError
from porefv.flow.paths import Paths
from porefv.flow.pore_flow import PoreFlow
from porefv.flow.walls import Walls
from porefv.mesh.cell_mesh import CellMesh
from porefv.mesh.polyhedra import Polyhedra, polyhedra
from porefv.mesh.pore_mesh import PoreMesh
from porefv.packing.box import Box
from porefv.packing.packing import Packing

# What each kind of picture needs. What it also shows, if there is such, is in `SHOWN_TOO`.
NEEDED = {
    "packing": (),
    "forces": ("force",),
    "pressure": ("cells", "pressure"),
    "network": ("network",),
    "throats": ("network",),
    "paths": ("paths",),
    "section": (),
    "velocity": ("cells", "velocity"),
}
SHOWN_TOO = {"forces": ("cells", "pressure"), "network": ("pressure", "flux"), "throats": ("flux",),
             "section": ("cells", "pressure")}  # fmt: skip
KINDS = tuple(NEEDED)
# Paths of a picture, with a seed that makes it the same each time.
PATHS = 200
SECTIONS = ("section", "velocity")  # drawn in a plane


@dataclass(frozen=True, eq=False)
class Cells:
    """The cells of a mesh, and the pore of each, (m,)."""

    polyhedra: Polyhedra
    pore: np.ndarray


@dataclass(frozen=True, eq=False)
class Network:
    """Pores as points, throats between them.

    Attributes
    ----------
    points : (p, 3) array
        Laguerre vertex of each pore [m].
    pores : (t, 2) int array
        Pores of each throat.
    fluid_areas : (t,) array
        A^f [m²].
    """

    points: np.ndarray
    pores: np.ndarray
    fluid_areas: np.ndarray


@dataclass(frozen=True, eq=False)
class PictureData:
    """What a picture shows.

    Attributes
    ----------
    centres, radii : (n, 3), (n,) arrays
        Of the grains [m].
    box : Box
    walls : Walls or None
        With all pressures known; for the sense of the flow.
    force : (n, 3) array or None
        On each grain [N].
    cells : Cells or None
    network : Network or None
    pressure, velocity : (p,), (p, 3) arrays or None
        Of each pore [Pa, m/s].
    flux : (t,) array or None
        Of each throat [m³/s].
    paths : Paths or None
        Of particles.
    missing : function
        What to say of a quantity that is needed and is not here.
    """

    centres: np.ndarray
    radii: np.ndarray
    box: Box
    walls: Walls | None = None
    force: np.ndarray | None = None
    cells: Cells | None = None
    network: Network | None = None
    pressure: np.ndarray | None = None
    velocity: np.ndarray | None = None
    flux: np.ndarray | None = None
    paths: Paths | None = None
    missing: Callable[[str], str] = "there is no {} to draw".format

    @property
    def axis(self) -> int | None:
        """The axis along which the walls drive the flow."""
        return None if self.walls is None else self.walls.axis

    def with_parts(self, what: str, parts: dict[str, Callable[[], Any]]) -> PictureData:
        """These data and those that a kind of picture shows, of those that can be computed."""
        check_kind(what)
        wanted = (*NEEDED[what], *SHOWN_TOO.get(what, ()))
        found = replace(self, **{name: parts[name]() for name in wanted if name in parts})
        for name in NEEDED[what]:
            if getattr(found, name) is None:
                raise InputError(self.missing(name))
        return found


def check_kind(what: str) -> None:
    """Refuse what is no kind of picture."""
    if what not in KINDS:
        raise InputError(f"there is no picture {what!r}; there are: {', '.join(KINDS)}")


def data_of_packing(packing: Packing, what: str = "packing") -> PictureData:
    """Data of a packing, in its box or, without one, in its bounding box."""
    box = packing.bounding_box if packing.walled_box is None else packing.walled_box
    data = PictureData(packing.centres, packing.radii, box, missing=_needs_a_flow)
    return data.with_parts(what, {})


def data_of_mesh(mesh: PoreMesh, what: str = "section") -> PictureData:
    """Data of a mesh without a flow."""
    data = PictureData(mesh.packing.centres, mesh.packing.radii, mesh.box, missing=_needs_a_flow)
    return data.with_parts(what, _parts_of_mesh(mesh))


def data_of_flow(flow: PoreFlow, what: str = "forces") -> PictureData:
    """Data of a flow: what the picture shows is computed, if it is not yet."""
    mesh = flow.mesh
    parts = _parts_of_mesh(mesh) | {
        "force": lambda: flow.forces.total,
        "pressure": lambda: flow.pressure,
        "velocity": lambda: flow.pore_velocity,
        "flux": lambda: flow.flux,
        "paths": lambda: flow.paths(PATHS, seed=1),
    }
    data = PictureData(mesh.packing.centres, mesh.packing.radii, mesh.box, walls=flow.walls_at_pressures)
    return data.with_parts(what, parts)


def _parts_of_mesh(mesh: PoreMesh) -> dict[str, Callable[[], Any]]:
    return {"cells": lambda: cells_of_mesh(mesh), "network": lambda: _network_of_mesh(mesh)}


def cells_of_mesh(mesh: CellMesh) -> Cells:
    """The cells of a mesh; without pores, each cell is one."""
    return Cells(polyhedra(mesh), mesh.cell_pore if isinstance(mesh, PoreMesh) else np.arange(mesh.n_cells))


def _network_of_mesh(mesh: PoreMesh) -> Network:
    areas = np.where(mesh.throats.closed, 0.0, mesh.throats.fluid_areas)
    return Network(mesh.pore_centres, mesh.throats.pores, areas)


def _needs_a_flow(name: str) -> str:
    return f"the picture needs the {name} of a flow, and there is none: solve one first (PoreFlow, or porefv solve)"
