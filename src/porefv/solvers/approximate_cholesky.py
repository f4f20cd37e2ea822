"""Approximate Cholesky factor of a network, by elimination with sampled fill.

Eliminating a node joins all its neighbours to each other. Instead of that clique a random graph with the same mean
is added: the three most strongly joined neighbours are linked as in the clique, every other one to one of those more
strongly joined, with probability in proportion to their links. (A tree, in which only the last two are linked as in
the clique, has a third more iterations.)
The factor stays nearly as sparse as the network, for any geometry, size and contrast, and as a preconditioner takes
conjugate gradients to convergence in a number of steps that hardly depends on them (Kyng and Sachdeva 2016,
doi:10.1109/FOCS.2016.68; Gao, Kyng and Spielman 2023, arXiv:2303.00709).

Large networks are cut into parts along their numbering, which the mesh lays along a space-filling curve. The inner
nodes of all parts are eliminated side by side, then the separator between them. The cut depends on the size alone
and the random numbers are seeded: equal networks have equal factors, on any number of threads.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from porefv.errors import ComputationError
from porefv.solvers.elimination import Elimination, eliminated
from porefv.solvers.network import Network
from porefv.solvers.network_parts import NetworkPart, links_of_separator, part_of_network, separator_numbers
from porefv.solvers.substitution import Factor, add_outer, backward, forward, substitute, substitute_separator
from porefv.system.threads import for_each

# Nodes from which two parts pay, and the size beyond which there are more of them.
_CUT_FROM = 50_000
_PART = 400_000


@dataclass(frozen=True, eq=False)
class ApproximateCholesky:
    """Preconditioner A ≈ L D Lᵀ of a network. It has room to work in: one thread at a time may apply it.

    Attributes
    ----------
    parts : list of Factor
    separator : Factor
        Its nodes are those that no part eliminates.
    """

    parts: list[Factor]
    separator: Factor

    @classmethod
    def of(cls, network: Network) -> ApproximateCholesky:
        """Factor a network, every part of which must be joined to a leak."""
        n = len(network)
        n_parts = 1 if n < _CUT_FROM else 2 * (1 + n // (2 * _PART))
        bounds = np.linspace(0, n, n_parts + 1).astype(np.int64)
        number = separator_numbers(network.rows, bounds)
        local = np.empty(n, np.int32)

        def eliminate(k: int) -> tuple[NetworkPart, Elimination]:
            part = part_of_network(network.rows, number, local, bounds[k], bounds[k + 1])
            return part, eliminated(part.rows, len(part.inner))

        pieces = for_each(eliminate, range(n_parts))
        nodes = np.flatnonzero(number >= 0).astype(np.int32)
        rest = _rest(network, number, nodes, pieces)
        last = eliminated(rest.rows, len(rest))
        inverse_pivots = np.concatenate([piece.inverse_pivots for piece in (*(piece for _, piece in pieces), last)])
        if not ((inverse_pivots > 0.0) & (inverse_pivots < np.inf)).all():
            raise ComputationError("the network is singular: a part of it is not joined to any imposed pressure")

        position = np.empty(len(nodes), np.uint32)
        position[last.order] = np.arange(len(nodes), dtype=np.uint32)
        parts = [_factor(piece, part.inner, position[number[part.outer]]) for part, piece in pieces]
        return cls(parts, _factor(last, nodes, position[:0]))

    def apply(self, r: np.ndarray, z: np.ndarray) -> float:
        """z = (L D Lᵀ)⁻¹ r, (n,); returns r·z."""
        if len(self.parts) == 1:
            return substitute(self.parts[0], r, z)
        for_each(lambda part: forward(part, r), self.parts)
        self.separator.y[:] = 0.0
        for part in self.parts:
            add_outer(part, self.separator)
        product = substitute_separator(self.separator, r, z)
        return product + sum(for_each(lambda part: backward(part, self.separator, r, z), self.parts))


def _factor(piece: Elimination, nodes: np.ndarray, outer: np.ndarray) -> Factor:
    """The factor of a part or of the separator, whose nodes are those of the network at `nodes`."""
    order = nodes[piece.order].astype(np.uint32)
    y = np.empty(len(order) + len(outer))
    return Factor(order, piece.starts, piece.rows, piece.factors, piece.inverse_pivots, y, outer)


def _rest(
    network: Network, number: np.ndarray, nodes: np.ndarray, pieces: list[tuple[NetworkPart, Elimination]]
) -> Network:
    """What the parts leave: the nodes of the separator, by `number`, with their links, given and filled in."""
    leaks = network.leaks[nodes]
    links = [links_of_separator(network.rows, number, nodes)]
    for part, piece in pieces:
        outer = number[part.outer]
        leaks[outer] += piece.leaks
        links.append((outer[piece.pairs], piece.weights))
    pairs, weights = (np.concatenate(arrays) for arrays in zip(*links, strict=True))
    return Network.from_links(pairs, weights, leaks)
