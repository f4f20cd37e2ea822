"""Contact forces between grains and with walls: linear, elastic and frictional (C14 §2.1, eq. 9-12).

Normal force k_n u_n where two spheres overlap by u_n, none where they do not; tangential force by increments of
k_s times the slip, at most tan φ times the normal force. The tangential force is kept per pair while the pair
touches, turned with the contact, and forgotten when it opens.

Arrays of the kernels
    state (n, 10)       x y z r, vx vy vz, wx wy wz: centre, radius, velocity, spin of each grain
    loads (n, 6)        force and torque on each grain, added to
    stiffness (m,)      k_n of each pair of grains i < j that may touch
    shear (m, 3)        tangential force on i, zero unless touching
    touching (m,)       whether the pair touches
"""

from __future__ import annotations

import numpy as np
from numba import njit

# Fused multiply-adds: quicker, and as deterministic on one machine.
_FAST = {"contract", "nsz", "arcp"}


@njit(cache=True, error_model="numpy", nogil=True, fastmath=_FAST)
def grain_contacts(first, last, state, starts, others, stiffness, ratio, friction, dt, shear, touching, loads):
    """Forces of the pairs of grains first ... last - 1 with later ones; returns the energy sliding dissipates.

    Pairs of grain i are starts[i] ... starts[i + 1], with the grains `others`. `ratio` is k_s / k_n, `friction` tan φ;
    where either is zero nothing tangential is computed.
    """
    dissipated = 0.0
    frictional = ratio > 0.0 and friction > 0.0
    for i in range(first, last):
        xi, yi, zi, ri = state[i, 0], state[i, 1], state[i, 2], state[i, 3]
        force_x = force_y = force_z = 0.0
        torque_x = torque_y = torque_z = 0.0
        for c in range(starts[i], starts[i + 1]):
            j = others[c]
            nx = state[j, 0] - xi
            ny = state[j, 1] - yi
            nz = state[j, 2] - zi
            reach = ri + state[j, 3]
            square = nx * nx + ny * ny + nz * nz
            if square >= reach * reach:
                if touching[c]:
                    touching[c] = False
                    shear[c, 0] = shear[c, 1] = shear[c, 2] = 0.0
                continue
            touching[c] = True
            distance = np.sqrt(square)
            inverse = 1.0 / distance
            nx *= inverse
            ny *= inverse
            nz *= inverse
            kn = stiffness[c]
            normal = kn * (reach - distance)
            fx = -normal * nx
            fy = -normal * ny
            fz = -normal * nz
            if frictional:
                # Arms from the centres to the middle of the overlap: they add up to the distance.
                arm_i = ri - 0.5 * (reach - distance)
                arm_j = distance - arm_i
                slid, tx, ty, tz = _tangential(
                    nx, ny, nz, normal, kn * ratio, friction, dt,
                    state[j, 4] - state[i, 4], state[j, 5] - state[i, 5], state[j, 6] - state[i, 6],
                    arm_i * state[i, 7] + arm_j * state[j, 7],
                    arm_i * state[i, 8] + arm_j * state[j, 8],
                    arm_i * state[i, 9] + arm_j * state[j, 9],
                    0.5 * (state[i, 7] + state[j, 7]),
                    0.5 * (state[i, 8] + state[j, 8]),
                    0.5 * (state[i, 9] + state[j, 9]),
                    shear[c, 0], shear[c, 1], shear[c, 2],
                )  # fmt: skip
                dissipated += slid
                shear[c, 0] = tx
                shear[c, 1] = ty
                shear[c, 2] = tz
                fx += tx
                fy += ty
                fz += tz
                qx = ny * tz - nz * ty
                qy = nz * tx - nx * tz
                qz = nx * ty - ny * tx
                torque_x += arm_i * qx
                torque_y += arm_i * qy
                torque_z += arm_i * qz
                loads[j, 3] += arm_j * qx
                loads[j, 4] += arm_j * qy
                loads[j, 5] += arm_j * qz
            force_x += fx
            force_y += fy
            force_z += fz
            loads[j, 0] -= fx
            loads[j, 1] -= fy
            loads[j, 2] -= fz
        loads[i, 0] += force_x
        loads[i, 1] += force_y
        loads[i, 2] += force_z
        loads[i, 3] += torque_x
        loads[i, 4] += torque_y
        loads[i, 5] += torque_z
    return dissipated


