"""Diffusion through the sections of a prism: the integral, its limits, and resolved diffusion."""

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.integrate import quad

from porefv.conductance.prism_sections import diffusive_conductances
from porefv.mesh.pore_mesh import PoreMesh
from porefv.packing.box import Box
from porefv.packing.packing import Packing


def integral(mesh, t):
    """1 / ∫ ds / A(s) of throat t by quadrature, from the geometry of its facets."""
    throats, facets = mesh.throats, mesh.facets
    of_throat = throats.facets_of_throats
    rows = of_throat.facets[of_throat.starts[t] : of_throat.starts[t + 1]]
    discs = []
    for f in rows:
        spheres = [k for k in facets.vertices[f] if k < mesh.n_spheres]
        if len(spheres) == 3:
            corners = mesh.packing.centres[spheres]
            for i in range(3):
                u, v = corners[(i + 1) % 3] - corners[i], corners[(i + 2) % 3] - corners[i]
                discs.append((mesh.packing.radii[spheres[i]], np.arccos(u @ v / np.linalg.norm(u) / np.linalg.norm(v))))
        elif len(spheres) == 1:
            discs.append((mesh.packing.radii[spheres[0]], 0.5 * np.pi))
        else:
            wall = facets.vertices[f][2] - mesh.n_spheres
            u = mesh.packing.centres[spheres[1]] - mesh.packing.centres[spheres[0]]
            outward = np.zeros(3)
            outward[wall // 2] = 1.0 if wall % 2 else -1.0
            angle = np.arccos(u @ outward / np.linalg.norm(u))
            discs += [(mesh.packing.radii[spheres[0]], angle), (mesh.packing.radii[spheres[1]], np.pi - angle)]
    first = rows[0]
    origin = mesh.packing.centres[facets.vertices[first, 0]]
    low, high = ((mesh.vertices[cell] - origin) @ facets.normals[first] for cell in facets.cells[first])

    def resistivity(s):
        return 1.0 / (throats.fluid_areas[t] + 0.5 * sum(angle * min(abs(s), r) ** 2 for r, angle in discs))

    kinks = [sign * r for r, _ in discs for sign in (-1.0, 1.0)] + [0.0]
    inside = sorted(place for place in set(kinks) if low < place < high)
    return 1.0 / quad(resistivity, low, high, points=inside or None, epsabs=0.0, epsrel=1e-11, limit=200)[0]


@pytest.mark.parametrize("name", ["n25_s1", "n54_s1"])
def test_it_is_the_integral_over_the_sections(name, mesh_of):
    mesh = mesh_of(name)
    found = diffusive_conductances(mesh.throats)
    assert (found > 0.0).all()
    long = np.flatnonzero(mesh.throats.lengths > 1e-6)[::7]
    assert_allclose(found[long], [integral(mesh, t) for t in long], rtol=1e-9)


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
