"""Approximate Cholesky factor of a network, by elimination with sampled fill.

Eliminating a node joins all its neighbours to each other. Instead of that clique a random tree with the same mean
is added, each neighbour linked to one of the more strongly joined ones with probability in proportion to its link.
The factor stays nearly as sparse as the network, for any geometry, size and contrast, and as a preconditioner takes
conjugate gradients to convergence in a number of steps that hardly depends on them (Kyng and Sachdeva 2016,
doi:10.1109/FOCS.2016.68; Gao, Kyng and Spielman 2023, arXiv:2303.00709). The random numbers are seeded: equal networks have equal factors.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from porefv.network import Network

_GROUND = -1


class ApproximateCholesky:
    """Preconditioner A ≈ L D Lᵀ of a network.

    Parameters
    ----------
    network : Network
        Every part of it must be joined to a leak.
    """

    def __init__(self, network: Network):
        self.order, self.starts, rows, self.factors, self.pivots = eliminate(
            network.starts, network.columns, network.links, network.leaks
        )
        position = np.empty(len(network), np.int32)
        position[self.order] = np.arange(len(network), dtype=np.int32)
        self.rows = position[rows]
        self.work = np.empty(len(network))

    @property
    def fill(self) -> int:
        """Number of entries below the diagonal of the factor."""
        return len(self.factors)

    def apply(self, r: np.ndarray) -> np.ndarray:
        """(n,): (L D Lᵀ)⁻¹ r."""
        z = np.empty_like(r)
        substitute(self.order, self.starts, self.rows, self.factors, self.pivots, r, self.work, z)
        return z


@njit(cache=True)
def eliminate(starts, columns, links, leaks):
    """Eliminate all nodes, the least connected first, in sweeps along the numbering.

    Links live in lists of half-links, one list a node; a half-link whose other end is gone is dropped when met.

    Returns
    -------
    order (n,), starts (n + 1,), rows, factors: column k of -L holds `factors` at the nodes `rows`; pivots (n,).
    """
    n = leaks.shape[0]
    np.random.seed(0)
    # Each elimination frees as many half-links as it makes, so the initial room suffices.
    room = columns.shape[0]
    head = np.full(n, -1, np.int64)
    following = np.empty(room, np.int64)
    other = np.empty(room, np.int32)
    weight = np.empty(room)
    degree = np.zeros(n, np.int32)
    ground = leaks.copy()
    used = 0
    for i in range(n):
        for k in range(starts[i], starts[i + 1]):
            following[used] = head[i]
            other[used] = columns[k]
            weight[used] = links[k]
            head[i] = used
            used += 1
            degree[i] += 1
    unused = np.int64(-1)

    done = np.zeros(n, np.bool_)
    slot = np.full(n, -1, np.int32)
    near = np.empty(64, np.int32)
    w = np.empty(64)
    order = np.empty(n, np.int32)
    pivots = np.empty(n)
    factor_starts = np.zeros(n + 1, np.int64)
    rows = np.empty(2 * room + 64, np.int32)
    factors = np.empty(2 * room + 64)
    filled = 0
    eliminated = 0
    limit = 3
    while eliminated < n:
        before = eliminated
        for i in range(n):
            if done[i] or degree[i] > limit:
                continue
            # Gather the neighbours, parallel links added up.
            m = 0
            link = head[i]
            while link >= 0:
                j = other[link]
                if not done[j]:
                    if slot[j] >= 0:
                        w[slot[j]] += weight[link]
                    else:
                        if m + 2 > near.shape[0]:
                            near = _doubled(near)
                            w = _doubled(w)
                        slot[j] = m
                        near[m] = j
                        w[m] = weight[link]
                        m += 1
                    degree[j] -= 1
                after = following[link]
                following[link] = unused
                unused = link
                link = after
            for q in range(m):
                slot[near[q]] = -1
            total = ground[i]
            for q in range(m):
                total += w[q]
            done[i] = True
            order[eliminated] = i
            pivots[eliminated] = total
            if filled + m > rows.shape[0]:
                rows = _doubled(rows)
                factors = _doubled(factors)
            for q in range(m):
                rows[filled] = near[q]
                factors[filled] = w[q] / total
                filled += 1
            eliminated += 1
            factor_starts[eliminated] = filled

            # Sample the fill: weakest neighbour first, each tied to one of those stronger than itself.
            if ground[i] > 0.0:
                near[m] = _GROUND
                w[m] = ground[i]
                m += 1
            for q in range(1, m):
                key = w[q]
                node = near[q]
                p = q
                while p > 0 and w[p - 1] > key:
                    w[p] = w[p - 1]
                    near[p] = near[p - 1]
                    p -= 1
                w[p] = key
                near[p] = node
            for q in range(m - 1):
                rest = 0.0
                for p in range(q + 1, m):
                    rest += w[p]
                aim = np.random.random() * rest
                p = q + 1
                passed = w[p]
                while passed < aim and p < m - 1:
                    p += 1
                    passed += w[p]
                a = near[q]
                b = near[p]
                strength = w[q] * rest / total
                if a == _GROUND:
                    ground[b] += strength
                elif b == _GROUND:
                    ground[a] += strength
                else:
                    for end in range(2):
                        x = a if end == 0 else b
                        link = unused
                        if link >= 0:
                            unused = following[link]
                        else:
                            if used == following.shape[0]:
                                following = _doubled(following)
                                other = _doubled(other)
                                weight = _doubled(weight)
                            link = used
                            used += 1
                        following[link] = head[x]
                        head[x] = link
                        other[link] = b if end == 0 else a
                        weight[link] = strength
                        degree[x] += 1
        if eliminated - before < 0.05 * (n - before):
            limit = max(limit + 1, limit * 5 // 4)
    return order, factor_starts, rows[:filled].copy(), factors[:filled].copy(), pivots


@njit(cache=True)
def substitute(order, starts, rows, factors, pivots, r, y, z):
    """z = (L D Lᵀ)⁻¹ r; y is working room."""
    n = order.shape[0]
    for k in range(n):
        y[k] = r[order[k]]
    for k in range(n):
        v = y[k]
        for e in range(starts[k], starts[k + 1]):
            y[rows[e]] += factors[e] * v
    for k in range(n - 1, -1, -1):
        s = y[k] / pivots[k]
        for e in range(starts[k], starts[k + 1]):
            s += factors[e] * y[rows[e]]
        y[k] = s
        z[order[k]] = s


@njit(cache=True)
def _doubled(array):
    larger = np.empty(2 * array.shape[0], array.dtype)
    for i in range(array.shape[0]):
        larger[i] = array[i]
    return larger
