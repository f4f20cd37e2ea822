"""Paths of particles through the network: outside grains, drawn by flux, with residence times."""

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from numpy.testing import assert_allclose, assert_array_equal

from porefv import Box, FixedPressure, FlowSource, InputError, Packing, Point, PoreFlow, PoreMesh, Wall, Walls

NAMES = ["n25_s1", "n54_s1", "n200_s1", "sc8", "nine_0.2", "nine_0.4", "nine_0.5", "nine_0.72"]


def pieces(paths):
    """Begin and end (k, 3) of the straight pieces of all paths."""
    within = np.ones(len(paths.points) - 1, bool)
    within[paths.offsets[1:-1] - 1] = False
    return paths.points[:-1][within], paths.points[1:][within]


def deepest(packing, begin, end):
    """The largest depth of a piece in a sphere, over its radius; negative if all pass outside. By brute force."""
    most = -np.inf
    along = end - begin
    squares = np.maximum((along**2).sum(axis=1), 1e-300)
    for centre, radius in zip(packing.centres, packing.radii, strict=True):
        place = np.clip(((centre - begin) * along).sum(axis=1) / squares, 0.0, 1.0)
        nearest = np.linalg.norm(begin + place[:, None] * along - centre, axis=1)
        most = max(most, 1.0 - nearest.min() / radius)
    return most


@pytest.mark.parametrize("name", NAMES)
def test_no_point_of_a_path_is_inside_a_grain_or_outside_the_box(mesh_of, unit_flow, name):
    flow = unit_flow(mesh_of(name), Walls.along("y"))
    paths = flow.paths(300, seed=2)
    assert paths.cut == 0
    assert deepest(flow.mesh.packing, *pieces(paths)) < 1e-12
    assert flow.mesh.box.wall_distances(paths.points).min() > -1e-12


@pytest.mark.parametrize("name", ["n25_s1", "n200_s1", "nine_0.72"])
def test_the_mean_residence_time_is_the_volume_over_the_flow(mesh_of, unit_flow, name):
    flow = unit_flow(mesh_of(name), Walls.along("y"))
    times = flow.paths(5000, seed=3).residence_times
    expected = flow.mesh.pore_volumes.sum() / flow.inflow  # every pore is reached
    assert abs(times.mean() - expected) < 4.0 * times.std() / np.sqrt(len(times))


def test_paths_pass_throats_as_often_as_fluid_does(mesh_of, unit_flow):
    flow = unit_flow(mesh_of("n25_s1"), Walls.along("y"))
    paths = flow.paths(20_000, seed=4)
    through = np.bincount(flow.mesh.throats.pores[:, 0], np.maximum(flow.flux, 0.0), flow.mesh.n_pores)
    through += np.bincount(flow.mesh.throats.pores[:, 1], np.maximum(-flow.flux, 0.0), flow.mesh.n_pores)
    number = np.repeat(np.arange(len(paths)), np.diff(paths.offsets))
    visits = np.bincount(np.unique(np.stack([number, paths.pores]), axis=1)[1], minlength=flow.mesh.n_pores)
    inner = flow.mesh.pore_walls & (4 + 8) == 0  # what enters or leaves by a throat alone
    share = through / flow.inflow
    scatter = np.sqrt(share * (1.0 - np.minimum(share, 1.0)) / len(paths))
    assert (np.abs(visits / len(paths) - share)[inner] <= 5.0 * scatter[inner] + 1.0 / len(paths)).all()


@pytest.mark.parametrize("name", ["n54_s1", "n200_s1", "sc8"])
def test_along_a_path_time_goes_on_and_pressure_falls(mesh_of, unit_flow, name):
    flow = unit_flow(mesh_of(name), Walls.along("y"))
    paths = flow.paths(200, seed=5)
    for first, last in zip(paths.offsets[:-1], paths.offsets[1:] - 1, strict=True):
        assert paths.times[first] == 0.0
        assert (np.diff(paths.times[first : last + 1]) > 0.0).all()
        assert (np.diff(paths.pressures[first : last + 1]) <= 1e-12).all()
        assert_allclose(paths.points[[first, last], 1], flow.mesh.box.wall_places[2:4])
        assert_allclose(paths.pressures[[first, last]], [1.0, 0.0], atol=1e-12)
    assert (paths.speeds >= 0.0).all()


