"""Solvers of the pressure equation behind one interface."""

from __future__ import annotations

import time
from dataclasses import dataclass

import numpy as np

from porefv.approximate_cholesky import ApproximateCholesky
from porefv.conjugate_gradients import conjugate_gradients, imbalance
from porefv.errors import ComputationError, InputError
from porefv.network import Network

SOLVERS = ("auto", "direct", "cg")

# Up to this many unknowns a factorisation costs no more than the iterations it saves.
DIRECT_LIMIT = 2_000


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
    if solver == "direct":
        x, iterations = _direct(network, rhs, tolerance)
    else:
        x, iterations = conjugate_gradients(network, rhs, ApproximateCholesky.of(network), tolerance)
    lost, flow, floor = imbalance(network, rhs, x)
    if floor > flow:
        if _driven(network, rhs):
            raise ComputationError(
                "conductances differ by too many decades for double precision: rounding alone would lose as much as "
                "flows; leave out spheres that are much smaller than the rest"
            )
        flow, lost, floor = 1.0, 0.0, 0.0  # equal pressures: nothing flows but what rounding makes
    reached = lost / flow
    floor = floor / flow
    report = SolverReport(solver, n, iterations, tolerance, reached, floor, time.perf_counter() - begin)
    if not reached <= max(tolerance, floor):
        raise ComputationError(
            f"the {solver} solver stopped at a flux imbalance of {reached:.1e} after {iterations} iterations "
            f"(asked: {tolerance:.1e}); try solver = 'direct' or a larger tolerance"
        )
    return x, report


def _driven(network: Network, rhs: np.ndarray) -> bool:
    """Whether some part of the network is held at different pressures."""
    from scipy.sparse.csgraph import connected_components

    count, part = connected_components(network.to_matrix(), directed=False)
    held = np.flatnonzero(network.leaks > 0.0)
    values = rhs[held] / network.leaks[held]
    lowest, highest = np.full(count, np.inf), np.full(count, -np.inf)
    np.minimum.at(lowest, part[held], values)
    np.maximum.at(highest, part[held], values)
    return bool(np.any(highest - lowest > 1e-9 * np.abs(values).max()) or np.any(rhs[network.leaks == 0.0] != 0.0))


def _direct(network: Network, rhs: np.ndarray, tolerance: float) -> tuple[np.ndarray, int]:
    import scipy.sparse as sparse
    from scipy.sparse.linalg import splu

    # Scaled to a unit diagonal: units and contrast then do not meet the factorisation's thresholds.
    scale = sparse.diags_array(1.0 / np.sqrt(network.diagonal))
    matrix = (scale @ network.to_matrix() @ scale).tocsc()
    try:
        factor = splu(matrix, permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options={"SymmetricMode": True})
    except RuntimeError:
        raise ComputationError("the network is singular: a part of it is not joined to any imposed pressure") from None
    x = scale @ factor.solve(scale @ rhs)
    refinements = 0
    while refinements < 3:
        refinements += 1
        lost, flow, floor = imbalance(network, rhs, x)
        if lost <= max(tolerance * flow, floor):
            break
        x += scale @ factor.solve(scale @ network.residual(rhs, x))
    return x, refinements
