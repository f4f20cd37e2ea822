"""PeriodicFlow: exact on lattices, independent of how a cell is described, and as the walled flow where they agree."""

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from numpy.testing import assert_allclose

from porefv.conductance.effective_radius import EffectiveRadius
from porefv.conductance.hydraulic_radius import HydraulicRadius
from porefv.conductance.section_friction.model import SectionFriction
from porefv.errors import InputError
from porefv.flow.fluid import Fluid
from porefv.flow.periodic_flow import PeriodicFlow
from porefv.flow.pore_flow import PoreFlow
from porefv.flow.walls import Walls
from porefv.mesh.pore_mesh import PoreMesh
from porefv.packing.cell import Cell
from porefv.packing.packing import Packing

UNIT = Fluid(viscosity=1.0)
MODELS = [HydraulicRadius(), EffectiveRadius(), SectionFriction()]
GRADIENT = np.array([0.7, -1.0, 0.4])
# Basis, touching radius, and vectors of the cell of one sphere.
LATTICES = {
    "sc": ([[0, 0, 0]], 0.5, np.eye(3)),
    "bcc": ([[0, 0, 0], [0.5] * 3], np.sqrt(3) / 4, np.array([[-1, 1, 1], [1, -1, 1], [1, 1, -1]]) / 2),
    "fcc": (
        [[0, 0, 0], [0.5, 0.5, 0], [0.5, 0, 0.5], [0, 0.5, 0.5]],
        np.sqrt(2) / 4,
        np.array([[0, 1, 1], [1, 0, 1], [1, 1, 0]]) / 2,
    ),
}


def flow_of(packing, model=None):
    return PeriodicFlow(packing, UNIT, model)


def cubic(kind, copied, looseness=1.0, shift=(0, 0, 0)):
    basis, radius, _ = LATTICES[kind]
    steps = np.stack(np.meshgrid(*[np.arange(m) for m in copied], indexing="ij"), axis=-1).reshape(-1, 3)
    centres = (np.array(basis)[:, None] + steps).reshape(-1, 3) + shift
    return Packing(centres, np.full(len(centres), looseness * radius), Cell(copied))


@pytest.mark.parametrize("radius", [0.5, 0.45, 0.3])
def test_simple_cubic_with_the_hydraulic_radius_is_the_closed_form(radius):
    # One pore a cell: A^f = 1 - π a², R_h = void over surface, k = A^f R_h² / 2.
    hydraulic = (1 - 4 / 3 * np.pi * radius**3) / (4 * np.pi * radius**2)
    expected = (1 - np.pi * radius**2) * hydraulic**2 / 2
    flow = flow_of(Packing([[0.2, 0.1, 0.3]], [radius], Cell([1, 1, 1])), HydraulicRadius())
    assert_allclose(flow.permeability, expected * np.eye(3), rtol=1e-12, atol=1e-15 * expected)


@pytest.mark.parametrize("kind", LATTICES)
@pytest.mark.parametrize("model", MODELS, ids=lambda model: model.name)
@pytest.mark.parametrize("looseness", [1.0, 0.8])
def test_copies_origins_and_primitive_cells_of_a_lattice_have_one_permeability(kind, model, looseness):
    rng = np.random.default_rng(0)
    primitive = Packing([[0.3, 0.1, 0.7]], [looseness * LATTICES[kind][1]], Cell(LATTICES[kind][2]))
    k = flow_of(primitive, model).permeability
    for copied in ([1, 1, 1], [2, 1, 1], [2, 2, 2], [3, 3, 3]):
        for shift in (np.zeros(3), rng.uniform(-1, 1, 3)):
            flow = flow_of(cubic(kind, copied, looseness, shift), model)
            assert_allclose(flow.permeability, k[0, 0] * np.eye(3), rtol=1e-10, atol=1e-10 * k[0, 0])
            assert flow.permeability_error < 1e-10
            # Every sphere bears its part of -∇p V.
            part = -GRADIENT * np.prod(copied) / len(flow.mesh.packing)
            assert_allclose(flow.forces(GRADIENT).total, np.broadcast_to(part, (len(flow.mesh.packing), 3)), atol=1e-10)


@pytest.mark.parametrize(
    ("kind", "solid", "stokes"),
    [("sc", 0.5236, 42.14), ("sc", 0.216, 7.442), ("bcc", 0.6802, 162.9), ("fcc", 0.7405, 435.0)],
)
def test_lattices_are_within_a_tenth_of_resolved_stokes_flow(kind, solid, stokes):
    # Zick and Homsy (1982): drag over Stokes' for an array; k = 2 a² / (9 c K).
    radius = np.cbrt(solid / len(LATTICES[kind][0]) / (4 / 3 * np.pi))
    flow = flow_of(cubic(kind, [1, 1, 1], min(radius / LATTICES[kind][1], 1.0)))
    assert 1.0 < flow.permeability[0, 0] / (2 * radius**2 / (9 * solid * stokes)) < 1.1


