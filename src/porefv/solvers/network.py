"""Network: the pressure equation's matrix as what it is, links between free pores and leaks to held ones."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from porefv.system.kernels import kernel, read_only, unsigned_range
from porefv.system.threads import for_blocks, for_rows

if TYPE_CHECKING:
    from scipy import sparse

# Sums run over blocks of so many nodes, so that they do not depend on the number of threads.
BLOCK = 16384

_ONE = np.uint64(1)


class NetworkRows(NamedTuple):
    """A network as kernels take it, row by row: (A x)_i = e_i x_i + Σ_j w_ij (x_i - x_j).

    Attributes
    ----------
    starts : (n + 1,) int64 array
        Row i has the entries starts[i] ... starts[i + 1] - 1 of `columns` and `links`.
    columns : (e,) int32 array
        Node j at the other end of each link.
    links : (e,) array
        Weight w_ij of each link [m³/(Pa s)].
    leaks : (n,) array
        Weight e_i of each node's links to nodes outside [m³/(Pa s)].
    """

    starts: np.ndarray
    columns: np.ndarray
    links: np.ndarray
    leaks: np.ndarray


@dataclass(frozen=True, eq=False)
class Network:
    """Symmetric M-matrix A = Σ links + leaks: (A x)_i = e_i x_i + Σ_j w_ij (x_i - x_j).

    Kept as non-negative links and leaks, from which sums of any scale are formed without cancellation.

    Attributes
    ----------
    starts : (n + 1,) int64 array
        Row i holds the entries starts[i] ... starts[i + 1].
    columns : int32 array
        Node at the other end of each link; every link stands in both its rows.
    links : array
        Weight w_ij > 0 of each entry [m³/(Pa s)].
    leaks : (n,) array
        Weight e_i >= 0 of each node's links to nodes outside [m³/(Pa s)].
    diagonal : (n,) array
        e_i + Σ_j w_ij.
    """

    starts: np.ndarray
    columns: np.ndarray
    links: np.ndarray
    leaks: np.ndarray
    diagonal: np.ndarray

    @classmethod
    def from_links(
        cls, pairs: np.ndarray, weights: np.ndarray, leaks: np.ndarray, number: np.ndarray | None = None
    ) -> Network:
        """From links (t, 2), their weights (t,) and the leaks (n,) of the nodes; parallel links stay apart.

        Parameters
        ----------
        pairs : (t, 2) int array
            What each link joins: nodes, or things whose node is `number`. Links with a negative number at one end are
            left out.
        weights : (t,) float64 array
            Weight of each link; links without weight are left out [m³/(Pa s)].
        leaks : (n,) float64 array
            As the attribute of the class [m³/(Pa s)].
        number : (k,) int32 array, optional
            Node of each of the k things that `pairs` names, negative for none. By default these are the nodes.
        """
        if number is None:
            number = np.arange(len(leaks), dtype=np.int32)
        pairs, weights = read_only(pairs), read_only(weights)
        starts = np.zeros(len(leaks) + 1, np.int64)
        _count(pairs, weights, number, starts)
        np.cumsum(starts, out=starts)
        columns = np.empty(starts[-1], np.int32)
        links = np.empty(starts[-1])
        diagonal = leaks.copy()
        _fill(pairs, weights, number, starts[:-1].copy(), columns, links, diagonal)
        return cls(starts, columns, links, leaks, diagonal)

    def __len__(self) -> int:
        return len(self.leaks)

    @property
    def rows(self) -> NetworkRows:
        """The network as kernels take it."""
        return NetworkRows(self.starts, self.columns, self.links, self.leaks)

    def multiply(self, q: np.ndarray, aq: np.ndarray) -> float:
        """aq = A q, from differences of q; returns q·aq."""
        return sum(for_blocks(_multiply, len(self), BLOCK, self.rows, q, aq))

    def residual(self, rhs: np.ndarray, x: np.ndarray) -> np.ndarray:
        """b - A x, from differences of x: the imbalance of each node."""
        out = np.empty(len(self))
        for_rows(_residual, len(self), self.rows, rhs, x, out, least=BLOCK)
        return out

    def split_residual(self, held: np.ndarray, sources: np.ndarray, x: np.ndarray, rest: np.ndarray) -> np.ndarray:
        """b - A (x + rest), b = leaks held + sources: from differences of both parts of the pressures.

        Parameters
        ----------
        held : (n,) float64 array
            Pressure that each node's leaks lead to [Pa].
        sources : (n,) float64 array
            Volume injected into each node per unit time [m³/s].
        x, rest : (n,) float64 arrays
            Pressure of each node, and what rounding has left of it [Pa].

        Returns
        -------
        (n,) float64 array
            Imbalance of each node [m³/s].
        """
        out = np.empty(len(self))
        for_rows(_split_residual, len(self), self.rows, held, sources, x, rest, out, least=BLOCK)
        return out

    def to_matrix(self) -> sparse.csr_array:
        """A as a scipy matrix."""
        from scipy import sparse

        n = len(self)
        off = sparse.csr_array((-self.links, self.columns.copy(), self.starts.copy()), shape=(n, n))
        off.sum_duplicates()
        return (off + sparse.diags_array(self.diagonal)).tocsr()


@kernel
def _count(pairs, weights, number, starts):
    """Add the number of node i's links to starts[i + 1]."""
    for t in range(pairs.shape[0]):
        a = number[pairs[t, 0]]
        b = number[pairs[t, 1]]
        if a >= 0 and b >= 0 and weights[t] > 0.0:
            starts[a + 1] += 1
            starts[b + 1] += 1


