"""Throats with much more room than grains, as pores of loose states have them, where pairs resist.

Two things that are true of narrow throats are wrong there (docs/theory_coupling.md, Throats with much room):

- the drag of section friction on a grain alone in a box of slip walls is 1.77 times Stokes' however large the box; the
  exact one falls from 1.75 at a side of 7 radii to Stokes';
- a no-slip wall takes over drag of a grain that moves, in proportion to its surface, however far it is.

The second is mended without a change of the flow through grains that are held. Grains and walls that share a throat
move with several velocities; the dissipation of the flow relative to their mean leaves out a part. That part is added
as a resistance of grains that move past the wall.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from porefv.conductance.conductances import throat_conductances
from porefv.conductance.model import ConductanceModel
from porefv.flow.forces import facet_forces
from porefv.mesh.pore_mesh import PoreMesh

# Drag of section friction on a grain with much room, over Stokes', and the room, over the radius of the largest grain,
# from which on it is too large. Stokes' drag is 1 + (_ALONE - 1) _ROOMY / room beyond that.
_ALONE, _ROOMY = 1.767, 4.0
# Room along a no-slip wall from and to which its share in the drag passes from that of its surface to that of its
# resistance.
_NEAR, _FAR = 1.0, 2.0


class FarWalls(NamedTuple):
    """Resistance of grains that move past no-slip walls on the other side of open throats.

    Attributes
    ----------
    members : (p, 2) int array
        Grain, by id, and n + number of the wall.
    normals : (p, 3) array
        Along the throat [-].
    coefficients : (p,) array
        Force along the throat per velocity of the grain relative to the wall [N s/m].
    """

    members: np.ndarray
    normals: np.ndarray
    coefficients: np.ndarray


NO_FAR_WALLS = FarWalls(np.empty((0, 2), np.int64), np.empty((0, 3)), np.empty(0))


class OpenThroats(NamedTuple):
    """Throats where pairs resist.

    Attributes
    ----------
    conductances : (t,) array
        [m³/(Pa s)]
    wall_factors : (t,) array
        Of the share of no-slip walls in the drag of each throat, as of `facet_forces` [-].
    far_walls : FarWalls
    """

    conductances: np.ndarray
    wall_factors: np.ndarray
    far_walls: FarWalls


def open_throats(mesh: PoreMesh, model: ConductanceModel, slip: np.ndarray, viscosity: float) -> OpenThroats:
    """Conductances of throats where pairs resist, and what no-slip walls do to grains that move.

    Parameters
    ----------
    mesh : PoreMesh
    model : ConductanceModel
    slip : (6,) bool array
        Walls of symmetry.
    viscosity : float
        [Pa s]

    Notes
    -----
    Theory, grains and fluid: :eq:`eq-open-throats` and :eq:`eq-far-walls`.
    """
    growth = growth_of_open_throats(mesh)
    conductances = throat_conductances(mesh, model, slip, viscosity)
    if slip.all():
        return OpenThroats(conductances * growth, np.ones(len(growth)), NO_FAR_WALLS)
    without = throat_conductances(mesh, model, np.ones(6, bool), viscosity)
    # Of the resistance, that of the grains: 1 - ratio is that of the walls.
    ratio = np.divide(conductances, without, out=np.ones_like(growth), where=without > conductances)
    conductances = conductances / (1.0 - ratio + ratio / growth)
    ratio = ratio / growth / (1.0 - ratio + ratio / growth)
    drag = _Drag.of(mesh, slip, model)
    reach, total = wall_reach(mesh, slip), drag.walls.sum(axis=1)
    dragged = (total > 0.0) & (conductances > 0.0)
    factors = reach + (1.0 - reach) * np.divide(1.0 - ratio, total, out=np.ones_like(total), where=dragged)
    apart = np.zeros_like(total)
    np.divide((1.0 - reach) * ratio * (1.0 - ratio), conductances * total, out=apart, where=dragged)
    return OpenThroats(conductances, factors, drag.far_walls(apart, mesh.n_spheres))


class _Drag(NamedTuple):
    """How the drag on throats is divided among grains, without the walls, and what part walls have.

    Attributes
    ----------
    sections : (t, 3) array
        Fluid area, along the throat [m²].
    throats, grains : (m,) int arrays
    shares : (m,) array
        Of the grain in the drag of the throat without walls [-].
    walls : (t, 6) array
        Share of each wall [-].
    """

    sections: np.ndarray
    throats: np.ndarray
    grains: np.ndarray
    shares: np.ndarray
    walls: np.ndarray

    @classmethod
    def of(cls, mesh: PoreMesh, slip: np.ndarray, model: ConductanceModel) -> _Drag:
        facets, n = mesh.facets, mesh.n_spheres
        own = np.flatnonzero(mesh.throats.facet_throat >= 0)
        throat = mesh.throats.facet_throat[own]
        normals, vertices = facets.normals[own], facets.vertices[own]
        first = facets.normals[mesh.throats.first_facets[throat]]
        senses = np.where((normals * first).sum(axis=1) > 0.0, 1.0, -1.0)
        sections = np.zeros((len(mesh.throats), 3))
        np.add.at(sections, throat, (senses * facets.fluid_areas[own])[:, None] * normals)
        squares = (sections**2).sum(axis=1)
        along = np.divide(sections, squares[:, None], out=np.zeros_like(sections), where=squares[:, None] > 0.0)
        along = senses[:, None] * along[throat]
        alike = facet_forces(mesh, np.ones(6, bool), model.force_split)[own]
        dragged = facet_forces(mesh, slip, model.force_split)[own]
        of_grains = alike - facets.sectors[own][:, :, None] * normals[:, None, :]
        shares = np.maximum((of_grains * along[:, None, :]).sum(axis=2), 0.0)
        of_walls = np.maximum(((dragged - alike) * along[:, None, :]).sum(axis=2), 0.0)
        facet, corner = np.nonzero(vertices >= n)
        walls = np.zeros((len(sections), 6))
        np.add.at(walls, (throat[facet], vertices[facet, corner] - n), of_walls[facet, corner])
        facet, corner = np.nonzero(vertices < n)
        return cls(sections, throat[facet], vertices[facet, corner], shares[facet, corner], walls)

    def far_walls(self, apart: np.ndarray, n: int) -> FarWalls:
        """Resistances, from those of the throats, (t,), to flux: for the whole drag of grains and of walls."""
        row, wall = np.nonzero(self.walls[self.throats] * (apart[self.throats] * self.shares)[:, None])
        throat = self.throats[row]
        areas = np.sqrt((self.sections[throat] ** 2).sum(axis=1))
        coefficients = apart[throat] * areas**2 * self.shares[row] * self.walls[throat, wall]
        members = np.stack([self.grains[row], n + wall], axis=1)
        return FarWalls(members, self.sections[throat] / areas[:, None], coefficients)


def room(mesh: PoreMesh, slip: np.ndarray) -> np.ndarray:
    """(t,): radius of the circle inscribed in each throat's neck over that of its largest grain [-].

    Parameters
    ----------
    mesh : PoreMesh
    slip : (6,) bool array
        Walls of symmetry: the circle reaches beyond them.
    """
    return mesh.throats.inscribed_circles(slip)[0] / _largest(mesh)


def _largest(mesh: PoreMesh) -> np.ndarray:
    vertices = mesh.facets.vertices[mesh.throats.first_facets]
    return np.append(mesh.packing.radii, np.zeros(6))[vertices].max(axis=1)


def growth_of_open_throats(mesh: PoreMesh) -> np.ndarray:
    """(t,): factor of the conductances, 1 up to a room of 4 radii, with which a grain alone has Stokes' drag.

    The radius is that of the throat's largest grain, and the mean by surface at least: between fines in a void of
    large grains the flow is not that past a grain alone.

    Theory, grains and fluid: :eq:`eq-open-throats`.
    """
    radii = mesh.packing.radii
    mean = float((radii**3).sum() / (radii**2).sum())
    circles = mesh.throats.inscribed_circles(np.ones(6, bool))[0]
    beyond = _ROOMY / np.maximum(circles / np.maximum(_largest(mesh), mean), _ROOMY)
    return _ALONE / (1.0 + (_ALONE - 1.0) * beyond)


def wall_reach(mesh: PoreMesh, slip: np.ndarray) -> np.ndarray:
    """(t,): how near no-slip walls are through each throat: 1 in narrow ones, 0 in open ones."""
    return np.clip((_FAR - room(mesh, slip)) / (_FAR - _NEAR), 0.0, 1.0)
