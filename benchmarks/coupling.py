"""Coupled steps: their cost beside dry ones and beside Yade's, and the largest stable step against viscosity.

    python benchmarks/coupling.py cost --store consolidation [--grains 5000]
    python benchmarks/coupling.py stability --store consolidation [--grains 500]
    python benchmarks/coupling.py suspension [--grains 5000]

`--store` holds samples as `benchmarks/consolidation.py` makes them. CPU time is of one thread, the least
of several runs.
"""

from __future__ import annotations

import argparse
import json
import os
import shutil
import subprocess
import tempfile
import time
from pathlib import Path

os.environ["NUMBA_NUM_THREADS"] = os.environ["OMP_NUM_THREADS"] = "1"

import numpy as np
from consolidation import CONFINEMENT, DRAINED, VISCOSITY, sample

import porefv.coupling.coupling as coupled_grains
from porefv.coupling.coupling import Coupling
from porefv.dem.dem import DEM
from porefv.dem.material import Material
from porefv.dem.plate import Plate
from porefv.dem.random_placement import cloud
from porefv.dem.sizes import UniformSizes
from porefv.errors import ComputationError
from porefv.flow.fluid import Fluid
from porefv.flow.walls import Walls
from porefv.packing.box import Box

YADE = """
import json, time
import numpy as np
rows = np.loadtxt({path!r})
lower, upper = {lower!r}, {upper!r}
O.materials.append(FrictMat(young=15e6, poisson=0.5, frictionAngle=radians(30), density=2600, label="grains"))
O.materials.append(FrictMat(young=15e6, poisson=0.5, frictionAngle=0, density=0, label="walls"))
O.bodies.append(aabbWalls([lower, upper], thickness=0, material="walls"))
O.bodies.append([sphere(row[:3], row[3], material="grains") for row in rows])
flow = FlowEngine(
    isActivated=True, useSolver=3, viscosity={viscosity}, meshUpdateInterval=-1, defTolerance=-1,
    bndCondIsPressure=[0, 0, 0, 0, 1, 1], bndCondValue=[0, 0, 0, 0, 0, 0], boundaryUseMaxMin=[0, 0, 0, 0, 0, 0],
)
O.engines = [
    ForceResetter(),
    InsertionSortCollider([Bo1_Sphere_Aabb(), Bo1_Box_Aabb()]),
    InteractionLoop(
        [Ig2_Sphere_Sphere_ScGeom(), Ig2_Box_Sphere_ScGeom()],
        [Ip2_FrictMat_FrictMat_FrictPhys()],
        [Law2_ScGeom_FrictPhys_CundallStrack()],
    ),
    flow,
    NewtonIntegrator(damping=0.0),
]
O.dt = {step}
O.run(5, True)
best = 1e9
for _ in range(4):
    begin = time.process_time()
    O.run(50, True)
    best = min(best, (time.process_time() - begin) / 50)
print(json.dumps([best, float(np.linalg.norm(O.bodies[100].state.vel))]))
"""


def loaded(grains: int, store: Path):
    """The sample of the consolidation test, at the start of it."""
    dem = sample(grains, store)
    dem.damping = 0.0
    dem.set_plates({"z_max": Plate(stress=2 * CONFINEMENT, top_speed=0.5)})
    return dem


def least(run, steps: int, times: int) -> float:
    """Least CPU time of a step, in ms."""
    best = np.inf
    for _ in range(times):
        begin = time.process_time()
        run(steps)
        best = min(best, (time.process_time() - begin) / steps * 1e3)
    return best


def yade(dem, viscosity: float) -> list[float] | None:
    """CPU time of a coupled step of Yade [s], and the speed of a grain after it."""
    if shutil.which("yade") is None:
        return None
    with tempfile.TemporaryDirectory() as folder:
        rows, script = Path(folder) / "grains.txt", Path(folder) / "run.py"
        np.savetxt(rows, np.column_stack([dem.positions, dem.radii]))
        box = dem.box
        script.write_text(
            YADE.format(
                path=str(rows), lower=tuple(map(float, box.lower)), upper=tuple(map(float, box.upper)),
                viscosity=viscosity, step=dem.step,
            )
        )  # fmt: skip
        done = subprocess.run(
            ["yade", "-x", "-n", "-j1", str(script)], capture_output=True, text=True, check=True, cwd=folder
        )
        return json.loads([line for line in done.stdout.splitlines() if line.startswith("[")][-1])


def cost(grains: int, store: Path) -> None:
    dry = loaded(grains, store)
    dry.run(20)
    coupling = Coupling(loaded(grains, store), DRAINED, Fluid(viscosity=VISCOSITY))
    coupling.run(100)
    effort = coupling.effort
    effort.seconds = dict.fromkeys(effort.seconds, 0.0)
    before = effort.iterations, effort.steps
    wet_ms, dry_ms = np.inf, np.inf
    for _ in range(6):
        dry_ms = min(dry_ms, least(dry.run, 100, 1))
        wet_ms = min(wet_ms, least(coupling.run, 100, 1))
    steps = effort.steps - before[1]
    print(f"{grains} grains, {coupling.mesh.n_pores} pores: dry {dry_ms:.2f} ms, coupled {wet_ms:.2f} ms a step")
    print(f"  {(effort.iterations - before[0]) / steps:.2f} iterations a step; shares:", end=" ")
    total = sum(effort.seconds.values())
    print(", ".join(f"{part} {seconds / total:.0%}" for part, seconds in effort.seconds.items()))
    begin = time.process_time()
    coupling.renew_mesh()
    coupling.run(1)
    print(f"  a new mesh, and its first step: {1e3 * (time.process_time() - begin):.0f} ms")
    rival = yade(coupling.grains, 0.1)
    if rival is not None:
        print(f"  Yade, 0.1 Pa s: {rival[0] * 1e3:.2f} ms a step, {rival[0] * 1e3 / wet_ms:.1f} times ours")
        rival = yade(coupling.grains, VISCOSITY)
        print(f"  Yade, {VISCOSITY:g} Pa s: speed of a grain after 205 steps {rival[1] if rival else None} m/s")


