"""Clouds: grains apart, inside, at the porosity, by seed."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from porefv.dem.random_placement import cloud
from porefv.dem.sizes import Grading, UniformSizes
from porefv.errors import InputError
from porefv.packing.box import Box

CUBE = Box([0, 0, 0], [1, 1, 1])
HALF = UniformSizes(0.5)


@pytest.mark.parametrize("sizes", [HALF, UniformSizes(0.05), Grading([1.0, 30.0], [0.0, 1.0])], ids=["2", "20", "30"])
def test_grains_of_a_cloud_are_apart_and_inside_at_the_porosity(sizes):
    box = Box([-1, 0, 3], [1, 1, 4])
    packing = cloud(3000, sizes, box, 0.7, seed=4)
    assert len(packing.overlaps.pairs) == 0
    assert len(packing.overlaps.wall_ids) == 0
    assert_allclose(packing.porosity, 0.7, rtol=1e-12)


def test_clouds_repeat_by_seed():
    one, again, other = (cloud(100, HALF, CUBE, 0.8, seed=seed) for seed in (1, 1, 2))
    assert np.array_equal(one.centres, again.centres) and np.array_equal(one.radii, again.radii)
    assert not np.array_equal(one.centres, other.centres)


def test_places_in_a_cloud_are_spread_over_the_box():
    # Mean of n uniform places: 0.5 within 4 standard deviations of 1/sqrt(12 n); grains are small here.
    centres = cloud(20_000, UniformSizes(1.0), CUBE, 0.99, seed=1).centres
    assert_allclose(centres.mean(axis=0), 0.5, atol=4.0 / np.sqrt(12 * 20_000))
    counts = np.histogramdd(centres, bins=2, range=[(0, 1)] * 3)[0]
    assert_allclose(counts, 2500, atol=4.0 * np.sqrt(2500))


def test_a_cloud_that_finds_no_room_says_how_far_it_came():
    with pytest.raises(InputError, match=r"porosity 0.5 cannot be reached .* at porosity 0\.[56]\d\d; ask for a high"):
        cloud(500, UniformSizes(1.0), CUBE, 0.5)
    with pytest.raises(InputError, match="the largest of 1 grains is .* wide"):
        cloud(1, UniformSizes(1.0), CUBE, 0.4)
