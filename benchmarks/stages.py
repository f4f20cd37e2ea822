"""How long each stage takes, everything asked; beside it Yade's FlowEngine on the same packings, if installed.

    python benchmarks/stages.py [--repeat 3] [--no-yade] [SCENE.toml ...]

Kernels are compiled and loaded before the clock starts. Times are medians, and comparisons are ratios within one run:
machines differ. Yade (https://yade-dem.org) is used as the executable `yade`, if there is one on the PATH. Its first
step triangulates, computes conductances, solves and sums up forces: the same as "triangulation to forces" here.
"""

from __future__ import annotations

import argparse
import dataclasses
import json
import os
import shutil
import statistics
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from porefv.progress import Progress
from porefv.scene import Scene

SCENES = Path(__file__).resolve().parents[1] / "data" / "scenes"
STEP = ("triangulation", "throats", "pressure", "forces")

# Read by Yade's own Python, with the numbers of a scene as `given`.
YADE_SCRIPT = """
import json, time, numpy, yade
from yade import utils
given = json.loads({given!r})
x = numpy.array(given["spheres"])
O.materials.append(FrictMat(young=1e6, poisson=0.5, frictionAngle=0.0, density=2600.0))
O.bodies.append(utils.aabbWalls([given["lower"], given["upper"]], thickness=0))
O.bodies.append([utils.sphere(c, r) for c, r in zip(x[:, :3].tolist(), x[:, 3].tolist())])
flow = FlowEngine(
    useSolver=3, viscosity=given["viscosity"], permeabilityFactor=1, clampKValues=False, slipBoundary=False,
    bndCondIsPressure=given["held"], bndCondValue=given["pressures"], boundaryUseMaxMin=[0] * 6,
)
O.engines = [flow]
O.dt = 1e-9
begin = time.perf_counter()
flow.emulateAction()
step = time.perf_counter() - begin
begin = time.perf_counter()
flow.saveVtk(given["directory"], False)
writing = time.perf_counter() - begin
print("RESULT", json.dumps([step, writing, abs(flow.getBoundaryFlux(given["inlet"]))]), flush=True)
"""


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("scenes", nargs="*", type=Path, default=[SCENES / "n2000.toml", SCENES / "n20000.toml"])
    parser.add_argument("--repeat", type=int, default=3, help="runs of each scene; times are medians")
    parser.add_argument("--no-yade", action="store_true", help="do not run Yade")
    options = parser.parse_args()
    yade = None if options.no_yade else shutil.which("yade")

    run(Scene.read(options.scenes[0]))  # compiles, loads
    columns = {}
    for path in options.scenes:
        scene = Scene.read(path)
        rows, flux = median([run(scene) for _ in range(options.repeat)])
        rows["all stages"] = sum(rows.values())
        rows["triangulation to forces"] = sum(rows[stage] for stage in STEP)
        rows["command porefv solve"] = statistics.median(command(scene) for _ in range(options.repeat))
        if yade:
            theirs, their_flux = median([run_yade(yade, scene) for _ in range(options.repeat)])
            rows.update(theirs)
            rows["Yade's step / ours"] = theirs["Yade: first step"] / rows["triangulation to forces"]
            rows["Yade's flux / ours"] = their_flux / flux
        columns[path.stem] = rows
    report(columns)
    if not yade and not options.no_yade:
        print("\nYade is not installed (no executable `yade` on the PATH): not compared")


def run(scene: Scene) -> tuple[dict[str, float], float]:
    """Seconds of each stage, and the flux through the sample."""
    with tempfile.TemporaryDirectory() as folder:
        progress = Progress(quiet=True)
        directory = elsewhere(scene, folder).solve(progress=progress)
        summary = json.loads((directory / "summary.json").read_text(encoding="utf-8"))
    return progress.seconds, summary["flow"]["inflow"]


def command(scene: Scene) -> float:
    """Seconds of the command line, imports included."""
    with tempfile.TemporaryDirectory() as folder:
        copy = Path(folder) / "data" / "scenes" / scene.path.name
        shutil.copytree(scene.path.parents[1], copy.parents[1], ignore=shutil.ignore_patterns("results"))
        begin = time.perf_counter()
        subprocess.run([sys.executable, "-m", "porefv", "solve", "--quiet", copy], check=True)
        return time.perf_counter() - begin


def run_yade(executable: str, scene: Scene) -> tuple[dict[str, float], float]:
    """Seconds of FlowEngine's first step and of writing its VTK file, and the flux."""
    packing = scene.read_packing()
    pressures = scene.walls.pressures
    held = [bool(p == p) for p in pressures]
    with tempfile.TemporaryDirectory() as folder:
        given = {
            "spheres": [[*c, r] for c, r in zip(packing.centres.tolist(), packing.radii.tolist(), strict=True)],
            "lower": packing.box.lower.tolist(),
            "upper": packing.box.upper.tolist(),
            "viscosity": scene.fluid.viscosity,
            "held": held,
            "pressures": [float(p) if h else 0.0 for p, h in zip(pressures, held, strict=True)],
            "inlet": held.index(True),
            "directory": folder,
        }
        script = Path(folder) / "flow.py"
        script.write_text(YADE_SCRIPT.format(given=json.dumps(given)), encoding="utf-8")
        # Yade writes where it stands, and needs no display.
        environment = {key: value for key, value in os.environ.items() if key not in ("DISPLAY", "PYTHONPATH")}
        done = subprocess.run(
            [executable, "-x", "-n", script], cwd=folder, env=environment, capture_output=True, text=True
        )
    found = [line for line in done.stdout.splitlines() if line.startswith("RESULT ")]
    if not found:
        raise SystemExit(f"Yade failed:\n{done.stdout[-2000:]}\n{done.stderr[-2000:]}")
    step, writing, flux = json.loads(found[0].removeprefix("RESULT "))
    return {"Yade: first step": step, "Yade: writing VTK": writing}, flux


def elsewhere(scene: Scene, folder: str) -> Scene:
    """The scene with its results in another folder."""
    return dataclasses.replace(scene, output=dataclasses.replace(scene.output, directory=Path(folder) / "results"))


def median(runs: list[tuple[dict[str, float], float]]) -> tuple[dict[str, float], float]:
    """Median of each row; the flux is the same in all."""
    rows = {name: statistics.median(seconds[name] for seconds, _ in runs) for name in runs[0][0]}
    return rows, runs[0][1]


def report(columns: dict[str, dict[str, float]]) -> None:
    names = list(dict.fromkeys(name for rows in columns.values() for name in rows))
    print(f"{'seconds':26}" + "".join(f"{title:>12}" for title in columns))
    for name in names:
        print(f"{name:26}" + "".join(f"{rows.get(name, float('nan')):12.3f}" for rows in columns.values()))


if __name__ == "__main__":
    main()
