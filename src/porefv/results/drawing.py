"""The picture of a results directory, as a PNG file."""

from __future__ import annotations

from collections.abc import Mapping
from os import PathLike
from pathlib import Path
from typing import Any

import numpy as np

from porefv.export.pictures import SIZE, load_pyvista, picture
from porefv.export.vtk_datasets import spheres_polydata
from porefv.flow.walls import Walls
from porefv.packing.box import WALLS
from porefv.packing.packing import Packing
from porefv.results.reading import Results
from porefv.system.atomic_files import atomic_write, locked, picture_target


def draw(results: Results, path: str | PathLike[str], size: tuple[int, int] = SIZE) -> None:
    """Write a PNG picture of a results directory.

    Raises
    ------
    InputError
        If the results have no VTK files, or the picture cannot be written.
    ComputationError
        If this machine cannot draw.
    """
    path = picture_target(path)
    summary = results.summary
    title = f"{Path(summary['scene']).stem}: " if summary["scene"] else ""
    title += f"{summary['packing']['spheres']} spheres"
    if "permeability" in summary:
        title += f",  k = {summary['permeability']:.4g} m²"
    with locked(path), atomic_write(path) as temporary:
        picture(
            results.spheres,
            results.pores,
            walls=_walls_at_pressures(summary),
            title=title,
            size=size,
        ).screenshot(temporary)


def _walls_at_pressures(summary: Mapping[str, Any]) -> Walls:
    """The walls of results, with the pressures that were found in place of imposed flows."""
    walls = Walls.from_mapping(summary.get("walls", {}))
    if not walls.imposes_flow.any():
        return walls
    found = summary["flow"]["wall_pressure"]
    return walls.with_pressures(np.array([found.get(name, np.nan) for name in WALLS]))


def draw_packing(packing: Packing, name: str, path: str | PathLike[str], size: tuple[int, int] = SIZE) -> None:
    """Write a PNG picture of the spheres of a packing in its box, or in their bounding box.

    Raises
    ------
    InputError
        If the picture cannot be written.
    ComputationError
        If this machine cannot draw.
    """
    path = picture_target(path)
    pyvista = load_pyvista()
    box = packing.bounding_box if packing.box is None else packing.box
    outline = pyvista.Box(box.wall_places).cast_to_unstructured_grid()
    spheres = pyvista.PolyData(spheres_polydata(packing))
    with locked(path), atomic_write(path) as temporary:
        picture(spheres, outline, upright=2, title=f"{name}: {len(packing)} spheres", size=size).screenshot(temporary)
