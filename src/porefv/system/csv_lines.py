"""Lines of a CSV file from arrays of doubles: each number in the text that `repr` gives, in an eighth of the time.

This is the shortest text that reads back to the number. It is found by the algorithm of R. Giulietti, The Schubfach way
to render doubles (2020). All numbers within half the distance to the next doubles read back. Their limits are
multiplied by a power of ten such that the numbers of the fewest digits between them are whole, or ten times whole.
"""

from __future__ import annotations

from collections.abc import Iterator
from functools import cache

import numpy as np

from porefv.system.kernels import helper, kernel

_ROWS_AT_ONCE = 4096
# Characters of a double at most, as in -2.2250738585072014e-308, and of a row's number; each with its comma or newline.
_DOUBLE, _NUMBER = 25, 20

_ZERO, _ONE, _TWO, _FOUR, _TEN = (np.uint64(number) for number in (0, 1, 2, 4, 10))
_HALF, _LOW = np.uint64(32), np.uint64(0xFFFFFFFF)
_SIGNIFICAND, _HIDDEN = np.uint64(2**52 - 1), np.uint64(2**52)
_FIRST_POWER, _LAST_POWER = -292, 324
_COMMA, _NEWLINE, _MINUS, _PLUS, _POINT, _DIGIT, _E = (np.uint8(ord(character)) for character in ",\n-+.0e")


def csv_lines(values: np.ndarray) -> Iterator[bytes]:
    r"""Text of the rows of an array (n, m) of finite doubles, some thousands at a time: their numbers, then the cells.

    Examples
    --------
    >>> b"".join(csv_lines(np.array([[0.1, 1e-5], [2.0, -3e22]])))
    b'0,0.1,1e-05\n1,2.0,-3e+22\n'
    """
    text = np.empty(_ROWS_AT_ONCE * (_NUMBER + values.shape[1] * _DOUBLE), np.uint8)
    for first in range(0, len(values), _ROWS_AT_ONCE):
        bits = np.ascontiguousarray(values[first : first + _ROWS_AT_ONCE], float).view(np.uint64)
        yield text[: _write_lines(first, bits, _powers_of_ten(), text)].tobytes()


