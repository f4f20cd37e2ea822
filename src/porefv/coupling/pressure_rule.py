"""PressureRule: when the pressures of a step are good enough, by the power still wrong and the volume still lost."""

from __future__ import annotations

import numpy as np

from porefv.solvers.network import Network
from porefv.system.kernels import helper, kernel

# Bound on the volume still lost by single pores, over the tolerance: with 1, a consolidation takes four times the
# iterations, for pressures that are the same within 0.003 of the load.
_VOLUME = 10.0
# What rounding may leave of the volume rates, relative to the sizes of the terms.
_ROUNDING = 1e-13


class PressureRule:
    """Stop where the power still wrong and the volume still lost are both small.

    The power: below the tolerance, squared, of the power x·b. r·M⁻¹r is the preconditioner's estimate of the power
    still wrong. Between two estimates the rule takes it to fall with Σ r² / diagonal: applying the preconditioner costs
    most, and may then be spared.

    The volume: Σ|r|, what pores lose or gain unseen, below ten times the tolerance of what flows: half of all that
    passes the walls of imposed pressure, or half of all that pores exchange, whichever is more. Drag and weight can
    dwarf G in the power: where grains lie under clear fluid, the first alone lets in- and outflow differ by as much as
    they are.

    Parameters
    ----------
    x, rhs, r : (f,) arrays
        Pressures, right-hand side and residual; x and r change in place.
    network : Network
        G between the free pores.
    inflow : (f,) array
        Flux from pores of imposed pressure into each, at x = 0 [m³/s].
    tolerance : float
    """

    def __init__(
        self, x: np.ndarray, rhs: np.ndarray, r: np.ndarray, network: Network, inflow: np.ndarray, tolerance: float
    ):
        self._arrays = x, rhs, r, 1.0 / network.diagonal
        self._network, self._inflow, self._tolerance = network, inflow, tolerance
        self._power, self._size = power_and_size(*self._arrays)
        self._wrong = np.inf

    def met_before(self, rz: float) -> bool:
        """See `porefv.solvers.conjugate_gradients.StoppingRule`."""
        self._wrong = rz
        if not rz <= max(self._tolerance**2 * self._power, 1e-300):
            return False
        return self._conserves(float(np.abs(self._arrays[2]).sum()))

    def met_after(self, iterations: int, lost: float) -> bool:
        """See `porefv.solvers.conjugate_gradients.StoppingRule`."""
        before = self._size
        self._power, self._size = power_and_size(*self._arrays)
        wrong = self._wrong * self._size / before
        return wrong <= self._tolerance**2 * self._power and self._conserves(lost)

    def _conserves(self, lost: float) -> bool:
        x, rhs, _, weights = self._arrays
        network = self._network
        flow, rounding = flow_and_rounding(
            network.starts, network.columns, network.links, network.leaks, self._inflow, rhs, x, weights
        )
        return lost <= max(_VOLUME * self._tolerance * flow, _ROUNDING * rounding)


@kernel
def power_and_size(x, rhs, r, weights):
    """|x·b| and Σ w r²."""
    return abs(dot(x, rhs)), _weighted_square(r, weights)


@kernel
def flow_and_rounding(starts, columns, links, leaks, inflow, rhs, x, weights):
    """Half of what passes to and from held pores, or of what free pores give to others; and Σ|b| + |x| / w."""
    held = exchanged = size = 0.0
    for i in range(x.shape[0]):
        out = leaks[i] * x[i] - inflow[i]
        held += abs(out)
        for k in range(starts[i], starts[i + 1]):
            out += links[k] * (x[i] - x[columns[k]])
        exchanged += abs(out)
        size += abs(rhs[i]) + abs(x[i]) / weights[i]
    return 0.5 * max(held, exchanged), size


@helper(fastmath={"reassoc", "contract"})
def dot(a, b):
    """Σ a b."""
    total = 0.0
    for i in range(a.shape[0]):
        total += a[i] * b[i]
    return total


@helper(fastmath={"reassoc", "contract"})
def _weighted_square(r, weights):
    total = 0.0
    for i in range(r.shape[0]):
        total += weights[i] * r[i] * r[i]
    return total
