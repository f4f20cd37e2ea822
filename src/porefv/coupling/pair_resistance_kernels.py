"""Kernels of `porefv.coupling.pair_resistance`: coefficients of the pairs, and the product of L with velocities."""

from __future__ import annotations

import numpy as np

from porefv.packing.box import WALL_AXES, WALL_SENSES
from porefv.system.kernels import helper, kernel


@helper(error_model="numpy")
def _normal(r, s, gap, reach):
    """Coefficient of the normal lubrication of two spheres (Jeffrey and Onishi 1984, X^A), over π μ [m].

    `r` is the smaller radius, `s` the other over it, infinite for a plane; `gap` is 2 h / (r + r s), or h / r, and
    below `reach`, where the coefficient ends.
    """
    inverse, logarithm = 1.0 / gap - 1.0 / reach, np.log(reach / gap)
    if np.isinf(s):
        return 6.0 * r * (inverse + 0.2 * logarithm)
    cube = (1.0 + s) ** 3
    return 6.0 * r * (2.0 * s**2 / cube * inverse + s * (1.0 + 7.0 * s + s**2) / (5.0 * cube) * logarithm)


@helper(error_model="numpy")
def _tangential(r, s, gap, reach):
    """The same of the tangential lubrication (Y^A), without spins."""
    share = 8.0 / 15.0 if np.isinf(s) else 4.0 * s * (2.0 + s + 2.0 * s**2) / (15.0 * (1.0 + s) ** 3)
    return 6.0 * r * share * np.log(reach / gap)


@kernel(error_model="numpy")
def find_coefficients(law, members, motion, places, pairs):
    """Fill in the geometry and the coefficients of pairs.

    Parameters
    ----------
    law : PairLaw
    members : (p, 2) uint32 array
        Rows of the two: grains, then the six walls; a wall is the second.
    motion : (n, 4) array
        Centres and radii of the grains, by row [m].
    places : (6,) array
        Coordinate of each wall along its axis [m].
    pairs : Pairs
        Filled in but for its rows.
    """
    n = motion.shape[0]
    for c in range(members.shape[0]):
        i = members[c, 0]
        j = members[c, 1]
        r = motion[i, 3]
        if j < n:
            x = motion[j, 0] - motion[i, 0]
            y = motion[j, 1] - motion[i, 1]
            z = motion[j, 2] - motion[i, 2]
            distance = np.sqrt(x * x + y * y + z * z)
            pairs.normals[c, 0], pairs.normals[c, 1], pairs.normals[c, 2] = x / distance, y / distance, z / distance
            other = motion[j, 3]
            small = min(r, other)
            ratio = max(r, other) / small
            size = 2.0 * r * other / (r + other)
            gap = distance - r - other
            half = 0.5 * (r + other)
            pairs.arms[c, 0], pairs.arms[c, 1] = r + 0.5 * gap, other + 0.5 * gap
            rolling = 0.6 * size**3
            wide = max(gap, 0.0) / half
            fading = 1.0 + (distance / half / law.reach) ** 4
            far = size * law.growth * min(wide, law.grown) / fading
        else:
            w = j - n
            axis = WALL_AXES[w]
            for a in range(3):
                pairs.normals[c, a] = WALL_SENSES[w] if a == axis else 0.0
            distance = WALL_SENSES[w] * (places[w] - motion[i, axis])
            small, ratio, size, half, rolling, far = r, np.inf, 2.0 * r, r, 0.0, 0.0
            gap = distance - r
            # A wall does not turn: only the arm of the grain counts.
            pairs.arms[c, 0], pairs.arms[c, 1] = r + 0.5 * gap, 0.0
        narrow = max(gap / half, law.roughness)
        normal, tangential, turning = far, far, 0.0
        if narrow < law.lubricated:
            constant = size * law.contact * (1.0 - narrow / law.lubricated)
            normal += _normal(small, ratio, narrow, law.lubricated) + constant
            tangential += _tangential(small, ratio, narrow, law.lubricated) + constant
            turning = rolling * np.log(law.lubricated / narrow)
        pairs.normal[c] = np.pi * law.viscosity * normal
        pairs.tangential[c] = np.pi * law.viscosity * tangential
        pairs.rolling[c] = np.pi * law.viscosity * turning


