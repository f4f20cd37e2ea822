"""Pores in the order of the flow, and the sweep that solves pure advection: each pore after those it is fed by."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from porefv.errors import ComputationError
from porefv.system.kernels import kernel


class Upstream(NamedTuple):
    """What flows into each pore from others: pore p has the entries starts[p] ... starts[p + 1] - 1.

    Attributes
    ----------
    order : (n,) int64 array
        All pores, each after those that feed it.
    starts : (n + 1,) int64 array
    pores : (k,) int64 array
        The pore that the fluid comes from.
    fluxes : (k,) array
        Positive [m³/s].
    """

    order: np.ndarray
    starts: np.ndarray
    pores: np.ndarray
    fluxes: np.ndarray


def upstream_of(pairs: np.ndarray, flux: np.ndarray, n: int) -> Upstream:
    """The order of n pores, from the fluxes (t,) of throats, from the first of their pores (t, 2) to the second.

    Raises
    ------
    ComputationError
        If fluxes run in a circle, as no fluxes of a pressure do.
    """
    flows = flux != 0.0
    ends = np.where(flux[flows, None] > 0.0, pairs[flows], pairs[flows, ::-1]).astype(np.int64)
    sizes = np.abs(flux[flows])
    by_target = np.argsort(ends[:, 1], kind="stable")
    by_source = np.argsort(ends[:, 0], kind="stable")
    places = np.arange(n + 1)
    starts = np.searchsorted(ends[by_target, 1], places)
    order = np.empty(n, np.int64)
    found = flow_order(
        np.searchsorted(ends[by_source, 0], places), np.ascontiguousarray(ends[by_source, 1]), np.diff(starts), order
    )
    if found < n:
        raise ComputationError(
            f"the fluxes between {n - found} pores run in a circle: they are not those of a pressure"
        )
    return Upstream(order, starts, np.ascontiguousarray(ends[by_target, 0]), sizes[by_target])


@kernel
def flow_order(starts, targets, waiting, order):
    """Fill in the order of pores; returns how many have a place in it: all, unless there are circles.

    Parameters
    ----------
    starts : (n + 1,) int64, targets : (k,) int64 arrays
        Pores that each pore feeds.
    waiting : (n,) int64 array
        Number of throats that feed each pore; used up.
    order : (n,) int64 array
        To be filled.
    """
    found = 0
    for pore in range(waiting.shape[0]):
        if waiting[pore] == 0:
            order[found] = pore
            found += 1
    done = 0
    while done < found:
        pore = order[done]
        done += 1
        for k in range(starts[pore], starts[pore + 1]):
            target = targets[k]
            waiting[target] -= 1
            if waiting[target] == 0:
                order[found] = target
                found += 1
    return found


@kernel(error_model="numpy")
def sweep(upstream, diagonal, rhs, x):
    """Fill in x (n,) of diagonal x - Σ q x of the pores upstream = rhs."""
    order, starts, pores, fluxes = upstream
    for place in range(order.shape[0]):
        pore = order[place]
        total = rhs[pore]
        for k in range(starts[pore], starts[pore + 1]):
            total += fluxes[k] * x[pores[k]]
        x[pore] = total / diagonal[pore]
