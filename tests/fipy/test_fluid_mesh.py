"""The fluid as a FiPy mesh: its geometry, FiPy's terms against matrices assembled by hand, fields and files."""

import pickle

import numpy as np
import pytest
import scipy.sparse as sp
from numpy.testing import assert_allclose, assert_array_equal

from porefv.conductance.prism_sections import diffusive_conductances
from porefv.errors import InputError
from porefv.mesh.pore_mesh import PoreMesh
from porefv.packing.box import WALLS, Box
from porefv.packing.packing import Packing

fipy = pytest.importorskip("fipy")

WITHOUT = [(), ("y_min", "y_max")]
IN_ORDER = ("facesLeft", "facesRight", "facesBottom", "facesTop", "facesFront", "facesBack")


@pytest.fixture(params=WITHOUT, ids=["all pores", "without two walls"])
def fluid(request, mesh_of):
    return mesh_of("n25_s1").to_fipy(request.param)


@pytest.fixture
def ends(fluid):
    """Cells (k, 2) of the faces between cells, and the mask of those faces."""
    inside = fluid.interiorFaces.value
    return np.asarray(fluid.faceCellIDs)[:, inside].T, inside


def network_matrix(ends, forward, backward, n_cells):
    """Σ over faces of what leaves: forward x_i - backward x_j for the first cell, the opposite for the second."""
    i, j = ends.T
    rows, columns = np.concatenate([i, i, j, j]), np.concatenate([i, j, j, i])
    values = np.concatenate([forward, -backward, backward, -forward])
    return sp.coo_array((values, (rows, columns)), shape=(n_cells, n_cells)).tocsr()


def assert_same(found, expected, part=1e-13):
    scale = np.abs(expected.toarray()).max() if sp.issparse(expected) else np.abs(expected).max()
    difference = np.abs(found.toarray() - expected.toarray() if sp.issparse(expected) else found - expected).max()
    assert difference <= part * scale


# ---- geometry ---------------------------------------------------------------------------------------------------


def test_cells_are_the_voids_of_the_pores(mesh_of):
    mesh = mesh_of("n54_s1")
    fluid = mesh.to_fipy()
    assert_array_equal(fluid.pores, np.arange(mesh.n_pores))
    assert_array_equal(fluid.cellVolumes, mesh.pore_volumes)
    assert_array_equal(np.asarray(fluid.cellCenters).T, mesh.pore_centres)
    assert fluid.pores_without_void == fluid.closed_throats == 0


def test_a_face_is_a_throat_with_the_area_of_its_diffusive_section(mesh_of):
    mesh = mesh_of("n54_s1")
    fluid = mesh.to_fipy()
    throats = fluid.throats >= 0
    assert_array_equal(np.sort(fluid.throats[throats]), np.arange(len(mesh.throats)))
    through = diffusive_conductances(mesh.throats)[fluid.throats[throats]]
    conductances = fipy.FaceVariable(mesh=fluid, value=fluid.scaledFaceAreas / fluid.scaledCellDistances)
    assert_allclose(conductances.value[throats], through, rtol=1e-14)


