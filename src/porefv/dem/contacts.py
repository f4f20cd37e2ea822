"""Contact forces between grains and with walls: linear, elastic and frictional (C14 §2.1, eq. 9-12).

Normal force k_n u_n where two spheres overlap by u_n, none where they do not; tangential force by increments of
k_s times the slip, at most tan φ times the normal force. The tangential force is kept per pair while the pair
touches, turned with the contact, and forgotten when it opens.

Arrays of the kernels
    state (n, 10)       x y z r, vx vy vz, wx wy wz: centre, radius, velocity, spin of each grain
    loads (n, 6)        force and torque on each grain, added to
    pairs (m, 2)        grains i < j that may touch
    stiffness (m,)      k_n of each pair
    shear (m, 3)        tangential force on i, zero unless touching
    touching (m,)       whether the pair touches
"""

from __future__ import annotations

import numpy as np
from numba import njit


@njit(cache=True, error_model="numpy", nogil=True)
def grain_contacts(first, last, state, pairs, stiffness, ratio, friction, dt, shear, touching, loads):
    """Forces of the pairs first ... last - 1; returns the energy that sliding dissipates in this step.

    `ratio` is k_s / k_n, `friction` tan φ; where either is zero nothing tangential is computed.
    """
    dissipated = 0.0
    frictional = ratio > 0.0 and friction > 0.0
    for c in range(first, last):
        i = pairs[c, 0]
        j = pairs[c, 1]
        nx = state[j, 0] - state[i, 0]
        ny = state[j, 1] - state[i, 1]
        nz = state[j, 2] - state[i, 2]
        reach = state[i, 3] + state[j, 3]
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
            arm_i = state[i, 3] - 0.5 * (reach - distance)
            arm_j = distance - arm_i
            slide, tx, ty, tz = _tangential(
                nx, ny, nz, normal, kn * ratio, friction, dt,
                state[j, 4] - state[i, 4], state[j, 5] - state[i, 5], state[j, 6] - state[i, 6],
                arm_i * state[i, 7] + arm_j * state[j, 7],
                arm_i * state[i, 8] + arm_j * state[j, 8],
                arm_i * state[i, 9] + arm_j * state[j, 9],
                0.5 * dt * ((state[i, 7] + state[j, 7]) * nx + (state[i, 8] + state[j, 8]) * ny
                            + (state[i, 9] + state[j, 9]) * nz),
                shear[c, 0], shear[c, 1], shear[c, 2],
            )  # fmt: skip
            dissipated += slide
            shear[c, 0] = tx
            shear[c, 1] = ty
            shear[c, 2] = tz
            fx += tx
            fy += ty
            fz += tz
            qx = ny * tz - nz * ty
            qy = nz * tx - nx * tz
            qz = nx * ty - ny * tx
            loads[i, 3] += arm_i * qx
            loads[i, 4] += arm_i * qy
            loads[i, 5] += arm_i * qz
            loads[j, 3] += arm_j * qx
            loads[j, 4] += arm_j * qy
            loads[j, 5] += arm_j * qz
        loads[i, 0] += fx
        loads[i, 1] += fy
        loads[i, 2] += fz
        loads[j, 0] -= fx
        loads[j, 1] -= fy
        loads[j, 2] -= fz
    return dissipated


@njit(cache=True, error_model="numpy", nogil=True)
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
                dt * (state[i, 7] * nx + state[i, 8] * ny + state[i, 9] * nz),
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


@njit(cache=True, error_model="numpy", nogil=True)
def _tangential(nx, ny, nz, normal, ks, friction, dt, ux, uy, uz, ax, ay, az, twist, sx, sy, sz):
    """The tangential force on i after this step, and the energy dissipated by sliding.

    n leads from i to j, u is the velocity of j's centre relative to i's, a the sum of arm times spin, `twist` the
    angle the pair turns about n in this step, s the tangential force before it.
    """
    # Turn with the contact: about n by the twist, and into the new plane without change of length.
    size = sx * sx + sy * sy + sz * sz
    if size > 0.0:
        tx = sx + twist * (ny * sz - nz * sy)
        ty = sy + twist * (nz * sx - nx * sz)
        tz = sz + twist * (nx * sy - ny * sx)
        off = tx * nx + ty * ny + tz * nz
        sx = tx - off * nx
        sy = ty - off * ny
        sz = tz - off * nz
        turned = sx * sx + sy * sy + sz * sz
        if abs(turned - size) > 1e-12 * size and turned > 0.0:  # small turns keep it to rounding: no root needed
            scale = np.sqrt(size / turned)
            sx *= scale
            sy *= scale
            sz *= scale
    # Velocity of j's surface relative to i's at the contact.
    ux -= ay * nz - az * ny
    uy -= az * nx - ax * nz
    uz -= ax * ny - ay * nx
    along = ux * nx + uy * ny + uz * nz
    step = ks * dt
    sx += step * (ux - along * nx)
    sy += step * (uy - along * ny)
    sz += step * (uz - along * nz)
    most = friction * normal
    size = sx * sx + sy * sy + sz * sz
    if size <= most * most:
        return 0.0, sx, sy, sz
    size = np.sqrt(size)
    scale = most / size
    return most * (size - most) / ks, sx * scale, sy * scale, sz * scale
