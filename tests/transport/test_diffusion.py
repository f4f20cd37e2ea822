"""Effective diffusivity: limits, bounds, closed packings, and resolved diffusion."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from porefv.conductance.prism_sections import diffusive_conductances
from porefv.errors import InputError
from porefv.mesh.periodic_mesh import PeriodicMesh
from porefv.mesh.pore_mesh import PoreMesh
from porefv.packing.box import Box
from porefv.packing.cell import Cell
from porefv.packing.packing import Packing
from porefv.transport.diffusion import effective_diffusion, periodic_diffusivity

UNIT = Box([0, 0, 0], [1, 1, 1])
# Octants of the unit cells of cubic lattices, in edges: centres, and the radius of touching spheres.
OCTANTS = {
    "sc": ([[0, 0, 0]], 0.5),
    "bcc": ([[0, 0, 0], [0.5, 0.5, 0.5]], np.sqrt(3) / 4),
    "fcc": ([[0, 0, 0], [0.5, 0.5, 0], [0.5, 0, 0.5], [0, 0.5, 0.5]], np.sqrt(2) / 4),
}


def octant(kind, shrunk=1.0):
    """An octant, whose walls are planes of symmetry; centres are within the box by 1e-6 of a radius."""
    centres, radius = OCTANTS[kind]
    radius *= shrunk
    centres = np.clip(np.array(centres, float), 1e-6 * radius, 0.5 - 1e-6 * radius)
    packing = Packing(centres, np.full(len(centres), radius * (1.0 - 1e-6)), Box([0, 0, 0], [0.5, 0.5, 0.5]))
    return PoreMesh(packing, wall_tolerance=1.0 - 1e-9)


def maxwell(solid):
    return (1.0 - solid) / (1.0 + 0.5 * solid)


def test_without_grains_diffusion_is_that_of_the_fluid(random_packing):
    packing = random_packing(100)
    points = PoreMesh(Packing(packing.centres, np.full(100, 1e-7), UNIT), unite_tolerance=0.0)
    for axis in "xyz":
        found = effective_diffusion(points, axis)
        assert_allclose(found.relative_diffusivity, 1.0, rtol=1e-5)
        x = points.pore_centres[:, "xyz".index(axis)]
        assert_allclose(found.concentration, 1.0 - x, atol=1e-5)


@pytest.mark.parametrize("solid", [0.01, 0.05, 0.1])
@pytest.mark.parametrize("seed", range(2))
def test_dilute_packings_diffuse_as_maxwell_has_it(random_packing, solid, seed):
    """Within 2 %: their walls and random places are not in Maxwell's formula, and the sections are an estimate."""
    mesh = PoreMesh(random_packing(300, seed=seed, fraction=solid))
    assert_allclose(effective_diffusion(mesh, "y").relative_diffusivity, maxwell(solid), rtol=0.02)


@pytest.mark.parametrize(("kind", "error"), [("sc", 0.10), ("bcc", 0.06), ("fcc", 0.06)])
def test_touching_lattices_diffuse_as_resolved(values, kind, error):
    """The error of the sections, as docs/theory_diffusion.md states it: sc +9.7 %, bcc -5.2 %, fcc +5.9 %."""
    found = effective_diffusion(octant(kind), "y").relative_diffusivity
    assert_allclose(found, values("diffusion")["lattices"][kind], rtol=error)


@pytest.mark.parametrize(("name", "error"), [("n54_s1", 0.05), ("n200_s1", 0.03), ("n2000_s1", 0.02)])
def test_random_packings_diffuse_as_resolved(mesh_of, values, name, error):
    """The error of the sections: +4.3 %, +2.5 % and +1.6 %."""
    found = effective_diffusion(mesh_of(name), "y").relative_diffusivity
    assert_allclose(found, values("diffusion")["packings"][name], rtol=error)


@pytest.mark.parametrize("kind", OCTANTS)
def test_cubic_lattices_are_isotropic(kind):
    mesh = octant(kind, shrunk=0.9)
    along = [effective_diffusion(mesh, axis).relative_diffusivity for axis in "xyz"]
    assert_allclose(along, along[0], rtol=1e-6)


