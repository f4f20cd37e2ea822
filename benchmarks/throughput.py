"""Packing to forces: this version beside another checkout of porefv, and beside Yade, where it is installed.

    python benchmarks/throughput.py [--before CHECKOUT] [--repeat 7] [--copies 1] [--no-yade]

Each line is the median of runs in processes that take turns, with kernels loaded before the clock starts; the last
column is the ratio of the totals. `--copies 2` makes 160 000 spheres of eight times the packing of 20 000.
"""

from __future__ import annotations

import argparse
import json
import os
import shutil
import subprocess
import sys
from pathlib import Path
from statistics import median

ROOT = Path(__file__).resolve().parents[1]
STAGES = ("triangulation", "throats", "pressure", "forces")

CHILD = """
import json, sys, time
import numpy as np
from porefv import Box, HydraulicRadius, Packing, PoreFlow, PoreMesh, Walls

path, copies, model, times = sys.argv[1], int(sys.argv[2]), sys.argv[3], int(sys.argv[4])
packing = Packing.read(path)
if copies > 1:
    size = packing.box.upper - packing.box.lower
    steps = np.stack(np.meshgrid(*[np.arange(copies)] * 3, indexing="ij"), axis=-1).reshape(-1, 3)
    centres = np.concatenate([packing.centres + step * size for step in steps])
    upper = packing.box.lower + copies * size
    packing = Packing(centres, np.tile(packing.radii, len(steps)), Box(packing.box.lower, upper))
conductance = HydraulicRadius() if model == "hydraulic-radius" else None
found = []
for _ in range(times + 1):
    clock = [time.perf_counter()]
    mesh = PoreMesh(packing)
    mesh.cells
    clock.append(time.perf_counter())
    flow = PoreFlow(mesh, Walls.along("y"), conductance=conductance)
    flow.conductances
    clock.append(time.perf_counter())
    flow.pressure
    clock.append(time.perf_counter())
    flow.forces
    clock.append(time.perf_counter())
    found.append(np.diff(clock).tolist())
print(json.dumps([np.median(found[1:], axis=0).tolist(), flow.permeability]))
"""


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--before", type=Path, help="another checkout")
    parser.add_argument("--repeat", type=int, default=7, help="processes of each kind")
    parser.add_argument("--copies", type=int, default=1, help="of the packing along each axis")
    parser.add_argument("--no-yade", action="store_true", help="do not run Yade")
    options = parser.parse_args()
    versions = {"before": options.before, "now": ROOT} if options.before else {"now": ROOT}
    print(f"{'seconds':34}" + "".join(f"{stage:>14}" for stage in STAGES) + f"{'all':>9}{'ratio':>8}")
    totals = {}
    for model in ("section-friction", "hydraulic-radius"):
        for threads in (1, 2):
            runs = {name: [] for name in versions}
            for _ in range(options.repeat):
                for name, checkout in versions.items():
                    runs[name].append(child(checkout, threads, model, options.copies))
            for name, found in runs.items():
                stages = [median(run[stage] for run in found) for stage in range(len(STAGES))]
                totals[name, model, threads] = total = median(sum(run) for run in found)
                ratio = totals.get(("before", model, threads), total) / total
                title = f"{name}, {model}, {threads} thread{'s' * (threads > 1)}"
                print(f"{title:34}" + "".join(f"{s:14.3f}" for s in stages) + f"{total:9.3f}{ratio:8.2f}", flush=True)
    if not options.no_yade and shutil.which("yade"):
        beside_yade(options.copies, options.repeat, totals)


def child(checkout: Path, threads: int, model: str, copies: int) -> list[float]:
    """Seconds of each stage, the median of five in one process (two of many spheres)."""
    environment = os.environ | {"PYTHONPATH": str(checkout / "src"), "NUMBA_NUM_THREADS": str(threads)}
    packing = ROOT / "data" / "packings" / "n20000_s1.csv"
    command = [sys.executable, "-c", CHILD, str(packing), str(copies), model, "5" if copies == 1 else "2"]
    done = subprocess.run(command, env=environment, check=True, capture_output=True, text=True)
    return json.loads(done.stdout)[0]


def beside_yade(copies: int, repeat: int, totals: dict) -> None:
    """The first step of Yade's FlowEngine, which does the work of the hydraulic radius."""
    import numpy as np
    from yade_flow import run_yade

    from porefv import Box, Packing

    packing = Packing.read(ROOT / "data" / "packings" / "n20000_s1.csv")
    steps = np.stack(np.meshgrid(*[np.arange(copies)] * 3, indexing="ij"), axis=-1).reshape(-1, 3)
    size = packing.box.upper - packing.box.lower
    many = Packing(
        np.concatenate([packing.centres + step * size for step in steps]),
        np.tile(packing.radii, len(steps)),
        Box(packing.box.lower, packing.box.lower + copies * size),
    )
    seconds = median(run_yade("yade", many, 1e-3) for _ in range(min(repeat, 3)))
    print(f"Yade, first step: {seconds:.2f} s")
    for (name, model, threads), total in totals.items():
        if name == "now":
            print(f"  {seconds / total:5.1f} times {model}, {threads} thread{'s' * (threads > 1)}")


if __name__ == "__main__":
    main()
