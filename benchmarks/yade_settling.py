"""The cloud of the immersed deposition of 500 grains, in porefv and in Yade with its lubrication (docs/coupling.md).

    python benchmarks/yade_settling.py [--yade yade] [--duration 1.5] [--repeat 3]

Both have the same grains, box, weight in the fluid, contacts, viscosity, roughness and step, and one thread. Seconds
are of the steps alone, without start-up. Speeds are of all grains, after the first third of the time, over that of a
grain alone.
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

os.environ["NUMBA_NUM_THREADS"] = os.environ["OMP_NUM_THREADS"] = os.environ["OPENBLAS_NUM_THREADS"] = "1"

import numpy as np

from porefv.coupling.coupling import Coupling
from porefv.dem.dem import DEM
from porefv.dem.material import Material
from porefv.flow.fluid import Fluid
from porefv.flow.walls import Walls
from porefv.packing.packing import Packing

CLOUD = Path(__file__).parent.parent / "data" / "packings" / "deposition_500.csv"
MATERIAL = Material(young=15e6, stiffness_ratio=0.5, friction_angle=30.0, density=2600.0)
FLUID = Fluid(viscosity=100.0, density=1000.0)
GRAVITY = 9.81
LOOKS = 30

# Read by Yade's own Python; what it needs stands in a file beside it.
SCRIPT = """
import json, time
from yade import utils
given = json.load(open("given.json"))
O.materials.append(FrictMat(young=given["young"], poisson=0.5, frictionAngle=radians(30), density=2600, label="grains"))
O.materials.append(FrictMat(young=given["young"], poisson=0.5, frictionAngle=0, density=0, label="walls"))
O.bodies.append(utils.aabbWalls([given["lower"], given["upper"]], thickness=0, material="walls"))
grains = O.bodies.append([utils.sphere(x[:3], x[3], material="grains") for x in given["spheres"]])
flow = FlowEngine(
    useSolver=3, viscosity=given["viscosity"], permeabilityFactor=1, slipBoundary=True,
    meshUpdateInterval=200, defTolerance=0.3,  # as in Yade's example oedometer.py
    bndCondIsPressure=[0, 0, 0, 0, 0, 1], bndCondValue=[0] * 6, boundaryUseMaxMin=[0] * 6,
    shearLubrication=given["lubrication"], normalLubrication=given["lubrication"], eps=0.05,
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
    NewtonIntegrator(damping=0.0, gravity=(0, 0, -given["gravity"])),
]
O.dt = given["step"]
rows, clock, cpu = [], 0.0, 0.0
for _ in range(given["looks"]):
    begun, used = time.perf_counter(), time.process_time()
    O.run(given["every"], True)
    clock, cpu = clock + time.perf_counter() - begun, cpu + time.process_time() - used
    rows.append([-O.bodies[i].state.vel[2] for i in grains])
