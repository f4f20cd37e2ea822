"""The iteration of conjugate gradients, on dense matrices."""

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from porefv.solvers.conjugate_gradients import preconditioned_cg
from porefv.solvers.network import BLOCK


class Dense:
    def __init__(self, matrix):
        self.matrix = matrix

    def multiply(self, q, aq):
        aq[:] = self.matrix @ q
        return float(q @ aq)


class Diagonal:
    def __init__(self, diagonal):
        self.diagonal = diagonal

    def multiply(self, q, aq):
        aq[:] = self.diagonal * q
        return float(q @ aq)


class Jacobi:
    def __init__(self, diagonal):
        self.diagonal = diagonal

    def apply(self, r, z):
        z[:] = r / self.diagonal
        return float(r @ z)


class Until:
    """Stop below a bound on r·M⁻¹r, or on Σ|r|."""

    def __init__(self, rz=-1.0, lost=-1.0):
        self.bounds = rz, lost

    def met_before(self, rz):
        return rz <= self.bounds[0]

    def met_after(self, iterations, lost):
        return lost <= self.bounds[1]


def system(n, seed=0):
    rng = np.random.default_rng(seed)
    root = rng.normal(size=(n, n))
    return root @ root.T + n * np.eye(n), rng.normal(size=n)


@pytest.mark.parametrize("rule", [Until(rz=1e-24), Until(lost=1e-10)])
def test_a_positive_definite_system_is_solved(rule):
    matrix, rhs = system(30)
    x, r = np.zeros(30), rhs.copy()
    iterations, met = preconditioned_cg(Dense(matrix), Jacobi(np.diag(matrix)), x, r, rule, 60)
    assert met and iterations <= 60
    assert_allclose(x, np.linalg.solve(matrix, rhs), rtol=1e-9)
    # The residual that is carried along is that of the result.
    assert_allclose(r, rhs - matrix @ x, atol=1e-12 * np.abs(rhs).sum())


def test_in_exact_arithmetic_as_many_iterations_as_eigenvalues_are_enough():
    n = 2 * BLOCK + 5  # several blocks
    diagonal = 1.0 + np.arange(n) % 3
    rhs = np.random.default_rng(1).normal(size=n)
    x = np.zeros(n)
    iterations, met = preconditioned_cg(
        Diagonal(diagonal), Jacobi(np.ones(n)), x, rhs.copy(), Until(lost=1e-8 * np.abs(rhs).sum()), 10
    )
    assert met and iterations == 3
    assert_allclose(x, rhs / diagonal, rtol=1e-6)


def test_a_start_that_is_good_enough_is_kept():
    matrix, rhs = system(10)
    x = np.linalg.solve(matrix, rhs)
    before = x.copy()
    r = rhs - matrix @ x
    assert preconditioned_cg(Dense(matrix), Jacobi(np.diag(matrix)), x, r, Until(rz=1e-20), 10) == (0, True)
    assert_array_equal(x, before)


def test_the_rule_is_not_met_where_iterations_are_too_few_or_the_matrix_is_not_positive():
    matrix, rhs = system(20)
    jacobi = Jacobi(np.diag(matrix))
    assert preconditioned_cg(Dense(matrix), jacobi, np.zeros(20), rhs.copy(), Until(rz=1e-24), 2) == (2, False)
    assert preconditioned_cg(Dense(-matrix), jacobi, np.zeros(20), rhs.copy(), Until(rz=1e-24), 20) == (1, False)
    rhs[3] = np.nan
    assert preconditioned_cg(Dense(matrix), jacobi, np.zeros(20), rhs, Until(rz=1e-24), 20) == (0, False)
