"""The pressure equation on networks small enough to solve by hand, and in rational numbers."""

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from porefv.errors import ComputationError
from porefv.solvers.pressure_equation import solve_network

METHODS = ["direct", "cg"]
NAN = np.nan


def random_network(n, decades, seed):
    rng = np.random.default_rng(seed)
    tree = np.stack([np.arange(1, n), (rng.random(n - 1) * np.arange(1, n)).astype(int)], axis=1)
    pairs = np.concatenate([tree, rng.integers(0, n, (2 * n, 2))])
    pairs = pairs[pairs[:, 0] != pairs[:, 1]]
    fixed = np.full(n, NAN)
    fixed[[0, n - 1]] = 1.0, 0.0
    return pairs, 10.0 ** rng.uniform(-decades, 0, len(pairs)), fixed


@pytest.mark.parametrize("solver", METHODS)
def test_three_throats_in_series_and_two_side_by_side(solver):
    #  1 bar —2— . —1— . —(1 and 3)— 0 bar: resistances 1/2, 1, 1/4
    pairs = np.array([[0, 1], [1, 2], [2, 3], [3, 2]])
    solution = solve_network(pairs, np.array([2.0, 1.0, 1.0, 3.0]), np.array([1.0, NAN, NAN, 0.0]), solver=solver)
    assert_allclose(solution.pressure, [1.0, 1 - 0.5 / 1.75, 0.25 / 1.75, 0.0], rtol=1e-12)
    assert not solution.isolated.any()


@pytest.mark.parametrize("solver", METHODS)
@pytest.mark.parametrize("decades", [0, 3, 6, 12])
def test_flow_is_that_of_the_exact_solution(exact_solution, solver, decades):
    for seed in range(4):
        pairs, k, fixed = random_network(16, decades, seed)
        exact = np.array(exact_solution(pairs, k, fixed), float)
        solution = solve_network(pairs, k, fixed, solver=solver)
        i, j = pairs.T

        def inflow(p, pairs=pairs, k=k, i=i, j=j):
            return (k * (p[i] - p[j]))[i == 0].sum() - (k * (p[i] - p[j]))[j == 0].sum()

        # As much as the tolerance loses, and what rounding of pressures near 1 costs at an inlet of conductance 1.
        largest = np.array([k[(i == v) | (j == v)].sum() for v in range(16)]).max()
        assert_allclose(inflow(solution.pressure), inflow(exact), rtol=1e-10, atol=1e-14 * largest)
        if decades <= 3:
            assert_allclose(solution.pressure, exact, rtol=0, atol=1e-9)


@pytest.mark.parametrize("solver", METHODS)
def test_pressures_stay_within_the_imposed_ones(solver):
    for seed in range(5):
        pairs, k, fixed = random_network(200, 12, seed)
        p = solve_network(pairs, k, fixed, solver=solver).pressure
        assert p.min() >= -1e-12 and p.max() <= 1 + 1e-12  # the maximum principle, but for rounding


@pytest.mark.parametrize("solver", METHODS)
def test_imposed_pressures_are_kept_to_the_bit(solver):
    pairs, k, fixed = random_network(50, 3, 0)
    fixed[[3, 20]] = 0.1, 0.7
    p = solve_network(pairs, k, fixed, solver=solver).pressure
    held = ~np.isnan(fixed)
    assert_array_equal(p[held], fixed[held])


def test_with_every_pore_imposed_there_is_nothing_to_solve():
    solution = solve_network(np.array([[0, 1]]), np.array([1.0]), np.array([1.0, 0.0]))
    assert_array_equal(solution.pressure, [1.0, 0.0])
    assert solution.report.unknowns == 0


# ---- sources ----------


@pytest.mark.parametrize("solver", METHODS)
def test_what_a_source_injects_leaves_through_the_imposed_pores(solver):
    # Σ K (p_i - p_j) = source
    pairs = np.array([[0, 1], [1, 2]])
    p = solve_network(
        pairs, np.array([1.0, 3.0]), np.array([0.0, NAN, 0.0]), sources=np.array([0.0, 2.0, 0.0]), solver=solver
    ).pressure
    assert_allclose(p, [0.0, 0.5, 0.0], rtol=1e-13)


@pytest.mark.parametrize("solver", METHODS)
def test_sources_and_imposed_pressures_superpose(solver):
    pairs, k, fixed = random_network(60, 2, 3)
    sources = np.zeros(60)
    sources[[5, 17]] = 1e-3, -2e-3
    none = np.where(np.isnan(fixed), NAN, 0.0)
    both = solve_network(pairs, k, fixed, sources=sources, solver=solver, tolerance=1e-12).pressure
    one = solve_network(pairs, k, fixed, solver=solver, tolerance=1e-12).pressure
    other = solve_network(pairs, k, none, sources=sources, solver=solver, tolerance=1e-12).pressure
    assert_allclose(both, one + other, rtol=0, atol=1e-10)
    i, j = pairs.T
    q = k * (both[i] - both[j])
    out = np.bincount(i, q, 60) - np.bincount(j, q, 60)
    free = np.isnan(fixed)
    assert_allclose(out[free], sources[free], rtol=0, atol=1e-14)
    assert_allclose(-out[~free].sum(), sources.sum(), rtol=0, atol=1e-13)


