"""Random numbers for kernels, from a state that the caller holds: numba's own generator is one for all of a thread.

The numbers are those of the Mersenne Twister (Matsumoto and Nishimura 1998, doi:10.1145/272991.272995) with 53 bits,
as of `numpy.random.RandomState`.
"""

from __future__ import annotations

import numpy as np

from porefv.system.kernels import helper

_WORDS, _SHIFT = 624, 397
_UPPER, _LOWER, _TWIST = 0x80000000, 0x7FFFFFFF, 0x9908B0DF


def random_state(seed: int) -> np.ndarray:
    """(625,) int64: the words of a generator that starts from a seed, and how many of them are used."""
    words = np.random.RandomState(seed).get_state(legacy=False)["state"]["key"]
    return np.append(words, _WORDS).astype(np.int64)


@helper
def uniform(state):
    """The next random number, 0 <= x < 1; `state` (625,) moves on."""
    return ((_word(state) >> 5) * 67108864.0 + (_word(state) >> 6)) / 9007199254740992.0  # (2²⁶ a + b) / 2⁵³


@helper
def _word(state):
    """The next word of 32 bits."""
    if state[_WORDS] == _WORDS:
        _renew(state)
    y = state[state[_WORDS]]
    state[_WORDS] += 1
    y ^= y >> 11
    y ^= (y << 7) & 0x9D2C5680
    y ^= (y << 15) & 0xEFC60000
    return y ^ (y >> 18)


@helper
def _renew(state):
    """Replace all words by the next ones."""
    for i in range(_WORDS):
        following = state[i + 1] if i + 1 < _WORDS else state[0]
        y = (state[i] & _UPPER) | (following & _LOWER)
        distant = state[i + _SHIFT] if i + _SHIFT < _WORDS else state[i + _SHIFT - _WORDS]
        state[i] = distant ^ (y >> 1) ^ (_TWIST if y & 1 else 0)
    state[_WORDS] = 0
