"""The patch of FiPy's gradient can be taken back, and comes with each mesh of a fluid."""

import numpy as np
import pytest

pytest.importorskip("fipy")
patch = pytest.importorskip("porefv.fipy.gradient_patch")


def test_the_patch_can_be_taken_back(mesh_of):
    import fipy

    fluid = mesh_of("n25_s1").to_fipy()
    height = fipy.CellVariable(mesh=fluid, value=fluid.z)
    upwards = height.grad.value[2].copy()
    np.testing.assert_allclose(upwards, 1.0, atol=1e-8)
    patch.restore_gradient()
    try:
        again = fipy.CellVariable(mesh=fluid, value=fluid.z)
        assert np.abs(again.grad.value[2] - 1.0).max() > 0.1
    finally:
        patch.patch_gradient()
