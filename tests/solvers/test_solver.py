"""The solvers on networks of their own: conservation, contrast, agreement, repeatability."""

from fractions import Fraction

import numba
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.testing import assert_allclose, assert_array_equal

from porefv.errors import ComputationError, InputError
from porefv.solvers.approximate_cholesky import ApproximateCholesky
from porefv.solvers.network import Network
from porefv.solvers.solver import DIRECT_LIMIT, SOLVERS, TOLERANCE, Solver
from porefv.system import threads

METHODS = ["direct", "cg"]


def solve(network, rhs, solver="auto", tolerance=TOLERANCE):
    return Solver(network, solver).solve(rhs, tolerance)


def grid_links(m):
    """Links (t, 2) of a cubic grid of m³ nodes."""
    node = np.arange(m**3).reshape(m, m, m)
    return np.concatenate(
        [
            np.stack([node[:-1].ravel(), node[1:].ravel()], axis=1),
            np.stack([node[:, :-1].ravel(), node[:, 1:].ravel()], axis=1),
            np.stack([node[:, :, :-1].ravel(), node[:, :, 1:].ravel()], axis=1),
        ]
    )


def grid_network(m, decades, seed=0, fraction_leaking=0.1):
    """A grid of links over so many decades, some nodes leaking to pressures between 0 and 1: (network, rhs)."""
    rng = np.random.default_rng(seed)
    pairs = grid_links(m)
    weights = 10.0 ** rng.uniform(-decades, 0.0, len(pairs))
    leaks = np.where(rng.random(m**3) < fraction_leaking, 10.0 ** rng.uniform(-decades, 0.0, m**3), 0.0)
    leaks[0] = 1.0
    held = rng.random(m**3)
    held[0] = 1.0
    return Network.from_links(pairs, weights, leaks), leaks * held


def exact_imbalance(network, rhs, x):
    """Σ|b - A x| and half of Σ|e x - b| of these doubles, without rounding."""
    lost, flow = Fraction(0), Fraction(0)
    value = [Fraction(float(v)) for v in x]
    for i in range(len(network)):
        through = Fraction(float(network.leaks[i])) * value[i] - Fraction(float(rhs[i]))
        flow += abs(through)
        for k in range(network.starts[i], network.starts[i + 1]):
            through += Fraction(float(network.links[k])) * (value[i] - value[network.columns[k]])
        lost += abs(through)
    return float(lost), float(flow / 2)


# ---- the network ----------


def test_network_is_the_matrix_of_its_links_and_leaks():
    network = Network.from_links(
        np.array([[0, 1], [1, 2], [2, 1], [0, 2]]), np.array([1.0, 2.0, 3.0, 0.0]), np.array([0.5, 0.0, 4.0])
    )
    matrix = network.to_matrix().toarray()
    assert_array_equal(matrix, [[1.5, -1, 0], [-1, 6, -5], [0, -5, 9]])
    assert_array_equal(network.diagonal, [1.5, 6.0, 9.0])
    x, b = np.array([3.0, -1.0, 2.0]), np.array([1.0, 2.0, 3.0])
    assert_array_equal(network.residual(b, x), b - matrix @ x)
    assert len(network) == 3


# ---- solving ----------


@pytest.mark.parametrize("solver", METHODS)
@pytest.mark.parametrize("decades", [0, 3, 6, 12])
def test_imbalance_is_as_small_as_asked_and_as_reported(solver, decades):
    network, rhs = grid_network(9, decades)
    x, report = solve(network, rhs, solver)
    lost, flow = exact_imbalance(network, rhs, x)
    # What rounding leaves of the tolerance; the report itself carries some roundings of the residual.
    bound = max(report.tolerance, report.floor)
    assert report.imbalance <= bound
    assert lost / flow <= 2 * bound
    assert abs(lost / flow - report.imbalance) <= bound
    assert (report.name, report.unknowns) == (solver, 729)
    assert report.iterations >= 1


