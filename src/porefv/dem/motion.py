"""The explicit step: contact forces, then leapfrog on translations and rotations (C14 §2.1.1), many steps a call.

Velocities live half a step before positions:
v(t + dt/2) = v(t - dt/2) + dt F(t) / m,  x(t + dt) = x(t) + dt v(t + dt/2).

Contacts and grains are dealt out to a fixed number of shares, each with load arrays of its own: results then depend
on the number of shares alone, and one share needs no sums.
"""

from __future__ import annotations

import numpy as np
from numba import njit, prange

from porefv.dem.contacts import grain_contacts, wall_contacts

# Why `advance` came back.
DONE, CROWDED, RUNAWAY = 0, 1, 2


@njit(cache=True, parallel=True, error_model="numpy")
def advance(
    steps, dt, state, inverse_mass, inverse_inertia, applied, gravity, damping,
    pairs, stiffness, shear, touching, pair_shares,
    rims, rim_stiffness, rim_shear, rim_touching, rim_shares,
    ratio, friction, wall_friction,
    places, wall_velocities, targets, top_speeds, gains,
    loads, wall_loads, wall_forces, start, wall_start, slack, fastest, work,
):  # fmt: skip
    """Take at most so many steps; returns how many were taken, and why no more.

    Parameters
    ----------
    state, pairs, stiffness, shear, touching : see `porefv.dem.contacts`
    rims, rim_stiffness, rim_shear, rim_touching : the same for grains (first column) and walls (second)
    pair_shares, rim_shares (s + 1,) : where each share's pairs start
    inverse_mass, inverse_inertia (n,) ; applied (n, 3) : force from outside ; gravity (3,)
    damping : part of the acceleration taken off (added on) where it speeds a component of the motion up (slows it)
    places (6,), wall_velocities (6, 3) : of the walls ; targets (6,) : stress servo-controlled walls press with, else
        NaN ; top_speeds (6,) ; gains : part of the distance to balance, by the stiffness of a wall's contacts, moved
        in a step
    loads (s, n, 6), wall_loads (s, 6, 4) : zero on entry and exit ; wall_forces (6, 3) : last force on each wall
    start (n, 3), wall_start (6,) : places at which pairs were listed ; slack : how far grains may have moved since
    fastest : speed at which the motion counts as runaway
    work (3,) : energies added to: dissipated by sliding, put in by walls, taken by damping
    """
    n = state.shape[0]
    shares = pair_shares.shape[0] - 1
    sliding = np.zeros(shares)
    damped = np.zeros(shares)
    far = np.zeros(shares)
    runaway = np.zeros(shares, np.bool_)
    bounds = np.zeros(shares + 1, np.int64)
    for s in range(shares + 1):
        bounds[s] = n * s // shares
    turning = ratio > 0.0 and (friction > 0.0 or wall_friction.max() > 0.0)
    for step in range(steps):
        for s in prange(shares):
            sliding[s] = grain_contacts(
                pair_shares[s], pair_shares[s + 1], state, pairs, stiffness, ratio, friction, dt, shear, touching,
                loads[s],
            )  # fmt: skip
            sliding[s] += wall_contacts(
                rim_shares[s], rim_shares[s + 1], state, rims, rim_stiffness, ratio, wall_friction, dt,
                places, wall_velocities, rim_shear, rim_touching, loads[s], wall_loads[s],
            )  # fmt: skip
        _move_walls(dt, places, wall_velocities, targets, top_speeds, gains, wall_loads, wall_forces, work)
        for s in prange(shares):
            damped[s], far[s], runaway[s] = _move(
                bounds[s], bounds[s + 1], dt, state, loads, inverse_mass, inverse_inertia, applied, gravity, damping,
                turning, start, fastest,
            )  # fmt: skip
        work[0] += sliding.sum()
        work[2] += damped.sum()
        walls = 0.0
        for w in range(6):
            walls = max(walls, abs(places[w] - wall_start[w]))
        if runaway.any():
            return step + 1, RUNAWAY
        # A pair closes by what both its ends have moved.
        if np.sqrt(far.max()) + max(walls, np.sqrt(far.max())) > slack:
            return step + 1, CROWDED
    return steps, DONE


@njit(cache=True, error_model="numpy", nogil=True)
def _move(
    first, last, dt, state, loads, inverse_mass, inverse_inertia, applied, gravity, damping, turning, start, fastest
):  # fmt: skip
    """Velocities and places of grains first ... last - 1 after a step.

    Returns the energy taken by damping, the largest square of a distance moved since `start`, and whether any grain
    is faster than `fastest`, or nowhere.
    """
    damped = 0.0
    far = 0.0
    runaway = False
    for i in range(first, last):
        square = 0.0
        moved = 0.0
        for a in range(3):
            force = applied[i, a]
            for s in range(loads.shape[0]):
                force += loads[s, i, a]
                loads[s, i, a] = 0.0
            acceleration = force * inverse_mass[i] + gravity[a]
            v = state[i, 4 + a]
            if damping > 0.0:
                drag = -damping * abs(acceleration) * np.sign(v)
                damped -= drag * (v + 0.5 * dt * acceleration) * dt / inverse_mass[i]
                acceleration += drag
            v += dt * acceleration
            state[i, 4 + a] = v
            state[i, a] += dt * v
            square += v * v
            moved += (state[i, a] - start[i, a]) ** 2
        far = max(far, moved)
        if not square <= fastest * fastest:  # so that NaN counts
            runaway = True
        if turning:
            for a in range(3):
                torque = 0.0
                for s in range(loads.shape[0]):
                    torque += loads[s, i, 3 + a]
                    loads[s, i, 3 + a] = 0.0
                acceleration = torque * inverse_inertia[i]
                spin = state[i, 7 + a]
                if damping > 0.0:
                    drag = -damping * abs(acceleration) * np.sign(spin)
                    damped -= drag * (spin + 0.5 * dt * acceleration) * dt / inverse_inertia[i]
                    acceleration += drag
                state[i, 7 + a] = spin + dt * acceleration
    return damped, far, runaway


@njit(cache=True, error_model="numpy", nogil=True)
def _move_walls(dt, places, velocities, targets, top_speeds, gains, wall_loads, wall_forces, work):
    """Walls of given velocity move on; those of given stress towards balance, no faster than their top speed."""
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
        axis = w // 2
        sense = 1.0 if w % 2 == 1 else -1.0
        if not np.isnan(targets[w]):
            b = 2 * ((axis + 1) % 3)
            c = 2 * ((axis + 2) % 3)
            section = (places[b + 1] - places[b]) * (places[c + 1] - places[c])
            excess = sense * wall_forces[w, axis] - targets[w] * section
            outward = top_speeds[w] if excess > 0.0 else -top_speeds[w]
            if stiffness > 0.0:
                outward = min(max(gains * excess / (stiffness * dt), -top_speeds[w]), top_speeds[w])
            velocities[w, axis] = sense * outward
    for w in range(6):
        places[w] += dt * velocities[w, w // 2]
        for a in range(3):  # the wall does the opposite of what is done on it
            work[1] -= wall_forces[w, a] * velocities[w, a] * dt
