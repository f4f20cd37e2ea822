"""PoreSolver: the answers of a direct solver, whatever the units, and errors where there is no answer."""

from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.sparse.linalg import spsolve

from porefv.errors import ComputationError, InputError, PorefvWarning
from porefv.flow.pore_flow import PoreFlow
from porefv.flow.walls import Walls

fipy = pytest.importorskip("fipy")
pore_solver = pytest.importorskip("porefv.fipy.pore_solver")
PoreSolver = pore_solver.PoreSolver


@pytest.fixture
def fluid(mesh_of):
    return PoreFlow(mesh_of("n54_s1"), Walls.along("y"), tolerance=1e-13).to_fipy()


def solute(fluid):
    c = fipy.CellVariable(mesh=fluid.mesh, name="c", hasOld=True)
    c.constrain(1.0, where=fluid.inlet)
    c.faceGrad.constrain(np.zeros((3, 1)), where=fluid.outlet)
    return c


EQUATIONS = {
    "diffusion in time": lambda fluid: fipy.TransientTerm() == fipy.DiffusionTerm(coeff=0.1),
    "convection": lambda fluid: fipy.UpwindConvectionTerm(coeff=fluid.velocity) == fipy.DiffusionTerm(coeff=1e-4),
    "power law in time": lambda fluid: fipy.TransientTerm() + fipy.PowerLawConvectionTerm(coeff=fluid.velocity)
    == fipy.DiffusionTerm(coeff=0.1),
    "sink": lambda fluid: fipy.DiffusionTerm(coeff=0.1) == fipy.ImplicitSourceTerm(coeff=2.0),
    "fourth order": lambda fluid: fipy.TransientTerm() == -fipy.DiffusionTerm(coeff=(1e-4, 1.0)),
}  # fmt: skip


@pytest.mark.parametrize("scale", [1.0, 1e-12, 1e12])
@pytest.mark.parametrize("name", EQUATIONS)
def test_the_answer_is_that_of_a_direct_solver(name, scale, fluid, assembled):
    c = solute(fluid)
    equation = scale * EQUATIONS[name](fluid)
    matrix, right = assembled(equation, c, dt=0.1)
    solver = PoreSolver(tolerance=1e-12)
    equation.solve(var=c, dt=0.1, solver=solver)
    assert_allclose(c.value, spsolve(matrix.tocsc(), right), rtol=0, atol=1e-9)
    assert solver.convergence.iterations >= 0


@pytest.mark.parametrize("limit", [0, 20_000])
def test_iteration_and_factor_agree(limit, fluid, monkeypatch):
    monkeypatch.setattr(pore_solver, "FACTOR_LIMIT", limit)
    c = solute(fluid)
    c.setValue(0.0)
    for _ in range(3):
        c.updateOld()
        EQUATIONS["power law in time"](fluid).solve(var=c, dt=1.0, solver=PoreSolver(tolerance=1e-12))
    age = solute(fluid)
    EQUATIONS["convection"](fluid).solve(var=age, solver=PoreSolver(tolerance=1e-12))
    assert_allclose(age.value, 1.0, atol=1e-9)
    assert 0.0 <= c.value.min() < c.value.max() <= 1.0 + 1e-12


@pytest.mark.parametrize("limit", [0, 2000])
def test_conjugate_gradients_and_factor_agree(limit, fluid, monkeypatch):
    monkeypatch.setattr(pore_solver, "DIRECT_LIMIT", limit)
    assert_allclose(fluid.solve(solver=PoreSolver()), fluid.flow.pressure, atol=1e-7)


def test_a_factor_is_kept_while_the_matrix_stays(fluid, monkeypatch):
    made = []
    splu = pore_solver.splu
    monkeypatch.setattr(pore_solver, "splu", lambda *args, **options: made.append(1) or splu(*args, **options))
    c, equation, solver = solute(fluid), EQUATIONS["power law in time"](fluid), PoreSolver()
    for _ in range(4):
        c.updateOld()
        equation.solve(var=c, dt=0.1, solver=solver)
    assert len(made) == 1
    equation.solve(var=c, dt=0.2, solver=solver)
    equation.solve(var=c, dt=0.1, solver=solver)
    assert len(made) == 2


