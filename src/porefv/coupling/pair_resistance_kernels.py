"""Kernels of `porefv.coupling.pair_resistance`: coefficients of the pairs, and the product of L with velocities."""

from __future__ import annotations

import numpy as np

from porefv.packing.box import WALL_AXES, WALL_SENSES
from porefv.system.kernels import helper, kernel


@helper(error_model="numpy")
def _lubrication(r, s, gap, reach, logarithm):
    """Coefficients of normal and tangential lubrication of two spheres without spins, over π μ [m].

    They are the leading terms of Jeffrey and Onishi (1984), X^A and Y^A. `r` is the smaller radius, `s` the other over
    it, infinite for a plane; `gap` is 2 h / (r + r s), or h / r, and below `reach`, where the coefficients end;
    `logarithm` is that of reach / gap.
    """
    inverse = 1.0 / gap - 1.0 / reach
    if np.isinf(s):
        return 6.0 * r * (inverse + 0.2 * logarithm), 3.2 * r * logarithm
    cube = (1.0 + s) * (1.0 + s) * (1.0 + s)
    normal = 2.0 * s * s * inverse + 0.2 * s * (1.0 + 7.0 * s + s * s) * logarithm
    return 6.0 * r * normal / cube, 1.6 * r * s * (2.0 + s + 2.0 * s * s) * logarithm / cube


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
            rolling = 0.6 * size * size * size
            wide = max(gap, 0.0) / half
            far_off = distance / (half * law.reach)
            far_off *= far_off
            far = size * law.growth * min(wide, law.grown) / (1.0 + far_off * far_off)
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
            logarithm = np.log(law.lubricated / narrow)
            near = _lubrication(small, ratio, narrow, law.lubricated, logarithm)
            normal += near[0] + constant
            tangential += near[1] + constant
            turning = rolling * logarithm
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
def add_blocks(pairs, blocks):
    """Add the diagonal blocks of L, (m, 2, 6): of velocities and of spins, as xx, yy, zz, yz, zx, xy."""
    members, normals, arms, normal, tangential, rolling = pairs
    for c in range(members.shape[0]):
        x, y, z = normals[c, 0], normals[c, 1], normals[c, 2]
        xx, yy, zz, yz, zx, xy = x * x, y * y, z * z, y * z, z * x, x * y
        across = tangential[c]
        along = normal[c] - across
        for side in range(2):
            block = blocks[members[c, side]]
            arm = arms[c, side]
            turning = arm * arm * across + (rolling[c] if arm > 0.0 else 0.0)
            block[0, 0] += across + along * xx
            block[0, 1] += across + along * yy
            block[0, 2] += across + along * zz
            block[0, 3] += along * yz
            block[0, 4] += along * zx
            block[0, 5] += along * xy
            block[1, 0] += turning * (1.0 - xx)
            block[1, 1] += turning * (1.0 - yy)
            block[1, 2] += turning * (1.0 - zz)
            block[1, 3] -= turning * yz
            block[1, 4] -= turning * zx
            block[1, 5] -= turning * xy


@kernel(error_model="numpy")
def invert_blocks(first, inertia, blocks, inverses):
    """Fill in the inverses of the diagonal blocks of D⁻¹ + L of rows from `first` on, zero in what moves on its own.

    Parameters
    ----------
    first : int
    inertia : (m, 6) array
        D⁻¹; zero for what moves on its own.
    blocks, inverses : (m, 2, 6) arrays
        Of L, as of `add_blocks`; and the inverses.
    """
    for k in range(first, inertia.shape[0]):
        for part in range(2):
            block, inverse = blocks[k, part], inverses[k, part]
            dx, dy, dz = inertia[k, 3 * part], inertia[k, 3 * part + 1], inertia[k, 3 * part + 2]
            fx, fy, fz = dx > 0.0, dy > 0.0, dz > 0.0
            xx = block[0] + dx if fx else 1.0
            yy = block[1] + dy if fy else 1.0
            zz = block[2] + dz if fz else 1.0
            yz = block[3] if fy and fz else 0.0
            zx = block[4] if fz and fx else 0.0
            xy = block[5] if fx and fy else 0.0
            cx, cy, cz = yy * zz - yz * yz, yz * zx - xy * zz, xy * yz - yy * zx
            scale = 1.0 / (xx * cx + xy * cy + zx * cz)
            inverse[0] = scale * cx if fx else 0.0
            inverse[1] = scale * (xx * zz - zx * zx) if fy else 0.0
            inverse[2] = scale * (xx * yy - xy * xy) if fz else 0.0
            inverse[3] = scale * (xy * zx - xx * yz)
            inverse[4] = scale * cz
            inverse[5] = scale * cy


