"""Approximate Cholesky factor of a network, by elimination with sampled fill.

Eliminating a node joins all its neighbours to each other. Instead of that clique a random tree with the same mean
is added, each neighbour linked to one of the more strongly joined ones with probability in proportion to its link.
The factor stays nearly as sparse as the network, for any geometry, size and contrast, and as a preconditioner takes
conjugate gradients to convergence in a number of steps that hardly depends on them (Kyng and Sachdeva 2016,
doi:10.1109/FOCS.2016.68; Gao, Kyng and Spielman 2023, arXiv:2303.00709).

Large networks are cut into parts along their numbering, which the mesh lays along a space-filling curve. The inner
nodes of all parts are eliminated side by side, then the separator between them. The cut depends on the size alone
and the random numbers are seeded: equal networks have equal factors, on any number of threads.
"""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass

import numpy as np
from numba import get_num_threads

from porefv.errors import ComputationError
from porefv.solvers.network import Network
from porefv.system.growing_arrays import doubled
from porefv.system.kernels import njit, prange
from porefv.system.random_numbers import random_state, uniform

_GROUND = -1
# One end of a link, as its node's list holds it. One record, so that following a list misses the cache once a link.
_HALF_LINK = np.dtype([("weight", np.float64), ("other", np.int32), ("following", np.int32)])
# Nodes from which two parts pay, and the size beyond which there are more of them.
_CUT_FROM = 20_000
_PART = 400_000


