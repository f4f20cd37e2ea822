"""The triangulation in blocks is the triangulation in one piece, cell for cell."""

import numpy as np
import pytest

from porefv import Box, Packing
from porefv.tessellation import blocks
from porefv.tessellation.triangulation import RegularTriangulation


def random_spheres(n, ratio, seed):
    rng = np.random.default_rng(seed)
    return rng.random((n, 3)), 0.2 * n ** (-1 / 3) * ratio ** -rng.random(n)


def simple_cubic(n):
    grid = (np.arange(n) + 0.5) / n
    centres = np.stack(np.meshgrid(grid, grid, grid, indexing="ij"), axis=-1).reshape(-1, 3)
    return centres, np.full(len(centres), 0.5 / n)


CASES = {
    "random": (*random_spheres(4000, 1.0, 0), [1, 1, 1]),
    "radii 1:100": (*random_spheres(4000, 100.0, 1), [1, 1, 1]),
    "a tall box": (random_spheres(3000, 2.0, 2)[0] * [0.1, 0.1, 5.0], np.full(3000, 0.005), [0.1, 0.1, 5.0]),
    "a lattice, all ties": (*simple_cubic(14), [1, 1, 1]),
}


@pytest.mark.parametrize("case", CASES)
def test_blocks_give_the_cells_of_one_piece(case, monkeypatch):
    centres, radii, size = CASES[case]
    box = Box([0, 0, 0], size)
    monkeypatch.setattr(blocks, "LEAST_BLOCK", 1000)
    monkeypatch.setattr(blocks, "thread_count", lambda: 1)
    whole = RegularTriangulation(centres, radii, box)
    monkeypatch.setattr(blocks, "thread_count", lambda: 3)
    pieces = RegularTriangulation(centres, radii, box)

    for array in ("cells", "neighbours", "local_vertices"):
        assert np.array_equal(getattr(whole, array), getattr(pieces, array)), array
    assert_neighbours_share_a_facet(pieces)


def test_a_halo_that_is_too_narrow_is_widened(monkeypatch):
    # One row of spheres far from a dense cluster: balls of cells reach much further than the mean spacing.
    rng = np.random.default_rng(3)
    centres = np.concatenate([0.3 * rng.random((3000, 3)), 0.3 + 0.69 * rng.random((30, 3))])
    packing = Packing(centres, np.full(len(centres), 1e-3), Box([0, 0, 0], [1, 1, 1]))
    widened = []
    certain = blocks.cells_are_certain
    monkeypatch.setattr(blocks, "cells_are_certain", lambda *a: widened.append(certain(*a)) or widened[-1])
    monkeypatch.setattr(blocks, "LEAST_BLOCK", 10**9)
    whole = RegularTriangulation(packing.centres, packing.radii, packing.box)
    monkeypatch.setattr(blocks, "LEAST_BLOCK", 1000)
    monkeypatch.setattr(blocks, "thread_count", lambda: 2)
    assert_same_cells(whole, RegularTriangulation(packing.centres, packing.radii, packing.box))
    assert not all(widened)


def assert_same_cells(one, other):
    assert np.array_equal(sorted_cells(one), sorted_cells(other))


def sorted_cells(triangulation):
    cells = np.sort(triangulation.cells, axis=1)
    return cells[np.lexsort(cells.T)]


def assert_neighbours_share_a_facet(triangulation):
    cells, neighbours = triangulation.cells, triangulation.neighbours
    for place in range(4):
        joined = np.flatnonzero(neighbours[:, place] >= 0)
        mine = np.sort(np.delete(cells[joined], place, axis=1), axis=1)
        other = neighbours[joined, place]
        back = np.argmax(neighbours[other] == joined[:, None], axis=1)
        assert np.array_equal(neighbours[other, back], joined)
        theirs = cells[other].copy()
        theirs[np.arange(len(other)), back] = -1
        assert np.array_equal(mine, np.sort(theirs, axis=1)[:, 1:])
    assert np.count_nonzero(neighbours < 0) == 8