def test_lengths_are_those_of_the_lines_and_no_shorter_than_the_height(mesh_of, unit_flow):
    paths = unit_flow(mesh_of("n200_s1"), Walls.along("z")).paths(100, seed=6)
    lines = np.split(paths.points, paths.offsets[1:-1])
    assert_allclose(paths.lengths, [np.linalg.norm(np.diff(line, axis=0), axis=1).sum() for line in lines])
    assert (paths.tortuosities >= 1.0).all()
    assert paths.path_tortuosity == pytest.approx(paths.lengths.mean() / paths.height)
    assert paths.path_tortuosity_scatter == pytest.approx(paths.tortuosities.std())


@given(st.integers(0, 10_000))
def test_pieces_that_pass_a_grain_are_counted_in_any_packing(random_packing, unit_flow, seed):
    flow = unit_flow(random_packing(15, ratio=0.1, seed=seed), Walls.along("z", slip=True))
    assume(flow.mesh.pore_volumes.min() > 0.0)  # a large sphere may reach through a flat cell
    paths = flow.paths(50, seed=seed)
    assert (deepest(flow.mesh.packing, *pieces(paths)) > 1e-9) == (paths.cut > 0)
    assert paths.cut == 0  # no sphere overlaps another


def test_the_seed_makes_the_paths(mesh_of, unit_flow):
    flow = unit_flow(mesh_of("n25_s1"), Walls.along("y"))
    assert_array_equal(flow.paths(10, seed=7).points, flow.paths(10, seed=7).points)
    assert len(flow.paths(10, seed=7)) == 10
    assert not np.array_equal(flow.paths(10, seed=7).lengths, flow.paths(10, seed=8).lengths)


def test_paths_between_a_source_and_walls_begin_in_its_pore(mesh_of):
    flow = PoreFlow(
        mesh_of("n200_s1"), Walls(y_max=Wall(0.0)), sources=[FlowSource(Point((0.5, 0.5, 0.5)), 1e-3)]
    )  # fmt: skip
    paths = flow.paths(100, seed=9)
    assert set(paths.pores[paths.offsets[:-1]]) == set(np.flatnonzero(flow.flow_of_sources))
    assert deepest(flow.mesh.packing, *pieces(paths)) < 1e-12
    with pytest.raises(InputError, match="exactly two pressure walls"):
        paths.path_tortuosity  # noqa: B018


def test_paths_end_at_fixed_pressures(mesh_of):
    flow = PoreFlow(
        mesh_of("n200_s1"), Walls(y_min=Wall(1.0)), fixed_pressures=[FixedPressure(Point((0.5, 0.9, 0.5)), 0.0)]
    )  # fmt: skip
    paths = flow.paths(100, seed=10)
    assert_allclose(paths.pressures[paths.offsets[1:] - 1], 0.0, atol=1e-12)


def test_what_is_no_count_or_seed_and_a_flow_at_rest_are_refused(mesh_of, unit_flow):
    flow = unit_flow(mesh_of("n25_s1"), Walls.along("y"))
    for count, seed, name in ((0, 0, "count"), (1.5, 0, "count"), (True, 0, "count"), (3, -1, "seed")):
        with pytest.raises(InputError, match=name):
            flow.paths(count, seed=seed)
    at_rest = unit_flow(mesh_of("n25_s1"), Walls(y_min=Wall(1.0), y_max=Wall(1.0)))
    with pytest.raises(InputError, match="nothing flows"):
        at_rest.paths(3)


def test_paths_through_the_channels_of_a_lattice_are_straight(mesh_of, unit_flow):
    # Pores of the cubic lattice are joined along the axis alone by throats that carry flux.
    paths = unit_flow(mesh_of("sc8"), Walls.along("y", slip=True)).paths(500, seed=11)
    assert_allclose(paths.tortuosities, 1.0, rtol=1e-6)


def test_paths_lead_round_a_single_sphere():
    packing = Packing([[1.0, 1.0, 1.0]], [0.5], Box([0, 0, 0], [2, 2, 2]))
    flow = PoreFlow(PoreMesh(packing), Walls.along("x"))
    paths = flow.paths(50, seed=12)
    assert deepest(packing, *pieces(paths)) < 1e-12
