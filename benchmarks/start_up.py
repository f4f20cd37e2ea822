"""How long commands take before they compute: CPU seconds of whole processes.

    python benchmarks/start_up.py [--repeat 5] [--install]

Medians, with kernels compiled before, of `porefv --help`, of importing porefv, of `porefv check` and of a warm `porefv
solve` of 25 and of 2000 spheres; beside the last its own computation, as summary.json has it. `--install` measures,
before that, what compiling takes: the build's step of its own, the first solve after `pip install .` in an environment
of its own, and the first solve in a working copy that has kept nothing.
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
from typing import Any

DATA = Path(__file__).resolve().parents[1] / "data"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--repeat", type=int, default=5, help="runs of each command; times are medians")
    parser.add_argument("--install", action="store_true", help="measure compiling, too")
    options = parser.parse_args()
    if options.install:
        compiling()
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


def compiling() -> None:
    """What compiling takes, of the build, after an installation, and in a working copy."""
    with tempfile.TemporaryDirectory() as folder:
        root, venv = Path(folder), Path(folder) / "venv"
        scenes = shutil.copytree(DATA, root / "data", ignore=shutil.ignore_patterns("results")) / "scenes"
        solve = ["-m", "porefv", "solve", "--force", str(scenes / "n2000.toml")]
        show("kernels of the build", ["-m", "porefv.system.kernel_build", str(root / "kernels")])
        subprocess.run([sys.executable, "-m", "venv", str(venv)], check=True)
        python = venv / ("Scripts" if os.name == "nt" else "bin") / "python"
        clone = root / "clone"
        subprocess.run(["git", "clone", "--quiet", str(DATA.parent), str(clone)], check=True)
        install = [str(python), "-m", "pip", "install", "--quiet", str(clone)]
        subprocess.run(install, check=True, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        show("installed, first solve", solve, python=str(python))
        show("installed, second solve", solve, python=str(python))
        show("working copy, first solve", solve, environment={"NUMBA_CACHE_DIR": str(root / "kept")})


def show(title: str, command: list[str], **options: Any) -> None:
    print(f"{title:26}{seconds(command, **options):8.2f} CPU s", flush=True)


def seconds(command: list[str], python: str = sys.executable, environment: dict[str, str] | None = None) -> float:
    """CPU seconds, user and system, of a Python process; 0 on Windows, which does not count those of children."""
    before = os.times()
    environment = os.environ | (environment or {})
    subprocess.run([python, *command], check=True, stdout=subprocess.DEVNULL, env=environment)
    after = os.times()
    return (after.children_user + after.children_system) - (before.children_user + before.children_system)


if __name__ == "__main__":
    main()
