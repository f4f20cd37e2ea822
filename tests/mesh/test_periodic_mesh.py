"""PeriodicMesh: its sums are those of the cell, and its throats those of a walled mesh of many images."""

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from numpy.testing import assert_allclose

import porefv.flow as flow_functions
from porefv.conductance.conductances import throat_conductances
from porefv.conductance.effective_radius import EffectiveRadius
from porefv.conductance.hydraulic_radius import HydraulicRadius
from porefv.conductance.section_friction.model import SectionFriction
from porefv.coupling.micromechanics import cell_strains
from porefv.errors import InputError
from porefv.export import cells_grid
from porefv.flow.walls import Walls
from porefv.mesh.periodic_mesh import PeriodicMesh
from porefv.mesh.polyhedra import polyhedra
from porefv.mesh.pore_mesh import PoreMesh
from porefv.packing.box import Box
from porefv.packing.cell import Cell
from porefv.packing.images import faces_of, images_within
from porefv.packing.packing import Packing
from porefv.transport.diffusion import effective_diffusion

NO_SLIP = np.zeros(6, bool)
SHEARED = np.array([[1.0, 0.0, 0.0], [0.3, 1.0, 0.0], [-0.1, 0.2, 1.1]])


def cloud(n, ratio, fraction, vectors, seed):
    """Random sequential addition in a periodic cell: n spheres without overlap, the largest first."""
    rng = np.random.default_rng(seed)
    radii = np.sort(rng.uniform(ratio, 1.0, n))[::-1]
    radii *= np.cbrt(fraction * abs(np.linalg.det(vectors)) / (4 / 3 * np.pi * (radii**3).sum()))
    fractions = np.empty((n, 3))
    k = 0
    while k < n:
        place = rng.uniform(0, 1, 3)
        away = fractions[:k] - place
        away -= np.rint(away)  # spheres here are much smaller than the cell
        if (((away @ vectors) ** 2).sum(axis=1) > (radii[:k] + radii[k]) ** 2).all():
            fractions[k] = place
            k += 1
    return Packing(fractions @ vectors, radii, Cell(vectors, rng.uniform(-3, 3, 3)))


@st.composite
def random_packings(draw):
    """Packings of up to 40 spheres, sizes to 1:10, in orthogonal and sheared cells; some spheres overlap."""
    rng = np.random.default_rng(draw(st.integers(0, 2**32 - 1)))
    vectors = np.diag(rng.uniform(0.5, 2.0, 3)) + draw(st.sampled_from([0.0, 0.3, 0.6])) * rng.uniform(-1, 1, (3, 3))
    assume(abs(np.linalg.det(vectors)) > 0.1)
    n = draw(st.integers(1, 40))
    radii = 1.0 / rng.uniform(1.0, draw(st.sampled_from([1.0, 2.0, 10.0])), n)
    solid = draw(st.floats(0.005, 0.2))
    radii *= np.cbrt(solid * abs(np.linalg.det(vectors)) / (4 / 3 * np.pi * (radii**3).sum()))
    packing = Packing(rng.uniform(0, 1, (n, 3)) @ vectors, radii, Cell(vectors, rng.uniform(-3, 3, 3)))
    smaller = radii[packing.overlaps.pairs].min(axis=1)
    assume((packing.overlaps.depths < 1.9 * smaller).all() and radii.max() < packing.box.shortest)
    return packing


MESH = PeriodicMesh(cloud(30, 0.5, 0.2, np.eye(3), seed=1))


@settings(max_examples=60)
@given(random_packings())
def test_sums_over_the_mesh_are_those_of_the_cell(packing):
    mesh, volume, n = PeriodicMesh(packing), packing.box.volume, len(packing)
    void = volume * packing.porosity
    assert mesh.cell_volumes.sum() == pytest.approx(volume, rel=1e-12)
    assert mesh.laguerre_volumes.sum() == pytest.approx(volume, rel=1e-12)
    for volumes in (mesh.facets.volumes, mesh.cell_void_volumes, mesh.pore_volumes):
        assert volumes.sum() == pytest.approx(void, rel=1e-12)
    if len(packing.overlaps.pairs) == 0:
        spheres = mesh.sphere_owners.rows[mesh.facets.vertices]
        surfaces = np.bincount(spheres.ravel(), mesh.facets.surfaces.ravel(), n)
        assert_allclose(surfaces, 4 * np.pi * packing.radii**2, rtol=1e-11)
        assert mesh.pore_surfaces.sum() == pytest.approx(4 * np.pi * (packing.radii**2).sum(), rel=1e-12)
    # Areas of the facets of each pore add up to nothing: it is closed.
    owners = mesh.pore_owners.rows[mesh.throats.pores]
    areas = mesh.throats.total_vectors(mesh.facets.areas[:, None] * mesh.facets.normals)[mesh.throats.first_facets]
    for axis in range(3):
        out = np.bincount(owners[:, 0], areas[:, axis], mesh.n_pores)
        assert_allclose(out, np.bincount(owners[:, 1], areas[:, axis], mesh.n_pores), atol=1e-12 * volume ** (2 / 3))


