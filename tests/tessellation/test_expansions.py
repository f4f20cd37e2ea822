"""Expansions against rational numbers. All equalities are exact: that is what expansions are for."""

from fractions import Fraction

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from porefv.tessellation.expansions import add, estimate, multiply, scale, sign, two_product, two_sum

# Wide in magnitude, yet no product of the tests overflows or underflows.
doubles = st.builds(
    lambda mantissa, exponent: float(np.ldexp(mantissa, exponent)),
    st.integers(-(2**53), 2**53),
    st.integers(-150, 50),
)
# Close in magnitude, so that sums cancel.
similar = st.builds(lambda m, e: float(np.ldexp(m, e)), st.integers(-(2**53), 2**53), st.integers(-3, 3))
terms = st.lists(st.one_of(doubles, similar), max_size=8)


def expansion(values):
    """The sum of doubles as an expansion, one added after the other."""
    e = np.empty(0)
    for value in values:
        if value != 0.0:
            h = np.empty(len(e) + 1)
            e = h[: add(e, len(e), np.array([value]), 1, h)].copy()
    return e


def exact(values):
    return sum(map(Fraction, map(float, values)), Fraction(0))


def is_valid(e):
    """Components increase in magnitude, without overlapping bits, and none is zero."""
    lowest = [abs(Fraction(float(x))) for x in e]
    bits = [value.numerator.bit_length() - value.denominator.bit_length() + 1 for value in lowest]
    units = [(value.numerator & -value.numerator) / Fraction(value.denominator) for value in lowest]
    return all(lowest) and all(Fraction(2) ** bits[i] <= units[i + 1] for i in range(len(e) - 1))


@given(doubles, doubles)
def test_two_sum_is_the_sum_and_its_rounding_error(a, b):
    x, error = two_sum(a, b)
    assert x == a + b
    assert Fraction(x) + Fraction(error) == Fraction(a) + Fraction(b)


@given(doubles, doubles)
def test_two_product_is_the_product_and_its_rounding_error(a, b):
    x, error = two_product(a, b)
    assert x == a * b
    assert Fraction(x) + Fraction(error) == Fraction(a) * Fraction(b)


@given(terms, terms)
def test_sum_of_expansions_is_exact(a, b):
    e, f = expansion(a), expansion(b)
    h = np.empty(len(e) + len(f))
    h = h[: add(e, len(e), f, len(f), h)]
    assert exact(h) == exact(a) + exact(b)
    assert is_valid(h)


@given(terms, doubles)
def test_product_of_expansion_and_double_is_exact(a, b):
    e = expansion(a)
    h = np.empty(2 * len(e))
    h = h[: scale(e, len(e), b, h)]
    assert exact(h) == exact(a) * Fraction(b)
    assert is_valid(h)


@given(terms, terms)
def test_product_of_expansions_is_exact(a, b):
    e, f = expansion(a), expansion(b)
    h = np.empty(2 * len(e) * len(f))
    h = h[: multiply(e, len(e), f, len(f), h)]
    assert exact(h) == exact(a) * exact(b)
    assert is_valid(h)


@given(terms)
def test_sign_is_that_of_the_sum_however_much_cancels(a):
    e = expansion(a)
    total = exact(a)
    assert sign(e, len(e)) == (total > 0) - (total < 0)


@given(terms)
def test_a_number_less_itself_is_the_empty_expansion(a):
    e = expansion(a)
    h = np.empty(2 * len(e))
    assert add(e, len(e), -e, len(e), h) == 0
    assert sign(h, 0) == 0


@given(terms)
def test_estimate_is_the_nearest_double_to_within_two_roundings(a):
    e = expansion(a)
    total = exact(a)
    assert abs(Fraction(float(estimate(e, len(e)))) - total) <= 2 * Fraction(2) ** -53 * abs(total)
