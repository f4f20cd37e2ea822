"""Gradient of a variable in each pore, by least squares over the neighbouring pores; without FiPy."""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp

# Neighbours whose directions have a smallest eigenvalue below this part of the largest do not span space.
_SPAN = 1e-10


def gradient_operators(
    cells: np.ndarray, vectors: np.ndarray, n_cells: int, faces: np.ndarray, n_faces: int
) -> list[sp.csr_array]:
    """Three operators G_x, G_y, G_z (n_cells, n_cells + n_faces): gradients from values of cells, and of faces.

    The gradient g of a cell minimises Σ ((v_k - v_c - g·d_k) / |d_k|)² over its neighbours k at d_k, as Barth (1991):
    exact for linear fields. Where neighbours do not span space, g has no part normal to them.

    Parameters
    ----------
    cells : (k, 2) int array
        A cell and its neighbour; -1 for a neighbour that is no cell: a face stands for it.
    vectors : (k, 3) array
        From the first cell's centre to the second's, or to the face [m].
    n_cells : int
    faces : (k,) int array
        The face between the two, or that stands for the neighbour: its value is in column n_cells + face.
    n_faces : int
    """
    both = cells[:, 1] >= 0
    rows = np.concatenate([cells[:, 0], cells[both, 1]])
    columns = np.concatenate([np.where(both, cells[:, 1], n_cells + faces), cells[both, 0]])
    vectors = np.concatenate([vectors, -vectors[both]])
    squares = np.einsum("ij,ij->i", vectors, vectors)
    directions = vectors / np.sqrt(squares)[:, None]
    moments = np.zeros((n_cells, 3, 3))
    np.add.at(moments, rows, directions[:, :, None] * directions[:, None, :])
    sizes, axes = np.linalg.eigh(moments)
    spanned = sizes > _SPAN * np.maximum(sizes[:, -1:], np.finfo(float).tiny)
    inverse = (axes * np.where(spanned, 1.0 / np.where(spanned, sizes, 1.0), 0.0)[:, None, :]) @ axes.transpose(0, 2, 1)
    weights = np.einsum("kij,kj->ki", inverse[rows], vectors / squares[:, None])
    shape = (n_cells, n_cells + n_faces)
    return [
        sp.csr_array(
            (np.concatenate([w, -w]), (np.concatenate([rows, rows]), np.concatenate([columns, rows]))), shape=shape
        )
        for w in weights.T
    ]
