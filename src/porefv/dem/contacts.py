"""Contact forces between grains and with walls: linear, elastic and frictional (C14 §2.1, eq. 9-12).

Normal force k_n u_n where two spheres overlap by u_n, none where they do not; tangential force by increments of
k_s times the slip, at most tan φ times the normal force. The tangential force is kept per pair while the pair
touches, turned with the contact, and forgotten when it opens. A wall stands for the mirror image of the grain it meets.

The kernels take the groups of arrays of `porefv.dem.grain_state`, and change what pairs hold: whether they touch, and
their tangential force. Frictional contacts are worked out a block at a time, from columns of numbers that the processor
takes four by four.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from porefv.packing.box import WALL_AXES, WALL_SENSES
from porefv.system.kernels import helper, kernel

# Contacts in a block, and where each quantity's column starts in it: given ...
_SIZE = 64
_BRANCH = 0 * _SIZE  # from i to j, three columns
_RADIUS = 3 * _SIZE  # of i
_REACH = 4 * _SIZE  # r_i + r_j
_MOTION = 5 * _SIZE  # velocity of j less that of i, three columns
_SPIN_I = 8 * _SIZE  # three columns
_SPIN_J = 11 * _SIZE  # three columns
_SHEAR = 14 * _SIZE  # tangential force on i, three columns, before and after
_NORMAL_STIFFNESS = 17 * _SIZE
_SHEAR_STIFFNESS = 18 * _SIZE
_FRICTION = 19 * _SIZE  # tan φ
# ... and found.
_FORCE = 20 * _SIZE  # on i, three columns
_TORQUE_I = 23 * _SIZE  # three columns
_TORQUE_J = 26 * _SIZE  # three columns
_SLID = 29 * _SIZE  # energy dissipated
_COLUMNS = 30 * _SIZE

# Contracted multiply-adds and no care for infinities: quicker, and as repeatable on one machine.
_FAST = {"contract", "nsz", "arcp", "nnan", "ninf"}
_TINY = 1e-300


class StepParameters(NamedTuple):
    """What a step depends on besides the state of grains and walls.

    Attributes
    ----------
    dt : float
        [s]
    ratio : float
        k_s / k_n; without it nothing tangential is computed.
    friction : float
        tan φ between grains; likewise.
    gravity : (3,) array
        [m/s²]
    damping : float
        Part of each acceleration that is taken off where it speeds a component of the motion up, and added where it
        slows it.
    gain : float
        Part of the way to balance, by the stiffness of its contacts, that a pressing wall moves in a step.
    fastest : float
        Speed at which the motion counts as runaway [m/s].
    """

    dt: float
    ratio: float
    friction: float
    gravity: np.ndarray
    damping: float
    gain: float
    fastest: float


@kernel(error_model="numpy")
def grain_contacts(first, last, parameters, grains, pairs, loads):
    """Forces of the pairs of grains first ... last - 1 with later ones.

    Parameters
    ----------
    first, last : int
    parameters : StepParameters
    grains : Grains
    pairs : GrainPairs
        Shear and touching are changed.
    loads : (n, 6) array
        Force [N] and torque [N m] on each grain, added to.

    Returns
    -------
    float
        Energy that sliding dissipates [J].
    """
    ratio, friction, dt = parameters.ratio, parameters.friction, parameters.dt
    motion, starts, others = grains.motion, pairs.starts, pairs.others
    stiffness, shear, touching = pairs.stiffness, pairs.shear, pairs.touching
    frictional = ratio > 0.0 and friction > 0.0
    block = np.empty(_COLUMNS)
    for k in range(_SIZE):
        block[_FRICTION + k] = friction
    pair = np.empty(_SIZE, np.int64)
    grain = np.empty(_SIZE, np.int64)
    dissipated = 0.0
    m = 0
    for i in range(first, last):
        x, y, z, r = motion[i, 0], motion[i, 1], motion[i, 2], motion[i, 3]
        vx, vy, vz = motion[i, 4], motion[i, 5], motion[i, 6]
        wx, wy, wz = motion[i, 7], motion[i, 8], motion[i, 9]
        for c in range(starts[i], starts[i + 1]):
            j = others[c]
            dx = motion[j, 0] - x
            dy = motion[j, 1] - y
            dz = motion[j, 2] - z
            reach = r + motion[j, 3]
            square = dx * dx + dy * dy + dz * dz
            if square >= reach * reach:
                if touching[c]:
                    touching[c] = False
                    shear[c, 0] = shear[c, 1] = shear[c, 2] = 0.0
                continue
            touching[c] = True
            if not frictional:
                distance = np.sqrt(square)
                push = stiffness[c] * (reach - distance) / distance
                loads[i, 0] -= push * dx
                loads[i, 1] -= push * dy
                loads[i, 2] -= push * dz
                loads[j, 0] += push * dx
                loads[j, 1] += push * dy
                loads[j, 2] += push * dz
                continue
            pair[m] = c
            grain[m] = i
            block[_BRANCH + m] = dx
            block[_BRANCH + _SIZE + m] = dy
            block[_BRANCH + 2 * _SIZE + m] = dz
            block[_RADIUS + m] = r
            block[_REACH + m] = reach
            block[_MOTION + m] = motion[j, 4] - vx
            block[_MOTION + _SIZE + m] = motion[j, 5] - vy
            block[_MOTION + 2 * _SIZE + m] = motion[j, 6] - vz
            block[_SPIN_I + m] = wx
            block[_SPIN_I + _SIZE + m] = wy
            block[_SPIN_I + 2 * _SIZE + m] = wz
            for a in range(3):
                block[_SPIN_J + a * _SIZE + m] = motion[j, 7 + a]
                block[_SHEAR + a * _SIZE + m] = shear[c, a]
            block[_NORMAL_STIFFNESS + m] = stiffness[c]
            block[_SHEAR_STIFFNESS + m] = ratio * stiffness[c]
            m += 1
            if m == _SIZE:
                _contact_law(m, dt, block)
                dissipated += _hand_out(m, block, pair, grain, pairs, loads)
                m = 0
    _contact_law(m, dt, block)
    return dissipated + _hand_out(m, block, pair, grain, pairs, loads)


@helper(error_model="numpy")
def _hand_out(m, block, pair, grain, pairs, loads):
    """Add what a block has found to the loads of its grains; returns the energy dissipated."""
    dissipated = 0.0
    for k in range(m):
        c = pair[k]
        i = grain[k]
        j = pairs.others[c]
        for a in range(3):
            pairs.shear[c, a] = block[_SHEAR + a * _SIZE + k]
            loads[i, a] += block[_FORCE + a * _SIZE + k]
            loads[j, a] -= block[_FORCE + a * _SIZE + k]
            loads[i, 3 + a] += block[_TORQUE_I + a * _SIZE + k]
            loads[j, 3 + a] += block[_TORQUE_J + a * _SIZE + k]
        dissipated += block[_SLID + k]
    return dissipated


@kernel(error_model="numpy")
def wall_contacts(first, last, parameters, grains, pairs, walls, loads, wall_loads):
    """Forces of the pairs first ... last - 1 of a grain and a wall.

    Parameters
    ----------
    first, last : int
    parameters : StepParameters
        The friction is that of each wall instead.
    grains : Grains
    pairs : WallPairs
        Shear and touching are changed.
    walls : MovingWalls
    loads : (n, 6) array
        Force [N] and torque [N m] on each grain, added to. A grain whose centre is beyond a wall gets an infinite
        one, which stops the motion.
    wall_loads : (6, 4) array
        Force on each wall [N], and the sum of the stiffnesses of its contacts [N/m], added to.

    Returns
    -------
    float
        Energy that sliding dissipates [J].
    """
    ratio, dt = parameters.ratio, parameters.dt
    motion, members, stiffness, shear, touching, friction = (
        grains.motion, pairs.members, pairs.stiffness, pairs.shear, pairs.touching, walls.friction
    )  # fmt: skip
    block = np.empty(_COLUMNS)
    pair = np.empty(_SIZE, np.int64)
    dissipated = 0.0
    m = 0
    for c in range(first, last):
        i = members[c, 0]
        w = members[c, 1]
        axis = WALL_AXES[w]
        r = motion[i, 3]
        ahead = walls.places[w] - motion[i, axis]
        gap = WALL_SENSES[w] * ahead
        if gap <= 0.0:  # the centre is beyond the wall: nothing pushes it back
            loads[i, axis] = np.inf
            continue
        if gap >= r:
            if touching[c]:
                touching[c] = False
                shear[c, 0] = shear[c, 1] = shear[c, 2] = 0.0
            continue
        touching[c] = True
        if not (ratio > 0.0 and friction[w] > 0.0):
            push = stiffness[c] * (r - gap) * WALL_SENSES[w]
            loads[i, axis] -= push
            wall_loads[w, axis] += push
            wall_loads[w, 3] += stiffness[c]
            continue
        pair[m] = c
        # The mirror image overlaps the grain twice as deep as the wall does, and does not spin.
        for a in range(3):
            block[_BRANCH + a * _SIZE + m] = 2.0 * ahead if a == axis else 0.0
            block[_MOTION + a * _SIZE + m] = walls.velocities[w, a] - motion[i, 4 + a]
            block[_SPIN_I + a * _SIZE + m] = motion[i, 7 + a]
            block[_SPIN_J + a * _SIZE + m] = 0.0
            block[_SHEAR + a * _SIZE + m] = shear[c, a]
        block[_RADIUS + m] = r
        block[_REACH + m] = 2.0 * r
        block[_NORMAL_STIFFNESS + m] = 0.5 * stiffness[c]
        block[_SHEAR_STIFFNESS + m] = ratio * stiffness[c]
        block[_FRICTION + m] = friction[w]
        m += 1
        if m == _SIZE:
            _contact_law(m, dt, block)
            dissipated += _hand_to_walls(m, block, pair, pairs, loads, wall_loads)
            m = 0
    _contact_law(m, dt, block)
    return dissipated + _hand_to_walls(m, block, pair, pairs, loads, wall_loads)


@helper(error_model="numpy")
def _hand_to_walls(m, block, pair, pairs, loads, wall_loads):
    """Add what a block has found to the loads of its grains and walls; returns the energy dissipated."""
    dissipated = 0.0
    for k in range(m):
        c = pair[k]
        i = pairs.members[c, 0]
        w = pairs.members[c, 1]
        for a in range(3):
            pairs.shear[c, a] = block[_SHEAR + a * _SIZE + k]
            loads[i, a] += block[_FORCE + a * _SIZE + k]
            loads[i, 3 + a] += block[_TORQUE_I + a * _SIZE + k]
            wall_loads[w, a] -= block[_FORCE + a * _SIZE + k]
        wall_loads[w, 3] += pairs.stiffness[c]
        dissipated += block[_SLID + k]
    return dissipated


@helper(error_model="numpy", fastmath=_FAST)
def _contact_law(m, dt, block):
    """Forces, torques and dissipation of the first m contacts of a block.

    Free of branches, so that it is compiled to work on several contacts at once.
    """
    for k in range(m):
        nx = block[_BRANCH + k]
        ny = block[_BRANCH + _SIZE + k]
        nz = block[_BRANCH + 2 * _SIZE + k]
        distance = np.sqrt(nx * nx + ny * ny + nz * nz)
        inverse = 1.0 / distance
        nx *= inverse
        ny *= inverse
        nz *= inverse
        overlap = block[_REACH + k] - distance
        normal = block[_NORMAL_STIFFNESS + k] * overlap
        # Arms from the centres to the middle of the overlap: they add up to the distance.
        arm_i = block[_RADIUS + k] - 0.5 * overlap
        arm_j = distance - arm_i
        ix = block[_SPIN_I + k]
        iy = block[_SPIN_I + _SIZE + k]
        iz = block[_SPIN_I + 2 * _SIZE + k]
        jx = block[_SPIN_J + k]
        jy = block[_SPIN_J + _SIZE + k]
        jz = block[_SPIN_J + 2 * _SIZE + k]
        # Velocity of j's surface relative to i's, where they touch: u - (arm_i w_i + arm_j w_j) x n.
        ax = arm_i * ix + arm_j * jx
        ay = arm_i * iy + arm_j * jy
        az = arm_i * iz + arm_j * jz
        ux = block[_MOTION + k] - (ay * nz - az * ny)
        uy = block[_MOTION + _SIZE + k] - (az * nx - ax * nz)
        uz = block[_MOTION + 2 * _SIZE + k] - (ax * ny - ay * nx)
        # The tangential force turns with the pair, about n and into the new plane, without change of length ...
        twist = 0.5 * dt * ((ix + jx) * nx + (iy + jy) * ny + (iz + jz) * nz)
        sx = block[_SHEAR + k]
        sy = block[_SHEAR + _SIZE + k]
        sz = block[_SHEAR + 2 * _SIZE + k]
        size = sx * sx + sy * sy + sz * sz
        off = sx * nx + sy * ny + sz * nz
        turned = (size - off * off) * (1.0 + twist * twist)
        scale = np.sqrt(size / max(turned, 1e-6 * size + _TINY))
        sx *= scale
        sy *= scale
        sz *= scale
        # ... and grows by the slip; what is along n is taken out of all at once.
        ks = block[_SHEAR_STIFFNESS + k]
        step = ks * dt
        tx = sx + twist * (ny * sz - nz * sy) + step * ux
        ty = sy + twist * (nz * sx - nx * sz) + step * uy
        tz = sz + twist * (nx * sy - ny * sx) + step * uz
        off = tx * nx + ty * ny + tz * nz
        tx -= off * nx
        ty -= off * ny
        tz -= off * nz
        # Coulomb's limit.
        size = np.sqrt(tx * tx + ty * ty + tz * tz)
        most = block[_FRICTION + k] * normal
        excess = max(size - most, 0.0)
        block[_SLID + k] = min(size, most) * excess / (ks + _TINY)
        scale = 1.0 - excess / (size + _TINY)
        tx *= scale
        ty *= scale
        tz *= scale
        block[_SHEAR + k] = tx
        block[_SHEAR + _SIZE + k] = ty
        block[_SHEAR + 2 * _SIZE + k] = tz
        block[_FORCE + k] = tx - normal * nx
        block[_FORCE + _SIZE + k] = ty - normal * ny
        block[_FORCE + 2 * _SIZE + k] = tz - normal * nz
        qx = ny * tz - nz * ty
        qy = nz * tx - nx * tz
        qz = nx * ty - ny * tx
        block[_TORQUE_I + k] = arm_i * qx
        block[_TORQUE_I + _SIZE + k] = arm_i * qy
        block[_TORQUE_I + 2 * _SIZE + k] = arm_i * qz
        block[_TORQUE_J + k] = arm_j * qx
        block[_TORQUE_J + _SIZE + k] = arm_j * qy
        block[_TORQUE_J + 2 * _SIZE + k] = arm_j * qz
