import itertools

import numpy as np
import pytest

from porefv.tessellation.ordering import morton_codes, rounds


@pytest.mark.parametrize("n", [1, 2, 999, 1000, 1001, 20_000, 123_457])
def test_rounds_hold_every_sphere_once_and_double_in_size(n):
    parts = rounds(n)
    np.testing.assert_array_equal(np.concatenate([np.arange(n)[part] for part in parts]), np.arange(n))
    ends = [part.stop for part in parts]
    assert all(b in (2 * a, 2 * a + 1) for a, b in itertools.pairwise(ends))
    assert ends[0] <= 1000


def test_morton_codes_interleave_the_bits_of_the_grid():
    points = np.random.default_rng(0).random((200, 3))
    points[0], points[1] = 0.0, 1.0  # the grid spans exactly the unit cube
    grid = (points * (2**20 - 1)).astype(np.int64)
    wanted = [sum(int(g[axis] >> bit & 1) << (3 * bit + axis) for bit in range(20) for axis in range(3)) for g in grid]
    np.testing.assert_array_equal(morton_codes(points), wanted)


def test_morton_codes_of_a_single_place_are_zero():
    assert morton_codes(np.full((3, 3), 0.25)).tolist() == [0, 0, 0]
