"""Runs Yade's FlowEngine on a packing, as a program of its own, for the benchmarks to compare with."""

from __future__ import annotations

import json
import os
import subprocess
import tempfile
from pathlib import Path

from porefv.packing.packing import Packing

# Read by Yade's own Python; the spheres stand in a file beside it.
SCRIPT = """
import json, time
from yade import utils
given = json.load(open("given.json"))
O.materials.append(FrictMat(young=1e6, poisson=0.5, frictionAngle=0.0, density=2600.0))
O.bodies.append(utils.aabbWalls([given["lower"], given["upper"]], thickness=0))
O.bodies.append([utils.sphere(x[:3], x[3]) for x in given["spheres"]])
flow = FlowEngine(
    useSolver=3, viscosity=given["viscosity"], permeabilityFactor=1, clampKValues=False, slipBoundary=False,
    bndCondIsPressure=[0, 0, 1, 1, 0, 0], bndCondValue=[0, 0, 1, 0, 0, 0], boundaryUseMaxMin=[0] * 6,
)
O.engines = [flow]
O.dt = 1e-9
begin = time.perf_counter()
flow.emulateAction()
print("RESULT", time.perf_counter() - begin, flush=True)
"""


def run_yade(executable: str, packing: Packing, viscosity: float) -> float:
    """Seconds of FlowEngine's first step: triangulation, conductances, pressure along y, forces."""
    assert packing.box is not None
    given = {
        "spheres": [[*c, r] for c, r in zip(packing.centres.tolist(), packing.radii.tolist(), strict=True)],
        "lower": packing.box.lower.tolist(),
        "upper": packing.box.upper.tolist(),
        "viscosity": viscosity,
    }
    with tempfile.TemporaryDirectory() as folder:
        (Path(folder) / "given.json").write_text(json.dumps(given), encoding="utf-8")
        (Path(folder) / "flow.py").write_text(SCRIPT, encoding="utf-8")
        environment = {key: value for key, value in os.environ.items() if key not in ("DISPLAY", "PYTHONPATH")}
        done = subprocess.run(
            [executable, "-x", "-n", "flow.py"], cwd=folder, env=environment, capture_output=True, text=True
        )
    found = [line for line in done.stdout.splitlines() if line.startswith("RESULT ")]
    if not found:
        raise SystemExit(f"Yade failed:\n{done.stdout[-2000:]}\n{done.stderr[-2000:]}")
    return float(found[0].removeprefix("RESULT "))
