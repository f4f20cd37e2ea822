"""Diffusion through the sections of a prism: the integral and its limits."""

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.integrate import quad

from porefv.conductance.prism_sections import diffusive_conductances
from porefv.mesh.pore_mesh import PoreMesh
from porefv.packing.box import Box
from porefv.packing.packing import Packing


def integral(mesh, t):
    """1 / ∫ ds / A(s) of throat t by quadrature, from the sectors of its facets."""
    throats, facets = mesh.throats, mesh.facets
    of_throat = throats.facets_of_throats
    rows = of_throat.facets[of_throat.starts[t] : of_throat.starts[t + 1]]
    spheres = facets.vertices[rows] < mesh.n_spheres
    radii = mesh.packing.radii[facets.vertices[rows][spheres]]
    angles = 2.0 * facets.sectors[rows][spheres] / radii**2
    origin = mesh.packing.centres[facets.vertices[rows[0], 0]]
    low, high = ((mesh.vertices[cell] - origin) @ facets.normals[rows[0]] for cell in facets.cells[rows[0]])

    def resistivity(s):
        return 1.0 / (throats.fluid_areas[t] + 0.5 * (angles * np.minimum(abs(s), radii) ** 2).sum())

    kinks = np.concatenate([-radii, [0.0], radii])
    inside = np.unique(kinks[(low < kinks) & (kinks < high)])
    return 1.0 / quad(resistivity, low, high, points=inside if len(inside) else None, epsabs=0.0, epsrel=1e-11)[0]


@pytest.mark.parametrize("name", ["n25_s1", "n54_s1"])
def test_it_is_the_integral_over_the_sections(name, mesh_of):
    mesh = mesh_of(name)
    found = diffusive_conductances(mesh.throats)
    assert (found > 0.0).all()
    long = np.flatnonzero(mesh.throats.lengths > 1e-6)[::7]
    assert_allclose(found[long], [integral(mesh, t) for t in long], rtol=1e-9)


def test_sectors_that_overlap_are_what_is_left_of_them(reference):
    """At the poles of its spheres, the section is the whole facet: nothing of it is counted twice."""
    packing = reference("n25_s1")
    overlapping = PoreMesh(Packing(packing.centres, 1.05 * packing.radii, packing.box), wall_tolerance=0.2)
    throats, facets = overlapping.throats, overlapping.facets
    found = diffusive_conductances(throats)
    assert (facets.fluid_areas + facets.sectors.sum(axis=1)).tolist() == pytest.approx(facets.areas.tolist())
    checked = np.flatnonzero((throats.lengths > 1e-6) & (found > 0.0))[::7]
    assert_allclose(found[checked], [integral(overlapping, t) for t in checked], rtol=1e-9)
    assert (found <= throats.areas / throats.effective_lengths * (1.0 + 1e-12)).all()


def test_a_lattice_has_the_integral_in_closed_form():
    """Simple cubic lattice, r = ½: A(s) = (1 - π / 4 + π s²) / 4 over a quarter of a facet, up to s = ½."""
    lattice = PoreMesh(Packing([[0.5, 0.5, 0.5]], [0.5], Box([0, 0, 0], [1, 1, 1])))
    # Eight pores, a corner of the box each; the twelve throats have a quarter of a unit square each.
    neck, growth = 0.25 * (1.0 - 0.25 * np.pi), 0.25 * np.pi
    half = np.arctan(0.5 * np.sqrt(growth / neck)) / np.sqrt(growth * neck)
    assert_allclose(diffusive_conductances(lattice.throats), 0.5 / half, rtol=1e-12)


def test_without_solid_it_is_that_of_the_dual_mesh(mesh_of):
    packing = mesh_of("n25_s1").packing
    points = PoreMesh(Packing(packing.centres, np.full(len(packing), 1e-9), packing.box), unite_tolerance=0.0)
    throats = points.throats
    long = throats.lengths > 1e-6
    assert_allclose(diffusive_conductances(throats)[long], (throats.areas / throats.lengths)[long], rtol=1e-6)


def test_a_closed_throat_passes_nothing():
    """Spheres that cover the squares between four of them in a cubic lattice."""
    centres = np.stack(np.meshgrid(*[[0.25, 0.75]] * 3, indexing="ij"), axis=-1).reshape(-1, 3)
    closed = PoreMesh(Packing(centres, np.full(8, 0.36), Box([0, 0, 0], [1, 1, 1])), wall_tolerance=0.5)
    found = diffusive_conductances(closed.throats)
    assert closed.throats.closed.any()
    assert (found[closed.throats.closed] == 0.0).all()
    assert np.isfinite(found).all() and (found >= 0.0).all()


def test_it_scales_with_length(mesh_of):
    packing = mesh_of("n54_s1").packing
    found = [diffusive_conductances(PoreMesh(packing.scaled(factor)).throats) for factor in (1.0, 1e-3)]
    assert_allclose(found[1], 1e-3 * found[0], rtol=1e-6)
