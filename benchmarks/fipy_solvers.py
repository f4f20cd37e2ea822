"""FiPy's equations on the pores: PoreSolver beside FiPy's own solvers and porefv's own pressure solution.

    python benchmarks/fipy_solvers.py                 # 20 000 spheres; FiPy's default LU takes minutes there
    python benchmarks/fipy_solvers.py n2000_s1        # another packing of data/packings

Prints a table in Markdown: the pressure equation by every solver, convection and diffusion steadily and in time, and
the mesh. Ratios are within this one run.
"""

from __future__ import annotations

import argparse
import time
import warnings
from pathlib import Path

import numpy as np

from porefv import Packing, PoreFlow, PoreMesh, Walls
from porefv.fipy.fipy_import import load_fipy
from porefv.fipy.fluid_mesh import FluidMesh
from porefv.fipy.pore_solver import PoreSolver

fipy = load_fipy()
PACKINGS = Path(__file__).parents[1] / "data" / "packings"
NOTHING = [[0.0], [0.0], [0.0]]


def timed(function):
    """Seconds that a call takes, and what it returns; an exception in its place."""
    begin = time.perf_counter()
    try:
        found = function()
    except Exception as error:
        found = error
    return time.perf_counter() - begin, found


def row(name, seconds, unit, note):
    print(f"| {name} | {seconds:.2f} | {seconds / unit:.1f} | {note} |", flush=True)


def pressure(flow, fluid, lu):
    native = flow.timings["solve"]
    first = PoreSolver()
    unit, found = timed(lambda: fluid.solve(solver=first))
    span = np.ptp(flow.pressure)

    def note(values, solver):
        if isinstance(values, Exception):
            return f"{type(values).__name__}"
        iterations = solver.convergence.iterations
        return f"{iterations} iterations, error {np.abs(values - flow.pressure).max() / span:.0e}"

    print("\n| pressure equation, steady | s | ratio | |\n|---|---|---|---|")
    row("porefv's own solution", native, unit, "without conductances")
    row("`PoreSolver`, first", unit, unit, note(found, first))
    fluid.pressure.setValue(0.5)
    again, found = timed(lambda: fluid.solve(solver=first))
    row("`PoreSolver`, factor kept", again, unit, note(found, first))
    others = {
        "`LinearPCGSolver`, FiPy's tolerance": lambda: fipy.LinearPCGSolver(),
        "`LinearPCGSolver`, 1e-14, no preconditioner": lambda: fipy.LinearPCGSolver(
            tolerance=1e-14, precon=None, iterations=5000
        ),
        "`LinearPCGSolver`, 1e-14, Jacobi": lambda: fipy.LinearPCGSolver(
            tolerance=1e-14, precon=fipy.JacobiPreconditioner(), iterations=5000
        ),
        "`LinearPCGSolver`, FiPy's tolerance, ILU": lambda: fipy.LinearPCGSolver(precon=fipy.ILUPreconditioner()),
        "`LinearGMRESSolver`, FiPy's tolerance": lambda: fipy.LinearGMRESSolver(),
        "`LinearBicgstabSolver`, 1e-14, ILU": lambda: fipy.LinearBicgstabSolver(
            tolerance=1e-14, precon=fipy.ILUPreconditioner()
        ),
    }
    if lu:
        others["`LinearLUSolver`, FiPy's default"] = lambda: fipy.LinearLUSolver(tolerance=1e-14, criterion="RHS")
    for name, make in others.items():
        fluid.pressure.setValue(0.5)
        solver = make()
        seconds, found = timed(lambda solver=solver: fluid.solve(solver=solver))
        row(name, seconds, unit, note(found, solver))


def transport(flow, fluid):
    mesh, volume = fluid.mesh, float(fluid.mesh.cellVolumes.sum())
    mean = volume / flow.inflow
    diameter = 2.0 * float(flow.mesh.packing.radii.mean())
    print("\n| solute (power law) | s | ratio | |\n|---|---|---|---|")
    for peclet in (1000.0, 10.0, 0.1):
        value = float(np.linalg.norm(flow.darcy_velocity)) * diameter / peclet
        diffusivity = fipy.FaceVariable(mesh=mesh, value=value)
        diffusivity.setValue(0.0, where=fluid.inlet)

        def variable(value, mesh=mesh):
            c = fipy.CellVariable(mesh=mesh, hasOld=True)
            c.constrain(value, where=fluid.inlet)
            c.faceGrad.constrain(NOTHING, where=fluid.outlet)
            return c

        age, solver = variable(0.0), PoreSolver()
        equation = fipy.PowerLawConvectionTerm(coeff=fluid.velocity) == fipy.DiffusionTerm(coeff=diffusivity) + 1.0
        unit, _ = timed(lambda e=equation, a=age, s=solver: e.solve(var=a, solver=s))
        error = mesh.through(age.faceValue * fluid.velocity, fluid.outlet) / flow.inflow / mean - 1.0
        note = f"{solver.convergence.iterations} iterations, mean residence time / (V/Q) - 1 = {error:.0e}"
        row(f"age, steady, Pe {peclet:g}", unit, unit, note)
        c, solver = variable(1.0), PoreSolver()
        equation = fipy.TransientTerm() + fipy.PowerLawConvectionTerm(coeff=fluid.velocity) == fipy.DiffusionTerm(
            coeff=diffusivity
        )
        seconds = []
        for _ in range(4):
            c.updateOld()
            seconds.append(timed(lambda e=equation, c=c, s=solver: e.solve(var=c, dt=mean / 50.0, solver=s))[0])
        row(f"first step of V/Q / 50, Pe {peclet:g}", seconds[0], unit, "")
        row(f"further steps, Pe {peclet:g}", min(seconds[1:]), unit, f"{solver.convergence.iterations} iterations")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("packing", nargs="?", default="n20000_s1")
    parser.add_argument("--no-lu", action="store_true", help="leave out FiPy's default LU")
    options = parser.parse_args()
    warnings.simplefilter("ignore")
    packing = Packing.read(PACKINGS / f"{options.packing}.csv")
    small = PoreFlow(Packing.read(PACKINGS / "n25_s1.csv"), Walls.along("y"))  # loads kernels and FiPy
    small.to_fipy().solve()
    mesh = PoreMesh(packing)
    made, _ = timed(lambda: (mesh.throats.volumes, mesh.pore_volumes))
    flow = PoreFlow(mesh, Walls.along("y"))
    solved, _ = timed(lambda: flow.pressure)
    built, fluid_mesh = timed(lambda: FluidMesh(mesh))
    print(f"{len(packing)} spheres, {mesh.n_pores} pores, {len(mesh.throats)} throats")
    print(f"PoreMesh with volumes {made:.2f} s, flow {solved:.2f} s, {fluid_mesh!r} {built:.2f} s")
    fluid = flow.to_fipy()
    pressure(flow, fluid, not options.no_lu)
    transport(flow, fluid)


if __name__ == "__main__":
    main()
