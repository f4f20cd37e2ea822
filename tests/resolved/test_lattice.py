"""The resolved flow on a lattice: its links, what it conserves, and flows that are known."""

import json

import numpy as np
import pytest
from numpy.testing import assert_allclose

from porefv import cli
from porefv.errors import InputError
from porefv.flow.walls import Wall, Walls
from porefv.mesh.pore_mesh import PoreMesh
from porefv.packing.box import Box
from porefv.packing.packing import Packing
from porefv.resolved import lattice_reference as module
from porefv.resolved.facet_quadrature import cells_of
from porefv.resolved.lattice import lattice_of
from porefv.resolved.lattice_boltzmann import StokesLattice
from porefv.resolved.lattice_links import DIRECTIONS, NO_SLIP, OPEN, OPPOSITE, SYMMETRY, WEIGHTS
from porefv.resolved.lattice_reference import LatticeOptions, cost, lattice_reference
from porefv.resolved.lattice_values import LatticeOnMesh
from porefv.resolved.reference import StokesReference

NO_SPHERES = np.empty((0, 3)), np.empty(0)
ALONG_Y = np.array([0.0, 0.0, 1.0, 0.0, 0.0, 0.0])


def at_rest(lattice, pressures=ALONG_Y, steps=3000):
    flow = StokesLattice(lattice, pressures)
    flow.start_from(np.full(len(lattice), 0.5))
    for _ in range(steps):
        flow.step()
    flow.send_back()
    return flow


def test_directions_are_isotropic_and_opposites_are_neighbours():
    assert_allclose(WEIGHTS.sum(), 1.0)
    assert_allclose(np.einsum("q,qa,qb->ab", WEIGHTS, DIRECTIONS, DIRECTIONS), np.eye(3) / 3.0, atol=1e-15)
    assert np.array_equal(DIRECTIONS[OPPOSITE], -DIRECTIONS)


@pytest.mark.parametrize("gap", [7.0, 7.3, 7.5, 7.8])
def test_the_flow_between_plates_is_poiseuilles_wherever_they_lie_between_nodes(gap):
    """u = x (h - x) / 2 at the nodes, of a pressure gradient and a viscosity of 1; exact for plates halfway between.

    Elsewhere 7 nodes are right to 3 %.
    """
    kinds = [NO_SLIP, NO_SLIP, OPEN, OPEN, SYMMETRY, SYMMETRY]
    length, width = 4.0, 2.0
    flow = at_rest(lattice_of(*NO_SPHERES, [gap, length, width], kinds, 1.0))
    flux = flow.wall_flux()
    assert flux[2] == pytest.approx(-flux[3], rel=1e-9)
    x = np.arange(round(gap)) + 0.5
    exact = (0.5 * x * (gap - x)).sum()
    assert flow.velocity_scale * flux[2] / width * length == pytest.approx(exact, rel=1e-9 if gap == 7.0 else 0.03)


@pytest.mark.parametrize("place", [3.0, 3.25, 3.5, 3.75])
def test_planes_of_symmetry_and_open_walls_leave_a_plug_flow_alone_wherever_they_lie(place):
    """Between planes of symmetry and without a solid nothing resists: pressure and speed have no steady state, but a
    flow that starts as one stays one."""
    kinds = [SYMMETRY, SYMMETRY, OPEN, OPEN, SYMMETRY, SYMMETRY]
    lattice = lattice_of(*NO_SPHERES, [place, place, place], kinds, 1.0)
    flow = StokesLattice(lattice, np.zeros(6))
    flow.start_from(np.zeros(len(lattice)), np.tile([0.0, 1.0, 0.0], (len(lattice), 1)))
    for _ in range(200):
        flow.step()
    flow.send_back()
    pressure, momentum = flow.moments()
    assert_allclose(pressure, 0.0, atol=1e-12)
    assert_allclose(momentum, np.tile([0.0, 1.0, 0.0], (len(lattice), 1)), atol=1e-12)


def test_every_node_is_in_the_cell_that_a_search_through_all_cells_finds(mesh_of):
    mesh = mesh_of("n25_s1")
    lattice = lattice_of(mesh.packing.centres, mesh.packing.radii, mesh.box.size, [1, 1, 2, 2, 1, 1], 1 / 20)
    found = LatticeOnMesh(mesh, lattice.places, 1 / 20)
    shift = mesh.triangulation.origin - mesh.box.lower
    assert np.array_equal(found.cells, cells_of(mesh, (lattice.places + 0.5) / 20 - shift))


@pytest.fixture(scope="module", params=[True, False], ids=["symmetry", "no-slip"])
def small(request):
    """One touching sphere in its cubic cell, or between no-slip walls."""
    mesh = PoreMesh(Packing([[0.5, 0.5, 0.5]], [0.5], Box([0, 0, 0], [1, 1, 1])))
    walls = Walls.along("y", drop=2.0, slip=request.param)
    return mesh, walls, lattice_reference(mesh, walls, 0.5, LatticeOptions(nodes=10.0), name="small")


