"""Micromechanics: stress and strain of each grain, of each cell, and their means over layers (C14 §3.2).

Both are positive in compression: a sample that is pressed, and shortens, has positive stress and positive strain.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from porefv.errors import InputError
from porefv.mesh.cell_mesh import ensure_walls
from porefv.mesh.facet_kernels import area_vector, spheres_first
from porefv.mesh.vectors import wall_distance
from porefv.packing.box import WALL_AXES
from porefv.system.kernels import helper, kernel, unsigned_range
from porefv.system.threads import for_rows

if TYPE_CHECKING:
    from porefv.dem.measurements import Contacts
    from porefv.mesh.pore_mesh import PoreMesh


class Displacements(NamedTuple):
    """Displacements of grains (n, 3), and of walls (6,) along their outward normals [m]."""

    grains: np.ndarray
    walls: np.ndarray


def grain_stresses(contacts: Contacts, centres: np.ndarray, volumes: np.ndarray) -> np.ndarray:
    """Mean stress in the Laguerre cell of each grain: Σ x_c ⊗ f_c / V over its contacts (C14 eq. 39).

    Points x_c are measured from the grain's centre: where the fluid, or inertia, has a share in a grain's balance, its
    contact forces alone do not add up to nothing, and the sum depends on where points are measured from.

    Parameters
    ----------
    contacts : Contacts
        Of the grains.
    centres : (n, 3) array
        Of the grains, when they have those contacts [m].
    volumes : (n,) array
        Of the grains' Laguerre cells, `PoreMesh.laguerre_volumes` [m³].

    Returns
    -------
    (n, 3, 3) array
        Positive in compression [Pa]. Their mean, weighted by volume, is the stress of the sample that contacts bear,
        the effective one. NaN for a grain without a Laguerre cell (V = 0).

    Notes
    -----
    Theory, grains and fluid: :eq:`eq-grain-stress`.
    """
    n = len(volumes)
    i, j = contacts.grains.T
    stresses = np.zeros((n, 3, 3))
    np.add.at(stresses, i, -_outer(contacts.points - centres[i], contacts.forces))
    other = j < n
    np.add.at(stresses, j[other], _outer(contacts.points[other] - centres[j[other]], contacts.forces[other]))
    return _over(stresses, volumes)


def grain_strains(mesh: PoreMesh, displacements: ArrayLike, wall_displacements: ArrayLike) -> np.ndarray:
    """Mean strain of what surrounds each grain: -sym (1/V) ∮ u ⊗ n dS over the union of its cells (C14 eq. 40-41).

    Parameters
    ----------
    mesh : PoreMesh
        Of the grains before they moved.
    displacements : (n, 3) array
        u of the grains' centres since then [m].
    wall_displacements : (6,) array
        Of the walls along their outward normals, in the order x_min, x_max, y_min, ... [m].

    Returns
    -------
    (n, 3, 3) array
        Positive in compression. NaN for a hidden grain, which has no cell.

    Raises
    ------
    InputError
        For displacements of another shape, or not finite.

    Notes
    -----
    Theory, grains and fluid: :eq:`eq-grain-strain`.

    u is that of the centres at the vertices, and linear on triangles. A corner that a cell has on a wall is the
    projection of a centre, and stays that: it moves with the wall along the normal, with the centre along the wall.
    Between the corners of trapezoids and rectangles u is bilinear. The trace is therefore the part of its volume
    that the polyhedron loses, to first order: `PoreMesh.cell_volume_rates` of its cells.
    """
    integrals = _integrals(mesh, displacements, wall_displacements)
    n = mesh.n_spheres
    around, volumes = np.zeros((n + 6, 3, 3)), np.zeros(n + 6)
    for vertex in mesh.cells.T:
        np.add.at(around, vertex, integrals)
        np.add.at(volumes, vertex, mesh.cell_volumes)
    return _strains(_over(around[:n], volumes[:n]))


def cell_strains(mesh: PoreMesh, displacements: ArrayLike, wall_displacements: ArrayLike) -> np.ndarray:
    """Mean strain of each cell, (m, 3, 3), positive in compression; parameters, errors and u as of `grain_strains`.

    Cells fill the box: their mean, weighted by `PoreMesh.cell_volumes`, is the strain of the sample.

    Theory, grains and fluid: :eq:`eq-grain-strain`.
    """
    return _strains(_over(_integrals(mesh, displacements, wall_displacements), mesh.cell_volumes))


def layer_means(places: ArrayLike, values: ArrayLike, weights: ArrayLike, edges: ArrayLike) -> np.ndarray:
    """Means over layers: Σ w v / Σ w over what lies in each.

    Parameters
    ----------
    places : (k,) array
        Where each thing is, along the axis: centres of grains, or vertices of cells [m].
    values : (k, ...) array
        What each has: stresses, strains, pressures.
    weights : (k,) array
        `PoreMesh.laguerre_volumes` for grains, `PoreMesh.cell_volumes` for cells. What has no weight does not count,
        whatever its value.
    edges : (l + 1,) array
        Of the layers, increasing; each holds its lower edge, the last its upper one too. What lies beyond belongs to
        none [m].

    Returns
    -------
    (l, ...) array
        NaN for a layer without anything in it.

    Raises
    ------
    InputError
        For arrays of different lengths, weights below zero, or edges that do not increase.
    """
    places, values = np.asarray(places, float), np.asarray(values, float)
    weights, edges = np.asarray(weights, float), np.asarray(edges, float)
    if edges.ndim != 1 or len(edges) < 2 or not (np.diff(edges) > 0.0).all():
        raise InputError("edges of layers must be two or more increasing places")
    if places.ndim != 1 or weights.shape != places.shape or values.shape[:1] != places.shape:
        raise InputError(
            f"places, values and weights must be equally many, not {places.shape}, {values.shape} and {weights.shape}"
        )
    if not (weights >= 0.0).all():
        raise InputError("weights must be zero or more: volumes of Laguerre cells, or of cells")
    layer = np.searchsorted(edges, places, side="right") - 1
    layer[places == edges[-1]] = len(edges) - 2
    held = (layer >= 0) & (layer < len(edges) - 1) & (weights > 0.0)
    layer, weights, values = layer[held], weights[held], values[held]
    sums = np.zeros((len(edges) - 1, *values.shape[1:]))
    np.add.at(sums, layer, weights.reshape(-1, *[1] * (values.ndim - 1)) * values)
    return _over(sums, np.bincount(layer, weights, len(edges) - 1))


def _outer(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    return a[:, :, None] * b[:, None, :]


def _over(sums: np.ndarray, sizes: np.ndarray) -> np.ndarray:
    """Sums (k, ...) over sizes (k,); NaN where there is no size."""
    sizes = np.broadcast_to(sizes.reshape(-1, *[1] * (sums.ndim - 1)), sums.shape)
    return np.divide(sums, sizes, out=np.full(sums.shape, np.nan), where=sizes > 0.0)


def _strains(gradients: np.ndarray) -> np.ndarray:
    return -0.5 * (gradients + np.swapaxes(gradients, 1, 2))


def _integrals(mesh: PoreMesh, displacements: ArrayLike, wall_displacements: ArrayLike) -> np.ndarray:
    """(m, 3, 3): ∮ u ⊗ n dS over each cell [m³]."""
    ensure_walls(mesh)
    u, walls = np.array(displacements, float), np.array(wall_displacements, float)
    for moves, shape, what in (
        (u, (mesh.n_spheres, 3), "displacements, one row per grain"),
        (walls, (6,), "wall_displacements, one per wall"),
    ):
        if moves.shape != shape or not np.isfinite(moves).all():
            raise InputError(f"{what}, must be finite numbers of shape {shape}, not {moves.shape}")
    integrals = np.zeros((mesh.n_cells, 3, 3))
    displacements_of = Displacements(u, walls)
    for_rows(_displacement_integrals, mesh.n_cells, mesh.cells, mesh.cell_vertices, displacements_of, integrals)
    return integrals


@kernel
def _displacement_integrals(first, last, cells, vertices, displacements, integrals):
    """Add ∮ u ⊗ n dS over cells first ... last - 1 to `integrals` (m, 3, 3).

    Facet by facet, it is the mean displacement times the area vector.

    The facet opposite to a wall has a projection on it, the cell's face there: the same displacement but for the
    component along the wall's normal, which is the wall's.
    """
    n = vertices.n_spheres
    for t in unsigned_range(first, last):
        for i in range(4):
            a, b, c = cells[t, (i + 1) % 4], cells[t, (i + 2) % 4], cells[t, (i + 3) % 4]
            if min(a, b, c) >= n:  # three walls: the corner of the box, without area
                continue
            # A step in the cycle of four is an odd permutation: every other facet is turned for its area to point out.
            a, b, c = spheres_first(a, c, b, n) if i % 2 == 0 else spheres_first(a, b, c, n)
            area = area_vector(a, b, c, vertices)
            mean = _mean_displacement(a, b, c, vertices, displacements)
            for p in range(3):
                for q in range(3):
                    integrals[t, p, q] += mean[p] * area[q]
            wall = cells[t, i] - n
            if wall >= 0:
                axis = WALL_AXES[wall]
                mean[axis] = vertices.points[n + wall, axis] * displacements.walls[wall]
                for p in range(3):
                    integrals[t, p, axis] -= mean[p] * area[axis]


@helper
def _mean_displacement(a, b, c, vertices, displacements):
    """Mean displacement over a facet: linear on a triangle, bilinear between the corners of the others."""
    moves, wall_moves = displacements
    n = vertices.n_spheres
    mean = np.empty(3)
    for axis in range(3):
        mean[axis] = moves[a, axis]
    if c < n:
        for axis in range(3):
            mean[axis] = (moves[a, axis] + moves[b, axis] + moves[c, axis]) / 3.0
    elif b < n:  # a trapezoid over the edge ab: half the weight of each end is on the wall
        ha = wall_distance(a, c, vertices)
        hb = wall_distance(b, c, vertices)
        share = (ha + 2.0 * hb) / (3.0 * (ha + hb))
        for axis in range(3):
            mean[axis] += share * (moves[b, axis] - moves[a, axis])
        _halve_with_wall(c - n, vertices, wall_moves, mean)
    else:
        _halve_with_wall(b - n, vertices, wall_moves, mean)
        _halve_with_wall(c - n, vertices, wall_moves, mean)
    return mean


@helper
def _halve_with_wall(wall, vertices, wall_moves, mean):
    """Half of the facet's corners are on the wall: along its normal they move with it."""
    axis = WALL_AXES[wall]
    mean[axis] = 0.5 * (mean[axis] + vertices.points[vertices.n_spheres + wall, axis] * wall_moves[wall])
