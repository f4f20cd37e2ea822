"""Solvers of the pressure equation behind one interface."""

from __future__ import annotations

import time
from dataclasses import dataclass

import numpy as np

from porefv.approximate_cholesky import ApproximateCholesky
from porefv.errors import ComputationError, InputError
from porefv.network import Network

SOLVERS = ("auto", "direct", "cg")

# Up to this many unknowns a factorisation costs no more than the iterations it saves.
DIRECT_LIMIT = 2_000
_MAX_ITERATIONS = 500


@dataclass(frozen=True)
class SolverReport:
    """How a network was solved.

    Attributes
    ----------
    name : str
        The solver used, `auto` resolved.
    unknowns, iterations : int
    tolerance : float
        Asked bound on the imbalance.
    imbalance : float
        What all nodes together fail to conserve, Σ|b - A x|, relative to the flow through the network.
    floor : float
        The least imbalance that pressures kept in double precision can be asked to have.
    seconds : float
    """

    name: str
    unknowns: int
    iterations: int
    tolerance: float
    imbalance: float
    floor: float
    seconds: float


def solve(
    network: Network, rhs: np.ndarray, solver: str = "auto", tolerance: float = 1e-12
) -> tuple[np.ndarray, SolverReport]:
    """Solve A x = b on a network.

    Parameters
    ----------
    network : Network
        Every part of it must be joined to a leak.
    rhs : (n,) array
        Flux into each node: held pressures times their links, and sources [m³/s].
    solver : {'auto', 'direct', 'cg'}
        `direct`: sparse factorisation (SuperLU, minimum degree). `cg`: conjugate gradients with an approximate
        Cholesky factor. `auto`: `direct` up to `DIRECT_LIMIT` unknowns, else `cg`.
    tolerance : float
        Bound on the imbalance (see `SolverReport`). Where rounding does not allow it, its floor counts.

    Raises
    ------
    InputError
        For an unknown solver or a tolerance that is not in (0, 1).
    ComputationError
        If the tolerance is not reached.
    """
    if solver not in SOLVERS:
        raise InputError(f"unknown solver {solver!r}; known: {', '.join(SOLVERS)}")
    if not 0.0 < tolerance < 1.0:
        raise InputError(f"the solver's tolerance must lie between 0 and 1, not {tolerance!r}")
    begin = time.perf_counter()
    n = len(network)
    if solver == "auto":
        solver = "direct" if n <= DIRECT_LIMIT else "cg"
    if not rhs.any():
        return np.zeros(n), SolverReport(solver, n, 0, tolerance, 0.0, 0.0, time.perf_counter() - begin)
    x, iterations = (_direct if solver == "direct" else _conjugate_gradients)(network, rhs, tolerance)
    flow, floor = _scales(network, rhs, x)
    lost = float(np.abs(network.residual(rhs, x)).sum())
    imbalance = lost / flow if flow > floor else 0.0
    floor = floor / flow if flow > floor else 0.0
    report = SolverReport(solver, n, iterations, tolerance, imbalance, floor, time.perf_counter() - begin)
    if not imbalance <= max(tolerance, floor):
        raise ComputationError(
            f"the {solver} solver stopped at a flux imbalance of {imbalance:.1e} after {iterations} iterations "
            f"(asked: {tolerance:.1e}); try solver = 'direct' or a larger tolerance"
        )
    return x, report


def _scales(network: Network, rhs: np.ndarray, x: np.ndarray) -> tuple[float, float]:
    """Flow through the network, half of all that enters or leaves it, and the rounding of Σ|b - A x|."""
    flow = 0.5 * float(np.abs(network.leaks * x - rhs).sum())
    return flow, np.finfo(float).eps * float(network.diagonal @ np.abs(x))


def _direct(network: Network, rhs: np.ndarray, tolerance: float) -> tuple[np.ndarray, int]:
    import scipy.sparse as sparse
    from scipy.sparse.linalg import splu

    # Scaled to a unit diagonal: units and contrast then do not meet the factorisation's thresholds.
    scale = sparse.diags_array(1.0 / np.sqrt(network.diagonal))
    matrix = (scale @ network.to_matrix() @ scale).tocsc()
    factor = splu(matrix, permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options={"SymmetricMode": True})
    x = scale @ factor.solve(scale @ rhs)
    refinements = 0
    while refinements < 3:
        refinements += 1
        flow, floor = _scales(network, rhs, x)
        lost = network.residual(rhs, x)
        if np.abs(lost).sum() <= max(tolerance * flow, floor):
            break
        x += scale @ factor.solve(scale @ lost)
    return x, refinements


def _conjugate_gradients(network: Network, rhs: np.ndarray, tolerance: float) -> tuple[np.ndarray, int]:
    preconditioner = ApproximateCholesky(network)
    zero = np.zeros(len(network))
    x = zero.copy()
    iterations = 0
    while True:
        # (Re)start from the true residual: the recurrence drifts from it by rounding.
        r = network.residual(rhs, x)
        flow, floor = _scales(network, rhs, x)
        goal = max(tolerance * flow, floor)
        if (iterations and np.abs(r).sum() <= goal) or iterations >= _MAX_ITERATIONS:
            return x, iterations
        start = float(np.abs(r).sum())
        z = preconditioner.apply(r)
        p = z.copy()
        rz = float(r @ z)
        while iterations < _MAX_ITERATIONS:
            iterations += 1
            minus_ap = network.residual(zero, p)
            alpha = -rz / float(p @ minus_ap)
            x += alpha * p
            r += alpha * minus_ap
            lost = float(np.abs(r).sum())
            flow, floor = _scales(network, rhs, x)
            if lost <= 0.5 * max(tolerance * flow, floor):
                break
            z = preconditioner.apply(r)
            new = float(r @ z)
            if not new > 0.0:
                break
            p *= new / rz
            p += z
            rz = new
        if float(np.abs(network.residual(rhs, x)).sum()) >= 0.5 * start:
            return x, iterations  # restarting gains nothing any more
