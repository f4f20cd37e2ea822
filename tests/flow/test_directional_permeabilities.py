import numpy as np
import pytest
from numpy.testing import assert_allclose

from porefv.conductance.hydraulic_radius import HydraulicRadius
from porefv.errors import InputError
from porefv.flow.directional_permeabilities import directional_permeabilities, slip_of_impervious_walls
from porefv.flow.fluid import Fluid
from porefv.flow.pore_flow import PoreFlow
from porefv.flow.walls import Wall, Walls
from porefv.mesh.pore_mesh import PoreMesh
from porefv.packing.box import Box
from porefv.packing.packing import Packing


@pytest.mark.parametrize("slip", [False, True])
@pytest.mark.parametrize("model", [None, HydraulicRadius()])
def test_each_permeability_is_that_of_a_run_along_its_axis(random_packing, slip, model):
    mesh = PoreMesh(random_packing(80, seed=6, box=Box([0, 0, 0], [0.3, 0.7, 1.1])))
    fluid = Fluid(viscosity=2e-3)
    found = directional_permeabilities(mesh, fluid, model, slip=slip)
    expected = [PoreFlow(mesh, Walls.along(axis, slip=slip), fluid, model).permeability for axis in "xyz"]
    assert [found.x, found.y, found.z] == expected and found.slip is slip


@pytest.mark.parametrize("slip", [False, True])
def test_those_of_a_simple_cubic_lattice_are_equal(slip):
    centres = (np.stack(np.meshgrid(*[np.arange(3)] * 3), axis=-1).reshape(-1, 3) + 0.5) / 3
    mesh = PoreMesh(Packing(centres, np.full(27, 0.5 / 3), Box([0, 0, 0], [1, 1, 1])))
    found = directional_permeabilities(mesh, slip=slip)
    assert_allclose([found.y, found.z], found.x, rtol=1e-9)


def test_walls_beside_the_flow_must_all_slip_or_all_drag():
    assert not slip_of_impervious_walls(Walls())
    assert slip_of_impervious_walls(Walls.along("y", slip=True))
    with pytest.raises(InputError, match="the same slip on all walls"):
        slip_of_impervious_walls(Walls(x_min=Wall(slip=True)))