def test_faces_on_walls_have_the_area_of_the_walls(mesh_of):
    mesh = mesh_of("n54_s1")
    fluid = mesh.to_fipy()
    normals = np.asarray(fluid.faceNormals)
    for wall, (name, of_fipy) in enumerate(zip(WALLS, IN_ORDER, strict=True)):
        mask = fluid.on_wall(name)
        assert_array_equal(getattr(fluid, of_fipy).value, mask.value)
        assert_allclose(fluid.scaledFaceAreas[mask.value].sum(), mesh.box.section(wall // 2), rtol=1e-12)
        assert_allclose(np.asarray(fluid.faceCenters)[wall // 2, mask.value], mesh.box.wall_places[wall], atol=1e-14)
        outwards = np.zeros(3)
        outwards[wall // 2] = 1.0 if wall % 2 else -1.0
        assert_array_equal(normals[:, mask.value], np.repeat(outwards[:, None], mask.value.sum(), axis=1))
        assert fluid.through(fipy.FaceVariable(mesh=fluid, rank=1, value=normals), mask) == pytest.approx(
            mesh.box.section(wall // 2), rel=1e-12
        )
    assert_array_equal(fluid.on_wall("x_min", "z_max").value, (fluid.facesLeft | fluid.facesBack).value)


def test_without_leaves_out_the_pores_of_walls(mesh_of):
    mesh = mesh_of("n54_s1")
    fluid = mesh.to_fipy(without=("y_min",))
    on_wall = (mesh.pore_walls >> 2 & 1).astype(bool)
    assert_array_equal(fluid.pores, np.flatnonzero(~on_wall))
    towards = fluid.on_wall("y_min").value
    pairs = mesh.throats.pores[fluid.throats[towards]]
    assert (on_wall[pairs].sum(axis=1) == 1).all()
    assert towards.sum() == (on_wall[mesh.throats.pores].sum(axis=1) == 1).sum()
    assert_allclose(fluid.scaledCellDistances[towards], mesh.throats.lengths[fluid.throats[towards]], rtol=1e-12)
    inside, outside = (on_wall[pairs] == kept for kept in (False, True))
    way = mesh.pore_centres[pairs[outside]] - mesh.pore_centres[pairs[inside]]
    assert (np.einsum("ij,ji->i", way, np.asarray(fluid.faceNormals)[:, towards]) > 0.0).all()


def test_what_cannot_be_made_is_refused(mesh_of):
    mesh = mesh_of("n25_s1")
    with pytest.raises(InputError, match="unknown wall 'top'; the walls are x_min"):
        mesh.to_fipy(without=("top",))
    with pytest.raises(InputError, match="every pore is on a wall left out"):
        PoreMesh(Packing([[0.5, 0.5, 0.5]], [0.5], Box([0, 0, 0], [1, 1, 1]))).to_fipy(without=WALLS)
    fluid = mesh.to_fipy()
    way = np.array([[1.0], [0.0], [0.0]])
    for attempt in (
        lambda: fluid + way, lambda: way + fluid, lambda: fluid + fluid, lambda: fluid * 2.0, lambda: 2.0 * fluid,
        lambda: fluid / 2.0, lambda: fluid - way,
    ):  # fmt: skip
        with pytest.raises(TypeError, match="cannot be moved, scaled or joined"):
            attempt()
    with pytest.raises(InputError, match="flux needs a vector for each face"):
        fluid.flux(fipy.FaceVariable(mesh=fluid))
    with pytest.raises(InputError, match="unknown wall"):
        fluid.on_wall("top")


# ---- terms against matrices assembled by hand ---------------------------------------------------------------------


def test_diffusion_is_that_of_the_network(fluid, ends, assembled):
    pairs, inside = ends
    rng = np.random.default_rng(1)
    diffusivity = fipy.FaceVariable(mesh=fluid, value=rng.uniform(1.0, 2.0, fluid.numberOfFaces))
    c = fipy.CellVariable(mesh=fluid, value=rng.uniform(size=fluid.numberOfCells))
    matrix, right = assembled(fipy.DiffusionTerm(coeff=diffusivity), c)
    g = diffusivity.value * fluid.scaledFaceAreas / fluid.scaledCellDistances
    assert_same(matrix, -network_matrix(pairs, g[inside], g[inside], fluid.numberOfCells))
    assert_array_equal(right, 0.0)


def test_a_value_given_on_a_wall_acts_through_its_faces(fluid, ends, assembled):
    pairs, inside = ends
    c = fipy.CellVariable(mesh=fluid)
    c.constrain(3.0, where=fluid.facesBottom)
    matrix, right = assembled(fipy.DiffusionTerm(coeff=2.0), c)
    g = 2.0 * fluid.scaledFaceAreas / fluid.scaledCellDistances
    faces = fluid.facesBottom.value
    leaks = np.bincount(np.asarray(fluid.faceCellIDs[0])[faces], g[faces], fluid.numberOfCells)
    expected = network_matrix(pairs, g[inside], g[inside], fluid.numberOfCells) + sp.diags_array(leaks)
    assert_same(matrix, -expected)
    assert_same(right, -3.0 * leaks)


def test_transients_and_sources_act_on_the_void(fluid, assembled):
    c = fipy.CellVariable(mesh=fluid, value=1.0, hasOld=True)
    rate = fipy.CellVariable(mesh=fluid, value=np.linspace(1.0, 2.0, fluid.numberOfCells))
    equation = fipy.TransientTerm(coeff=4.0) == fipy.ImplicitSourceTerm(coeff=-rate) + 5.0 * rate
    matrix, right = assembled(equation, c, dt=0.5)
    volumes = fluid.cellVolumes
    assert_same(matrix, sp.diags_array(8.0 * volumes + rate.value * volumes))
    assert_same(right, 8.0 * volumes + 5.0 * rate.value * volumes)


def power_law(peclet):
    """Patankar (1980): part of the first cell's value in that of the face."""
    size = np.abs(peclet)
    decay = np.maximum(1.0 - 0.1 * size, 0.0) ** 5
    return np.where(peclet > 0.0, 1.0 - (1.0 - decay) / size, (1.0 - decay) / size)


FACE_PARTS = {
    "Upwind": lambda peclet: np.where(peclet > 0.0, 1.0, 0.0),
    "CentralDifference": lambda peclet: np.full_like(peclet, 0.5),
    "PowerLaw": power_law,
    "Exponential": lambda peclet: -1.0 / np.expm1(-peclet) - 1.0 / peclet,
}


def any_velocity(fluid):
    """A velocity of random fluxes, of both senses and not nearly zero: FiPy takes a Péclet number of 1e-3 for zero."""
    rng = np.random.default_rng(2)
    flux = rng.choice([-1.0, 1.0], fluid.numberOfFaces) * rng.uniform(0.1, 1.0, fluid.numberOfFaces)
    flux[-1] = 0.0
    return fipy.FaceVariable(mesh=fluid, rank=1, value=flux / fluid.scaledFaceAreas * fluid.faceNormals), flux


@pytest.mark.filterwarnings("ignore:the variable has no condition:porefv.errors.TransportWarning")
@pytest.mark.parametrize("scheme", FACE_PARTS)
def test_convection_carries_the_flux(scheme, fluid, ends, assembled):
    pairs, inside = ends
    velocity, flux = any_velocity(fluid)
    assert_allclose(fluid.flux(velocity)[inside], flux[inside], rtol=1e-13)
    c = fipy.CellVariable(mesh=fluid)
    convection = getattr(fipy, f"{scheme}ConvectionTerm")(coeff=velocity)
    matrix, right = assembled(convection == fipy.DiffusionTerm(coeff=0.3), c)
    q, g = flux[inside], (0.3 * fluid.scaledFaceAreas / fluid.scaledCellDistances)[inside]
    part = FACE_PARTS[scheme](q / g)
    expected = network_matrix(pairs, g + q * part, g - q * (1.0 - part), fluid.numberOfCells)
    # The formula of the exponential scheme loses digits at small Péclet numbers, in FiPy as here.
    assert_same(matrix, expected, 1e-7 if scheme == "Exponential" else 1e-13)
    assert_array_equal(right, 0.0)


@pytest.mark.filterwarnings("ignore:the variable has no condition:porefv.errors.TransportWarning")
def test_explicit_upwind_convection_takes_the_old_values(fluid, ends, assembled):
    pairs, inside = ends
    velocity, flux = any_velocity(fluid)
    old = np.random.default_rng(3).uniform(size=fluid.numberOfCells)
    c = fipy.CellVariable(mesh=fluid, value=old, hasOld=True)
    _, right = assembled(fipy.TransientTerm() == -fipy.ExplicitUpwindConvectionTerm(coeff=velocity), c, dt=1.0)
    q = flux[inside]
    leaving = network_matrix(pairs, np.maximum(q, 0.0), np.maximum(-q, 0.0), fluid.numberOfCells) @ old
    assert_same(right, fluid.cellVolumes * old - leaving)


def test_the_divergence_of_a_flux_is_what_leaves_the_pore_for_its_void(fluid, ends):
    pairs, inside = ends
    velocity, flux = any_velocity(fluid)
    leaving = np.bincount(np.asarray(fluid.faceCellIDs[0])[:-1], flux[:-1], fluid.numberOfCells)
    leaving -= np.bincount(pairs[:, 1], flux[inside], fluid.numberOfCells)
    assert_same(velocity.divergence.value * fluid.cellVolumes, leaving)


def test_a_vector_of_unknowns_has_the_same_terms(fluid, ends, assembled):
    pairs, inside = ends
    v = fipy.CellVariable(mesh=fluid, elementshape=(2,))
    matrix, _ = assembled(fipy.DiffusionTerm(coeff=[[[1.0, 0.0], [0.0, 2.0]]]), v)
    g = (fluid.scaledFaceAreas / fluid.scaledCellDistances)[inside]
    n = fluid.numberOfCells
    expected = network_matrix(pairs, g, g, n)
    assert_same(matrix, -sp.block_diag([expected, 2.0 * expected]).tocsr())


# ---- fields -------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("without", WITHOUT, ids=["all pores", "without two walls"])
@pytest.mark.parametrize("name", ["n25_s1", "n200_s1"])
def test_gradients_of_linear_fields_are_exact(name, without, mesh_of):
    fluid = mesh_of(name).to_fipy(without)
    slope = np.array([1.0, -2.0, 3.0])
    centres = np.asarray(fluid.cellCenters)
    linear = fipy.CellVariable(mesh=fluid, value=slope @ centres)
    # Beside a pore left out, the value that is given in its place counts.
    left_out = fipy.FaceVariable(mesh=fluid, value=(fluid.throats >= 0) & fluid.exteriorFaces.value)
    linear.constrain(fipy.FaceVariable(mesh=fluid, value=slope @ np.asarray(fluid.faceCenters)), where=left_out)
    assert np.median(np.abs(linear.grad.value - slope[:, None])) < 1e-12
    assert_allclose(linear.grad.value, np.repeat(slope[:, None], fluid.numberOfCells, axis=1), atol=1e-7)
    if without:
        return
    assert np.median(np.abs(linear.leastSquaresGrad.value - slope[:, None])) < 1e-12
    assert_allclose((2.0 * linear).grad.value, 2.0 * linear.grad.value, atol=1e-12)
    of_vector = fipy.CellVariable(mesh=fluid, rank=1, value=centres).grad.value
    assert_allclose(of_vector, np.repeat(np.eye(3)[:, :, None], fluid.numberOfCells, axis=2), atol=1e-7)


def test_fipys_own_meshes_keep_their_gradient(mesh_of):
    mesh_of("n25_s1").to_fipy()
    grid = fipy.Grid2D(nx=3, ny=3)
    assert_array_equal(fipy.CellVariable(mesh=grid, value=grid.x).grad.value[0], [0.5, 1.0, 0.5] * 3)


def test_values_on_faces_are_linear_between_the_centres(fluid):
    slope = np.array([1.0, -2.0, 3.0])
    inside = fluid.interiorFaces.value
    single = inside & (fluid.throats >= 0)
    linear = fipy.CellVariable(mesh=fluid, value=slope @ np.asarray(fluid.cellCenters))
    found = linear.faceValue.value[single]
    # Centres of united pores are means of Laguerre vertices: off the line by some of the united pores' size.
    assert np.median(np.abs(found - slope @ np.asarray(fluid.faceCenters)[:, single])) < 1e-14
    normal = np.einsum("ij,ij->j", np.asarray(linear.faceGrad), np.asarray(fluid.faceNormals))[single]
    first, second = np.asarray(fluid.faceCellIDs)[:, single]
    assert_allclose(
        normal, (linear.value[second] - linear.value[first]) / fluid.scaledCellDistances[single], rtol=1e-9, atol=1e-9
    )


def test_a_mesh_and_its_variables_can_be_pickled_and_dumped(fluid, tmp_path):
    c = fipy.CellVariable(mesh=fluid, name="c", value=fluid.x, hasOld=True)
    again = pickle.loads(pickle.dumps(c))
    assert_array_equal(again.value, c.value)
    assert_array_equal(again.mesh.scaledFaceAreas, fluid.scaledFaceAreas)
    assert again.mesh.without == fluid.without
    fipy.dump.write(c, str(tmp_path / "c.gz"))
    assert_array_equal(fipy.dump.read(str(tmp_path / "c.gz")).value, c.value)


def test_averages_are_over_the_void(fluid):
    height = fipy.CellVariable(mesh=fluid, value=fluid.z)
    volumes = fluid.cellVolumes
    assert float(height.cellVolumeAverage.value) == pytest.approx((volumes * height.value).sum() / volumes.sum())


def test_the_extents_are_those_of_the_box(mesh_of):
    mesh = mesh_of("n25_s1")
    assert_allclose(mesh.to_fipy().extents["min"], mesh.box.lower, atol=1e-14)
    assert_allclose(mesh.to_fipy().extents["max"], mesh.box.upper, atol=1e-14)


def test_only_exterior_faces_count_for_what_is_carried_out(mesh_of):
    fluid = mesh_of("n54_s1").to_fipy()
    vector = fipy.FaceVariable(mesh=fluid, rank=1, value=fluid.faceNormals)
    everywhere = fipy.FaceVariable(mesh=fluid, value=True)
    assert fluid.through(vector, everywhere) == pytest.approx(6.0)
