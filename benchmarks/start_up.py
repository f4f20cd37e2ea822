"""How long commands take before they compute: CPU seconds of whole processes, kernels compiled before.

    python benchmarks/start_up.py [--repeat 5]

Medians of `porefv --help`, of importing porefv, of `porefv check` and of a warm `porefv solve` of 25 and of 2000
spheres; beside the last its own computation, as summary.json has it.
"""

from __future__ import annotations

import argparse
import json
import os
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path
from statistics import median

DATA = Path(__file__).resolve().parents[1] / "data"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--repeat", type=int, default=5, help="runs of each command; times are medians")
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        scenes = shutil.copytree(DATA, Path(folder) / "data", ignore=shutil.ignore_patterns("results")) / "scenes"
        commands = {
            "python -c pass": ["-c", "pass"],
            "import porefv": ["-c", "import porefv"],
            "porefv --help": ["-m", "porefv", "--help"],
            "porefv check n25.toml": ["-m", "porefv", "check", str(scenes / "n25.toml")],
            "porefv solve n25.toml": ["-m", "porefv", "solve", "--force", str(scenes / "n25.toml")],
            "porefv solve n2000.toml": ["-m", "porefv", "solve", "--force", str(scenes / "n2000.toml")],
        }
        for name, command in commands.items():
            seconds(command)  # compiles, and loads from the disk
            print(f"{name:26}{median(seconds(command) for _ in range(options.repeat)):8.2f} CPU s")
        summary = json.loads((scenes / "results" / "n2000" / "summary.json").read_text(encoding="utf-8"))
        print(f"{'  its stages':26}{summary['seconds']['total']:8.2f} s")


def seconds(command: list[str]) -> float:
    """CPU seconds, user and system, of a Python process; 0 on Windows, which does not count those of children."""
    before = os.times()
    subprocess.run([sys.executable, *command], check=True, stdout=subprocess.DEVNULL)
    after = os.times()
    return (after.children_user + after.children_system) - (before.children_user + before.children_system)


if __name__ == "__main__":
    main()