@kernel
def _fill(pairs, weights, number, place, columns, links, diagonal):
    """Store every link in both its rows, from `place` on, and add it to the diagonal."""
    for t in range(pairs.shape[0]):
        a = number[pairs[t, 0]]
        b = number[pairs[t, 1]]
        if a < 0 or b < 0 or weights[t] <= 0.0:
            continue
        columns[place[a]] = b
        columns[place[b]] = a
        links[place[a]] = weights[t]
        links[place[b]] = weights[t]
        diagonal[a] += weights[t]
        diagonal[b] += weights[t]
        place[a] += 1
        place[b] += 1


# The kernels that follow are what the iteration spends its time in: without sign, indices need no look at whether they
# count from the end, and the links of a node are taken several at a time.


@kernel(fastmath={"contract"})
def _multiply(first, last, network, q, aq):
    """Rows first ... last - 1 of aq = A q; returns their part of q·aq."""
    starts, columns, links, leaks = network
    total = 0.0
    for i in unsigned_range(first, last):
        s = leaks[i] * q[i]
        for k in unsigned_range(starts[i], starts[i + _ONE]):
            s += links[k] * (q[i] - q[np.uint32(columns[k])])
        aq[i] = s
        total += s * q[i]
    return total


@kernel
def _residual(first, last, network, rhs, x, out):
    """Rows first ... last - 1 of out = b - A x."""
    starts, columns, links, leaks = network
    for i in unsigned_range(first, last):
        s = rhs[i] - leaks[i] * x[i]
        for k in unsigned_range(starts[i], starts[i + _ONE]):
            s -= links[k] * (x[i] - x[np.uint32(columns[k])])
        out[i] = s


@kernel
def _split_residual(first, last, network, held, sources, x, rest, out):
    """Rows first ... last - 1 of out = leaks held + sources - A (x + rest)."""
    starts, columns, links, leaks = network
    for i in unsigned_range(first, last):
        s = sources[i] + leaks[i] * ((held[i] - x[i]) - rest[i])
        for k in unsigned_range(starts[i], starts[i + _ONE]):
            j = np.uint32(columns[k])
            s -= links[k] * ((x[i] - x[j]) + (rest[i] - rest[j]))
        out[i] = s
