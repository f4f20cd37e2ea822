"""Least squares over neighbours: exact for linear fields, and no part where neighbours do not span space."""

import numpy as np
from numpy.testing import assert_allclose

from porefv.fipy.gradient import gradient_operators


def test_neighbours_in_a_plane_give_the_gradient_in_the_plane():
    vectors = np.array([[1.0, 0.0, 0.0], [0.0, 2.0, 0.0]])
    operators = gradient_operators(np.array([[0, 1], [0, 2]]), vectors, 3, np.arange(2), 2)
    values = np.array([1.0, 4.0, 11.0, 0.0, 0.0])
    assert_allclose([(operator @ values)[0] for operator in operators], [3.0, 5.0, 0.0], atol=1e-12)


def test_the_value_of_a_face_stands_for_a_neighbour():
    operators = gradient_operators(np.array([[0, -1]]), np.array([[0.0, 0.0, -0.5]]), 1, np.array([1]), 2)
    assert_allclose([(operator @ [1.0, 99.0, 3.0])[0] for operator in operators], [0.0, 0.0, -4.0], atol=1e-12)
