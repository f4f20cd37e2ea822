"""The discrete element method: time of a step, beside Yade's if it is installed; time against size; the largest step.

    python benchmarks/dem.py [--largest 1000000]

Grains are those of data/packings and their mirror images, in contact, with friction, at rest but for a little random
motion. Every run is a process of its own; the least of several runs counts, of both programs.
"""

from __future__ import annotations

import argparse
import json
import os
import shutil
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np
from scale import mirrored

from porefv.dem.dem import DEM
from porefv.dem.material import Material
from porefv.errors import ComputationError
from porefv.packing.packing import Packing

PACKINGS = Path(__file__).resolve().parents[1] / "data" / "packings"
SIZES = (2_000, 20_000, 160_000, 1_000_000)
MATERIAL = Material(young=15e6, stiffness_ratio=0.5, friction_angle=30.0, density=2600.0)

YADE = """
import json, time
import numpy as np
rows = np.loadtxt({path!r})
O.materials.append(FrictMat(young=15e6, poisson=0.5, frictionAngle=radians(30), density=2600, label="grains"))
O.materials.append(FrictMat(young=15e6, poisson=0.5, frictionAngle=0, density=0, label="walls"))
O.bodies.append(aabbWalls([(0, 0, 0), (1, 1, 1)], thickness=0, material="walls"))
O.bodies.append([sphere(row[:3], row[3], material="grains") for row in rows])
O.engines = [
    ForceResetter(),
    InsertionSortCollider([Bo1_Sphere_Aabb(), Bo1_Box_Aabb()]),
    InteractionLoop(
        [Ig2_Sphere_Sphere_ScGeom(), Ig2_Box_Sphere_ScGeom()],
        [Ip2_FrictMat_FrictMat_FrictPhys()],
        [Law2_ScGeom_FrictPhys_CundallStrack()],
    ),
    NewtonIntegrator(damping=0.0),
]
O.dt = 0.3 * PWaveTimeStep()
O.run(100, True)
best = 1e9
for _ in range(5):
    begin = time.process_time()
    O.run(200, True)
    best = min(best, (time.process_time() - begin) / 200)
print(json.dumps([best, O.interactions.countReal()]))
"""


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--largest", type=int, default=160_000, help=f"grains, of {', '.join(map(str, SIZES))}")
    parser.add_argument("--one", type=int, help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.one:
        print(json.dumps(measure(options.one)))
        return
    print("one step:")
    for grains in (5_000, *(n for n in SIZES if n <= options.largest)):
        for threads in sorted({1, os.cpu_count() or 1}):
            seconds, contacts, pairs = child(grains, threads)
            print(
                f"  {grains:>8} grains, {contacts:>8} contacts, {threads} thread(s): {1e3 * seconds:8.3f} ms, "
                f"{1e9 * seconds / grains:5.0f} ns a grain, {1e9 * pairs:5.0f} ns a grain to list pairs",
                flush=True,
            )
        if grains == 5_000 and (yade := shutil.which("yade")):
            seconds, contacts = run_yade(yade)
            print(f"  {grains:>8} grains, {contacts:>8} contacts, Yade, 1 thread: {1e3 * seconds:7.3f} ms of CPU")
    print("largest stable step, as a part of the critical one:")
    for friction in (0.0, 30.0, 60.0):
        print(f"  friction {friction:2.0f}°: {largest_step(friction):.2f}", flush=True)


def packing(grains: int) -> Packing:
    return Packing.read(PACKINGS / "n5000_s1.csv") if grains == 5_000 else mirrored(grains)


def sample(grains: int, material: Material = MATERIAL, **options) -> DEM:
    dem = DEM(packing(grains), material, **options)
    speed = 1e-6 * dem.radii.min() / dem.step
    dem.velocities = speed * np.random.default_rng(0).normal(size=(len(dem), 3))
    return dem


def measure(grains: int) -> tuple[float, int, float]:
    """Seconds of a step, contacts, seconds per grain to list pairs."""
    dem = sample(grains)
    steps = max(5, 1_000_000 // grains)
    dem.run(steps)
    best = np.inf
    for _ in range(5):
        begin = time.perf_counter()
        dem.run(steps)
        best = min(best, (time.perf_counter() - begin) / steps)
    begin = time.perf_counter()
    dem.list_pairs()
    return best, len(dem.contacts), (time.perf_counter() - begin) / grains


def child(grains: int, threads: int) -> tuple[float, int, float]:
    environment = os.environ | {"NUMBA_NUM_THREADS": str(threads)}
    command = [sys.executable, __file__, "--one", str(grains)]
    return json.loads(subprocess.run(command, env=environment, stdout=subprocess.PIPE, text=True, check=True).stdout)


def run_yade(yade: str) -> tuple[float, int]:
    """Seconds of CPU that Yade takes for a step of the 5000 grains, and its contacts."""
    grains = packing(5_000)
    with tempfile.TemporaryDirectory() as folder:
        rows, script = Path(folder) / "grains.txt", Path(folder) / "steps.py"
        np.savetxt(rows, np.column_stack([grains.centres, grains.radii]), fmt="%.17g")
        script.write_text(YADE.format(path=str(rows)), encoding="utf-8")
        done = subprocess.run([yade, "-x", "-n", str(script)], stdout=subprocess.PIPE, text=True, check=True)
    return json.loads(done.stdout.splitlines()[-1])


def largest_step(friction: float) -> float:
    """Largest part of the critical step, in hundredths, at which energy does not grow in 5000 steps."""
    low, high = 0.1, 1.0
    material = Material(MATERIAL.young, MATERIAL.stiffness_ratio, friction, MATERIAL.density)
    critical = DEM(packing(2_000), material).critical_step
    while high - low > 0.015:
        part = 0.5 * (low + high)
        dem = sample(2_000, material, step=part * critical)
        before = dem.energies.stored
        try:
            dem.run(5_000)
            low, high = (part, high) if dem.energies.stored < 2.0 * before else (low, part)
        except ComputationError:
            high = part
    return low


if __name__ == "__main__":
    main()
