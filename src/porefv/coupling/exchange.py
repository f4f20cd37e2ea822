"""What moving grains do to pores, and pores to grains: volume rates E ẋ and forces Eᵀ p (C14 eq. 25-26).

One operator E serves for both, so that the work of the fluid on the grains is the work it takes from the pores, to
the last digit. There are two such operators:

- `facets`: Eᵀ is the force operator S of a steady flow, by C12 (eq. 14, 17, 18) or by the conductance model's force
  split. E = Sᵀ is then the rate of the fluid's volume in a pore whose throats move with the mean velocity of the solids
  around them, each weighted by its wetted surface: what the throat's flow is relative to, by reciprocity.
- `volumes`: E is the exact derivative of the volume of the pore's cells, solid included; Eᵀ shares the force on a
  facet equally among its three vertices.

Summed over all pores both are the rate of the box.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from porefv.conductance.model import ForceSplit
from porefv.flow.forces import facet_forces
from porefv.flow.pressure_on_grains import SolidPressureWeights
from porefv.mesh.pore_mesh import PoreMesh
from porefv.packing.box import WALL_NORMALS
from porefv.system.kernels import kernel

EXCHANGES = ("facets", "volumes")


class Exchange(NamedTuple):
    """The operator E, cell by cell, and once more for each neighbour whose pressure acts on the cell's solid.

    A named tuple, so that compiled kernels take it as it is.

    Attributes
    ----------
    rows : (e, 4) uint32 array
        Row of each vertex of each cell in arrays of velocities or forces: grains, then the six walls.
    gradients : (e, 4, 3) array
        What a pressure of 1 at the node does to each vertex [m²].
    nodes : (e,) uint32 array
        Entry in arrays of pressures or volume rates: the cell itself, or one of the neighbour's. (Indices without sign
        need no look at whether they count from the end.)

    Notes
    -----
    Theory, grains and fluid: :eq:`eq-coupled-pressure` and :eq:`eq-coupled-motion`.
    """

    rows: np.ndarray
    gradients: np.ndarray
    nodes: np.ndarray

    @classmethod
    def of(
        cls,
        mesh: PoreMesh,
        kind: str,
        slip: np.ndarray,
        grain_rows: np.ndarray | None = None,
        *,
        split: ForceSplit = "surface",
        solid_pressure: SolidPressureWeights | None = None,
        wall_factors: np.ndarray | None = None,
    ) -> Exchange:
        """The operator of a mesh.

        Parameters
        ----------
        mesh : PoreMesh
        kind : {'facets', 'volumes'}
        slip : (6,) bool array
            Walls that do not drag the fluid.
        grain_rows : (n,) int array, optional
            Row of each grain in arrays of velocities and forces, its id by default.
        split : {'surface', 'drag'}
            How the vertices of a throat divide its drag, with the kind 'facets' (see `porefv.flow.grain_forces`).
        solid_pressure : SolidPressureWeights, optional
            How the pressures of other pores act on the grains of a pore, with the kind 'facets'.
        wall_factors : (t,) array, optional
            Of the share of no-slip walls in the drag of each throat, with the kind 'facets'; the throat's grains take
            the rest (`porefv.coupling.open_throats`). 1 by default [-].
        """
        n = mesh.n_spheres
        gradients = mesh.volume_gradients if kind == "volumes" else _facet_gradients(mesh, slip, split, wall_factors)
        number = np.arange(n + 6, dtype=np.uint32)
        if grain_rows is not None:
            number[:n] = grain_rows
        found = cls(number[mesh.cells], gradients, np.arange(mesh.n_cells, dtype=np.uint32))
        return found if kind == "volumes" or solid_pressure is None else found._interpolated(mesh, solid_pressure)

    def _interpolated(self, mesh: PoreMesh, solid_pressure: SolidPressureWeights) -> Exchange:
        """The same with pressures of neighbours acting on the grains of pores, by these weights."""
        pores, weights = solid_pressure.pores, solid_pressure.weights
        order, firsts = mesh.cells_of_pores
        throat, side = np.nonzero(weights)
        here, there = pores[throat, side], pores[throat, 1 - side]
        count = firsts[here + 1] - firsts[here]
        which = np.repeat(np.arange(len(throat)), count)  # a throat's side for every cell of its pore
        within = np.arange(len(which)) - np.repeat(np.cumsum(count) - count, count)
        cells = order[firsts[here[which]] + within]
        factors = weights[throat, side][which, None, None]
        kept = 1.0 - np.bincount(pores.ravel(), weights.ravel(), mesh.n_pores)[mesh.cell_pore]
        return Exchange(
            np.concatenate([self.rows, self.rows[cells]]),
            np.concatenate([kept[:, None, None] * self.gradients, factors * self.gradients[cells]]),
            np.concatenate([self.nodes, order[firsts[there[which]]].astype(np.uint32)]),
        )

    def between(self, nodes: np.ndarray) -> Exchange:
        """The same with these entries (m,) for the cells, without the cells where they are negative."""
        nodes = nodes[self.nodes]
        used = nodes >= 0
        return Exchange(self.rows[used], self.gradients[used], nodes[used].astype(np.uint32))

    def rates(self, velocities: np.ndarray, wall_velocities: np.ndarray) -> np.ndarray:
        """(m,): E ẋ of each cell, from velocities (n, 3) of the grains and (6, 3) of the walls [m³/s]."""
        out = np.zeros(int(self.nodes.max()) + 1)
        self.gather(np.concatenate([velocities, wall_velocities]), out)
        return out

    def forces(self, pressure: np.ndarray, n: int) -> tuple[np.ndarray, np.ndarray]:
        """Eᵀ p: forces on grains (n, 3) and walls (6, 3), from the pressure of each cell (m,) [N]."""
        out = np.zeros((n + 6, 3))
        self.spread(pressure, out)
        return out[:n], out[n:]

    def gather(self, moves: np.ndarray, out: np.ndarray) -> None:
        """Add E ẋ to `out`, by entry, from the velocities (n + 6, 3) of grains, by row, and walls."""
        gather(self, moves, out)

    def spread(self, pressure: np.ndarray, out: np.ndarray) -> None:
        """Add Eᵀ p to `out` (n + 6, 3), from pressures by entry."""
        spread(self, pressure, out)


def _facet_gradients(
    mesh: PoreMesh, slip: np.ndarray, split: ForceSplit, wall_factors: np.ndarray | None
) -> np.ndarray:
    gradients = np.zeros((mesh.n_cells, 4, 3))
    forces = facet_forces(mesh, slip, split)
    if wall_factors is not None and (wall_factors != 1.0).any() and not slip.all():
        throat = mesh.throats.facet_throat
        taken = np.where(throat >= 0, wall_factors[throat], 1.0)[:, None, None]
        forces = taken * forces + (1.0 - taken) * facet_forces(mesh, np.ones(6, bool), split)
    _gather_facets(mesh.cells, mesh.facets.cells, mesh.facets.vertices, forces, gradients)
    faces = mesh.wall_faces
    on_wall = (mesh.cells[faces.cells] == (mesh.n_spheres + faces.walls)[:, None]).argmax(axis=1)
    np.add.at(gradients, (faces.cells, on_wall), faces.areas[:, None] * WALL_NORMALS[faces.walls])
    return gradients


@kernel
def _gather_facets(cells, facet_cells, facet_vertices, forces, gradients):
    """Add to each cell what its facets' unit forces (f, 3, 3) do to its vertices, outward from the cell."""
    for f in range(facet_cells.shape[0]):
        for side in range(2):
            t = facet_cells[f, side]
            sense = 1.0 if side == 0 else -1.0
            for v in range(3):
                for i in range(4):
                    if cells[t, i] == facet_vertices[f, v]:
                        for axis in range(3):
                            gradients[t, i, axis] += sense * forces[f, v, axis]


@kernel
def gather(exchange, moves, out):
    """out[node] += Σ gradient · move over each cell's vertices.

    Parameters
    ----------
    exchange : Exchange
    moves : (n + 6, 3) array
        Velocities of grains, by row, and walls [m/s], or displacements.
    out : array by entry
        Added to [m³/s].
    """
    rows, gradients, nodes = exchange
    for t in range(rows.shape[0]):
        total = 0.0
        for i in range(4):
            k = rows[t, i]
            for axis in range(3):
                total += gradients[t, i, axis] * moves[k, axis]
        out[nodes[t]] += total


@kernel
def spread(exchange, pressure, out):
    """out[vertex] += gradient × pressure[node], over the vertices of each cell.

    Parameters
    ----------
    exchange : Exchange
    pressure : array by entry
        [Pa]
    out : (n + 6, 3) array
        Forces on grains, by row, and walls, added to [N].
    """
    rows, gradients, nodes = exchange
    for t in range(rows.shape[0]):
        p = pressure[nodes[t]]
        for i in range(4):
            k = rows[t, i]
            for axis in range(3):
                out[k, axis] += gradients[t, i, axis] * p