@pytest.mark.parametrize("radius", [1.0, 0.9])
@pytest.mark.parametrize("model", MODELS, ids=lambda model: model.name)
def test_simple_cubic_is_the_box_with_walls_of_symmetry(lattice, radius, model):
    packing = lattice("sc", 2, radius)
    walled = PoreFlow(PoreMesh(packing), Walls.along("y", slip=True), UNIT, model).permeability
    periodic = flow_of(packing.with_box(Cell.of(packing.box)), model).permeability
    assert_allclose(periodic, walled * np.eye(3), rtol=1e-10, atol=1e-10 * walled)


@pytest.mark.parametrize("model", MODELS, ids=lambda model: model.name)
@pytest.mark.parametrize("seed", [0, 1])
def test_a_packing_and_its_mirror_images_have_the_flow_of_the_box_with_walls_of_symmetry(random_packing, model, seed):
    packing = random_packing(12, seed=seed)
    centres, radii = packing.centres, packing.radii
    for axis in range(3):
        image = centres.copy()
        image[:, axis] *= -1.0
        centres, radii = np.concatenate([centres, image]), np.concatenate([radii, radii])
    periodic = flow_of(Packing(centres, radii, Cell([2, 2, 2], [-1, -1, -1])), model).permeability
    for axis, name in enumerate("xyz"):
        walled = PoreFlow(packing, Walls.along(name, slip=True), UNIT, model).permeability
        assert periodic[axis, axis] == pytest.approx(walled, rel=1e-8)
    assert_allclose(periodic, np.diag(np.diag(periodic)), atol=1e-8 * periodic.max())


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
    return packing, rng, draw(st.sampled_from([HydraulicRadius(), SectionFriction()]))


@settings(max_examples=40)
@given(random_packings())
def test_random_cells_conserve_flow_and_force(case):
    packing, rng, model = case
    flow, gradient = flow_of(packing, model), rng.uniform(-1, 1, 3)
    mesh, largest = flow.mesh, np.abs(flow.permeability).max()
    assert flow.permeability_error < 1e-8
    assert flow.principal_permeabilities[2] > -1e-9 * largest
    assert_allclose(
        flow.forces(gradient).total.sum(axis=0), -gradient * packing.box.volume, atol=1e-12 * packing.box.volume
    )
    assert flow.forces(gradient).conservation_residual < 1e-12
    flux, pores = flow.flux(gradient), mesh.pore_owners.rows[mesh.throats.pores]
    net = np.bincount(pores[:, 0], flux, mesh.n_pores) - np.bincount(pores[:, 1], flux, mesh.n_pores)
    assert np.abs(net).sum() <= 1e-9 * np.abs(flux).sum()
    velocities = flow.pore_velocity(gradient) * np.maximum(mesh.pore_volumes, 0.0)[:, None]
    if (mesh.pore_volumes > 0.0).all():
        mean = flow.darcy_velocity(gradient) * packing.box.volume
        assert_allclose(velocities.sum(axis=0), mean, atol=1e-9 * np.abs(flux).sum() * np.cbrt(packing.box.volume))
    # The flux of a throat is that of the pressures of its pores, an image's lower or higher by the mean gradient.
    _, steps = mesh.pore_owners
    pressure = flow.pressure(gradient)[mesh.pore_owners.rows] + steps @ mesh.vectors @ gradient
    i, j = mesh.throats.pores.T
    drops = pressure[i] - pressure[j]
    assert_allclose(flow.conductances * drops, flux, atol=1e-9 * np.abs(flow.conductances * np.abs(pressure[i])).max())


@settings(max_examples=40)
@given(random_packings())
def test_flow_does_not_depend_on_origin_numbering_basis_and_number_of_periods(case):
    packing, rng, model = case
    centres, radii, vectors, n = packing.centres, packing.radii, packing.box.vectors, len(packing)
    flow = flow_of(packing, model)
    k, forces = flow.permeability, flow.forces(GRADIENT).total
    order, (a, b, c), axis = rng.permutation(n), rng.integers(-3, 4, 3), rng.integers(3)
    basis = np.array([[1, 0, 0], [a, 1, 0], [b, c, 1]]) @ vectors
    moved = Packing((centres + rng.uniform(-5, 5, 3))[order], radii[order], Cell(basis))
    double = vectors * np.where(np.arange(3) == axis, 2.0, 1.0)[:, None]
    doubled = Packing(np.concatenate([centres, centres + vectors[axis]]), np.tile(radii, 2), Cell(double))
    for other, expected in ((moved, forces[order]), (doubled, np.tile(forces, (2, 1)))):
        found = flow_of(other, model)
        assert_allclose(found.permeability, k, rtol=0, atol=1e-9 * np.abs(k).max())
        assert_allclose(found.forces(GRADIENT).total, expected, rtol=0, atol=1e-9 * np.abs(expected).max())


def test_a_packing_whose_throats_are_all_closed_lets_nothing_through_and_bears_the_whole_gradient():
    packing = cubic("fcc", [2, 2, 2], 1.17)  # equal spheres three of which touch close at 2 / √3 = 1.155
    flow = flow_of(packing)
    assert flow.mesh.throats.closed.all() and packing.porosity > 0.0
    assert_allclose(flow.permeability, 0.0)
    assert_allclose(flow.forces(GRADIENT).total, np.broadcast_to(-GRADIENT * 8 / 32, (32, 3)), atol=1e-10)


