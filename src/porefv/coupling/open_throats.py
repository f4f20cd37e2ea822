"""Throats with much more room than grains, as pores of loose states have them.

Two things that are true of narrow throats are wrong there (docs/theory_coupling.md, Pair resistance):

- the drag of section friction on a grain alone in a box of slip walls is 1.77 times Stokes' however large the box; the
  exact one falls from 1.75 at a side of 7 radii to Stokes';
- a no-slip wall takes a share of the drag in proportion to its surface, however far the grains are.
"""

from __future__ import annotations

import numpy as np

from porefv.mesh.pore_mesh import PoreMesh

# Drag of section friction on a grain with much room, over Stokes', and the room, over the radius of the largest grain
# of the throat, from which on it is too large. Stokes' drag is 1 + (_ALONE - 1) _ROOMY / room beyond that.
_ALONE, _ROOMY = 1.767, 4.0
# Room along a no-slip wall from and to which its drag on the throat passes to the pairs of grains and wall.
_NEAR, _FAR = 1.0, 2.0


def room(mesh: PoreMesh, slip: np.ndarray) -> np.ndarray:
    """(t,): radius of the circle inscribed in each throat's neck over that of its largest grain [-].

    Parameters
    ----------
    mesh : PoreMesh
    slip : (6,) bool array
        Walls of symmetry: the circle reaches beyond them.
    """
    vertices = mesh.facets.vertices[mesh.throats.first_facets]
    largest = np.append(mesh.packing.radii, np.zeros(6))[vertices].max(axis=1)
    return mesh.throats.inscribed_circles(slip)[0] / largest


def growth_of_open_throats(mesh: PoreMesh) -> np.ndarray:
    """(t,): factor of the conductances, 1 up to a room of 4 radii, with which a grain alone has Stokes' drag.

    Theory, grains and fluid: :eq:`eq-open-throats`.
    """
    all_slip = room(mesh, np.ones(6, bool))
    beyond = np.minimum(1.0, _ROOMY / np.maximum(all_slip, _ROOMY))
    return _ALONE / (1.0 + (_ALONE - 1.0) * beyond)


def wall_reach(mesh: PoreMesh, slip: np.ndarray) -> np.ndarray:
    """(t,): part of the drag of no-slip walls that stays with each throat: 1 in narrow ones, 0 in open ones."""
    return np.clip((_FAR - room(mesh, slip)) / (_FAR - _NEAR), 0.0, 1.0)