print("RESULT", json.dumps({"speeds": rows, "seconds": clock, "cpu": cpu}), flush=True)
"""


def cloud() -> DEM:
    """The grains, with their weight in the fluid."""
    dem = DEM(Packing.read(CLOUD), MATERIAL, gravity=(0.0, 0.0, -GRAVITY))
    dem.apply(np.outer(dem.masses * FLUID.density / MATERIAL.density * GRAVITY, [0.0, 0.0, 1.0]))
    return dem


def of_porefv(every: int, **options) -> dict:
    """Speeds of the grains [m/s] at each look, and seconds."""
    Coupling(cloud(), walls(), FLUID, **options).run(30)  # numba compiles, or loads what it compiled
    dem = cloud()
    begun, used = time.perf_counter(), time.process_time()
    coupling = Coupling(dem, walls(), FLUID, **options)
    rows, clock, cpu = [], time.perf_counter() - begun, time.process_time() - used
    for _ in range(LOOKS):
        begun, used = time.perf_counter(), time.process_time()
        coupling.run(every)
        clock, cpu = clock + time.perf_counter() - begun, cpu + time.process_time() - used
        rows.append(-dem.velocities[:, 2])
    return {"speeds": rows, "seconds": clock, "cpu": cpu, "meshes": coupling.effort.meshes}


def walls() -> Walls:
    """Clear fluid at the top, side walls without drag."""
    return Walls.from_mapping({"z_max": {"pressure": 0.0, "free": True}, "lateral": {"slip": True}})


def of_yade(executable: str, dem: DEM, every: int, lubrication: bool) -> dict:
    """The same by Yade."""
    given = {
        "spheres": [[*c, r] for c, r in zip(dem.positions.tolist(), dem.radii.tolist(), strict=True)],
        "lower": dem.box.lower.tolist(), "upper": dem.box.upper.tolist(), "young": MATERIAL.young,
        "viscosity": FLUID.viscosity, "gravity": GRAVITY * (1.0 - FLUID.density / MATERIAL.density), "step": dem.step,
        "every": every, "looks": LOOKS, "lubrication": lubrication,
    }  # fmt: skip
    with tempfile.TemporaryDirectory() as folder:
        (Path(folder) / "given.json").write_text(json.dumps(given), encoding="utf-8")
        (Path(folder) / "settling.py").write_text(SCRIPT, encoding="utf-8")
        environment = {key: value for key, value in os.environ.items() if key not in ("DISPLAY", "PYTHONPATH")}
        done = subprocess.run(
            [executable, "-x", "-n", "-j1", "settling.py"], cwd=folder, env=environment, capture_output=True, text=True
        )
    found = [line for line in done.stdout.splitlines() if line.startswith("RESULT ")]
    if not found:
        raise SystemExit(f"Yade failed:\n{done.stdout[-2000:]}\n{done.stderr[-2000:]}")
    return json.loads(found[0].removeprefix("RESULT "))


def print_row(name: str, runs: list[dict], steps: int, alone: float) -> None:
    """Means over the looks after the first third, of the run that took least CPU time."""
    found = min(runs, key=lambda run: run["cpu"])
    late = np.array(found["speeds"])[LOOKS // 3 :] / alone
    mean = late.mean()
    print(
        f"| {name} | {found['seconds']:.1f} | {found['cpu']:.1f} | {1e3 * found['cpu'] / steps:.2f} | {mean:.2f} | "
        f"{late.std(axis=1).mean() / mean:.2f} | {late.max() / mean:.1f} |",
        flush=True,
    )


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--yade", default="yade", help="Yade's program")
    parser.add_argument("--duration", type=float, default=1.5, help="[s]")
    parser.add_argument("--repeat", type=int, default=3, help="runs of each, of which the quickest counts")
    options = parser.parse_args()
    dem = cloud()
    every = round(options.duration / dem.step / LOOKS)
    steps = every * LOOKS
    submerged = dem.masses[0] * (1.0 - FLUID.density / MATERIAL.density) * GRAVITY
    alone = float(submerged / (6.0 * np.pi * FLUID.viscosity * dem.radii[0]))
    print(f"{len(dem.radii)} grains, {steps} steps of {dem.step:.3g} s; a grain alone sinks with {alone:.4f} m/s\n")
    columns = "", "seconds", "of CPU", "ms a step", "mean speed", "scatter / mean", "fastest / mean"
    print(f"| {' | '.join(columns)} |\n|{'---|' * len(columns)}")
    for roughness, renewal in ((0.05, 0.1), (0.02, 0.1), (0.02, 0.02)):
        runs = [
            of_porefv(every, pair_resistance=True, roughness=roughness, renewal=renewal) for _ in range(options.repeat)
        ]
        name = f"porefv, roughness {roughness:g}, `renewal` {renewal:g}, {runs[0]['meshes']} meshes"
        print_row(name, runs, steps, alone)
    if shutil.which(options.yade) is None:
        print(f"{options.yade} is not on the path: Yade is left out")
        return
    for lubrication in (True, False):
        runs = [of_yade(options.yade, dem, every, lubrication) for _ in range(options.repeat)]
        print_row(f"Yade, {'lubrication, eps 0.05' if lubrication else 'no lubrication'}", runs, steps, alone)


if __name__ == "__main__":
    main()
