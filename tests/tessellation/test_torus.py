"""TorusTriangulation: closed, exact in ties, and the same whatever cell or image describes the lattice."""

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from numpy.testing import assert_allclose

from porefv.packing.cell import Cell
from porefv.tessellation.torus import OTHERS, TorusTriangulation

LATTICES = {
    "sc": [[0, 0, 0]],
    "bcc": [[0, 0, 0], [0.5, 0.5, 0.5]],
    "fcc": [[0, 0, 0], [0.5, 0.5, 0], [0.5, 0, 0.5], [0, 0.5, 0.5]],
    "diamond": [
        [0, 0, 0], [0.5, 0.5, 0], [0.5, 0, 0.5], [0, 0.5, 0.5],
        [0.25, 0.25, 0.25], [0.75, 0.75, 0.25], [0.75, 0.25, 0.75], [0.25, 0.75, 0.75],
    ],
}  # fmt: skip


def copies(basis, vectors, m):
    """Centres of m³ copies of a cell."""
    steps = np.stack(np.meshgrid(*[np.arange(m)] * 3, indexing="ij"), axis=-1).reshape(-1, 3)
    return ((np.array(basis)[:, None] + steps).reshape(-1, 3)) @ vectors


def edges(torus):
    """Number of edges of one period."""
    found = set()
    for i in range(4):
        for j in range(4):
            if i != j:
                steps = torus.steps[:, j] - torus.steps[:, i]
                found.update(map(tuple, np.column_stack([torus.cells[:, i], torus.cells[:, j], steps])))
    return len(found) // 2  # each from both its ends


def check(torus, volume):
    """All that a closed triangulation of a torus must be."""
    m = len(torus.cells)
    corners = torus.points[torus.cells] + torus.steps @ torus.vectors
    volumes = np.linalg.det(corners[:, 1:] - corners[:, :1]) / 6
    assert (volumes >= -1e-12 * volume).all() or (volumes <= 1e-12 * volume).all()
    assert np.abs(volumes).sum() == pytest.approx(volume, rel=1e-12)
    # Across each facet is one cell, whose own facet is that one, so many steps away.
    for i in range(4):
        beside, steps = torus.neighbours[:, i], torus.neighbour_steps[:, i]
        mine = np.concatenate([torus.cells[:, OTHERS[i], None], torus.steps[:, OTHERS[i]]], axis=2)
        theirs = np.concatenate([torus.cells[beside, :, None], torus.steps[beside] + steps[:, None]], axis=2)
        shared = (mine[:, :, None] == theirs[:, None]).all(axis=3)
        assert (shared.sum(axis=(1, 2)) == 3).all()
        back = (torus.neighbours[beside] == np.arange(m)[:, None]) & (
            torus.neighbour_steps[beside] == -steps[:, None]
        ).all(axis=2)
        assert back.any(axis=1).all()
    # The Euler number of a torus: vertices - edges + facets - cells = 0, with two facets a cell.
    assert len(np.unique(torus.cells)) - edges(torus) + m == 0


@pytest.mark.parametrize("kind", LATTICES)
@pytest.mark.parametrize("jitter", [0.0, 1e-15, 1e-9])
@pytest.mark.parametrize(("copied", "scale"), [(1, 1.0), (1, 1 / 3), (2, 0.1), (2, 7e-4), (3, 1e5)])
def test_lattices_are_closed(kind, jitter, copied, scale):
    rng = np.random.default_rng(copied)
    for vectors in (np.eye(3), np.array([[1, 0, 0], [0.3, 1, 0], [0.1, -0.4, 0.9]])):
        centres = copies(LATTICES[kind], vectors, copied) + rng.uniform(-1, 1, 3)
        centres = scale * (centres + jitter * rng.uniform(-1, 1, centres.shape))
        cell = Cell(scale * copied * vectors, scale * rng.uniform(-1, 1, 3))
        check(TorusTriangulation(centres, np.full(len(centres), 0.2 * scale), cell), cell.volume)


@st.composite
def random_cells(draw):
    rng = np.random.default_rng(draw(st.integers(0, 2**32 - 1)))
    vectors = np.diag(rng.uniform(0.5, 2.0, 3)) + draw(st.sampled_from([0.0, 0.3, 0.6])) * rng.uniform(-1, 1, (3, 3))
    assume(abs(np.linalg.det(vectors)) > 0.1)
    n = draw(st.integers(1, 40))
    radii = 1.0 / rng.uniform(1.0, draw(st.sampled_from([1.0, 2.0, 10.0])), n)
    solid = draw(st.floats(0.005, 0.3))
    radii *= np.cbrt(solid * abs(np.linalg.det(vectors)) / (4 / 3 * np.pi * (radii**3).sum()))
    return rng.uniform(0, 1, (n, 3)) @ vectors, radii, Cell(vectors, rng.uniform(-3, 3, 3)), rng


@settings(max_examples=60)
@given(random_cells())
def test_random_cells_are_closed(case):
    centres, radii, cell, _ = case
    check(TorusTriangulation(centres, radii, cell), cell.volume)


@settings(max_examples=30)
@given(random_cells())
def test_cells_do_not_depend_on_origin_images_and_basis(case):
    centres, radii, cell, rng = case
    assume(not cell.is_orthogonal)  # images of one sphere make rectangles there, which rounding cuts either way
    torus = TorusTriangulation(centres, radii, cell)
    a, b, c = rng.integers(-4, 5, 3)
    basis = np.array([[1, 0, 0], [a, 1, 0], [b, c, 1]]) @ cell.vectors
    moved = centres + rng.integers(-3, 4, (len(radii), 3)) @ cell.vectors + rng.uniform(-5, 5, 3)
    other = TorusTriangulation(moved, radii, Cell(basis))

    def shapes(torus):
        corners = torus.points[torus.cells] + torus.steps @ torus.vectors
        lengths = [np.linalg.norm(corners[:, i] - corners[:, j], axis=1) for i in range(4) for j in range(i)]
        table = np.column_stack([np.sort(torus.cells, axis=1), np.sort(np.array(lengths).T, axis=1)])
        return table[np.lexsort(np.round(table, 9).T[::-1])]

    assert_allclose(shapes(other), shapes(torus), rtol=0, atol=1e-9)


def test_images_are_taken_as_far_as_needed():
    # Planes of spheres far apart: the balls between them reach further than the first images.
    torus = TorusTriangulation(np.zeros((1, 3)), np.array([0.1]), Cell([1, 1, 12]))
    check(torus, 12.0)
    assert_allclose(np.abs(torus.local_vertices[:, 2] % 12.0 - 6.0), 0.0, atol=1e-9)
