"""Terms and conditions that are not right on the fluid in pores are refused or warned about by name."""

import warnings

import numpy as np
import pytest

from porefv.errors import InputError, TransportWarning
from porefv.flow.pore_flow import PoreFlow
from porefv.flow.walls import Walls

fipy = pytest.importorskip("fipy")


@pytest.fixture
def fluid(mesh_of):
    return PoreFlow(mesh_of("n25_s1"), Walls.along("y")).to_fipy()


@pytest.fixture
def solute(fluid):
    c = fipy.CellVariable(mesh=fluid.mesh, name="c", value=0.0, hasOld=True)
    c.constrain(1.0, where=fluid.inlet)
    c.faceGrad.constrain(np.zeros((3, 1)), where=fluid.outlet)
    return c


def test_van_leers_scheme_is_refused(fluid, solute):
    equation = fipy.TransientTerm() == -fipy.VanLeerConvectionTerm(coeff=fluid.velocity)
    with pytest.raises(InputError, match="VanLeerConvectionTerm takes volume over area"):
        equation.solve(var=solute, dt=1.0)
    assert (solute.value == 0.0).all()


def test_a_velocity_from_cells_or_uniform_is_warned_of(fluid, solute):
    in_cells = fipy.CellVariable(mesh=fluid.mesh, rank=1, value=1e-9)
    for velocity in (in_cells, (0.0, 1e-9, 0.0)):
        equation = fipy.TransientTerm() + fipy.UpwindConvectionTerm(coeff=velocity) == 0.0
        with pytest.warns(TransportWarning, match="the velocity of a UpwindConvectionTerm is not given on faces"):
            equation.solve(var=solute, dt=1.0)


def test_faces_that_fluid_passes_without_a_condition_are_warned_of(fluid):
    c = fipy.CellVariable(mesh=fluid.mesh, name="c")
    c.constrain(1.0, where=fluid.inlet)
    outlet = int(fluid.outlet.value.sum())
    equation = fipy.TransientTerm() + fipy.UpwindConvectionTerm(coeff=fluid.velocity) == 0.0
    with pytest.warns(TransportWarning, match=f"c has no condition on {outlet} faces that fluid passes") as found:
        equation.solve(var=c, dt=1e-3)
    assert found[0].filename == __file__
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        equation.solve(var=c, dt=1e-3)  # told once


def test_central_differences_at_an_inlet_are_warned_of(fluid, solute):
    equation = fipy.CentralDifferenceConvectionTerm(coeff=fluid.velocity) == fipy.DiffusionTerm(coeff=1.0)
    with pytest.warns(TransportWarning, match="central differences at an inlet"):
        equation.solve(var=solute)


def test_a_tensor_is_warned_of(fluid, solute):
    tensor = fipy.FaceVariable(mesh=fluid.mesh, rank=2, value=np.eye(3)[:, :, None])
    with pytest.warns(TransportWarning, match="is a vector or a tensor"):
        (fipy.TransientTerm() == fipy.DiffusionTerm(coeff=[tensor])).solve(var=solute, dt=1.0)


def test_a_sound_equation_is_solved_without_a_word(fluid, solute):
    equation = fipy.TransientTerm() + fipy.PowerLawConvectionTerm(coeff=fluid.velocity) == fipy.DiffusionTerm(
        coeff=1e-3
    )
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        equation.solve(var=solute, dt=0.1)
    assert solute.value.min() >= -1e-12
    assert solute.value.max() <= 1.0 + 1e-12


def test_a_uniform_velocity_on_faces_is_warned_of(fluid, solute):
    velocity = fipy.FaceVariable(mesh=fluid.mesh, rank=1, value=[[0.0], [1e-3], [0.0]])
    equation = fipy.TransientTerm() + fipy.UpwindConvectionTerm(coeff=velocity) == 0.0
    with pytest.warns(TransportWarning, match="pores gain or lose"):
        equation.solve(var=solute, dt=1e-3)


def test_conditions_are_looked_at_again_when_they_change(fluid, solute):
    equation = fipy.TransientTerm() + fipy.UpwindConvectionTerm(coeff=fluid.velocity) == 0.0
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        equation.solve(var=solute, dt=1e-3)
    without = fipy.CellVariable(mesh=fluid.mesh, name="d")
    with pytest.warns(TransportWarning, match="d has no condition"):
        equation.solve(var=without, dt=1e-3)
    loose = fipy.CellVariable(mesh=fluid.mesh, name="e")
    loose.faceGrad.constrain(np.zeros((3, 1)), where=fluid.mesh.exteriorFaces)
    with pytest.warns(TransportWarning, match="e has no value on .* through which fluid enters"):
        equation.solve(var=loose, dt=1e-3)


def test_an_equation_belongs_to_one_mesh(fluid, mesh_of):
    equation = fipy.TransientTerm() == fipy.DiffusionTerm(coeff=1.0)
    equation.solve(var=fipy.CellVariable(mesh=fluid.mesh), dt=1.0)
    with pytest.raises(InputError, match="solved on another mesh"):
        equation.solve(var=fipy.CellVariable(mesh=mesh_of("n54_s1").to_fipy()), dt=1.0)


def test_plain_constraints_of_a_fourth_order_term_are_warned_of(fluid, solute):
    with pytest.warns(TransportWarning, match="does not reach a DiffusionTerm of order 4"):
        (fipy.TransientTerm() == -fipy.DiffusionTerm(coeff=(1e-4, 1.0))).solve(var=solute, dt=1.0)