@pytest.mark.parametrize("solver", METHODS)
@pytest.mark.parametrize("decades", [0, 6, 12])
def test_pressures_stay_within_those_held(solver, decades):
    for seed in range(5):
        network, rhs = grid_network(8, decades, seed)
        x, _ = solve(network, rhs, solver)
        held = rhs[network.leaks > 0] / network.leaks[network.leaks > 0]
        # The maximum principle, but for rounding.
        assert x.min() >= held.min() - 1e-12 and x.max() <= held.max() + 1e-12


@pytest.mark.parametrize("decades", [0, 3, 6])
def test_direct_and_iterative_solutions_agree(decades):
    for seed in range(3):
        network, rhs = grid_network(12, decades, seed)
        direct, _ = solve(network, rhs, "direct", 1e-12)
        iterative, _ = solve(network, rhs, "cg", 1e-12)
        # Loss of 1e-12 of the flow across a resistance of 10^decades times the least one.
        assert_allclose(iterative, direct, atol=1e-12 * 10.0**decades, rtol=0)


@pytest.mark.parametrize("solver", METHODS)
@pytest.mark.parametrize("decades", [0, 3, 6, 12])
def test_a_chain_divides_the_pressure_by_its_resistances(solver, decades):
    # 501 links in series: the flow is 1 / Σ 1/K.
    k = 10.0 ** np.random.default_rng(4).uniform(-decades, 0, 501)
    n = 500
    leaks, rhs = np.zeros(n), np.zeros(n)
    leaks[0], leaks[-1] = k[0], k[-1]
    rhs[0] = k[0]
    network = Network.from_links(np.stack([np.arange(n - 1), np.arange(1, n)], axis=1), k[1:-1], leaks)
    x, report = solve(network, rhs, solver)
    expected = 1 - np.cumsum(1 / k)[:-1] / (1 / k).sum()
    # What a node loses of the flow changes pressures by no more than that part of the whole drop.
    assert_allclose(x, expected, rtol=0, atol=2 * max(report.tolerance, report.floor))
    assert (np.diff(x) <= max(report.tolerance, report.floor)).all()


@settings(max_examples=30)
@given(st.integers(2, 40), st.integers(0, 12), st.integers(0, 10**6))
def test_any_network_is_solved_by_both_methods(n, decades, seed):
    rng = np.random.default_rng(seed)
    tree = np.stack([np.arange(1, n), (rng.random(n - 1) * np.arange(1, n)).astype(int)], axis=1)
    pairs = np.concatenate([tree, rng.integers(0, n, (3 * n, 2))])
    pairs = pairs[pairs[:, 0] != pairs[:, 1]]
    weights = 10.0 ** rng.uniform(-decades, 0, len(pairs))
    leaks = np.where(rng.random(n) < 0.3, 10.0 ** rng.uniform(-decades, 0, n), 0.0)
    leaks[rng.integers(n)] = 1.0
    network = Network.from_links(pairs, weights, leaks)
    rhs = leaks * rng.random(n)
    for solver in METHODS:
        x, report = solve(network, rhs, solver)
        lost, flow = exact_imbalance(network, rhs, x)
        # Where all pressures are equal but for rounding there is no flow to compare with.
        assert lost <= 4 * max(report.tolerance * flow, np.finfo(float).eps * (network.diagonal @ np.abs(x)))


@pytest.mark.parametrize("scale", [1e-60, 1e-18, 1e12, 1e60])
@pytest.mark.parametrize("solver", METHODS)
def test_units_do_not_matter(solver, scale):
    network, rhs = grid_network(8, 6)
    scaled = Network.from_links(grid_links(8), *(scale * v for v in _weights_and_leaks(network)))
    x, report = solve(network, rhs, solver)
    y, scaled_report = solve(scaled, scale * rhs, solver)
    assert_allclose(y, x, rtol=0, atol=1e-10)
    z, _ = solve(network, scale * rhs, solver)
    assert_allclose(z / scale, x, rtol=0, atol=1e-10)
    assert abs(scaled_report.iterations - report.iterations) <= 2


