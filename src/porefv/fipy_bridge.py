"""The pore mesh as a FiPy mesh, and the pressure equation in FiPy's words.

FiPy's diffusion term takes every mesh as orthogonal, with the coefficient Γ A / d on each face. Here that is
right: the line between two Laguerre vertices is normal to the facet between them. So its face areas are the
facets', its cell distances the throats' lengths L, and Γ = g / A makes Γ A / d = g / L = K.
"""

from __future__ import annotations

import os
import sys
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from porefv.errors import InputError, MissingExtraError
from porefv.facets import facet_centroids
from porefv.packing import WALLS
from porefv.tessellation.triangulation import wall_normals

if TYPE_CHECKING:
    from porefv.flow import PoreFlow
    from porefv.mesh import PoreMesh


def _import_fipy() -> Any:
    """FiPy, with its scipy solvers unless the user chose others; it reads its options from the command line."""
    if "fipy" not in sys.modules:
        os.environ.setdefault("FIPY_SOLVERS", "scipy")
        argv, sys.argv = sys.argv, sys.argv[:1]
        try:
            import fipy
        except ModuleNotFoundError:
            raise MissingExtraError("fipy", "A FiPy mesh") from None
        finally:
            sys.argv = argv
    import fipy

    return fipy


fipy = _import_fipy()


class FipyPoreMesh(fipy.meshes.mesh.Mesh):  # type: ignore[name-defined]
    """Pores as the cells of a genuine FiPy mesh.

    Cells are the pores that are not held, in order; faces are facets between different pores, and the pores' faces
    on the walls. Facets towards held pores are exterior faces, at the distance L, to `constrain` a variable on.

    Parameters
    ----------
    mesh : PoreMesh
    held : (n_pores,) bool array, optional
        Pores to leave out because their value is imposed.

    Attributes
    ----------
    pores : (c,) int array
        Pore of each cell.
    held_faces : (f,) bool array
        Faces towards held pores; beyond, in `held_pores` (f,), the pore held there, -1 elsewhere.
    wall_of_face : (f,) int array
        Wall of each face on a wall, -1 elsewhere.

    Notes
    -----
    FiPy's cell centre is the mean of a pore's face centres; its pressure lives at the Laguerre vertex. Terms that use
    face areas, normals, cell volumes and cell distances (diffusion, transients, sources) are exact; interpolation to
    faces uses the cell centres and is not. FiPy's cell volume is the whole cell's, solid included: scale a source
    per void volume with `pore_mesh.pore_volumes[pores]`.
    """

    def __init__(self, mesh: PoreMesh, held: np.ndarray | None = None):
        held = np.zeros(mesh.n_pores, bool) if held is None else np.asarray(held)
        if held.shape != (mesh.n_pores,) or held.dtype != bool:
            raise InputError(
                f"held must be a bool array of one value a pore ({mesh.n_pores}), not {held.dtype}{held.shape}"
            )
        if held.all():
            raise InputError("every pore is held: nothing is left to solve for")
        self.pore_mesh = mesh
        self.pores = np.flatnonzero(~held)
        cell_of_pore = np.full(mesh.n_pores, -1)
        cell_of_pore[self.pores] = np.arange(len(self.pores))

        pair = mesh.cell_pore[mesh.facet_cells]
        self.facets = np.flatnonzero((pair[:, 0] != pair[:, 1]) & ~held[pair].all(axis=1))
        pair = pair[self.facets]
        walls = mesh.wall_faces
        on_wall = np.flatnonzero(~held[mesh.cell_pore[walls.cells]])

        ends = cell_of_pore[pair]
        # FiPy's normals point from the lower cell to the higher, and outwards.
        sense = np.where((ends[:, 1] < 0) | ((ends[:, 0] >= 0) & (ends[:, 0] < ends[:, 1])), 1.0, -1.0)
        throats = mesh.throats
        centres = facet_centroids(mesh.facet_vertices[self.facets], mesh.n_spheres, mesh.local_points, mesh.sizes)
        self._given_areas = np.concatenate([throats.facet_areas[self.facets], walls.areas[on_wall]])
        self._given_centres = np.concatenate([centres, walls.centroids[on_wall]]).T + mesh.triangulation.origin[:, None]
        normals = sense[:, None] * throats.facet_normals[self.facets]
        self._given_normals = np.concatenate([normals, wall_normals()[walls.walls[on_wall]]]).T
        self._given_distances = np.maximum(
            throats.facet_lengths[self.facets], np.finfo(float).eps * mesh.packing.radii.min()
        )

        nothing = np.full(len(on_wall), -1)
        self.held_pores = np.concatenate([np.where(held[pair], pair, -1).max(axis=1), nothing])
        self.held_faces = self.held_pores >= 0
        self.wall_of_face = np.concatenate([np.full(len(self.facets), -1), walls.walls[on_wall]])

        wall_cells = np.stack([cell_of_pore[mesh.cell_pore[walls.cells[on_wall]]], nothing], axis=1)
        points, polygons = _polygons(mesh, self.facets, walls.cells[on_wall], walls.walls[on_wall])
        super().__init__(points.T, polygons.T, _faces_of_cells(np.concatenate([ends, wall_cells]), len(self.pores)))

    # The geometry FiPy would derive from its vertices, taken from the pore mesh instead.

    def _calcFaceAreas(self):
        return self._given_areas

    def _calcFaceCenters(self):
        return self._given_centres

    def _calcFaceNormals(self):
        return self._given_normals

    def _calcCellDistAndVec(self):
        distances, vectors = super()._calcCellDistAndVec()
        distances = np.array(distances)
        distances[: len(self._given_distances)] = self._given_distances
        return distances, vectors

    def on_wall(self, name: str) -> np.ndarray:
        """(f,) bool: faces on the wall of that name, of pores that are not held."""
        if name not in WALLS:
            raise InputError(f"unknown wall {name!r}; the walls are {', '.join(WALLS)}")
        return self.wall_of_face == WALLS.index(name)

    def coefficient(self, conductances: np.ndarray) -> Any:
        """Γ = g / A on each face, from the conductance K of each throat (t,), as a `fipy.FaceVariable`.

        Zero on walls. A throat of several facets is shared among them by area.
        """
        throats = self.pore_mesh.throats
        throat = throats.facet_throat[self.facets]
        values = np.zeros(self.numberOfFaces)
        values[: len(self.facets)] = conductances[throat] * self._given_distances / throats.areas[throat]
        return fipy.FaceVariable(mesh=self, value=values)