def cloud_in_fluid(grains: int, stride: int | None):
    """The cloud of the immersed deposition (C14 §4): 6 cm grains at a solid fraction of 0.25; dry without a stride."""
    # Vessels as of C14's 5000 grains, 2 m high, and of 500.
    sides = [1.5, 0.75, 2.0] if grains == 5000 else [0.45, 0.45, 1.117 * grains / 500]
    packing = cloud(grains, UniformSizes(1.0), Box([0, 0, 0], sides), 0.75, 1)
    dem = DEM(packing, Material(15e6, 0.5, 30.0, 2600.0), gravity=(0.0, 0.0, -9.81))
    dem.apply(1000.0 * 9.81 * 4.0 / 3.0 * np.pi * packing.radii[:, None] ** 3 * [0.0, 0.0, 1.0])
    if stride is None:
        return dem
    lid = Walls.from_mapping({"z_max": {"pressure": 0.0, "free": True}, "lateral": {"slip": True}})
    fluid = Fluid(viscosity=100.0, density=1000.0)
    return Coupling(dem, lid, fluid, pair_resistance=True, renewal=0.1, stride=stride)


def suspension(grains: int) -> None:
    """A step with pair resistance in a suspension, short and long, beside a dry one, for as long as a mesh lasts."""
    dry, lasts = cloud_in_fluid(grains, None), 800
    runs = {stride: cloud_in_fluid(grains, stride) for stride in (1, 10)}
    dry.run(50)
    for coupling in runs.values():
        coupling.run(200)
    dry_ms = least(dry.run, 200, 4)
    print(f"{grains} grains: dry {dry_ms:.2f} ms")
    for stride, coupling in runs.items():
        before = coupling.effort.iterations, coupling.effort.pair_iterations
        step_ms = least(coupling.run, 100, 4)
        effort = coupling.effort
        begin = time.process_time()
        coupling.renew_mesh()
        coupling.run(stride)
        mesh_ms = 1e3 * (time.process_time() - begin) / lasts
        print(
            f"  stride {stride}: {step_ms:.2f} ms a step of the grains, {step_ms / dry_ms:.1f} dry ones; with a mesh "
            f"every {lasts} steps {step_ms + mesh_ms:.2f} ms, {(step_ms + mesh_ms) / dry_ms:.1f}; iterations a long "
            f"step: {stride * (effort.iterations - before[0]) / 400:.1f} for pressures, "
            f"{stride * (effort.pair_iterations - before[1]) / 400:.1f} for pairs"
        )


def bounded(grains: int, store: Path, scheme: str, viscosity: float, part: float) -> bool:
    """Whether 200 steps of so much of the critical dry step stay within bounds."""
    dem = loaded(grains, store)
    dem.step = part * dem.critical_step
    coupling = Coupling(dem, DRAINED, Fluid(viscosity=viscosity), scheme=scheme)
    most = 0.0
    try:
        for _ in range(10):
            coupling.run(20)
            most = max(most, float((dem.masses[:, None] * dem.velocities**2).sum()))
            if not np.isfinite(most) or most > 1e3 * max(dem.energies.walls, 1e-12):
                return False
    except ComputationError:
        return False
    return True


def stability(grains: int, store: Path) -> None:
    """Largest stable step of both schemes, by bisection, over ten decades of viscosity."""
    coupled_grains.UNSTABLE = np.inf
    dem = loaded(grains, store)
    print(f"{grains} grains; the critical dry step is {dem.critical_step:.3g} s; steps as parts of it")
    print("| viscosity, Pa s | semi-implicit | implicit drag | drag number at the default step |")
    for viscosity in 10.0 ** np.arange(-4, 7):
        largest = {}
        for scheme in ("semi-implicit", "implicit-drag"):
            low, high = 0.0, 1.0
            if bounded(grains, store, scheme, viscosity, high * 0.85):
                low = 0.85
            else:
                low, high = 1e-8, 0.85
                while high / low > 1.3:
                    middle = np.sqrt(low * high)
                    low, high = (middle, high) if bounded(grains, store, scheme, viscosity, middle) else (low, middle)
            largest[scheme] = low
        fluid = Fluid(viscosity=viscosity)
        probe = Coupling(loaded(grains, store), DRAINED, fluid, scheme="semi-implicit")
        shown = [f"{'≥ ' if part >= 0.85 else ''}{part:.2g}" for part in largest.values()]
        print(f"| {viscosity:g} | {shown[0]} | {shown[1]} | {probe.drag_number:.2g} |", flush=True)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("what", choices=["cost", "stability", "suspension"])
    parser.add_argument("--grains", type=int)
    parser.add_argument("--store", type=Path, default=Path("consolidation"), help="directory of samples")
    options = parser.parse_args()
    if options.what == "suspension":
        suspension(options.grains or 5000)
        return
    options.store.mkdir(exist_ok=True)
    if options.what == "cost":
        cost(options.grains or 5000, options.store)
    else:
        stability(options.grains or 500, options.store)


if __name__ == "__main__":
    main()
