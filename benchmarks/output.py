"""Seconds and size of each results file, at scale.

python benchmarks/output.py [SPHERES]
"""

from __future__ import annotations

import sys
import tempfile
import time
from pathlib import Path

from scale import mirrored

from porefv import results
from porefv.conductance.hydraulic_radius import HydraulicRadius
from porefv.flow.fluid import Fluid
from porefv.flow.pore_flow import PoreFlow
from porefv.flow.walls import Walls


def main() -> None:
    spheres = int(sys.argv[1]) if len(sys.argv) > 1 else 160_000
    flow = PoreFlow(mirrored(spheres), Walls.along("y"), Fluid(1.0), HydraulicRadius())
    _ = flow.forces, flow.pore_velocity, flow.mesh.pore_volumes
    with tempfile.TemporaryDirectory() as folder:
        for name, asked in (
            ("summary.json", {"quantities": ("permeability", "pressure"), "vtk": False}),
            ("and forces.csv", {"vtk": False}),
            ("and VTK files", {"vtk": True}),
        ):
            begin = time.perf_counter()
            directory = results.write(flow, Path(folder) / name, **asked)
            seconds = time.perf_counter() - begin
            size = sum(file.stat().st_size for file in directory.iterdir()) / 2**20
            print(f"{spheres} spheres, {name:<15} {seconds:6.1f} s, {size:6.0f} MiB", flush=True)


if __name__ == "__main__":
    main()