@pytest.mark.parametrize("axis", "xyz")
def test_grains_slow_diffusion_down_more_than_they_take_of_the_volume(random_packing, axis):
    """Σ g L² (n·e)² over V bounds D_eff / D from above, and the fluid's own part of the volume is above both."""
    for seed in range(3):
        found = effective_diffusion(PoreMesh(random_packing(80, seed=seed, fraction=0.3)), axis)
        assert 0.0 < found.relative_diffusivity < found.porosity
        assert found.diffusive_tortuosity > 1.0
        assert_allclose(found.formation_factor * found.relative_diffusivity, 1.0, rtol=1e-15)
        assert found.concentration.min() == 0.0 and found.concentration.max() == 1.0


def test_the_ratio_does_not_depend_on_the_scale(mesh_of):
    packing = mesh_of("n54_s1").packing
    found = [effective_diffusion(PoreMesh(packing.scaled(s)), "z").relative_diffusivity for s in (1.0, 1e-4)]
    assert_allclose(found[1], found[0], rtol=1e-9)


def test_a_sample_without_an_open_path_lets_nothing_pass(reference):
    packing = reference("n25_s1")
    mesh = PoreMesh(Packing(packing.centres, 1.5 * packing.radii, packing.box), wall_tolerance=0.9)
    found = effective_diffusion(mesh, "y")
    assert found.relative_diffusivity == 0.0
    assert found.formation_factor == np.inf
    assert np.isnan(found.diffusive_tortuosity)
    assert np.isfinite(found.concentration).all()


def test_a_sample_that_is_partly_closed_still_lets_something_pass(reference):
    packing = reference("n200_s1")
    mesh = PoreMesh(Packing(packing.centres, 1.17 * packing.radii, packing.box), wall_tolerance=0.9)
    assert 0 < mesh.throats.closed.sum() < len(mesh.throats)
    found = effective_diffusion(mesh, "y")
    assert 0.0 < found.relative_diffusivity < found.porosity
    assert found.concentration.min() >= 0.0 and found.concentration.max() <= 1.0


def test_a_sample_that_is_one_pore_thin_is_refused():
    thin = Packing([[0.5, 5e-4, 0.5]], [0.3], Box([0, 0, 0], [1, 1e-3, 1]))
    with pytest.raises(InputError, match="touches both y_min and y_max"):
        effective_diffusion(PoreMesh(thin, wall_tolerance=0.999), "y")


def test_wrong_arguments_are_refused(mesh_of):
    mesh = mesh_of("n25_s1")
    with pytest.raises(InputError, match="axis must be 'x', 'y' or 'z'"):
        effective_diffusion(mesh_of("n25_s1"), "w")
    with pytest.raises(InputError, match="mesh must be a PoreMesh"):
        effective_diffusion(mesh_of("n25_s1").packing, "x")
    with pytest.raises(InputError, match="conductances must be finite and not negative: 1 throat"):
        effective_diffusion(mesh, "x", conductances=np.where(np.arange(len(mesh.throats)) == 7, -1.0, 1.0))


def test_it_is_in_proportion_to_given_conductances(mesh_of):
    mesh = mesh_of("n25_s1")
    found = effective_diffusion(mesh, "x")
    doubled = effective_diffusion(mesh, "x", conductances=2.0 * diffusive_conductances(mesh.throats))
    assert_allclose(doubled.relative_diffusivity, 2.0 * found.relative_diffusivity, rtol=1e-9)


def test_in_a_periodic_cell_points_leave_the_diffusivity_of_the_fluid():
    vectors = np.array([[1.0, 0.0, 0.0], [0.4, 1.0, 0.0], [-0.2, 0.3, 0.8]])
    places = np.random.default_rng(0).uniform(0, 1, (60, 3)) @ vectors
    points = PeriodicMesh(Packing(places, np.full(60, 1e-7), Cell(vectors)), unite_tolerance=0.0)
    assert_allclose(periodic_diffusivity(points), np.eye(3), atol=1e-5)


@pytest.mark.parametrize("radius", [0.5, 0.4])
def test_a_periodic_lattice_has_the_diffusivity_of_the_box_around_its_sphere(radius):
    packing = Packing([[0.5, 0.5, 0.5]], [radius], UNIT)
    walled = effective_diffusion(PoreMesh(packing), "x").relative_diffusivity
    periodic = periodic_diffusivity(PeriodicMesh(packing.with_box(Cell([1, 1, 1]))))
    assert_allclose(periodic, walled * np.eye(3), atol=1e-12)
    with pytest.raises(InputError, match="mesh must be a PeriodicMesh; for a packing in a box"):
        periodic_diffusivity(PoreMesh(packing))
