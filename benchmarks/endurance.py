"""Memory, open files and threads of one process that computes again and again: they must not grow.

    python benchmarks/endurance.py [--times 300]

Rows are of solves of 200 spheres with all results written, then of steps of a coupled run of 200 grains with a new mesh
each. The first solve loads libraries and kernels.
"""

from __future__ import annotations

import argparse
import gc
import os
import tempfile
import threading
from collections.abc import Callable
from pathlib import Path

from porefv import results
from porefv.coupling.coupling import Coupling
from porefv.dem.dem import DEM
from porefv.dem.material import Material
from porefv.dem.plate import Plate
from porefv.flow.fluid import Fluid
from porefv.flow.pore_flow import PoreFlow
from porefv.flow.walls import Walls
from porefv.packing.packing import Packing
from porefv.system.memory import resident

PACKINGS = Path(__file__).resolve().parents[1] / "data" / "packings"


def solve(folder: Path) -> Callable[[], None]:
    """A solve, with all its results written."""
    packing = Packing.read(PACKINGS / "n200_s1.csv")

    def once() -> None:
        flow = PoreFlow(packing.with_box(packing.box), Walls.along("y"))
        results.write(flow, folder / "results", force=True)

    return once


def renew() -> Callable[[], None]:
    """A step of a coupled run that compresses the sample, and a new mesh."""
    plates = {"z_max": Plate(velocity=(0.0, 0.0, -1e-3))}
    dem = DEM(Packing.read(PACKINGS / "n200_s1.csv"), Material(young=1e6), plates)
    coupling = Coupling(dem, Walls.along("z"), Fluid(1.0))

    def once() -> None:
        coupling.run(1)
        coupling.renew_mesh()

    return once


def measure(name: str, once: Callable[[], None], times: int) -> None:
    print(f"\n{name:<10}  memory      files  threads")
    for done in range(times + 1):
        if done:
            once()
        if done in (0, 1, 10) or done % (times // 6) == 0:
            gc.collect()
            files = len(os.listdir("/proc/self/fd")) - 1
            print(f"{done:>10}  {resident() / 2**20:5.0f} MiB  {files:5}  {threading.active_count():7}", flush=True)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--times", type=int, default=300)
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        measure("solves", solve(Path(folder)), options.times)
    measure("steps", renew(), options.times)


if __name__ == "__main__":
    main()