@njit(cache=True, error_model="numpy", nogil=True, fastmath=_FAST)
def wall_contacts(
    first, last, state, rims, stiffness, ratio, friction, dt, places, velocities, shear, touching, loads, wall_loads
):  # fmt: skip
    """Forces between grains and walls, rims (m, 2): grain and wall; a wall counts as a sphere of the grain's size.

    Wall w is normal to axis w // 2, at places[w] along it, and moves with velocities[w]; wall_loads (6, 4), added to,
    holds the force on it and the sum of the stiffnesses of its contacts. Returns the energy that sliding dissipates.
    """
    dissipated = 0.0
    for c in range(first, last):
        i = rims[c, 0]
        w = rims[c, 1]
        axis = w // 2
        sense = 1.0 if w % 2 == 1 else -1.0
        r = state[i, 3]
        gap = sense * (places[w] - state[i, axis])
        if gap >= r:
            if touching[c]:
                touching[c] = False
                shear[c, 0] = shear[c, 1] = shear[c, 2] = 0.0
            continue
        touching[c] = True
        kn = stiffness[c]
        normal = kn * (r - gap)
        nx = sense if axis == 0 else 0.0
        ny = sense if axis == 1 else 0.0
        nz = sense if axis == 2 else 0.0
        fx = -normal * nx
        fy = -normal * ny
        fz = -normal * nz
        if ratio > 0.0 and friction[w] > 0.0:
            slide, tx, ty, tz = _tangential(
                nx, ny, nz, normal, kn * ratio, friction[w], dt,
                velocities[w, 0] - state[i, 4], velocities[w, 1] - state[i, 5], velocities[w, 2] - state[i, 6],
                gap * state[i, 7], gap * state[i, 8], gap * state[i, 9],
                state[i, 7], state[i, 8], state[i, 9],
                shear[c, 0], shear[c, 1], shear[c, 2],
            )  # fmt: skip
            dissipated += slide
            shear[c, 0] = tx
            shear[c, 1] = ty
            shear[c, 2] = tz
            fx += tx
            fy += ty
            fz += tz
            loads[i, 3] += gap * (ny * tz - nz * ty)
            loads[i, 4] += gap * (nz * tx - nx * tz)
            loads[i, 5] += gap * (nx * ty - ny * tx)
        loads[i, 0] += fx
        loads[i, 1] += fy
        loads[i, 2] += fz
        wall_loads[w, 0] -= fx
        wall_loads[w, 1] -= fy
        wall_loads[w, 2] -= fz
        wall_loads[w, 3] += kn
    return dissipated


@njit(cache=True, error_model="numpy", nogil=True, fastmath=_FAST)
def _tangential(nx, ny, nz, normal, ks, friction, dt, ux, uy, uz, ax, ay, az, wx, wy, wz, sx, sy, sz):
    """Energy dissipated by sliding, and the tangential force on i after this step.

    n leads from i to j, u is the velocity of j's centre relative to i's, a the sum of arm times spin, w the spin with
    which the pair turns about n, s the tangential force before the step.
    """
    # Turned with the pair, about n and into the new plane, and on by the slip of j's surface on i's; what is along n
    # is taken out of all at once. Small turns keep the length to rounding, larger ones need a root to.
    twist = dt * (wx * nx + wy * ny + wz * nz)
    size = sx * sx + sy * sy + sz * sz
    off = sx * nx + sy * ny + sz * nz
    if off * off > 1e-12 * size or twist * twist > 1e-12:
        scale = np.sqrt(size / max((size - off * off) * (1.0 + twist * twist), 1e-6 * size)) if size > 0.0 else 0.0
        sx *= scale
        sy *= scale
        sz *= scale
    step = ks * dt
    tx = sx + twist * (ny * sz - nz * sy) + step * (ux - (ay * nz - az * ny))
    ty = sy + twist * (nz * sx - nx * sz) + step * (uy - (az * nx - ax * nz))
    tz = sz + twist * (nx * sy - ny * sx) + step * (uz - (ax * ny - ay * nx))
    off = tx * nx + ty * ny + tz * nz
    tx -= off * nx
    ty -= off * ny
    tz -= off * nz
    most = friction * normal
    size = tx * tx + ty * ty + tz * tz
    if size <= most * most:
        return 0.0, tx, ty, tz
    size = np.sqrt(size)
    scale = most / size
    return most * (size - most) / ks, tx * scale, ty * scale, tz * scale
