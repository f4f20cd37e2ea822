"""Pictures of a results directory, and of the quantities in it."""

from __future__ import annotations

from collections.abc import Mapping
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from porefv.export import pictures
from porefv.export.picture_data import SECTIONS, Cells, Network, PictureData, check_kind
from porefv.export.picture_output import FORMATS_2D, FORMATS_3D, Picture
from porefv.export.picture_style import SIZE, PictureSize
from porefv.flow.walls import Walls
from porefv.mesh.polyhedra import Polyhedra
from porefv.packing.box import WALLS, Box
from porefv.results.quantity_pictures import QUANTITY_PICTURES, quantity_picture
from porefv.results.reading import Results
from porefv.system.atomic_files import picture_target

if TYPE_CHECKING:
    import pyvista

# What `porefv plot --what` draws of results. Results hold no paths: `porefv plot` solves the flow again for them.
PICTURES = (*pictures.KINDS, *QUANTITY_PICTURES)


def draw(results: Results, path: str | PathLike[str], what: str | None = None, **options: Any) -> Picture:
    """Write a picture of a results directory: PNG; SVG or PDF of a diagram; HTML in three dimensions.

    Parameters
    ----------
    results : Results
    path : path
    what, **options
        As of `results_picture`.

    Returns
    -------
    Picture
        What was written.

    Raises
    ------
    InputError
        If the results do not have what is to be drawn, or the picture cannot be written.
    ComputationError
        If this machine cannot draw.
    """
    what = what or default_kind(results)
    picture_target(path, formats_of(what))  # before it is drawn
    found = results_picture(results, what, **options)
    found.save(path)
    return found


def formats_of(what: str) -> tuple[str, ...]:
    """Endings of the files that a picture, one of `PICTURES`, can be saved as."""
    return FORMATS_2D if what in SECTIONS or what in QUANTITY_PICTURES else FORMATS_3D


def default_kind(results: Results) -> str:
    """The picture that shows most of the results."""
    if "fluid_force" in results.spheres.point_data:
        return "forces"
    return "pressure" if "pressure" in results.pores.cell_data else "packing"


def results_picture(
    results: Results,
    what: str | None = None,
    *,
    axis: str | None = None,
    at: float | None = None,
    size: PictureSize | tuple[int, int] = SIZE,
    dpi: float | None = None,
) -> Picture:
    """A picture of a results directory.

    Parameters
    ----------
    results : Results
    what : str, optional
        One of `PICTURES`: of `porefv.export.picture`, or a quantity. By default what shows most of the results.
    axis, at, size, dpi
        As of `porefv.export.picture`.
    """
    what = what or default_kind(results)
    if what in QUANTITY_PICTURES:
        return quantity_picture(results, what, size=size, dpi=dpi)
    data = _data(results, what)
    return pictures.draw(data, what, axis=axis, at=at, title=title_of(results), size=size, dpi=dpi)


def title_of(results: Results) -> str:
    """The title of a picture: scene, number of spheres and permeability."""
    summary = results.summary
    title = f"{Path(summary['scene']).stem}: " if summary["scene"] else ""
    title += f"{summary['packing']['spheres']} spheres"
    if "permeability" in summary:
        title += f",  k = {summary['permeability']:.4g} m²"
    return title


def _data(results: Results, what: str) -> PictureData:
    """What a kind of picture shows of the results; InputError with the remedy if they do not have it."""
    check_kind(what)
    spheres, pores = results.spheres, results.pores
    parts = {
        "cells": lambda: _cells(pores),
        "network": lambda: _network(results.throats),
        "pressure": lambda: _by_pore(pores, "pressure"),
        "velocity": lambda: _by_pore(pores, "velocity"),
        "force": lambda: spheres.point_data.get("fluid_force"),
        "flux": lambda: results.throats.cell_data.get("flux"),
    }
    data = PictureData(
        np.asarray(spheres.points, float), np.asarray(spheres["radius"]), Box.between(pores.bounds),
        walls=_walls_at_pressures(results.summary), missing=lambda name: _remedy(results, name),
    )  # fmt: skip
    return data.with_parts(what, parts)


def _cells(pores: pyvista.UnstructuredGrid) -> Cells:
    solids = Polyhedra(np.asarray(pores.points, float), pores.celltypes, pores.cell_offsets, pores.cell_connectivity)
    return Cells(solids, np.asarray(pores["pore"]))


def _network(throats: pyvista.PolyData) -> Network:
    pores = np.asarray(throats.lines).reshape(-1, 3)[:, 1:]
    areas = np.asarray(throats["fluid_area"], float)
    if "conductance" in throats.cell_data:
        areas = np.where(throats["conductance"] > 0.0, areas, 0.0)
    return Network(np.asarray(throats.points, float), pores, areas)


def _by_pore(pores: pyvista.UnstructuredGrid, name: str) -> np.ndarray | None:
    """Cell data by pore; None if the mesh does not have them."""
    if name not in pores.cell_data:
        return None
    _, first = np.unique(pores["pore"], return_index=True)
    return np.asarray(pores[name], float)[first]


def _remedy(results: Results, name: str) -> str:
    if name == "paths":
        return (
            f"{results.directory} holds no paths of particles: porefv plot --what paths solves the flow of the scene "
            'again for them, and in Python flow.plot("paths") draws them'
        )
    quantity = {"force": "forces", "velocity": "pressure"}.get(name, name)
    return (
        f'{results.directory} has no {name}: add "{quantity}" to the quantities in the scene\'s [output], and solve '
        "again."
    )


def _walls_at_pressures(summary: Mapping[str, Any]) -> Walls:
    """The walls of results, with the pressures that were found in place of imposed flows."""
    walls = Walls.from_mapping(summary.get("walls", {}))
    if not walls.imposes_flow.any():
        return walls
    found = summary["flow"]["wall_pressure"]
    return walls.with_pressures(np.array([found.get(name, np.nan) for name in WALLS]))
