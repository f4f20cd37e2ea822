"""FipyPoreMesh: the pores as a FiPy mesh.

FiPy's diffusion term takes every mesh as orthogonal, with the coefficient Γ A / d on each face. Here that is
right: the line between two Laguerre vertices is normal to the facet between them. So its face areas are the
facets', its cell distances the throats' lengths L, and Γ = g / A makes Γ A / d = g / L = K.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from porefv.errors import InputError
from porefv.fipy.fipy_import import load_fipy
from porefv.mesh.polyhedra import polygons
from porefv.packing.box import WALL_NORMALS, WALLS

if TYPE_CHECKING:
    from porefv.mesh.pore_mesh import PoreMesh

fipy = load_fipy()


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

        pair = mesh.cell_pore[mesh.facets.cells]
        self.facets = np.flatnonzero((pair[:, 0] != pair[:, 1]) & ~held[pair].all(axis=1))
        pair = pair[self.facets]
        walls = mesh.wall_faces
        on_wall = np.flatnonzero(~held[mesh.cell_pore[walls.cells]])

        ends = cell_of_pore[pair]
        # FiPy's normals point from the lower cell to the higher, and outwards.
        sense = np.where((ends[:, 1] < 0) | ((ends[:, 0] >= 0) & (ends[:, 0] < ends[:, 1])), 1.0, -1.0)
        centres = mesh.facets.centroids[self.facets]
        self._given_areas = np.concatenate([mesh.facets.areas[self.facets], walls.areas[on_wall]])
        self._given_centres = np.concatenate([centres, walls.centroids[on_wall]]).T + mesh.triangulation.origin[:, None]
        normals = sense[:, None] * mesh.facets.normals[self.facets]
        self._given_normals = np.concatenate([normals, WALL_NORMALS[walls.walls[on_wall]]]).T
        self._given_distances = np.maximum(
            mesh.facets.lengths[self.facets], np.finfo(float).eps * mesh.packing.radii.min()
        )

        nothing = np.full(len(on_wall), -1)
        self.held_pores = np.concatenate([np.where(held[pair], pair, -1).max(axis=1), nothing])
        self.held_faces = self.held_pores >= 0
        self.wall_of_face = np.concatenate([np.full(len(self.facets), -1), walls.walls[on_wall]])

        wall_cells = np.stack([cell_of_pore[mesh.cell_pore[walls.cells[on_wall]]], nothing], axis=1)
        points, corners = polygons(mesh, self.facets, walls.cells[on_wall], walls.walls[on_wall])
        super().__init__(points.T, corners.T, _faces_of_cells(np.concatenate([ends, wall_cells]), len(self.pores)))

    # The geometry FiPy would derive from its vertices, taken from the pore mesh instead.

    def _calcFaceAreas(self) -> np.ndarray:
        return self._given_areas

    def _calcFaceCenters(self) -> np.ndarray:
        return self._given_centres

    def _calcFaceNormals(self) -> np.ndarray:
        return self._given_normals

    def _calcCellDistAndVec(self) -> tuple[np.ndarray, np.ndarray]:
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
