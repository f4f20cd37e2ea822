"""Profiles, fluxes through planes, tortuosity, mean velocities, and sizes of pores and constrictions."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from numpy.testing import assert_allclose, assert_array_equal

from porefv.errors import InputError
from porefv.flow.sizes import Distribution
from porefv.flow.walls import Wall, Walls
from porefv.mesh.pore_mesh import PoreMesh
from porefv.packing.box import WALL_SENSES, WALLS, Box
from porefv.packing.packing import Packing

NAMES = ["n25_s1", "n54_s1", "n200_s1", "nine_0.72", "sc8"]


# ---- planes ----------


@pytest.mark.parametrize("axis", ["x", "y", "z"])
@pytest.mark.parametrize("name", NAMES)
def test_every_plane_between_the_pressure_walls_has_the_flux_of_the_walls(mesh_of, unit_flow, name, axis):
    flow = unit_flow(mesh_of(name), Walls.along(axis))
    box, k = flow.mesh.box, "xyz".index(axis)
    places = box.lower[k] + box.size[k] * np.array([1e-6, 0.1, 0.25, 0.5, 0.777, 1 - 1e-6])
    assert_allclose(flow.plane_fluxes(places), flow.inflow, rtol=1e-9)


@given(st.integers(0, 10_000), st.floats(0.001, 0.999))
def test_planes_have_the_flux_of_the_walls_in_any_packing(random_packing, unit_flow, seed, place):
    flow = unit_flow(random_packing(15, ratio=0.1, seed=seed), Walls.along("z", slip=True))
    assert_allclose(flow.plane_fluxes([place]), flow.inflow, rtol=1e-9)


@pytest.mark.parametrize("axis", ["x", "y", "z"])
def test_the_mean_flux_of_all_planes_is_that_of_the_darcy_velocity(mesh_of, unit_flow, axis):
    # ∫ u dV = ∫ Q(x) dx, also across the flow, where planes pass what enters on one side and leaves on the other.
    flow = unit_flow(mesh_of("n200_s1"), Walls.along("y"))
    through = flow.plane_fluxes((np.arange(2000) + 0.5) / 2000, axis=axis)
    assert_allclose(through.mean(), flow.darcy_velocity["xyz".index(axis)], rtol=0, atol=1e-4 * flow.inflow)


def test_the_flux_through_planes_follows_the_pressures(mesh_of, unit_flow):
    flow = unit_flow(mesh_of("n200_s1"), Walls.along("y", drop=-1.0))
    assert_allclose(flow.plane_fluxes([0.3, 0.6]), -flow.inflow, rtol=1e-9)


def test_what_enters_by_a_lateral_wall_passes_the_planes_behind_it(mesh_of, unit_flow):
    # From x_min to y_max: near y_min no flux passes, near y_max all of it.
    flow = unit_flow(mesh_of("n200_s1"), Walls(x_min=Wall(1.0), y_max=Wall(0.0)))
    through = flow.plane_fluxes(np.linspace(0.001, 0.999, 21), axis="y")
    assert abs(through[0]) < 0.05 * flow.inflow
    assert_allclose(through[-1], flow.inflow, rtol=0.2)
    # Fluid enters on all of x_min below y_max, so that the flux grows nearly everywhere.
    assert (np.diff(through) > -0.02 * flow.inflow).all()


@pytest.mark.parametrize("places", [[0.0], [1.0], [1.5], [np.nan], 0.5])
def test_planes_outside_the_box_are_refused(mesh_of, unit_flow, places):
    with pytest.raises(InputError, match="planes must be places between 0 and 1 m"):
        unit_flow(mesh_of("n25_s1"), Walls.along("y")).plane_fluxes(places)


# ---- profile ----------


def test_pressure_of_a_lattice_falls_evenly_by_layer(lattice, unit_flow):
    # The pores of a simple cubic lattice between walls: on the walls, and between the layers of spheres.
    flow = unit_flow(lattice("sc", 5), Walls.along("y", drop=2.0, slip=True))
    profile = flow.profile(layers=5)
    assert_allclose(profile.pressure, np.array([9, 7, 5, 3, 1]) / 5, rtol=0, atol=1e-12)
    assert_allclose(profile.porosity, 1 - np.pi / 6, rtol=1e-12)
    assert_allclose(profile.edges, np.arange(6.0))
    assert profile.axis == 1


def test_a_profile_of_one_layer_is_the_sample(mesh_of, unit_flow):
    flow = unit_flow(mesh_of("n200_s1"), Walls.along("y"))
    profile = flow.profile(layers=1)
    volumes = flow.mesh.pore_volumes
    assert_allclose(profile.porosity, flow.mesh.packing.porosity, rtol=1e-12)
    assert_allclose(profile.pressure, (volumes * flow.pressure).sum() / volumes.sum(), rtol=1e-9)


@pytest.mark.parametrize("layers", [1, 3, 10, 200])
def test_layers_of_any_thickness_have_pressures_between_those_of_the_walls(mesh_of, unit_flow, layers):
    profile = unit_flow(mesh_of("n200_s1"), Walls.along("y", drop=3.0)).profile(layers=layers)
    assert ((profile.pressure >= -1e-12) & (profile.pressure <= 3.0 + 1e-12)).all()
    assert len(profile.pressure) == len(profile.porosity) == layers


def test_reversed_pressures_give_the_complement_of_the_profile(mesh_of, unit_flow):
    mesh = mesh_of("n200_s1")
    there, back = (unit_flow(mesh, Walls.along("y", drop=drop)).profile() for drop in (1.0, -1.0))
    assert_allclose(there.pressure, -back.pressure, rtol=0, atol=1e-12)
    assert_array_equal(there.porosity, back.porosity)


def test_a_small_drop_on_a_large_pressure_keeps_its_digits(mesh_of, unit_flow):
    mesh = mesh_of("n54_s1")
    high = Walls(y_min=Wall(1e5 + 1.0), y_max=Wall(1e5))
    found = unit_flow(mesh, high).profile().pressure - 1e5
    assert_allclose(found, unit_flow(mesh, Walls.along("y")).profile().pressure, rtol=0, atol=1e-9)


def test_an_axis_must_be_given_where_the_walls_have_none(mesh_of, unit_flow):
    flow = unit_flow(mesh_of("n25_s1"), Walls(x_min=Wall(1.0), y_max=Wall(0.0)))
    with pytest.raises(InputError, match='give an axis "x", "y" or "z"'):
        flow.profile()
    assert flow.profile(axis="z").axis == 2
    with pytest.raises(InputError, match="axis must be 'x', 'y' or 'z', not 'w'"):
        flow.profile(axis="w")


# ---- tortuosity ----------


@pytest.mark.parametrize("slip", [False, True])
def test_parallel_straight_tubes_have_tortuosity_one(lattice, unit_flow, slip):
    # Along an axis of a simple cubic lattice nothing flows across.
    flow = unit_flow(lattice("sc", 4), Walls.along("y", slip=slip))
    assert_allclose(flow.tortuosity, 1.0, rtol=1e-12)


@given(st.integers(0, 10_000), st.sampled_from(["x", "y", "z"]), st.booleans())
def test_tortuosity_is_one_at_least(random_packing, unit_flow, seed, axis, slip):
    flow = unit_flow(random_packing(20, ratio=0.2, seed=seed), Walls.along(axis, slip=slip))
    assert flow.tortuosity >= 1.0 - 1e-9


def test_tortuosity_depends_on_neither_pressure_nor_viscosity_nor_scale(random_packing, unit_flow):
    packing = random_packing(60, seed=5)
    large = Packing(100 * packing.centres, 100 * packing.radii, Box([0, 0, 0], [100, 100, 100]))
    found = unit_flow(packing, Walls.along("y")).tortuosity
    assert 1.1 < found < 2.0
    assert_allclose(unit_flow(packing, Walls.along("y", drop=-7.0)).tortuosity, found, rtol=1e-9)
    assert_allclose(unit_flow(large, Walls.along("y")).tortuosity, found, rtol=1e-9)


def test_tortuosity_needs_two_opposite_walls(mesh_of, unit_flow):
    with pytest.raises(InputError, match="tortuosity needs exactly two pressure walls"):
        _ = unit_flow(mesh_of("n25_s1"), Walls(x_min=Wall(1.0), y_max=Wall(0.0))).tortuosity


# ---- mean velocities ----------


@pytest.mark.parametrize("axis", ["x", "y", "z"])
@pytest.mark.parametrize("name", NAMES)
def test_the_darcy_velocity_is_the_flux_over_the_section(mesh_of, unit_flow, name, axis):
    flow = unit_flow(mesh_of(name), Walls.along(axis))
    k = "xyz".index(axis)
    assert_allclose(flow.darcy_velocity[k], flow.inflow / flow.mesh.box.section(k), rtol=1e-9)
    assert_allclose(flow.interstitial_velocity * flow.mesh.packing.porosity, flow.darcy_velocity, rtol=1e-14)


def test_the_darcy_velocity_is_the_mean_over_the_pores(mesh_of, unit_flow):
    # Also where fluid enters and leaves by walls that are not opposite.
    for walls in (Walls.along("y"), Walls(x_min=Wall(1.0), y_max=Wall(0.0), z_max=Wall(0.3))):
        flow = unit_flow(mesh_of("n200_s1"), walls)
        mean = (flow.pore_velocity * flow.mesh.pore_volumes[:, None]).sum(axis=0) / flow.mesh.box.volume
        assert_allclose(flow.darcy_velocity, mean, rtol=0, atol=1e-9 * np.abs(mean).max())


def test_the_sense_of_the_darcy_velocity_is_that_of_the_fluxes_of_the_walls(mesh_of, unit_flow):
    flow = unit_flow(mesh_of("n54_s1"), Walls.along("y", drop=-1.0))
    assert flow.darcy_velocity[1] < 0.0
    inward = np.array([flow.wall_flux[wall] for wall in WALLS]) * -WALL_SENSES
    assert np.sign(inward[2]) == np.sign(flow.darcy_velocity[1])


# ---- sizes ----------


def test_void_volumes_of_pores_add_up_to_the_porosity(mesh_of, unit_flow):
    flow = unit_flow(mesh_of("n200_s1"), Walls.along("y"))
    assert_allclose(flow.pore_sizes.void_volumes.sum(), flow.mesh.packing.porosity, rtol=1e-12)
    assert flow.pore_sizes.by_number.mean < flow.pore_sizes.by_volume.mean  # larger pores have more volume


def test_constrictions_of_a_lattice_have_the_radius_between_four_spheres(lattice, unit_flow):
    flow = unit_flow(lattice("sc", 4), Walls.along("y", slip=True))
    flowing = flow.constriction_sizes.flux > 1e-9 * flow.inflow
    inner = flowing & (flow.mesh.pore_walls[flow.mesh.throats.pores] & 0b110011 == 0).all(axis=1)
    assert_allclose(flow.constriction_sizes.radii[inner], 0.5 * (np.sqrt(2) - 1), rtol=1e-9)
    assert inner.sum() == 3 * 3 * 4


def test_fluid_takes_the_wide_constrictions(mesh_of, unit_flow):
    sizes = unit_flow(mesh_of("n2000_s1"), Walls.along("y")).constriction_sizes
    for fraction in (0.1, 0.5, 0.9):
        assert sizes.by_flux.quantile(fraction) > sizes.by_number.quantile(fraction)


def test_a_constriction_is_not_wider_than_both_of_its_pores_but_rarely(mesh_of, unit_flow):
    # The sphere with the centre of the circle is a candidate of both pores; it is smaller than the circle only where
    # other spheres reach into it. Circles on walls of symmetry are centred on the wall: there are none here.
    flow = unit_flow(mesh_of("n200_s1"), Walls.along("y"))
    pores = flow.pore_sizes.radii[flow.mesh.throats.pores]
    wider = flow.constriction_sizes.radii > pores.min(axis=1) * (1 + 1e-9)
    assert wider.mean() < 0.05


VALUES = arrays(float, st.integers(1, 30), elements=st.floats(0, 1e6))


@given(VALUES, st.integers(0, 1000), st.floats(1e-3, 1e3))
def test_a_distribution_is_monotone_and_depends_on_relative_weights_alone(values, seed, factor):
    weights = np.random.default_rng(seed).uniform(0.1, 1.0, len(values))
    found = Distribution.of(values, weights)
    assert (np.diff(found.values) >= 0.0).all() and (np.diff(found.fractions) >= 0.0).all()
    assert found.fractions[-1] == 1.0
    quantiles = [found.quantile(f) for f in np.linspace(0, 1, 11)]
    assert (np.diff(quantiles) >= 0.0).all()
    assert quantiles[0] == values.min() and quantiles[-1] == values.max()
    assert_allclose(Distribution.of(values, factor * weights).mean, found.mean, rtol=1e-12)
    assert_allclose(found.mean, np.average(values, weights=weights), rtol=1e-9, atol=1e-9)


@given(VALUES)
def test_a_value_that_counts_twice_is_one_of_twice_the_weight(values):
    twice, weighted = Distribution.of(np.repeat(values, 2)), Distribution.of(values, np.full(len(values), 2.0))
    assert_allclose(twice.mean, weighted.mean, rtol=1e-12)
    for fraction in (0.1, 0.5, 0.9, 1.0):
        assert twice.quantile(fraction) == weighted.quantile(fraction) or len(values) > 1


def test_what_has_no_weight_does_not_count():
    found = Distribution.of([1.0, 2.0, 3.0], [0.0, 1.0, 0.0])
    assert found.quantile(0.0) == found.quantile(1.0) == found.mean == 2.0
    nothing = Distribution.of([1.0], [0.0])
    assert np.isnan(nothing.mean) and np.isnan(nothing.quantile(0.5))


@pytest.mark.parametrize(("values", "weights"), [([1.0], [-1.0]), ([1.0, 2.0], [1.0]), ([1.0], [np.nan])])
def test_weights_are_one_for_each_value_and_not_negative(values, weights):
    with pytest.raises(InputError, match="values and weights must be equally many"):
        Distribution.of(values, weights)


def test_a_fraction_lies_between_0_and_1():
    with pytest.raises(InputError, match="a fraction must lie between 0 and 1"):
        Distribution.of([1.0]).quantile(1.5)


def test_nothing_is_computed_before_it_is_asked_for(random_packing, unit_flow):
    flow = unit_flow(PoreMesh(random_packing(20)), Walls.along("y"))
    assert not {"pore_sizes", "constriction_sizes", "tortuosity", "darcy_velocity"} & set(vars(flow))
    _ = flow.pore_sizes
    assert "solution" not in vars(flow)  # sizes of pores need no flow
