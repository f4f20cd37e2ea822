"""The faces of the fluid: one for each throat, and one for each pore and wall; arrays alone, without FiPy."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass

import numpy as np

from porefv.conductance.prism_sections import diffusive_conductances
from porefv.errors import InputError
from porefv.mesh.pore_mesh import PoreMesh
from porefv.packing.box import WALL_AXES, WALL_NORMALS, WALLS

# The Laguerre vertex of a pore on a wall lies on the wall. FiPy divides by the distance of a cell's centre to its face:
# this part of the mean radius stands for the distance 0. A value that is given on the wall is that of the pore to about
# this part of the pore's own drop to its neighbours, and the flux at the wall keeps as many digits.
WALL_DISTANCE = 1e-6

# A closed throat has this part of its facets' area: nothing is singular, and what it passes is below rounding.
CLOSED = float(np.finfo(float).eps)


@dataclass(frozen=True, eq=False)
class Faces:
    """Faces of the cells, in this order: throats between two cells, throats towards pores left out, faces on walls.

    Attributes
    ----------
    cells : (f, 2) int array
        Cells on both sides; the second is -1 where a face has one cell.
    throats : (f,) int array
        Throat of each face, -1 on walls.
    walls : (f,) int array
        Wall of each face on a wall or towards a pore left out, 0 ... 5, -1 elsewhere.
    areas : (f,) array
        Area A = g L of the diffusive section of a throat; area of the face on a wall [m²].
    distances : (f,) array
        From the first cell's centre to the second's, or to the face [m].
    ratios : (f,) array
        Distance of the first cell's centre from the face over `distances`, 0 ... 1.
    normals : (f, 3) array
        Unit normal from the first cell to the second, or outwards.
    centres : (f, 3) array
        Where the line between the two centres meets the face [m].
    """

    cells: np.ndarray
    throats: np.ndarray
    walls: np.ndarray
    areas: np.ndarray
    distances: np.ndarray
    ratios: np.ndarray
    normals: np.ndarray
    centres: np.ndarray

    def __len__(self) -> int:
        return len(self.areas)


def walls_left_out(without: Collection[str]) -> list[int]:
    """Numbers of the walls whose pores are left out; InputError for an unknown name."""
    if isinstance(without, str):
        without = (without,)
    for name in without:
        if name not in WALLS:
            raise InputError(f"unknown wall {name!r}; the walls are {', '.join(WALLS)}")
    return [wall for wall, name in enumerate(WALLS) if name in without]


def faces_of_fluid(mesh: PoreMesh, kept: np.ndarray, left_out: list[int]) -> Faces:
    """The faces between the pores that are kept, (n_pores,) bool, towards the others, and on walls.

    A face towards a pore left out that is on several of the walls `left_out` belongs to the first of them.
    """
    cell_of_pore = np.where(kept, np.cumsum(kept) - 1, -1)
    between = _faces_of_throats(mesh, cell_of_pore, left_out)
    on_walls = _faces_on_walls(mesh, cell_of_pore)
    return Faces(*(np.concatenate(pair) for pair in zip(between, on_walls, strict=True)))


def _faces_of_throats(mesh: PoreMesh, cell_of_pore: np.ndarray, left_out: list[int]) -> tuple[np.ndarray, ...]:
    throats = mesh.throats
    cells = cell_of_pore[throats.pores]
    found = np.flatnonzero((cells >= 0).any(axis=1))
    found = found[np.argsort((cells[found] < 0).any(axis=1), kind="stable")]
    cells, pores = cells[found], throats.pores[found]
    lengths = throats.effective_lengths[found]
    areas = np.maximum(diffusive_conductances(throats)[found] * lengths, CLOSED * np.abs(throats.areas[found]))
    ratios, normals = _ratios(mesh)[found], throats.normals[found].copy()
    # A face with one cell has it first.
    turned = np.flatnonzero(cells[:, 0] < 0)
    cells[turned] = cells[turned, ::-1]
    pores = pores.copy()
    pores[turned] = pores[turned, ::-1]
    normals[turned] *= -1.0
    ratios[turned] = 1.0 - ratios[turned]
    centres = mesh.pore_centres[pores[:, 0]] + (ratios * lengths)[:, None] * normals
    outer = np.flatnonzero(cells[:, 1] < 0)
    ratios[outer] = 1.0
    centres[outer] = mesh.pore_centres[pores[outer, 0]] + lengths[outer, None] * normals[outer]
    walls = np.full(len(found), -1)
    for wall in reversed(left_out):
        on_wall = outer[(mesh.pore_walls[pores[outer, 1]] >> wall & 1).astype(bool)]
        walls[on_wall] = wall
    return cells, found, walls, areas, lengths, ratios, normals, centres


def _ratios(mesh: PoreMesh) -> np.ndarray:
    """(t,): height of each throat's first Laguerre vertex under its facet over L, between 0 and 1.

    Where the facet does not lie between the two vertices (one throat in seven), it is taken to lie at the nearer.
    """
    throats = mesh.throats
    facets = throats.first_facets
    first = mesh.facets.cells[facets, 0]
    corner = mesh.facets.centroids[facets] - mesh.local_vertices[first]
    heights = np.einsum("ij,ij->i", corner, throats.normals)
    return np.clip(heights / throats.effective_lengths, 0.0, 1.0)


def _faces_on_walls(mesh: PoreMesh, cell_of_pore: np.ndarray) -> tuple[np.ndarray, ...]:
    faces = mesh.wall_faces
    pores = mesh.cell_pore[faces.cells]
    # One face for each pore and wall.
    keys, place = np.unique(pores.astype(np.int64) * len(WALLS) + faces.walls, return_inverse=True)
    pores, walls = np.divmod(keys, len(WALLS))
    areas = np.bincount(place, faces.areas, len(keys))
    kept = np.flatnonzero(cell_of_pore[pores] >= 0)
    pores, walls, areas = pores[kept], walls[kept], areas[kept]
    distances = np.full(len(kept), WALL_DISTANCE * float(mesh.packing.radii.mean()))
    centres = mesh.pore_centres[pores].copy()
    axes = WALL_AXES[walls]
    centres[np.arange(len(kept)), axes] = mesh.box.wall_places[walls]
    cells = np.stack([cell_of_pore[pores], np.full(len(kept), -1)], axis=1)
    return cells, np.full(len(kept), -1), walls, areas, distances, np.ones(len(kept)), WALL_NORMALS[walls], centres


def faces_of_cells(cells: np.ndarray, n_cells: int, null: int) -> np.ndarray:
    """(most, n_cells): faces of each cell from the cells (f, 2) of each face, padded with the face `null`."""
    face, end = np.nonzero(cells >= 0)
    cell = cells[face, end]
    order = np.argsort(cell, kind="stable")
    cell, face = cell[order], face[order]
    count = np.bincount(cell, minlength=n_cells)
    rank = np.arange(len(cell)) - np.repeat(np.cumsum(count) - count, count)
    faces = np.full((count.max(), n_cells), null)
    faces[rank, cell] = face
    return faces
