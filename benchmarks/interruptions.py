"""Ctrl-C, SIGTERM or a kill at any moment of `porefv solve`: how it ends, and what the next command finds.

    python benchmarks/interruptions.py [--times 400] [--signal INT|TERM|KILL]

Each run is interrupted at a random moment of the time that a whole one takes. It must end by itself, with a status that
says so, and leave the whole of its results or nothing. After a kill, the next command does.
"""

from __future__ import annotations

import argparse
import os
import random
import shutil
import signal
import subprocess
import sys
import time
from collections import Counter
from pathlib import Path
from tempfile import TemporaryDirectory

DATA = Path(__file__).resolve().parents[1] / "data"
ENDS = {
    0: "done",
    130: "interrupted, in a line",
    143: "terminated, in a line",
    -signal.SIGINT: "interrupted as Python starts or ends",
    -signal.SIGTERM: "terminated as Python starts or ends",
    -signal.SIGKILL: "killed",
}


def start(folder: Path) -> subprocess.Popen[bytes]:
    """`porefv solve` in a folder; without a terminal, Ctrl-C would be ignored if it is here."""
    return subprocess.Popen(
        [sys.executable, "-m", "porefv", "solve", "scene.toml", "--force", "--quiet"],
        cwd=folder, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, env={**os.environ, "PYTHONFAULTHANDLER": "1"},
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.default_int_handler),
    )  # fmt: skip


def interrupted(folder: Path, after: float, number: signal.Signals) -> tuple[str, str]:
    """How a run ends that is interrupted after some seconds, and what it leaves; after a kill, with the next run."""
    process = start(folder)
    time.sleep(after)
    process.send_signal(number)
    try:
        said = process.communicate(timeout=60)[1].decode()
    except subprocess.TimeoutExpired:
        process.kill()
        return "does not end", ""
    end = ENDS.get(process.returncode, f"status {process.returncode}: {said.strip()[:80]!r}")
    if number == signal.SIGKILL:
        found = subprocess.run([sys.executable, "-m", "porefv", "info", "results"], cwd=folder, capture_output=True)
        if (found.returncode == 0) != (folder / "results").is_dir():
            return end, "results that are not found"
        start(folder).communicate()
    names = sorted(path.name for path in folder.iterdir() if path.name != "scene.toml")
    whole = (folder / "results").is_dir() and len(list((folder / "results").iterdir())) == 5
    left = "nothing" if not names else "whole results" if whole and names == ["results"] else f"{names}"
    return end, left


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--times", type=int, default=400)
    parser.add_argument("--signal", choices=["INT", "TERM", "KILL"], default="INT")
    options = parser.parse_args()
    number = signal.Signals[f"SIG{options.signal}"]
    moments = random.Random(1)
    counts: Counter[tuple[str, str]] = Counter()
    with TemporaryDirectory() as name:
        folder = Path(name)
        scene = (DATA / "scenes" / "n2000.toml").read_text(encoding="utf-8")
        scene = scene.replace("../packings", str(DATA / "packings")).replace("results/n2000", "results")
        (folder / "scene.toml").write_text(scene, encoding="utf-8")
        for _ in range(2):  # the first may compile
            begin = time.perf_counter()
            start(folder).communicate()
            whole = time.perf_counter() - begin
        for _ in range(options.times):
            shutil.rmtree(folder / "results", ignore_errors=True)
            counts[interrupted(folder, moments.uniform(0.0, whole), number)] += 1
    print(f"{options.times} runs of {whole:.1f} s, with SIG{options.signal}")
    for (end, left), count in counts.most_common():
        print(f"{count:5}  {end}; leaves {left}")


if __name__ == "__main__":
    main()