@kernel(error_model="numpy")
def solve_for_changes(
    pairs, contacts, mobilities, inertia, inverses, velocities, x, forces, yielded, room, tolerance, limit
):
    """Solve (D⁻¹ + L) x = -L ẋ* for what moves freely, by preconditioned conjugate gradients; returns the iterations.

    Parameters
    ----------
    pairs, contacts : Pairs
        L is the sum of both.
    mobilities, inertia : (m, 6) arrays
        D and D⁻¹; zero for what moves on its own, where x is zero.
    inverses : (m, 2, 6) array
        Of the diagonal blocks of D⁻¹ + L, as of `add_blocks`; zero in what moves on its own.
    velocities, x : (m, 6) arrays
        ẋ*; the start, and the result [m/s, rad/s].
    forces, yielded : (m, 6) arrays
        Filled in: what pairs and what contacts do at ẋ* + x [N, N m].
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
            lq[k, a] = inertia[k, a] * x[k, a]
    add_resistance(pairs, q, lq)
    add_resistance(contacts, q, lq)
    for k in range(m):
        for a in range(6):
            r[k, a] = -lq[k, a]
    iteration = 0
    before = 1.0
    while True:
        wrong, bound = _wrong_and_bound(mobilities, inertia, velocities, x, r, tolerance)
        if wrong <= bound:
            break
        if iteration == limit:
            return -1
        rz = _precondition(inverses, r, z)
        _turn(inertia, z, rz / before if iteration > 0 else 0.0, q, lq)
        add_resistance(pairs, q, lq)
        add_resistance(contacts, q, lq)
        power = _product(q, lq)
        if not power > 0.0:
            return -1
        _go_along(rz / power, q, lq, x, r)
        before = rz
        iteration += 1
    # What moves on its own has no inertia here: there the residual is the force itself.
    for k in range(m):
        for a in range(6):
            q[k, a] = velocities[k, a] + x[k, a]
            lq[k, a] = 0.0
    add_resistance(contacts, q, lq)
    for k in range(m):
        for a in range(6):
            yielded[k, a] = -lq[k, a]
            forces[k, a] = r[k, a] + inertia[k, a] * x[k, a] - yielded[k, a]
    return iteration


# Sums may be taken in any order: they are then formed four numbers at a time.
@helper(fastmath={"reassoc", "contract"})
def _wrong_and_bound(mobilities, inertia, velocities, x, r, tolerance):
    wrong = moving = changed = 0.0
    for k in range(x.shape[0]):
        for a in range(6):
            u = velocities[k, a] + x[k, a]
            wrong += mobilities[k, a] * r[k, a] * r[k, a]
            moving += inertia[k, a] * u * u
            changed += inertia[k, a] * x[k, a] * x[k, a]
    return wrong, tolerance * tolerance * moving + 1e-10 * changed + 1e-300


@helper(fastmath={"contract"})
def _turn(inertia, z, turn, q, lq):
    """q = z + turn q, and lq = D⁻¹ q."""
    for k in range(q.shape[0]):
        for a in range(6):
            along = z[k, a] + turn * q[k, a] if turn > 0.0 else z[k, a]
            q[k, a] = along
            lq[k, a] = inertia[k, a] * along


@helper(fastmath={"reassoc", "contract"})
def _product(a, b):
    total = 0.0
    for k in range(a.shape[0]):
        for c in range(6):
            total += a[k, c] * b[k, c]
    return total


@helper(fastmath={"contract"})
def _go_along(step, q, lq, x, r):
    for k in range(x.shape[0]):
        for a in range(6):
            x[k, a] += step * q[k, a]
            r[k, a] -= step * lq[k, a]


@helper(fastmath={"contract"})
def _precondition(inverses, r, z):
    """z = M⁻¹ r; returns r·z."""
    product = 0.0
    for k in range(r.shape[0]):
        for part in range(2):
            b = inverses[k, part]
            x, y, w = r[k, 3 * part], r[k, 3 * part + 1], r[k, 3 * part + 2]
            s = b[0] * x + b[5] * y + b[4] * w
            t = b[5] * x + b[1] * y + b[3] * w
            u = b[4] * x + b[3] * y + b[2] * w
            z[k, 3 * part], z[k, 3 * part + 1], z[k, 3 * part + 2] = s, t, u
            product += s * x + t * y + u * w
    return product
