"""What must hold at the extremes: of contrast, size, place, overlap, memory, and of files half written."""

import dataclasses
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_allclose

from porefv import results
from porefv.conductance.effective_radius import EffectiveRadius
from porefv.conductance.hydraulic_radius import HydraulicRadius
from porefv.conductance.model import ConductanceModel
from porefv.conductance.section_friction.model import SectionFriction
from porefv.errors import ComputationError, InputError
from porefv.flow.fluid import Fluid
from porefv.flow.flux import fluxes, net_outflows, wall_face_fluxes
from porefv.flow.pore_flow import PoreFlow
from porefv.flow.pressure import solve_pressure
from porefv.flow.walls import Wall, Walls
from porefv.mesh.pore_mesh import PoreMesh
from porefv.packing import memory_estimate
from porefv.packing.box import Box
from porefv.packing.packing import Packing
from porefv.solvers.pressure_equation import free_network, solve_network
from porefv.tessellation.triangulation import RegularTriangulation

UNIT = Box([0, 0, 0], [1, 1, 1])
PACKINGS = Path(__file__).parents[2] / "data" / "packings"


def resized(packing, factor):
    return Packing(packing.centres, packing.radii * factor, packing.box)


def scaled(packing, length, order=slice(None)):
    box = Box([0] * 3, packing.box.size * length)
    return Packing(packing.centres[order] * length, packing.radii[order] * length, box)


# ---- contrast ------------------------------------------------------------------------------------------------


def with_fines(packing, ratio, count=60):
    """Fines at random in the voids, smaller than the smallest grain by the ratio."""
    rng = np.random.default_rng(0)
    radius = packing.radii.min() / ratio
    centres, radii = packing.centres, packing.radii
    while len(radii) < len(packing) + count:
        place = rng.uniform(radius, 1 - radius, 3)
        if (np.linalg.norm(centres - place, axis=1) > radii + radius).all():
            centres, radii = np.vstack([centres, place]), np.append(radii, radius)
    return Packing(centres, radii, packing.box)


@pytest.mark.parametrize("ratio", [10, 1e3, 1e4])
def test_fines_that_float_in_voids_lose_no_digits(reference, ratio):
    # Their throats conduct up to 10^20 times as well as those between grains: differences of single doubles are noise.
    packing = with_fines(reference("n54_s1"), ratio)
    order = np.random.default_rng(1).permutation(len(packing))
    flow, copy = (PoreFlow(p, Walls.along("y"), Fluid(1.0)) for p in (packing, scaled(packing, 0.3, order)))
    assert flow.solver_report.imbalance <= 1e-10
    assert flow.imbalance <= 1e-10
    assert flow.forces.conservation_residual <= 1e-12
    assert_allclose(copy.permeability / 0.3**2, flow.permeability, rtol=1e-10)
    largest = np.abs(flow.forces.total).max()
    assert_allclose(copy.forces.total / 0.3**2, flow.forces.total[order], rtol=0, atol=1e-8 * largest)


@pytest.mark.parametrize("solver", ["auto", "cg"])
@pytest.mark.parametrize("decades", [12, 20, 28])
def test_flow_and_pressures_are_those_of_rational_numbers_whatever_the_contrast(exact_solution, solver, decades):
    for seed in range(6):
        rng = np.random.default_rng(seed)
        n = 18
        tree = np.stack([np.arange(1, n), (rng.random(n - 1) * np.arange(1, n)).astype(int)], axis=1)
        pairs = np.concatenate([tree, rng.integers(0, n, (n, 2))])
        pairs = pairs[pairs[:, 0] != pairs[:, 1]]
        k = 10.0 ** rng.uniform(-decades, 0, len(pairs))
        fixed = np.full(n, np.nan)
        fixed[[0, n - 1]] = 1.0, 0.0
        exact = exact_solution(pairs, k, fixed)
        found = solve_network(pairs, k, fixed, solver=solver)
        assert found.report.imbalance <= 1e-10 and found.report.pressure_error <= 1e-8
        # Pores behind the least of conductances, too, and so none outside of what is imposed.
        assert_allclose(found.pressure, [float(p) for p in exact], rtol=0, atol=1e-8)
        inflow = exact_flow = 0.0
        for (i, j), kij in zip(pairs.tolist(), k.tolist(), strict=True):
            if 0 in (i, j):
                sense = 1.0 if i == 0 else -1.0
                inflow += sense * kij * ((found.pressure[i] - found.pressure[j]) + (found.rest[i] - found.rest[j]))
                exact_flow += sense * kij * float(exact[i] - exact[j])
        assert_allclose(inflow, exact_flow, rtol=1e-9)


