"""Distributions of sizes: what they say, and what they refuse."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from porefv.dem.sizes import Grading, UniformSizes
from porefv.errors import InputError


def test_uniform_radii_are_spread_evenly_between_the_ratio_and_one():
    radii = np.sort(UniformSizes(0.3).draw(1001, np.random.default_rng(0)))
    assert_allclose(radii, np.linspace(0.3, 1.0, 1001))


def test_grains_drawn_from_a_grading_have_its_curve_by_mass():
    sieves, passing = [1.0, 2.0, 4.0, 5.0], [0.0, 0.3, 0.8, 1.0]
    diameters = 2.0 * Grading(sieves, passing).draw(50_000, np.random.default_rng(0))
    mass = diameters**3
    assert diameters.min() >= 1.0 and diameters.max() <= 5.0
    # On the sieves, and half-way between two of them over the logarithm of the diameter.
    for d, fraction in [(2.0, 0.3), (4.0, 0.8), (np.sqrt(2.0), 0.15), (np.sqrt(20.0), 0.9)]:
        # An even spacing by number misses the curve by no more than the mass of one grain, 1e-3 with the largest.
        assert_allclose(mass[diameters <= d].sum() / mass.sum(), fraction, atol=1e-3)


def test_two_equal_sieves_hold_grains_of_one_size():
    diameters = 2.0 * Grading([1.0, 1.0, 3.0, 3.0], [0.0, 0.5, 0.5, 1.0]).draw(28_000, np.random.default_rng(0))
    assert np.unique(diameters.round(12)).tolist() == [1.0, 3.0]
    assert np.count_nonzero(diameters < 2.0) == 27_000  # as heavy as the others: 27 to 1


@pytest.mark.parametrize(
    ("make", "said"),
    [
        (lambda: UniformSizes(0.0), "ratio"),
        (lambda: UniformSizes(1.5), "ratio"),
        (lambda: Grading([1.0], [1.0]), "diameters"),
        (lambda: Grading([2.0, 1.0], [0.0, 1.0]), "diameters"),
        (lambda: Grading([1.0, 2.0], [0.0, 0.5, 1.0]), "passing must have a fraction for each of the 2"),
        (lambda: Grading([1.0, 2.0], [0.0, 100.0]), "not per cent"),
        (lambda: Grading([1.0, 2.0, 3.0], [0.0, 1.2, 1.0]), "passing must rise"),
    ],
)
def test_sizes_out_of_range_are_refused(make, said):
    with pytest.raises(InputError, match=said):
        make()
