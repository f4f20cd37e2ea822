"""BiCGStab with an incomplete factor without fill (ILU(0)), for matrices whose unknowns are in the order of the flow.

Where the flow carries more than diffusion does, each unknown depends on earlier ones mostly, and the factor is nearly
exact. It is exact for pairs of pores that a short throat ties together, which sweeps alone hardly bring together.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

from porefv.system.kernels import kernel


class Rows(NamedTuple):
    """A sparse matrix, or the factors L (its diagonal is 1) and U of one, row by row.

    Attributes
    ----------
    starts : (n + 1,) int64 array
    columns : (k,) int32 array
        In rising order in each row.
    values : (k,) array
        [m³/s].
    diagonal : (n,) int64 array
        Place of the diagonal's entry of each row.
    """

    starts: np.ndarray
    columns: np.ndarray
    values: np.ndarray
    diagonal: np.ndarray


def rows_of(matrix: Any) -> Rows:
    """The rows of a scipy matrix (n, n) in CSR, each with an entry on the diagonal."""
    matrix.sort_indices()
    rows = np.repeat(np.arange(matrix.shape[0]), np.diff(matrix.indptr))
    diagonal = np.flatnonzero(matrix.indices == rows)
    return Rows(matrix.indptr.astype(np.int64), matrix.indices.astype(np.int32), matrix.data, diagonal)


def factored(rows: Rows) -> Rows:
    """L and U of a matrix, with entries where it has some and nowhere else (Meijerink and van der Vorst 1977)."""
    factors = rows._replace(values=rows.values.copy())
    factor_in_place(factors)
    return factors


@kernel(error_model="numpy")
def factor_in_place(rows):
    """Replace a matrix by its incomplete factors."""
    starts, columns, values, diagonal = rows
    n = diagonal.shape[0]
    place = np.full(n, -1)
    for i in range(n):
        for k in range(starts[i], starts[i + 1]):
            place[columns[k]] = k
        for k in range(starts[i], diagonal[i]):
            j = columns[k]
            values[k] /= values[diagonal[j]]
            for m in range(diagonal[j] + 1, starts[j + 1]):
                at = place[columns[m]]
                if at >= 0:
                    values[at] -= values[k] * values[m]
        for k in range(starts[i], starts[i + 1]):
            place[columns[k]] = -1


@kernel(error_model="numpy")
def solve_factors(rows, b, x):
    """Fill in x (n,) of L U x = b."""
    starts, columns, values, diagonal = rows
    n = diagonal.shape[0]
    for i in range(n):
        total = b[i]
        for k in range(starts[i], diagonal[i]):
            total -= values[k] * x[columns[k]]
        x[i] = total
    for i in range(n - 1, -1, -1):
        total = x[i]
        for k in range(diagonal[i] + 1, starts[i + 1]):
            total -= values[k] * x[columns[k]]
        x[i] = total / values[diagonal[i]]


@kernel
def multiply(rows, x, out):
    """Fill in A x (n,)."""
    starts, columns, values, _ = rows
    for i in range(out.shape[0]):
        total = 0.0
        for k in range(starts[i], starts[i + 1]):
            total += values[k] * x[columns[k]]
        out[i] = total


def bicgstab(
    rows: Rows, inverse: Callable[[np.ndarray, np.ndarray], object], r: np.ndarray, part: float, limit: int
) -> tuple[np.ndarray, int]:
    """x (n,) with |r - A x|₂ below a part of |r|₂, or the best that was found, and the number of iterations.

    Preconditioned from the right (van der Vorst 1992): the residual is that of A. inverse(b, x) fills in x with what is
    nearly A⁻¹ b.
    """
    n = len(r)
    x, shadow, p = np.zeros(n), r.copy(), r.copy()
    residual = r.copy()
    best, least = x.copy(), float(np.sqrt(_dot(r, r)))
    enough = part * least
    rho = _dot(shadow, residual)
    v, t, ahead, side = np.empty((4, n))
    for iteration in range(1, limit + 1):
        inverse(p, ahead)
        multiply(rows, ahead, v)
        alpha = rho / _dot(shadow, v)
        residual -= alpha * v
        x += alpha * ahead
        inverse(residual, side)
        multiply(rows, side, t)
        omega = _dot(t, residual) / _dot(t, t)
        x += omega * side
        residual -= omega * t
        size = float(np.sqrt(_dot(residual, residual)))
        if not np.isfinite(size):
            return best, iteration
        if size < least:
            best, least = x.copy(), size
        if size <= enough:
            return x, iteration
        before, rho = rho, _dot(shadow, residual)
        if rho == 0.0 or omega == 0.0:
            return best, iteration
        p = residual + (rho / before * alpha / omega) * (p - omega * v)
    return best, limit


@kernel
def _dot(a, b):
    total = 0.0
    for i in range(a.shape[0]):
        total += a[i] * b[i]
    return total
