"""Forward and backward substitution with an approximate Cholesky factor, in one piece or in parts side by side."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from porefv.system.kernels import helper, kernel, unsigned_range

_ONE, _TWO, _THREE, _FOUR = np.uint32(1), np.uint32(2), np.uint32(3), np.uint32(4)


class Factor(NamedTuple):
    """A factor L D Lᵀ of n nodes that are eliminated and m - n that are not, column by column.

    Attributes
    ----------
    order : (n,) uint32 array
        Node at each position. Indices without sign need no look at whether they count from the end.
    starts : (n + 1,) uint32, rows : (fill,) uint32, factors : (fill,) float32 arrays
        Column k of -L below its unit diagonal has the entries starts[k] ... starts[k + 1] - 1 of `factors`, in `rows`,
        filled up to a multiple of four by zeros in its own row: most loops are then as long as the one before, as the
        processor expects them to be.
    inverse_pivots : (n,) array
        1 / D [Pa s/m³].
    y : (m,) array
        Room to work in: what lies between the two substitutions.
    outer : (m - n,) uint32 array
        Position in the separator of the nodes that are not eliminated.
    """

    order: np.ndarray
    starts: np.ndarray
    rows: np.ndarray
    factors: np.ndarray
    inverse_pivots: np.ndarray
    y: np.ndarray
    outer: np.ndarray


@kernel(error_model="numpy")
def substitute(factor, r, z):
    """z = (L D Lᵀ)⁻¹ r of a network in one piece; returns r·z."""
    _gather(factor, r)
    _forward(factor)
    return _backward(factor, r, z)


@kernel
def forward(part, r):
    """y = L⁻¹ r within one part; for its outer nodes, what they get from it."""
    _gather(part, r)
    y = part.y
    for k in range(part.order.shape[0], y.shape[0]):
        y[k] = 0.0
    _forward(part)


@kernel(error_model="numpy")
def substitute_separator(separator, r, z):
    """Both substitutions within the separator, whose y has what it gets from the parts; returns its part of r·z."""
    order, y = separator.order, separator.y
    for k in range(order.shape[0]):
        y[k] += r[order[k]]
    _forward(separator)
    return _backward(separator, r, z)


@kernel(error_model="numpy")
def backward(part, separator, r, z):
    """y and z = L⁻ᵀ D⁻¹ y within one part, from the y of the separator; returns its part of r·z."""
    outer, y = part.outer, part.y
    n = part.order.shape[0]
    for k in range(outer.shape[0]):
        y[n + k] = separator.y[outer[k]]
    return _backward(part, r, z)


@kernel
def add_outer(part, separator):
    """Add what a part's outer nodes get from it to the y of the separator."""
    n = part.order.shape[0]
    for k in range(part.outer.shape[0]):
        separator.y[part.outer[k]] += part.y[n + k]


@helper
def _gather(factor, r):
    order, y = factor.order, factor.y
    for k in unsigned_range(0, order.shape[0]):
        y[k] = r[order[k]]


@helper(fastmath={"contract"})
def _forward(factor):
    """y = L⁻¹ y."""
    starts, rows, factors, y = factor.starts, factor.rows, factor.factors, factor.y
    for k in unsigned_range(0, factor.order.shape[0]):
        v = y[k]
        for a in range(starts[k], starts[k + _ONE], _FOUR):
            b, c, d = a + _ONE, a + _TWO, a + _THREE
            # All four are read before one is written: the processor need not see that they differ.
            at_a = y[rows[a]] + factors[a] * v
            at_b = y[rows[b]] + factors[b] * v
            at_c = y[rows[c]] + factors[c] * v
            at_d = y[rows[d]] + factors[d] * v
            y[rows[a]], y[rows[b]], y[rows[c]], y[rows[d]] = at_a, at_b, at_c, at_d


@helper(error_model="numpy", fastmath={"contract"})
def _backward(factor, r, z):
    """y and z = L⁻ᵀ D⁻¹ y; returns r·z."""
    order, starts, rows, factors, inverse_pivots, y, _ = factor
    product = 0.0
    n = np.uint64(order.shape[0])
    for step in unsigned_range(1, n + _ONE):
        k = n - step
        s = y[k] * inverse_pivots[k]
        for a in range(starts[k], starts[k + _ONE], _FOUR):
            b, c, d = a + _ONE, a + _TWO, a + _THREE
            s += (factors[a] * y[rows[a]] + factors[b] * y[rows[b]]) + (
                factors[c] * y[rows[c]] + factors[d] * y[rows[d]]
            )
        y[k] = s
        z[order[k]] = s
        product += s * r[order[k]]
    return product
