"""What a coupling asks for, ours has, with the shapes and the meanings promised."""

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from porefv import Box, Packing
from porefv.dem.dem import DEM
from porefv.dem.grain_model import GrainModel
from porefv.dem.plate import Plate
from porefv.errors import InputError


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
    grains = model()
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
    grains = model()
    push = np.tile([1.0, 0.0, 0.0], (3, 1))
    grains.apply(push)
    grains.run(2)
    before = grains.velocities
    grains.apply(0.0 * push)
    grains.run(2)
    assert_allclose(grains.velocities, before, rtol=0.0)
    assert (before[:, 0] > 0.0).all()


def test_two_halves_are_a_step():
    whole, halves = model(), model()
    force = np.array([[3.0, 0.0, 0.0], [0.0, -2.0, 0.0], [0.0, 0.0, 1.0]])
    whole.apply(force)
    whole.run(5)
    for _ in range(5):
        halves.predict()
        halves.correct(force[np.argsort(halves.rows)], np.zeros(6))
    assert_array_equal(whole.positions, halves.positions)
    assert_array_equal(whole.velocities, halves.velocities)
    assert (whole.time, whole.steps) == (halves.time, halves.steps)


def test_the_first_half_says_what_the_second_does():
    grains: GrainModel = model()
    push = np.tile([1.0, 2.0, 0.0], (3, 1))
    velocities, speeds, mobilities, _ = grains.predict()
    grains.correct(push, np.zeros(6))
    assert_allclose(grains.velocities, (velocities + mobilities[:, None] * push)[grains.rows], rtol=1e-14)
    assert_allclose(grains.wall_velocities[np.arange(6), np.arange(6) // 2] * [-1, 1, -1, 1, -1, 1], speeds)


def test_a_thrust_moves_a_pressing_wall_as_it_yields():
    packing = Packing([[0.0999, 0.1, 0.1]], [0.1], Box([0, 0, 0], [0.2, 0.2, 0.1998]))
    dem = DEM(packing, plates={"z_max": Plate(stress=1e3, top_speed=1.0)})
    _, speeds, _, yields = dem.predict()
    dem.correct(np.zeros((1, 3)), np.array([0.0, 0.0, 0.0, 0.0, 0.0, 7.0]))
    assert yields[5] > 0.0 and not yields[:5].any()
    assert_allclose(dem.wall_velocities[5, 2], speeds[5] + 7.0 * yields[5], rtol=1e-13)


def test_halves_are_taken_in_turn():
    dem = model()
    with pytest.raises(InputError, match="correct"):
        dem.correct(np.zeros((3, 3)), np.zeros(6))
    dem.predict()
    with pytest.raises(InputError, match="half taken"):
        dem.run(1)
    damped = DEM(dem.packing, damping=0.1)
    with pytest.raises(InputError, match="damping"):
        damped.predict()
