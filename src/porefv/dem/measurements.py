"""What is measured of a sample of grains: its contacts and its energies."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from porefv.dem.contacts import StepParameters, grain_contacts, wall_contacts
from porefv.dem.grain_state import GrainState
from porefv.packing.box import WALL_AXES, WALL_NORMALS, WALL_SENSES


@dataclass(frozen=True, eq=False)
class Contacts:
    """Contacts at this moment: forces on grains from others and from walls.

    Attributes
    ----------
    grains : (c, 2) int array
        Grains i, j of each contact; j = n + w for wall w.
    normals : (c, 3) array
        Unit vector from i to j.
    points : (c, 3) array
        Middle of the overlap; on the wall, for walls [m].
    forces : (c, 3) array
        Force on i [N].
    overlaps : (c,) array
        u_n [m].
    """

    grains: np.ndarray
    normals: np.ndarray
    points: np.ndarray
    forces: np.ndarray
    overlaps: np.ndarray

    def __len__(self) -> int:
        return len(self.grains)

    @classmethod
    def of(cls, state: GrainState) -> Contacts:
        """Contacts between grains, and then between grains and walls; tangential forces are those of the last step."""
        x, r = state.grains.motion[:, :3], state.grains.motion[:, 3]
        pairs, wall_pairs = state.pairs, state.wall_pairs
        held = np.flatnonzero(_overlaps(state) > 0.0)
        i, j = pairs.grains[held].T
        branch = x[j] - x[i]
        distance = np.sqrt((branch**2).sum(axis=1))
        normals = branch / distance[:, None]
        overlaps = r[i] + r[j] - distance
        forces = _across(pairs.shear[held], normals) - (pairs.stiffness[held] * overlaps)[:, None] * normals
        points = x[i] + (r[i] - 0.5 * overlaps)[:, None] * normals

        walled = np.flatnonzero(_wall_overlaps(state) > 0.0)
        k, w = wall_pairs.members[walled].T
        wall_normals = WALL_NORMALS[w]
        wall_overlaps = _wall_overlaps(state)[walled]
        wall_forces = _across(wall_pairs.shear[walled], wall_normals)
        wall_forces -= (wall_pairs.stiffness[walled] * wall_overlaps)[:, None] * wall_normals
        wall_points = x[k] + (r[k] - wall_overlaps)[:, None] * wall_normals
        ids = state.order
        return cls(
            np.concatenate([ids[pairs.grains[held]], np.stack([ids[k], len(state) + w.astype(np.int64)], axis=1)]),
            np.concatenate([normals, wall_normals]),
            np.concatenate([points, wall_points]),
            np.concatenate([forces, wall_forces]),
            np.concatenate([overlaps, wall_overlaps]),
        )


@dataclass(frozen=True)
class Energies:
    """Energies [J]: what there is, and what has come and gone since the start.

    Kinetic energy is ½ m v(t - dt/2)·v(t + dt/2) and the like for spins: with it the total is conserved exactly by the
    leapfrog on linear contacts that neither open nor close, without damping.
    """

    kinetic: float
    elastic: float
    potential: float
    sliding: float
    damping: float
    walls: float
    applied: float

    @property
    def stored(self) -> float:
        """Kinetic, elastic and potential energy."""
        return self.kinetic + self.elastic + self.potential

    @property
    def balance(self) -> float:
        """Stored and dissipated energy less work done on the grains: constant, but for the error of the steps."""
        return self.stored + self.sliding + self.damping - self.walls - self.applied

    @classmethod
    def of(cls, state: GrainState, parameters: StepParameters) -> Energies:
        """Energies at time t."""
        step, gravity, ratio = parameters.dt, parameters.gravity, parameters.ratio
        motion, inverse_mass, inverse_inertia = state.grains
        loads = contact_loads(state, parameters)
        accelerations = (loads[:, :3] + state.applied) * inverse_mass[:, None] + gravity
        turns = loads[:, 3:] * inverse_inertia[:, None]
        v, w = motion[:, 4:7], motion[:, 7:10]
        kinetic = 0.5 * ((v * (v + step * accelerations)).sum(axis=1) / inverse_mass).sum()
        kinetic += 0.5 * ((w * (w + step * turns)).sum(axis=1) / inverse_inertia).sum()
        elastic = 0.0
        for pairs, overlaps in ((state.pairs, _overlaps(state)), (state.wall_pairs, _wall_overlaps(state))):
            elastic += 0.5 * float((pairs.stiffness * np.maximum(overlaps, 0.0) ** 2).sum())
            if ratio > 0.0:
                tangential = ratio * pairs.stiffness
                elastic += 0.5 * float(((pairs.shear**2).sum(axis=1) / tangential)[overlaps > 0.0].sum())
        potential = -float(((motion[:, :3] * gravity).sum(axis=1) / inverse_mass).sum())
        sliding, walls, damped = state.work
        return cls(float(kinetic), elastic, potential, sliding, damped, walls, state.applied_work)


def contact_loads(state: GrainState, parameters: StepParameters) -> np.ndarray:
    """(n, 6): force [N] and torque [N m] of contacts on grains, inside numbering; tangential forces as they stand."""
    n, pairs, wall_pairs = len(state), state.pairs, state.wall_pairs
    loads = np.zeros((n, 6))
    parameters = parameters._replace(dt=0.0)
    # The kernels write what pairs hold: they are given copies.
    pairs = pairs._replace(shear=pairs.shear.copy(), touching=pairs.touching.copy())
    wall_pairs = wall_pairs._replace(shear=wall_pairs.shear.copy(), touching=wall_pairs.touching.copy())
    grain_contacts(0, n, parameters, state.grains, pairs, loads)
    wall_contacts(
        0, len(wall_pairs.members), parameters, state.grains, wall_pairs, state.walls, loads, np.zeros((6, 4))
    )
    return loads


def _overlaps(state: GrainState) -> np.ndarray:
    """(p,): overlap of each pair of grains, negative where they are apart [m]."""
    x, r = state.grains.motion[:, :3], state.grains.motion[:, 3]
    i, j = state.pairs.grains.T
    return r[i] + r[j] - np.sqrt(((x[j] - x[i]) ** 2).sum(axis=1))


def _wall_overlaps(state: GrainState) -> np.ndarray:
    """(k,): overlap of each pair of a grain and a wall, negative where they are apart [m]."""
    motion = state.grains.motion
    k, w = state.wall_pairs.members.T
    return motion[k, 3] - WALL_SENSES[w] * (state.walls.places[w] - motion[k, WALL_AXES[w]])


def _across(vectors: np.ndarray, normals: np.ndarray) -> np.ndarray:
    """Tangential forces, known in the plane of a step ago, in the plane of now."""
    return vectors - (vectors * normals).sum(axis=1)[:, None] * normals
