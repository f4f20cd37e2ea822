"""Which cells of a mesh the nodes of a lattice lie in, and through which facets the flow along its links passes."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from porefv.mesh.facet_kernels import centroid
from porefv.system.kernels import helper, kernel

if TYPE_CHECKING:
    from porefv.mesh.pore_mesh import PoreMesh

# Facets that a link or a walk through cells may pass: more are rounding at an edge.
_MOST_FACETS = 64
_MOST_CELLS = 1000


class CellSides(NamedTuple):
    """The facets of each cell: up to four, -1 for none.

    Attributes
    ----------
    facets, neighbours : (m, 4) int32 arrays
    senses : (m, 4) array
        1 where the facet's normal points out of the cell, -1 where into it.
    planes : (m, 4, 4) array
        Outward unit normal and offset.
    """

    facets: np.ndarray
    neighbours: np.ndarray
    senses: np.ndarray
    planes: np.ndarray


def cell_sides(mesh: PoreMesh, shift: np.ndarray, spacing: float) -> CellSides:
    """The sides of a mesh's cells, in spacings: x = (local place + shift) / spacing."""
    m = mesh.n_cells
    first, second = mesh.facets.cells.T
    cells = np.concatenate([first, second])
    others = np.concatenate([second, first])
    facets = np.tile(np.arange(len(first)), 2)
    senses = np.repeat([1.0, -1.0], len(first))
    normals = mesh.facets.normals
    middles = np.array([centroid(a, b, c, mesh.cell_vertices) for a, b, c in mesh.facets.vertices])
    offsets = ((middles + shift) * normals).sum(axis=1) / spacing
    order = np.argsort(cells, kind="stable")
    cells, others, facets, senses = cells[order], others[order], facets[order], senses[order]
    column = np.arange(len(cells)) - np.searchsorted(cells, cells)
    sides = CellSides(
        np.full((m, 4), -1, np.int32), np.full((m, 4), -1, np.int32), np.zeros((m, 4)), np.zeros((m, 4, 4))
    )
    sides.facets[cells, column] = facets
    sides.neighbours[cells, column] = others
    sides.senses[cells, column] = senses
    sides.planes[cells, column, :3] = senses[:, None] * normals[facets]
    sides.planes[cells, column, 3] = senses * offsets[facets]
    return sides


@helper
def _above(planes, cell, side, x, y, z):
    return (
        planes[cell, side, 0] * x + planes[cell, side, 1] * y + planes[cell, side, 2] * z - planes[cell, side, 3]
    )  # fmt: skip


@kernel
def locate(places, begin, sides, cells):
    """The cell of each node: a walk from that of the node before, through the side that it is beyond most."""
    cell = begin
    for i in range(places.shape[0]):
        x, y, z = places[i, 0] + 0.5, places[i, 1] + 0.5, places[i, 2] + 0.5
        for _ in range(_MOST_CELLS):
            most, through = 1e-9, -1
            for side in range(4):
                if sides.neighbours[cell, side] >= 0:
                    beyond = _above(sides.planes, cell, side, x, y, z)
                    if beyond > most:
                        most, through = beyond, side
            if through < 0:
                break
            cell = sides.neighbours[cell, through]
        cells[i] = cell


@helper
def _pass(cell, x, y, z, dx, dy, dz, flux, sides, facet_flux):
    """Add a flux to the facets that a straight line passes; the cell in which it ends."""
    at = 0.0
    came = -1
    for _ in range(_MOST_FACETS):
        least, through = 1.0, -1
        for side in range(4):
            other = sides.neighbours[cell, side]
            if other < 0 or other == came:
                continue
            begin = _above(sides.planes, cell, side, x, y, z)
            end = _above(sides.planes, cell, side, x + dx, y + dy, z + dz)
            if end > 0.0 and end > begin:
                s = max(-begin / (end - begin), at)
                if s < least:
                    least, through = s, side
        if through < 0:
            break
        facet_flux[sides.facets[cell, through]] += sides.senses[cell, through] * flux
        came, cell, at = cell, sides.neighbours[cell, through], least
    return cell


@kernel
def add_link_flux(places, cells, sources, f, directions, opposite, sides, facet_flux):
    """Flux of all links between nodes of the fluid, to the facets that they pass [lattice units]."""
    n = places.shape[0]
    for q in range(1, 19, 2):
        for i in range(n):
            j = sources[q, i]  # the link is from j to i
            if j < n and cells[i] != cells[j]:
                back = opposite[q]
                flux = f[q, j] - f[back, i]
                _pass(
                    cells[j], places[j, 0] + 0.5, places[j, 1] + 0.5, places[j, 2] + 0.5, directions[q, 0],
                    directions[q, 1], directions[q, 2], flux, sides, facet_flux,
                )  # fmt: skip


@kernel
def add_image_flux(places, cells, images, flux, directions, beyond, shape, sides, facet_flux, wall_cells):
    """Flux of links through walls: to the facets between their nodes and the wall. The cell at the wall of each."""
    for k in range(flux.shape[0]):
        i, q = images[k, 0], images[k, 1]
        away = 0.5
        for axis in range(3):
            if directions[q, axis] < 0 and places[i, axis] == shape[axis] - 1:
                away = beyond[axis]
        x, y, z = places[i, 0] + 0.5, places[i, 1] + 0.5, places[i, 2] + 0.5
        wall_cells[k] = _pass(
            cells[i], x, y, z, -away * directions[q, 0], -away * directions[q, 1], -away * directions[q, 2], -flux[k],
            sides, facet_flux,
        )  # fmt: skip


@kernel
def add_mirrored_flux(places, cells, nodes, starts, origins, flux, sides, facet_flux):
    """Flux along planes of symmetry, from mirrored nodes to others."""
    for k in range(nodes.shape[0]):
        i = nodes[k]
        for e in range(starts[k], starts[k + 1]):
            j = origins[e]
            if cells[i] != cells[j]:
                _pass(
                    cells[j], places[j, 0] + 0.5, places[j, 1] + 0.5, places[j, 2] + 0.5,
                    places[i, 0] - places[j, 0], places[i, 1] - places[j, 1], places[i, 2] - places[j, 2], flux[e],
                    sides, facet_flux,
                )  # fmt: skip