@cache
def _powers_of_ten() -> np.ndarray:
    """Upper and lower 64 bits (617, 2) of 10^-292 ... 10^324, each times a power of two, rounded up to 128 bits."""
    powers = []
    for exponent in range(_FIRST_POWER, _LAST_POWER + 1):
        power = 10 ** abs(exponent)
        if exponent >= 0:
            shift = 128 - power.bit_length()
            scaled = power << shift if shift >= 0 else -(-power >> -shift)
        else:
            scaled = -(-(1 << 127 + (power - 1).bit_length()) // power)
        powers.append((scaled >> 64, scaled & (2**64 - 1)))
    return np.array(powers, np.uint64)


@kernel
def _write_lines(number, bits, powers, text):
    """Write rows, from a number on, of the bits (n, m) of doubles; returns how many characters they are."""
    end = 0
    for row in range(bits.shape[0]):
        end = _write_digits(np.uint64(number + row), text, end)
        for column in range(bits.shape[1]):
            text[end] = _COMMA
            end = _write_double(bits[row, column], powers, text, end + 1)
        text[end] = _NEWLINE
        end += 1
    return end


@helper
def _write_double(bits, powers, text, end):
    if bits >> np.uint64(63):
        text[end] = _MINUS
        end += 1
    significand, biased = bits & _SIGNIFICAND, np.int64((bits >> np.uint64(52)) & np.uint64(2047))
    if significand == _ZERO and biased == 0:
        digits, exponent = _ZERO, 0
    else:
        digits, exponent = _shortest(significand, biased, powers)
    while digits != _ZERO and digits % _TEN == _ZERO:
        digits //= _TEN
        exponent += 1
    begin = end
    end = _write_digits(digits, text, end)
    point = end - begin + exponent  # digits before the decimal point
    if -4 < point <= 16:
        return _write_point(point, text, begin, end)
    return _write_exponent(point - 1, text, begin, end)


@helper
def _shortest(significand, biased, powers):
    """The fewest digits, and the exponent of ten, that read back to a positive double, the nearest to it of these."""
    c, q = (significand | _HIDDEN, biased - 1075) if biased else (significand, -1074)
    odd = c & _ONE
    # Below a power of two doubles are half as far apart.
    closer = significand == _ZERO and biased > 1
    k = (q * 1262611 - (524031 if closer else 0)) >> 22
    h = np.uint64(q + ((-k * 1741647) >> 19) + 1)
    high, low = powers[-k - _FIRST_POWER, 0], powers[-k - _FIRST_POWER, 1]
    c4 = _FOUR * c
    least = _rounded_to_odd(high, low, (c4 - (_ONE if closer else _TWO)) << h) + odd
    value = _rounded_to_odd(high, low, c4 << h)
    most = _rounded_to_odd(high, low, (c4 + _TWO) << h) - odd
    s = value // _FOUR
    tens = s // _TEN
    if tens:
        below, above = least <= _FOUR * _TEN * tens, _FOUR * _TEN * (tens + _ONE) <= most
        if below != above:
            return (tens + _ONE if above else tens), k + 1
    below, above = least <= _FOUR * s, _FOUR * (s + _ONE) <= most
    if below == above:
        middle = _FOUR * s + _TWO
        above = value > middle or (value == middle and (s & _ONE) == _ONE)
    return (s + _ONE if above else s), k


@helper
def _rounded_to_odd(high, low, factor):
    """Upper 64 of the 192 bits of a product; the last tells whether more follow.

    The power of ten is rounded up, so that the last of the bits cut off says nothing.
    """
    upper, lower = _product(high, factor)
    carried, _ = _product(low, factor)
    lower += carried
    if lower < carried:
        upper += _ONE
    return upper | (_ONE if lower > _ONE else _ZERO)


@helper
def _product(a, b):
    """Upper and lower 64 bits of a product."""
    a1, a0, b1, b0 = a >> _HALF, a & _LOW, b >> _HALF, b & _LOW
    middle = a1 * b0 + ((a0 * b0) >> _HALF)
    other = a0 * b1 + (middle & _LOW)
    return a1 * b1 + (middle >> _HALF) + (other >> _HALF), a * b


@helper
def _write_digits(number, text, end):
    count, beyond = 1, _TEN
    while number >= beyond:  # numbers have 19 digits at most
        count, beyond = count + 1, beyond * _TEN
    for place in range(end + count - 1, end - 1, -1):
        text[place] = _DIGIT + np.uint8(number % _TEN)
        number //= _TEN
    return end + count


@helper
def _write_point(point, text, begin, end):
    """Put a decimal point into, before or behind digits."""
    if point >= end - begin:
        for place in range(end, begin + point):
            text[place] = _DIGIT
        text[begin + point], text[begin + point + 1] = _POINT, _DIGIT
        return begin + point + 2
    shift = 1 if point > 0 else 2 - point
    first = begin + max(point, 0)
    for place in range(end - 1, first - 1, -1):
        text[place + shift] = text[place]
    if point <= 0:
        for place in range(begin, first + shift):
            text[place] = _DIGIT
        text[begin + 1] = _POINT
    else:
        text[first] = _POINT
    return end + shift


@helper
def _write_exponent(exponent, text, begin, end):
    """Put a decimal point behind the first of some digits, if there are more, and an exponent behind them."""
    if end > begin + 1:
        for place in range(end - 1, begin, -1):
            text[place + 1] = text[place]
        text[begin + 1] = _POINT
        end += 1
    text[end], text[end + 1] = _E, _MINUS if exponent < 0 else _PLUS
    end += 2
    if abs(exponent) < 10:
        text[end] = _DIGIT
        end += 1
    return _write_digits(np.uint64(abs(exponent)), text, end)
