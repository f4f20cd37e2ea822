"""Terzaghi's solution: published values, its equation, its limits."""

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.integrate import trapezoid

from porefv import InputError
from porefv.coupling.consolidation import (
    consolidation_coefficient,
    critical_gradient,
    terzaghi_pressure,
    terzaghi_settlement,
)


@pytest.mark.parametrize(("t", "u"), [(0.008, 0.10), (0.197, 0.50), (0.848, 0.90)])
def test_degree_of_consolidation_is_that_of_the_tables(t, u):
    assert_allclose(terzaghi_settlement(t), u, atol=1e-3)


@pytest.mark.parametrize("t", [5e-5, 9e-4, 0.05, 0.5, 2.0])
def test_settlement_is_the_mean_of_the_pressure_that_is_gone(t):
    z = np.linspace(0.0, 1.0, 20_001)
    assert_allclose(terzaghi_settlement(t), 1.0 - trapezoid(terzaghi_pressure(z, t), z), atol=1e-7)


def test_pressure_diffuses():
    # ∂p/∂T = ∂²p/∂Z².
    z, t, h = np.linspace(0.05, 0.95, 10), 0.1, 1e-4
    rate = (terzaghi_pressure(z, t + h) - terzaghi_pressure(z, t - h)) / (2 * h)
    curvature = (terzaghi_pressure(z + h, t) - 2 * terzaghi_pressure(z, t) + terzaghi_pressure(z - h, t)) / h**2
    assert_allclose(rate, curvature, rtol=1e-5)


def test_early_and_late_forms_meet():
    z = np.linspace(0.0, 2.0, 81)
    assert_allclose(terzaghi_pressure(z, 0.999999e-4), terzaghi_pressure(z, 1.000001e-4), atol=1e-5)
    assert_allclose(terzaghi_settlement(0.999999e-3), terzaghi_settlement(1.000001e-3), rtol=1e-5)


def test_ends_drain_the_middle_does_not_and_both_sides_are_alike():
    z = np.linspace(0.0, 1.0, 11)
    assert_allclose(terzaghi_pressure([0.0, 2.0], 0.3), 0.0, atol=1e-12)
    assert_allclose(terzaghi_pressure(z, 0.3), terzaghi_pressure(2.0 - z, 0.3), atol=1e-12)
    assert_allclose(terzaghi_pressure([0.0, 0.5, 1.0], 0.0), [0.0, 1.0, 1.0])


def test_negative_times_are_refused():
    with pytest.raises(InputError, match="time factor"):
        terzaghi_settlement(-0.1)


def test_coefficients():
    assert_allclose(consolidation_coefficient(2.3e-6, 5.895e6, 250.0), 0.0542, rtol=1e-3)
    assert_allclose(critical_gradient(0.4, 2600.0, 1000.0), 0.96)
