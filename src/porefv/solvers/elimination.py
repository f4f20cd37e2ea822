"""Elimination of the nodes of a network with sampled fill: its approximate Cholesky factor, column by column.

A node that is eliminated leaves a column of the factor: its links, divided by the sum of their weights, the pivot.
Exact elimination then links all its neighbours to each other. Here a random graph takes the place of that clique, with
the same mean and no more links than the node had: they take over its links' places in memory (`approximate_cholesky`
has the references).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from porefv.solvers.network import NetworkRows
from porefv.system.kernels import helper, kernel
from porefv.system.random_numbers import random_state, uniform

# What leaks lead to, among the neighbours of a node.
_GROUND = -1
# One end of a link, in the list of the node there: what the other end is, the record of it in the list there, and the
# record that follows. One record, so that following a list misses the cache once a link.
_HALF_LINK = np.dtype([("weight", np.float64), ("other", np.int32), ("reverse", np.int32), ("following", np.int32)])
# The first record of a node's list, how many records of it are in use, and the node's place in a star.
_NODE = np.dtype([("head", np.int32), ("degree", np.int32), ("place", np.int32)])
# A neighbour of a node, `_GROUND` for a leak: the weight of the link to it, the record of that in the list of the node
# itself, and the sum of the weights of the neighbours that follow.
_NEIGHBOUR = np.dtype([("weight", np.float64), ("beyond", np.float64), ("node", np.int32), ("record", np.int32)])
# No record, no place in a star, and for `other`: no longer in use.
_NONE = -1
# Columns are filled up with zeros in their own row to a multiple of so many entries (see `substitution.Factor`).
_FILLED_TO = 4
# Nodes of up to so many half-links are eliminated in the first sweep.
_FIRST_LIMIT = 3
# Places in `counts`: nodes eliminated, entries and kept links made, nodes looked at in a sweep, and left by it.
_DONE, _FILL, _KEPT, _LOOKED_AT, _LEFT = range(5)


class Elimination(NamedTuple):
    """What elimination of the first n of m nodes gives. Indices without sign need no look at whether they count back.

    Attributes
    ----------
    order : (n,) int32 array
        The nodes as they were eliminated.
    starts : (n + 1,) uint32, rows : (fill,) uint32, factors : (fill,) float32 arrays
        Column k of -L has the entries starts[k] ... starts[k + 1] - 1 of `factors`, the last ones zeros. Their rows
        are positions in `order`, or n ... m - 1 for the other nodes.
    inverse_pivots : (n,) array
        1 / D [Pa s/m³].
    pairs : (k, 2) int32, weights : (k,) arrays
        Links between the other m - n nodes that elimination has made, which count from 0 [m³/(Pa s)].
    leaks : (m - n,) array
        Leaks of the other nodes after elimination [m³/(Pa s)].
    """

    order: np.ndarray
    starts: np.ndarray
    rows: np.ndarray
    factors: np.ndarray
    inverse_pivots: np.ndarray
    pairs: np.ndarray
    weights: np.ndarray
    leaks: np.ndarray


class Lists(NamedTuple):
    """Links in lists, one for each node that is to be eliminated; a link is in the lists of those of its two nodes.

    Attributes
    ----------
    nodes : (m,) array of `_NODE`
    records : (number of half-links,) array of `_HALF_LINK`
    leaks : (m,) array
        [m³/(Pa s)]
    """

    nodes: np.ndarray
    records: np.ndarray
    leaks: np.ndarray


class Columns(NamedTuple):
    """Columns of the factor as they are made, by node: attributes as of `Elimination`, with room for more."""

    order: np.ndarray
    starts: np.ndarray
    rows: np.ndarray
    factors: np.ndarray
    inverse_pivots: np.ndarray


class KeptLinks(NamedTuple):
    """Links between nodes that are not eliminated, with room for more: their nodes (room, 2) int32, weights (room,)."""

    pairs: np.ndarray
    weights: np.ndarray


def eliminated(network: NetworkRows, n: int) -> Elimination:
    """Eliminate the first n nodes of a network whose rows are those of these nodes, the least connected first.

    That is done in sweeps along the numbering. A sweep eliminates nodes of at most `limit` half-links, and leaves the
    others to the next. The limit grows when a sweep has found few. Equal networks give equal results.
    """
    lists = Lists(np.empty(len(network.leaks), _NODE), np.empty(len(network.columns), _HALF_LINK), network.leaks.copy())
    _put_in_lists(network, n, lists)
    room = 2 * len(network.columns)  # suffices as a rule; what is not used is never touched
    columns = Columns(
        np.empty(n, np.int32), np.zeros(n + 1, np.uint32), np.empty(room, np.int32), np.empty(room, np.float32),
        np.empty(n),
    )  # fmt: skip
    kept = KeptLinks(np.empty((room, 2), np.int32), np.empty(room))
    counts = np.zeros(5, np.int64)
    random = random_state(0)
    waiting = np.arange(n, dtype=np.int32)
    limit = _FIRST_LIMIT
    while counts[_DONE] < n:
        before = int(counts[_DONE])
        counts[_LOOKED_AT] = counts[_LEFT] = 0
        most = limit + 1  # neighbours, and links that take the place of a node
        star = np.empty(most, _NEIGHBOUR)
        while not _sweep(limit, lists, star, columns, kept, waiting, random, counts):
            fill = int(counts[_FILL]) + most + _FILLED_TO
            columns = columns._replace(rows=_with_room(columns.rows, fill), factors=_with_room(columns.factors, fill))
            kept = KeptLinks(*(_with_room(array, int(counts[_KEPT]) + most) for array in kept))
        waiting = waiting[: counts[_LEFT]]
        if counts[_DONE] - before < 0.3 * (n - before):
            limit += max(1, limit // 2)
    rows = np.empty(counts[_FILL], np.uint32)
    _renumber(columns, np.arange(len(lists.leaks), dtype=np.uint32), rows)
    count = counts[_KEPT]
    return Elimination(
        columns.order, columns.starts, rows, columns.factors[: len(rows)].copy(), columns.inverse_pivots,
        kept.pairs[:count] - n, kept.weights[:count], lists.leaks[n:],
    )  # fmt: skip


def _with_room(array: np.ndarray, least: int) -> np.ndarray:
    """The array, at the start of a longer one if it has less than the least length."""
    if len(array) >= least:
        return array
    longer = np.empty((2 * least, *array.shape[1:]), array.dtype)
    longer[: len(array)] = array
    return longer


@kernel
def _put_in_lists(network, n, lists):
    """The links of the first n nodes in lists, each sorted by the other end, but for nodes that are not eliminated."""
    starts, columns, links, _ = network
    nodes, records, _ = lists
    for i in range(nodes.shape[0]):
        nodes[i].head = _NONE
        nodes[i].degree = 0
        nodes[i].place = _NONE
    # Rows are put at the ends of their links, in their order: `degree` counts what each end has so far.
    for i in range(n):
        for k in range(starts[i], starts[i + 1]):
            j = columns[k]
            if j < n:
                record = starts[j] + nodes[j].degree
                records[record].other = i
                records[record].weight = links[k]
                nodes[j].degree += 1
    # Once more in the same order, with `place` to count: where the other half of each link was put.
    for i in range(n):
        for record in range(starts[i], starts[i] + nodes[i].degree):
            j = records[record].other
            records[record].reverse = starts[j] + nodes[j].place + 1
            nodes[j].place += 1
    for i in range(n):
        for k in range(starts[i], starts[i + 1]):
            if columns[k] >= n:
                record = starts[i] + nodes[i].degree
                records[record].other = columns[k]
                records[record].weight = links[k]
                records[record].reverse = _NONE
                nodes[i].degree += 1
        for record in range(starts[i], starts[i + 1]):
            records[record].following = nodes[i].head
            nodes[i].head = record
        nodes[i].place = _NONE


@kernel(error_model="numpy", allocates=False)
def _sweep(limit, lists, star, columns, kept, waiting, random, counts):
    """Eliminate those of the waiting nodes that have at most `limit` half-links; returns whether all were looked at.

    The others are left at the start of `waiting`. The sweep stops where room is short, and goes on when called again.
    """
    order, starts, rows, factors, inverse_pivots = columns
    done, fill, left, place = counts[_DONE], counts[_FILL], counts[_LEFT], counts[_LOOKED_AT]
    most = star.shape[0]
    while place < waiting.shape[0]:
        i = waiting[place]
        if lists.nodes[i].degree > limit:
            waiting[left] = i
            left += 1
            place += 1
            continue
        if fill + most + _FILLED_TO > rows.shape[0] or counts[_KEPT] + most > kept.weights.shape[0]:
            break
        place += 1
        m = _take_list(i, lists, star)
        leak = lists.leaks[i]
        pivot = leak
        for q in range(m):
            pivot += star[q].weight
        inverse = 1.0 / pivot
        order[done] = i
        inverse_pivots[done] = inverse
        for q in range(m):
            rows[fill] = star[q].node
            factors[fill] = star[q].weight * inverse
            fill += 1
        while fill % _FILLED_TO != 0:
            rows[fill] = i
            factors[fill] = 0.0
            fill += 1
        done += 1
        starts[done] = fill
        if leak > 0.0:
            star[m].node, star[m].weight = _GROUND, leak
            m += 1
        _sample_fill(star, m, inverse, lists, order.shape[0], kept, random, counts)
    counts[_DONE], counts[_FILL], counts[_LEFT], counts[_LOOKED_AT] = done, fill, left, place
    return place == waiting.shape[0]


@helper(inline="always")
def _take_list(i, lists, star):
    """Gather the neighbours of node i, parallel links made one; returns their number."""
    nodes, records, _ = lists
    m = 0
    record = nodes[i].head
    while record != _NONE:
        j = records[record].other
        if j != _NONE:
            place = nodes[j].place
            if place == _NONE:
                nodes[j].place = m
                star[m].node, star[m].weight, star[m].record = j, records[record].weight, record
                m += 1
            else:
                star[place].weight += records[record].weight
                _drop_reverse(record, j, lists)
        record = records[record].following
    for q in range(m):
        nodes[star[q].node].place = _NONE
    return m


@helper(error_model="numpy", inline="always")
def _sample_fill(star, m, inverse, lists, n, kept, random, counts):
    """Link m neighbours to each other, by one link for each; `inverse` is 1 / pivot.

    The three of the largest weights are all linked, p and q by w_p w_q / pivot. Every other neighbour q is linked to
    one of those with larger weights, with probability in proportion to the weights, by a link of weight
    w_q Σ w / pivot; the sum is over those with larger weights. The mean of these links is the clique.
    """
    _sort_by_weight(star, m)
    total = 0.0
    for q in range(m - 1, -1, -1):
        star[q].beyond = total
        total += star[q].weight
    for q in range(m if m > 2 else m - 1):
        if q < m - 3:
            aim = uniform(random) * star[q].beyond
            p = m - 1  # the most probable first
            passed = star[p].weight
            while passed < aim and p > q + 1:
                p -= 1
                passed += star[p].weight
            sum_of_weights = star[q].beyond
        else:
            p = q + 1 if q + 1 < m else m - 3
            sum_of_weights = star[p].weight
        _add_link(q, p, star[q].weight * inverse * sum_of_weights, star, lists, n, kept, counts)
    if 0 < m < 3 and star[m - 1].node != _GROUND:  # one or two have no link to spare for the last
        _drop_reverse(star[m - 1].record, star[m - 1].node, lists)


@helper(inline="always")
def _sort_by_weight(star, m):
    """Sort the m neighbours of a star, the smallest weight first, by insertion."""
    for q in range(1, m):
        weight, node, record = star[q].weight, star[q].node, star[q].record
        p = q
        while p > 0 and star[p - 1].weight > weight:
            star[p] = star[p - 1]
            p -= 1
        star[p].weight, star[p].node, star[p].record = weight, node, record


@helper(inline="always")
def _add_link(q, p, weight, star, lists, n, kept, counts):
    """Link neighbour q of a star to neighbour p, by the two records of its link to the star's node."""
    nodes, records, leaks = lists
    i, j = star[q].node, star[p].node
    record = star[q].record
    if i == _GROUND:
        leaks[j] += weight
    elif j == _GROUND:
        leaks[i] += weight
        _drop_reverse(record, i, lists)
    elif i >= n and j >= n:
        k = counts[_KEPT]
        kept.pairs[k, 0], kept.pairs[k, 1], kept.weights[k] = i, j, weight
        counts[_KEPT] += 1
    else:
        reverse = records[record].reverse
        if i < n:
            records[reverse].other, records[reverse].weight = j, weight
            records[reverse].reverse = record if j < n else _NONE
        if j < n:
            records[record].other, records[record].weight = i, weight  # `reverse` stays as it is
            records[record].following, nodes[j].head = nodes[j].head, record
            nodes[j].degree += 1


@helper(inline="always")
def _drop_reverse(record, other, lists):
    """Take the other half of a link out of use, that of the node `other`."""
    reverse = lists.records[record].reverse
    if reverse != _NONE:
        lists.records[reverse].other = _NONE
        lists.nodes[other].degree -= 1


@kernel
def _renumber(columns, position, rows):
    """Rows of the entries by position; `position` (m,) is given, the identity, which it stays for outer nodes."""
    for k in range(columns.order.shape[0]):
        position[columns.order[k]] = k
    for e in range(rows.shape[0]):
        rows[e] = position[columns.rows[e]]
