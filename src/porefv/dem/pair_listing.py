"""Pairs that may touch: listed with a margin, and anew when grains have moved through it."""

from __future__ import annotations

import numpy as np

from porefv.dem.grain_state import GrainPairs, GrainState, Listing, WallPairs
from porefv.packing.neighbours import neighbour_pairs
from porefv.system.kernels import kernel

# Part of the smallest radius that grains may come closer before pairs are listed anew.
_SKIN = 0.2


def ranges_for(grains: int) -> int:
    """Into how many ranges contacts and grains are divided, whatever the number of threads.

    Each costs one thread 1 or 2 % more. Below 4000 grains a step takes no longer than handing a range over.
    """
    return 1 if grains < 4_000 else 2 if grains < 40_000 else 4


def list_pairs(state: GrainState, young: float) -> None:
    """List the pairs that may touch before any grain has moved by half the margin, and keep what contacts hold.

    Parameters
    ----------
    state : GrainState
        Whose pairs, pairs with walls, and listing are replaced.
    young : float
        Of the material [Pa].
    """
    n, places = len(state), state.walls.places
    # A copy, for the listing keeps it: of a single grain these columns are contiguous, and would be a view.
    x = state.grains.motion[:, :3].copy()
    r = np.ascontiguousarray(state.grains.motion[:, 3])
    skin = _SKIN * float(r.min())

    pairs = neighbour_pairs(x, r, skin)
    shear, touching = np.zeros((len(pairs), 3)), np.zeros(len(pairs), bool)
    _carry(state.pairs.grains, state.pairs.shear, state.pairs.touching, pairs, shear, touching)
    starts = np.searchsorted(pairs[:, 0], np.arange(n + 1))
    stiffness = pair_stiffness(young, pairs, state.grains.motion)
    others = np.ascontiguousarray(pairs[:, 1])
    state.pairs = GrainPairs(pairs, starts, others, stiffness, shear, touching, _pair_ranges(starts))

    near = np.stack([x - places[0::2] < r[:, None] + skin, places[1::2] - x < r[:, None] + skin], axis=2)
    members = np.ascontiguousarray(np.argwhere(near.reshape(-1, 6)), dtype=np.int32)
    shear, touching = np.zeros((len(members), 3)), np.zeros(len(members), bool)
    _carry(state.wall_pairs.members, state.wall_pairs.shear, state.wall_pairs.touching, members, shear, touching)
    ranges = _wall_pair_ranges(len(members), n)
    state.wall_pairs = WallPairs(members, young * r[members[:, 0]], shear, touching, ranges)

    state.listing = Listing(x, places.copy(), skin)


def divide_into_ranges(state: GrainState) -> None:
    """Divide the pairs that are listed among the ranges of this version of porefv, for a state of another one."""
    state.pairs = state.pairs._replace(ranges=_pair_ranges(state.pairs.starts))
    state.wall_pairs = state.wall_pairs._replace(ranges=_wall_pair_ranges(len(state.wall_pairs.members), len(state)))


def _pair_ranges(starts: np.ndarray) -> np.ndarray:
    """(s + 1,): ranges of grains with about as many pairs each."""
    n = len(starts) - 1
    ranges = np.searchsorted(starts, np.linspace(0, starts[-1], ranges_for(n) + 1))
    ranges[-1] = n
    return ranges


def _wall_pair_ranges(pairs: int, grains: int) -> np.ndarray:
    """(s + 1,): ranges of about as many pairs with walls each."""
    return np.linspace(0, pairs, ranges_for(grains) + 1).astype(np.int64)


def set_stiffness(state: GrainState, young: float) -> None:
    """The stiffness of pairs that are listed, for another modulus [Pa]."""
    state.pairs.stiffness[:] = pair_stiffness(young, state.pairs.grains, state.grains.motion)
    state.wall_pairs.stiffness[:] = young * state.grains.motion[state.wall_pairs.members[:, 0], 3]


@kernel
def pair_stiffness(young, pairs, motion):
    """(p,): k_n = 2 E r_i r_j / (r_i + r_j) of each pair (C14 eq. 10) [N/m]."""
    stiffness = np.empty(pairs.shape[0])
    for c in range(pairs.shape[0]):
        a = motion[pairs[c, 0], 3]
        b = motion[pairs[c, 1], 3]
        stiffness[c] = 2.0 * young * a * b / (a + b)
    return stiffness


@kernel
def _carry(old_pairs, old_shear, old_touching, pairs, shear, touching):
    """Hand what contacts hold from one sorted list of pairs to another."""
    o = 0
    for c in range(pairs.shape[0]):
        while o < old_pairs.shape[0] and (
            old_pairs[o, 0] < pairs[c, 0] or (old_pairs[o, 0] == pairs[c, 0] and old_pairs[o, 1] < pairs[c, 1])
        ):
            o += 1
        if o < old_pairs.shape[0] and old_pairs[o, 0] == pairs[c, 0] and old_pairs[o, 1] == pairs[c, 1]:
            touching[c] = old_touching[o]
            for a in range(3):
                shear[c, a] = old_shear[o, a]
