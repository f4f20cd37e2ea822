"""The explicit step: contact forces, then leapfrog on translations and rotations (C14 §2.1.1), many steps a call.

Velocities live half a step before positions:
v(t + dt/2) = v(t - dt/2) + dt F(t) / m,  x(t + dt) = x(t) + dt v(t + dt/2).

Contacts and grains are divided among a fixed number of ranges, each with load arrays of its own: results then depend on
the number of ranges alone, and a single range needs no sums.
"""

from __future__ import annotations

import numpy as np

from porefv.dem.contacts import grain_contacts, wall_contacts
from porefv.packing.box import WALL_AXES, WALL_SENSES
from porefv.system.kernels import njit, prange

# Why `advance` came back.
DONE, CROWDED, RUNAWAY = 0, 1, 2
# Which halves of a step to take: both, contact forces alone, or the motion they cause alone.
WHOLE, FORCES, MOTION = 0, 1, 2


@njit(cache=True, parallel=True, error_model="numpy")
def advance(
    steps, half, dt, state, inverse_mass, inverse_inertia, applied, gravity, damping,
    starts, others, stiffness, shear, touching, grain_ranges,
    wall_pairs, wall_pair_stiffness, wall_pair_shear, wall_pair_touching, wall_pair_ranges,
    ratio, friction, wall_friction,
    places, wall_velocities, targets, top_speeds, gains, wall_yields, wall_thrusts,
    loads, wall_loads, wall_forces, start, wall_start, slack, fastest, work,
):  # fmt: skip
    """Take at most so many steps; returns how many were taken, and why no more.

    Parameters
    ----------
    half : WHOLE, or FORCES and then MOTION to see the loads before they move anything, of one step
    state, starts, others, stiffness, shear, touching : see `porefv.dem.contacts`
    wall_pairs, wall_pair_stiffness, wall_pair_shear, wall_pair_touching : the same for pairs of a grain (first column)
        and a wall (second)
    grain_ranges, wall_pair_ranges (s + 1,) : where the grains of each range, with their pairs, and its wall pairs start
    inverse_mass, inverse_inertia (n,) ; applied (n, 3) : force from outside ; gravity (3,)
    damping : part of the acceleration taken off (added on) where it speeds a component of the motion up (slows it)
    places (6,), wall_velocities (6, 3) : of the walls ; targets (6,) : stress servo-controlled walls press with, else
        NaN ; top_speeds (6,) ; gains : part of the distance to balance, by the stiffness of a wall's contacts, moved
        in a step
    wall_yields (6,) : what a pressing wall moves outward in a step for each unit of force; set by FORCES
    wall_thrusts (6,) : outward force on each wall from outside
    loads (s, n, 6), wall_loads (s, 6, 4) : zero before FORCES and after MOTION ; wall_forces (6, 3) : force of the
        grains on each wall
    start (n, 3), wall_start (6,) : places at which pairs were listed ; slack : how far grains may have moved since
    fastest : speed at which the motion counts as runaway
    work (3,) : energies added to: dissipated by sliding, put in by walls, taken by damping
    """
    n = state.shape[0]
    ranges = wall_pair_ranges.shape[0] - 1
    sliding = np.zeros(ranges)
    damped = np.zeros(ranges)
    far = np.zeros(ranges)
    runaway = np.zeros(ranges, np.bool_)
    bounds = np.zeros(ranges + 1, np.int64)
    for s in range(ranges + 1):
        bounds[s] = n * s // ranges
    for step in range(steps):
        if half != MOTION:
            for s in prange(ranges):
                sliding[s] = grain_contacts(
                    grain_ranges[s], grain_ranges[s + 1], state, starts, others, stiffness, ratio, friction,
                    dt, shear, touching, loads[s],
                )  # fmt: skip
                sliding[s] += wall_contacts(
                    wall_pair_ranges[s], wall_pair_ranges[s + 1], state, wall_pairs, wall_pair_stiffness, ratio,
                    wall_friction, dt, places, wall_velocities, wall_pair_shear, wall_pair_touching, loads[s],
                    wall_loads[s],
                )  # fmt: skip
            work[0] += sliding.sum()
            _weigh_walls(dt, places, targets, top_speeds, gains, wall_loads, wall_forces, wall_yields)
        if half == FORCES:
            return 0, DONE
        _move_walls(dt, places, wall_velocities, targets, wall_yields, wall_thrusts, wall_forces, work)
        for s in prange(ranges):
            damped[s], far[s], runaway[s] = _move(
                bounds[s], bounds[s + 1], dt, state, loads, inverse_mass, inverse_inertia, applied, gravity, damping,
                start, fastest,
            )  # fmt: skip
        reason = _look(damped, far, runaway, places, wall_start, slack, work)
        if reason != DONE:
            return step + 1, reason
    return steps, DONE


@njit(cache=True, nogil=True)
def _look(damped, far, runaway, places, wall_start, slack, work):
    """Add up what the ranges have found; whether to go on."""
    farthest = 0.0
    lost = False
    for s in range(far.shape[0]):
        work[2] += damped[s]
        farthest = max(farthest, far[s])
        lost = lost or runaway[s]
    if lost:
        return RUNAWAY
    farthest = np.sqrt(farthest)
    walls = 0.0
    for w in range(6):
        walls = max(walls, abs(places[w] - wall_start[w]))
    # A pair closes by what both its ends have moved.
    return CROWDED if farthest + max(walls, farthest) > slack else DONE


