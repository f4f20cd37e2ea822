"""Stress and strain of the grains: imposed motions, conservation, and what layers make of them."""

import dataclasses

import numpy as np
import pytest
from numpy.testing import assert_allclose

from porefv import Box, InputError, Packing, PoreMesh
from porefv.coupling.micromechanics import cell_strains, grain_strains, grain_stresses, layer_means
from porefv.dem.dem import DEM
from porefv.dem.material import Material
from porefv.packing.box import WALLS


def still(mesh):
    return np.zeros((mesh.n_spheres, 3)), np.zeros(6)


def any_motion(mesh, seed=0):
    rng = np.random.default_rng(seed)
    return rng.normal(size=(mesh.n_spheres, 3)), rng.normal(size=6)


def box_motion(mesh, stretch, shift):
    """u = stretch ∘ x + shift, with the walls."""
    lower, upper = stretch * mesh.box.lower + shift, stretch * mesh.box.upper + shift
    return mesh.packing.centres * stretch + shift, np.stack([-lower, upper], axis=1).ravel()


def sums_around(mesh, values):
    """Sum over the cells around each grain."""
    return np.bincount(mesh.cells.ravel(), np.repeat(values, 4), mesh.n_spheres + 6)[: mesh.n_spheres]


# ---- stress ----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("steps", [30, 3000])
def test_stresses_of_the_grains_have_the_stress_of_the_sample_for_mean_in_balance_or_not(reference, steps):
    dem = DEM(reference("n200_s1"), damping=0.3)
    dem.run(steps)
    mesh = PoreMesh(dem.packing, wall_tolerance=0.2)
    stresses = grain_stresses(dem.contacts, dem.positions, mesh.laguerre_volumes)
    mean = np.einsum("k,kab->ab", mesh.laguerre_volumes, stresses) / mesh.box.volume
    assert_allclose(mean, dem.stress.T, rtol=1e-12, atol=1e-12 * dem.stress[0, 0])


def test_a_grain_pressed_between_two_plates_bears_their_stress():
    r, depth = 0.1, 1e-4
    dem = DEM(Packing([[0.1, 0.1, r - depth]], [r], Box([0, 0, 0], [0.2, 0.2, 2 * (r - depth)])), Material(young=1e6))
    stress = grain_stresses(dem.contacts, dem.positions, PoreMesh(dem.packing).laguerre_volumes)[0]
    assert_allclose(stress[2, 2], 1e6 * r * depth / 0.2**2, rtol=1e-9)
    assert_allclose(stress - np.diag(np.diag(stress)), 0.0, atol=1e-9)


def test_stress_does_not_depend_on_where_places_are_measured_from_though_grains_are_out_of_balance(reference):
    dem = DEM(reference("n25_s1"))
    dem.apply(np.tile([0.0, 0.0, -1.0], (len(dem), 1)))
    dem.run(30)
    volumes, shift = PoreMesh(dem.packing, wall_tolerance=0.2).laguerre_volumes, np.array([3.0, -5.0, 7.0])
    here = grain_stresses(dem.contacts, dem.positions, volumes)
    moved = dataclasses.replace(dem.contacts, points=dem.contacts.points + shift)
    assert dem.unbalanced > 1e-3
    assert_allclose(grain_stresses(moved, dem.positions + shift, volumes), here, atol=1e-12 * np.abs(here).max())


# ---- strain ----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", ["n25_s1", "n200_s1", "sc8"])
def test_stretch_of_the_box_is_the_strain_of_every_grain_and_cell(mesh_of, name):
    mesh = mesh_of(name)
    stretch = np.array([0.01, -0.02, 0.005])
    motion = box_motion(mesh, stretch, np.array([0.1, 0.2, -0.3]))
    for strains in (grain_strains(mesh, *motion), cell_strains(mesh, *motion)):
        assert_allclose(strains, np.broadcast_to(-np.diag(stretch), strains.shape), atol=1e-12)


def test_any_uniform_gradient_is_the_strain_of_grains_whose_cells_have_no_wall(mesh_of):
    mesh = mesh_of("n200_s1")
    gradient = 0.01 * np.random.default_rng(1).normal(size=(3, 3))
    walled = (mesh.cells >= mesh.n_spheres).any(axis=1)
    inner = sums_around(mesh, walled.astype(float)) == 0
    assert inner.sum() > 10
    strains = grain_strains(mesh, mesh.packing.centres @ gradient.T, np.zeros(6))[inner]
    assert_allclose(strains, np.broadcast_to(-0.5 * (gradient + gradient.T), strains.shape), atol=1e-12)


def test_shear_along_two_walls_is_the_strain_of_grains_next_to_them(mesh_of):
    # u_x = γ y slides along the walls z, which do not move; other walls would have to bend.
    mesh = mesh_of("n200_s1")
    n, gamma = mesh.n_spheres, 0.01
    around = [sums_around(mesh, (mesh.cells == n + w).any(axis=1).astype(float)) for w in range(len(WALLS))]
    beside = (around[4] + around[5] > 0) & (sum(around[:4]) == 0)
    assert beside.sum() > 5
    displacements = np.zeros((n, 3))
    displacements[:, 0] = gamma * mesh.packing.centres[:, 1]
    expected = np.zeros((3, 3))
    expected[0, 1] = expected[1, 0] = -0.5 * gamma
    strains = grain_strains(mesh, displacements, np.zeros(6))[beside]
    assert_allclose(strains, np.broadcast_to(expected, strains.shape), atol=1e-12)


