"""Age and residence time: volume over flow, steps and steady equations, dispersion of a vessel."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from porefv.errors import InputError
from porefv.flow.pore_flow import PoreFlow
from porefv.flow.walls import Walls
from porefv.mesh.pore_mesh import PoreMesh
from porefv.packing.packing import Packing
from porefv.transport.residence import breakthrough, residence_time, vessel_peclet


@pytest.fixture(scope="module")
def flow():
    return PoreFlow(Packing.read("data/packings/n2000_s1.csv"), Walls.along("y"))


def strength(flow, peclet):
    speed = flow.inflow / (flow.mesh.box.section(1) * flow.mesh.packing.porosity)
    return 2.0 * speed * flow.mesh.packing.radii.mean() / peclet


@pytest.mark.parametrize("peclet", [np.inf, 100.0, 1.0])
def test_the_mean_residence_time_is_volume_over_flow(flow, peclet):
    found = residence_time(flow, strength(flow, peclet))
    assert_allclose(found.mean, flow.mesh.pore_volumes.sum() / flow.inflow, rtol=1e-10)
    assert not found.not_reached.any()
    assert (found.age > 0.0).all()


def test_moments_are_those_of_the_breakthrough_less_what_steps_add(flow):
    found = residence_time(flow)
    dt = found.mean / 50.0
    times, leaving = breakthrough(flow, dt, 5000)
    assert_allclose(dt * (1.0 - leaving).sum(), found.mean, rtol=1e-6)
    assert (np.diff(leaving) > -1e-14).all()
    # Time steps of a Markov chain: the age is a number of steps, of variance σ² + τ dt.
    variance = ((2.0 * times - dt) * dt * (1.0 - leaving)).sum() - found.mean**2
    assert_allclose(variance / found.mean**2, found.relative_variance + 1.0 / 50.0, rtol=1e-4)


def test_dispersion_of_the_network_of_mixed_pores(flow):
    """D_L / (U d) is 0.36-0.42 where the flow is faster than diffusion: the known limit of mixed pores."""
    size = flow.mesh.box.size[1] / (2.0 * flow.mesh.packing.radii.mean())
    for peclet in (np.inf, 100.0, 10.0):
        found = residence_time(flow, strength(flow, peclet))
        assert 0.36 < size / found.peclet < 0.42


@pytest.mark.parametrize("scale", [1.17, 1.20])
def test_the_volume_is_that_of_the_pores_that_are_reached(scale):
    packing = Packing.read("data/packings/n200_s1.csv")
    scaled = Packing(packing.centres, scale * packing.radii, packing.box)
    flow = PoreFlow(PoreMesh(scaled, wall_tolerance=1.0), Walls.along("y"))
    found = residence_time(flow)
    assert found.not_reached[flow.solution.isolated].all()
    assert np.isnan(found.age[found.not_reached]).all()
    assert_allclose(found.volume, flow.mesh.pore_volumes[~found.not_reached].sum())
    assert_allclose(found.mean, found.volume / flow.inflow, rtol=1e-10)


def test_a_vessel_of_little_dispersion_has_twice_the_inverse_peclet_number():
    assert_allclose(vessel_peclet(2e-6), 1e6, rtol=1e-5)
    assert_allclose(vessel_peclet(2.0 / 5.0 - 2.0 / 25.0 * (1.0 - np.exp(-5.0))), 5.0)
    with pytest.raises(InputError, match="between 0 and 1"):
        vessel_peclet(1.0)
