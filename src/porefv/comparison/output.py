"""A comparison of methods as a table of text, and as files: CSV, JSON and a picture."""

from __future__ import annotations

import csv
import json
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from porefv.comparison.comparison import MethodComparison
from porefv.comparison.measurement import MethodResult
from porefv.export.picture_style import PictureSize, new_figure, style

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def table(found: MethodComparison) -> str:
    """The comparison as text of at most 80 columns."""
    width = max(len(_label(result)) for result in found.results)
    lines = [f"{'':{width}} {'k, m²':>11} {'error':>10} {'forces, rms':>11} {'time':>8} {'memory':>8}"]
    for result in found.results:
        permeability, forces = found.errors(result)
        reference = result is found.reference
        lines.append(
            f"{_label(result):{width}} {result.permeability:>11.5g} "
            f"{'-' if reference or np.isnan(permeability) else f'{100 * permeability:+.2g} %':>10} "
            f"{'-' if reference else f'{100 * forces:.2g} %':>11} {_time(result.seconds):>8} "
            f"{_memory(result.memory):>8}{' *' if found.is_best(result) else ''}"
        )
    if any(result.method.tolerance is not None for result in found.results):
        lines.append("tolerance: of the solver, with the scene's own model")
    if found.reference.method.conductance is None:
        lines.append("Errors are distances from the resolved flow.")
    else:
        lines.append(f"Errors are distances from {found.reference.method.name}, as there is no resolved flow.")
    lines.append("* No other method has better forces in less time.")
    return "\n".join([*lines, *found.remarks])


def _label(result: MethodResult) -> str:
    """The name of a method in the table."""
    tolerance = result.method.tolerance
    return result.method.name if tolerance is None else f"  tolerance {tolerance:.0e}"


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
    """Draw errors of the forces against time and memory: of models above, of the solver's tolerances below.

    Models are measured from the reference, tolerances from the smallest of them. An error of zero stands on the lower
    edge.
    """
    with style():
        figure = _errors_picture(found)
        figure.savefig(path, dpi=figure.dpi)


def _errors_picture(found: MethodComparison) -> Figure:
    """The picture of `draw`."""
    from matplotlib.ticker import NullFormatter

    models = [result for result in found.results if result.method.tolerance is None]
    tolerances = [result for result in found.results if result.method.tolerance is not None]
    rows = [("error of the forces, rms", models, found.reference)]
    if tolerances:
        rows.append(("error by the solver's tolerance, rms", tolerances, tolerances[-1]))
    figure = new_figure(PictureSize(1600, 650 * len(rows)), layout="constrained")
    for axes, (label, results, reference) in zip(figure.subplots(len(rows), 2, squeeze=False), rows, strict=True):
        errors = [MethodComparison(results, reference).errors(result)[1] for result in results]
        known = [error for error in errors if error > 0.0]
        lowest = 10.0 ** np.floor(np.log10(min(known)) - 0.3) if known else 1e-3
        highest = 10.0 ** np.ceil(np.log10(max(known)) + 0.1) if known else 1.0
        for axis, measure, unit in (
            (axes[0], lambda result: result.seconds, "time, s"),
            (axes[1], lambda result: result.memory / 2**20, "memory, MB"),
        ):
            for result, error in zip(results, errors, strict=True):
                place, name = measure(result), _label(result).strip()
                if not (np.isfinite(place) and place > 0.0):
                    continue
                drawn = {"marker": "*", "s": 140.0, "color": "k"} if result is reference else {"marker": "o", "s": 45.0}
                name = f"{name} (reference)" if result is reference else name
                axis.scatter(place, error if error > 0.0 else lowest, label=name, clip_on=False, zorder=3, **drawn)
            places = [place for place in map(measure, results) if np.isfinite(place) and place > 0.0]
            if places and max(places) > 10.0 * min(places):
                axis.set_xscale("log")
            else:
                axis.set_xlim(0.0, 1.15 * max(places, default=1.0))
            axis.set(yscale="log", xlabel=unit, ylabel=label, ylim=(lowest, highest))
            axis.yaxis.set_major_formatter(lambda value, _: f"{100.0 * value:g} %")
            axis.yaxis.set_minor_formatter(NullFormatter())
            axis.grid(which="major", color="#dddddd")
        axes[1].legend(
            *axes[0].get_legend_handles_labels(), fontsize=8, loc="center left", bbox_to_anchor=(1.0, 0.5)
        )  # fmt: skip
    return figure