def _weights_and_leaks(network):
    rng = np.random.default_rng(0)
    return 10.0 ** rng.uniform(-6, 0.0, len(network.links) // 2), network.leaks


@pytest.mark.parametrize("solver", SOLVERS)
def test_repeated_solutions_are_equal_to_the_bit(solver):
    network, rhs = grid_network(14, 6)
    one, two = (solve(network, rhs, solver)[0] for _ in range(2))
    assert_array_equal(one, two)


def test_solutions_do_not_depend_on_the_number_of_threads(monkeypatch):
    monkeypatch.setattr(threads, "processors", lambda: 3)
    network, rhs = grid_network(38, 6)  # large enough to be cut into parts
    with threads.limited_threads(1):
        one, _ = solve(network, rhs, "cg")
    assert_array_equal(one, solve(network, rhs, "cg")[0])


@pytest.mark.parametrize("order", ["along the grid", "at random"])
def test_networks_cut_into_parts_are_solved_as_any_other(order):
    m = 38
    rng = np.random.default_rng(1)
    pairs = grid_links(m)
    if order == "at random":  # nearly every node is then linked to a later part
        pairs = rng.permutation(m**3)[pairs]
    weights = 10.0 ** rng.uniform(-4, 0, len(pairs))
    leaks = np.zeros(m**3)
    leaks[pairs[0, 0]], leaks[pairs[-1, 1]] = 1.0, 1.0
    network = Network.from_links(pairs, weights, leaks)
    assert len(ApproximateCholesky.of(network).parts) > 1
    rhs = np.zeros(m**3)
    rhs[pairs[0, 0]] = 1.0
    x, report = solve(network, rhs, "cg")
    assert report.imbalance <= max(1e-12, report.floor)
    assert report.iterations < 100  # hardly depends on size and contrast; without a preconditioner: thousands
    through = x[pairs[-1, 1]]  # leaks of 1: what enters at one end leaves at the other
    assert_allclose(1.0 - x[pairs[0, 0]], through, rtol=1e-10)


@numba.njit
def numbers_after(seed, count):
    np.random.seed(seed)
    return more_numbers(count)


@numba.njit
def more_numbers(count):
    found = np.empty(count)
    for i in range(count):
        found[i] = np.random.random()
    return found


def test_solving_leaves_the_random_numbers_of_the_caller_alone():
    expected = numbers_after(7, 20)
    state = np.random.get_state()[1].copy()
    begin = numbers_after(7, 10)
    solve(*grid_network(12, 6), "cg")
    assert_array_equal(np.concatenate([begin, more_numbers(10)]), expected)
    assert_array_equal(np.random.get_state()[1], state)


def test_preconditioner_is_symmetric_and_positive():
    network, _rhs = grid_network(10, 8)
    m = ApproximateCholesky.of(network)
    rng = np.random.default_rng(0)
    for _ in range(5):
        a, b = rng.normal(size=(2, len(network)))
        x, y = np.empty((2, len(network)))
        ax = m.apply(a, x)
        m.apply(b, y)
        # Rounding of sums of both signs, relative to their terms.
        assert_allclose(b @ x, a @ y, rtol=0, atol=1e-12 * (np.abs(b) @ np.abs(x) + np.abs(a) @ np.abs(y)))
        assert ax > 0.0
        assert_allclose(ax, a @ x, rtol=1e-12)


def test_preconditioner_is_exact_where_elimination_makes_no_fill():
    # A chain: each elimination joins two neighbours, nothing is sampled away.
    n = 100
    k = 10.0 ** np.random.default_rng(0).uniform(-3, 0, n - 1)
    leaks = np.zeros(n)
    leaks[0] = 1.0
    network = Network.from_links(np.stack([np.arange(n - 1), np.arange(1, n)], axis=1), k, leaks)
    b = np.random.default_rng(1).random(n)
    # Factors are kept in single precision.
    expected = np.linalg.solve(network.to_matrix().toarray(), b)
    found = np.empty(n)
    ApproximateCholesky.of(network).apply(b, found)
    assert_allclose(found, expected, rtol=1e-5)


# ---- the interface ----------


def test_auto_is_direct_for_small_networks_and_iterative_for_large():
    small, large = grid_network(12, 0), grid_network(13, 0)
    assert len(small[0]) <= DIRECT_LIMIT < len(large[0])
    assert solve(*small)[1].name == "direct"
    assert solve(*large)[1].name == "cg"


@pytest.mark.parametrize("solver", METHODS)
def test_without_any_drive_the_solution_is_zero(solver):
    network, rhs = grid_network(5, 3)
    x, report = solve(network, 0.0 * rhs, solver)
    assert not x.any() and report.imbalance == 0.0


@pytest.mark.parametrize("solver", METHODS)
def test_a_singular_network_is_an_error_not_a_number(solver):
    # Nodes 1 and 2 are joined to each other only.
    network = Network.from_links(np.array([[1, 2]]), np.array([1.0]), np.array([1.0, 0.0, 0.0]))
    with pytest.raises(ComputationError):
        solve(network, np.array([1.0, 0.0, 0.0]), solver)


@pytest.mark.parametrize("solver", METHODS)
def test_equal_held_pressures_everywhere_leave_no_flow(solver):
    network, _ = grid_network(8, 6)
    x, report = solve(network, 3.0 * network.leaks, solver)
    # The floor: nothing flows but what rounding makes.
    assert_allclose(x, 3.0, rtol=1e-9)
    assert report.imbalance <= max(report.tolerance, report.floor)


def test_unknown_solver_and_senseless_tolerance_are_refused():
    network, rhs = grid_network(3, 0)
    with pytest.raises(InputError, match="unknown solver 'multigrid'; known: auto, direct, cg"):
        solve(network, rhs, "multigrid")
    for tolerance in (0.0, -1.0, 1.0, np.nan):
        with pytest.raises(InputError, match="tolerance"):
            solve(network, rhs, tolerance=tolerance)


def test_a_solver_that_does_not_converge_says_so(monkeypatch):
    monkeypatch.setattr("porefv.solvers.conjugate_gradients.MAX_ITERATIONS", 2)
    network, rhs = grid_network(10, 6)
    with pytest.raises(ComputationError, match="cg solver stopped at a flux imbalance of .* after 2 iterations"):
        solve(network, rhs, "cg")


@pytest.mark.parametrize("solver", METHODS)
def test_a_looser_tolerance_is_kept_too(solver):
    network, rhs = grid_network(10, 3)
    _x, report = solve(network, rhs, solver, tolerance=1e-4)
    assert report.imbalance <= 1e-4 and report.tolerance == 1e-4
    if solver == "cg":
        assert report.iterations < solve(network, rhs, solver)[1].iterations


# ---- many right-hand sides ----------


@pytest.mark.parametrize("method", METHODS)
def test_one_factor_serves_many_right_hand_sides_and_guesses(method):
    network, rhs = grid_network(10, 3)
    ready = Solver(network, method, many=True)
    once, first = ready.solve(rhs, 1e-12)
    assert_allclose(once, solve(network, rhs, method, 1e-12)[0], rtol=0, atol=1e-12)
    twice, _ = ready.solve(2.0 * rhs, 1e-12)
    # Linear: what is lost of the flow, 1e-12, across a resistance of up to 10³.
    assert_allclose(twice, 2.0 * once, rtol=0, atol=1e-9)
    again, report = ready.solve(rhs, 1e-10, guess=once)
    assert_allclose(again, once, rtol=0, atol=1e-9)
    assert report.iterations <= 1  # nothing is left to do
    assert first.name == method


def test_many_right_hand_sides_are_worth_a_factor_sooner():
    network, _ = grid_network(15, 0)  # 3375 nodes
    assert Solver(network).name == "cg"
    assert Solver(network, many=True).name == "direct"


@pytest.mark.parametrize("decades", [0, 4, 8, 12])
def test_iterations_hardly_depend_on_contrast(decades):
    network, rhs = grid_network(30, decades, fraction_leaking=0.001)
    _, uniform = solve(*grid_network(30, 0, fraction_leaking=0.001), "cg", 1e-8)
    _, report = solve(network, rhs, "cg", 1e-8)
    assert report.iterations <= 1.5 * uniform.iterations