@pytest.mark.parametrize("decades", [16, 21])
def test_pairs_of_pores_joined_by_stiff_throats_are_those_of_rational_numbers(exact_solution, decades):
    # As between the specks and walls of a slab: the first correction makes flows in them larger than all others.
    for seed in range(6):
        rng = np.random.default_rng(seed)
        n = 24
        stiff = np.arange(n).reshape(-1, 2)
        other = rng.integers(0, n, (4 * n, 2))
        other = other[other[:, 0] // 2 != other[:, 1] // 2]
        k = 10.0 ** np.append(rng.uniform(decades - 4, decades, len(stiff)), rng.uniform(-2, 0, len(other)))
        fixed = np.full(n, np.nan)
        fixed[[0, n - 1]] = 1.0, 0.0
        found = solve_network(np.concatenate([stiff, other]), k, fixed)
        exact = exact_solution(np.concatenate([stiff, other]), k, fixed)
        assert found.report.imbalance <= 1e-10 and found.report.pressure_error <= 1e-8
        assert_allclose(found.pressure, [float(p) for p in exact], rtol=0, atol=1e-8)


@pytest.mark.parametrize("solver", ["auto", "direct", "cg"])
def test_parts_that_lead_from_nowhere_to_nowhere_have_the_pressure_of_their_end(solver):
    # A closed throat between two chains, each held at one end: nothing flows, and there is nothing to be relative to.
    pairs = np.array([[0, 1], [1, 2], [2, 3], [3, 4], [4, 5], [5, 6], [6, 7]])
    k = np.array([1.0, 1e-5, 3e-4, 0.0, 2e-6, 1.0, 7.0])
    fixed = np.array([1.0, *[np.nan] * 6, 0.3])
    found = solve_network(pairs, k, fixed, solver=solver)
    assert_allclose(found.pressure, [1.0] * 4 + [0.3] * 4, rtol=1e-15)
    assert found.report.imbalance == 0.0


@pytest.mark.parametrize("name", ["sc8", "n25_s1", "n54_s1", "n200_s1"])
def test_the_matrix_is_symmetric_and_positive_definite(reference, name):
    flow = PoreFlow(reference(name), Walls.along("y"), Fluid(1.0))
    fixed = flow.imposed_pressures
    free = np.isnan(fixed) & ~flow.solution.isolated
    network, _ = free_network(
        flow.mesh.throats.pores, flow.conductances, np.nan_to_num(fixed), free, np.zeros(len(fixed))
    )
    matrix = network.to_matrix().toarray()
    np.testing.assert_array_equal(matrix, matrix.T)
    scale = 1 / np.sqrt(np.diag(matrix))
    assert np.linalg.eigvalsh(scale[:, None] * matrix * scale).min() > 0.0


# ---- lattices and mirror images ------------------------------------------------------------------------------


def nudged(packing, size):
    moved = packing.centres + size * np.random.default_rng(0).uniform(-1, 1, packing.centres.shape)
    return Packing(moved, packing.radii, packing.box)


@pytest.mark.parametrize("kind", ["sc", "bcc", "fcc", "hcp"])
@pytest.mark.parametrize("nudge", [1e-16, 1e-14, 1e-12, 1e-10])
def test_a_lattice_that_rounding_has_bent_has_the_permeability_of_the_exact_one(lattice, unit_flow, kind, nudge):
    exact = unit_flow(PoreMesh(lattice(kind, 3)), Walls.along("y"))
    bent = unit_flow(PoreMesh(nudged(lattice(kind, 3), nudge)), Walls.along("y"))
    # Flat cells between the halves of a square have no say: one throat it is, as before.
    assert bent.mesh.n_pores == exact.mesh.n_pores
    assert_allclose(bent.permeability, exact.permeability, rtol=10 * nudge + 1e-12)
    copy = unit_flow(PoreMesh(scaled(bent.mesh.packing, 0.3)), Walls.along("y"))  # bent otherwise by rounding
    assert_allclose(copy.permeability / 0.3**2, bent.permeability, rtol=1e-11)
    assert_allclose(copy.forces.total / 0.3**2, bent.forces.total, rtol=0, atol=1e-11)


@pytest.mark.parametrize(
    ("model", "kind", "jump"),
    [
        (HydraulicRadius, "sc", 8e-3), (HydraulicRadius, "bcc", 3e-8), (HydraulicRadius, "fcc", 4e-5),
        (HydraulicRadius, "hcp", 2e-5), (SectionFriction, "sc", 7.3e-3), (SectionFriction, "bcc", 2e-7),
        (SectionFriction, "fcc", 6e-6), (SectionFriction, "hcp", 1.5e-3),
    ],
)  # fmt: skip
def test_a_lattice_that_is_bent_in_earnest_jumps_to_another_permeability_once(lattice, model, kind, jump):
    # From the tolerance of ties on, squares are triangles with a flat cell between, each a throat of its own.
    exact, *bent = (
        PoreFlow(nudged(lattice(kind, 3), x), Walls.along("y"), conductance=model()).permeability
        for x in (0.0, 1e-7, 1e-6)
    )
    assert_allclose(bent, exact, rtol=jump + 3e-5)


@pytest.mark.parametrize("tiles", [(2, 1, 1), (1, 2, 1), (2, 2, 2), (3, 1, 2)])
def test_mirror_images_between_walls_of_symmetry_have_the_permeability_of_one(reference, tiles):
    packing = reference("n25_s1")
    copies = [np.where(np.array(t) % 2 == 1, 1 - packing.centres, packing.centres) + t for t in np.ndindex(tiles)]
    many = Packing(np.concatenate(copies), np.tile(packing.radii, len(copies)), Box([0] * 3, tiles))
    walls = Walls.along("y", slip=True)
    one, all_of_them = PoreFlow(packing, walls), PoreFlow(many, walls)
    assert_allclose(all_of_them.permeability, one.permeability, rtol=1e-9)
    assert all_of_them.solver_report.imbalance <= 1e-10


# ---- one more grain ------------------------------------------------------------------------------------------

# How much a grain may raise the permeability: nothing, if throats were Stokes problems. To the models of conductance
# dust in a pore makes throats shorter, and hardly narrower (docs/extremes.md).
RISE = {HydraulicRadius: 0.13, EffectiveRadius: 0.11, SectionFriction: 0.001}


def widest_pores(packing, count):
    """Places and radii of the largest spheres that fit at vertices of pores, no two of them in one void."""
    places = PoreMesh(packing).vertices
    places = places[((places > 0) & (places < 1)).all(axis=1)]
    room = np.minimum(places, 1 - places).min(axis=1)
    for centre, radius in zip(packing.centres, packing.radii, strict=True):
        room = np.minimum(room, np.linalg.norm(places - centre, axis=1) - radius)
    kept = []
    for k in np.argsort(-room, kind="stable"):
        if all(np.linalg.norm(places[k] - places[other]) > 0.5 * room[k] for other in kept):
            kept.append(k)
    return places[kept[:count]], room[kept[:count]]


def with_one_more(packing, place, radius, model):
    more = Packing(np.vstack([packing.centres, place]), np.append(packing.radii, radius), packing.box)
    return PoreFlow(more, Walls.along("y"), conductance=model()).permeability


@pytest.mark.parametrize("model", RISE)
@pytest.mark.parametrize("name", ["sc8", "n25_s1", "n54_s1", "n200_s1"])
def test_one_more_grain_lowers_the_permeability(reference, name, model):
    packing = reference(name)
    (place,), (room,) = widest_pores(packing, 1)
    before = PoreFlow(packing, Walls.along("y"), conductance=model()).permeability
    for size in (0.001, 0.01, 0.1, 0.3, 0.5, 1.0):
        after = with_one_more(packing, place, size * room, model)
        assert after < before * (1.0 + (RISE[model] if size < 1.0 else 0.0))


@pytest.mark.parametrize("name", ["n25_s1", "n54_s1"])
def test_one_more_grain_lowers_the_permeability_in_the_mean_of_pores(reference, name):
    packing = reference(name)
    places, rooms = widest_pores(packing, 20)
    before = PoreFlow(packing, Walls.along("y")).permeability
    for size in (0.01, 0.2, 0.6):
        after = [with_one_more(packing, x, size * r, SectionFriction) for x, r in zip(places, rooms, strict=True)]
        assert np.mean(after) < before
        assert max(after) < 1.008 * before


@pytest.mark.parametrize("ratio", [10, 100, 1e4])
def test_fines_that_float_in_voids_leave_the_permeability_alone(reference, ratio):
    # 500 of them; the hydraulic radius has it rise by a quarter to a third.
    packing = reference("n200_s1")
    before, after = (PoreFlow(p, Walls.along("y")).permeability for p in (packing, with_fines(packing, ratio, 500)))
    assert_allclose(after, before, rtol=0.07)


@pytest.mark.parametrize("model", RISE)
def test_larger_grains_lower_the_permeability(reference, model):
    packing = reference("n200_s1")
    k = [
        PoreFlow(resized(packing, f), Walls.along("y"), conductance=model()).permeability
        for f in (0.1, 0.3, 0.5, 0.7, 0.9, 0.99, 1.0, 1.01, 1.03)
    ]
    assert (np.diff(k) < 0.0).all()


# ---- overlap -------------------------------------------------------------------------------------------------


def counted_porosity(packing, m=60):
    """By counting the points of a grid, within about 1/m² of the truth."""
    axis = (np.arange(m) + 0.5) / m
    grid = np.stack(np.meshgrid(axis, axis, axis, indexing="ij"), axis=-1).reshape(-1, 3)
    void = np.ones(len(grid), bool)
    for centre, radius in zip(packing.centres, packing.radii, strict=True):
        void &= ((grid - centre) ** 2).sum(axis=1) > radius**2
    return void.mean()


@pytest.mark.parametrize("name", ["n25_s1", "n54_s1"])
@pytest.mark.parametrize("factor", [1.0, 1.2, 1.3, 1.45, 1.6, 1.7])
def test_porosity_is_that_of_the_union_of_the_spheres(reference, name, factor):
    packing = resized(reference(name), factor)
    assert packing.porosity == pytest.approx(counted_porosity(packing), abs=2e-3)
    assert (packing.triple_overlaps > 0) == (factor > 1.15)
    mesh = PoreMesh(packing, wall_tolerance=2.0)
    void = packing.porosity * packing.box.volume
    for volumes in (mesh.facets.volumes, mesh.cell_void_volumes, mesh.pore_volumes):
        assert volumes.sum() == pytest.approx(void, abs=1e-12)


@pytest.mark.parametrize("factor", [1.0, 1.3, 1.6, 1.9])
def test_the_surface_is_the_derivative_of_the_volume(reference, factor):
    packing, change = reference("n25_s1"), 1e-5
    mesh = PoreMesh(resized(packing, factor), wall_tolerance=2.0)
    grown, shrunk = (resized(packing, factor * (1.0 + sign * change)).solid_volume for sign in (1, -1))
    of_spheres = mesh.facets.vertices < mesh.n_spheres
    radii = np.append(mesh.packing.radii, np.zeros(6))[mesh.facets.vertices]
    by_surfaces = (mesh.facets.surfaces * radii)[of_spheres].sum()
    assert by_surfaces == pytest.approx((grown - shrunk) / (2.0 * change), rel=1e-8)


def test_balls_that_fill_the_box_leave_nothing():
    packing = Packing([[0.3, 0.5, 0.5], [0.7, 0.5, 0.5]], [0.8, 0.9], UNIT)
    assert packing.porosity == pytest.approx(0.0, abs=1e-12)
    assert Packing([[0.3, 0.5, 0.5]], [0.9], UNIT).porosity == pytest.approx(
        counted_porosity(Packing([[0.3, 0.5, 0.5]], [0.9], UNIT)), abs=2e-3
    )


def test_a_clump_has_the_volume_of_its_union_wherever_it_is():
    # Three balls of radius 1 whose centres lie in each other, by the formula of Gibson and Scheraga (1987).
    rng = np.random.default_rng(3)
    centres, radii = np.array([[0.0, 0, 0], [0.7, 0, 0], [0.35, 0.6, 0]]), np.array([1.0, 0.9, 0.8])
    points = rng.uniform(-1.2, 2.2, (400_000, 3))
    inside = (((points[:, None] - centres) ** 2).sum(axis=2) < radii**2).any(axis=1).mean() * 3.4**3
    free = Packing(centres, radii).solid_volume
    assert free == pytest.approx(inside, rel=6e-3)
    for _ in range(5):
        turn, _ = np.linalg.qr(rng.normal(size=(3, 3)))
        box = Box([-5, -6, -7], [4, 5, 6])
        assert Packing(centres @ turn.T, radii, box).solid_volume == pytest.approx(free, rel=1e-12)


@pytest.mark.parametrize("factor", [1.3, 1.6])
def test_flow_through_cemented_grains_balances(reference, unit_flow, factor):
    flow = unit_flow(PoreMesh(resized(reference("n54_s1"), factor), wall_tolerance=2.0), Walls.along("y"))
    assert np.isfinite(flow.pressure).all() and flow.permeability >= 0.0
    assert flow.forces.conservation_residual < 1e-10
    assert flow.permeability < 1e-100 or flow.imbalance < 1e-10  # closed, or open


def test_triples_of_spheres_and_walls_are_counted():
    r, h = 0.1, 0.1 * np.sqrt(3)
    corners = np.array([[0.0, 0, 0], [1, 0, 0], [0.5, np.sqrt(3) / 2, 0]])
    for side, triples in ((1.74, 0), (1.73, 1)):  # they share their middle from √3 radii on
        assert Packing(0.4 + side * r * corners, [r] * 3, UNIT).triple_overlaps == triples
    # Three in a row, the outer two within reach of each other, inside the middle one.
    assert Packing([[0.4, 0.5, 0.5], [0.5, 0.5, 0.5], [0.595, 0.5, 0.5]], [r, 0.09, r], UNIT).triple_overlaps == 1
    # A sphere that reaches over an edge of the box, and two whose lens reaches over a wall.
    assert Packing([[0.08, 0.5, 0.08]], [r], UNIT).triple_overlaps == 0 + (r**2 > 2 * 0.08**2)
    assert Packing([[0.06, 0.5, 0.06]], [r], UNIT).triple_overlaps == 1
    for z, triples in ((0.06, 0), (0.04, 1)):  # the circle they share has radius 0.05
        assert Packing([[0.5 - h / 2, 0.5, z], [0.5 + h / 2, 0.5, z]], [r, r], UNIT).triple_overlaps == triples


def deep_lattice(radius):
    grid = (np.stack(np.meshgrid(*[np.arange(4)] * 3), axis=-1).reshape(-1, 3) + 0.5) / 4
    return Packing(grid, np.full(64, radius / 4), UNIT)


def test_the_porosity_of_a_lattice_however_deep_the_overlap():
    # Of one cell: 1 - 4π/3 r³ + 6 caps; the lenses of a cell's edges are beyond the reach of 0.7.
    caps = 6 * np.pi * 0.2**2 * (0.7 - 0.2 / 3)
    assert deep_lattice(0.7).porosity == pytest.approx(1 - 4 / 3 * np.pi * 0.7**3 + caps, rel=1e-12)
    for radius in (0.72, 0.8, 0.95):
        one = Packing([[0.5, 0.5, 0.5]], [radius], UNIT)
        assert one.porosity == pytest.approx(counted_porosity(one, 100), abs=3e-4)
        assert deep_lattice(radius).porosity == pytest.approx(one.porosity, abs=1e-12)


@pytest.mark.parametrize("radius", [0.6, 0.72, 0.8, 0.95])
def test_forces_add_up_however_deep_the_overlap(unit_flow, radius):
    # Of squares cut in two, neither of whose triangles has a surface left that could take the drag.
    flow = unit_flow(PoreMesh(deep_lattice(radius), wall_tolerance=1.0), Walls.along("y"))
    assert flow.forces.conservation_residual < 1e-12


def permeability_with_holes(flow, closed, part):
    """Permeability with closed throats opened: round holes of a part of their area in thin plates."""
    mesh, walls, throats = flow.mesh, flow.walls, flow.mesh.throats
    images = throats.mirror_images(walls.slip)
    holes = np.sqrt(part * images * throats.areas / np.pi) ** 3 / (3 * images * flow.fluid.viscosity)
    conductances = np.where(closed, holes, flow.conductances)
    flux = fluxes(mesh, conductances, solve_pressure(mesh, conductances, walls))
    return flow.permeability / flow.inflow * inflow(mesh, walls, flux)


def inflow(mesh, walls, flux):
    into = wall_face_fluxes(mesh, net_outflows(mesh, flux), walls.held)
    return into[into > 0.0].sum()


@pytest.mark.parametrize("model", [SectionFriction, HydraulicRadius])
@pytest.mark.parametrize("factor", [1.0, 1.15, 1.2, 1.25])
def test_closed_throats_cost_no_more_than_the_error_told(reference, model, factor):
    mesh = PoreMesh(resized(reference("n200_s1"), factor), wall_tolerance=0.9)
    flow = PoreFlow(mesh, Walls.along("y", slip=True), Fluid(1.0), model())
    assert 0.0 <= flow.closing_error < 1e-3
    doubtful = (flow.conductances == 0.0) & ~mesh.throats.covered
    assert (flow.closing_error > 0.0) == doubtful.any() == (factor > 1.0)
    for part in (0.01, 0.3, 1.0):
        opened = permeability_with_holes(flow, doubtful, part)
        assert flow.permeability * (1.0 - 1e-9) < opened
        assert opened < flow.permeability / (1.0 - flow.closing_error) * (1.0 + 1e-9)


# ---- throats of no shape -------------------------------------------------------------------------------------


def in_planes_and_rows(seed):
    """A lattice that touches or overlaps, and dust in one of its planes, or in a row: corners of 0 and 180 degrees."""
    rng = np.random.default_rng(seed)
    m = 2 + seed % 3
    grid = (np.stack(np.meshgrid(*[np.arange(m)] * 3), axis=-1).reshape(-1, 3) + 0.5) / m
    dust = rng.uniform(0.02, 0.98, (20, 3))
    dust[:, 2] = 0.5
    if seed % 2:
        dust[:, 1] = 0.25
    centres = np.vstack([grid, dust])
    radii = np.append(np.full(m**3, rng.choice([0.3, 1.0, 1.2]) * 0.5 / m), 10.0 ** rng.uniform(-6, -2, 20))
    gaps = np.linalg.norm(centres[:, None] - centres, axis=2) - 1.01 * np.maximum(radii[:, None], radii)
    np.fill_diagonal(gaps, 1.0)
    apart = [k for k in range(len(radii)) if k < m**3 or (gaps[k] > 0.0).all()]
    return Packing(centres[apart], radii[apart], UNIT)


@pytest.mark.parametrize("scale", [1.0, 1e-29, 1e29])
def test_dust_in_planes_and_rows_makes_no_force_larger_than_what_drives_the_flow(scale):
    for seed in range(30):
        packing = scaled(in_planes_and_rows(seed), scale)
        flow = PoreFlow(PoreMesh(packing, wall_tolerance=1.0), Walls.along("y"), Fluid(1.0))
        assert (flow.conductances[flow.mesh.throats.fluid_areas <= 0.0] == 0.0).all()
        assert (flow.conductances[~flow.mesh.throats.closed] > 0.0).all()
        assert np.linalg.norm(flow.forces.total, axis=1).max() < flow.forces.scale
        assert flow.forces.conservation_residual < 1e-12


@pytest.mark.parametrize("seed", [18, 69, 117])
def test_a_lattice_with_sites_left_out_has_finite_forces(seed):
    # Three spheres nearly in a row, and the pore's vertex in their plane: its way to the middle one's patch is a line.
    rng = np.random.default_rng(seed)
    grid = (np.stack(np.meshgrid(*[np.arange(3)] * 3), axis=-1).reshape(-1, 3) + 0.5) / 3
    grid = grid[rng.random(27) < 0.7]
    radii = 0.5 / 3 * 10.0 ** (-[0, 1, 6][seed % 3] * rng.random(len(grid)))
    forces = PoreFlow(Packing(grid, radii, UNIT), Walls.along("x"), Fluid(1.0)).forces
    assert np.abs(forces.total).max() < forces.scale
    assert forces.conservation_residual < 1e-12


@pytest.mark.parametrize("model", [HydraulicRadius, EffectiveRadius, SectionFriction])
def test_a_mesh_that_is_one_pore_has_no_flow(model):
    mesh = PoreMesh(Packing([[0.5] * 3], [5.0], UNIT), unite_tolerance=0.99, wall_tolerance=1.0)
    assert mesh.n_pores == 1 and len(mesh.throats) == 0
    flow = PoreFlow(mesh, Walls.along("y"), conductance=model())
    assert flow.permeability == 0.0
    assert (flow.forces.total == 0.0).all()


# ---- numbers that cannot be computed with --------------------------------------------------------------------


@pytest.mark.parametrize("scale", [1e-60, 1e-31, 1e31, 1e60])
def test_boxes_whose_lengths_leave_double_precision_are_refused(reference, scale):
    with pytest.raises(InputError, match="sides .* must lie between 1e-30 and 1e.30 m"):
        PoreMesh(scaled(reference("n25_s1"), scale))


@pytest.mark.parametrize("scale", [1e-29, 1e29])
def test_boxes_within_the_limits_lose_no_digits(reference, unit_flow, scale):
    packing = reference("n25_s1")
    flow, other = (unit_flow(PoreMesh(p), Walls.along("y")) for p in (packing, scaled(packing, scale)))
    assert_allclose(other.permeability / scale**2, flow.permeability, rtol=1e-11)


@pytest.mark.parametrize("radius", [1e-16, 1e-300])
def test_a_radius_that_the_box_cannot_resolve_is_refused(radius):
    with pytest.raises(InputError, match="radius not between 1e-15 m"):
        PoreMesh(Packing([[0.5] * 3, [0.2] * 3], [0.1, radius], UNIT))


def test_pressures_viscosities_densities_and_gravity_beyond_products_are_refused(reference):
    for value in (1e-70, 1e70, -1e300):
        with pytest.raises(InputError, match="pressure must be 0 or of size"):
            Wall(pressure=value)
    for value in (1e-70, 1e70):
        with pytest.raises(InputError, match="viscosity must lie between"):
            Fluid(viscosity=value)
    with pytest.raises(InputError, match="density must be at most"):
        Fluid(density=1e70)
    with pytest.raises(InputError, match="gravity must be at most"):
        PoreFlow(reference("n25_s1"), Walls.along("y"), gravity=(0, 0, 1e70))


@pytest.mark.parametrize("value", [np.nan, np.inf])
def test_a_model_that_gives_no_number_is_an_error(reference, value):
    class Broken(ConductanceModel):
        name = "broken"

        def conductivity(self, throats, slip):
            conductivity = throats.fluid_areas**2
            conductivity[3] = value
            return conductivity

    flow = PoreFlow(reference("n25_s1"), Walls.along("y"), conductance=Broken())
    with pytest.raises(ComputationError, match="1 of 240 conductances of broken are not finite"):
        _ = flow.permeability


def test_a_force_that_is_no_number_cannot_pass_for_conserved(reference, unit_flow):
    forces = unit_flow(PoreMesh(reference("n25_s1")), Walls.along("y")).forces
    broken = dataclasses.replace(forces, pressure=np.full_like(forces.pressure, np.nan))
    assert np.isnan(broken.conservation_residual)


# ---- what is counted -----------------------------------------------------------------------------------------


def test_summary_counts_every_case_that_has_a_rule_of_its_own(reference, tmp_path):
    mesh = PoreMesh(with_fines(reference("n54_s1"), 1e4))
    walls = Walls(x_min=Wall(pressure=1.0), y_min=Wall(pressure=0.0))
    flow = PoreFlow(mesh, walls, Fluid(1.0), HydraulicRadius())
    summary = results.read(results.write(flow, tmp_path / "results", quantities=["pressure"], vtk=False)).summary
    assert set(summary["unusual"]) == {
        "closed_throats", "throats_without_length", "throats_without_conductance", "isolated_pores",
        "pores_of_several_pressures", "throats_without_volume", "throats_without_surface", "throats_wider_than_the_box",
    }  # fmt: skip
    assert summary["unusual"]["throats_wider_than_the_box"] > 0
    edge = (flow.mesh.cells >= flow.mesh.n_spheres).sum(axis=1) >= 2
    assert 0 < summary["unusual"]["pores_of_several_pressures"] <= edge.sum()
    packing = summary["packing"]
    assert (packing["hidden_spheres"], packing["overlapping_triples"]) == (0, 0)
    assert summary["solver"]["pressure_error"] <= 1e-8


# ---- memory --------------------------------------------------------------------------------------------------


def test_a_packing_with_far_more_pores_than_usual_is_refused_before_memory_runs_out(monkeypatch):
    # Two skew rows of m spheres have m² cells, hundreds a sphere.
    m = 300
    s = np.linspace(0.1, 0.9, m)
    rows = [np.stack(c, axis=1) for c in ((s, 0 * s + 0.4, 0 * s + 0.4), (0 * s + 0.6, s, 0 * s + 0.6))]
    centres, radii = np.concatenate(rows), np.full(2 * m, 1e-3)
    assert len(RegularTriangulation(centres, radii, UNIT).cells) > m**2 / 2
    monkeypatch.setattr(memory_estimate, "available", lambda: 20 * 2**20)
    with pytest.raises(ComputationError, match="more than .* pores, which need .* MiB of memory, 20 MiB are free"):
        RegularTriangulation(centres, radii, UNIT)


def test_memory_is_compared_before_work_starts(reference, monkeypatch):
    monkeypatch.setattr(memory_estimate, "available", lambda: 2**20)
    with pytest.raises(ComputationError, match="25 spheres need about .* MiB of memory, 1 MiB are free"):
        _ = PoreMesh(reference("n25_s1")).cells


# ---- files half written --------------------------------------------------------------------------------------

posix = pytest.mark.skipif(os.name != "posix", reason="signals and limits of POSIX")


@pytest.fixture(scope="module")
def compiled(tmp_path_factory):
    """Every kernel of a solve is in numba's cache: where a disk is full, it cannot be put there."""
    flow = PoreFlow(Packing.read(PACKINGS / "n2000_s1.csv"), Walls.along("y"))
    results.write(flow, tmp_path_factory.mktemp("compiled") / "results")


@pytest.fixture
def project(tmp_path, compiled, write_scene):
    """A scene of 2000 spheres, and results of an earlier one."""
    (tmp_path / "results").mkdir()
    (tmp_path / "results" / "summary.json").write_text("earlier")
    write_scene(tmp_path, "n2000_s1.csv", vtk="true")
    return tmp_path


def untouched(project):
    return (
        sorted(path.name for path in project.iterdir()) == ["results", "scene.toml"]
        and [path.name for path in (project / "results").iterdir()] == ["summary.json"]
        and (project / "results" / "summary.json").read_text() == "earlier"
    )


def limit_files_to(size):
    import resource  # of POSIX

    resource.setrlimit(resource.RLIMIT_FSIZE, (size, size))


def solving(project, **options):
    command = [sys.executable, "-m", "porefv", "solve", str(project / "scene.toml"), "--force", "--quiet"]
    return subprocess.Popen(command, stderr=subprocess.PIPE, text=True, **options)


@posix
@pytest.mark.parametrize("after", [0.0, 0.2, 0.6])
def test_an_interruption_leaves_what_existed_and_nothing_half_written(project, after):
    process = solving(project)
    while process.poll() is None and not list(project.glob(".results.porefv-new")):
        time.sleep(0.002)  # until the temporary folder stands: the interruption must clear it away
    time.sleep(after)
    process.send_signal(signal.SIGINT)
    _, said = process.communicate(timeout=60)
    if not untouched(project):  # it was done before
        assert "permeability" in results.read(project / "results").summary
        assert sorted(path.name for path in project.iterdir()) == ["results", "scene.toml"]
        return
    # Python may hand the signal on as it exits, where it came while code from text ran: to a shell that is 130 too.
    assert process.returncode in (130, -signal.SIGINT), said
    assert "interrupted; nothing was written" in said and "Traceback" not in said
    assert untouched(project)


@posix
@pytest.mark.parametrize("room", [0, 300_000])
def test_a_full_disk_loses_nothing_that_existed(project, room):
    process = solving(project, preexec_fn=lambda: limit_files_to(room))
    _, said = process.communicate(timeout=60)
    assert process.returncode == 2, said
    assert "cannot write" in said and "Traceback" not in said
    assert untouched(project)


@posix
@pytest.mark.parametrize("name", ["grains.csv", "grains.txt", "grains.vtp"])
def test_a_packing_written_to_a_full_disk_leaves_the_old_one(tmp_path, name):
    (tmp_path / name).write_text("earlier")
    code = (
        "import sys, porefv; packing = porefv.Packing.read(sys.argv[1])\n"
        "try: packing.write(sys.argv[2])\n"
        "except porefv.InputError as error: sys.exit(f'refused: {error}')"
    )
    done = subprocess.run(
        [sys.executable, "-c", code, str(PACKINGS / "n2000_s1.csv"), str(tmp_path / name)],
        preexec_fn=lambda: limit_files_to(20_000),
        capture_output=True, text=True, timeout=60,
    )  # fmt: skip
    assert done.returncode == 1 and done.stderr.startswith("refused: cannot write"), done.stderr
    assert [path.name for path in tmp_path.iterdir()] == [name] and (tmp_path / name).read_text() == "earlier"
