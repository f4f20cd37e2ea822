"""The explicit step: contact forces, then leapfrog on translations and rotations (C14 §2.1.1), many steps a call.

Velocities live half a step before positions:
v(t + dt/2) = v(t - dt/2) + dt F(t) / m,  x(t + dt) = x(t) + dt v(t + dt/2).

Contacts and grains are divided among a fixed number of ranges, each with load arrays of its own: results then depend on
the number of ranges alone, and a single range needs no sums.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from porefv.dem.contacts import StepParameters, grain_contacts, wall_contacts
from porefv.dem.grain_state import GrainPairs, Grains, Listing, MovingWalls, WallPairs
from porefv.packing.box import WALL_AXES, WALL_SENSES
from porefv.system.kernels import helper, kernel
from porefv.system.threads import for_rows, thread_count

# Why `advance` came back.
DONE, CROWDED, RUNAWAY = 0, 1, 2
# Which halves of a step to take: both, contact forces alone, or the motion they cause alone.
WHOLE, FORCES, MOTION = 0, 1, 2


class Loads(NamedTuple):
    """Loads of a step. Those of contacts are zero between two steps, and kept apart for each range.

    Attributes
    ----------
    grains : (s, n, 6) array
        Force [N] and torque [N m] of contacts on each grain.
    walls : (s, 6, 4) array
        Force of contacts on each wall [N], and the sum of their stiffnesses [N/m].
    applied : (n, 3) array
        Force on each grain from outside [N].
    thrusts : (6,) array
        Outward force on each wall from outside [N].
    """

    grains: np.ndarray
    walls: np.ndarray
    applied: np.ndarray
    thrusts: np.ndarray


class Found(NamedTuple):
    """What each range finds in a step.

    Attributes
    ----------
    sliding, damped : (s,) arrays
        Energies dissipated by sliding, and taken by damping [J].
    far : (s,) array
        Largest square of a distance that a grain has moved since the pairs were listed [m²].
    runaway : (s,) bool array
        Whether any grain is faster than the fastest allowed, or nowhere.
    """

    sliding: np.ndarray
    damped: np.ndarray
    far: np.ndarray
    runaway: np.ndarray

    @classmethod
    def of(cls, ranges: int) -> Found:
        """Room for so many ranges."""
        return cls(np.zeros(ranges), np.zeros(ranges), np.zeros(ranges), np.zeros(ranges, bool))


class Motion(NamedTuple):
    """All that a step of a DEM changes, or reads.

    Attributes
    ----------
    parameters : StepParameters
    grains : Grains
    pairs : GrainPairs
    wall_pairs : WallPairs
    walls : MovingWalls
    listing : Listing
    loads : Loads
        Of contacts: zero before FORCES and after MOTION.
    found : Found
    work : (3,) array
        Energies added to: dissipated by sliding, put in by walls, taken by damping [J].
    """

    parameters: StepParameters
    grains: Grains
    pairs: GrainPairs
    wall_pairs: WallPairs
    walls: MovingWalls
    listing: Listing
    loads: Loads
    found: Found
    work: np.ndarray


def advance(steps: int, half: int, motion: Motion) -> tuple[int, int]:
    """Take at most so many steps.

    Parameters
    ----------
    steps : int
    half : int
        WHOLE, or FORCES and then MOTION to see the loads before they move anything, of one step.
    motion : Motion

    Returns
    -------
    taken : int
    reason : int
        DONE, CROWDED where pairs must be listed anew, or RUNAWAY.
    """
    ranges = len(motion.found.far)
    if ranges == 1 or thread_count() == 1:
        return _advance(steps, half, motion)
    for step in range(steps):
        if half != MOTION:
            for_rows(_find_loads, ranges, motion, least=1)
            _end_loads(motion)
        if half == FORCES:
            return 0, DONE
        _move_walls(motion)
        for_rows(_move, ranges, motion, least=1)
        reason = _look(motion)
        if reason != DONE:
            return step + 1, reason
    return steps, DONE


@kernel(error_model="numpy")
def _advance(steps, half, motion):
    """The same by one thread."""
    ranges = motion.found.far.shape[0]
    for step in range(steps):
        if half != MOTION:
            _find_loads(0, ranges, motion)
            _end_loads(motion)
        if half == FORCES:
            return 0, DONE
        _move_walls(motion)
        _move(0, ranges, motion)
        reason = _look(motion)
        if reason != DONE:
            return step + 1, reason
    return steps, DONE


@kernel(error_model="numpy")
def _find_loads(first, last, motion):
    """Loads of the contacts in ranges first ... last - 1."""
    parameters, grains, pairs, wall_pairs, walls, _, loads, found, _ = motion
    for s in range(first, last):
        found.sliding[s] = grain_contacts(
            pairs.ranges[s], pairs.ranges[s + 1], parameters, grains, pairs, loads.grains[s]
        )
        found.sliding[s] += wall_contacts(
            wall_pairs.ranges[s], wall_pairs.ranges[s + 1], parameters, grains, wall_pairs, walls,
            loads.grains[s], loads.walls[s],
        )  # fmt: skip


@kernel(error_model="numpy")
def _end_loads(motion):
    """Add up what the ranges have found, and weigh the walls."""
    for s in range(motion.found.sliding.shape[0]):
        motion.work[0] += motion.found.sliding[s]
    _weigh_walls(motion.parameters, motion.walls, motion.loads)


@kernel(error_model="numpy")
def _move(first, last, motion):
    """Velocities and places of the grains in ranges first ... last - 1 after a step."""
    found = motion.found
    ranges, n = found.far.shape[0], motion.grains.motion.shape[0]
    for s in range(first, last):
        found.damped[s], found.far[s], found.runaway[s] = _move_grains(
            n * s // ranges, n * (s + 1) // ranges, motion.parameters, motion.grains, motion.loads,
            motion.listing.centres,
        )  # fmt: skip


@kernel
def _look(motion):
    """Add up what the ranges have found; whether to go on."""
    damped, far, runaway = motion.found.damped, motion.found.far, motion.found.runaway
    walls, listing, work = motion.walls, motion.listing, motion.work
    farthest = 0.0
    lost = False
    for s in range(far.shape[0]):
        work[2] += damped[s]
        farthest = max(farthest, far[s])
        lost = lost or runaway[s]
    if lost:
        return RUNAWAY
    farthest = np.sqrt(farthest)
    moved = 0.0
    for w in range(6):
        moved = max(moved, abs(walls.places[w] - listing.walls[w]))
    # A pair closes by what both its ends have moved.
    return CROWDED if farthest + max(moved, farthest) > listing.slack else DONE


@helper(error_model="numpy")
def _move_grains(first, last, parameters, grains, loads, start):
    """Velocities and places of grains first ... last - 1 after a step; takes their loads.

    Returns the energy taken by damping, the largest square of a distance moved since `start` (n, 3), and whether any
    grain is faster than the fastest allowed, or nowhere.
    """
    dt, damping, fastest = parameters.dt, parameters.damping, parameters.fastest
    motion, inverse_mass, inverse_inertia = grains
    contacts, applied = loads.grains, loads.applied
    damped = 0.0
    far = 0.0
    runaway = False
    gx, gy, gz = parameters.gravity[0], parameters.gravity[1], parameters.gravity[2]
    for i in range(first, last):
        fx, fy, fz = applied[i, 0], applied[i, 1], applied[i, 2]
        tx = ty = tz = 0.0
        for s in range(contacts.shape[0]):
            fx += contacts[s, i, 0]
            fy += contacts[s, i, 1]
            fz += contacts[s, i, 2]
            tx += contacts[s, i, 3]
            ty += contacts[s, i, 4]
            tz += contacts[s, i, 5]
            for a in range(6):
                contacts[s, i, a] = 0.0
        ax = inverse_mass[i] * fx + gx
        ay = inverse_mass[i] * fy + gy
        az = inverse_mass[i] * fz + gz
        bx = inverse_inertia[i] * tx
        by = inverse_inertia[i] * ty
        bz = inverse_inertia[i] * tz
        if damping > 0.0:
            ax, lost_x = _damp(ax, motion[i, 4], damping, dt)
            ay, lost_y = _damp(ay, motion[i, 5], damping, dt)
            az, lost_z = _damp(az, motion[i, 6], damping, dt)
            damped += (lost_x + lost_y + lost_z) / inverse_mass[i]
            bx, lost_x = _damp(bx, motion[i, 7], damping, dt)
            by, lost_y = _damp(by, motion[i, 8], damping, dt)
            bz, lost_z = _damp(bz, motion[i, 9], damping, dt)
            damped += (lost_x + lost_y + lost_z) / inverse_inertia[i]
        vx = motion[i, 4] + dt * ax
        vy = motion[i, 5] + dt * ay
        vz = motion[i, 6] + dt * az
        motion[i, 4], motion[i, 5], motion[i, 6] = vx, vy, vz
        motion[i, 7] += dt * bx
        motion[i, 8] += dt * by
        motion[i, 9] += dt * bz
        x = motion[i, 0] + dt * vx
        y = motion[i, 1] + dt * vy
        z = motion[i, 2] + dt * vz
        motion[i, 0], motion[i, 1], motion[i, 2] = x, y, z
        x -= start[i, 0]
        y -= start[i, 1]
        z -= start[i, 2]
        far = max(far, x * x + y * y + z * z)
        if not vx * vx + vy * vy + vz * vz <= fastest * fastest:  # so that NaN counts
            runaway = True
    return damped, far, runaway


@helper
def _damp(acceleration, velocity, damping, dt):
    """The acceleration less its damped part, against the velocity, and the energy per mass that this takes."""
    drag = -damping * abs(acceleration) * np.sign(velocity)
    return acceleration + drag, -drag * (velocity + 0.5 * dt * (acceleration + drag)) * dt


@helper(error_model="numpy")
def _weigh_walls(parameters, walls, loads):
    """Forces of the grains on the walls, and how far pressing walls yield, no faster than their top speed."""
    dt, gain = parameters.dt, parameters.gain
    forces, yields, contacts = walls.forces, walls.yields, loads.walls
    for w in range(6):
        stiffness = 0.0
        for a in range(3):
            forces[w, a] = 0.0
        for s in range(contacts.shape[0]):
            for a in range(3):
                forces[w, a] += contacts[s, w, a]
                contacts[s, w, a] = 0.0
            stiffness += contacts[s, w, 3]
            contacts[s, w, 3] = 0.0
        yields[w] = 0.0
        excess = abs(_excess(w, walls))
        if excess > 0.0:
            yields[w] = walls.top_speeds[w] / excess
            if stiffness > 0.0:
                yields[w] = min(gain / (stiffness * dt), yields[w])
        elif excess == 0.0 and stiffness > 0.0:  # a wall without a target has NaN
            yields[w] = gain / (stiffness * dt)


@helper
def _excess(w, walls):
    """Outward force on wall w beyond the stress it presses with [N]; NaN where that is not given."""
    places = walls.places
    axis = WALL_AXES[w]
    b = 2 * ((axis + 1) % 3)
    c = 2 * ((axis + 2) % 3)
    section = (places[b + 1] - places[b]) * (places[c + 1] - places[c])
    return WALL_SENSES[w] * walls.forces[w, axis] - walls.targets[w] * section


@kernel(error_model="numpy")
def _move_walls(motion):
    """Walls of given velocity move on; those of given stress towards balance."""
    parameters, walls, loads, work = motion.parameters, motion.walls, motion.loads, motion.work
    dt, velocities = parameters.dt, walls.velocities
    for w in range(6):
        if not np.isnan(walls.targets[w]):
            outward = walls.yields[w] * (_excess(w, walls) + loads.thrusts[w])
            velocities[w, WALL_AXES[w]] = WALL_SENSES[w] * outward
    for w in range(6):
        walls.places[w] += dt * velocities[w, WALL_AXES[w]]
        for a in range(3):  # the wall does the opposite of what is done on it
            work[1] -= walls.forces[w, a] * velocities[w, a] * dt


@kernel
def free_motion(parameters, grains, walls, loads):
    """What grains and walls would do after a step under the loads there are, without moving them.

    Parameters
    ----------
    parameters : StepParameters
    grains : Grains
    walls : MovingWalls
    loads : Loads
        Between FORCES and MOTION.

    Returns
    -------
    velocities : (n, 3) array
        Of grains [m/s].
    speeds : (6,) array
        Of walls, along their outward normals [m/s].
    mobilities : (n,) array
        dt / m of grains [m/(s N)].
    """
    n, dt, gravity = grains.motion.shape[0], parameters.dt, parameters.gravity
    velocities = np.empty((n, 3))
    mobilities = np.empty(n)
    for i in range(n):
        mobilities[i] = dt * grains.inverse_mass[i]
        for a in range(3):
            force = loads.applied[i, a]
            for s in range(loads.grains.shape[0]):
                force += loads.grains[s, i, a]
            velocities[i, a] = grains.motion[i, 4 + a] + mobilities[i] * force + dt * gravity[a]
    speeds = np.empty(6)
    for w in range(6):
        if np.isnan(walls.targets[w]):
            speeds[w] = walls.velocities[w, WALL_AXES[w]] * WALL_SENSES[w]
        else:
            speeds[w] = walls.yields[w] * _excess(w, walls)
    return velocities, speeds, mobilities
