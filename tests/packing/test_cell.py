"""Periodic cells, and packings in them."""

from itertools import product

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from porefv.errors import InputError
from porefv.packing.box import Box
from porefv.packing.cell import Cell, reduced_basis
from porefv.packing.packing import Packing

CUBE = Cell([1, 1, 1])
SHEARED = np.array([[1.0, 0.0, 0.0], [0.3, 1.0, 0.0], [-0.1, 0.2, 1.1]])


def test_a_cell_knows_its_volume_and_sides():
    cell = Cell(SHEARED, [1, 2, 3])
    assert cell.volume == pytest.approx(1.1, rel=1e-14)
    assert repr(Cell([1, 2, 1])) == "Cell(1×2×1 m)"
    assert repr(cell).startswith(
        "Cell(1×1.04403×1.1225 m, vectors (1, 0, 0), (0.3, 1, 0), (-0.1, 0.2, 1.1), origin (1,"
    )
    assert_array_equal(Cell.of(Box([1, 1, 1], [2, 3, 4])).vectors, np.diag([1, 2, 3]))


@pytest.mark.parametrize(
    ("vectors", "origin", "said"),
    [
        ([1, 1, 0], (0, 0, 0), "no volume"),
        ([[1, 0, 0], [0, 1, 0], [1, 1, 0]], (0, 0, 0), "no volume: its vectors 1, 0, 0, 0, 1, 0, 1, 1, 0 m"),
        ([[1, 0, 0], [0, 1, 0], [1 / 3, 1 / 7, 1e-12]], (0, 0, 0), "no volume"),
        ([1e200, 1e200, 1e200], (0, 0, 0), "no volume"),
        ([1e-200, 1e-200, 1e-200], (0, 0, 0), "no volume"),
        ([1, 1], (0, 0, 0), "three rows of three finite numbers, or three lengths"),
        ([1, 1, np.nan], (0, 0, 0), "three finite numbers"),
        ([1, 1, 1], (0, 0), "origin of a periodic cell must be three finite numbers"),
        ("abc", (0, 0, 0), "must be numbers"),
    ],
)
def test_a_cell_without_a_volume_is_refused(vectors, origin, said):
    with pytest.raises(InputError, match=said):
        Cell(vectors, origin)


def test_points_are_wrapped_by_whole_vectors():
    cell = Cell(SHEARED, [5.0, -1.0, 2.0])
    points = np.random.default_rng(0).uniform(-20, 20, (200, 3))
    wrapped = cell.wrapped(points)
    fractions = (wrapped - cell.origin) @ np.linalg.inv(SHEARED)
    assert fractions.min() > -1e-12 and fractions.max() < 1 + 1e-12
    assert_allclose(points - wrapped, cell.steps(points) @ SHEARED, atol=1e-12)


@pytest.mark.parametrize("seed", range(20))
def test_a_reduced_basis_spans_the_same_lattice_with_the_shortest_vectors(seed):
    rng = np.random.default_rng(seed)
    short = np.eye(3) + rng.uniform(-0.3, 0.3, (3, 3))
    mixed = np.array([[1, 0, 0], [rng.integers(-9, 9), 1, 0], [rng.integers(-9, 9), rng.integers(-9, 9), 1]]) @ short
    reduced = reduced_basis(mixed)
    steps = reduced @ np.linalg.inv(short)
    assert_allclose(steps, np.rint(steps), atol=1e-9)
    assert abs(np.linalg.det(steps)) == pytest.approx(1.0, abs=1e-9)
    around = np.array([step for step in product(range(-4, 5), repeat=3) if any(step)]) @ short
    assert Cell(mixed).shortest == pytest.approx(np.linalg.norm(around, axis=1).min(), rel=1e-12)


def test_spheres_outside_the_cell_are_wrapped_and_counted():
    packing = Packing([[0.2, 0.2, 0.2], [1.5, -0.2, 7.3]], [0.1, 0.1], CUBE)
    assert_allclose(packing.wrapped().centres, [[0.2, 0.2, 0.2], [0.5, 0.8, 0.3]], atol=1e-15)
    assert packing.wrapped().metadata == {"wrapped": "1"}
    assert repr(packing) == "Packing(2 spheres, radius 0.1 m, periodic cell 1×1×1 m)"


