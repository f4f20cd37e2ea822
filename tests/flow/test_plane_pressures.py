"""Mean pressures over planes: a linear pressure is read as what it is, a clear layer has the pressure of its fluid."""

from functools import cache
from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_allclose

from porefv import Box, Packing, PoreMesh
from porefv.flow.plane_pressures import PlanePressures

PACKINGS = Path(__file__).parents[2] / "data" / "packings"


@cache
def mesh_of(name):
    """Of a packing of the project, away from the origin."""
    packing = Packing.read(PACKINGS / f"{name}.csv")
    away = np.array([3.0, -2.0, 5.0])
    box = Box(packing.box.lower + away, packing.box.upper + away)
    return PoreMesh(Packing(packing.centres + away, packing.radii, box))


@pytest.fixture(scope="module", params=["sc8", "nine_0.5", "n25_s1", "n200_s1", "deposition_500"])
def mesh(request):
    """Lattices, whose cells are united, grown packings, and a cloud."""
    return mesh_of(request.param)


@pytest.mark.parametrize("axis", [0, 1, 2])
@pytest.mark.parametrize(
    ("name", "within"),
    [
        *(("sc8", 1e-12), ("nine_0.5", 1e-12)),
        *(("n25_s1", 0.01), ("n200_s1", 0.01), ("n2000_s1", 0.01)),
        *(("deposition_500", 0.07), ("deposition", 0.07)),
    ],
)
def test_a_linear_pressure_is_read_at_every_plane_and_in_every_layer(name, within, axis):
    # In clouds, and in wide pores of packings, Laguerre vertices lie further from a facet than the fluid of it reaches.
    mesh = mesh_of(name)
    lower, upper = mesh.box.lower[axis], mesh.box.upper[axis]
    radius = mesh.packing.radii.mean()
    planes = PlanePressures.of(mesh, 7.0 * (upper - mesh.vertices[:, axis]), axis)
    places = np.linspace(lower, upper, 24)
    assert_allclose(planes.at(places[1:-1]), 7.0 * (upper - places[1:-1]), rtol=0.0, atol=7.0 * within * radius)
    # Planes on walls are taken a little further in.
    ends = places[[0, -1]]
    assert_allclose(planes.at(ends), 7.0 * (upper - ends), rtol=0.0, atol=7.0 * (within * radius + 1e-8))
    middles = 0.5 * (places[1:] + places[:-1])
    assert_allclose(planes.means(places), 7.0 * (upper - middles), rtol=0.0, atol=7.0 * within * radius)


def test_the_facets_at_a_plane_fill_the_section(mesh):
    planes = PlanePressures.of(mesh, np.zeros(mesh.n_cells), 2)
    for place in np.linspace(mesh.box.lower[2], mesh.box.upper[2], 24)[1:-1]:
        crossed = (planes.lower <= place) & (place < planes.upper)
        assert planes.areas[crossed].sum() == pytest.approx(mesh.box.section(2), rel=1e-12)


def test_a_pressure_that_varies_across_is_that_of_the_middle_of_the_section(mesh):
    # Facets of the surface lie around their plane, so that their middle is that of the section to a part of a grain.
    middle = 0.5 * (mesh.box.lower[0] + mesh.box.upper[0])
    places = np.linspace(mesh.box.lower[2], mesh.box.upper[2], 24)[1:-1]
    found = PlanePressures.of(mesh, mesh.vertices[:, 0], 2).at(places)
    assert np.abs(found - middle).max() < 0.15 * mesh.packing.radii.mean()


def test_means_lie_between_the_pressures():
    mesh = PoreMesh(Packing.read(PACKINGS / "n200_s1.csv"))
    pressures = np.random.default_rng(1).uniform(2.0, 3.0, mesh.n_cells)
    planes = PlanePressures.of(mesh, pressures, 2)
    found = np.concatenate([planes.at(np.linspace(0, 1, 50)), planes.means(np.linspace(0, 1, 50))])
    assert (found > 2.0).all() and (found < 3.0).all()
    layers = planes.means([0.3, 0.4])
    assert_allclose(layers, planes.at(np.linspace(0.3, 0.4, 2001)).mean(), rtol=1e-4)


def test_clear_fluid_has_its_pressure():
    grains = Packing.read(PACKINGS / "n200_s1.csv")
    mesh = PoreMesh(Packing(grains.centres, grains.radii, Box([0, 0, 0], [1, 1, 4])))
    clear = mesh.vertices[:, 2] > 1.1
    planes = PlanePressures.of(mesh, np.where(clear, 5.0, 5.0 + 10.0 * (1.1 - mesh.vertices[:, 2])), 2)
    assert_allclose(planes.at([1.3, 2.0, 4.0]), 5.0)
    assert_allclose(planes.means(np.linspace(1.3, 4.0, 9)), 5.0)
    # Where a layer is thinner than the cells there is a pressure, too.
    assert np.isfinite(planes.means(np.linspace(0.0, 4.0, 400))).all()
