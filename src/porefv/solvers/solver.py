"""Solvers of the pressure equation behind one interface, chosen by the number of unknowns and of right-hand sides."""

from __future__ import annotations

import time
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from porefv.errors import ComputationError, InputError
from porefv.solvers.approximate_cholesky import ApproximateCholesky
from porefv.solvers.conjugate_gradients import conjugate_gradients, imbalance, refined
from porefv.solvers.direct import DirectFactor
from porefv.solvers.network import Network

SOLVERS = ("auto", "direct", "cg")

# What all pores together may fail to conserve, relative to the flow.
TOLERANCE = 1e-10

# Largest error of a pressure, relative to the range of those imposed, or the tolerance where that is larger: pores
# behind a nearly closed throat have such errors.
PRESSURE_TOLERANCE = 1e-8

# Up to so many unknowns a factorisation costs no more than the iterations it saves, over one solution and over many
# (benchmarks/solvers.py).
DIRECT_LIMIT = 2_000
DIRECT_LIMIT_MANY = 20_000


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
    pressure_error : float
        Estimate of the largest error of a pressure, relative to the range of the held ones; NaN where not asked for.

    Notes
    -----
    Theory, method: :eq:`eq-imbalance`.
    """

    name: str
    unknowns: int
    iterations: int
    tolerance: float
    imbalance: float
    floor: float
    seconds: float
    pressure_error: float = float("nan")


@dataclass(frozen=True)
class SplitSolution:
    """Pressures (n,) as sums of two doubles, so that the flow through the stiffest throat is in their differences."""

    pressure: np.ndarray
    rest: np.ndarray
    report: SolverReport


class Solver:
    """A network made ready to be solved, for one right-hand side or for many.

    Parameters
    ----------
    network : Network
        Every part of it must be joined to a leak.
    solver : {'auto', 'direct', 'cg'}
        `direct`: sparse factorisation (SuperLU, minimum degree). `cg`: conjugate gradients with an approximate
        Cholesky factor. `auto`: `direct` up to `DIRECT_LIMIT` unknowns, or `DIRECT_LIMIT_MANY` with `many`; else `cg`.
    many : bool
        Whether the network will be solved for many right-hand sides.

    Attributes
    ----------
    name : str
        The solver used, `auto` resolved.

    Raises
    ------
    InputError
        For an unknown solver.
    """

    def __init__(self, network: Network, solver: str = "auto", *, many: bool = False):
        if solver not in SOLVERS:
            raise InputError(f"unknown solver {solver!r}; known: {', '.join(SOLVERS)}")
        asked = solver
        if solver == "auto":
            solver = "direct" if len(network) <= (DIRECT_LIMIT_MANY if many else DIRECT_LIMIT) else "cg"
        self.network = network
        self.name = solver
        self._may_fall_back = asked == "auto" and solver != "cg"

    @cached_property
    def _fallback(self) -> Solver | None:
        return Solver(self.network, "cg") if self._may_fall_back else None

    @cached_property
    def _factor(self) -> DirectFactor | ApproximateCholesky:
        return DirectFactor(self.network) if self.name == "direct" else ApproximateCholesky.of(self.network)

    def solve(
        self, rhs: np.ndarray, tolerance: float = TOLERANCE, guess: np.ndarray | None = None
    ) -> tuple[np.ndarray, SolverReport]:
        """Solve A x = b. The first call makes the factor.

        Parameters
        ----------
        rhs : (n,) array
            Flux into each node: held pressures times their links, and sources [m³/s].
        tolerance : float
            Bound on the imbalance (see `SolverReport`). Where rounding does not allow it, its floor counts.
        guess : (n,) array, optional
            Where iterations start, zero by default.

        Raises
        ------
        InputError
            For a tolerance that is not in (0, 1).
        ComputationError
            If the network is singular, or the tolerance not reached.
        """
        if not 0.0 < tolerance < 1.0:
            raise InputError(f"the solver's tolerance must lie between 0 and 1, not {tolerance!r}")
        begin = time.perf_counter()
        n = len(self.network)
        if not rhs.any():
            return np.zeros(n), SolverReport(self.name, n, 0, tolerance, 0.0, 0.0, time.perf_counter() - begin)
        if isinstance(self._factor, DirectFactor):
            x, iterations = self._factor.solve(rhs, tolerance)
        else:
            x, iterations = conjugate_gradients(self.network, rhs, self._factor, tolerance, guess)
        lost, flow, floor = imbalance(self.network, rhs, x)
        if floor > flow:
            if _driven(self.network, rhs):
                raise ComputationError(
                    "conductances differ by too many decades for double precision: rounding alone would lose as much "
                    "as flows; leave out spheres that are much smaller than the rest"
                )
            flow, lost, floor = 1.0, 0.0, 0.0  # equal pressures: nothing flows but what rounding makes
        reached = lost / flow
        floor = floor / flow
        report = SolverReport(self.name, n, iterations, tolerance, reached, floor, time.perf_counter() - begin)
        if not reached <= max(tolerance, floor):
            raise ComputationError(
                f"the {self.name} solver stopped at a flux imbalance of {reached:.1e} after {iterations} iterations "
                f"(asked: {tolerance:.1e}); try solver = 'direct' or a larger tolerance"
            )
        return x, report

    def solve_split(
        self, held: np.ndarray, sources: np.ndarray, tolerance: float = TOLERANCE, drive: float | None = None
    ) -> SplitSolution:
        """Solve A x = leaks held + sources to the tolerance, however far apart conductances are.

        Where rounding of its factor leaves `direct` short of that, `auto` goes on with `cg`.

        Parameters
        ----------
        held : (n,) array
            Pressure that each node's leaks lead to [Pa].
        sources : (n,) array
            Volume injected into each node per unit time [m³/s].
        tolerance : float
            See `solve`.
        drive : float, optional
            What the error of pressures is measured against; by default the range of the held ones, where nothing else
            drives the flow [Pa].

        Raises
        ------
        InputError, ComputationError
            As `solve`; also if pressures cannot be told to `PRESSURE_TOLERANCE` of their range.
        """
        if not 0.0 < tolerance < 1.0:
            raise InputError(f"the solver's tolerance must lie between 0 and 1, not {tolerance!r}")
        begin = time.perf_counter()
        network, n = self.network, len(self.network)
        values = held[network.leaks > 0.0]
        span = float(np.ptp(values)) if len(values) else 0.0
        if n == 0 or (span == 0.0 and not sources.any()):  # nothing is driven
            pressure = np.full(n, values[0] if n else 0.0)
            report = SolverReport(self.name, n, 0, tolerance, 0.0, 0.0, time.perf_counter() - begin, 0.0)
            return SplitSolution(pressure, np.zeros(n), report)
        if drive is None:
            drive = span if span > 0.0 and not sources.any() else np.inf
        accuracy = max(PRESSURE_TOLERANCE, tolerance) * drive
        found = None
        for ready in (self,) if self._fallback is None else (self, self._fallback):
            name = ready.name
            try:
                factor = ready._factor
            except ComputationError:  # singular, or by rounding as good as that
                continue
            found = refined(network, held, sources, factor, tolerance, accuracy)
            if found.lost <= tolerance * found.flow and found.error <= accuracy:
                break
        if found is None:
            raise ComputationError(
                "the network is singular: a part of it is not joined to any imposed pressure, or by conductances "
                "too many decades below its own"
            )
        reached = found.lost / found.flow if found.flow > 0.0 else 0.0
        if not reached <= tolerance:
            if _driven(network, network.leaks * held + sources):
                raise ComputationError(
                    f"the {name} solver stopped at a flux imbalance of {reached:.1e} after {found.iterations} "
                    f"iterations (asked: {tolerance:.1e}): conductances differ by too many decades, leave out spheres "
                    "that are much smaller than the rest; or try another solver, or a larger tolerance"
                )
            reached = 0.0  # equal pressures: nothing flows but what rounding makes
        if not found.error <= accuracy:
            raise ComputationError(
                f"pressures are uncertain by {found.error / drive:.1e} of their range: some pores are joined to the "
                "rest by conductances too many decades below their own; leave out spheres that are much smaller than "
                "the rest"
            )
        error = found.error / drive if np.isfinite(drive) else found.error / span if span > 0.0 else float("nan")
        seconds = time.perf_counter() - begin
        report = SolverReport(name, n, found.iterations, tolerance, reached, 0.0, seconds, error)
        return SplitSolution(found.x, found.rest, report)


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
