"""Network: the pressure equation's matrix as what it is, links between free pores and leaks to held ones."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numba import njit, prange

if TYPE_CHECKING:
    from scipy import sparse


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
    def from_links(cls, pairs: np.ndarray, weights: np.ndarray, leaks: np.ndarray) -> Network:
        """From links (t, 2) between nodes, their weights (t,) and the leaks (n,); parallel links stay apart."""
        return cls(*_assemble(pairs, weights, leaks))

    def __len__(self) -> int:
        return len(self.leaks)

    def residual(self, rhs: np.ndarray, x: np.ndarray) -> np.ndarray:
        """b - A x, from differences of x: the imbalance of each node."""
        out = np.empty(len(self))
        residual(self.starts, self.columns, self.links, self.leaks, rhs, x, out)
        return out

    def to_matrix(self) -> sparse.csr_array:
        """A as a scipy matrix."""
        from scipy import sparse

        n = len(self)
        off = sparse.csr_array((-self.links, self.columns.copy(), self.starts.copy()), shape=(n, n))
        off.sum_duplicates()
        return (off + sparse.diags_array(self.diagonal)).tocsr()


@njit(cache=True)
def _assemble(pairs, weights, leaks):
    n = leaks.shape[0]
    starts = np.zeros(n + 1, np.int64)
    for t in range(pairs.shape[0]):
        if weights[t] > 0.0:
            starts[pairs[t, 0] + 1] += 1
            starts[pairs[t, 1] + 1] += 1
    for i in range(n):
        starts[i + 1] += starts[i]
    columns = np.empty(starts[n], np.int32)
    links = np.empty(starts[n])
    diagonal = leaks.copy()
    place = starts[:-1].copy()
    for t in range(pairs.shape[0]):
        if weights[t] <= 0.0:
            continue
        for end in range(2):
            i = pairs[t, end]
            columns[place[i]] = pairs[t, 1 - end]
            links[place[i]] = weights[t]
            diagonal[i] += weights[t]
            place[i] += 1
    return starts, columns, links, leaks, diagonal


@njit(cache=True, parallel=True)
def residual(starts, columns, links, leaks, rhs, x, out):
    """out = b - A x."""
    for i in prange(leaks.shape[0]):
        s = rhs[i] - leaks[i] * x[i]
        for k in range(starts[i], starts[i + 1]):
            s -= links[k] * (x[i] - x[columns[k]])
        out[i] = s
