"""Conjugate gradients on a network, in fused kernels, judged by the flow that the nodes fail to conserve.

Sums run over blocks of fixed size, so that results do not depend on the number of threads.
"""

from __future__ import annotations

import numpy as np
from numba import njit, prange

from porefv.approximate_cholesky import ApproximateCholesky
from porefv.network import Network

_BLOCK = 16384
_MAX_ITERATIONS = 500


def imbalance(network: Network, rhs: np.ndarray, x: np.ndarray) -> tuple[float, float, float]:
    """Σ|b - A x|, the flow through the network, and the rounding of the first.

    The flow is half of all that enters or leaves; Σ ε d|x| is what rounding x to double precision alone may lose.
    """
    lost = float(np.abs(network.residual(rhs, x)).sum())
    flow = 0.5 * float(np.abs(network.leaks * x - rhs).sum())
    return lost, flow, float(np.finfo(float).eps * (network.diagonal * np.abs(x)).sum())


def conjugate_gradients(
    network: Network, rhs: np.ndarray, preconditioner: ApproximateCholesky, tolerance: float
) -> tuple[np.ndarray, int]:
    """Iterate until Σ|b - A x| is below `tolerance` times the flow, or rounding allows no better.

    Returns
    -------
    x (n,), number of iterations
    """
    a = network
    x = np.zeros(len(a))
    r = rhs.copy()
    iterations = 0
    before = np.inf
    while True:
        # (Re)start from the true residual: the recurrence drifts from it by rounding.
        lost, flow, floor = imbalance(a, rhs, x)
        if lost <= max(tolerance * flow, floor) or lost > 0.5 * before or iterations >= _MAX_ITERATIONS:
            return x, iterations
        before = lost
        r = a.residual(rhs, x)
        z, rz = preconditioner.apply(r)
        p = z.copy()
        ap = np.empty(len(a))
        while iterations < _MAX_ITERATIONS:
            iterations += 1
            alpha = rz / _multiply(a.starts, a.columns, a.links, a.leaks, p, ap)
            lost, flow, size = _advance(x, r, p, ap, alpha, a.leaks, a.diagonal, rhs)
            if lost <= 0.5 * max(tolerance * 0.5 * flow, np.finfo(float).eps * size):
                break
            z, new = preconditioner.apply(r)
            if not new > 0.0:
                break
            p *= new / rz
            p += z
            rz = new


@njit(cache=True, parallel=True)
def _multiply(starts, columns, links, leaks, p, ap):
    """ap = A p; returns p·ap."""
    n = p.shape[0]
    parts = np.zeros((n + _BLOCK - 1) // _BLOCK)
    for block in prange(parts.shape[0]):
        total = 0.0
        for i in range(block * _BLOCK, min(block * _BLOCK + _BLOCK, n)):
            s = leaks[i] * p[i]
            for k in range(starts[i], starts[i + 1]):
                s += links[k] * (p[i] - p[columns[k]])
            ap[i] = s
            total += s * p[i]
        parts[block] = total
    return parts.sum()


@njit(cache=True, parallel=True)
def _advance(x, r, p, ap, alpha, leaks, diagonal, rhs):
    """x += α p, r -= α ap; returns Σ|r|, Σ|e x - b| and Σ d|x|."""
    n = p.shape[0]
    n_blocks = (n + _BLOCK - 1) // _BLOCK
    lost = np.zeros(n_blocks)
    flow = np.zeros(n_blocks)
    size = np.zeros(n_blocks)
    for block in prange(n_blocks):
        for i in range(block * _BLOCK, min(block * _BLOCK + _BLOCK, n)):
            x[i] += alpha * p[i]
            r[i] -= alpha * ap[i]
            lost[block] += abs(r[i])
            flow[block] += abs(leaks[i] * x[i] - rhs[i])
            size[block] += diagonal[i] * abs(x[i])
    return lost.sum(), flow.sum(), size.sum()
