"""Pores and throats in the names of OpenPNM: an array each, and the same permeability."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_allclose, assert_array_equal
from scipy.sparse import coo_array
from scipy.sparse.linalg import spsolve

from porefv.flow.walls import Wall, Walls
from porefv.mesh.pore_mesh import PoreMesh
from porefv.packing.box import WALLS

NAMES = ["n25_s1", "n54_s1", "n200_s1", "nine_0.72", "sc8"]


def laplacian(network):
    i, j = network["throat.conns"].T
    g, n = network["throat.hydraulic_conductance"], len(network["pore.all"])
    return coo_array((np.r_[g, g, -g, -g], (np.r_[i, j, i, j], np.r_[i, j, j, i])), (n, n)).tocsr()


def solved(network):
    """Pressure of each pore, and the flux into the network by each, from the dictionary alone."""
    matrix, pressure = laplacian(network), network["pore.imposed_pressure"].copy()
    held = ~np.isnan(pressure)
    free = ~held & ~network["pore.isolated"]
    pressure[network["pore.isolated"]] = 0.0
    pressure[free] = spsolve(matrix[free][:, free].tocsc(), -matrix[free][:, held] @ pressure[held])
    return pressure, matrix @ pressure


def permeability(flux, flow):
    axis, box = flow.walls.axis, flow.mesh.box
    pressures = flow.walls.pressures[2 * axis : 2 * axis + 2]
    return flow.fluid.viscosity * flux * box.size[axis] / ((pressures[0] - pressures[1]) * box.section(axis))


@pytest.mark.parametrize("axis", ["x", "y", "z"])
@pytest.mark.parametrize("name", NAMES)
def test_the_laplace_problem_on_the_network_has_the_permeability_of_the_flow(mesh_of, unit_flow, name, axis):
    flow = unit_flow(mesh_of(name), Walls.along(axis, drop=3.0))
    network = flow.to_openpnm()
    pressure, into = solved(network)
    assert_allclose(permeability(into[network[f"pore.{axis}_min"]].sum(), flow), flow.permeability, rtol=1e-8)
    reached = ~network["pore.isolated"]
    assert_allclose(pressure[reached], flow.pressure[reached], rtol=0, atol=1e-8)


@given(st.integers(0, 10_000), st.booleans())
def test_so_it_has_for_any_packing(random_packing, unit_flow, seed, slip):
    flow = unit_flow(random_packing(15, ratio=0.3, seed=seed), Walls.along("y", slip=slip))
    network = flow.to_openpnm()
    _, into = solved(network)
    assert_allclose(permeability(into[network["pore.y_min"]].sum(), flow), flow.permeability, rtol=1e-8)


def test_openpnm_finds_the_same_permeability(mesh_of, unit_flow):
    openpnm = pytest.importorskip("openpnm")
    flow = unit_flow(mesh_of("n200_s1"), Walls.along("y"))
    dictionary = flow.to_openpnm()
    assert not dictionary["pore.isolated"].any()
    network = openpnm.network.Network()
    network.update(dictionary)
    fluid = openpnm.phase.Phase(network=network)
    fluid["throat.hydraulic_conductance"] = dictionary["throat.hydraulic_conductance"]
    stokes = openpnm.algorithms.StokesFlow(network=network, phase=fluid)
    stokes.set_value_BC(pores=network.pores("y_min"), values=1.0)
    stokes.set_value_BC(pores=network.pores("y_max"), values=0.0)
    stokes.run()
    flux = np.abs(stokes.rate(pores=network.pores("y_min"))).sum()
    assert_allclose(permeability(flux, flow), flow.permeability, rtol=1e-8)


@pytest.mark.parametrize("name", NAMES)
def test_throats_are_named_once_the_smaller_pore_first(mesh_of, unit_flow, name):
    flow = unit_flow(mesh_of(name), Walls.along("y"))
    network = flow.to_openpnm()
    conns = network["throat.conns"]
    assert (conns[:, 0] < conns[:, 1]).all()
    assert_array_equal(conns, np.unique(conns, axis=0))  # in order, none twice
    pairs = {tuple(pair) for pair in np.sort(flow.mesh.throats.pores, axis=1).tolist()}
    assert {tuple(pair) for pair in conns.tolist()} == pairs
    lengths = {len(values) for key, values in network.items() if key.startswith("throat.")}
    assert lengths == {len(conns)}
    assert {len(values) for key, values in network.items() if key.startswith("pore.")} == {flow.mesh.n_pores}


def test_parallel_throats_become_one_with_the_sum_of_their_conductances(mesh_of, unit_flow):
    flow = unit_flow(mesh_of("n200_s1"), Walls.along("y"))
    throats, network = flow.mesh.throats, flow.to_openpnm()
    _, first, count = np.unique(np.sort(throats.pores, axis=1), axis=0, return_inverse=True, return_counts=True)
    assert count.max() > 1  # the packing has some
    for k in np.flatnonzero(count > 1):
        parallel = first == k
        assert_allclose(network["throat.hydraulic_conductance"][k], flow.conductances[parallel].sum(), rtol=1e-14)
        lengths = throats.lengths[parallel]
        assert lengths.min() <= network["throat.length"][k] <= lengths.max()
    assert_allclose(network["throat.hydraulic_conductance"].sum(), flow.conductances.sum(), rtol=1e-13)
    once = count == 1
    assert_allclose(network["throat.length"][once], throats.lengths[np.unique(first, return_index=True)[1]][once])


def test_fluxes_lead_from_the_smaller_pore_to_the_other(mesh_of, unit_flow):
    flow = unit_flow(mesh_of("n200_s1"), Walls.along("y"))
    network = flow.to_openpnm()
    i, j = network["throat.conns"].T
    fluxes = network["throat.hydraulic_conductance"] * (network["pore.pressure"][i] - network["pore.pressure"][j])
    assert_allclose(network["throat.flux"], fluxes, rtol=0, atol=1e-10 * flow.inflow)


def test_labels_and_imposed_pressures_are_those_of_the_walls(mesh_of, unit_flow):
    mesh = mesh_of("n54_s1")
    flow = unit_flow(mesh, Walls(x_min=Wall(5.0), y_max=Wall(1.0)))
    network = flow.to_openpnm()
    for w, wall in enumerate(WALLS):
        pores = np.unique(mesh.cell_pore[mesh.wall_faces.cells[mesh.wall_faces.walls == w]])
        assert_array_equal(np.flatnonzero(network[f"pore.{wall}"]), pores)
    assert_array_equal(network["pore.imposed_pressure"], flow.imposed_pressures)  # the mean of 5 and 1 on the edge


def test_volumes_and_places_are_those_of_the_pores(mesh_of):
    mesh = mesh_of("n200_s1")
    network = mesh.to_openpnm()
    assert_array_equal(network["pore.volume"], mesh.pore_volumes)
    assert_array_equal(network["pore.coords"], mesh.pore_centres)
    assert network["pore.all"].all() and network["throat.all"].all()
    assert not any("conductance" in key or "pressure" in key for key in network)


def test_pores_that_no_flow_reaches_are_isolated(lattice, unit_flow):
    # Spheres so large that their throats are closed.
    flow = unit_flow(PoreMesh(lattice("fcc", 2, radius=1.16 * np.sqrt(2) / 4), wall_tolerance=0.9), Walls.along("y"))
    network = flow.to_openpnm()
    assert_array_equal(network["pore.isolated"], flow.solution.isolated)
