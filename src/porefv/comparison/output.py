"""A comparison of methods as a table of text, and as files: CSV, JSON and a picture."""

from __future__ import annotations

import csv
import json
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from porefv.comparison.comparison import MethodComparison
from porefv.export.picture_style import PictureSize, new_figure, style

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def table(found: MethodComparison) -> str:
    """The comparison as text."""
    width = max(len(result.method.name) for result in found.results)
    resolved = found.reference.method.conductance is None
    origin = "the resolved flow" if resolved else f"{found.reference.method.name}, as there is no resolved flow"
    lines = [
        f"{'':{width}}  {'permeability':>12}  {'error':>8}  {'forces, rms':>11}  {'time':>9}  {'memory':>8}",
    ]
    for result in found.results:
        permeability, forces = found.errors(result)
        reference = result is found.reference
        lines.append(
            f"{result.method.name:{width}}  {result.permeability:>12.5g}  "
            f"{'-' if reference or np.isnan(permeability) else f'{100 * permeability:+.2g} %':>8}  "
            f"{'-' if reference else f'{100 * forces:.2g} %':>11}  {_time(result.seconds):>9}  "
            f"{_memory(result.memory):>8}{'  *' if found.is_best(result) else ''}"
        )
    lines.append(f"Errors are distances from {origin}. * No other method has better forces in less time.")
    return "\n".join(lines)


def _memory(size: float) -> str:
    return "-" if np.isnan(size) else f"{size / 2**20:.0f} MB"


def _time(seconds: float) -> str:
    return f"{1e3 * seconds:.3g} ms" if seconds < 1.0 else f"{seconds:.3g} s"


def save(found: MethodComparison, folder: Path) -> None:
    """Write trade.csv, trade.png and summary.json in a directory."""
    with (folder / "trade.csv").open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file)
        writer.writerow(["method", "permeability_m2", "permeability_error", "forces_error", "seconds", "memory_bytes"])
        for result in found.results:
            errors = found.errors(result)
            writer.writerow([result.method.name, result.permeability, *errors, result.seconds, result.memory])
    summary = {"kind": "trade", "reference": found.reference.method.name}
    (folder / "summary.json").write_text(json.dumps(summary, indent=2), encoding="utf-8")
    draw(found, folder / "trade.png")


def draw(found: MethodComparison, path: Path) -> None:
    """Draw the error of the forces against time and against memory, the Pareto front joined."""
    with style():
        figure = _errors_picture(found)
        figure.savefig(path, dpi=figure.dpi)


def _errors_picture(found: MethodComparison) -> Figure:
    """The picture of `draw`."""
    figure = new_figure(PictureSize(1600, 700), layout="constrained")
    axes = figure.subplots(1, 2, sharey=True)
    others = [result for result in found.results if result is not found.reference]
    for axis, measure, label in (
        (axes[0], lambda result: result.seconds, "time, s"),
        (axes[1], lambda result: result.memory / 2**20, "memory, MB"),
    ):
        for result in others:
            error = max(found.errors(result)[1], 1e-12)
            axis.loglog(measure(result), error, "o", label=result.method.name)
        best = sorted((other for other in others if found.is_best(other)), key=measure)
        axis.loglog([measure(o) for o in best], [max(found.errors(o)[1], 1e-12) for o in best], "k-", lw=0.7, zorder=0)
        if found.reference.method.conductance is None:
            axis.axvline(measure(found.reference), color="k", ls=":", label="resolved Stokes flow")
        axis.set_xlabel(label)
    axes[0].set_ylabel("error of the forces, rms")
    axes[1].legend(loc="center left", bbox_to_anchor=(1.0, 0.5))
    return figure
