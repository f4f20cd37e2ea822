"""Kernels of the lattice-Boltzmann method: a step of collisions and motion, and what walls and solids send back.

Populations are (19, n + slots) arrays f, as they leave the nodes after a collision. They are in the unit in which Σ f
is the pressure, from 0 to 1.
"""

from __future__ import annotations

from porefv.resolved.lattice_links import DIRECTIONS, OPPOSITE
from porefv.system.kernels import helper, kernel


@kernel(fastmath={"reassoc", "contract"}, allocates=False)
def move_and_collide(first, last, sources, f, new, even, odd):
    """f'_q = f_q - even (f_q⁺ - w_q p) - odd (f_q⁻ - 3 w_q c_q·j), of the populations that come in.

    p = Σ f, j = Σ c f; f⁺ and f⁻ are the halves of f_q ± f_q̄. `even` and `odd` are the relaxation rates.
    """
    h, k = 0.5 * even, 0.5 * odd
    for i in range(first, last):
        f0 = f[0, i]
        f1, f2 = f[1, sources[1, i]], f[2, sources[2, i]]
        f3, f4 = f[3, sources[3, i]], f[4, sources[4, i]]
        f5, f6 = f[5, sources[5, i]], f[6, sources[6, i]]
        f7, f8 = f[7, sources[7, i]], f[8, sources[8, i]]
        f9, f10 = f[9, sources[9, i]], f[10, sources[10, i]]
        f11, f12 = f[11, sources[11, i]], f[12, sources[12, i]]
        f13, f14 = f[13, sources[13, i]], f[14, sources[14, i]]
        f15, f16 = f[15, sources[15, i]], f[16, sources[16, i]]
        f17, f18 = f[17, sources[17, i]], f[18, sources[18, i]]
        p = f0 + (f1 + f2) + (f3 + f4) + (f5 + f6) + (f7 + f8) + (f9 + f10)
        p += (f11 + f12) + (f13 + f14) + (f15 + f16) + (f17 + f18)
        x = (f1 - f2) + (f7 - f8) + (f9 - f10) + (f11 - f12) + (f13 - f14)
        y = (f3 - f4) + (f7 - f8) - (f9 - f10) + (f15 - f16) + (f17 - f18)
        z = (f5 - f6) + (f11 - f12) - (f13 - f14) + (f15 - f16) - (f17 - f18)
        new[0, i] = f0 - even * (f0 - p / 3.0)
        a, b = p / 9.0, p / 18.0  # 2 w p of the axes and of the diagonals
        new[1, i], new[2, i] = _relaxed(f1, f2, a, x / 3.0, h, k)
        new[3, i], new[4, i] = _relaxed(f3, f4, a, y / 3.0, h, k)
        new[5, i], new[6, i] = _relaxed(f5, f6, a, z / 3.0, h, k)
        new[7, i], new[8, i] = _relaxed(f7, f8, b, (x + y) / 6.0, h, k)
        new[9, i], new[10, i] = _relaxed(f9, f10, b, (x - y) / 6.0, h, k)
        new[11, i], new[12, i] = _relaxed(f11, f12, b, (x + z) / 6.0, h, k)
        new[13, i], new[14, i] = _relaxed(f13, f14, b, (x - z) / 6.0, h, k)
        new[15, i], new[16, i] = _relaxed(f15, f16, b, (y + z) / 6.0, h, k)
        new[17, i], new[18, i] = _relaxed(f17, f18, b, (y - z) / 6.0, h, k)


@helper(fastmath={"reassoc", "contract"})
def _relaxed(f, back, even_sum, odd_difference, h, k):
    """Both populations of a pair, after the collision."""
    even = h * (f + back - even_sum)
    odd = k * (f - back - odd_difference)
    return f - even - odd, back - even + odd


@kernel(allocates=False)
def fill_images(f, directions, slots, starts, origins, origin_directions, weights, constants):
    """What comes in through walls: constant + Σ weight f."""
    for k in range(directions.shape[0]):
        total = constants[k]
        for e in range(starts[k], starts[k + 1]):
            total += weights[e] * f[origin_directions[e], origins[e]]
        f[directions[k], slots[k]] = total


@kernel(allocates=False)
def fill_cuts(f, nodes, directions, slots, weights, sources):
    """What comes back from solids, interpolated along the link.

    f_q̄(t + 1) = f_q + (1 - 2 δ) / (1 + 2 δ) (f_q(t + 1) - f_q̄).
    """
    for k in range(nodes.shape[0]):
        q, i = directions[k], nodes[k]
        back = OPPOSITE[q]
        f[back, slots[k]] = f[q, i] + weights[k] * (f[q, sources[q, i]] - f[back, i])


@kernel
def moments(first, last, sources, f, pressure, momentum):
    """p = Σ f and j = Σ c f of the populations that come in."""
    for i in range(first, last):
        p = x = y = z = 0.0
        for q in range(19):
            value = f[q, sources[q, i]]
            p += value
            x += DIRECTIONS[q, 0] * value
            y += DIRECTIONS[q, 1] * value
            z += DIRECTIONS[q, 2] * value
        pressure[i] = p
        momentum[i, 0], momentum[i, 1], momentum[i, 2] = x, y, z
