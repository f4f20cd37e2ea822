"""Conjugate gradients on a network, in fused kernels, judged by the flow that the nodes fail to conserve.

Sums run over blocks of fixed size, so that results do not depend on the number of threads.
"""

from __future__ import annotations

import numpy as np
from numba import get_num_threads, njit, prange

from porefv.approximate_cholesky import ApproximateCholesky
from porefv.network import Network
from porefv.threads import threads

_BLOCK = 16384
_MAX_ITERATIONS = 500
# Iterations between two looks at what the tolerance is measured against.
_LOOK_EVERY = 4
# Up to so many unknowns threads gain less than waiting for each other costs; on a busy machine it costs most of all.
_ALONE = 30_000


def imbalance(network: Network, rhs: np.ndarray, x: np.ndarray) -> tuple[float, float, float]:
    """Σ|b - A x|, the flow through the network, and the rounding of the first.

    The flow is half of all that enters or leaves; Σ ε d|x| is what rounding x to double precision alone may lose.
    """
    lost = float(np.abs(network.residual(rhs, x)).sum())
    return lost, *_measures(network, rhs, x)


def _measures(network, rhs, x):
    flow, size = _flow_and_size(network.leaks, network.diagonal, rhs, x)
    return 0.5 * flow, float(np.finfo(float).eps) * size


def conjugate_gradients(
    network: Network,
    rhs: np.ndarray,
    preconditioner: ApproximateCholesky,
    tolerance: float,
    guess: np.ndarray | None = None,
) -> tuple[np.ndarray, int]:
    """Iterate until Σ|b - A x| is below `tolerance` times the flow, or rounding allows no better.

    Returns
    -------
    x (n,), number of iterations
    """
    with threads(1 if len(network) <= _ALONE else get_num_threads()):
        return _iterate(network, rhs, preconditioner, tolerance, guess)


def _iterate(a, rhs, preconditioner, tolerance, guess):
    x = np.zeros(len(a)) if guess is None else guess.copy()
    z, ap, room = np.empty((3, len(a)))
    iterations = 0
    before = np.inf
    while True:
        # (Re)start from the true residual: the recurrence drifts from it by rounding.
        r = a.residual(rhs, x)
        lost = float(np.abs(r).sum())
        flow, floor = _measures(a, rhs, x)
        if lost <= max(tolerance * flow, floor) or lost > 0.5 * before or iterations >= _MAX_ITERATIONS:
            return x, iterations
        before = lost
        rz = preconditioner.apply(r, z, room)
        p = z.copy()
        enough = 0.0
        while iterations < _MAX_ITERATIONS:
            iterations += 1
            alpha = rz / _multiply(a.starts, a.columns, a.links, a.leaks, p, ap)
            lost = _advance(x, r, p, ap, alpha)
            if iterations % _LOOK_EVERY == 0:
                flow, floor = _measures(a, rhs, x)
                enough = 0.5 * max(tolerance * flow, floor)
            if lost <= enough:
                break
            new = preconditioner.apply(r, z, room)
            if not new > 0.0:
                break
            _redirect(p, z, new / rz)
            rz = new


@njit(cache=True, parallel=True)
def _flow_and_size(leaks, diagonal, rhs, x):
    """Σ|e x - b| and Σ d|x|."""
    n = x.shape[0]
    flow = np.zeros((n + _BLOCK - 1) // _BLOCK)
    size = np.zeros(flow.shape[0])
    for block in prange(flow.shape[0]):
        for i in range(block * _BLOCK, min(block * _BLOCK + _BLOCK, n)):
            flow[block] += abs(leaks[i] * x[i] - rhs[i])
            size[block] += diagonal[i] * abs(x[i])
    return flow.sum(), size.sum()


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
def _advance(x, r, p, ap, alpha):
    """x += α p, r -= α ap; returns Σ|r|."""
    n = p.shape[0]
    lost = np.zeros((n + _BLOCK - 1) // _BLOCK)
    for block in prange(lost.shape[0]):
        total = 0.0
        for i in range(block * _BLOCK, min(block * _BLOCK + _BLOCK, n)):
            x[i] += alpha * p[i]
            r[i] -= alpha * ap[i]
            total += abs(r[i])
        lost[block] = total
    return lost.sum()


@njit(cache=True, parallel=True)
def _redirect(p, z, beta):
    """p = z + β p."""
    for i in prange(p.shape[0]):
        p[i] = z[i] + beta * p[i]
