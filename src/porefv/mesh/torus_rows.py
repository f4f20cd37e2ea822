"""Rows of a periodic mesh: its cells and spheres, and the images of both that facets across the boundary need.

The kernels of the mesh know cells, spheres and pores by the rows of arrays. An image is one more row, after all those
of the period itself; its owner is the row that it repeats, so many steps of the lattice vectors away.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from porefv.errors import InputError
from porefv.mesh.facet_kernels import FacetTopology, enumerate_facets
from porefv.mesh.flat_cells import flat_cells
from porefv.mesh.uniting import join_with_steps
from porefv.tessellation.torus import OTHERS, TorusTriangulation
from porefv.tessellation.vertices import Vertices

# Cells whose corners are in memory at a time.
_BLOCK = 1 << 16


class Owners(NamedTuple):
    """What each row repeats.

    Attributes
    ----------
    rows : (k,) int32 array
        The row itself, of those of the period; the row that an image repeats.
    steps : (k, 3) int array
        Steps of the lattice vectors that lead from there to the image.
    """

    rows: np.ndarray
    steps: np.ndarray


class TorusRows(NamedTuple):
    """The rows of a periodic mesh.

    Attributes
    ----------
    spheres, cells, pores : Owners
        The n spheres, m cells and p pores of the period come first, in this order, without steps.
    vertices : (k, 4) int32 array
        Rows of the spheres of each cell.
    local_vertices : (k, 3) array
        Laguerre vertex of each cell, from the local origin [m].
    nodes, cell_pore : (k,) int32 arrays
        Laguerre vertex of each cell, shared by cells of a tie; and its pore.
    facets : FacetTopology
        The facets of the period, each in the frame of its pore of lower number.
    """

    spheres: Owners
    cells: Owners
    pores: Owners
    vertices: np.ndarray
    local_vertices: np.ndarray
    nodes: np.ndarray
    cell_pore: np.ndarray
    facets: FacetTopology


def settled_vertices(torus: TorusTriangulation, radii: np.ndarray) -> np.ndarray:
    """(m, 3): Laguerre vertices, those of flat cells as the nearest of their neighbours' (see `settle_flat_cells`)."""
    vertices = torus.local_vertices.copy()
    flat = np.empty(len(vertices), bool)
    for begin in range(0, len(flat), _BLOCK):
        cells, steps = torus.cells[begin : begin + _BLOCK], torus.steps[begin : begin + _BLOCK]
        points = (torus.points[cells] + steps @ torus.vectors).reshape(-1, 3)
        one_cell_each = np.arange(len(points), dtype=np.int32).reshape(-1, 4)
        corners = Vertices(len(points), points, radii[cells].ravel())
        flat_cells(one_cell_each, corners, flat[begin : begin + _BLOCK])
    while True:
        rows = np.flatnonzero(flat)
        beside = torus.neighbours[rows]
        places = vertices[beside] + torus.neighbour_steps[rows] @ torus.vectors
        squares = ((places - vertices[rows, None]) ** 2).sum(axis=2)
        squares[flat[beside]] = np.inf
        nearest = squares.argmin(axis=1)
        found = np.isfinite(squares.min(axis=1, initial=np.inf))
        if not found.any():
            return vertices
        vertices[rows[found]] = places[found, nearest[found]]
        flat[rows[found]] = False


class United(NamedTuple):
    """Cells that are one.

    Attributes
    ----------
    labels : (m,) int32 array
        Equal for cells that are one, in the order of the cells.
    steps : (m, 3) int array
        Steps from each cell to its image that is beside the first cell of its label.
    """

    labels: np.ndarray
    steps: np.ndarray


def unite_on_torus(torus: TorusTriangulation, vertices: np.ndarray, radii: np.ndarray, tolerance: float) -> United:
    """Which cells are united, as by `unite`: their Laguerre vertices are no further apart than a part of a radius.

    Parameters
    ----------
    torus : TorusTriangulation
    vertices : (m, 3) array
        Laguerre vertices [m].
    radii : (n,) array
        Of the spheres [m].
    tolerance : float
        Relative to the smallest radius of the facet's spheres.

    Raises
    ------
    InputError
        If a cell is united with an image of itself.
    """
    sizes = radii[torus.cells]
    cells, places = [], []
    for i in range(4):
        beside = vertices[torus.neighbours[:, i]] + torus.neighbour_steps[:, i] @ torus.vectors
        square = ((beside - vertices) ** 2).sum(axis=1)
        near = np.flatnonzero(square <= (tolerance * sizes[:, OTHERS[i]].min(axis=1)) ** 2)
        cells.append(near)
        places.append(np.full(len(near), i))
    m, cell, place = len(vertices), np.concatenate(cells), np.concatenate(places)
    parent, steps = np.arange(m, dtype=np.int32), np.zeros((m, 3), np.int64)
    itself = join_with_steps(cell, torus.neighbours[cell, place], torus.neighbour_steps[cell, place], parent, steps)
    if itself >= 0:
        raise InputError(
            f"the pore at {np.array2string(vertices[itself] + torus.origin, precision=6)} m is united with its own "
            "image: give a smaller unite_tolerance, or a larger periodic cell"
        )
    return United(parent, steps)


