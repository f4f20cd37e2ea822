"""Random numbers of kernels are those of numpy, from a state that the caller holds."""

import numpy as np
import pytest
from numba import njit
from numpy.testing import assert_array_equal

from porefv.system.random_numbers import random_state, uniform


@njit
def numbers(state, count):
    found = np.empty(count)
    for i in range(count):
        found[i] = uniform(state)
    return found


@pytest.mark.parametrize("seed", [0, 1, 2**32 - 1])
def test_numbers_are_those_of_numpy_to_the_bit(seed):
    # More than two rounds of the generator's 624 words.
    assert_array_equal(numbers(random_state(seed), 1000), np.random.RandomState(seed).random_sample(1000))


def test_a_state_goes_on_where_it_was_left_and_states_do_not_share_numbers():
    state = random_state(3)
    first, other, second = numbers(state, 400), numbers(random_state(3), 400), numbers(state, 400)
    assert_array_equal(np.concatenate([first, second]), numbers(random_state(3), 800))
    assert_array_equal(first, other)