@kernel
def add_resistance(pairs, u, lu):
    """Add L u to `lu`, both (m, 6): velocities and spins of grains and walls, by row, and forces and torques.

    Parameters
    ----------
    pairs : Pairs
    u : (m, 6) array
        [m/s, rad/s]
    lu : (m, 6) array
        What the pairs resist with: forces of the fluid on the grains are -L u [N, N m].
    """
    members, normals, arms, normal, tangential, rolling = pairs
    count = members.shape[0]
    c = 0
    while c < count:
        i = members[c, 0]
        vx, vy, vz, wx, wy, wz = u[i, 0], u[i, 1], u[i, 2], u[i, 3], u[i, 4], u[i, 5]
        sum_fx = sum_fy = sum_fz = sum_tx = sum_ty = sum_tz = 0.0
        while c < count and members[c, 0] == i:  # pairs are sorted by their first
            j = members[c, 1]
            nx, ny, nz = normals[c, 0], normals[c, 1], normals[c, 2]
            p, q = arms[c, 0], arms[c, 1]
            sx = p * wx + q * u[j, 3]
            sy = p * wy + q * u[j, 4]
            sz = p * wz + q * u[j, 5]
            # Velocity of j at the midpoint relative to i there.
            ux = u[j, 0] - vx - (sy * nz - sz * ny)
            uy = u[j, 1] - vy - (sz * nx - sx * nz)
            uz = u[j, 2] - vz - (sx * ny - sy * nx)
            along = (normal[c] - tangential[c]) * (ux * nx + uy * ny + uz * nz)
            fx = tangential[c] * ux + along * nx
            fy = tangential[c] * uy + along * ny
            fz = tangential[c] * uz + along * nz
            sum_fx += fx
            sum_fy += fy
            sum_fz += fz
            lu[j, 0] += fx
            lu[j, 1] += fy
            lu[j, 2] += fz
            qx = ny * fz - nz * fy
            qy = nz * fx - nx * fz
            qz = nx * fy - ny * fx
            mx = my = mz = 0.0
            if rolling[c] > 0.0:
                mx = u[j, 3] - wx
                my = u[j, 4] - wy
                mz = u[j, 5] - wz
                twist = mx * nx + my * ny + mz * nz
                mx = rolling[c] * (mx - twist * nx)
                my = rolling[c] * (my - twist * ny)
                mz = rolling[c] * (mz - twist * nz)
            sum_tx += p * qx + mx
            sum_ty += p * qy + my
            sum_tz += p * qz + mz
            lu[j, 3] -= q * qx - mx
            lu[j, 4] -= q * qy - my
            lu[j, 5] -= q * qz - mz
            c += 1
        lu[i, 0] -= sum_fx
        lu[i, 1] -= sum_fy
        lu[i, 2] -= sum_fz
        lu[i, 3] -= sum_tx
        lu[i, 4] -= sum_ty
        lu[i, 5] -= sum_tz


@kernel
def add_blocks(pairs, moving, turning):
    """Add the diagonal blocks of L: `moving` and `turning`, both (m, 3, 3), of velocities and of spins."""
    members, normals, arms, normal, tangential, rolling = pairs
    for c in range(members.shape[0]):
        for side in range(2):
            k = members[c, side]
            arm = arms[c, side]
            across = arm * arm * tangential[c] + (rolling[c] if arm > 0.0 else 0.0)
            for a in range(3):
                moving[k, a, a] += tangential[c]
                turning[k, a, a] += across
                for b in range(3):
                    both = normals[c, a] * normals[c, b]
                    moving[k, a, b] += (normal[c] - tangential[c]) * both
                    turning[k, a, b] -= across * both


@kernel(error_model="numpy")
def invert_blocks(first, inertia, blocks, inverses):
    """Fill in the inverses of the diagonal blocks of D⁻¹ + L of rows from `first` on, zero in what moves on its own.

    Parameters
    ----------
    first : int
    inertia : (m, 6) array
        D⁻¹; zero for what moves on its own.
    blocks, inverses : (2, m, 3, 3) arrays
        Of L, of velocities and of spins; and the inverses.
    """
    a = np.empty((3, 3))
    for k in range(first, inertia.shape[0]):
        for part in range(2):
            for i in range(3):
                free = inertia[k, 3 * part + i] > 0.0
                for j in range(3):
                    both = free and inertia[k, 3 * part + j] > 0.0
                    a[i, j] = blocks[part, k, i, j] if both else 0.0
                a[i, i] += inertia[k, 3 * part + i] if free else 1.0
            cx = a[1, 1] * a[2, 2] - a[1, 2] * a[2, 1]
            cy = a[1, 2] * a[2, 0] - a[1, 0] * a[2, 2]
            cz = a[1, 0] * a[2, 1] - a[1, 1] * a[2, 0]
            scale = 1.0 / (a[0, 0] * cx + a[0, 1] * cy + a[0, 2] * cz)
            inverse = inverses[part, k]
            inverse[0, 0], inverse[1, 0], inverse[2, 0] = scale * cx, scale * cy, scale * cz
            inverse[0, 1] = scale * (a[0, 2] * a[2, 1] - a[0, 1] * a[2, 2])
            inverse[1, 1] = scale * (a[0, 0] * a[2, 2] - a[0, 2] * a[2, 0])
            inverse[2, 1] = scale * (a[0, 1] * a[2, 0] - a[0, 0] * a[2, 1])
            inverse[0, 2] = scale * (a[0, 1] * a[1, 2] - a[0, 2] * a[1, 1])
            inverse[1, 2] = scale * (a[0, 2] * a[1, 0] - a[0, 0] * a[1, 2])
            inverse[2, 2] = scale * (a[0, 0] * a[1, 1] - a[0, 1] * a[1, 0])
            for i in range(3):
                if inertia[k, 3 * part + i] == 0.0:
                    inverse[i, i] = 0.0


