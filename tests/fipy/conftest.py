"""What tests of FiPy share: the matrix that FiPy assembles."""

import numpy as np
import pytest
import scipy.sparse as sp

fipy = pytest.importorskip("fipy")


@pytest.fixture
def assembled():
    """assembled(equation, var, dt): matrix and right-hand side of A x = b as FiPy assembles them."""

    def assemble(equation, var, dt=None):
        equation.cacheMatrix()
        equation.cacheRHSvector()
        before = var.value.copy()
        equation.sweep(var=var, dt=dt, solver=fipy.DummySolver())
        var.setValue(before)
        return sp.csr_array(equation.matrix.matrix, copy=True), np.array(equation.RHSvector)

    return assemble
