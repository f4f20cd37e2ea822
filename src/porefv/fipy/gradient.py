"""Gradient of a variable in each pore, by least squares over the neighbouring pores; without FiPy."""

from __future__ import annotations

import numpy as np

# Neighbours whose directions have a smallest eigenvalue below this part of the largest do not span space.
_SPAN = 1e-10
# A determinant above this part of the trace's cube: the inverse of the moments keeps 8 digits at least.
_WELL = 1e-8


class LeastSquaresGradient:
    """Gradient g of each cell that minimises Σ ((v_k - v_c - g·d_k) / |d_k|)² over its neighbours k, which are at d_k.

    It is exact for linear fields. Where neighbours do not span space, it has no part normal to them (Barth 1991).

    Parameters
    ----------
    cells : (k, 2) int array
        A cell and its neighbour; -1 for a neighbour that is no cell: a face stands for it.
    vectors : (k, 3) array
        From the first cell's centre to the second's, or to the face [m].
    n_cells : int
    faces : (k,) int array
        The face between the two, or that stands for the neighbour.
    """

    def __init__(self, cells: np.ndarray, vectors: np.ndarray, n_cells: int, faces: np.ndarray):
        both = cells[:, 1] >= 0
        self._n_cells = n_cells
        self._rows = np.concatenate([cells[:, 0], cells[both, 1]])
        # Values of cells come first, those of faces after them.
        self._neighbours = np.concatenate([np.where(both, cells[:, 1], n_cells + faces), cells[both, 0]])
        vectors = np.concatenate([vectors, -vectors[both]])
        squares = np.einsum("ij,ij->i", vectors, vectors)
        moments = np.empty((n_cells, 3, 3))
        for a in range(3):
            for b in range(a + 1):
                moment = np.bincount(self._rows, vectors[:, a] * vectors[:, b] / squares, n_cells)
                moments[:, a, b] = moments[:, b, a] = moment
        inverse = _inverses(moments)
        self._weights = np.einsum("kij,kj->ik", inverse[self._rows], vectors / squares[:, None])

    def of(self, values: np.ndarray, on_faces: np.ndarray) -> np.ndarray:
        """(3, ..., n_cells): gradient of values of cells (..., n_cells), given those on faces (..., f)."""
        known = np.concatenate([values, on_faces], axis=-1)
        gradients = np.empty((3, *values.shape))
        for place in np.ndindex(values.shape[:-1]):
            steps = known[place][self._neighbours] - known[place][self._rows]
            for axis in range(3):
                gradients[(axis, *place)] = np.bincount(self._rows, self._weights[axis] * steps, self._n_cells)
        return gradients


def _inverses(moments: np.ndarray) -> np.ndarray:
    """(n, 3, 3): inverses of symmetric matrices; where one is singular, its inverse on what it spans."""
    trace = np.einsum("kii->k", moments)
    well = np.linalg.det(moments) > _WELL * (trace / 3.0) ** 3
    inverse = np.empty_like(moments)
    inverse[well] = np.linalg.inv(moments[well])
    sizes, axes = np.linalg.eigh(moments[~well])
    spanned = sizes > _SPAN * np.maximum(sizes[:, -1:], np.finfo(float).tiny)
    reciprocals = np.where(spanned, 1.0 / np.where(spanned, sizes, 1.0), 0.0)
    inverse[~well] = (axes * reciprocals[:, None, :]) @ axes.transpose(0, 2, 1)
    return inverse
