"""The incomplete factor without fill, and BiCGStab with it."""

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy import sparse
from scipy.sparse.linalg import spsolve

from porefv.transport.incomplete_factor import bicgstab, factored, multiply, rows_of, solve_factors


@pytest.fixture
def matrix():
    """An M-matrix of 300 unknowns, not symmetric."""
    rng = np.random.default_rng(5)
    dense = np.where(rng.random((300, 300)) < 0.02, rng.random((300, 300)), 0.0)
    np.fill_diagonal(dense, 0.0)
    off = sparse.csr_array(dense)
    return sparse.csr_array(sparse.diags_array(off.sum(axis=1) + 0.1) - off)


def test_the_rows_are_those_of_the_matrix(matrix):
    x, out = np.random.default_rng(6).normal(size=300), np.empty(300)
    multiply(rows_of(matrix), x, out)
    assert_allclose(out, matrix @ x, atol=1e-12)


def test_a_matrix_whose_factor_has_no_fill_is_solved_at_once():
    ladder = sparse.csr_array(sparse.diags_array([[-1.0] * 49, [3.0] * 50, [-0.5] * 49], offsets=[-1, 0, 1]))
    b, x = np.arange(50.0), np.empty(50)
    solve_factors(factored(rows_of(ladder)), b, x)
    assert_allclose(x, spsolve(ladder.tocsc(), b), rtol=1e-12)


def test_iterations_end_at_the_solution(matrix):
    rows, b = rows_of(matrix), np.random.default_rng(7).normal(size=300)
    factors = factored(rows)
    x, iterations = bicgstab(rows, lambda r, z: solve_factors(factors, r, z), b, 1e-11, 200)
    assert iterations < 200
    assert_allclose(x, spsolve(matrix.tocsc(), b), atol=1e-8)
