"""Conjugate gradients: the iteration itself, and the pressures of a network to a bound on what its nodes lose.

`preconditioned_cg` iterates on any symmetric positive definite operator until a stopping rule is met.
`conjugate_gradients` finds the pressures of a network in double precision. `refined` finds them as the sum of two
doubles each: stiff throats then pass flows that differences of single doubles could not tell from nothing.

Sums run over blocks of fixed size, so that results do not depend on the number of threads.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import Protocol

import numpy as np

from porefv.solvers.network import BLOCK, Network
from porefv.system.kernels import kernel
from porefv.system.threads import for_blocks, for_rows

# By how much a correction makes the residual smaller before that is computed anew: the recurrence drifts by rounding.
_REACH = 1e-10
MAX_ITERATIONS = 500
# Corrections that may fail to halve the imbalance before it is given up: rounding of the first ones, in throats
# 10¹⁶ times as conductive as others, makes flows larger than all there are, which the next ones take away.
_PATIENCE = 3
_EPSILON = float(np.finfo(float).eps)
# Nodes that take some 0.1 ms where each is one multiplication.
_CHEAP = 1 << 16
# Iterations between two looks at what the tolerance is measured against.
_LOOK_EVERY = 4


class Operator(Protocol):
    """A symmetric positive definite matrix A."""

    def multiply(self, q: np.ndarray, aq: np.ndarray) -> float:
        """aq = A q; returns q·aq."""
        ...


class Preconditioner(Protocol):
    """An approximate inverse M⁻¹ of an operator."""

    def apply(self, r: np.ndarray, z: np.ndarray) -> float:
        """z = M⁻¹ r; returns r·z."""
        ...


class StoppingRule(Protocol):
    """When the iteration ends. A rule may keep references to x and r, which change in place."""

    def met_before(self, rz: float) -> bool:
        """Whether to stop before the next iteration, given r·M⁻¹r."""
        ...

    def met_after(self, iterations: int, lost: float) -> bool:
        """Whether to stop after so many iterations, given Σ|r|, before M⁻¹ is applied to r."""
        ...


def preconditioned_cg(
    operator: Operator,
    preconditioner: Preconditioner,
    x: np.ndarray,
    r: np.ndarray,
    rule: StoppingRule,
    limit: int,
    room: np.ndarray | None = None,
) -> tuple[int, bool]:
    """Iterate on A x = b by preconditioned conjugate gradients (Hestenes and Stiefel 1952).

    Parameters
    ----------
    operator, preconditioner
        A and M⁻¹.
    x : (n,) array
        Start, and result.
    r : (n,) array
        b - A x of the start, and of the result but for rounding.
    rule : StoppingRule
    limit : int
        Most iterations.
    room : (3, n) array, optional
        To work in.

    Returns
    -------
    iterations : int
    met : bool
        Whether the rule is met. It is not after `limit` iterations, or where q·Aq or r·M⁻¹r is not positive: rounding
        has then spoilt the factor, or the numbers are not finite.
    """
    n = len(x)
    q, aq, z = np.empty((3, n)) if room is None else room
    rz = preconditioner.apply(r, z)
    q[:] = z
    iterations = 0
    while not rule.met_before(rz):
        if not rz > 0.0 or iterations >= limit:
            return iterations, False
        iterations += 1
        power = operator.multiply(q, aq)
        if not power > 0.0:
            return iterations, False
        if rule.met_after(iterations, sum(for_blocks(_advance, n, BLOCK, x, r, q, aq, rz / power))):
            return iterations, True
        before, rz = rz, preconditioner.apply(r, z)
        for_rows(_redirect, n, q, z, rz / before, least=_CHEAP)
    return iterations, True


def imbalance(network: Network, rhs: np.ndarray, x: np.ndarray) -> tuple[float, float, float]:
    """Σ|b - A x|, the flow through the network, and the rounding of the first.

    The flow is half of all that enters or leaves; Σ ε d|x| is what rounding x to double precision alone may lose.
    """
    lost = float(np.abs(network.residual(rhs, x)).sum())
    return lost, *_measures(network, rhs, x)


def _measures(network, rhs, x):
    parts = for_blocks(_flow_and_size, len(network), BLOCK, network.leaks, network.diagonal, rhs, x)
    return 0.5 * sum(flow for flow, _ in parts), _EPSILON * sum(size for _, size in parts)


def conjugate_gradients(
    network: Network,
    rhs: np.ndarray,
    preconditioner: Preconditioner,
    tolerance: float,
    guess: np.ndarray | None = None,
    limit: int | None = None,
) -> tuple[np.ndarray, int]:
    """Iterate until Σ|b - A x| is below `tolerance` times the flow, or rounding allows no better.

    Parameters
    ----------
    network : Network
    rhs : (n,) float64 array
        b, the flux into each node [m³/s].
    preconditioner : Preconditioner
        Approximate inverse of the network's matrix A.
    tolerance : float
    guess : (n,) float64 array, optional
        Pressures where iterations start, zero by default; they are copied [Pa].
    limit : int, optional
        Most iterations, `MAX_ITERATIONS` by default.

    Returns
    -------
    x (n,), number of iterations
    """
    x = np.zeros(len(network)) if guess is None else guess.copy()
    limit = MAX_ITERATIONS if limit is None else limit

    def enough() -> float:
        flow, floor = _measures(network, rhs, x)
        return 0.5 * max(tolerance * flow, floor)

    iterations = 0
    before = np.inf
    while True:
        # (Re)start from the true residual: the recurrence drifts from it by rounding.
        r = network.residual(rhs, x)
        lost = float(np.abs(r).sum())
        flow, floor = _measures(network, rhs, x)
        if lost <= max(tolerance * flow, floor) or not lost < 0.5 * before or iterations >= limit:
            return x, iterations
        before = lost
        rule = _ImbalanceRule(0.0, enough)
        iterations += preconditioned_cg(network, preconditioner, x, r, rule, limit - iterations)[0]


class _ImbalanceRule:
    """Stop where Σ|r| is below `least`, or below what `enough` returns at every fourth iteration."""

    def __init__(self, least: float, enough: Callable[[], float]):
        self._least, self._enough, self._target = least, enough, least

    def met_before(self, rz: float) -> bool:
        return False

    def met_after(self, iterations: int, lost: float) -> bool:
        if iterations % _LOOK_EVERY == 0:
            self._target = max(self._least, self._enough())
        return lost <= self._target


@dataclass(frozen=True, eq=False)
class Refined:
    """Pressures as sums of two doubles, and how exact they are.

    Attributes
    ----------
    x, rest : (n,) arrays
        Pressures, and what rounding has left of them [Pa].
    iterations : int
    lost, flow : float
        Σ|b - A x|, and half of all that enters or leaves [m³/s].
    error : float
        Estimate of the largest error of a pressure: what A⁻¹ makes of |b - A x| [Pa].
    """

    x: np.ndarray
    rest: np.ndarray
    iterations: int
    lost: float
    flow: float
    error: float


def refined(
    network: Network,
    held: np.ndarray,
    sources: np.ndarray,
    preconditioner: Preconditioner,
    tolerance: float,
    accuracy: float,
) -> Refined:
    """Correct pressures until Σ|b - A x| is below `tolerance` times the flow and their error below `accuracy`.

    A correction reduces the residual of the pressures found before it: down to the tolerance as long as that is not
    reached and every correction halves the least imbalance; else as far as one residual allows.

    Parameters
    ----------
    network : Network
    held : (n,) array
        Pressure that each node's leaks lead to [Pa].
    sources : (n,) array
        Volume injected into each node per unit time [m³/s].
    preconditioner : ApproximateCholesky or DirectFactor
    tolerance : float
    accuracy : float
        [Pa]

    Returns
    -------
    Refined
        The pressures of the least imbalance, whether or not they meet both.
    """
    found = best = _Approximation(_Equation(network, held, sources, preconditioner), *np.zeros((2, len(network))))
    iterations = 0
    futile = 0  # corrections, one after another, that have not halved the least imbalance
    while not (found.conserves(tolerance) and found.error <= accuracy):
        if futile >= _PATIENCE or iterations >= MAX_ITERATIONS:
            break
        to_tolerance = futile == 0 and not found.conserves(tolerance)
        found, count = found.corrected(tolerance if to_tolerance else 0.0)
        iterations += count
        futile = 0 if found.lost < 0.5 * best.lost else futile + 1
        if found.lost < best.lost:
            best = found
    return Refined(best.x, best.rest, iterations, best.lost, best.flow, best.error)


@dataclass(frozen=True, eq=False)
class _Equation:
    """A x = b, b = leaks held + sources; attributes are parameters of `refined`."""

    network: Network
    held: np.ndarray
    sources: np.ndarray
    preconditioner: Preconditioner

    @cached_property
    def _leaking(self) -> np.ndarray:
        """Nodes with leaks: few of all."""
        return np.flatnonzero(self.network.leaks)

    @cached_property
    def _injected(self) -> float:
        return float(np.abs(self.sources).sum())

    def flow(self, x: np.ndarray, rest: np.ndarray) -> float:
        """Half of all that enters or leaves with the pressures x + rest [m³/s]."""
        nodes = self._leaking
        entering = self.network.leaks[nodes] * ((self.held[nodes] - x[nodes]) - rest[nodes])
        return 0.5 * (float(np.abs(entering).sum()) + self._injected)


@dataclass(frozen=True, eq=False)
class _Approximation:
    """Pressures x + rest as the solution of an equation."""

    equation: _Equation
    x: np.ndarray
    rest: np.ndarray

    @cached_property
    def residual(self) -> np.ndarray:
        """(n,): b - A (x + rest) [m³/s]."""
        equation = self.equation
        return equation.network.split_residual(equation.held, equation.sources, self.x, self.rest)

    @cached_property
    def lost(self) -> float:
        """Σ|b - A (x + rest)| [m³/s]."""
        return float(np.abs(self.residual).sum())

    @cached_property
    def flow(self) -> float:
        """Half of all that enters or leaves [m³/s]."""
        return self.equation.flow(self.x, self.rest)

    @cached_property
    def error(self) -> float:
        """Estimate of the largest error of a pressure: what A⁻¹ makes of |b - A (x + rest)| [Pa]."""
        z = np.empty(len(self.x))
        self.equation.preconditioner.apply(np.abs(self.residual), z)
        return float(np.abs(z).max(initial=0.0))

    def conserves(self, tolerance: float) -> bool:
        """Whether no more than this part of the flow is lost."""
        return self.lost <= tolerance * self.flow

    def corrected(self, tolerance: float) -> tuple[_Approximation, int]:
        """A better approximation, which loses this part of the flow or the least that one residual allows.

        Returns
        -------
        approximation, number of iterations
        """
        network, x, rest = self.equation.network, self.x, self.rest
        correction = np.zeros(len(network))

        def enough() -> float:
            return 0.5 * tolerance * self.equation.flow(x, rest + correction)

        rule = _ImbalanceRule(_REACH * self.lost, enough)
        iterations, *_ = preconditioned_cg(
            network, self.equation.preconditioner, correction, self.residual.copy(), rule, MAX_ITERATIONS
        )
        return _Approximation(self.equation, *_two_sum(x, rest + correction)), iterations


def _two_sum(a: np.ndarray, b: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The sums a + b, and exactly what rounding leaves of them (Knuth)."""
    total = a + b
    part = total - a
    return total, (a - (total - part)) + (b - part)


@kernel
def _flow_and_size(first, last, leaks, diagonal, rhs, x):
    """Σ|e x - b| and Σ d|x| of nodes first ... last - 1."""
    flow = 0.0
    size = 0.0
    for i in range(first, last):
        flow += abs(leaks[i] * x[i] - rhs[i])
        size += diagonal[i] * abs(x[i])
    return flow, size


# The sum may be taken in any order: it is then formed four numbers at a time.
@kernel(fastmath={"reassoc"})
def _advance(first, last, x, r, q, aq, alpha):
    """x += α q, r -= α aq for nodes first ... last - 1; returns their Σ|r|."""
    lost = 0.0
    for i in range(first, last):
        x[i] += alpha * q[i]
        r[i] -= alpha * aq[i]
        lost += abs(r[i])
    return lost


@kernel
def _redirect(first, last, q, z, beta):
    """q = z + β q for nodes first ... last - 1."""
    for i in range(first, last):
        q[i] = z[i] + beta * q[i]
