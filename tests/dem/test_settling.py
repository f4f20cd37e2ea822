"""Settling under gravity."""

import pytest
from numpy.testing import assert_allclose

from porefv.dem.dem import DEM
from porefv.dem.material import Material
from porefv.dem.plate import Plate
from porefv.dem.random_placement import cloud
from porefv.dem.settling import settle
from porefv.dem.sizes import UniformSizes
from porefv.errors import InputError
from porefv.packing.box import WALLS, Box

CUBE = Box([0, 0, 0], [1, 1, 1])
HALF = UniformSizes(0.5)


def test_a_cloud_settles_to_a_bed_whose_weight_the_floor_bears():
    box = Box([0, 0, 0], [0.02, 0.02, 0.06])
    start = cloud(100, UniformSizes(0.8), box, 0.9, seed=1)
    rough = {name: Plate(friction_angle=30.0) for name in WALLS}
    dem = DEM(start, Material(), rough, gravity=(0, 0, -9.81), damping=0.3)
    assert settle(dem) is dem
    weight = 9.81 * dem.masses.sum()
    # Side walls carry some by friction. The mean resultant on a grain is a thousandth of a contact's force.
    assert_allclose(dem.wall_forces.sum(axis=0), [0.0, 0.0, -weight], atol=1e-2 * weight)
    assert -dem.wall_forces[4, 2] > 0.8 * weight
    assert dem.unbalanced < 1e-3
    assert 0.5 * (dem.masses * (dem.velocities**2).sum(axis=1)).sum() < 1e-3 * dem.energies.elastic
    assert dem.positions[:, 2].max() < 0.6 * start.centres[:, 2].max()
    assert (dem.positions > box.lower).all() and (dem.positions < box.upper).all()


def test_what_cannot_settle_is_refused():
    start = cloud(10, HALF, CUBE, 0.9)
    with pytest.raises(InputError, match="gravity"):
        settle(DEM(start, damping=0.3))
    with pytest.raises(InputError, match="damping"):
        settle(DEM(start, Material(friction_angle=0.0), gravity=(0, 0, -9.81)))
