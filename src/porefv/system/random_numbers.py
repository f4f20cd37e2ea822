"""Random numbers for kernels, from a state that the caller holds: numba's own generator is one for all of a thread.

The generator is SplitMix64 (Steele, Lea and Flood 2014, doi:10.1145/2660193.2660195).
"""

from __future__ import annotations

import numpy as np

from porefv.system.kernels import helper

_STEP = np.uint64(0x9E3779B97F4A7C15)
_FIRST_FACTOR = np.uint64(0xBF58476D1CE4E5B9)
_SECOND_FACTOR = np.uint64(0x94D049BB133111EB)


def random_state(seed: int) -> np.ndarray:
    """(1,) uint64: the state of a generator that starts from a seed."""
    return np.array([seed], np.uint64)


@helper
def uniform(state):
    """The next random number, 0 <= x < 1; `state` (1,) moves on."""
    return np.float64(_word(state) >> np.uint64(11)) / 9007199254740992.0  # 2⁵³


@helper
def _word(state):
    """The next word of 64 bits."""
    state[0] += _STEP
    x = state[0]
    x = (x ^ (x >> np.uint64(30))) * _FIRST_FACTOR
    x = (x ^ (x >> np.uint64(27))) * _SECOND_FACTOR
    return x ^ (x >> np.uint64(31))
