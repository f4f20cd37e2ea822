"""Time and memory against the number of grains, from packing arrays to forces; beside it Yade, if installed.

    python benchmarks/scale.py [--out scale.png] [--yade-limit 160000] [SPHERES ...]

Packings are n2000_s1 and n20000_s1 of data/packings and mirror images of the latter side by side. Every run is a
process of its own, with compiled kernels loaded before the clock starts, on one thread and on all. Yade runs its
FlowEngine (CHOLMOD, one thread) on the same spheres in the same minute: compare ratios, machines differ. Of small
packings the quickest of several runs counts, of both.
"""

from __future__ import annotations

import argparse
import json
import os
import shutil
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
from yade_flow import run_yade

from porefv.conductance.registry import conductance_model
from porefv.export.picture_style import PictureSize, new_figure, style
from porefv.flow.fluid import Fluid
from porefv.flow.pore_flow import PoreFlow
from porefv.flow.walls import Walls
from porefv.mesh.pore_mesh import PoreMesh
from porefv.packing.box import Box
from porefv.packing.packing import Packing
from porefv.system import memory

PACKINGS = Path(__file__).resolve().parents[1] / "data" / "packings"
REPEATS = {2_000: 5, 20_000: 5, 160_000: 2, 1_000_000: 1}
TILES = {2_000: (1, 1, 1), 20_000: (1, 1, 1), 160_000: (2, 2, 2), 1_000_000: (5, 5, 2)}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("spheres", nargs="*", type=int, default=list(TILES), help=f"of {', '.join(map(str, TILES))}")
    parser.add_argument("--out", type=Path, help="write a log-log plot here")
    parser.add_argument("--yade-limit", type=int, default=160_000, help="largest packing given to Yade; 0: none")
    parser.add_argument("--conductance", default="auto", help="hydraulic-radius is Yade's model")
    parser.add_argument("--one", action="store_true", help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.one:
        print(json.dumps(measure(options.spheres[0], options.conductance)))
        return
    yade = shutil.which("yade")
    rows = []
    for spheres in options.spheres:
        counts = sorted({1, os.cpu_count() or 1})
        ours = {threads: child(spheres, threads, options.conductance) for threads in counts}
        rows.append({"spheres": spheres, "ours": ours})
        if yade and spheres <= options.yade_limit:
            repeats = 1 + REPEATS[spheres] // 3
            rows[-1]["yade"] = min(run_yade(yade, mirrored(spheres), viscosity=1.0) for _ in range(repeats))
        report(rows[-1])
    if options.out:
        plot(rows, options.out)


def mirrored(spheres: int) -> Packing:
    """So many spheres: mirror images of a packing, side by side."""
    tiles = TILES[spheres]
    packing = Packing.read(PACKINGS / ("n2000_s1.csv" if spheres == 2_000 else "n20000_s1.csv"))
    copies = []
    for tile in np.ndindex(tiles):
        odd = np.array(tile) % 2 == 1
        copies.append(np.where(odd, 1.0 - packing.centres, packing.centres) + tile)
    centres = np.concatenate(copies)
    return Packing(centres, np.tile(packing.radii, len(copies)), Box(np.zeros(3), np.array(tiles, float)))


def measure(spheres: int, conductance: str) -> dict:
    """Seconds of each stage, and what was computed."""
    run(mirrored(2_000), conductance)  # loads the compiled kernels
    before = peak()
    seconds, flow = min(
        (run(mirrored(spheres), conductance) for _ in range(REPEATS[spheres])), key=lambda run: run[0]["total"]
    )
    report = flow.solver_report
    return {
        "seconds": seconds,
        "pores": flow.mesh.n_pores,
        "peak_MiB": peak(),
        "loaded_MiB": before,
        "permeability": flow.permeability,
        "iterations": report.iterations,
        "imbalance": report.imbalance,
        "force_balance": flow.forces.conservation_residual,
    }


def run(packing: Packing, conductance: str) -> tuple[dict[str, float], PoreFlow]:
    """Validation to forces, stage by stage."""
    seconds = {}
    mesh = None
    for stage in ("validation", "triangulation", "pores", "throats", "pressure", "forces"):
        begin = time.perf_counter()
        if stage == "validation":
            mesh = PoreMesh(packing)
            flow = PoreFlow(mesh, Walls.along("y"), Fluid(1.0), conductance_model(conductance), solver="cg")
        elif stage == "triangulation":
            _ = mesh.triangulation
        elif stage == "pores":
            _ = mesh.facets.cells, mesh.cell_pore
        elif stage == "throats":
            _ = flow.conductances
        elif stage == "pressure":
            _ = flow.solution
        else:
            _ = flow.forces
        seconds[stage] = time.perf_counter() - begin
    seconds["total"] = sum(seconds.values())
    return seconds, flow


def peak() -> int:
    """Largest resident size of this process so far [MiB]; 0 where the system does not say."""
    return (memory.peak_resident() or 0) // 2**20


def child(spheres: int, threads: int, conductance: str) -> dict:
    """`measure` in a process of its own."""
    environment = os.environ | {"NUMBA_NUM_THREADS": str(threads), "OPENBLAS_NUM_THREADS": str(threads)}
    command = [sys.executable, __file__, "--one", str(spheres), "--conductance", conductance]
    done = subprocess.run(command, env=environment, stdout=subprocess.PIPE, text=True, check=True)
    return json.loads(done.stdout)


def report(row: dict) -> None:
    for threads, ours in row["ours"].items():
        stages = ", ".join(f"{name} {value:.2f}" for name, value in ours["seconds"].items() if name != "total")
        print(
            f"{row['spheres']:>9} spheres, {ours['pores']:>8} pores, {threads} thread(s): "
            f"{ours['seconds']['total']:7.2f} s, {1e6 * ours['seconds']['total'] / row['spheres']:5.1f} µs a sphere, "
            f"{ours['peak_MiB']} MiB, {ours['iterations']} iterations, imbalance {ours['imbalance']:.0e}"
        )
        print(f"          {stages}")
    if "yade" in row:
        ratios = " and ".join(f"{row['yade'] / ours['seconds']['total']:.1f}" for ours in row["ours"].values())
        print(f"          Yade {row['yade']:.2f} s: {ratios} times as long")
    print(flush=True)


@style()
def plot(rows: list[dict], path: Path) -> None:
    figure = new_figure(PictureSize(1200, 900), layout="constrained")
    axes = figure.subplots()
    for threads in rows[0]["ours"]:
        axes.loglog(
            [row["spheres"] for row in rows],
            [row["ours"][threads]["seconds"]["total"] for row in rows],
            "o-", label=f"porefv, {threads} thread" + ("s" if threads > 1 else ""),
        )  # fmt: skip
    theirs = [row for row in rows if "yade" in row]
    if theirs:
        axes.loglog([row["spheres"] for row in theirs], [row["yade"] for row in theirs], "s-", label="Yade FlowEngine")
    axes.set(xlabel="spheres", ylabel="seconds, packing to forces")
    axes.grid(True, which="both", alpha=0.3)
    axes.legend()
    figure.savefig(path)


if __name__ == "__main__":
    main()