def test_all_throats_of_2000_spheres_are_those_of_their_images_between_far_walls():
    packing = cloud(2000, 0.4, 0.3, SHEARED, seed=3)
    mesh = PeriodicMesh(packing)
    torus, radii = mesh.triangulation, packing.radii
    fractions = np.clip(np.linalg.solve(torus.vectors.T, torus.points.T).T, 0, 1)
    images = images_within(fractions, faces_of(torus.vectors).heights, 8 * radii.max())
    points = torus.points[images.spheres] + images.steps @ torus.vectors
    far = PoreMesh(Packing(points, radii[images.spheres], Box(points.min(axis=0) - 2, points.max(axis=0) + 2)))

    def names(spheres, steps):
        """Spheres of each facet and the steps between them: rows that do not depend on the image of the facet."""
        rows = np.concatenate([spheres[:, :, None], steps], axis=2)
        order = np.lexsort(rows.transpose(2, 0, 1)[::-1], axis=1)
        rows = np.take_along_axis(rows, order[:, :, None], axis=1)
        rows[:, :, 1:] -= rows[:, :1, 1:].copy()
        return map(tuple, rows.reshape(len(rows), -1))

    vertices = far.facets.vertices
    at_home = np.append(~images.steps.any(axis=1), np.zeros(6, bool))
    kept = np.flatnonzero(at_home[vertices.min(axis=1)] & (vertices < len(points)).all(axis=1))
    found = dict(
        zip(
            names(images.spheres[vertices[kept]], images.steps[vertices[kept]]),
            far.throats.facet_throat[kept],
            strict=True,
        )
    )
    spheres, steps = mesh.sphere_owners
    rows = mesh.throats.spheres
    same = np.array([found[name] for name in names(spheres[rows], steps[rows])])
    assert len(np.unique(same)) == len(same) and same.min() >= 0
    assert mesh.n_united > 100
    for model in (HydraulicRadius(), EffectiveRadius(), SectionFriction()):
        conductances = [throat_conductances(m, model, NO_SLIP, 1.0) for m in (mesh, far)]
        assert_allclose(conductances[0], conductances[1][same], rtol=1e-12)
    parts = []
    for m in (mesh, far):
        beyond = SectionFriction().drop_beyond_vertices(m.throats, NO_SLIP)
        parts.append(np.zeros((len(m.throats), 2)))
        parts[-1][beyond.throats] = np.sort(beyond.parts, axis=1)
    assert_allclose(parts[0], parts[1][same], atol=1e-12)


def test_the_cells_of_one_period_are_tetrahedra_for_others():
    mesh = MESH
    solids = polyhedra(mesh)
    nodes = solids.points[solids.connectivity.reshape(-1, 4)]
    volumes = np.linalg.det(nodes[:, 1:] - nodes[:, :1]) / 6
    assert_allclose(volumes, mesh.cell_volumes, atol=1e-14)  # positively oriented
    assert_allclose(solids.points[:30] - mesh.packing.wrapped().centres, 0.0, atol=1e-12)
    grid = cells_grid(mesh, volume=mesh.pore_volumes)
    assert grid.GetNumberOfCells() == mesh.n_cells
    assert grid.GetCellData().GetArray("volume").GetNumberOfTuples() == mesh.n_cells


def test_a_pore_united_with_its_own_image_is_refused():
    packing = Packing([[0.5, 0.5, 0.5], [0, 0, 0]], [np.sqrt(3) / 4] * 2, Cell([1, 1, 1]))
    mesh = PeriodicMesh(packing, unite_tolerance=0.9)
    with pytest.raises(InputError, match=r"the pore at \[.*\] m is united with its own image: give a smaller unite"):
        mesh.pore_centres.sum()


def test_a_mesh_needs_a_cell_and_a_tolerance():
    packing = Packing([[0.5, 0.5, 0.5]], [0.3], Cell([1, 1, 1]))
    with pytest.raises(InputError, match="in no periodic cell. Give it one: packing.with_box"):
        PeriodicMesh(packing.with_box(Box([0, 0, 0], [1, 1, 1])))
    with pytest.raises(InputError, match="must lie in"):
        PeriodicMesh(packing, unite_tolerance=1.0)
    with pytest.raises(InputError, match="packing must be a Packing in a Cell"):
        PeriodicMesh([[0, 0, 0]])
    assert repr(PeriodicMesh(packing)) == "PeriodicMesh(1 sphere, 1 pore, 3 throats, cell 1×1×1 m)"


WALLS = Walls.along("y")


@pytest.mark.parametrize(
    "use",
    [
        lambda m, k, p: m.box,
        lambda m, k, p: m.inscribed_spheres,
        lambda m, k, p: m.cell_volume_rates(np.zeros((30, 3)), np.zeros(6)),
        lambda m, k, p: m.to_fipy(),
        lambda m, k, p: m.to_openpnm(),
        lambda m, k, p: m.plot(),
        lambda m, k, p: flow_functions.PoreFlow(m, WALLS),
        lambda m, k, p: flow_functions.solve_pressure(m, k, WALLS),
        lambda m, k, p: flow_functions.solve_imposed_flow(m, k, WALLS),
        lambda m, k, p: flow_functions.fluxes(m, k, p),
        lambda m, k, p: flow_functions.acting_pressure(m, SectionFriction(), k, WALLS, p),
        lambda m, k, p: flow_functions.solid_pressure_weights(m, SectionFriction(), k, NO_SLIP, p > 0),
        lambda m, k, p: flow_functions.grain_forces(m, p, WALLS),
        lambda m, k, p: flow_functions.pore_velocities(m, k, np.empty(0)),
        lambda m, k, p: flow_functions.directional_permeabilities(m),
        lambda m, k, p: effective_diffusion(m, "x"),
        lambda m, k, p: cell_strains(m, np.zeros((30, 3)), np.zeros(6)),
    ],
)
def test_what_needs_walls_is_refused_in_words(use):
    conductances = throat_conductances(MESH, HydraulicRadius(), NO_SLIP, 1.0)
    with pytest.raises(InputError, match="a periodic mesh has no walls, which this needs: use PeriodicFlow"):
        use(MESH, conductances, np.zeros(MESH.n_pores))


def test_a_walled_mesh_of_a_periodic_packing_is_refused():
    with pytest.raises(InputError, match="in a periodic cell, which has no walls: porefv has PeriodicMesh"):
        PoreMesh(MESH.packing)
