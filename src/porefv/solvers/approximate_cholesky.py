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

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from porefv.errors import ComputationError
from porefv.solvers.elimination import Elimination, eliminated
from porefv.solvers.network import Network
from porefv.solvers.network_parts import links_of_separator, part_of_network, separator_numbers
from porefv.solvers.substitution import (
    FactorColumns,
    FactorRows,
    backward,
    forward,
    part_entries_first,
    rows_from,
    substitute,
    substitute_separator,
    sum_separator_rows,
)
from porefv.system.threads import for_each, for_rows

# Nodes from which two parts pay, and the size beyond which there are more of them.
_CUT_FROM = 50_000
_PART = 400_000


@dataclass(frozen=True, eq=False)
class ApproximateCholesky:
    """Preconditioner A ≈ L D Lᵀ of a network.

    Positions run over the inner nodes of each part in their order of elimination, then over the separator's.

    Attributes
    ----------
    parts : (p + 1,) int64 array
        Position where each part starts; the last is where the separator starts.
    columns : FactorColumns
        L and D.
    separator_rows : FactorRows
        The rows of -L in which the separator depends on the parts, so that every row can be summed by itself.
    """

    parts: np.ndarray
    columns: FactorColumns
    separator_rows: FactorRows

    @classmethod
    def of(cls, network: Network) -> ApproximateCholesky:
        """Factor a network, every part of which must be joined to a leak."""
        n = len(network)
        n_parts = 1 if n < _CUT_FROM else 2 * (1 + n // (2 * _PART))
        bounds = np.linspace(0, n, n_parts + 1).astype(np.int64)
        separator = separator_numbers(network.rows, bounds)
        local = np.empty(n, np.int32)

        def factor(k: int) -> _Piece:
            part = part_of_network(network.rows, separator, local, bounds[k], bounds[k + 1])
            return _Piece(part.inner, part.outer, eliminated(part.rows, len(part.inner)))

        pieces = for_each(factor, range(n_parts))
        pieces.append(_separator_piece(network, separator, pieces))

        pivots = np.concatenate([piece.factor.pivots for piece in pieces])
        if not (pivots > 0.0).all():
            raise ComputationError("the network is singular: a part of it is not joined to any imposed pressure")

        order = np.concatenate([piece.inner[piece.factor.order] for piece in pieces])
        position = np.empty(n, np.int32)
        position[order] = np.arange(n, dtype=np.int32)
        fills = np.cumsum([0] + [len(piece.factor.rows) for piece in pieces])
        parts = np.cumsum([0] + [len(piece.inner) for piece in pieces[:-1]])
        starts = np.concatenate(
            [piece.factor.starts[:-1] + fill for piece, fill in zip(pieces, fills, strict=False)] + [fills[-1:]]
        )
        rows = np.concatenate([position[piece.nodes[piece.factor.rows]] for piece in pieces])
        factors = np.concatenate([piece.factor.factors for piece in pieces])
        starts, rows, part_ends = starts.astype(np.uint32), rows.astype(np.uint32), np.empty(n, np.uint32)
        part_entries_first(starts, rows, factors, parts[-1] if n_parts > 1 else n, part_ends)
        columns = FactorColumns(order.astype(np.uint32), starts, rows, factors, part_ends, 1.0 / pivots)
        return cls(parts, columns, rows_from(columns, parts[-1]))

    def apply(self, r: np.ndarray, z: np.ndarray, y: np.ndarray) -> float:
        """z = (L D Lᵀ)⁻¹ r, (n,); returns r·z. `y`, (n,), is room to work in."""
        columns, inner = self.columns, int(self.parts[-1])
        if len(self.parts) == 2:
            return substitute(columns, r, z, y)
        parts = list(pairwise(self.parts.tolist()))
        for_each(lambda part: forward(*part, columns, r, y), parts)
        for_rows(sum_separator_rows, len(y) - inner, columns, self.separator_rows, inner, r, y, least=4096)
        product = substitute_separator(columns, inner, r, z, y)
        return product + sum(for_each(lambda part: backward(*part, columns, r, z, y), parts))


@dataclass(frozen=True, eq=False)
class _Piece:
    """The factor of a part, or of the separator.

    Attributes
    ----------
    inner : (k,) int32 array
        Nodes that are eliminated.
    outer : (l,) int32 array
        Nodes of the separator next to them.
    factor : Elimination
        In it, node i < k is `inner[i]`, and node k + i is `outer[i]`.
    """

    inner: np.ndarray
    outer: np.ndarray
    factor: Elimination

    @property
    def nodes(self) -> np.ndarray:
        """(k + l,): node of the network for each of the factor."""
        return np.concatenate([self.inner, self.outer])


def _separator_piece(network: Network, separator: np.ndarray, pieces: list[_Piece]) -> _Piece:
    """Factor of what the parts leave: links between nodes of the separator, given and filled in."""
    nodes = np.flatnonzero(separator >= 0).astype(np.int32)
    leaks = network.leaks[nodes]
    for piece in pieces:
        leaks[separator[piece.outer]] += piece.factor.leaks
    given_pairs, given_weights = links_of_separator(network.rows, separator, nodes)
    pairs = np.concatenate([given_pairs] + [separator[piece.nodes[piece.factor.pairs]] for piece in pieces])
    weights = np.concatenate([given_weights] + [piece.factor.weights for piece in pieces])
    rest = Network.from_links(pairs, weights, leaks)
    return _Piece(nodes, np.empty(0, np.int32), eliminated(rest.rows, len(rest)))
