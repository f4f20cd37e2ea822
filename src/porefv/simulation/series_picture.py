"""Time series of a simulation in a picture: pressure, stresses, strain, and profiles across the sample."""

from __future__ import annotations

from collections.abc import Iterable
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from porefv.errors import InputError, counted
from porefv.export.picture_output import FORMATS_2D, Picture
from porefv.export.picture_style import (
    AXIS_COLOURS,
    PALE_INK,
    SIZE,
    SMALL,
    PictureSize,
    label_in_unit,
    new_figure,
    style,
)
from porefv.packing.box import WALLS
from porefv.simulation.reading import read_profiles, read_series
from porefv.simulation.run_record import RunRecord, read_record
from porefv.simulation.series import PROFILES
from porefv.system.atomic_files import picture_target

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from matplotlib.lines import Line2D

# Moments of which profiles are drawn.
_MOMENTS = 6


def draw_series(directory: str | PathLike[str], path: str | PathLike[str], **options: Any) -> Picture:
    """Write a picture of the series of a results directory, also while its run goes on: PNG, SVG or PDF.

    Parameters
    ----------
    directory, path : path
    **options
        `size` and `dpi`, as of `series_picture`.

    Raises
    ------
    InputError
        If the directory holds no series, or the picture cannot be written.
    MissingExtraError
        If matplotlib is not installed.
    """
    picture_target(path, FORMATS_2D)
    picture = Picture(series_picture(directory, **options))
    picture.save(path)
    return picture


def series_picture(
    directory: str | PathLike[str], *, size: tuple[int, int] | None = None, dpi: float | None = None
) -> Figure:
    """The picture, a `matplotlib.figure.Figure`; errors as `draw_series`.

    Parameters
    ----------
    directory : path
    size : (int, int), optional
        Width and height; by default as high as there are curves [pixels].
    dpi : float, optional
        Pixels per inch.
    """
    record, series = read_record(directory), read_series(directory)
    if len(series) == 0:
        raise InputError(f"{directory} has no rows to draw yet")
    wet = "mean_pressure" in (series.dtype.names or ())
    profiles = read_profiles(directory) if (Path(directory) / PROFILES).is_file() else None
    rows = 2 if wet or profiles is not None else 1
    size = size or (2000, 700 * rows)
    with style():
        figure = new_figure(PictureSize(*size, SIZE.dpi if dpi is None else dpi).check(), layout="constrained")
        axes = iter(np.atleast_1d(figure.subplots(rows, 2)).ravel())
        if wet:
            _pressures(next(axes), series)
        _stresses(next(axes), series, wet)
        _strains(next(axes), series)
        in_time = list(figure.axes[: 3 if wet else 2])
        for ax in in_time:
            _stages(ax, record)
            ax.set_xlim(series["time"][0], max(series["time"][-1], np.nextafter(series["time"][0], np.inf)))
            label_in_unit(ax.xaxis, "time", series["time"][-1], "s")
            ax.grid(alpha=0.3)
            ax.legend()
        if profiles is not None and len(profiles):
            _profiles(next(axes), profiles, record, "pressure" if wet else "effective_stress")
        for ax in axes:
            ax.set_axis_off()
        title = Path(record.path).stem if record.path else str(directory)
        text = f"{title}: {counted(len(record.spans), 'stage')}, {series['time'][-1]:.4g} s, {record.status}"
        figure.suptitle(text, parse_math=False)
    return figure


def _most(lines: Iterable[Line2D]) -> float:
    """The largest size of a value of curves; 0 if all are missing."""
    sizes = [np.abs(np.asarray(line.get_ydata(), float)) for line in lines]
    return max((float(np.nanmax(size)) for size in sizes if not np.isnan(size).all()), default=0.0)


def _pressures(ax: Axes, series: np.ndarray) -> None:
    ax.plot(series["time"], series["mean_pressure"], label="mean")
    ax.plot(series["time"], series["max_pressure"], label="largest")
    label_in_unit(ax.yaxis, "pressure of the pores", _most(ax.lines), "Pa")


def _stresses(ax: Axes, series: np.ndarray, wet: bool) -> None:
    for wall in WALLS:
        style: dict[str, Any] = {"color": AXIS_COLOURS[wall[0]], "ls": "-" if wall.endswith("max") else "--"}
        ax.plot(series["time"], series[f"contact_stress_{wall}"], label=wall, **style)
        if wet:
            ax.plot(series["time"], series[f"total_stress_{wall}"], lw=3.0, alpha=0.3, **style)
    label_in_unit(ax.yaxis, "stress on walls", _most(ax.lines), "Pa", " (contacts; broad: total)" if wet else "")


def _strains(ax: Axes, series: np.ndarray) -> None:
    for axis, colour in AXIS_COLOURS.items():
        ax.plot(series["time"], 100.0 * series[f"strain_{axis}"], color=colour, label=f"strain {axis}")
    ax.set_ylabel("settlement, % of the side")
    ax.invert_yaxis()


def _stages(ax: Axes, record: RunRecord) -> None:
    for span in record.spans[1:]:
        ax.axvline(span.begin, color="0.6", lw=0.8)
    for span in record.spans:
        ax.annotate(
            f" {span.name}", (span.begin, 0.99), xycoords=("data", "axes fraction"),
            rotation=90, va="top", fontsize=SMALL, color=PALE_INK, parse_math=False,
        )  # fmt: skip


def _profiles(ax: Axes, profiles: np.ndarray, record: RunRecord, quantity: str) -> None:
    """The quantity across the layers, at moments of the last stage that has it: close at first, as it changes then."""
    found = profiles[~np.isnan(profiles[quantity])]
    if not len(found):
        ax.set_axis_off()
        return
    found = found[found["stage"] == found["stage"].max()]
    times = np.unique(found["time"])
    for time in times[np.unique(np.geomspace(1, len(times), _MOMENTS).round().astype(int)) - 1]:
        layers = found[found["time"] == time]
        ax.plot(layers[quantity], 0.5 * (layers["lower"] + layers["upper"]), ".-", label=f"{time:.4g} s")
    stage = record.spans[int(found["stage"][0]) - 1].name
    shown = f"{quantity.replace('_', ' ')} by layer"
    label_in_unit(ax.xaxis, shown, np.nanmax(np.abs(found[quantity])), "Pa", f", in {stage}")
    label_in_unit(ax.yaxis, "place across the layers", np.abs(found["upper"]).max(), "m")
    ax.grid(alpha=0.3)
    ax.legend()
