"""Least squares over neighbours: exact for linear fields, and no part where neighbours do not span space."""

import numpy as np
from numpy.testing import assert_allclose

from porefv.fipy.gradient import LeastSquaresGradient


def test_neighbours_in_a_plane_give_the_gradient_in_the_plane():
    vectors = np.array([[1.0, 0.0, 0.0], [0.0, 2.0, 0.0]])
    gradient = LeastSquaresGradient(np.array([[0, 1], [0, 2]]), vectors, 3, np.arange(2))
    assert_allclose(gradient.of(np.array([1.0, 4.0, 11.0]), np.zeros(2))[:, 0], [3.0, 5.0, 0.0], atol=1e-12)


def test_the_value_of_a_face_stands_for_a_neighbour():
    gradient = LeastSquaresGradient(np.array([[0, -1]]), np.array([[0.0, 0.0, -0.5]]), 1, np.array([1]))
    assert_allclose(gradient.of(np.array([1.0]), np.array([99.0, 3.0]))[:, 0], [0.0, 0.0, -4.0], atol=1e-12)


def test_components_of_a_vector_have_their_own_gradients():
    rng = np.random.default_rng(4)
    points = rng.uniform(size=(6, 3))
    cells = np.array([[i, j] for i in range(6) for j in range(i)])
    gradient = LeastSquaresGradient(cells, points[cells[:, 1]] - points[cells[:, 0]], 6, np.arange(len(cells)))
    slopes = rng.uniform(size=(2, 3))
    found = gradient.of(slopes @ points.T, np.zeros((2, len(cells))))
    assert_allclose(found, np.repeat(slopes.T[:, :, None], 6, axis=2), atol=1e-11)
