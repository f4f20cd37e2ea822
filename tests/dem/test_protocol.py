"""What a coupling asks for, ours has, with the shapes and the meanings promised."""

import numpy as np
from numpy.testing import assert_allclose

from porefv import Box, Packing
from porefv.dem import DEM, Plate
from porefv.dem.protocol import GrainModel


def model() -> DEM:
    return DEM(
        Packing([[0.2, 0.5, 0.5], [0.7, 0.5, 0.5], [0.5, 0.2, 0.5]], [0.1, 0.2, 0.1], Box([0, 0, 0], [1, 1, 1])),
        plates={"z_max": Plate(velocity=(0.0, 0.0, -0.1)), "x_min": Plate(velocity=(0.0, 0.2, 0.0))},
    )


def test_ours_is_a_grain_model():
    assert isinstance(model(), GrainModel)
    assert not isinstance(Packing([[0, 0, 0]], [1]), GrainModel)


def test_shapes_are_those_of_the_protocol():
    grains: GrainModel = model()
    assert grains.positions.shape == grains.velocities.shape == (3, 3)
    assert grains.radii.shape == grains.masses.shape == (3,)
    assert grains.wall_velocities.shape == (6, 3)
    assert isinstance(grains.box, Box)
    assert isinstance(grains.step, float)


def test_velocities_live_half_a_step_before_positions():
    # x(t) = x(t - dt) + dt v(t - dt/2) and m (v(t + dt/2) - v(t - dt/2)) = dt F(t), for grains and for walls.
    grains: GrainModel = model()
    force = np.array([[3.0, 0.0, 0.0], [0.0, -2.0, 0.0], [0.0, 0.0, 1.0]])
    grains.apply(force)
    for step in range(1, 4):
        x, lower, upper = grains.positions, grains.box.lower, grains.box.upper
        grains.run(1)
        assert_allclose(grains.velocities, step * grains.step * force / grains.masses[:, None], rtol=1e-12)
        assert_allclose(grains.positions, x + grains.step * grains.velocities, rtol=1e-14)
        assert_allclose(grains.box.lower, lower + grains.step * np.diag(grains.wall_velocities[0::2]), rtol=1e-14)
        assert_allclose(grains.box.upper, upper + grains.step * np.diag(grains.wall_velocities[1::2]), rtol=1e-14)


def test_forces_stay_until_changed():
    grains: GrainModel = model()
    push = np.tile([1.0, 0.0, 0.0], (3, 1))
    grains.apply(push)
    grains.run(2)
    before = grains.velocities
    grains.apply(0.0 * push)
    grains.run(2)
    assert_allclose(grains.velocities, before, rtol=0.0)
    assert (before[:, 0] > 0.0).all()
