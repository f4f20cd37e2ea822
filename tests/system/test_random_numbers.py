"""Random numbers of kernels are those of SplitMix64, from a state that the caller holds."""

import numpy as np
from numba import njit
from numpy.testing import assert_array_equal

from porefv.system.random_numbers import random_state, uniform


@njit
def numbers(state, count):
    found = np.empty(count)
    for i in range(count):
        found[i] = uniform(state)
    return found


def test_numbers_are_those_of_the_generator_to_the_bit():
    # The first words of the seed 1234567, as other implementations of the generator give them.
    words = [6457827717110365317, 3203168211198807973, 9817491932198370423, 4593380528125082431, 16408922859458223821]
    assert_array_equal(numbers(random_state(1234567), 5), [(word >> 11) / 2.0**53 for word in words])


def test_numbers_are_spread_evenly():
    found = numbers(random_state(0), 100_000)
    counts, _ = np.histogram(found, bins=10, range=(0.0, 1.0))
    assert counts.sum() == len(found)
    assert np.abs(counts - 10_000).max() < 500  # five standard deviations


def test_a_state_goes_on_where_it_was_left_and_states_do_not_share_numbers():
    state = random_state(3)
    first, other, second = numbers(state, 400), numbers(random_state(3), 400), numbers(state, 400)
    assert_array_equal(np.concatenate([first, second]), numbers(random_state(3), 800))
    assert_array_equal(first, other)
