"""Stiffness of a packing against Yade's, and the uses of a sample: oedometer, stress, reversibility."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from porefv.dem.dem import DEM
from porefv.dem.material import Material
from porefv.dem.plate import Plate

# n2000_s1 compressed along z between plates that start at 1500 Pa, the other walls fixed and smooth; E = 15 MPa,
# k_s/k_n = 0.5, as Yade 2023.02a has it (TriaxialStressController on z, damping 0.3, unbalanced force below 2e-5):
# stress on z_max, on x_max [Pa], and strain since 1500 Pa.
YADE_ELASTIC = [(1650.0, 1524.87, 3.41394e-5), (2250.0, 1652.35, 1.733151e-4)]  # friction 80°: no contact slides
YADE_FRICTION = [(1650.0, 1525.93, 3.46946e-5)]  # friction 30°


def pressed(dem, stress):
    """The height of the sample at rest under a stress on its ends."""
    dem.set_plates({wall: Plate(stress=stress, top_speed=0.02) for wall in ("z_min", "z_max")})
    dem.run_to_rest(unbalanced=1e-5, stress=1e-4, most=10_000)
    return float(dem.box.size[2])


@pytest.fixture
def sample(reference):
    def make(friction):
        return DEM(reference("n2000_s1"), Material(15e6, 0.5, friction, 2600.0), damping=0.3)

    return make


def test_oedometric_stiffness_is_yades_where_nothing_slides(sample):
    dem = sample(80.0)
    start = pressed(dem, 1500.0)
    for stress, lateral, strain in YADE_ELASTIC:
        height = pressed(dem, stress)
        assert_allclose((start - height) / start, strain, rtol=0.01)
        assert_allclose(dem.wall_stress["x_max"], lateral, rtol=0.003)
    # Unloading gives the strain back.
    assert abs(start - pressed(dem, 1500.0)) / start < 0.02 * YADE_ELASTIC[-1][2]


def test_oedometric_stiffness_is_yades_where_contacts_slide(sample):
    dem = sample(30.0)
    start = pressed(dem, 1500.0)
    for stress, lateral, strain in YADE_FRICTION:
        height = pressed(dem, stress)
        assert_allclose((start - height) / start, strain, rtol=0.02)
        assert_allclose(dem.wall_stress["x_max"], lateral, rtol=0.003)


def test_virial_stress_is_the_stress_on_the_walls(sample):
    dem = sample(30.0)
    pressed(dem, 2000.0)
    walls = dem.wall_stress
    mean = [0.5 * (walls[f"{axis}_min"] + walls[f"{axis}_max"]) for axis in "xyz"]
    assert_allclose(np.diag(dem.stress), mean, rtol=0.001)
    assert_allclose(dem.stress, dem.stress.T, atol=1e-3 * mean[2])