def test_a_time_step_that_changes_little_is_solved(fluid):
    """FiPy's default criterion leaves such steps as they are, for values on walls swell the right-hand side."""
    pressure = fluid.pressure
    pressure.setValue(0.5)
    equation = fipy.TransientTerm(coeff=1e-3) == fipy.DiffusionTerm(coeff=fluid.mobility)
    for _ in range(60):
        equation.solve(var=pressure, dt=1.0)
    assert_allclose(pressure.value, fluid.flow.pressure, atol=1e-7)


def test_what_is_not_determined_is_an_error(fluid):
    c, infinite = (fipy.CellVariable(mesh=fluid.mesh, value=value) for value in (1.0, np.inf))
    with pytest.raises(ComputationError, match=f"{fluid.mesh.numberOfCells} unknowns of .* up to a constant only"):
        (fipy.DiffusionTerm(coeff=1.0) == 1.0).solve(var=c)
    assert (c.value == 1.0).all()
    with pytest.raises(ComputationError, match="not finite"):
        (fipy.TransientTerm(coeff=np.nan) == fipy.DiffusionTerm(coeff=1.0)).solve(var=c, dt=1.0)
    with np.errstate(all="ignore"), pytest.raises(ComputationError, match="not finite"):
        (fipy.TransientTerm() == fipy.DiffusionTerm(coeff=1.0)).solve(var=infinite, dt=1.0)
    with pytest.raises(ComputationError, match="nothing determines"):
        (fipy.ImplicitSourceTerm(coeff=0.0) == 1.0).solve(var=c)
    assert (c.value == 1.0).all()


def test_a_tolerance_that_is_none_is_refused():
    for tolerance in (0.0, 1.0, -1e-3, "small"):
        with pytest.raises(InputError, match="tolerance must lie between 0 and 1"):
            PoreSolver(tolerance=tolerance)


def test_pores_behind_nearly_closed_faces_have_their_values(fluid):
    """What they lose is nothing beside the flow; their values are solved for all the same."""
    mesh = fluid.mesh
    diffusivity = fipy.FaceVariable(mesh=mesh, value=1.0)
    alone = int(np.flatnonzero(mesh.pore_mesh.pore_walls == 0)[0])
    around = (np.asarray(mesh.faceCellIDs) == alone).any(axis=0) & mesh.interiorFaces.value
    diffusivity.setValue(1e-14, where=around)
    c = fipy.CellVariable(mesh=mesh, value=5.0)
    c.constrain(1.0, where=mesh.facesBottom)
    c.constrain(0.0, where=mesh.facesTop)
    for limit in (0, 2000):
        with pytest.MonkeyPatch.context() as patch:
            patch.setattr(pore_solver, "DIRECT_LIMIT", limit)
            c.setValue(5.0)
            fipy.DiffusionTerm(coeff=diffusivity).solve(var=c, solver=PoreSolver())
            assert 0.0 < c.value[alone] < 1.0


def test_sweeps_end_where_what_enters_leaves(fluid):
    """A diffusivity 1 + c."""
    mesh = fluid.mesh
    c = fipy.CellVariable(mesh=mesh)
    c.constrain(1.0, where=mesh.facesBottom)
    c.constrain(0.0, where=mesh.facesTop)
    equation = fipy.DiffusionTerm(coeff=1.0 + c.faceValue)
    residuals = [equation.sweep(var=c) for _ in range(40)]
    assert residuals[-1] < 1e-7 * residuals[0]
    flux = -(1.0 + c.faceValue) * c.faceGrad
    assert mesh.through(flux, mesh.facesTop) == pytest.approx(-mesh.through(flux, mesh.facesBottom), rel=1e-6)


def grid_variable(grid):
    c = fipy.CellVariable(mesh=grid)
    c.constrain(1.0, where=grid.facesLeft)
    c.constrain(0.0, where=grid.facesRight)
    return c