# ---- singular problems ----------


@pytest.mark.parametrize("solver", METHODS)
def test_without_an_imposed_pressure_there_is_no_solution(solver):
    with pytest.raises(ComputationError, match="no pore has an imposed pressure"):
        solve_network(np.array([[0, 1]]), np.array([1.0]), np.array([NAN, NAN]), solver=solver)


@pytest.mark.parametrize("solver", METHODS)
def test_isolated_pores_take_the_mean_of_their_neighbours_weighted_by_links(solver):
    # 0 — 1 — 2 flows; 3 hangs on 1 and 2 by closed throats, 4 on 3 by an open one, 5 on 0 by a closed one.
    pairs = np.array([[0, 1], [1, 2], [1, 3], [2, 3], [3, 4], [0, 5]])
    k = np.array([1.0, 1.0, 0.0, 0.0, 5.0, 0.0])
    fixed = np.array([1.0, NAN, 0.0, NAN, NAN, NAN])
    links = np.array([9.0, 9.0, 3.0, 1.0, 1.0, 2.0])
    solution = solve_network(pairs, k, fixed, links=lambda: links, solver=solver)
    assert_array_equal(solution.isolated, [False, False, False, True, True, True])
    assert_allclose(solution.pressure, [1.0, 0.5, 0.0, 0.375, 0.375, 1.0], rtol=1e-12)
    # Equal weights by default.
    solution = solve_network(pairs, k, fixed, solver=solver)
    assert_allclose(solution.pressure[3:5], 0.25, rtol=1e-12)


@pytest.mark.parametrize("solver", METHODS)
def test_a_part_of_the_network_without_imposed_pressure_is_isolated_or_an_error(solver):
    # Two pairs of pores, all throats open, nothing between the pairs: the second floats.
    pairs = np.array([[0, 1], [2, 3]])
    fixed = np.array([1.0, NAN, NAN, NAN])
    with pytest.raises(ComputationError):
        solve_network(pairs, np.array([1.0, 1.0]), fixed, solver=solver)
    with pytest.raises(ComputationError):  # the same where a closed throat elsewhere makes pores be looked at
        solve_network(np.array([[0, 1], [2, 3], [0, 1]]), np.array([1.0, 1.0, 0.0]), fixed, solver=solver)
    # With a closed throat between them its pressure is that of its surroundings.
    pairs = np.array([[0, 1], [2, 3], [1, 2]])
    solution = solve_network(pairs, np.array([1.0, 1.0, 0.0]), fixed, solver=solver)
    assert_allclose(solution.pressure, 1.0, rtol=1e-13)
    assert_array_equal(solution.isolated, [False, False, True, True])


def test_a_source_in_an_isolated_pore_is_an_error():
    pairs = np.array([[0, 1], [1, 2]])
    with pytest.raises(ComputationError, match="pore 2 has a source"):
        solve_network(pairs, np.array([1.0, 0.0]), np.array([1.0, NAN, NAN]), sources=np.array([0.0, 0.0, 1.0]))


@pytest.mark.parametrize("solver", METHODS)
def test_parts_that_no_path_joins_have_their_imposed_pressures_exactly(solver):
    # Two parts with conductances many decades apart, and a pore in neither.
    pairs = np.array([[0, 1], [1, 2], [0, 2], [3, 4], [4, 5], [2, 6], [6, 3]])
    k = np.array([1e-9, 3.7, 1.3e5, 0.7, 2.9e-12, 0.0, 0.0])
    fixed = np.array([0.3, NAN, NAN, NAN, NAN, 0.1, NAN])
    solution = solve_network(pairs, k, fixed, solver=solver)
    assert solution.pressure[:6].tolist() == [0.3] * 3 + [0.1] * 3 and not solution.rest[:6].any()
    assert solution.isolated.tolist() == [False] * 6 + [True] and 0.1 < solution.pressure[6] < 0.3


@pytest.mark.parametrize("solver", METHODS)
def test_a_source_raises_the_pressure_of_its_own_part_alone(solver):
    pairs, k = np.array([[0, 1], [1, 2], [3, 4]]), np.array([2.0, 1.0, 1.0])
    sources = np.array([0.0, 0.0, 4.0, 0.0, 0.0])
    solution = solve_network(pairs, k, np.array([1.0, NAN, NAN, 0.0, NAN]), sources=sources, solver=solver)
    assert_allclose(solution.pressure, [1.0, 3.0, 7.0, 0.0, 0.0], rtol=1e-12)
    assert solution.pressure[4] == 0.0
