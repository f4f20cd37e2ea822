"""Forward and backward substitution with an approximate Cholesky factor, in one piece or in parts side by side."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from porefv.system.kernels import helper, kernel, unsigned_range


class FactorColumns(NamedTuple):
    """A factor L D Lᵀ, column by column. Indices without sign need no look at whether they count from the end.

    Attributes
    ----------
    order : (n,) uint32 array
        Node at each position.
    starts : (n + 1,) uint32, rows : (fill,) uint32, factors : (fill,) float32 arrays
        Column k of -L below its unit diagonal has the entries starts[k] ... starts[k + 1] - 1 of `factors`, in `rows`.
    part_ends : (n,) uint32 array
        Where the entries of column k in rows of its own part end; those in rows of the separator follow.
    inverse_pivots : (n,) array
        1 / D [Pa s/m³].
    """

    order: np.ndarray
    starts: np.ndarray
    rows: np.ndarray
    factors: np.ndarray
    part_ends: np.ndarray
    inverse_pivots: np.ndarray


class FactorRows(NamedTuple):
    """The last rows of -L, row by row: entries starts[i] ... starts[i + 1] - 1 of `factors`, in `columns`.

    Attributes
    ----------
    starts : (m + 1,) int64, columns : (e,) int32, factors : (e,) float32 arrays
    """

    starts: np.ndarray
    columns: np.ndarray
    factors: np.ndarray


@kernel
def part_entries_first(starts, rows, factors, n_inner, part_ends):
    """Put the entries of each column in rows before n_inner before the others, and fill in where they end."""
    for k in range(part_ends.shape[0]):
        end = np.int64(starts[k])
        for e in range(np.int64(starts[k]), np.int64(starts[k + 1])):
            if rows[e] < n_inner:
                row, factor = rows[e], factors[e]
                for i in range(e, end, -1):
                    rows[i] = rows[i - 1]
                    factors[i] = factors[i - 1]
                rows[end] = row
                factors[end] = factor
                end += 1
        part_ends[k] = end


@kernel
def rows_from(factor, n_inner):
    """The entries of the first n_inner columns in the rows from n_inner on."""
    starts, rows, factors = factor.starts, factor.rows, factor.factors
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
            i = np.int64(rows[e]) - n_inner
            if i >= 0:
                columns[place[i]] = k
                row_factors[place[i]] = factors[e]
                place[i] += 1
    return FactorRows(row_starts, columns, row_factors)


@kernel(error_model="numpy")
def substitute(factor, r, z, y):
    """z = (L D Lᵀ)⁻¹ r, by way of y; returns r·z.

    Parameters
    ----------
    factor : named tuple of arrays
        Order of the nodes, and the columns of L and D.
    r : (n,) float64 array
        Right-hand side.
    z, y : (n,) float64 arrays
        To fill: the result, and what lies between the two substitutions.
    """
    order, starts, rows, factors, _, _ = factor
    n = order.shape[0]
    for k in range(n):
        y[k] = r[order[k]]
    for k in range(n):
        v = y[k]
        for e in range(starts[k], starts[k + 1]):
            y[rows[e]] += factors[e] * v
    return _backward(0, n, factor, r, z, y)


@kernel
def forward(first, last, factor, r, y):
    """y = L⁻¹ r within one part.

    Parameters
    ----------
    first, last : int
        The part has the positions first ... last - 1.
    factor : FactorColumns
    r : (n,) float64 array
        Right-hand side.
    y : (n,) float64 array
        To fill.
    """
    order, starts, rows, factors, part_ends, _ = factor
    for k in unsigned_range(first, last):
        y[k] = r[order[k]]
    for k in unsigned_range(first, last):
        v = y[k]
        for e in range(starts[k], part_ends[k]):
            y[rows[e]] += factors[e] * v


@kernel
def sum_separator_rows(first, last, factor, separator_rows, n_inner, r, y):
    """What the separator's nodes first ... last - 1 get from the parts, into y.

    Parameters
    ----------
    first, last : int
        Nodes to treat, counted from the start of the separator.
    factor : FactorColumns
    separator_rows : FactorRows
    n_inner : int
        Position where the separator starts.
    r : (n,) float64 array
        Right-hand side.
    y : (n,) float64 array
        Filled for the parts; to fill for the separator.
    """
    row_starts, row_columns, row_factors = separator_rows
    for i in range(first, last):
        s = r[factor.order[n_inner + i]]
        for e in range(row_starts[i], row_starts[i + 1]):
            s += row_factors[e] * y[row_columns[e]]
        y[n_inner + i] = s


@kernel(error_model="numpy")
def substitute_separator(factor, n_inner, r, z, y):
    """Both substitutions within the separator, from position n_inner on; returns its part of r·z."""
    _, starts, rows, factors, _, _ = factor
    n = y.shape[0]
    for k in range(n_inner, n):
        v = y[k]
        for e in range(starts[k], starts[k + 1]):
            y[rows[e]] += factors[e] * v
    return _backward(n_inner, n, factor, r, z, y)


@kernel(error_model="numpy")
def backward(first, last, factor, r, z, y):
    """y and z = L⁻ᵀ D⁻¹ y within one part, positions first ... last - 1; returns its part of r·z."""
    return _backward(first, last, factor, r, z, y)


@helper(error_model="numpy")
def _backward(first, last, factor, r, z, y):
    """y and z = L⁻ᵀ D⁻¹ y for positions first ... last - 1; returns their part of r·z."""
    order, starts, rows, factors, _, inverse_pivots = factor
    product = 0.0
    for k in range(last - 1, first - 1, -1):
        s = y[k] * inverse_pivots[k]
        for e in range(starts[k], starts[k + 1]):
            s += factors[e] * y[rows[e]]
        y[k] = s
        z[order[k]] = s
        product += s * r[order[k]]
    return product
