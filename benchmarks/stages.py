"""How long each stage takes, everything asked; beside it Yade's FlowEngine on the same packings, if installed.

    python benchmarks/stages.py [--repeat 3] [--no-yade] [SCENE.toml ...]

Kernels are compiled and loaded before the clock starts. Times are medians, and comparisons are ratios within one run:
machines differ. Yade (https://yade-dem.org) is used as the executable `yade`, if there is one on the PATH. Its first
step triangulates, computes conductances, solves and sums up forces: the same as "triangulation to forces" here.
"""

from __future__ import annotations

import argparse
import shutil
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from statistics import median

from yade_flow import run_yade

from porefv.scenes.flow_scene import FlowScene
from porefv.system.progress import Progress

SCENES = Path(__file__).resolve().parents[1] / "data" / "scenes"
STEP = ("triangulation", "throats", "pressure", "forces")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("scenes", nargs="*", type=Path, default=[SCENES / "n2000.toml", SCENES / "n20000.toml"])
    parser.add_argument("--repeat", type=int, default=3, help="runs of each scene; times are medians")
    parser.add_argument("--no-yade", action="store_true", help="do not run Yade")
    options = parser.parse_args()
    yade = None if options.no_yade else shutil.which("yade")

    stages(FlowScene.read(options.scenes[0]))  # compiles, loads
    columns = {}
    for path in options.scenes:
        scene = FlowScene.read(path)
        runs = [stages(scene) for _ in range(options.repeat)]
        rows = {name: median(run[name] for run in runs) for name in runs[0]}
        rows["all stages"] = median(sum(run.values()) for run in runs)
        rows["triangulation to forces"] = median(sum(run.get(stage, 0.0) for stage in STEP) for run in runs)
        rows["command porefv solve"] = median(command(scene) for _ in range(options.repeat))
        if yade and scene.walls.axis == 1:
            packing, viscosity = scene.read_packing(), scene.fluid.viscosity
            rows["Yade, first step"] = median(run_yade(yade, packing, viscosity) for _ in range(options.repeat))
            rows["  times ours"] = rows["Yade, first step"] / rows["triangulation to forces"]
        columns[path.stem] = rows
    report(columns)


def stages(scene: FlowScene) -> dict[str, float]:
    """Seconds of each stage, reading and writing included."""
    progress = Progress(quiet=True)
    with tempfile.TemporaryDirectory() as folder:
        output = scene.output.model_copy(update={"directory": Path(folder) / "results"})
        scene.model_copy(update={"output": output}).solve(progress=progress)
    return progress.seconds


def command(scene: FlowScene) -> float:
    """Seconds of the command line, from its start to its end."""
    assert scene.path is not None
    with tempfile.TemporaryDirectory() as folder:
        data = Path(folder) / "data"
        shutil.copytree(scene.path.parents[1], data, ignore=shutil.ignore_patterns("results"))
        arguments = ["solve", "--quiet", str(data / "scenes" / scene.path.name)]
        begin = time.perf_counter()
        subprocess.run([sys.executable, "-m", "porefv", *arguments], check=True)
        return time.perf_counter() - begin


def report(columns: dict[str, dict[str, float]]) -> None:
    names = dict.fromkeys(name for rows in columns.values() for name in rows)
    print(f"{'seconds':26}" + "".join(f"{title:>12}" for title in columns))
    for name in names:
        print(f"{name:26}" + "".join(f"{rows.get(name, float('nan')):12.3f}" for rows in columns.values()))


if __name__ == "__main__":
    main()
