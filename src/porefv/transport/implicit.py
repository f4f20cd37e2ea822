"""The linear equations of a solute in the pores: (storage + losses) c - upwind advection - diffusion = rhs."""

from __future__ import annotations

from functools import cached_property
from typing import Any

import numpy as np
from scipy import sparse
from scipy.sparse.linalg import splu

from porefv.errors import ComputationError
from porefv.solvers.approximate_cholesky import ApproximateCholesky
from porefv.solvers.network import Network
from porefv.transport.flow_order import Upstream, sweep
from porefv.transport.incomplete_factor import Rows, bicgstab, factored, rows_of, solve_factors

# Up to so many pores the matrix is factored; beyond, BiCGStab with an incomplete factor costs less.
FACTOR_LIMIT = 20_000
TOLERANCE = 5e-15
TOLERANCE_OF_MANY = 1e-13  # beyond FACTOR_LIMIT
# Iterations of one correction. What it may leave of the imbalance is not asked to be smaller than this part: the
# residual is computed anew for the next.
_ITERATIONS = 200
# Where the factor in the order of the flow takes more iterations than these, diffusion is strong, and the approximate
# Cholesky factor of the symmetric part takes fewer (benchmarks/transport.py).
_MANY = 12
_LEAST_PART = 1e-9
_CORRECTIONS = 20
_EPSILON = float(np.finfo(float).eps)


class Implicit:
    """The equations of one step, made ready once for as many right-hand sides as there are.

    Parameters
    ----------
    upstream : Upstream
    diagonal : (n,) array
        What c of each pore loses, without diffusion: storage, flow and reaction; positive [m³/s].
    pairs : (t, 2) int array
    diffusion : (t,) array
        D g of each throat; zero for pure advection, whose equations one sweep in the order of the flow solves [m³/s].
    tolerance : float
        Largest Σ|b - A c| relative to Σ|b|; what rounding alone may leave is allowed.
    """

    def __init__(
        self, upstream: Upstream, diagonal: np.ndarray, pairs: np.ndarray, diffusion: np.ndarray, tolerance: float
    ):
        self._upstream, self._pairs, self._diffusion, self._tolerance = upstream, pairs, diffusion, tolerance
        self._diagonal = diagonal
        self._diffusive = False

    def solve(self, rhs: np.ndarray, guess: np.ndarray) -> np.ndarray:
        """c (n,) of the right-hand side (n,).

        Raises
        ------
        ComputationError
            If the tolerance is not reached.
        """
        if not self._diffusion.any():
            found = np.empty(len(rhs))
            sweep(self._upstream, self._diagonal, rhs, found)
            return found
        tolerance = max(self._tolerance, TOLERANCE_OF_MANY if len(rhs) > FACTOR_LIMIT else 0.0)
        allowed = tolerance * float(np.abs(rhs).sum())
        x, lost, before = guess, np.inf, np.inf
        for _ in range(_CORRECTIONS):
            r = rhs - self._matrix @ x
            lost = float(np.abs(r).sum())
            rounding = 2.0 * _EPSILON * float((self._sizes @ np.abs(x)).sum() + np.abs(rhs).sum())
            if lost <= max(allowed, rounding):
                return x
            if not lost < 0.9 * before:
                break
            before = lost
            x = x + self._correction(r, max(allowed, rounding))
        raise ComputationError(
            f"the concentrations leave {lost:.1e} mol/s out of balance, and {allowed:.1e} mol/s are allowed; "
            "try smaller time steps"
        )

    def _correction(self, r: np.ndarray, allowed: float) -> np.ndarray:
        if len(r) <= FACTOR_LIMIT:
            return self._factor.solve(r)
        order = self._upstream.order
        part = max(0.3 * allowed / float(np.abs(r).sum()), _LEAST_PART)
        found = np.empty(len(r))
        inverse = self._symmetric.apply if self._diffusive else self._in_order_of_flow
        found[order], iterations = bicgstab(self._rows, inverse, r[order], part, _ITERATIONS)
        self._diffusive = self._diffusive or iterations > _MANY
        return found

    def _in_order_of_flow(self, b: np.ndarray, x: np.ndarray) -> None:
        solve_factors(self._incomplete, b, x)

    @cached_property
    def _symmetric(self) -> ApproximateCholesky:
        """The factor of (A + Aᵀ) / 2, in the order of the flow."""
        n, up = len(self._diagonal), self._upstream
        number = np.empty(n, np.int32)
        number[up.order] = np.arange(n, dtype=np.int32)
        fed = np.repeat(np.arange(n), np.diff(up.starts))
        carried, half = np.stack([fed, up.pores], axis=1), 0.5 * up.fluxes
        leaks = self._diagonal - np.bincount(fed, half, n) - np.bincount(up.pores, half, n)
        pairs = np.concatenate([number[self._pairs], number[carried]])
        weights = np.concatenate([self._diffusion, half])
        return ApproximateCholesky.of(Network.from_links(pairs, weights, np.maximum(leaks, 0.0)[up.order]))

    @cached_property
    def _matrix(self) -> Any:
        n, up, (i, j) = len(self._diagonal), self._upstream, self._pairs.T
        own = self._diagonal + np.bincount(i, self._diffusion, n) + np.bincount(j, self._diffusion, n)
        places = np.arange(n)
        rows = np.concatenate([places, np.repeat(places, np.diff(up.starts)), i, j])
        columns = np.concatenate([places, up.pores, j, i])
        values = np.concatenate([own, -up.fluxes, -self._diffusion, -self._diffusion])
        return sparse.csr_array(sparse.coo_array((values, (rows, columns)), shape=(n, n)))

    @cached_property
    def _rows(self) -> Rows:
        """The matrix in the order of the flow."""
        order = self._upstream.order
        return rows_of(sparse.csr_array(self._matrix[order][:, order]))

    @cached_property
    def _incomplete(self) -> Rows:
        return factored(self._rows)

    @cached_property
    def _sizes(self) -> Any:
        return abs(self._matrix)

    @cached_property
    def _factor(self) -> Any:
        return splu(
            self._matrix.tocsc(), permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options={"SymmetricMode": True}
        )