@dataclass(frozen=True, eq=False)
class FipyProblem:
    """A flow posed in FiPy: `equation.solve(var=pressure)` solves it.

    Attributes
    ----------
    flow : PoreFlow
    mesh : FipyPoreMesh
        Without the pores on pressure walls.
    """

    flow: PoreFlow
    mesh: FipyPoreMesh

    @cached_property
    def coefficient(self) -> Any:
        """`fipy.FaceVariable` Γ = g / A [m²/(Pa s)]."""
        return self.mesh.coefficient(self.flow.conductances)

    @cached_property
    def pressure(self) -> Any:
        """`fipy.CellVariable` of piezometric pressure, constrained on the faces towards held pores [Pa]."""
        pressure = fipy.CellVariable(name="pressure", mesh=self.mesh, value=0.0)
        held = self.mesh.held_faces
        values = np.zeros(self.mesh.numberOfFaces)
        values[held] = self.flow.imposed_pressures[self.mesh.held_pores[held]]
        pressure.constrain(fipy.FaceVariable(mesh=self.mesh, value=values), where=held)
        return pressure

    @cached_property
    def equation(self) -> Any:
        """`fipy.DiffusionTerm(coeff=coefficient) == 0`."""
        return fipy.DiffusionTerm(coeff=self.coefficient) == 0.0

    def solve(self) -> np.ndarray:
        """Solve directly; the pressure of each pore, (n_pores,), held ones included [Pa]."""
        self.equation.solve(
            var=self.pressure, solver=fipy.LinearLUSolver(tolerance=1e-14, criterion="RHS", iterations=10)
        )
        values = self.flow.imposed_pressures.copy()
        values[self.mesh.pores] = self.pressure.value
        return values


def _faces_of_cells(ends: np.ndarray, n_cells: int) -> np.ndarray:
    """(most, n_cells): faces of each cell, padded with -1, from the cells of each face (f, 2), -1 for none."""
    face, end = np.nonzero(ends >= 0)
    cell = ends[face, end]
    order = np.argsort(cell, kind="stable")
    cell, face = cell[order], face[order]
    count = np.bincount(cell, minlength=n_cells)
    rank = np.arange(len(cell)) - np.repeat(np.cumsum(count) - count, count)
    faces = np.full((count.max(), n_cells), -1)
    faces[rank, cell] = face
    return faces


def _polygons(mesh, facets, face_cells, face_walls):
    """Points (p, 3) and corners (f, 4) of facets and wall faces, padded with -1.

    A corner is the image of a sphere on some walls: its own centre, swept to a wall, an edge or a corner of the box.
    """
    n = mesh.n_spheres
    cells = mesh.cells[face_cells]
    wall = n + face_walls
    others = cells[cells != wall[:, None]].reshape(-1, 3)
    rows = np.concatenate([mesh.facet_vertices[facets], _spheres_first(others, n)])
    base = np.concatenate([np.zeros(len(facets), np.int64), _digit(wall, n)])
    a, b, c = rows.T
    walls_b, walls_c = _digit(b, n), _digit(c, n)
    triangle, swept = c < n, (b < n) & (c >= n)
    corners = np.full((len(rows), 4, 2), -1, np.int64)  # (sphere, code of its walls)
    corners[:, 0] = np.stack([a, base], axis=1)
    corners[:, 1, 0] = np.where(b < n, b, a)
    corners[:, 1, 1] = base + np.where(b < n, 0, walls_b)
    corners[:, 2, 0] = np.where(triangle, c, np.where(swept, b, a))
    corners[:, 2, 1] = base + np.where(triangle, 0, np.where(swept, walls_c, walls_b + walls_c))
    corners[~triangle, 3, 0] = a[~triangle]
    corners[~triangle, 3, 1] = base[~triangle] + walls_c[~triangle]

    keys = np.where(corners[..., 0] < 0, -1, corners[..., 0] * 27 + corners[..., 1])
    unique, polygons = np.unique(keys, return_inverse=True)
    polygons = polygons.reshape(keys.shape)
    if unique[0] == -1:
        unique, polygons = unique[1:], polygons - 1
    sphere, code = np.divmod(unique, 27)
    points = mesh.packing.centres[sphere].copy()
    for axis in range(3):
        digit = code // 3**axis % 3
        points[:, axis] = np.choose(digit, [points[:, axis], mesh.box.lower[axis], mesh.box.upper[axis]])
    return points, polygons


def _digit(vertices, n):
    """Code of a wall: 1 or 2 (lower or upper) times 3^axis; 0 for spheres."""
    wall = np.maximum(vertices - n, 0)
    return np.where(vertices >= n, (1 + wall % 2) * 3 ** (wall // 2), 0)


def _spheres_first(rows, n):
    return np.take_along_axis(rows, np.argsort(rows >= n, axis=1, kind="stable"), axis=1)
