"""Time of a step of a solute: porefv.transport beside FiPy, and versus diffusion. Ratios of one process.

Run: python benchmarks/transport.py [packing]
"""

from __future__ import annotations

import sys
import time

import fipy
import numpy as np

from porefv import Packing, PoreFlow, Walls
from porefv.transport.solute import Solute

STEPS = 5


def timed(step, count=STEPS):
    """Seconds of the first step, and the least of some further ones."""
    found = []
    for _ in range(count + 1):
        start = time.perf_counter()
        step()
        found.append(time.perf_counter() - start)
    return found[0], min(found[1:])


def main():
    """Print the table."""
    name = sys.argv[1] if len(sys.argv) > 1 else "n20000_s1"
    flow = PoreFlow(Packing.read(f"data/packings/{name}.csv"), Walls.along("y"), tolerance=1e-13)
    mesh, box = flow.mesh, flow.mesh.box
    diameter = 2.0 * mesh.packing.radii.mean()
    speed = flow.inflow / (box.section(1) * mesh.packing.porosity)
    dt = mesh.pore_volumes.sum() / flow.inflow / 50.0
    problem = flow.to_fipy()
    fluid, u = problem.mesh, problem.velocity
    print(f"{name}: {mesh.n_pores} pores; seconds of the first step, of a further one; FiPy's over ours; difference")
    for peclet in (np.inf, 100.0, 1.0, 0.01):
        diffusivity = speed * diameter / peclet
        start = time.perf_counter()
        solute = Solute(flow, diffusivity)
        setup = time.perf_counter() - start
        ours = timed(lambda solute=solute: solute.advance(dt))
        c = fipy.CellVariable(mesh=fluid, hasOld=True)
        c.constrain(1.0, where=problem.inlet)
        c.faceGrad.constrain([[0.0], [0.0], [0.0]], where=problem.outlet)
        equation = fipy.TransientTerm() + fipy.UpwindConvectionTerm(coeff=u)
        if diffusivity > 0.0:
            inward = fipy.FaceVariable(mesh=fluid, value=diffusivity)
            inward.setValue(0.0, where=fluid.exteriorFaces)
            equation = equation == fipy.DiffusionTerm(coeff=inward)
        else:
            equation = equation == 0.0

        def step(c=c, equation=equation):
            c.updateOld()
            equation.solve(var=c, dt=dt)

        theirs = timed(step)
        difference = np.abs(c.value - solute.concentration[fluid.pores]).max()
        print(
            f"U d/D {peclet:6g}: setup {setup:.2f}, ours {ours[0]:.3f} {ours[1]:.4f}, FiPy {theirs[0]:.3f} "
            f"{theirs[1]:.3f}, ratio {theirs[1] / ours[1]:.1f}, difference {difference:.1e}, "
            f"balance {solute.balance.largest_imbalance:.0e}",
            flush=True,
        )


if __name__ == "__main__":
    main()
