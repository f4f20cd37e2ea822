"""Two threads on a machine that others use too: other busy processes, or one processor alone.

    python benchmarks/busy_machine.py [--runs 5]

For every number of other processes, runs with all threads and with one take turns. A figure is the wall time of a stage
with all threads over the median with one, in the same situation: the largest of the runs. On Linux the last line holds
the process on one processor (as `taskset -c 0` does), beside which another process is busy or not.
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
import time
from contextlib import contextmanager
from statistics import median

from throughput import CHILD, ROOT, STAGES


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--runs", type=int, default=5)
    options = parser.parse_args()
    print(f"{'all threads over one, largest of ' + str(options.runs):44}" + "".join(f"{s:>14}" for s in STAGES))
    for others in (0, 1, 2):
        with busy(others):
            show(f"{others} other busy process{'es' * (others != 1)}", options.runs, None)
    if hasattr(os, "sched_setaffinity"):
        one = min(os.sched_getaffinity(0))
        show("one processor", options.runs, one)
        with busy(1, one):
            show("one processor, busy", options.runs, one)


def show(title: str, runs: int, processor: int | None) -> None:
    found = {1: [], 64: []}  # no machine has so many processors to spare: all there are
    for _ in range(runs):
        for threads, times in found.items():
            times.append(child(threads, processor))
    ratios = [
        max(run[stage] for run in found[64]) / median(run[stage] for run in found[1]) for stage in range(len(STAGES))
    ]
    print(f"{title:44}" + "".join(f"{ratio:14.2f}" for ratio in ratios), flush=True)


def child(threads: int, processor: int | None) -> list[float]:
    environment = os.environ | {"PYTHONPATH": str(ROOT / "src"), "NUMBA_NUM_THREADS": str(threads)}
    packing = ROOT / "data" / "packings" / "n20000_s1.csv"
    command = [sys.executable, "-c", CHILD, str(packing), "1", "section-friction", "1"]
    if processor is not None:
        command = ["taskset", "-c", str(processor), *command]
    done = subprocess.run(command, env=environment, check=True, capture_output=True, text=True)
    return json.loads(done.stdout)[0]


@contextmanager
def busy(count: int, processor: int | None = None):
    """So many processes that compute all the time."""
    command = [sys.executable, "-c", "while True: pass"]
    if processor is not None:
        command = ["taskset", "-c", str(processor), *command]
    processes = [subprocess.Popen(command) for _ in range(count)]
    time.sleep(0.2)
    try:
        yield
    finally:
        for process in processes:
            process.kill()
            process.wait()


if __name__ == "__main__":
    main()
