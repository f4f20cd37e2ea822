"""Elimination of the nodes of a network with sampled fill: its approximate Cholesky factor, column by column.

A node that is eliminated leaves a column of the factor: its links, divided by the sum of their weights, the pivot.
Exact elimination then links all its neighbours to each other. Here a random tree of links takes the place of that
clique, and has the same mean (`approximate_cholesky` has the references).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from porefv.solvers.network import NetworkRows
from porefv.system.growing_arrays import doubled
from porefv.system.kernels import helper, kernel
from porefv.system.random_numbers import random_state, uniform

# What leaks lead to, among the neighbours of a node.
_GROUND = -1
# One end of a link, as its node's list has it. One record, so that following a list misses the cache once a link.
_HALF_LINK = np.dtype([("weight", np.float64), ("other", np.int32), ("following", np.int32)])
# Places in `HalfLinks.counts`.
_USED, _FIRST_FREE, _FREE = 0, 1, 2
# Nodes of up to so many half-links are eliminated in the first sweep.
_FIRST_LIMIT = 3


class Elimination(NamedTuple):
    """What elimination of the first n of m nodes gives.

    Attributes
    ----------
    order : (n,) int32 array
        The nodes as they were eliminated.
    starts : (n + 1,) int64, rows : (fill,) int32, factors : (fill,) float32 arrays
        Column k of -L has the entries starts[k] ... starts[k + 1] - 1 of `factors`, at the nodes `rows`.
    pivots : (n,) array
        D [m³/(Pa s)].
    pairs : (k, 2) int32, weights : (k,) arrays
        Links between the other m - n nodes that elimination has made [m³/(Pa s)].
    leaks : (m - n,) array
        Leaks of the other nodes after elimination [m³/(Pa s)].
    """

    order: np.ndarray
    starts: np.ndarray
    rows: np.ndarray
    factors: np.ndarray
    pivots: np.ndarray
    pairs: np.ndarray
    weights: np.ndarray
    leaks: np.ndarray


class HalfLinks(NamedTuple):
    """Links in lists, one list for each node that is to be eliminated; a link is in the lists of both its nodes.

    Attributes
    ----------
    records : (room,) array of `_HALF_LINK`
        Weight of the link, node at its other end, and the record that follows in the list, -1 at its end.
    heads : (n,) int32 array
        First record of each node's list.
    degrees : (n,) int32 array
        How many records of each list have an other end that is not eliminated.
    counts : (3,) int64 array
        How many records have been in use, the first of the list of free ones among them, and the length of that list.
    """

    records: np.ndarray
    heads: np.ndarray
    degrees: np.ndarray
    counts: np.ndarray


class Star(NamedTuple):
    """A node's neighbours.

    Attributes
    ----------
    nodes : (room,) int32 array
        The neighbours, `_GROUND` among them for a leak.
    weights : (room,) array
        Of the links to them [m³/(Pa s)].
    beyond : (room,) array
        Sum of the weights after each [m³/(Pa s)].
    """

    nodes: np.ndarray
    weights: np.ndarray
    beyond: np.ndarray


class KeptLinks(NamedTuple):
    """Links between nodes that are not eliminated: their nodes (room, 2) int32, weights (room,), number (1,) int64."""

    pairs: np.ndarray
    weights: np.ndarray
    number: np.ndarray


def eliminated(network: NetworkRows, n: int) -> Elimination:
    """Eliminate the first n nodes of a network whose rows are those of these nodes.

    Equal networks give equal results.
    """
    # Each elimination frees about as many half-links as it makes, so the initial room nearly suffices. The memory is
    # numpy's, which large arrays get in large pages.
    room = len(network.columns) + 64
    return _eliminate(
        network, n, np.empty(room, _HALF_LINK), np.empty(2 * room, np.int32), np.empty(2 * room, np.float32),
        random_state(0),
    )  # fmt: skip


@kernel(error_model="numpy")
def _eliminate(network, n, records, rows, factors, random):
    """Eliminate the first n nodes, the least connected first, in sweeps along the numbering.

    A sweep eliminates nodes of at most `limit` half-links, and leaves the others to the next. The limit grows when a
    sweep has found few. Arrays of half-links, rows and factors are given, to be filled; `random` is the state of the
    random numbers.
    """
    half_links = _in_lists(network, n, records)
    leaks = network.leaks.copy()
    slots = np.full(leaks.shape[0], -1, np.int32)
    gone = np.zeros(leaks.shape[0], np.bool_)
    kept = KeptLinks(np.empty((64, 2), np.int32), np.empty(64), np.zeros(1, np.int64))
    waiting = np.arange(n, dtype=np.int32)
    n_waiting = n
    limit = _FIRST_LIMIT
    star = _star(limit)
    order = np.empty(n, np.int32)
    starts = np.zeros(n + 1, np.int64)
    pivots = np.empty(n)
    done = 0
    while done < n:
        before = done
        n_left = 0
        for place in range(n_waiting):
            i = waiting[place]
            if half_links.degrees[i] > limit:
                waiting[n_left] = i
                n_left += 1
                continue
            m = _take_list(i, half_links, gone, slots, star)
            pivot = leaks[i]
            for q in range(m):
                pivot += star.weights[q]
            gone[i] = True
            order[done] = i
            pivots[done] = pivot
            if starts[done] + m > rows.shape[0]:
                rows = doubled(rows)
                factors = doubled(factors)
            for q in range(m):
                rows[starts[done] + q] = star.nodes[q]
                factors[starts[done] + q] = star.weights[q] / pivot
            done += 1
            starts[done] = starts[done - 1] + m
            if leaks[i] > 0.0:
                star.nodes[m] = _GROUND
                star.weights[m] = leaks[i]
                m += 1
            half_links = _with_room(half_links, 2 * m)
            kept = _with_room_to_keep(kept, m)
            _sample_fill(star, m, pivot, half_links, leaks, kept, random)
        n_waiting = n_left
        if done - before < 0.3 * (n - before):
            limit += max(1, limit // 2)
            star = _star(limit)
    fill = starts[n]
    count = kept.number[0]
    return Elimination(
        order, starts, rows[:fill].copy(), factors[:fill].copy(), pivots,
        kept.pairs[:count].copy(), kept.weights[:count].copy(), leaks[n:].copy(),
    )  # fmt: skip


@helper
def _in_lists(network, n, records):
    """The links of the first n nodes in lists."""
    starts, columns, links, _ = network
    heads = np.full(n, -1, np.int32)
    degrees = np.zeros(n, np.int32)
    used = 0
    for i in range(n):
        for k in range(starts[i], starts[i + 1]):
            records[used].following = heads[i]
            records[used].other = columns[k]
            records[used].weight = links[k]
            heads[i] = used
            used += 1
            degrees[i] += 1
    return HalfLinks(records, heads, degrees, np.array([used, -1, 0]))


@helper
def _star(limit):
    """Room for the neighbours of a node of so many half-links, and the ground."""
    return Star(np.empty(limit + 1, np.int32), np.empty(limit + 1), np.empty(limit + 1))


# The steps for one node are inlined: numba would count references to all the arrays at every call, which takes longer.


@helper(inline="always")
def _take_list(i, half_links, gone, slots, star):
    """Gather the neighbours of node i that are left, parallel links added up, and free its list; returns their number.

    `gone` (m,) bool marks the nodes that are eliminated. `slots` (m,) int32, -1 before and after, are the places of
    nodes in the star.
    """
    records, heads, degrees, counts = half_links
    m = 0
    link = heads[i]
    while link >= 0:
        j = records[link].other
        if not gone[j]:
            if slots[j] >= 0:
                star.weights[slots[j]] += records[link].weight
            else:
                slots[j] = m
                star.nodes[m] = j
                star.weights[m] = records[link].weight
                m += 1
            if j < degrees.shape[0]:
                degrees[j] -= 1
        following = records[link].following
        records[link].following = counts[_FIRST_FREE]
        counts[_FIRST_FREE] = link
        counts[_FREE] += 1
        link = following
    for q in range(m):
        slots[star.nodes[q]] = -1
    return m


@helper(error_model="numpy", inline="always")
def _sample_fill(star, m, pivot, half_links, leaks, kept, random):
    """Link each of m neighbours, the weakest first, to one of those with larger weights.

    Neighbour q is linked to one of them with probability in proportion to the weights, by a link of weight
    w_q Σ w / pivot; the sum is over those with larger weights. The mean of these links is the clique.
    """
    nodes, weights, beyond = star
    _sort_by_weight(star, m)
    beyond[m - 1] = 0.0
    for q in range(m - 2, -1, -1):
        beyond[q] = beyond[q + 1] + weights[q + 1]
    for q in range(m - 1):
        aim = uniform(random) * beyond[q]
        p = q + 1
        passed = weights[p]
        while passed < aim and p < m - 1:
            p += 1
            passed += weights[p]
        _add_link(nodes[q], nodes[p], weights[q] * beyond[q] / pivot, half_links, leaks, kept)


@helper(inline="always")
def _sort_by_weight(star, m):
    """Sort the m neighbours of a star, the smallest weight first, by insertion."""
    nodes, weights, _ = star
    for q in range(1, m):
        weight = weights[q]
        node = nodes[q]
        p = q
        while p > 0 and weights[p - 1] > weight:
            weights[p] = weights[p - 1]
            nodes[p] = nodes[p - 1]
            p -= 1
        weights[p] = weight
        nodes[p] = node


@helper(inline="always")
def _add_link(a, b, weight, half_links, leaks, kept):
    """Add a link between two nodes, or a node and the ground."""
    n = half_links.heads.shape[0]
    if a == _GROUND:
        leaks[b] += weight
    elif b == _GROUND:
        leaks[a] += weight
    elif a >= n and b >= n:
        k = kept.number[0]
        kept.pairs[k, 0] = a
        kept.pairs[k, 1] = b
        kept.weights[k] = weight
        kept.number[0] += 1
    else:
        if a < n:
            _add_half_link(a, b, weight, half_links)
        if b < n:
            _add_half_link(b, a, weight, half_links)


@helper(inline="always")
def _add_half_link(i, other, weight, half_links):
    """Put a half-link to another node at the head of the list of node i."""
    records, heads, degrees, counts = half_links
    link = counts[_FIRST_FREE]
    if link >= 0:
        counts[_FIRST_FREE] = records[link].following
        counts[_FREE] -= 1
    else:
        link = counts[_USED]
        counts[_USED] += 1
    records[link].following = heads[i]
    records[link].other = other
    records[link].weight = weight
    heads[i] = link
    degrees[i] += 1


@helper
def _with_room(half_links, more):
    """The half-links with room for so many more."""
    records, heads, degrees, counts = half_links
    if counts[_USED] + more - counts[_FREE] <= records.shape[0]:
        return half_links
    return HalfLinks(doubled(records), heads, degrees, counts)


@helper
def _with_room_to_keep(kept, more):
    """The kept links with room for so many more."""
    pairs, weights, number = kept
    if number[0] + more <= weights.shape[0]:
        return kept
    room = max(2 * weights.shape[0], number[0] + more)
    larger = KeptLinks(np.empty((room, 2), np.int32), np.empty(room), number)
    for k in range(number[0]):
        larger.pairs[k, 0] = pairs[k, 0]
        larger.pairs[k, 1] = pairs[k, 1]
        larger.weights[k] = weights[k]
    return larger
