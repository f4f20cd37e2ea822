"""Pairs that may touch: listed with a margin, and anew when grains have moved through it."""

from __future__ import annotations

import numpy as np

from porefv.dem.grain_state import GrainPairs, GrainState, Listing, WallPairs
from porefv.packing.neighbours import neighbour_pairs
from porefv.system.kernels import njit

# Part of the smallest radius that grains may come closer before pairs are listed anew.
_SKIN = 0.2


def list_pairs(state: GrainState, young: float, threads: int) -> None:
    """List the pairs that may touch before any grain has moved by half the margin, and keep what contacts hold.

    Parameters
    ----------
    state : GrainState
        Whose pairs, pairs with walls, and listing are replaced.
    young : float
        Of the material [Pa].
    threads : int
        To share the pairs between.
    """
    n, places = len(state), state.walls.places
    x = np.ascontiguousarray(state.grains.motion[:, :3])
    r = np.ascontiguousarray(state.grains.motion[:, 3])
    skin = _SKIN * float(r.min())

    pairs = neighbour_pairs(x, r, skin)
    shear, touching = np.zeros((len(pairs), 3)), np.zeros(len(pairs), bool)
    _carry(state.pairs.grains, state.pairs.shear, state.pairs.touching, pairs, shear, touching)
    # For each thread a range of grains with about as many pairs.
    starts = np.searchsorted(pairs[:, 0], np.arange(n + 1))
    ranges = np.searchsorted(starts, np.linspace(0, len(pairs), threads + 1))
    ranges[-1] = n
    stiffness = pair_stiffness(young, pairs, state.grains.motion)
    others = np.ascontiguousarray(pairs[:, 1])
    state.pairs = GrainPairs(pairs, starts, others, stiffness, shear, touching, ranges)

    near = np.stack([x - places[0::2] < r[:, None] + skin, places[1::2] - x < r[:, None] + skin], axis=2)
    members = np.ascontiguousarray(np.argwhere(near.reshape(-1, 6)), dtype=np.int32)
    shear, touching = np.zeros((len(members), 3)), np.zeros(len(members), bool)
    _carry(state.wall_pairs.members, state.wall_pairs.shear, state.wall_pairs.touching, members, shear, touching)
    ranges = np.linspace(0, len(members), threads + 1).astype(np.int64)
    state.wall_pairs = WallPairs(members, young * r[members[:, 0]], shear, touching, ranges)

    state.listing = Listing(x, places.copy(), skin)


def set_stiffness(state: GrainState, young: float) -> None:
    """The stiffness of pairs that are listed, for another modulus [Pa]."""
    state.pairs.stiffness[:] = pair_stiffness(young, state.pairs.grains, state.grains.motion)
    state.wall_pairs.stiffness[:] = young * state.grains.motion[state.wall_pairs.members[:, 0], 3]


@njit(cache=True)
def pair_stiffness(young, pairs, motion):
    """(p,): k_n = 2 E r_i r_j / (r_i + r_j) of each pair (C14 eq. 10) [N/m]."""
    stiffness = np.empty(pairs.shape[0])
    for c in range(pairs.shape[0]):
        a = motion[pairs[c, 0], 3]
        b = motion[pairs[c, 1], 3]
        stiffness[c] = 2.0 * young * a * b / (a + b)
    return stiffness


@njit(cache=True)
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