def test_closed_pores_and_pockets_have_pressures_between_those_around_them():
    # Necks of touching spheres close at 2 / √3 = 1.155 of their radius: some do here, and some do not.
    packing = cubic("fcc", [3, 3, 3])
    radii = packing.radii * np.random.default_rng(5).uniform(1.1, 1.2, len(packing))
    flow = flow_of(Packing(packing.centres, radii, packing.box), HydraulicRadius())
    mesh, parts = flow.mesh, flow.solutions.parts
    counts = np.bincount(parts, minlength=mesh.n_pores)
    assert np.count_nonzero(counts == 1) > 20 and np.count_nonzero(counts > 1) > 5 and counts.max() > 20
    assert flow.permeability_error < 1e-8
    own, steps = mesh.pore_owners
    pressure = flow.pressure(GRADIENT)[own] + steps @ mesh.vectors @ GRADIENT
    i, j = mesh.throats.pores.T
    rise = pressure[j] - pressure[i]
    lowest, highest = np.full(mesh.n_pores, np.inf), np.full(mesh.n_pores, -np.inf)
    for pores, rises in ((own[i], rise), (own[j], -rise)):
        np.minimum.at(lowest, pores, rises)
        np.maximum.at(highest, pores, rises)
    alone = counts[parts] == 1
    assert (lowest[alone] <= 1e-12).all() and (highest[alone] >= -1e-12).all()
    double = Packing(
        np.concatenate([packing.centres, packing.centres + np.array([3, 0, 0])]),
        np.tile(radii, 2),
        Cell([6, 3, 3], [0.3, 0, 0]),
    )
    found, expected = flow_of(double, HydraulicRadius()).forces(GRADIENT).total, flow.forces(GRADIENT).total
    assert_allclose(found, np.tile(expected, (2, 1)), rtol=0, atol=1e-9 * np.abs(expected).max())


def test_viscosity_and_lengths_scale_as_they_must():
    rng = np.random.default_rng(0)
    packing = Packing(rng.uniform(0, 1, (20, 3)), np.full(20, 0.15), Cell([1, 1, 1]))
    flow = PeriodicFlow(packing, Fluid(viscosity=1e-3))
    small = PeriodicFlow(packing.scaled(1e-4), Fluid(viscosity=10.0))
    assert_allclose(small.permeability, 1e-8 * flow.permeability, rtol=1e-9)
    assert_allclose(flow.darcy_velocity(GRADIENT), -1e3 * flow.permeability @ GRADIENT)
    assert_allclose(flow.flux(2 * GRADIENT), 2 * flow.flux(GRADIENT), rtol=1e-12)
    k, axes = flow.principal_permeabilities, flow.principal_axes
    assert_allclose(axes.T @ np.diag(k) @ axes, flow.permeability, rtol=0, atol=1e-14 * k[0])
    assert (np.diff(k) <= 0).all()
    still = flow.forces([0, 0, 0])
    assert not still.total.any() and still.conservation_residual == 0.0
    assert repr(flow).startswith("PeriodicFlow(PeriodicMesh(20 spheres, ")


@pytest.mark.parametrize("solver", ["direct", "cg"])
def test_solvers_agree(solver):
    rng = np.random.default_rng(1)
    packing = Packing(rng.uniform(0, 1, (60, 3)), np.full(60, 0.1), Cell([1, 1, 1]))
    k = flow_of(packing).permeability
    found = PeriodicFlow(packing, UNIT, solver=solver)
    assert [report.name for report in found.solver_reports] == [solver] * 3
    assert_allclose(found.permeability, k, rtol=0, atol=1e-9 * k.max())


@pytest.mark.parametrize(
    ("use", "said"),
    [
        (lambda p: PeriodicFlow("p.csv"), "mesh must be a PeriodicMesh or a Packing in a Cell"),
        (lambda p: PeriodicFlow(p, fluid=1.0), "fluid must be a Fluid"),
        (lambda p: PeriodicFlow(p, conductance="hydraulic-radius"), "not a text"),
        (lambda p: PeriodicFlow(p).pressure([1, 0]), "the mean pressure gradient must be three finite numbers in Pa/m"),
        (lambda p: PeriodicFlow(p).forces(1.0), "the mean pressure gradient must be three finite numbers in Pa/m"),
        (lambda p: PeriodicFlow(p, solver="none").permeability, "unknown solver"),
        (lambda p: PeriodicFlow(p, tolerance=2.0).permeability, "tolerance"),
        (lambda p: PeriodicFlow(Packing(p.centres, p.radii, ([0, 0, 0], [1, 1, 1]))), "in no periodic cell"),
    ],
)
def test_wrong_arguments_are_refused_in_words(use, said):
    with pytest.raises(InputError, match=said):
        use(Packing([[0.3, 0.3, 0.3], [0.8, 0.7, 0.6]], [0.2, 0.2], Cell([1, 1, 1])))