@pytest.mark.parametrize("seed", range(10))
def test_overlaps_count_each_pair_of_images_once(seed):
    rng = np.random.default_rng(seed)
    vectors = np.eye(3) + rng.uniform(-0.3, 0.3, (3, 3))
    n = rng.integers(1, 6)
    centres, radii = rng.uniform(-2, 2, (n, 3)), rng.uniform(0.2, 0.5, n)
    found = Packing(centres, radii, Cell(vectors, rng.uniform(-1, 1, 3))).overlaps
    moves = np.array(list(product(range(-8, 9), repeat=3))) @ vectors
    expected = []
    for i in range(n):
        for j in range(i, n):
            distances = np.linalg.norm(centres[j] + moves - centres[i], axis=1)
            depths = np.sort((radii[i] + radii[j] - distances)[(distances < radii[i] + radii[j]) & (distances > 0)])
            expected += [(i, j, depth) for depth in (depths[::2] if i == j else depths)]
    order = np.lexsort([found.depths, *found.pairs.T[::-1]])
    assert_array_equal(found.pairs[order], np.array([row[:2] for row in expected]).reshape(-1, 2))
    assert_allclose(found.depths[order], [row[2] for row in expected], atol=1e-12)


def test_porosity_takes_off_what_images_share():
    cap = np.pi * 0.02**2 * (0.52 - 0.02 / 3)
    packing = Packing([[0.9, 0.1, 0.5]], [0.52], CUBE)
    assert packing.porosity == pytest.approx(1 - (4 / 3 * np.pi * 0.52**3 - 6 * cap), rel=1e-14)
    # Each square of four spheres has four triples with its middle in common, and there are three squares a sphere.
    thick = Packing([[0.9, 0.1, 0.5]], [0.72], CUBE)
    assert thick.triple_overlaps == 12
    within = Packing([[0.5, 0.5, 0.5]], [0.72], Box([0, 0, 0], [1, 1, 1]))  # by symmetry its part of the cube
    assert thick.porosity == pytest.approx(within.porosity, rel=1e-12)
    double = Packing([[0.9, 0.1, 0.5], [1.9, 0.1, 0.5]], [0.72, 0.72], Cell([2, 1, 1]))
    assert (double.triple_overlaps, double.porosity) == (24, pytest.approx(thick.porosity, rel=1e-12))


@pytest.mark.parametrize(
    ("packing", "said"),
    [
        (Packing([[0.5, 0.5, 0.5]], [0.5], Cell([1, 1, 0.4])), "sphere holds the centre of its own image"),
        (Packing([[0.5, 0.5, 0.5]], [0.5], Cell([[1, 0, 0], [0, 1, 0], [3.1, 2.1, 0.3]])), "next image 0.33166"),
        (Packing([[0.1, 0.1, 0.1], [2.1, 0.1, 0.1]], [0.1, 0.05], CUBE), "one sphere lies within another"),
        (Packing([[0.5, 0.5, 0.5]], [1e-17], CUBE), "radius not between"),
        (Packing([[0.5, 0.5, 0.5]], [1e-33], Cell([1e-32, 1, 1])), "must lie between"),
    ],
)
def test_spheres_that_do_not_fit_the_cell_are_refused(packing, said):
    with pytest.raises(InputError, match=said):
        packing.validate()


def test_a_cropped_packing_has_all_images_in_the_box():
    packing = Packing([[3.25, 0.25, 0.25]], [0.2], CUBE).cropped(Box([0, 0, 0], [2, 3, 1]))
    assert sorted(map(tuple, packing.centres)) == [(x, y, 0.25) for x in (0.25, 1.25) for y in (0.25, 1.25, 2.25)]
    assert packing.scaled(2.0).box.volume == 48
    with pytest.raises(InputError, match="no centre lies in the box"):
        Packing([[0.5, 0.5, 0.5]], [0.1], CUBE).cropped(Box([0.1, 0.1, 0.1], [0.2, 0.2, 0.2]))


def test_scaling_scales_the_cell():
    packing = Packing([[0.5, 0.5, 0.5]], [0.3], Cell(SHEARED, [1, 2, 3]))
    scaled = packing.scaled(3.0)
    assert_allclose(scaled.box.vectors, 3 * SHEARED)
    assert scaled.porosity == pytest.approx(packing.porosity, rel=1e-13)


def test_what_needs_walls_says_so(tmp_path):
    packing = Packing([[0.5, 0.5, 0.5]], [0.3], CUBE)
    for use in (lambda: packing.write(tmp_path / "p.csv"), lambda: packing.write(tmp_path / "p.vtk")):
        with pytest.raises(InputError, match="in a periodic cell, which has no walls"):
            use()
    with pytest.raises(InputError, match="in no periodic cell"):
        packing.with_box(Box([0, 0, 0], [1, 1, 1])).wrapped()
