"""The largest sphere in the void of each pore: it touches no solid, and lattices have known ones."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_allclose

from porefv.mesh.inscribed_spheres import NearestSurface
from porefv.mesh.pore_mesh import PoreMesh
from porefv.packing.box import Box
from porefv.packing.packing import Packing


def distances(packing, points):
    """Of each point from the nearest sphere or wall, by comparison with all of them."""
    to_spheres = np.linalg.norm(points[:, None] - packing.centres, axis=2) - packing.radii
    return np.minimum(to_spheres.min(axis=1), packing.box.wall_distances(points).min(axis=1))


def shifted(packing, factor, shift):
    box = Box(packing.box.lower * factor + shift, packing.box.upper * factor + shift)
    return Packing(packing.centres * factor + shift, packing.radii * factor, box)


# Spheres in the holes of a lattice of touching spheres of radius 1, far from walls.
HOLES = {
    "sc": [np.sqrt(3) - 1],
    "bcc": [np.sqrt(5 / 3) - 1],
    "fcc": [np.sqrt(2) - 1, np.sqrt(3 / 2) - 1],
}


@pytest.mark.parametrize("kind", HOLES)
def test_the_holes_of_a_lattice_have_their_known_sizes(lattice, kind):
    mesh = PoreMesh(lattice(kind, 3))
    inner = mesh.box.wall_distances(mesh.pore_centres).min(axis=1) > 0.99
    found = mesh.inscribed_spheres.radii[inner] / mesh.packing.radii[0]
    assert_allclose(np.unique(found.round(9)), np.sort(HOLES[kind]), rtol=0, atol=1e-8)


@given(st.integers(0, 10_000), st.sampled_from([0.02, 0.3, 1.0]))
def test_each_sphere_touches_the_nearest_solid_and_overlaps_none(random_packing, seed, ratio):
    mesh = PoreMesh(random_packing(25, ratio=ratio, seed=seed))
    spheres = mesh.inscribed_spheres
    found = spheres.radii > 0.0
    assert found.mean() > 0.97  # few pores between spheres of very different sizes have none
    assert_allclose(distances(mesh.packing, spheres.centres[found]), spheres.radii[found], rtol=0, atol=1e-12)


@pytest.mark.parametrize("name", ["n54_s1", "n200_s1", "nine_0.72", "sc8"])
def test_spheres_of_packings_with_overlaps_lie_in_the_void(mesh_of, name):
    mesh = mesh_of(name)
    spheres = mesh.inscribed_spheres
    found = spheres.radii > 0.0
    assert found.mean() > 0.99
    assert_allclose(distances(mesh.packing, spheres.centres[found]), spheres.radii[found], rtol=0, atol=1e-12)


def test_a_sphere_is_tangent_to_four_solids_of_different_sizes():
    # One sphere in a corner: in the opposite corner of the box, the sphere that touches three walls and it.
    packing = Packing([[0.3, 0.3, 0.3]], [0.3], Box([0, 0, 0], [1, 1, 1]))
    radius = PoreMesh(packing).inscribed_spheres.radii.max()
    # √3 (0.7 - ρ) = 0.3 + ρ
    assert_allclose(radius, (0.7 * np.sqrt(3) - 0.3) / (1 + np.sqrt(3)), rtol=1e-12)


@pytest.mark.parametrize(("factor", "shift"), [(1e-6, 0.0), (1e3, 0.0), (1.0, 100.0)])
def test_radii_scale_with_the_packing_and_do_not_depend_on_its_place(random_packing, factor, shift):
    packing = random_packing(40, ratio=0.4, seed=3)
    here, there = PoreMesh(packing).inscribed_spheres, PoreMesh(shifted(packing, factor, shift)).inscribed_spheres
    assert_allclose(np.sort(there.radii), factor * np.sort(here.radii), rtol=1e-9)


@given(st.integers(0, 10_000))
def test_the_nearest_surface_is_the_nearest_of_all_spheres_and_walls(random_packing, seed):
    packing = random_packing(60, ratio=0.03, seed=seed)
    points = np.random.default_rng(seed).uniform(-0.1, 1.1, (200, 3))
    assert_allclose(
        NearestSurface(packing).distances(points), np.maximum(distances(packing, points), 0.0), rtol=0, atol=1e-14
    )


def test_walls_of_pores_are_those_on_which_they_have_faces(mesh_of):
    mesh = mesh_of("n200_s1")
    faces = mesh.wall_faces
    for wall in range(6):
        on_wall = np.zeros(mesh.n_pores, bool)
        on_wall[mesh.cell_pore[faces.cells[faces.walls == wall]]] = True
        np.testing.assert_array_equal((mesh.pore_walls >> wall) & 1 == 1, on_wall)
