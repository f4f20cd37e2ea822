"""Exact floating-point arithmetic: sums and products of doubles kept as expansions.

An expansion is a short array of doubles, of increasing magnitude and without overlapping bits, whose
exact sum is the number meant. Shewchuk (1997), "Adaptive precision floating-point arithmetic and fast
robust geometric predicates", Discrete Comput. Geom. 18:305-363, proves the algorithms used here. Exact as long as no
product underflows, which `RegularTriangulation` ensures by scaling.

Every function writes into an array of its caller and returns the number of components written
(zero components are left out, so that an empty expansion is the number 0).
"""

from __future__ import annotations

import numpy as np

from porefv.system.kernels import helper

_SPLITTER = 134217729.0  # 2**27 + 1 cuts a double in two halves of 26 bits


@helper(forceinline=False)
def two_sum(a, b):
    """The sum a + b as (rounded, error), exactly."""
    x = a + b
    bv = x - a
    return x, (a - (x - bv)) + (b - bv)


@helper(forceinline=False)
def two_product(a, b):
    """The product a b as (rounded, error), exactly."""
    x = a * b
    c = _SPLITTER * a
    a_high = c - (c - a)
    a_low = a - a_high
    c = _SPLITTER * b
    b_high = c - (c - b)
    b_low = b - b_high
    return x, a_low * b_low - (((x - a_high * b_high) - a_low * b_high) - a_high * b_low)


@helper(forceinline=False)
def add(e, ne, f, nf, h):
    """Sum of two expansions into `h` (room for ne + nf; neither input may share memory with it).

    Parameters
    ----------
    e, f : float64 arrays
        The expansions.
    ne, nf : int
        Number of components of each.
    h : float64 array
        Is overwritten with the sum.
    """
    i = 0
    j = 0
    n = 0
    q = 0.0
    first = True
    while i < ne or j < nf:
        # Merge by magnitude, so that each partial sum meets the next larger component.
        if j >= nf or (i < ne and abs(e[i]) < abs(f[j])):
            g = e[i]
            i += 1
        else:
            g = f[j]
            j += 1
        if first:
            q = g
            first = False
        else:
            q, low = two_sum(q, g)
            if low != 0.0:
                h[n] = low
                n += 1
    if q != 0.0:
        h[n] = q
        n += 1
    return n


@helper(forceinline=False)
def scale(e, ne, b, h):
    """Product of an expansion and a double into `h` (room for 2 ne).

    Parameters
    ----------
    e : float64 array
        The expansion.
    ne : int
        Number of its components.
    b : float
    h : float64 array
        Is overwritten with the product; shares no memory with `e`.
    """
    if ne == 0 or b == 0.0:
        return 0
    n = 0
    q, low = two_product(e[0], b)
    if low != 0.0:
        h[n] = low
        n += 1
    for i in range(1, ne):
        high, low = two_product(e[i], b)
        s, error = two_sum(q, low)
        if error != 0.0:
            h[n] = error
            n += 1
        q, error = two_sum(high, s)
        if error != 0.0:
            h[n] = error
            n += 1
    if q != 0.0:
        h[n] = q
        n += 1
    return n


@helper(forceinline=False)
def multiply(e, ne, f, nf, h):
    """Product of two expansions into `h` (room for 2 ne nf).

    Parameters
    ----------
    e, f : float64 arrays
        The expansions.
    ne, nf : int
        Number of components of each.
    h : float64 array
        Is overwritten with the product; shares no memory with `e` and `f`.
    """
    if ne < nf:
        e, ne, f, nf = f, nf, e, ne
    if nf == 0:
        return 0
    if nf == 1:
        return scale(e, ne, f[0], h)
    part = np.empty(2 * ne)
    total = np.empty(2 * ne * nf)
    n = scale(e, ne, f[0], h)
    for k in range(1, nf):
        m = scale(e, ne, f[k], part)
        for i in range(n):
            total[i] = h[i]
        n = add(total, n, part, m, h)
    return n


@helper(forceinline=False)
def estimate(e, ne):
    """The double nearest to an expansion, to within a rounding or two."""
    value = 0.0
    for i in range(ne):
        value += e[i]
    return value


@helper(forceinline=False)
def sign(e, ne):
    """-1, 0 or 1: the sign of an expansion is that of its largest component."""
    if ne == 0:
        return 0
    return 1 if e[ne - 1] > 0.0 else -1
