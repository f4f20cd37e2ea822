"""A plane section through grains and pores, as polygons for VTK."""

from __future__ import annotations

import os
from os import PathLike
from pathlib import Path
from typing import Any

import numpy as np

from porefv.errors import FORCE_OPTION, InputError
from porefv.export.vtk_files import attach, attach_provenance, vtk_array, vtk_data_model, vtk_points, write_xml
from porefv.results.reading import Results
from porefv.system.atomic_files import atomic_write, locked

# Edges of the polygon that stands for a circle: its area is 0.2 % less than that of the circle.
CORNERS = 60


def write_section(
    results: Results, path: str | PathLike[str], axis: str = "x", at: float | None = None, *, force: bool = False
) -> Path:
    """Write a plane section of results: discs of the grains, and polygons of the pores without them.

    Cell data: `grain` (id, -1 in pores), `pore` (id, -1 in grains), and the fields of pores.vtu and spheres.vtp, NaN
    where they have no meaning.

    Parameters
    ----------
    results : Results
        With VTK files.
    path : path
        With the extension .vtp.
    axis : {"x", "y", "z"}
        Normal of the plane.
    at : float, optional
        Place of the plane on that axis; the middle of the box by default [m].
    force : bool
        Replace a file that exists.

    Raises
    ------
    InputError
        For another extension, a plane outside the box, results without VTK files, or a file that exists or cannot be
        written.
    """
    path, k = Path(path), "xyz".index(axis)
    if path.suffix != ".vtp":
        raise InputError(f"cannot write {path}: files of section need a name that ends in .vtp")
    pores, spheres = results.pores, results.spheres
    lower, upper = pores.bounds[2 * k : 2 * k + 2]
    place = 0.5 * (lower + upper) if at is None else at
    if not lower < place < upper:
        raise InputError(f"the plane {axis} = {place:g} m is outside the box, {lower:g} to {upper:g} m")
    others = [axis for axis in range(3) if axis != k]
    heights = spheres.points[:, k] - place
    cut = np.flatnonzero(np.abs(heights) < spheres["radius"])
    centres = np.asarray(spheres.points)[cut][:, others].astype(float)
    radii = np.sqrt(spheres["radius"][cut] ** 2 - heights[cut] ** 2)
    angles = 2.0 * np.pi * np.arange(CORNERS) / CORNERS
    circle = np.stack([np.cos(angles), np.sin(angles)], axis=1)
    polygons = list(centres[:, None] + radii[:, None, None] * circle)
    discs = list(polygons)
    origin = np.where(np.arange(3) == k, place, 0.0)
    cells = pores.slice(normal=np.eye(3)[k], origin=origin)
    owner = []
    for number in range(cells.n_cells):
        for part in _outside(np.asarray(cells.get_cell(number).points)[:, others], centres, radii, discs):
            polygons.append(part)
            owner.append(number)
    data = _fields(spheres, cells, cut, np.array(owner, int))
    sizes = np.array([len(polygon) for polygon in polygons])
    points = np.full((sizes.sum(), 3), place)
    points[:, others] = np.concatenate(polygons)
    polydata = vtk_data_model().vtkPolyData()
    polydata.SetPoints(vtk_points(points))
    faces = vtk_data_model().vtkCellArray()
    faces.SetData(vtk_array(np.concatenate([[0], np.cumsum(sizes)])), vtk_array(np.arange(len(points))))
    polydata.SetPolys(faces)
    attach(polydata.GetCellData(), data, len(polygons))
    attach_provenance(polydata, _provenance(pores))
    with locked(path):
        if os.path.lexists(path) and not force:
            raise InputError(f"{path} exists. Choose another place, or replace it with {FORCE_OPTION}")
        with atomic_write(path) as temporary:
            write_xml(polydata, temporary)
    return path


def _fields(spheres: Any, cells: Any, grains: np.ndarray, owner: np.ndarray) -> dict[str, np.ndarray]:
    """Cell data of the discs, then of the parts of pores."""
    of_spheres = {name: np.asarray(spheres.point_data[name])[grains] for name in spheres.point_data}
    of_pores = {name: np.asarray(cells.cell_data[name])[owner] for name in cells.cell_data if name != "walls"}
    data = {
        "grain": np.concatenate([of_spheres.pop("id"), np.full(len(owner), -1)]),
        "pore": np.concatenate([np.full(len(grains), -1), of_pores.pop("pore")]),
    }
    for name, values in of_spheres.items():
        data[name] = np.concatenate([values, np.full((len(owner), *values.shape[1:]), np.nan)])
    for name, values in of_pores.items():
        data[name] = np.concatenate([np.full((len(grains), *values.shape[1:]), np.nan), values])
    return data


def _provenance(pores: Any) -> dict[str, Any]:
    """The field data of pores.vtu; none in files of porefv 0.2.0 and before."""
    fields = pores.field_data
    given = {name: str(fields[name][0]) for name in ("scene",) if name in fields}
    return given | {
        name: np.asarray(fields[name]) for name in ("box_lower", "box_upper", "viscosity") if name in fields
    }


def _outside(polygon: np.ndarray, centres: np.ndarray, radii: np.ndarray, discs: list[np.ndarray]) -> list[np.ndarray]:
    """Parts of a convex polygon (m, 2) outside of all discs, which are convex, too."""
    lower, upper = polygon.min(axis=0), polygon.max(axis=0)
    gap = np.maximum(np.maximum(lower - centres, centres - upper), 0.0)
    parts = [polygon]
    for disc in np.flatnonzero((gap**2).sum(axis=1) < radii**2):
        parts = [piece for part in parts for piece in _less(part, discs[disc])]
    return parts


def _less(polygon: np.ndarray, disc: np.ndarray) -> list[np.ndarray]:
    """A convex polygon less another: what lies outside of each of its edges in turn; the polygon, if they are apart."""
    pieces, inside = [], polygon
    for start, end in zip(disc, np.roll(disc, -1, axis=0), strict=True):
        along = end - start
        sides = along[1] * (inside[:, 0] - start[0]) - along[0] * (inside[:, 1] - start[1])  # positive outside
        if (sides > 0.0).any():
            pieces.append(_kept(inside, sides))
            inside = _kept(inside, -sides)
        if len(inside) < 3:
            return [polygon]
    return [piece for piece in pieces if len(piece) >= 3]


def _kept(polygon: np.ndarray, sides: np.ndarray) -> np.ndarray:
    """The part of a convex polygon where a linear function, given at its corners, is not negative."""
    corners = []
    for k in range(len(polygon)):
        j = k - 1
        if sides[j] * sides[k] < 0.0:
            part = sides[j] / (sides[j] - sides[k])
            corners.append(polygon[j] + part * (polygon[k] - polygon[j]))
        if sides[k] >= 0.0:
            corners.append(polygon[k])
    return np.array(corners).reshape(-1, 2)
