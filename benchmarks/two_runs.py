"""Two runs of `porefv simulate --resume` on one results directory at once: one is refused, and the series is right.

    python benchmarks/two_runs.py [--pairs 40]

A run is killed at a random moment. Then two runs go on with it, the second up to 1.2 s after the first.
"""

from __future__ import annotations

import argparse
import random
import shutil
import subprocess
import sys
import time
from collections import Counter
from pathlib import Path
from tempfile import TemporaryDirectory

DATA = Path(__file__).resolve().parents[1] / "data"


def start(folder: Path) -> subprocess.Popen[str]:
    command = [sys.executable, "-m", "porefv", "simulate", "scene.toml", "--resume", "--quiet"]
    return subprocess.Popen(command, cwd=folder, stderr=subprocess.PIPE, text=True)


def outcome(folder: Path, moments: random.Random, whole: float, series: bytes) -> str:
    """What comes of two runs at once, after one that was killed."""
    shutil.rmtree(folder / "results", ignore_errors=True)
    first = start(folder)
    time.sleep(moments.uniform(0.2, 0.8) * whole)
    first.kill()
    first.communicate()
    runs = [start(folder)]
    time.sleep(moments.uniform(0.0, 1.2))
    runs.append(start(folder))
    said = [run.communicate()[1] for run in runs]
    statuses = sorted(run.returncode for run in runs)
    right = (folder / "results" / "series.csv").read_bytes() == series
    refused = any("is being written by process" in text for text in said)
    what = {(0, 0): "one after the other", (0, 2): "one refused" if refused else f"{said}"}
    return f"{what.get(tuple(statuses), statuses)}; the series is {'right' if right else 'WRONG'}"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--pairs", type=int, default=40)
    options = parser.parse_args()
    moments = random.Random(1)
    with TemporaryDirectory() as name:
        folder = Path(name)
        scene = (DATA / "scenes" / "oedometer.toml").read_text(encoding="utf-8")
        scene = scene.replace("../packings", str(DATA / "packings")).replace('"results/oedometer"', '"results"')
        (folder / "scene.toml").write_text(scene + "\n[checkpoint]\nsteps = 500\n", encoding="utf-8")
        start(folder).communicate()
        shutil.rmtree(folder / "results")
        begin = time.perf_counter()
        start(folder).communicate()
        whole, series = time.perf_counter() - begin, (folder / "results" / "series.csv").read_bytes()
        counts = Counter(outcome(folder, moments, whole, series) for _ in range(options.pairs))
    print(f"{options.pairs} pairs of runs of {whole:.1f} s")
    for what, count in counts.most_common():
        print(f"{count:5}  {what}")


if __name__ == "__main__":
    main()
