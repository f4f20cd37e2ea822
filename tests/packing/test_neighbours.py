import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from porefv.errors import InputError
from porefv.packing.neighbours import neighbour_pairs
from porefv.system.threads import limited_threads


def brute_force(centres, radii, gap=0.0):
    """The definition, with the same order of floating-point operations, so that agreement is exact."""
    i, j = np.triu_indices(len(radii), k=1)
    dx, dy, dz = (centres[j] - centres[i]).T
    near = dx * dx + dy * dy + dz * dz < (radii[i] + radii[j] + gap) ** 2
    return np.column_stack((i[near], j[near]))


def random_spheres(seed, n, ratio, extent):
    rng = np.random.default_rng(seed)
    return rng.random((n, 3)) * extent, ratio ** -rng.random(n)


@settings(max_examples=200, deadline=None)
@given(
    seed=st.integers(0, 2**32),
    n=st.integers(1, 120),
    ratio=st.sampled_from([1.0, 2.0, 30.0, 1000.0]),
    extent=st.sampled_from([(3, 3, 3), (10, 10, 10), (100, 1, 1), (20, 20, 0), (50, 0, 0), (1e-3, 1e-3, 1e-3)]),
    gap=st.sampled_from([0.0, 0.01, 1.0]),
    scale=st.sampled_from([1e-9, 1.0, 1e6]),
    offset=st.sampled_from([0.0, 1e3]),
)
def test_pairs_are_those_of_brute_force(seed, n, ratio, extent, gap, scale, offset):
    centres, radii = random_spheres(seed, n, ratio, extent)
    centres, radii, gap = (centres + offset) * scale, radii * scale, gap * scale
    np.testing.assert_array_equal(neighbour_pairs(centres, radii, gap), brute_force(centres, radii, gap))


@settings(max_examples=50, deadline=None)
@given(
    n=st.integers(1, 5),
    radius=st.sampled_from([0.5, 0.51, 0.1, np.nextafter(0.5, 1), np.sqrt(0.5), 1.0]),
    scale=st.sampled_from([1.0, 0.1, 1e-9, 1 / 3]),
)
def test_pairs_on_a_cubic_lattice_are_those_of_brute_force(n, radius, scale):
    centres = np.mgrid[:n, :n, :n].reshape(3, -1).T * scale
    radii = np.full(n**3, radius * scale)
    np.testing.assert_array_equal(neighbour_pairs(centres, radii), brute_force(centres, radii))


@pytest.mark.parametrize("size", [2.0**-k for k in range(0, 12)])
def test_small_spheres_all_around_a_large_one_are_found(size):
    rng = np.random.default_rng(0)
    directions = rng.normal(size=(300, 3))
    directions /= np.linalg.norm(directions, axis=1)[:, None]
    # Half of them overlap the large sphere by a thousandth of their radius, half miss it by as much.
    distances = 1 + size * np.where(np.arange(300) % 2, 1.001, 0.999)
    centres = np.concatenate(([[0, 0, 0]], directions * distances[:, None])) + 7.0
    radii = np.concatenate(([1.0], np.full(300, size)))
    pairs = neighbour_pairs(centres, radii)
    np.testing.assert_array_equal(pairs[pairs[:, 0] == 0, 1], np.arange(1, 301, 2))


def test_exactly_touching_spheres_are_not_a_pair():
    assert len(neighbour_pairs([[0, 0, 0], [1, 0, 0]], [0.5, 0.5])) == 0
    assert len(neighbour_pairs([[0, 0, 0], [1, 0, 0]], [0.5, 0.5 + 2.0**-52])) == 1


def test_pairs_are_int32_in_lexicographic_order_whatever_the_number_of_threads():
    centres, radii = random_spheres(1, 5000, 10.0, (10, 10, 10))
    pairs = neighbour_pairs(centres, radii)
    assert pairs.dtype == np.int32 and (pairs[:, 0] < pairs[:, 1]).all()
    np.testing.assert_array_equal(pairs, pairs[np.lexsort((pairs[:, 1], pairs[:, 0]))])
    with limited_threads(1):
        np.testing.assert_array_equal(neighbour_pairs(centres, radii), pairs)


def test_a_dense_cluster_of_fines_in_a_large_box_is_not_quadratic():
    # All fines lie in one cell of any uniform grid: tests of all pairs (2e10) would take a minute.
    rng = np.random.default_rng(2)
    centres = np.concatenate((rng.random((100, 3)), 1e-3 * rng.random((200_000, 3))))
    radii = np.concatenate((np.full(100, 0.01), np.full(200_000, 1e-6)))
    pairs = neighbour_pairs(centres, radii)
    some = rng.choice(np.arange(100, 200_100), 20, replace=False)
    for i in some:
        d = np.linalg.norm(centres - centres[i], axis=1)
        expected = np.setdiff1d(np.flatnonzero(d < radii + radii[i]), [i])
        found = np.concatenate((pairs[pairs[:, 0] == i, 1], pairs[pairs[:, 1] == i, 0]))
        np.testing.assert_array_equal(np.sort(found), expected)


def test_radii_in_another_unit_than_centres_are_an_error_not_an_exhausted_memory():
    centres, radii = random_spheres(3, 100_000, 1.0, (1, 1, 1))
    with pytest.raises(InputError, match="same unit"):
        neighbour_pairs(centres, radii)


@pytest.mark.parametrize(
    ("centres", "radii", "gap"),
    [
        (np.zeros((2, 2)), np.ones(2), 0.0),
        (np.zeros((2, 3)), np.ones(3), 0.0),
        (np.zeros((0, 3)), np.ones(0), 0.0),
        (np.full((1, 3), np.nan), np.ones(1), 0.0),
        (np.zeros((1, 3)), np.zeros(1), 0.0),
        (np.zeros((1, 3)), np.ones(1), -1.0),
        (np.zeros((1, 3)), np.ones(1), np.nan),
    ],
)
def test_bad_arguments_are_refused(centres, radii, gap):
    with pytest.raises(InputError):
        neighbour_pairs(centres, radii, gap)