@dataclass(frozen=True, eq=False)
class ApproximateCholesky:
    """Preconditioner A ≈ L D Lᵀ of a network.

    Positions run over the inner nodes of each part in their order of elimination, then over the separator's.

    Attributes
    ----------
    order : (n,) uint32 array
        Node at each position.
    parts : (p + 1,) int64 array
        Position where each part starts; the last is where the separator starts.
    starts : (n + 1,) uint32, rows : (fill,) uint32, factors : (fill,) float32 arrays
        Column k of -L below its unit diagonal. Indices without sign need no look at whether they count from the end.
    inverse_pivots : (n,) array
        1 / D.
    row_starts, row_columns, row_factors
        The rows of -L in which the separator hangs on the parts, so that every row can be summed by itself.
    """

    order: np.ndarray
    parts: np.ndarray
    starts: np.ndarray
    rows: np.ndarray
    factors: np.ndarray
    inverse_pivots: np.ndarray
    row_starts: np.ndarray
    row_columns: np.ndarray
    row_factors: np.ndarray

    @classmethod
    def of(cls, network: Network) -> ApproximateCholesky:
        """Factor a network, every part of which must be joined to a leak."""
        n = len(network)
        n_parts = 1 if n < _CUT_FROM else 2 * (1 + n // (2 * _PART))
        bounds = np.linspace(0, n, n_parts + 1).astype(np.int64)
        separator = _separator(network.starts, network.columns, bounds)
        local = np.empty(n, np.int32)

        def factor(part):
            inner, outer, starts, columns, links, leaks = _part(
                network.starts, network.columns, network.links, network.leaks, separator, local,
                bounds[part], bounds[part + 1],
            )  # fmt: skip
            order, *column, kept, strengths, ground = _eliminated(starts, columns, links, leaks, len(inner))
            starts, rows, factors, pivots = column
            nodes = np.concatenate([inner, outer])
            return inner[order], starts, nodes[rows], factors, pivots, nodes[kept], strengths, outer, ground

        with ThreadPoolExecutor(get_num_threads()) as pool:
            pieces = list(pool.map(factor, range(n_parts)))
        pieces.append(cls._separator_piece(network, separator, pieces))

        pivots = np.concatenate([piece[4] for piece in pieces])
        if not (pivots > 0.0).all():
            raise ComputationError("the network is singular: a part of it is not joined to any imposed pressure")

        order = np.concatenate([piece[0] for piece in pieces])
        position = np.empty(n, np.int32)
        position[order] = np.arange(n, dtype=np.int32)
        fills = np.cumsum([0] + [len(piece[2]) for piece in pieces])
        parts = np.cumsum([0] + [len(piece[0]) for piece in pieces[:-1]])
        starts = np.concatenate(
            [piece[1][:-1] + fill for piece, fill in zip(pieces, fills, strict=False)] + [fills[-1:]]
        )
        rows = np.concatenate([position[piece[2]] for piece in pieces])
        factors = np.concatenate([piece[3] for piece in pieces])
        return cls(
            order.astype(np.uint32), parts, starts.astype(np.uint32), rows.astype(np.uint32), factors, 1.0 / pivots,
            *_rows_of(parts[-1], starts, rows, factors),
        )  # fmt: skip

    @staticmethod
    def _separator_piece(network, separator, pieces):
        """Factor of what the parts leave: links between separator nodes, given and filled in."""
        nodes = np.flatnonzero(separator >= 0).astype(np.int32)
        leaks = network.leaks[nodes]
        for piece in pieces:
            leaks[separator[piece[7]]] += piece[8]
        given = _links_within(network.starts, network.columns, network.links, separator, nodes)
        pairs = np.concatenate([given[0]] + [separator[piece[5]] for piece in pieces])
        strengths = np.concatenate([given[1]] + [piece[6] for piece in pieces])
        rest = Network.from_links(pairs, strengths, leaks)
        order, starts, rows, factors, pivots, *_ = _eliminated(
            rest.starts, rest.columns, rest.links, rest.leaks, len(rest)
        )
        return nodes[order], starts, nodes[rows], factors, pivots

    def apply(self, r: np.ndarray, z: np.ndarray, y: np.ndarray) -> float:
        """z = (L D Lᵀ)⁻¹ r, (n,); returns r·z. `y`, (n,), is room to work in."""
        if len(self.parts) == 2 or get_num_threads() == 1:
            return _substitute(self.order, self.starts, self.rows, self.factors, self.inverse_pivots, r, z, y)
        return _substitute_parts(
            self.order, self.parts, self.starts, self.rows, self.factors, self.inverse_pivots,
            self.row_starts, self.row_columns, self.row_factors, r, z, y,
        )  # fmt: skip


@njit(cache=True)
def _separator(starts, columns, bounds):
    """Number of each node in the separator, -1 outside: the nodes linked to a later part."""
    number = np.full(bounds[-1], -1, np.int32)
    count = 0
    for part in range(bounds.shape[0] - 2):
        for i in range(bounds[part], bounds[part + 1]):
            for k in range(starts[i], starts[i + 1]):
                if columns[k] >= bounds[part + 1]:
                    number[i] = count
                    count += 1
                    break
    return number


@njit(cache=True, nogil=True)
def _part(starts, columns, links, leaks, separator, local, first, last):
    """One part as a network of its own: inner nodes first, then the separator's nodes next to them.

    Returns
    -------
    inner, outer : node ids;  starts, columns, links : rows of the inner nodes;  leaks : of both, zero for the outer.
    """
    inner = np.empty(last - first, np.int32)
    n_inner = 0
    n_links = 0
    for i in range(first, last):
        if separator[i] < 0:
            local[i] = n_inner
            inner[n_inner] = i
            n_inner += 1
            n_links += starts[i + 1] - starts[i]
    outer = np.empty(n_links, np.int32)
    n_outer = 0
    seen = np.full(separator.max() + 1, -1, np.int32)
    new_starts = np.zeros(n_inner + 1, np.int64)
    new_columns = np.empty(n_links, np.int32)
    new_links = np.empty(n_links)
    filled = 0
    for a in range(n_inner):
        i = inner[a]
        for k in range(starts[i], starts[i + 1]):
            j = columns[k]
            s = separator[j]
            if s < 0:
                new_columns[filled] = local[j]
            else:
                if seen[s] < 0:
                    seen[s] = n_outer
                    outer[n_outer] = j
                    n_outer += 1
                new_columns[filled] = n_inner + seen[s]
            new_links[filled] = links[k]
            filled += 1
        new_starts[a + 1] = filled
    new_leaks = np.zeros(n_inner + n_outer)
    for a in range(n_inner):
        new_leaks[a] = leaks[inner[a]]
    return inner[:n_inner].copy(), outer[:n_outer].copy(), new_starts, new_columns, new_links, new_leaks


@njit(cache=True)
def _links_within(starts, columns, links, separator, nodes):
    """Links (m, 2), (m,) between nodes of the separator, in its numbering."""
    room = 0
    for a in range(nodes.shape[0]):
        room += starts[nodes[a] + 1] - starts[nodes[a]]
    pairs = np.empty((room, 2), np.int32)
    strengths = np.empty(room)
    count = 0
    for a in range(nodes.shape[0]):
        for k in range(starts[nodes[a]], starts[nodes[a] + 1]):
            b = separator[columns[k]]
            if b > a:
                pairs[count, 0] = a
                pairs[count, 1] = b
                strengths[count] = links[k]
                count += 1
    return pairs[:count].copy(), strengths[:count].copy()


def _eliminated(starts, columns, links, leaks, n):
    """`eliminate`, with memory from numpy, which large arrays get in large pages."""
    # Each elimination frees about as many half-links as it makes, so the initial room nearly suffices.
    room = len(columns) + 64
    half_links = np.empty(room, _HALF_LINK)
    rows, factors = np.empty(2 * room, np.int32), np.empty(2 * room, np.float32)
    return eliminate(starts, columns, links, leaks, n, half_links, rows, factors, random_state(0))


@njit(cache=True, nogil=True, error_model="numpy")
def eliminate(starts, columns, links, leaks, n, half_links, rows, factors, random):
    """Eliminate the first n nodes, the least connected first, in sweeps along the numbering.

    Links live in lists of half-links, one list for each of these nodes; a half-link whose other end is gone is
    dropped when met. Nodes from n on are kept: fill between two of them is given back. Arrays of half-links, rows and
    factors are given, to be filled, and the state of the random numbers (`system.random_numbers`).

    Returns
    -------
    order (n,), starts (n + 1,), rows, factors : column k of -L holds `factors` at the nodes `rows`
    pivots (n,)
    kept (m, 2), strengths (m,) : links between kept nodes that elimination has left
    ground : leaks of the kept nodes
    """
    n_all = leaks.shape[0]
    head = np.full(n, -1, np.int32)
    degree = np.zeros(n, np.int32)
    ground = leaks.copy()
    used = 0
    for i in range(n):
        for k in range(starts[i], starts[i + 1]):
            half_links[used].following = head[i]
            half_links[used].other = columns[k]
            half_links[used].weight = links[k]
            head[i] = used
            used += 1
            degree[i] += 1
    unused = np.int32(-1)

    done = np.zeros(n_all, np.bool_)
    slot = np.full(n_all, -1, np.int32)
    near = np.empty(64, np.int32)
    w = np.empty(64)
    rest = np.empty(64)
    active = np.arange(n, dtype=np.int32)
    n_active = n
    order = np.empty(n, np.int32)
    pivots = np.empty(n)
    factor_starts = np.zeros(n + 1, np.int64)
    filled = 0
    kept = np.empty((64, 2), np.int32)
    strengths = np.empty(64)
    n_kept = 0
    eliminated = 0
    limit = 3
    while eliminated < n:
        before = eliminated
        waiting = 0
        for place in range(n_active):
            i = active[place]
            if degree[i] > limit:
                active[waiting] = i
                waiting += 1
                continue
            # Gather the neighbours, parallel links added up.
            m = 0
            link = head[i]
            while link >= 0:
                j = half_links[link].other
                if not done[j]:
                    if slot[j] >= 0:
                        w[slot[j]] += half_links[link].weight
                    else:
                        if m + 2 > near.shape[0]:
                            near = doubled(near)
                            w = doubled(w)
                            rest = doubled(rest)
                        slot[j] = m
                        near[m] = j
                        w[m] = half_links[link].weight
                        m += 1
                    if j < n:
                        degree[j] -= 1
                after = half_links[link].following
                half_links[link].following = unused
                unused = link
                link = after
            total = ground[i]
            for q in range(m):
                slot[near[q]] = -1
                total += w[q]
            done[i] = True
            order[eliminated] = i
            pivots[eliminated] = total
            if filled + m > rows.shape[0]:
                rows = doubled(rows)
                factors = doubled(factors)
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
            rest[m - 1] = 0.0
            for q in range(m - 2, -1, -1):
                rest[q] = rest[q + 1] + w[q + 1]
            for q in range(m - 1):
                aim = uniform(random) * rest[q]
                p = q + 1
                passed = w[p]
                while passed < aim and p < m - 1:
                    p += 1
                    passed += w[p]
                a = near[q]
                b = near[p]
                strength = w[q] * rest[q] / total
                if a == _GROUND:
                    ground[b] += strength
                elif b == _GROUND:
                    ground[a] += strength
                elif a >= n and b >= n:
                    if n_kept == strengths.shape[0]:
                        kept = _doubled_pairs(kept)
                        strengths = doubled(strengths)
                    kept[n_kept, 0] = a
                    kept[n_kept, 1] = b
                    strengths[n_kept] = strength
                    n_kept += 1
                else:
                    for end in range(2):
                        x = a if end == 0 else b
                        if x >= n:
                            continue
                        link = unused
                        if link >= 0:
                            unused = half_links[link].following
                        else:
                            if used == half_links.shape[0]:
                                half_links = doubled(half_links)
                            link = np.int32(used)
                            used += 1
                        half_links[link].following = head[x]
                        head[x] = link
                        half_links[link].other = b if end == 0 else a
                        half_links[link].weight = strength
                        degree[x] += 1
        n_active = waiting
        if eliminated - before < 0.3 * (n - before):
            limit += max(1, limit // 2)
    return (
        order, factor_starts, rows[:filled].copy(), factors[:filled].copy(), pivots,
        kept[:n_kept].copy(), strengths[:n_kept].copy(), ground[n:].copy(),
    )  # fmt: skip


@njit(cache=True)
def _rows_of(n_inner, starts, rows, factors):
    """Entries of the first n_inner columns in rows from n_inner on, row by row: starts, columns, factors."""
    n = starts.shape[0] - 1
    row_starts = np.zeros(n - n_inner + 1, np.int64)
    for e in range(starts[n_inner]):
        if rows[e] >= n_inner:
            row_starts[rows[e] - n_inner + 1] += 1
    for i in range(n - n_inner):
        row_starts[i + 1] += row_starts[i]
    columns = np.empty(row_starts[-1], np.int32)
    row_factors = np.empty(row_starts[-1], np.float32)
    place = row_starts[:-1].copy()
    for k in range(n_inner):
        for e in range(starts[k], starts[k + 1]):
            i = rows[e] - n_inner
            if i >= 0:
                columns[place[i]] = k
                row_factors[place[i]] = factors[e]
                place[i] += 1
    return row_starts, columns, row_factors


@njit(cache=True, error_model="numpy")
def _substitute(order, starts, rows, factors, inverse_pivots, r, z, y):
    """z = (L D Lᵀ)⁻¹ r, by way of y; returns r·z."""
    n = order.shape[0]
    for k in range(n):
        y[k] = r[order[k]]
    for k in range(n):
        v = y[k]
        for e in range(starts[k], starts[k + 1]):
            y[rows[e]] += factors[e] * v
    return _backward(0, n, order, starts, rows, factors, inverse_pivots, r, z, y)


@njit(cache=True, parallel=True)
def _substitute_parts(
    order, parts, starts, rows, factors, inverse_pivots, row_starts, row_columns, row_factors, r, z, y
):  # fmt: skip
    """The same, parts side by side."""
    n = order.shape[0]
    n_parts = parts.shape[0] - 1
    n_inner = parts[n_parts]
    products = np.zeros(n_parts + 1)
    for part in prange(n_parts):
        _forward(parts[part], parts[part + 1], n_inner, order, starts, rows, factors, r, y)
    for i in prange(n - n_inner):
        s = r[order[n_inner + i]]
        for e in range(row_starts[i], row_starts[i + 1]):
            s += row_factors[e] * y[row_columns[e]]
        y[n_inner + i] = s
    for k in range(n_inner, n):
        v = y[k]
        for e in range(starts[k], starts[k + 1]):
            y[rows[e]] += factors[e] * v
    products[n_parts] = _backward(n_inner, n, order, starts, rows, factors, inverse_pivots, r, z, y)
    for part in prange(n_parts):
        products[part] = _backward(
            parts[part], parts[part + 1], order, starts, rows, factors, inverse_pivots, r, z, y
        )  # fmt: skip
    return products.sum()


@njit(cache=True)
def _forward(first, last, n_inner, order, starts, rows, factors, r, y):
    """y = L⁻¹ r within one part."""
    for k in range(first, last):
        y[k] = r[order[k]]
    for k in range(first, last):
        v = y[k]
        for e in range(starts[k], starts[k + 1]):
            if rows[e] < n_inner:
                y[rows[e]] += factors[e] * v


@njit(cache=True, error_model="numpy")
def _backward(first, last, order, starts, rows, factors, inverse_pivots, r, z, y):
    """y and z = L⁻ᵀ D⁻¹ y for one part; returns its part of r·z."""
    product = 0.0
    for k in range(last - 1, first - 1, -1):
        s = y[k] * inverse_pivots[k]
        for e in range(starts[k], starts[k + 1]):
            s += factors[e] * y[rows[e]]
        y[k] = s
        z[order[k]] = s
        product += s * r[order[k]]
    return product


@njit(cache=True)
def _doubled_pairs(array):
    larger = np.empty((2 * array.shape[0], 2), array.dtype)
    for i in range(array.shape[0]):
        larger[i, 0] = array[i, 0]
        larger[i, 1] = array[i, 1]
    return larger