@pytest.mark.parametrize("name", ["n25_s1", "n200_s1", "nine_0.4", "sc8"])
def test_trace_is_the_volume_that_the_cells_lose(mesh_of, name):
    mesh = mesh_of(name)
    motion = any_motion(mesh)
    rates = mesh.cell_volume_rates(*motion)
    scale = np.abs(rates).max()
    of_cells = np.trace(cell_strains(mesh, *motion), axis1=1, axis2=2) * mesh.cell_volumes
    assert_allclose(of_cells, -rates, atol=1e-12 * scale)
    of_grains = np.trace(grain_strains(mesh, *motion), axis1=1, axis2=2) * sums_around(mesh, mesh.cell_volumes)
    assert_allclose(of_grains, -sums_around(mesh, rates), atol=1e-11 * scale)


def test_a_grain_has_the_mean_strain_of_its_cells(mesh_of):
    mesh = mesh_of("n25_s1")
    motion = any_motion(mesh)
    around = np.array([(mesh.cells == k).any(axis=1) for k in range(mesh.n_spheres)])
    volumes = around * mesh.cell_volumes
    expected = np.einsum("kt,tab->kab", volumes / volumes.sum(axis=1, keepdims=True), cell_strains(mesh, *motion))
    assert_allclose(grain_strains(mesh, *motion), expected, rtol=1e-10, atol=1e-10 * np.abs(expected).max())


def test_mean_strain_of_the_cells_is_that_of_the_box_however_grains_move(mesh_of):
    mesh = mesh_of("n200_s1")
    displacements, walls = any_motion(mesh)
    mean = np.einsum("t,tab->ab", mesh.cell_volumes, cell_strains(mesh, displacements, walls)) / mesh.box.volume
    assert_allclose(np.diag(mean), -(walls[0::2] + walls[1::2]) / mesh.box.size, rtol=1e-11)


def test_one_grain_in_a_box_has_the_strain_of_the_box():
    mesh = PoreMesh(Packing([[0.4, 0.5, 0.6]], [0.3], Box([0, 0, 0], [1, 1, 1])))
    strain = grain_strains(mesh, [[0.3, -0.2, 0.1]], [0.0, 0.0, 0.0, 0.0, 0.0, -0.02])
    assert_allclose(np.diagonal(strain[0]), [0.0, 0.0, 0.02], atol=1e-14)


def test_bad_displacements_are_refused(mesh_of):
    mesh = mesh_of("n25_s1")
    displacements, walls = still(mesh)
    with pytest.raises(InputError, match="one row per grain"):
        grain_strains(mesh, displacements[:-1], walls)
    with pytest.raises(InputError, match="one per wall"):
        cell_strains(mesh, displacements, walls[:3])
    displacements[3, 1] = np.nan
    with pytest.raises(InputError, match="finite"):
        grain_strains(mesh, displacements, walls)


# ---- layers ----------------------------------------------------------------------------------------------------------


def test_layers_that_fill_the_sample_have_its_mean(reference):
    dem = DEM(reference("n200_s1"), damping=0.3)
    dem.run(3000)
    mesh = PoreMesh(dem.packing, wall_tolerance=0.2)
    volumes, places = mesh.laguerre_volumes, dem.positions[:, 2]
    stresses = grain_stresses(dem.contacts, dem.positions, volumes)
    edges = np.linspace(mesh.box.lower[2], mesh.box.upper[2], 7)
    profile = layer_means(places, stresses, volumes, edges)
    shares = layer_means(places, np.ones(len(dem)), volumes, edges) * np.histogram(places, edges, weights=volumes)[0]
    assert_allclose(shares.sum(), mesh.box.volume)
    mean = np.einsum("l,lab->ab", shares, profile) / mesh.box.volume
    assert_allclose(mean, dem.stress.T, rtol=1e-12, atol=1e-12 * dem.stress[0, 0])


def test_a_layer_holds_its_lower_edge_the_last_its_upper_too_and_nothing_is_in_an_empty_one():
    places = [0.0, 0.5, 1.0, 3.0, -0.1, 3.1]
    means = layer_means(places, [1.0, 2.0, 4.0, 8.0, 99.0, 99.0], [1.0, 3.0, 1.0, 2.0, 1.0, 1.0], [0.0, 1.0, 2.0, 3.0])
    assert_allclose(means, [1.75, 4.0, 8.0])
    assert_allclose(layer_means(places, np.ones(6), np.ones(6), [0.0, 1.0, 1.5, 2.0]), [1.0, 1.0, np.nan])


def test_what_has_no_volume_does_not_count():
    assert_allclose(layer_means([0.5, 0.5], [[3.0], [np.nan]], [1.0, 0.0], [0.0, 1.0]), [[3.0]])


@pytest.mark.parametrize(
    ("places", "weights", "edges", "match"),
    [
        ([0.5], [1.0], [0.0, 0.0], "increasing"),
        ([0.5], [1.0], [0.0], "increasing"),
        ([0.5, 0.6], [1.0], [0.0, 1.0], "equally many"),
        ([0.5], [-1.0], [0.0, 1.0], "zero or more"),
    ],
)
def test_bad_layers_are_refused(places, weights, edges, match):
    with pytest.raises(InputError, match=match):
        layer_means(places, np.ones(1), weights, edges)