@kernel(error_model="numpy")
def solve_for_changes(pairs, inertia, inverses, velocities, x, forces, room, tolerance, limit):
    """Solve (D⁻¹ + L) x = -L ẋ* for what moves freely, by preconditioned conjugate gradients; returns the iterations.

    Parameters
    ----------
    pairs : Pairs
    inertia : (m, 6) array
        D⁻¹; zero for what moves on its own, where x is zero.
    inverses : (2, m, 3, 3) array
        Of the diagonal blocks of D⁻¹ + L, of velocities and of spins; zero in what moves on its own.
    velocities, x : (m, 6) arrays
        ẋ*; the start, and the result [m/s, rad/s].
    forces : (m, 6) array
        Filled in: -L (ẋ* + x) [N, N m].
    room : (4, m, 6) array
        To work in.
    tolerance : float
        Bound on what the residual changes the velocities by over the step, relative to them, and a hundred thousandth
        of their change: both in the norm of the kinetic energy.
    limit : int
        Most iterations.

    Returns
    -------
    int
        -1 where the limit is reached, or numbers are not finite.
    """
    r, q, lq, z = room[0], room[1], room[2], room[3]
    m = x.shape[0]
    for k in range(m):
        for a in range(6):
            if inertia[k, a] == 0.0:
                x[k, a] = 0.0
            q[k, a] = velocities[k, a] + x[k, a]
    lq[:] = 0.0
    add_resistance(pairs, q, lq)
    for k in range(m):
        for a in range(6):
            forces[k, a] = -lq[k, a]
            r[k, a] = forces[k, a] - inertia[k, a] * x[k, a] if inertia[k, a] > 0.0 else 0.0
    rz = 0.0
    for iteration in range(limit):
        wrong = moving = changed = 0.0
        for k in range(m):
            for a in range(6):
                if inertia[k, a] > 0.0:
                    wrong += r[k, a] * r[k, a] / inertia[k, a]
                    moving += inertia[k, a] * (velocities[k, a] + x[k, a]) ** 2
                    changed += inertia[k, a] * x[k, a] ** 2
        if wrong <= tolerance * tolerance * moving + 1e-10 * changed + 1e-300:
            return iteration
        before, rz = rz, _precondition(inverses, r, z)
        turn = rz / before if iteration > 0 else 0.0
        for k in range(m):
            for a in range(6):
                q[k, a] = z[k, a] + turn * q[k, a] if iteration > 0 else z[k, a]
                lq[k, a] = 0.0
        add_resistance(pairs, q, lq)
        power = 0.0
        for k in range(m):
            for a in range(6):
                power += q[k, a] * (lq[k, a] + inertia[k, a] * q[k, a])
        if not power > 0.0:
            return -1
        along = rz / power
        for k in range(m):
            for a in range(6):
                forces[k, a] -= along * lq[k, a]
                if inertia[k, a] > 0.0:
                    x[k, a] += along * q[k, a]
                    r[k, a] -= along * (lq[k, a] + inertia[k, a] * q[k, a])
    return -1


@helper
def _precondition(inverses, r, z):
    """z = M⁻¹ r; returns r·z."""
    product = 0.0
    for k in range(r.shape[0]):
        for part in range(2):
            for a in range(3):
                total = 0.0
                for b in range(3):
                    total += inverses[part, k, a, b] * r[k, 3 * part + b]
                z[k, 3 * part + a] = total
                product += total * r[k, 3 * part + a]
    return product
