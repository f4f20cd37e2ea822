"""Pair resistance: what the fluid between two grains does against their moving past each other, and lubrication.

The pores resist flow through grains that move together, and next to nothing else: grains that move without a change of
pore volumes meet no drag. In loose states that is most of the motion. This module adds, for every edge of the
triangulation between two grains, or a grain and a wall that drags the fluid, forces and torques against the relative
velocity at the middle of the gap (docs/theory_coupling.md, Pair resistance):

- lubrication, normal, tangential and rolling, with the leading terms of Jeffrey and Onishi (1984), cut off at a gap of
  the roughness;
- a part that does not depend on the gap, fitted to settling clouds (benchmarks/settling.py);
- both fading at large distance.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from porefv.coupling.open_throats import NO_FAR_WALLS, FarWalls
from porefv.coupling.pair_resistance_kernels import (
    add_blocks,
    add_resistance,
    find_coefficients,
    invert_blocks,
    solve_for_changes,
)
from porefv.errors import ComputationError
from porefv.mesh.pore_mesh import PoreMesh

_MOST_ITERATIONS = 5000


class PairLaw(NamedTuple):
    """What the coefficients of pairs depend on, besides their geometry. Gaps are over the mean radius of a pair.

    The far part is π μ a growth min(gap, grown) / (1 + (l / reach)⁴) along all axes, with a the harmonic mean of the
    radii and l the distance of the centres over the mean radius. Numbers are fitted to the mean settling speed of free
    clouds, its scatter and the smallest eigenvalue, and to two grains that slide (benchmarks/settling.py).

    Attributes
    ----------
    viscosity : float
        [Pa s]
    roughness : float
        Gap below which lubrication grows no more [-].
    growth, grown : float
        How the far part grows with the gap, and the gap to which it does. Without it, grains of a dilute cloud move
        past each other too fast [-].
    reach : float
        Distance beyond which the far part fades: or else the grains of a bed would hold back those far above it [-].
    lubricated : float
        Gap at which lubrication begins: the leading terms are those of near contact [-].
    contact : float
        What stands for the terms of lubrication that do not grow as the gap closes: its coefficient over π μ a at
        contact, from where it falls to nothing at `lubricated` [-].

    Notes
    -----
    Theory, grains and fluid: :eq:`eq-lubrication-normal`, :eq:`eq-lubrication-shear` and :eq:`eq-pair-far`.
    """

    viscosity: float
    roughness: float
    growth: float = 0.7
    grown: float = 5.0
    reach: float = 12.0
    lubricated: float = 1.0
    contact: float = 1.0


class Pairs(NamedTuple):
    """Pairs of grains, or of a grain and a wall, by row: grains, then the six walls.

    Attributes
    ----------
    members : (p, 2) uint32 array
    normals : (p, 3) array
        From the first to the second [-].
    arms : (p, 2) array
        From the centres to the middle of the gap; zero for a wall, which does not turn [m].
    normal, tangential : (p,) arrays
        Force per relative velocity along the normal, and across it [N s/m].
    rolling : (p,) array
        Torque per relative spin across the normal [N m s].
    """

    members: np.ndarray
    normals: np.ndarray
    arms: np.ndarray
    normal: np.ndarray
    tangential: np.ndarray
    rolling: np.ndarray


_NO_CONTACTS = Pairs(np.empty((0, 2), np.uint32), np.empty((0, 3)), np.empty((0, 2)), *np.empty((3, 0)))


class PairResistance:
    """L of the pairs of one mesh: forces and torques -L u for velocities and spins u.

    L is symmetric and positive semidefinite, and L u is zero where grains and walls move as one rigid body.

    Parameters
    ----------
    mesh : PoreMesh
    dragging : (6,) bool array
        Walls that drag the fluid: those with neither slip nor a pressure.
    law : PairLaw
    grain_rows : (n,) int array, optional
        Row of each grain in arrays of velocities and forces, its id by default.
    far_walls : FarWalls, optional
        Resistances of walls on the other side of open throats, which stay those of the mesh.

    Attributes
    ----------
    pairs : Pairs
        Coefficients are those of the last `set_positions`; at first of the mesh. Those of far walls come last.
    n_rows : int
        Number of grains and walls.

    Notes
    -----
    Theory, grains and fluid: :eq:`eq-pair-motion` and :eq:`eq-pair-force`.
    """

    def __init__(
        self,
        mesh: PoreMesh,
        dragging: np.ndarray,
        law: PairLaw,
        grain_rows: np.ndarray | None = None,
        far_walls: FarWalls = NO_FAR_WALLS,
    ):
        n = mesh.n_spheres
        self.law, self._rows = law, np.arange(n) if grain_rows is None else grain_rows
        number = np.append(self._rows, n + np.arange(6))
        ends = np.concatenate([mesh.cells[:, [a, b]] for a in range(4) for b in range(a)])
        ends = ends[(ends < n).any(axis=1) & np.append(np.ones(n, bool), dragging)[ends].all(axis=1)]
        codes = np.unique(np.sort(number[ends], axis=1) @ np.array([n + 6, 1]))
        members = np.stack(np.divmod(codes, n + 6), axis=1).astype(np.uint32)
        near, count = len(members), len(members) + len(far_walls.members)
        members = np.concatenate([members, number[far_walls.members].astype(np.uint32)])
        self.pairs = Pairs(members, np.zeros((count, 3)), np.zeros((count, 2)), *np.zeros((3, count)))
        self.pairs.normals[near:], self.pairs.normal[near:] = far_walls.normals, far_walls.coefficients
        self._near = Pairs(*(values[:near] for values in self.pairs))
        self.n_rows = n + 6
        self._blocks, self._room = np.zeros((n + 6, 2, 6)), np.empty((4, n + 6, 6))
        self.set_positions(mesh.packing.centres, mesh.packing.radii, mesh.box.wall_places)

    def set_positions(self, centres: np.ndarray, radii: np.ndarray, places: np.ndarray) -> None:
        """Work out the coefficients for grains, by id, and walls that have moved; pairs stay those of the mesh."""
        motion = np.empty((len(centres), 4))
        motion[self._rows, :3], motion[self._rows, 3] = centres, radii
        find_coefficients(self.law, self._near.members, motion, places, self._near)
        self._blocks[:] = 0.0
        add_blocks(self.pairs, self._blocks)
        self._kept: tuple[np.ndarray, np.ndarray] | None = None

    def multiply(self, velocities: np.ndarray) -> np.ndarray:
        """(n + 6, 6): L u, forces and torques that pairs resist with, from velocities and spins by row."""
        resisted = np.zeros_like(velocities)
        add_resistance(self.pairs, velocities, resisted)
        return resisted

    def solve(
        self,
        velocities: np.ndarray,
        mobilities: np.ndarray,
        guess: np.ndarray,
        tolerance: float,
        contacts: Pairs | None = None,
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray, int]:
        """u with u = ẋ* - D L u: velocities after a step in which pairs resist those at its end.

        Parameters
        ----------
        velocities : (n + 6, 6) array
            ẋ*: velocities and spins that grains and walls, by row, would have without pairs [m/s, rad/s].
        mobilities : (n + 6, 6) array
            D: what a force, or torque, over the step adds to them; zero for what moves on its own.
        guess : (n + 6, 6) array
            Where to start: u - ẋ*.
        tolerance : float
            Bound on what the residual changes velocities by over the step, relative to them.
        contacts : Pairs, optional
            Contacts that yield in the step, by the same law: they resist besides.

        Returns
        -------
        u : (n + 6, 6) array
        forces, yielded : (n + 6, 6) arrays
            Forces and torques of the pairs, and of such contacts [N, N m].
        iterations : int

        Raises
        ------
        ComputationError
            If it is not reached.
        """
        contacts = _NO_CONTACTS if contacts is None else contacts
        inertia = np.divide(1.0, mobilities, out=np.zeros_like(mobilities), where=mobilities > 0.0)
        changes, room = guess.copy(), self._room
        forces, yielded = np.empty((2, *guess.shape))
        iterations = solve_for_changes(
            self.pairs, contacts, mobilities, inertia, self._inverses(inertia, contacts), velocities, changes, forces,
            yielded, room, float(tolerance), _MOST_ITERATIONS,
        )  # fmt: skip
        if iterations < 0:
            raise ComputationError(
                f"the velocities of grains that lubrication slows down were not found in {_MOST_ITERATIONS} "
                "iterations; a larger roughness, a smaller step or a lower viscosity makes it easier"
            )
        return velocities + changes, forces, yielded, iterations

    def _inverses(self, inertia: np.ndarray, contacts: Pairs) -> np.ndarray:
        """(n + 6, 2, 6): inverses of the diagonal blocks of D⁻¹ + L, zero in what moves on its own."""
        first, blocks, inverses = 0, self._blocks, np.empty_like(self._blocks)
        if len(contacts.normal):
            blocks = blocks.copy()
            add_blocks(contacts, blocks)
        elif self._kept is not None and np.array_equal(self._kept[0][:-6], inertia[:-6]):
            first, inverses = len(inertia) - 6, self._kept[1]
        invert_blocks(first, inertia, blocks, inverses)
        self._kept = None if len(contacts.normal) else (inertia, inverses)
        return inverses
