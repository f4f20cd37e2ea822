"""The patches of FiPy come with a mesh of the fluid, leave other meshes alone, and can be taken back."""

import importlib

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

fipy = pytest.importorskip("fipy")
patches = pytest.importorskip("porefv.fipy.fipy_patches")
PoreSolver = pytest.importorskip("porefv.fipy.pore_solver").PoreSolver


@pytest.fixture
def fluid(mesh_of):
    yield mesh_of("n25_s1").to_fipy()
    patches.install()


def test_both_can_be_taken_back(fluid):
    assert_allclose(fipy.CellVariable(mesh=fluid, value=fluid.z).grad.value[2], 1.0, atol=1e-8)
    c = fipy.CellVariable(mesh=fluid)
    assert isinstance(fipy.DiffusionTerm().getDefaultSolver(var=c), PoreSolver)
    patches.remove()
    assert np.abs(fipy.CellVariable(mesh=fluid, value=fluid.z).grad.value[2] - 1.0).max() > 0.1
    assert not isinstance(fipy.DiffusionTerm().getDefaultSolver(var=c), PoreSolver)


def test_fipys_own_meshes_are_left_alone(fluid):
    grid = fipy.Grid2D(nx=3, ny=3)
    c = fipy.CellVariable(mesh=grid, value=grid.x)
    assert_array_equal(c.grad.value[0], [0.5, 1.0, 0.5] * 3)
    assert type(fipy.DiffusionTerm().getDefaultSolver(var=c)) is fipy.DefaultSolver


def test_a_solver_that_is_named_is_taken(fluid):
    named = fipy.LinearLUSolver()
    assert fipy.DiffusionTerm().getDefaultSolver(var=fipy.CellVariable(mesh=fluid), solver=named) is named


def test_coupled_equations_are_solved_by_the_solver_of_their_mesh(fluid):
    a, b = fipy.CellVariable(mesh=fluid), fipy.CellVariable(mesh=fluid)
    coupled = (fipy.DiffusionTerm(var=a) == 0) & (fipy.DiffusionTerm(var=b) == 0)
    assert isinstance(coupled.getDefaultSolver(), PoreSolver)


def test_loading_the_module_once_more_patches_what_is_fipys(fluid):
    again = importlib.reload(patches)
    again.install()
    again.install()
    grid = fipy.Grid2D(nx=3, ny=3)
    assert_array_equal(fipy.CellVariable(mesh=grid, value=grid.x).grad.value[0], [0.5, 1.0, 0.5] * 3)
    assert_allclose(fipy.CellVariable(mesh=fluid, value=fluid.z).grad.value[2], 1.0, atol=1e-8)
