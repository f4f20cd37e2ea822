"""Numbers are written as `repr` writes them."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from porefv.system.csv_lines import csv_lines


def lines(values):
    return b"".join(csv_lines(values)).decode("ascii").splitlines()


def by_repr(values):
    return [",".join([str(number), *map(repr, row)]) for number, row in enumerate(values.tolist())]


def assert_as_repr(numbers):
    """Compare as columns of two, so that there are several rows and cells."""
    values = np.concatenate([numbers, -numbers]).reshape(-1, 2)
    assert lines(values) == by_repr(values)


@given(st.lists(st.floats(allow_nan=False, allow_infinity=False), min_size=1, max_size=20))
def test_any_numbers_are_written_as_by_repr(numbers):
    assert_as_repr(np.array(numbers))


def test_doubles_of_random_bits_are_written_as_by_repr():
    bits = np.random.default_rng(0).integers(0, 2**63, 100_000, dtype=np.uint64)
    numbers = bits.view(float)
    assert_as_repr(numbers[np.isfinite(numbers)])


def test_powers_and_their_neighbours_are_written_as_by_repr():
    powers = np.concatenate([2.0 ** np.arange(-1074, 1024), [float(f"1e{k}") for k in range(-323, 309)]])
    for numbers in (powers, np.nextafter(powers, 0.0), np.nextafter(powers, 1.0)):
        assert_as_repr(numbers)


def test_numbers_of_few_digits_are_written_as_by_repr():
    whole = np.random.default_rng(1).integers(0, 10**7, 10_000)
    for power in range(-12, 13, 3):
        assert_as_repr(whole * 10.0**power)
        assert_as_repr(whole / 10.0**power)


def test_rows_are_numbered_across_the_pieces_of_the_text():
    values = np.linspace(0.0, 1.0, 10_001)[:, None]
    assert len(list(csv_lines(values))) > 1
    assert lines(values) == by_repr(values)


def test_columns_of_another_order_in_memory_are_the_same():
    values = np.asfortranarray(np.random.default_rng(2).random((100, 3)))
    assert lines(values) == by_repr(values)