@pytest.mark.filterwarnings("error::porefv.errors.PorefvWarning")
@pytest.mark.parametrize("scale", [1.0, 1e-12, 1e12])
@pytest.mark.parametrize("shape", [(30, 20), (15, 10, 8)])
def test_the_answer_on_grids_of_fipys_own(shape, scale, assembled, monkeypatch):
    grid = (fipy.Grid2D if len(shape) == 2 else fipy.Grid3D)(*([1.0] * len(shape)), *shape)
    velocity = [1000.0] + [300.0] * (len(shape) - 1)
    for limit in (0, 20_000):
        monkeypatch.setattr(pore_solver, "FACTOR_LIMIT", limit)
        monkeypatch.setattr(pore_solver, "DIRECT_LIMIT", limit)
        for equation in (
            fipy.DiffusionTerm(coeff=scale) == -3.0 * scale,
            fipy.PowerLawConvectionTerm(coeff=[scale * v for v in velocity]) == fipy.DiffusionTerm(coeff=scale),
            fipy.TransientTerm(coeff=scale) == fipy.DiffusionTerm(coeff=scale),
            fipy.TransientTerm(coeff=scale) == -fipy.DiffusionTerm(coeff=(scale, 1.0)),
        ):
            c = grid_variable(grid)
            matrix, right = assembled(equation, c, dt=0.1)
            equation.solve(var=c, dt=0.1, solver=PoreSolver(tolerance=1e-12))
            expected = spsolve(matrix.tocsc(), right)
            assert_allclose(c.value, expected, rtol=0, atol=1e-9 * np.abs(expected).max())


@pytest.mark.parametrize("limit", [0, 20_000])
def test_coupled_equations_have_the_answer_of_fipys_solver(limit, monkeypatch):
    monkeypatch.setattr(pore_solver, "FACTOR_LIMIT", limit)
    grid = fipy.Grid2D(nx=12, ny=10)
    found = []
    for solver in (PoreSolver(tolerance=1e-12), fipy.LinearLUSolver(tolerance=1e-14)):
        a, b = grid_variable(grid), grid_variable(grid)
        first = fipy.TransientTerm(var=a) == fipy.DiffusionTerm(1.0, var=a) - fipy.ImplicitSourceTerm(2.0, var=b)
        second = fipy.TransientTerm(var=b) == fipy.DiffusionTerm(3.0, var=b) + fipy.ImplicitSourceTerm(1.0, var=a)
        (first & second).solve(dt=1.0, solver=solver)
        found.append(np.concatenate([a.value, b.value]))
    assert_allclose(found[0], found[1], rtol=0, atol=1e-9)


def test_sweeps_return_the_residuals_of_fipy():
    grid, residuals = fipy.Grid2D(nx=8, ny=8), []
    for solver in (PoreSolver(), fipy.LinearLUSolver(tolerance=1e-12)):
        c, equation = grid_variable(grid), fipy.DiffusionTerm(coeff=1.0)
        residuals.append([equation.sweep(var=c, solver=solver, underRelaxation=0.5) for _ in range(3)])
        assert equation.sweep(var=c, solver=solver, residualFn=lambda *_: 7.0) == 7.0
    assert_allclose(residuals[0], residuals[1], rtol=1e-7)


@pytest.mark.parametrize("limit", [0, 20_000])
def test_convection_in_a_closed_box_is_not_determined(limit, monkeypatch):
    monkeypatch.setattr(pore_solver, "FACTOR_LIMIT", limit)
    grid = fipy.Grid2D(nx=8, ny=8)
    velocity = fipy.FaceVariable(mesh=grid, rank=1, value=[[1.0], [0.0]])
    velocity.setValue(0.0, where=grid.exteriorFaces)
    equation = fipy.PowerLawConvectionTerm(coeff=velocity) == fipy.DiffusionTerm(coeff=1.0) + 1.0
    with pytest.raises(ComputationError, match="64 unknowns of 64, .* up to a constant only"):
        equation.solve(var=fipy.CellVariable(mesh=grid), solver=PoreSolver())


def test_too_few_iterations_are_an_error_and_a_slower_way_is_told(monkeypatch):
    monkeypatch.setattr(pore_solver, "FACTOR_LIMIT", 0)
    monkeypatch.setattr(pore_solver, "DIRECT_LIMIT", 0)
    grid = fipy.Grid2D(nx=40, ny=40)
    c = grid_variable(grid)
    with pytest.raises(ComputationError, match="stopped after 1 iterations"):
        fipy.DiffusionTerm(coeff=1.0).solve(var=c, solver=PoreSolver(iterations=1))
    equation = fipy.CentralDifferenceConvectionTerm(coeff=[1.0, 0.3]) == fipy.DiffusionTerm(coeff=1.0)
    with pytest.warns(PorefvWarning, match="BiCGStab did not reach"):
        equation.solve(var=c, solver=PoreSolver(tolerance=1e-12, iterations=1))