def test_forces_add_up_to_the_thrust_and_flux_is_conserved(small):
    _, _, reference = small
    values = reference.values
    total = values.sphere_total.sum(axis=0) + (values.wall_pressure + values.wall_viscous).sum(axis=0)
    assert_allclose(total, [0.0, 2.0, 0.0], atol=1e-3)
    assert values.wall_flux[2] == pytest.approx(-values.wall_flux[3], rel=2e-3)
    assert values.face_flux.sum() == pytest.approx(0.0, abs=2e-3 * values.wall_flux[2])
    # By symmetry.
    assert_allclose(values.sphere_total[0, [0, 2]], 0.0, atol=1e-3)
    assert max(run.thrust_residual for run in reference.runs) < 1e-3


def test_the_drag_is_that_of_zick_and_homsy(small):
    """42.1 times 6 π μ a U for touching spheres of a simple cubic lattice, by less than 1 %."""
    _, walls, reference = small
    if not walls.slip[0]:
        pytest.skip("the lattice is between planes of symmetry")
    velocity = reference.values.wall_flux[2]
    assert 2.0 / (6.0 * np.pi * 0.5 * 0.5 * velocity) == pytest.approx(42.1, rel=0.01)


def test_what_is_written_is_read_back(small, tmp_path):
    _, _, reference = small
    reference.write(tmp_path / "flow.json")
    back = StokesReference.read(tmp_path / "flow.json")
    assert back.method == "lattice-boltzmann"
    assert [tuple(run.shape) for run in back.runs] == [run.shape for run in reference.runs]
    assert back.permeability == pytest.approx(reference.permeability)


def test_an_interrupted_computation_goes_on_and_finds_the_same(tmp_path, monkeypatch):
    mesh = PoreMesh(Packing([[0.5, 0.5, 0.5]], [0.5], Box([0, 0, 0], [1, 1, 1])))
    walls, options, state = Walls.along("y", slip=True), LatticeOptions(nodes=4.0), tmp_path / "state.npz"
    whole = lattice_reference(mesh, walls, 1.0, options)
    monkeypatch.setattr(module, "_SAVE", 0.0)
    step, count = StokesLattice.step, 0

    def interrupted(flow):
        nonlocal count
        count += 1
        if count == sum(run.steps for run in whole.runs) - 20:
            raise KeyboardInterrupt
        step(flow)

    monkeypatch.setattr(StokesLattice, "step", interrupted)
    with pytest.raises(KeyboardInterrupt):
        lattice_reference(mesh, walls, 1.0, options, state=state)
    monkeypatch.setattr(StokesLattice, "step", step)
    with pytest.raises(InputError, match="state of another computation"):
        lattice_reference(mesh, walls, 2.0, options, state=state)
    again = lattice_reference(mesh, walls, 1.0, options, state=state)
    assert again.permeability == pytest.approx(whole.permeability, rel=1e-12)
    assert not state.exists()


def test_the_cost_is_that_of_the_finest_lattice(small):
    mesh, _, reference = small
    expected = cost(mesh, LatticeOptions(nodes=10.0))
    assert expected.nodes == pytest.approx(reference.runs[-1].fluid_nodes, rel=0.05)
    assert "GiB of memory" in str(expected)


@pytest.mark.parametrize("nodes", [1.0, float("nan"), 1e6])
def test_impossible_options_are_refused(nodes):
    with pytest.raises(InputError, match="nodes must lie between"):
        LatticeOptions(nodes=nodes)


def test_walls_without_pressure_are_refused():
    mesh = PoreMesh(Packing([[0.5, 0.5, 0.5]], [0.4], Box([0, 0, 0], [1, 1, 1])))
    with pytest.raises(InputError, match="no wall has a pressure"):
        lattice_reference(mesh, Walls(x_min=Wall(slip=True)))


def test_the_command_compares_the_scene_with_the_lattice(tmp_path, capsys):
    (tmp_path / "packing.csv").write_text(
        "# box_lower = 0 0 0\n# box_upper = 1 1 1\nx,y,z,radius\n0.5,0.5,0.5,0.4\n", encoding="utf-8"
    )
    (tmp_path / "scene.toml").write_text(
        'packing = "packing.csv"\n[walls]\ny_min = { pressure = 1.0 }\ny_max = { pressure = 0.0 }\n'
        '[output]\ndirectory = "results"\n',
        encoding="utf-8",
    )
    arguments = ["reference", str(tmp_path / "scene.toml"), "--method", "lattice-boltzmann", "--nodes", "4", "--single"]
    assert cli.main(arguments) == 0
    printed = capsys.readouterr().out
    assert printed.startswith("lattice: ")
    assert "4 nodes in a radius" in printed
    assert json.loads((tmp_path / "results_stokes.json").read_text())["method"] == "lattice-boltzmann"
    assert [path.name for path in tmp_path.iterdir() if "state" in path.name] == []
