"""The cells as polyhedra and the facets as polygons that share their nodes: what VTK, meshio and FiPy take.

A cell is its spheres' centres swept to its walls. Its nodes are sphere centres, their projections on walls
and on edges of the box, and corners of the box: one node for all cells that have it, so the mesh conforms.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from porefv.mesh.cell_mesh import CellMesh

TETRA, WEDGE, HEXAHEDRON = 10, 13, 12  # VTK's cell types

# The image of a sphere's centre on walls has a code: a digit in base 3 for each axis, 0, or 1 (2) for its lower (upper)
# wall. These are the codes of the images on one wall; those on several walls are sums of them, less than 27.
_WALL_CODES = np.array([1, 2, 3, 6, 9, 18])

# A node of a cell as (the sphere's place in the cell or -1, the places of its walls): see `_wall_cells`.
_Recipe = list[tuple[int, tuple[int, ...]]]
_WEDGE: _Recipe = [(0, ()), (1, ()), (2, ()), (0, (3,)), (1, (3,)), (2, (3,))]
_SWEPT_EDGE: _Recipe = [(k, walls) for k in (0, 1) for walls in ((), (2,), (2, 3), (3,))]
_CORNER_BOX: _Recipe = [(0, walls) for walls in ((), (1,), (1, 2), (2,), (3,), (1, 3), (1, 2, 3), (2, 3))]


@dataclass(frozen=True, eq=False)
class Polyhedra:
    """Cells of a mesh in VTK's terms.

    Attributes
    ----------
    points : (p, 3) array
        Nodes; node k < n_spheres is the centre of sphere k, in a periodic cell of an image of it [m].
    types : (m,) uint8 array
        VTK's type of each cell.
    offsets : (m + 1,) int64 array
        Where each cell starts in `connectivity`.
    connectivity : (c,) int64 array
        Nodes of the cells, one after the other, positively oriented.
    """

    points: np.ndarray
    types: np.ndarray
    offsets: np.ndarray
    connectivity: np.ndarray

    def of_type(self, kind: int) -> tuple[np.ndarray, np.ndarray]:
        """Ids (k,) and nodes (k, 4, 6 or 8) of the cells of one type."""
        ids = np.flatnonzero(self.types == kind)
        width = {TETRA: 4, WEDGE: 6, HEXAHEDRON: 8}[kind]
        return ids, self.connectivity[self.offsets[ids][:, None] + np.arange(width)]


def polyhedra(mesh: CellMesh) -> Polyhedra:
    """The cells of a mesh as VTK's: tetrahedra, wedges (3 spheres, a wall), hexahedra (2 and 2, 1 and 3).

    Those of a periodic mesh are the tetrahedra of one period: some reach beyond the periodic cell, to images.
    """
    if mesh.periodic:
        tetrahedra = mesh.cells[: mesh.n_cells, [1, 0, 2, 3]]
        offsets = np.arange(0, 4 * mesh.n_cells + 1, 4)
        points = mesh.local_points + mesh.triangulation.origin
        return Polyhedra(points, np.full(mesh.n_cells, TETRA, np.uint8), offsets, tetrahedra.ravel().astype(np.int64))
    n = mesh.n_spheres
    n_walls = np.count_nonzero(mesh.cells >= n, axis=1)
    types = np.array([TETRA, WEDGE, HEXAHEDRON, HEXAHEDRON], np.uint8)[n_walls]
    offsets = np.zeros(mesh.n_cells + 1, np.int64)
    np.cumsum(np.array([4, 6, 8, 8])[n_walls], out=offsets[1:])
    connectivity = np.empty(offsets[-1], np.int64)

    tetrahedra = np.flatnonzero(n_walls == 0)
    connectivity[offsets[tetrahedra][:, None] + np.arange(4)] = mesh.cells[tetrahedra][:, [1, 0, 2, 3]]
    for count, recipe in ((1, _WEDGE), (2, _SWEPT_EDGE), (3, _CORNER_BOX)):
        ids = np.flatnonzero(n_walls == count)
        nodes = _wall_cells(mesh.cells[ids], n, recipe)
        connectivity[offsets[ids][:, None] + np.arange(len(recipe))] = nodes

    # Nodes on walls have been given as keys beyond n: number those in use after the spheres.
    on_walls = np.flatnonzero(connectivity >= n)
    keys, connectivity[on_walls] = np.unique(connectivity[on_walls], return_inverse=True)
    connectivity[on_walls] += n
    spheres, codes = np.divmod(keys - 27 * n, 27)
    points = np.concatenate([mesh.packing.centres, _images(mesh, spheres, codes)])
    return Polyhedra(points, types, offsets, connectivity)


def _wall_cells(cells: np.ndarray, n: int, recipe: _Recipe) -> np.ndarray:
    """Nodes of cells of one kind: ids of spheres, or keys 27 n + 27 k + code of sphere k's image on walls.

    Corners of the box belong to no sphere: their k is 0.
    """
    cells = _walls_last(cells, n)
    nodes = np.empty((len(cells), len(recipe)), np.int64)
    for column, (sphere, walls) in enumerate(recipe):
        nodes[:, column] = cells[:, sphere]
        if walls:
            if len(walls) == 3:
                nodes[:, column] = 0
            code = sum(_WALL_CODES[cells[:, wall] - n] for wall in walls)
            nodes[:, column] = 27 * (n + nodes[:, column]) + code
    return nodes


def _walls_last(cells: np.ndarray, n: int) -> np.ndarray:
    """The cells, spheres first, by odd permutations: the triangulation's orientation is opposite to VTK's."""
    order = np.argsort(cells >= n, axis=1, kind="stable")
    inversions = sum((order[:, i] > order[:, j]).astype(int) for i in range(4) for j in range(i + 1, 4))
    cells = np.take_along_axis(cells, order, axis=1)
    even = np.flatnonzero(inversions % 2 == 0)
    # Two spheres change places, or two walls.
    i = np.where(cells[even, 1] < n, 0, 2)
    cells[even, i], cells[even, i + 1] = cells[even, i + 1], cells[even, i]
    return cells


def _images(mesh: CellMesh, spheres: np.ndarray, codes: np.ndarray) -> np.ndarray:
    """(p, 3): images of the centres of spheres (p,) on the walls that the codes (p,) tell; code 0 is the centre [m]."""
    points = mesh.packing.centres[spheres].copy()
    for axis in range(3):
        digit = codes // 3**axis % 3
        points[:, axis] = np.choose(digit, [points[:, axis], mesh.box.lower[axis], mesh.box.upper[axis]])
    return points


def polygons(
    mesh: CellMesh, facets: np.ndarray, face_cells: np.ndarray, face_walls: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Points (p, 3) and corners (f, 4) of facets and wall faces, padded with -1.

    A corner is the image of a sphere on some walls: its own centre, swept to a wall, an edge or a corner of the box.

    Parameters
    ----------
    mesh : CellMesh
    facets : (k,) int array
        Facets between cells.
    face_cells, face_walls : (w,) int arrays
        Cell and wall of each wall face.
    """
    n = mesh.n_spheres
    cells = mesh.cells[face_cells]
    wall = n + face_walls
    others = cells[cells != wall[:, None]].reshape(-1, 3)
    rows = np.concatenate([mesh.facets.vertices[facets], _spheres_first(others, n)])
    base = np.concatenate([np.zeros(len(facets), np.int64), _code(wall, n)])
    a, b, c = rows.T
    walls_b, walls_c = _code(b, n), _code(c, n)
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
    return _images(mesh, *np.divmod(unique, 27)), polygons


def _code(vertices: np.ndarray, n: int) -> np.ndarray:
    """Code of the image on a wall, for vertices that are walls; 0 for spheres."""
    return np.where(vertices >= n, _WALL_CODES[np.maximum(vertices - n, 0)], 0)


def _spheres_first(rows: np.ndarray, n: int) -> np.ndarray:
    return np.take_along_axis(rows, np.argsort(rows >= n, axis=1, kind="stable"), axis=1)
