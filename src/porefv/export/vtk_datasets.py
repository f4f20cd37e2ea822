"""Cells, spheres and throats as VTK's datasets, for files, PyVista and ParaView."""

from __future__ import annotations

from collections.abc import Mapping
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from porefv.errors import InputError
from porefv.export.cell_data import values_by_cell
from porefv.export.vtk_files import attach, cell_array, vtk_array, vtk_data_model, vtk_points, write_xml
from porefv.mesh.cell_mesh import CellMesh, ensure_walls
from porefv.mesh.polyhedra import polyhedra
from porefv.mesh.pore_mesh import PoreMesh
from porefv.mesh.throats import Throats
from porefv.packing.packing import Packing
from porefv.system.atomic_files import atomic_write, locked
from porefv.system.optional_imports import load

if TYPE_CHECKING:
    import pyvista
    from vtkmodules.vtkCommonDataModel import vtkPolyData, vtkUnstructuredGrid

    from porefv.flow.paths import Paths


def to_pyvista(mesh: CellMesh, **cell_data: Any) -> pyvista.UnstructuredGrid:
    """The cells as a `pyvista.UnstructuredGrid`, in order, with the cell data given; of a `PoreMesh` also `pore` (id).

    Parameters
    ----------
    mesh : CellMesh or PoreMesh
    **cell_data
        Arrays with a row per cell, or per pore of a `PoreMesh`: the cells of a pore then have the same value.

    Raises
    ------
    MissingExtraError
        If pyvista is not installed.
    InputError
        If an array has a row for neither each cell nor each pore.
    """
    pyvista = load("pyvista", "to_pyvista()")
    return pyvista.UnstructuredGrid(cells_grid(mesh, **cell_data))


def cells_grid(mesh: CellMesh, **cell_data: Any) -> vtkUnstructuredGrid:
    """As `to_pyvista`, but VTK's own object: what the results are written from, without pyvista."""
    vtk = vtk_data_model()
    solids = polyhedra(mesh)
    grid = vtk.vtkUnstructuredGrid()
    grid.SetPoints(vtk_points(solids.points))
    cells = vtk.vtkCellArray()
    cells.SetData(vtk_array(solids.offsets), vtk_array(solids.connectivity))
    grid.SetCells(vtk_array(solids.types), cells)
    data = {"pore": mesh.cell_pore[: mesh.n_cells]} if isinstance(mesh, PoreMesh) else {}
    for name, values in cell_data.items():
        data[name] = values_by_cell(mesh, name, np.asarray(values))
    attach(grid.GetCellData(), data, mesh.n_cells)
    return grid


def spheres_polydata(packing: Packing, **point_data: np.ndarray) -> vtkPolyData:
    """The spheres' centres as vertices with the point data `id`, `radius` and those given (n rows).

    Field data `box_lower` and `box_upper` give the box, so that `Packing.read` reads a file of it back.
    """
    n = len(packing)
    polydata = vtk_data_model().vtkPolyData()
    polydata.SetPoints(vtk_points(packing.centres))
    polydata.SetVerts(cell_array(np.arange(n)[:, None]))
    attach(polydata.GetPointData(), {"id": np.arange(n), "radius": packing.radii, **point_data}, n)
    if packing.walled_box is not None:
        attach(
            polydata.GetFieldData(), {"box_lower": packing.walled_box.lower, "box_upper": packing.walled_box.upper}, 3
        )
    return polydata


def throats_polydata(
    throats: Throats, point_data: Mapping[str, np.ndarray] | None = None, **cell_data: np.ndarray
) -> vtkPolyData:
    """The network: a point per pore, a line per throat with the cell data given (t rows).

    Points are Laguerre vertices, that of a united pore the mean of several. They have the point data `pore` (id),
    `volume` and those given (n_pores rows).
    """
    ensure_walls(throats.mesh)
    polydata = vtk_data_model().vtkPolyData()
    polydata.SetPoints(vtk_points(throats.mesh.pore_centres))
    polydata.SetLines(cell_array(throats.pores))
    mesh = throats.mesh
    data = {"pore": np.arange(mesh.n_pores), "volume": mesh.pore_volumes, **(point_data or {})}
    attach(polydata.GetPointData(), data, mesh.n_pores)
    attach(polydata.GetCellData(), cell_data, len(throats))
    return polydata


def paths_polydata(paths: Paths) -> vtkPolyData:
    """A line for each path, with the point data `time` [s], `pressure` [Pa], `speed` [m/s] and `pore` (id).

    Cell data `residence_time` [s] and `length` [m] have a row for each path.
    """
    vtk = vtk_data_model()
    polydata = vtk.vtkPolyData()
    polydata.SetPoints(vtk_points(paths.points))
    lines = vtk.vtkCellArray()
    m = len(paths.points)
    lines.SetData(vtk_array(paths.offsets.astype(np.int64)), vtk_array(np.arange(m, dtype=np.int64)))
    polydata.SetLines(lines)
    of_points = {"time": paths.times, "pressure": paths.pressures, "speed": paths.speeds, "pore": paths.pores}
    attach(polydata.GetPointData(), of_points, m)
    of_paths = {"residence_time": paths.residence_times, "length": paths.lengths}
    attach(polydata.GetCellData(), of_paths, len(paths))
    return polydata


def write_paths(paths: Paths, path: str | PathLike[str]) -> None:
    """Write paths to a .vtp file, the dataset of `paths_polydata`; a file that exists is replaced.

    Raises
    ------
    InputError
        If the name does not end in .vtp, or the file cannot be written.
    MissingExtraError
        If VTK is not installed.
    """
    path = Path(path)
    if path.suffix != ".vtp":
        raise InputError(f"cannot write {path}: files of paths need a name that ends in .vtp")
    dataset = paths_polydata(paths)
    with locked(path), atomic_write(path) as temporary:
        write_xml(dataset, temporary)


def flux_data(throats: Throats, flux: np.ndarray, slip: np.ndarray) -> dict[str, np.ndarray]:
    """Cell data of the network that show a flow.

    Parameters
    ----------
    throats : Throats
    flux : (t,) array
        From the first pore of each throat to its second [m³/s].
    slip : (6,) bool array
        Walls with slip.

    Returns
    -------
    dict of str to (t,) array
        `flux` and `flux_magnitude` [m³/s]; `speed`, the size of the mean velocity in the neck [m/s], zero where no
        section is open; `neck_radius`, of the circle with the fluid's cross-section, and `inscribed_radius`, of the
        largest circle in the neck [m].
    """
    areas = np.where(throats.closed, 0.0, throats.fluid_areas)
    size = np.abs(flux)
    return {
        "flux": flux,
        "flux_magnitude": size,
        "speed": np.divide(size, areas, out=np.zeros(len(throats)), where=areas > 0.0),
        "neck_radius": np.sqrt(areas / np.pi),
        "inscribed_radius": throats.inscribed_radii(slip),
    }