def torus_rows(torus: TorusTriangulation, vertices: np.ndarray, nodes: United, pores: United) -> TorusRows:
    """The rows of a mesh.

    Parameters
    ----------
    torus : TorusTriangulation
    vertices : (m, 3) array
        Laguerre vertices [m].
    nodes, pores : United
        Cells that share a Laguerre vertex, and those that are one pore.
    """
    m = len(vertices)
    numbers, moved = pores.labels, pores.steps.astype(np.int16)
    # All cells of a pore are put beside one another, and keep their neighbours.
    vertices = vertices + moved @ torus.vectors
    corner_steps = torus.steps + moved[:, None]
    jumps = moved[:, None] + torus.neighbour_steps - moved[torus.neighbours]

    # Each facet is kept once: within the period by the first of its cells, across the boundary by the pore of lower
    # number, or, between a pore and an image of itself, where the steps are positive. So all facets of a throat are
    # kept in one frame, and agree on the rows of what is around them.
    first, second = np.broadcast_to(numbers[:, None], (m, 4)), numbers[torus.neighbours]
    across = jumps.any(axis=2)
    positive = np.sign(jumps) @ np.array([4, 2, 1], np.int16) > 0
    kept = across & ((first < second) | ((first == second) & positive))
    n_pores = int(numbers.max()) + 1
    images, ghost = np.unique(np.column_stack([second[kept], jumps[kept]]), axis=0, return_inverse=True)
    ghost = ghost.ravel()

    # An image of a pore has images of all its cells.
    order = np.argsort(numbers, kind="stable")
    starts = np.searchsorted(numbers[order], np.arange(n_pores + 1))
    place = np.empty(m, np.int64)
    place[order] = np.arange(m) - starts[numbers[order]]
    repeated, steps = images[:, 0].astype(np.int64), images[:, 1:]
    counts = (starts[1:] - starts[:-1])[repeated]
    begins = np.concatenate([[0], np.cumsum(counts)])
    which = np.repeat(np.arange(len(images)), counts)
    members = order[starts[repeated[which]] + np.arange(begins[-1]) - begins[which]]
    cells = _owners(m, members, steps[which])
    pore_rows = _owners(n_pores, repeated, steps)

    neighbours = np.where(across, -1, torus.neighbours).astype(np.int32)
    neighbours[kept] = m + begins[ghost] + place[torus.neighbours[kept]]
    spheres, corners = _sphere_rows(
        torus.n_spheres, torus.cells[cells.rows], corner_steps[cells.rows] + cells.steps[:, None]
    )
    facets = FacetTopology.of(2 * m)
    enumerate_facets(corners[:m], neighbours, len(spheres.rows), facets)

    # Nodes of images are numbered after those of the period, each image's together.
    of_images = np.column_stack([which, nodes.labels[members]])
    _, label = np.unique(of_images, axis=0, return_inverse=True)
    n_nodes = int(nodes.labels.max()) + 1
    return TorusRows(
        spheres,
        cells,
        pore_rows,
        corners,
        vertices[cells.rows] + cells.steps @ torus.vectors,
        np.concatenate([nodes.labels, n_nodes + label.ravel()]).astype(np.int32),
        np.concatenate([numbers, n_pores + which]).astype(np.int32),
        facets,
    )


def _owners(own: int, repeated: np.ndarray, steps: np.ndarray) -> Owners:
    """So many rows of the period, and the images of some of them."""
    rows = np.concatenate([np.arange(own), repeated]).astype(np.int32)
    return Owners(rows, np.concatenate([np.zeros((own, 3), np.int64), steps.astype(np.int64)]))


def _sphere_rows(n: int, spheres: np.ndarray, steps: np.ndarray) -> tuple[Owners, np.ndarray]:
    """Rows of n spheres and of all their images that are vertices of cells, and the vertices of the cells as rows."""
    rows = spheres.astype(np.int32)
    away = steps.any(axis=2)
    images, label = np.unique(np.column_stack([spheres[away], steps[away]]), axis=0, return_inverse=True)
    rows[away] = n + label.ravel()
    return _owners(n, images[:, 0], images[:, 1:]), rows
