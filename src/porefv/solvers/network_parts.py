"""Parts of a network, and the separator between them: the nodes that are linked to a later part."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from porefv.solvers.network import NetworkRows
from porefv.system.kernels import kernel


class NetworkPart(NamedTuple):
    """One part as a network of its own, of k inner nodes and the l nodes of the separator next to them.

    Attributes
    ----------
    inner, outer : (k,), (l,) int32 arrays
        Nodes of the whole network.
    rows : NetworkRows
        Rows of the inner nodes; their columns and the leaks count the inner nodes, then the outer ones. The outer nodes
        have no leaks.
    """

    inner: np.ndarray
    outer: np.ndarray
    rows: NetworkRows


@kernel
def separator_numbers(network, bounds):
    """(n,): number of each node in the separator, -1 outside; part p has the nodes bounds[p] ... bounds[p + 1] - 1."""
    starts, columns = network.starts, network.columns
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


@kernel
def part_of_network(network, separator, local, first, last):
    """The part of the nodes first ... last - 1; `local` (n,) is given, for the numbers of the inner nodes in it.

    Parameters
    ----------
    network : NetworkRows
    separator : (n,) int array
        Number of each node in the separator, negative for nodes of parts.
    local : (n,) int array
        To fill, with the number of each inner node within the part.
    first, last : int
        The part has the nodes first ... last - 1.
    """
    starts, columns, links, leaks = network
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
    largest = -1
    for i in range(separator.shape[0]):
        largest = max(largest, separator[i])
    seen = np.full(largest + 1, -1, np.int32)
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
    rows = NetworkRows(new_starts, new_columns, new_links, new_leaks)
    return NetworkPart(inner[:n_inner].copy(), outer[:n_outer].copy(), rows)


@kernel
def links_of_separator(network, separator, nodes):
    """Links (m, 2), (m,) between the nodes of the separator, in its numbering."""
    starts, columns, links, _ = network
    room = 0
    for a in range(nodes.shape[0]):
        room += starts[nodes[a] + 1] - starts[nodes[a]]
    pairs = np.empty((room, 2), np.int32)
    weights = np.empty(room)
    count = 0
    for a in range(nodes.shape[0]):
        for k in range(starts[nodes[a]], starts[nodes[a] + 1]):
            b = separator[columns[k]]
            if b > a:
                pairs[count, 0] = a
                pairs[count, 1] = b
                weights[count] = links[k]
                count += 1
    return pairs[:count].copy(), weights[:count].copy()