def test_several_processes_are_refused():
    class Communicator:
        Nproc = 2

    grid = fipy.Grid2D(nx=3, ny=3)
    c = grid_variable(grid)
    grid.communicator = Communicator()
    with pytest.raises(InputError, match="solves in one process, and there are 2"):
        fipy.DiffusionTerm(coeff=1.0).solve(var=c, solver=PoreSolver())


def test_fipys_defaults_are_replaced_within_a_block_only():
    c = grid_variable(fipy.Grid2D(nx=3, ny=3))
    equations = fipy.DiffusionTerm(), fipy.PowerLawConvectionTerm(coeff=[1.0, 0.0])
    before = [type(equation.getDefaultSolver(var=c)) for equation in equations]
    with pore_solver.use_pore_solver() as solver:
        assert all(equation.getDefaultSolver(var=c) is solver for equation in equations)
    assert [type(equation.getDefaultSolver(var=c)) for equation in equations] == before


def test_threads_that_solve_on_one_mesh_have_their_own_answers(fluid):
    mesh = fluid.mesh

    def found(value):
        c = fipy.CellVariable(mesh=mesh)
        c.constrain(value, where=mesh.facesBottom)
        fipy.DiffusionTerm(coeff=1.0).solve(var=c)
        return float(np.abs(c.value / value - 1.0).max())

    with ThreadPoolExecutor(4) as pool:
        assert max(pool.map(found, [1.0, 2.0, 3.0, 4.0] * 20)) < 1e-9


def test_an_equation_may_be_solved_within_the_residual_of_another(fluid):
    mesh = fluid.mesh
    c, d = fipy.CellVariable(mesh=mesh), fipy.CellVariable(mesh=mesh)
    c.constrain(1.0, where=mesh.facesBottom)
    d.constrain(7.0, where=mesh.facesTop)

    def residual(var, matrix, right):
        fipy.DiffusionTerm(coeff=2.0).solve(var=d)
        return 0.0

    fipy.DiffusionTerm(coeff=1.0).sweep(var=c, residualFn=residual)
    assert_allclose(c.value, 1.0, atol=1e-9)
    assert_allclose(d.value, 7.0, atol=1e-8)


@pytest.mark.parametrize("limit", [0, 20_000])
def test_a_trace_beside_much_of_another_solute_is_solved(limit, fluid, monkeypatch):
    monkeypatch.setattr(pore_solver, "FACTOR_LIMIT", limit)
    mesh, flow = fluid.mesh, fluid.flow
    k = 1e-13 * flow.inflow / mesh.cellVolumes.sum()
    a, b = solute(fluid), solute(fluid)
    b.constrain(0.0, where=fluid.inlet)
    of_a = fipy.UpwindConvectionTerm(coeff=fluid.velocity, var=a) == 0.0
    of_b = fipy.UpwindConvectionTerm(coeff=fluid.velocity, var=b) == fipy.ImplicitSourceTerm(coeff=k, var=a)
    for _ in range(2):
        (of_a & of_b).solve()
    assert mesh.through(b.faceValue * fluid.velocity, fluid.outlet) == pytest.approx(
        k * mesh.cellVolumes.sum(), rel=1e-6
    )


def test_sinks_that_rounding_hides_are_an_error(fluid):
    c = fipy.CellVariable(mesh=fluid.mesh)
    equation = fipy.DiffusionTerm(coeff=1.0) - fipy.ImplicitSourceTerm(coeff=1e-13) == -2e-13
    with pytest.raises(ComputationError, match="rounding of the matrix hides|up to a constant only"):
        equation.solve(var=c)


def test_numbers_too_large_to_be_squared_end_in_an_error(fluid):
    c = fipy.CellVariable(mesh=fluid.mesh)
    c.constrain(1e160, where=fluid.mesh.facesBottom)
    with np.errstate(all="ignore"), pytest.raises(ComputationError):
        fipy.DiffusionTerm(coeff=1.0).solve(var=c)
