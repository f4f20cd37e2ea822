"""Seconds and size of each results file, at scale, and seconds to read tables of forces back.

python benchmarks/output.py [SPHERES]
"""

from __future__ import annotations

import sys
import tempfile
import time
from importlib.util import find_spec
from pathlib import Path

from scale import mirrored

from porefv import results
from porefv.conductance.hydraulic_radius import HydraulicRadius
from porefv.flow.fluid import Fluid
from porefv.flow.pore_flow import PoreFlow
from porefv.flow.walls import Walls
from porefv.system.tables import TABLE_FORMATS


def main() -> None:
    spheres = int(sys.argv[1]) if len(sys.argv) > 1 else 160_000
    flow = PoreFlow(mirrored(spheres), Walls.along("y"), Fluid(1.0), HydraulicRadius())
    _ = flow.forces, flow.pore_velocity, flow.mesh.pore_volumes
    tables = [table_format for table_format in TABLE_FORMATS if table_format != "parquet" or find_spec("pyarrow")]
    print(f"{spheres} spheres       written       size  read back")
    measure("summary.json", flow, quantities=["permeability"], vtk=False)
    for table_format in tables:
        measure(f"forces.{table_format}", flow, quantities=["forces"], vtk=False, table_format=table_format)
    measure("VTK files", flow, quantities=results.QUANTITIES, vtk=True, table_format="npy")


def measure(name: str, flow: PoreFlow, **asked: object) -> None:
    """Print a row: files are written with what `asked` says, and read back if they are tables."""
    with tempfile.TemporaryDirectory() as folder:
        begin = time.perf_counter()
        directory = results.write(flow, Path(folder) / "results", **asked)
        written = time.perf_counter() - begin
        size = sum(file.stat().st_size for file in directory.iterdir()) / 2**20
        row = f"{name:<16} {written:10.1f} s {size:6.0f} MiB"
        if name.startswith("forces"):
            begin = time.perf_counter()
            _ = results.read(directory).forces
            row += f" {time.perf_counter() - begin:8.1f} s"
    print(row, flush=True)


if __name__ == "__main__":
    main()