@njit(cache=True, error_model="numpy", nogil=True)
def _move(
    first, last, dt, state, loads, inverse_mass, inverse_inertia, applied, gravity, damping, start, fastest
):  # fmt: skip
    """Velocities and places of grains first ... last - 1 after a step; takes their loads.

    Returns the energy taken by damping, the largest square of a distance moved since `start`, and whether any grain
    is faster than `fastest`, or nowhere.
    """
    damped = 0.0
    far = 0.0
    runaway = False
    gx, gy, gz = gravity[0], gravity[1], gravity[2]
    for i in range(first, last):
        fx, fy, fz = applied[i, 0], applied[i, 1], applied[i, 2]
        tx = ty = tz = 0.0
        for s in range(loads.shape[0]):
            fx += loads[s, i, 0]
            fy += loads[s, i, 1]
            fz += loads[s, i, 2]
            tx += loads[s, i, 3]
            ty += loads[s, i, 4]
            tz += loads[s, i, 5]
            for a in range(6):
                loads[s, i, a] = 0.0
        ax = inverse_mass[i] * fx + gx
        ay = inverse_mass[i] * fy + gy
        az = inverse_mass[i] * fz + gz
        bx = inverse_inertia[i] * tx
        by = inverse_inertia[i] * ty
        bz = inverse_inertia[i] * tz
        if damping > 0.0:
            ax, lost_x = _damp(ax, state[i, 4], damping, dt)
            ay, lost_y = _damp(ay, state[i, 5], damping, dt)
            az, lost_z = _damp(az, state[i, 6], damping, dt)
            damped += (lost_x + lost_y + lost_z) / inverse_mass[i]
            bx, lost_x = _damp(bx, state[i, 7], damping, dt)
            by, lost_y = _damp(by, state[i, 8], damping, dt)
            bz, lost_z = _damp(bz, state[i, 9], damping, dt)
            damped += (lost_x + lost_y + lost_z) / inverse_inertia[i]
        vx = state[i, 4] + dt * ax
        vy = state[i, 5] + dt * ay
        vz = state[i, 6] + dt * az
        state[i, 4], state[i, 5], state[i, 6] = vx, vy, vz
        state[i, 7] += dt * bx
        state[i, 8] += dt * by
        state[i, 9] += dt * bz
        x = state[i, 0] + dt * vx
        y = state[i, 1] + dt * vy
        z = state[i, 2] + dt * vz
        state[i, 0], state[i, 1], state[i, 2] = x, y, z
        x -= start[i, 0]
        y -= start[i, 1]
        z -= start[i, 2]
        far = max(far, x * x + y * y + z * z)
        if not vx * vx + vy * vy + vz * vz <= fastest * fastest:  # so that NaN counts
            runaway = True
    return damped, far, runaway


@njit(cache=True, nogil=True)
def _damp(acceleration, velocity, damping, dt):
    """The acceleration less its damped part, against the velocity, and the energy per mass that this takes."""
    drag = -damping * abs(acceleration) * np.sign(velocity)
    return acceleration + drag, -drag * (velocity + 0.5 * dt * (acceleration + drag)) * dt


@njit(cache=True, error_model="numpy", nogil=True)
def _weigh_walls(dt, places, targets, top_speeds, gains, wall_loads, wall_forces, yields):
    """Forces of the grains on the walls, and how far pressing walls yield, no faster than their top speed."""
    for w in range(6):
        stiffness = 0.0
        for a in range(3):
            wall_forces[w, a] = 0.0
        for s in range(wall_loads.shape[0]):
            for a in range(3):
                wall_forces[w, a] += wall_loads[s, w, a]
                wall_loads[s, w, a] = 0.0
            stiffness += wall_loads[s, w, 3]
            wall_loads[s, w, 3] = 0.0
        yields[w] = 0.0
        excess = abs(wall_excess(w, places, targets, wall_forces))
        if excess > 0.0:
            yields[w] = top_speeds[w] / excess
            if stiffness > 0.0:
                yields[w] = min(gains / (stiffness * dt), yields[w])
        elif excess == 0.0 and stiffness > 0.0:  # a wall without a target has NaN
            yields[w] = gains / (stiffness * dt)


@njit(cache=True, nogil=True)
def wall_excess(w, places, targets, wall_forces):
    """Outward force on wall w beyond the stress it presses with; NaN where that is not given."""
    axis = WALL_AXES[w]
    b = 2 * ((axis + 1) % 3)
    c = 2 * ((axis + 2) % 3)
    section = (places[b + 1] - places[b]) * (places[c + 1] - places[c])
    return WALL_SENSES[w] * wall_forces[w, axis] - targets[w] * section


@njit(cache=True, error_model="numpy", nogil=True)
def _move_walls(dt, places, velocities, targets, yields, thrusts, wall_forces, work):
    """Walls of given velocity move on; those of given stress towards balance."""
    for w in range(6):
        if not np.isnan(targets[w]):
            outward = yields[w] * (wall_excess(w, places, targets, wall_forces) + thrusts[w])
            velocities[w, WALL_AXES[w]] = WALL_SENSES[w] * outward
    for w in range(6):
        places[w] += dt * velocities[w, WALL_AXES[w]]
        for a in range(3):  # the wall does the opposite of what is done on it
            work[1] -= wall_forces[w, a] * velocities[w, a] * dt
