"""The pressure equation: Σ_j K_ij (p_i - p_j) = source, on the network of pores and throats (C12 eq. 20)."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from porefv.errors import ComputationError
from porefv.solvers.network import Network
from porefv.solvers.solver import TOLERANCE, Solver, SolverReport
from porefv.system.kernels import kernel, read_only
from porefv.system.union_find import join


@dataclass(frozen=True)
class NetworkSolution:
    """Pressures of all pores.

    Attributes
    ----------
    pressure : (n_pores,) array
        Pressure of each pore [Pa].
    isolated : (n_pores,) bool array
        Pores from which no flow reaches a pore of imposed pressure.
    report : SolverReport
    rest : (n_pores,) array
        What rounding has left of each pressure: differences of `pressure` plus those of `rest` drive the fluxes [Pa].
    """

    pressure: np.ndarray
    isolated: np.ndarray
    report: SolverReport
    rest: np.ndarray


def solve_network(
    pairs: np.ndarray,
    conductances: np.ndarray,
    fixed: np.ndarray,
    *,
    links: Callable[[], np.ndarray] | None = None,
    sources: np.ndarray | None = None,
    solver: str = "auto",
    tolerance: float = TOLERANCE,
) -> NetworkSolution:
    """Solve for the pressures of the pores that are not fixed.

    Where no flowing path joins two different imposed pressures, each part of the network that has no source takes its
    imposed pressure exactly, so that nothing flows in it.

    Parameters
    ----------
    pairs : (t, 2) int array
        Pores joined by each throat.
    conductances : (t,) array
        K of each throat, not negative [m³/(Pa s)].
    fixed : (n_pores,) array
        Imposed pressures, NaN where free [Pa].
    links : function, optional
        Returns positive weights (t,), by which pores without any flowing path to an imposed pressure take theirs from
        their neighbours (equal weights by default); called only if there are such. Nothing flows there: the rule
        only keeps their pressure, which the flow leaves open, within that of their surroundings.
    sources : (n_pores,) array, optional
        Volume injected into each free pore per unit time [m³/s].
    solver, tolerance
        See `porefv.solvers.solver.Solver`.

    Raises
    ------
    ComputationError
        If no pore is fixed, an isolated pore has a source, or the solver fails.
    """
    n = len(fixed)
    free = np.isnan(fixed)
    if free.all():
        raise ComputationError("no pore has an imposed pressure: pressures are defined only up to a constant")
    sources = np.zeros(n) if sources is None else sources
    parts = joined_parts(pairs, conductances, n)
    lowest, highest = pressures_of_parts(parts, fixed)
    isolated = lowest > highest
    if np.any(sources[isolated] != 0.0):
        pore = int(np.flatnonzero(isolated & (sources != 0.0))[0])
        raise ComputationError(f"pore {pore} has a source but no flowing path to an imposed pressure")

    pressure = np.where(free, 0.0, fixed)
    rest = np.zeros(n)
    unknown = free & ~isolated
    if not (lowest < highest).any():
        sourced = np.zeros(n, bool)
        sourced[parts[free & (sources != 0.0)]] = True
        still = unknown & ~sourced[parts]
        pressure[still] = lowest[still]
        unknown &= ~still
    report = _solve_free(pairs, conductances, pressure, rest, unknown, sources, solver, tolerance)
    if isolated.any():
        solve_isolated(pairs, isolated, ~free, pressure, rest, links=links, tolerance=tolerance)
    return NetworkSolution(pressure, isolated, report, rest)


def solve_isolated(
    pairs: np.ndarray,
    isolated: np.ndarray,
    held: np.ndarray,
    pressure: np.ndarray,
    rest: np.ndarray,
    *,
    links: Callable[[], np.ndarray] | None = None,
    tolerance: float = TOLERANCE,
) -> None:
    """Fill in the pressures of isolated pores from those of the others: see `links` of `solve_network`.

    Parameters
    ----------
    pairs : (t, 2) int array
    isolated, held : (n_pores,) bool arrays
        Pores without a flowing path to an imposed pressure; pores of imposed pressure.
    pressure, rest : (n_pores,) arrays
        As of `NetworkSolution`; those of isolated pores are overwritten.
    links, tolerance
        As of `solve_network`.

    Raises
    ------
    ComputationError
        If neighbours do not lead to an imposed pressure.
    """
    cut_off = ~reached(pairs, np.ones(len(pairs)), held)
    if cut_off.any():
        raise ComputationError(
            f"{np.count_nonzero(cut_off)} pores, the first of them {int(np.argmax(cut_off))}, have no neighbours "
            "that lead to an imposed pressure: their pressure is not defined"
        )
    weights = np.ones(len(pairs)) if links is None else links()
    touching = isolated[pairs].any(axis=1)
    _solve_free(pairs[touching], weights[touching], pressure, rest, isolated, np.zeros(len(held)), "auto", tolerance)


def reached(pairs: np.ndarray, weights: np.ndarray, sources: np.ndarray) -> np.ndarray:
    """(n,) bool: nodes that links (t, 2) of positive weight (t,) join to a source, (n,) bool."""
    parts = joined_parts(pairs, weights, len(sources))
    found = np.zeros(len(sources), bool)
    found[parts[sources]] = True
    return found[parts]


def pressures_of_parts(parts: np.ndarray, fixed: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """(n,), (n,): lowest and highest imposed pressure in the part of each node; inf and -inf where there is none [Pa].

    Parameters
    ----------
    parts : (n,) int array
        From `joined_parts`.
    fixed : (n,) array
        Imposed pressures, NaN where free [Pa].
    """
    held = np.flatnonzero(~np.isnan(fixed))
    lowest, highest = np.full(len(fixed), np.inf), np.full(len(fixed), -np.inf)
    np.minimum.at(lowest, parts[held], fixed[held])
    np.maximum.at(highest, parts[held], fixed[held])
    return lowest[parts], highest[parts]


def joined_parts(pairs: np.ndarray, weights: np.ndarray, nodes: int) -> np.ndarray:
    """(n,) int: the first node of the part of each node, which links (t, 2) of positive weight (t,) join."""
    return _joined_parts(read_only(pairs), read_only(weights), nodes)


@kernel
def _joined_parts(pairs, weights, nodes):
    parent = np.arange(nodes)
    for t in range(pairs.shape[0]):
        if weights[t] > 0.0:
            join(parent, pairs[t, 0], pairs[t, 1])
    for i in range(nodes):  # a root comes before all that hang on it
        parent[i] = parent[parent[i]]
    return parent


def _solve_free(pairs, conductances, pressure, rest, free, sources, solver, tolerance):
    """Solve for the pressures of the free pores, in place; all others are held."""
    network, rhs = free_network(pairs, conductances, pressure, free, sources)
    held = _held_beside(pairs, conductances, pressure, free, (rhs - sources[free]), network.leaks)
    solution = Solver(network, solver).solve_split(held, sources[free], tolerance)
    pressure[free] = solution.pressure
    rest[free] = solution.rest
    return solution.report


def _held_beside(pairs, conductances, pressure, free, inflow, leaks):
    """(number of free pores,): mean pressure of the held pores beside each free one, exact where they are equal."""
    number = np.cumsum(free) - 1
    lowest, highest = np.full(len(leaks), np.inf), np.full(len(leaks), -np.inf)
    i, j = pairs.T
    across = (free[i] != free[j]) & (conductances > 0.0)
    i, j = i[across], j[across]
    node, beside = number[np.where(free[i], i, j)], pressure[np.where(free[i], j, i)]
    np.minimum.at(lowest, node, beside)
    np.maximum.at(highest, node, beside)
    mean = np.divide(inflow, leaks, out=np.zeros(len(leaks)), where=leaks > 0.0)
    return np.where(lowest == highest, lowest, mean)


def free_network(
    pairs: np.ndarray, conductances: np.ndarray, pressure: np.ndarray, free: np.ndarray, sources: np.ndarray
) -> tuple[Network, np.ndarray]:
    """The network of the free pores, all others held at their pressure, and its right-hand side.

    Parameters
    ----------
    pairs : (t, 2) int array
    conductances : (t,) array
    pressure, sources : (n_pores,) arrays
    free : (n_pores,) bool array
    """
    number = np.cumsum(free, dtype=np.int32) - np.int32(1)
    number[~free] = -1
    rhs = sources[free]
    leaks = np.zeros(len(rhs))
    _leak(read_only(pairs), read_only(conductances), pressure, number, leaks, rhs)
    return Network.from_links(pairs, conductances, leaks, number), rhs


@kernel
def _leak(pairs, conductances, pressure, number, leaks, rhs):
    """Add links from free to held pores to `leaks` and `rhs`."""
    for t in range(pairs.shape[0]):
        i = pairs[t, 0]
        j = pairs[t, 1]
        a = number[i]
        b = number[j]
        if a >= 0 and b < 0:
            leaks[a] += conductances[t]
            rhs[a] += conductances[t] * pressure[j]
        elif b >= 0 and a < 0:
            leaks[b] += conductances[t]
            rhs[b] += conductances[t] * pressure[i]
