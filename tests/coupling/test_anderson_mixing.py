"""Rounds of a fixed-point iteration, extrapolated: they end where plain ones would, sooner, and where these do not."""

import numpy as np
from numpy.testing import assert_allclose

from porefv.coupling.anderson_mixing import AndersonMixing


def rounds(matrix, b, count, kept):
    """x after so many rounds of x = b + M x."""
    mixing, x = AndersonMixing(kept), np.zeros(len(b))
    for _ in range(count):
        x = mixing.next(x, b + matrix @ x)
    return x


def test_a_linear_iteration_of_n_unknowns_ends_in_n_rounds():
    rng = np.random.default_rng(0)
    directions = np.linalg.qr(rng.normal(size=(6, 6)))[0]
    matrix = directions @ np.diag([0.999, 0.9, 0.5, 0.1, -0.3, 0.98]) @ directions.T
    b = rng.normal(size=6)
    exact = np.linalg.solve(np.eye(6) - matrix, b)
    assert_allclose(rounds(matrix, b, 8, 20), exact, rtol=1e-6)
    plain = sum(np.linalg.matrix_power(matrix, k) for k in range(8)) @ b
    assert np.abs(plain - exact).max() > 0.1 * np.abs(exact).max()


def test_it_ends_where_plain_rounds_move_away():
    assert_allclose(rounds(np.diag([-2.0, 1.5]), np.array([3.0, 1.0]), 4, 20), [1.0, -2.0], rtol=1e-6)


def test_a_round_that_changes_nothing_is_the_end():
    assert_allclose(rounds(np.zeros((3, 3)), np.ones(3), 5, 20), np.ones(3))
