"""Time series of a simulation in a picture: pressure, stresses, strain, and profiles across the sample."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from os import PathLike
from pathlib import Path
from textwrap import fill
from typing import TYPE_CHECKING, Any

import numpy as np

from porefv.errors import InputError, counted
from porefv.export.picture_output import FORMATS_2D, Picture
from porefv.export.picture_style import (
    AXIS_COLOURS,
    FONTS,
    INK,
    PictureSize,
    label_in_unit,
    new_figure,
    style,
)
from porefv.packing.box import WALLS
from porefv.scenes.simulation_scene import AXES, SimulationScene
from porefv.simulation.gauge_picture import Gauges, draw_gauges, draw_stress_profiles
from porefv.simulation.laboratory_tests import LaboratoryTests, Oedometer, Triaxial
from porefv.simulation.reading import read_profiles, read_series
from porefv.simulation.run_record import RunRecord, read_record
from porefv.simulation.series import PROFILES
from porefv.simulation.stage_axis import StageAxis
from porefv.system.atomic_files import picture_target

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from matplotlib.lines import Line2D

# Moments of which profiles are drawn.
_MOMENTS = 6
# Curves of theory, and of total stresses beside those of contacts.
_THEORY: dict[str, Any] = {"color": INK, "ls": (0, (4, 2)), "lw": 1.0}
_TOTAL: dict[str, Any] = {"lw": 3.0, "alpha": 0.3}


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

    Over a stage of one-dimensional consolidation there is Terzaghi's solution, and below a triaxial test there are its
    stresses and strains: see `porefv.simulation.laboratory_tests`. A run with gauges has diagrams of these, and of
    total and effective stress and pressure over the place, instead of the pressure by layer:
    see `porefv.simulation.gauge_picture`.

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
    scene = SimulationScene.from_record(record.scene)
    tests, gauges = LaboratoryTests(scene, record), Gauges.of(scene, series)
    axis = StageAxis.of(record.spans, tests.dry, float(series["time"][-1]))
    oedometers, triaxial = tests.oedometers(series), tests.triaxial()
    by_gauges = profiles if gauges is not None else None
    profiles = profiles if gauges is None or oedometers else None
    # Of walls that stand there is nothing to see, where something else is.
    strained = not wet or any((series[f"strain_{name}"] != 0.0).any() for name in AXES)
    in_time = 1 + wet + strained
    panels = in_time + (profiles is not None)
    rows = -(-panels // 2)
    all_rows = rows + (gauges is not None) + (by_gauges is not None) + (triaxial is not None)
    size = size or (2000, 700 * all_rows)
    with style():
        figure = new_figure(PictureSize.of(size, dpi), layout="constrained")
        grid = figure.add_gridspec(all_rows, 6)
        places = [grid[row, left : left + 3] for row in range(rows) for left in (0, 3)]
        if panels % 2:
            places[panels - 1] = grid[rows - 1, :]
        axes = iter([figure.add_subplot(place) for place in places[:panels]])
        if wet:
            _pressures(next(axes), series, oedometers)
        _stresses(next(axes), series, wet)
        if strained:
            _strains(next(axes), series, oedometers)
        for ax in figure.axes[:in_time]:
            axis.apply(ax)
            ax.grid(alpha=0.3)
            ax.legend()
        if profiles is not None and len(profiles):
            _profiles(next(axes), profiles, record, tests, oedometers)
        for ax in axes:
            ax.set_axis_off()
        if gauges is not None:
            pair = [figure.add_subplot(grid[rows, left : left + 3]) for left in (0, 3)]
            draw_gauges(pair, gauges)
            for ax in pair:
                axis.apply(ax)
                ax.grid(alpha=0.3)
        if by_gauges is not None:
            three = [figure.add_subplot(grid[rows + 1, left : left + 2]) for left in (0, 2, 4)]
            draw_stress_profiles(three, by_gauges, scene.output.axis)
        if triaxial is not None:
            below = [figure.add_subplot(grid[-1, left : left + 2]) for left in (0, 2, 4)]
            _triaxial(below, triaxial.curves(series), triaxial, record)
        title = Path(record.path).stem if record.path else str(directory)
        text = f"{title}: {counted(len(record.spans), 'stage')}, {series['time'][-1]:.4g} s, {record.status}"
        letters = int(figure.get_figwidth() * 72.0 / (0.6 * FONTS["figure.titlesize"]))
        figure.suptitle(f"{text}\n{fill(axis.names(), letters)}", parse_math=False)
    return figure


def _most(lines: Iterable[Line2D]) -> float:
    """The largest size of a value of curves; 0 if all are missing."""
    sizes = [np.abs(np.asarray(line.get_ydata(), float)) for line in lines]
    return max((float(np.nanmax(size)) for size in sizes if not np.isnan(size).all()), default=0.0)


def _pressures(ax: Axes, series: np.ndarray, oedometers: Sequence[Oedometer]) -> None:
    ax.plot(series["time"], series["mean_pressure"], label="mean")
    ax.plot(series["time"], series["max_pressure"], label="largest")
    for test in oedometers:
        times = _dense_times(series, test)
        ax.plot(times, test.mean_pressure(times), label=_terzaghi(test, "mean"), **_THEORY)
    label_in_unit(ax.yaxis, "pressure of the pores", _most(ax.lines), "Pa")


def _dense_times(series: np.ndarray, test: Oedometer) -> np.ndarray:
    """Times of a stage, close at its begin, where the solution goes with the root of time [s]."""
    return (
        test.begin + (series["time"][series["stage"] == test.stage][-1] - test.begin) * np.linspace(0.0, 1.0, 200) ** 2
    )


def _terzaghi(test: Oedometer, what: str) -> str:
    return f"Terzaghi, {what} ($C_v$ {test.coefficient:.3g} m²/s)"


def _stresses(ax: Axes, series: np.ndarray, wet: bool) -> None:
    for wall in WALLS:
        look: dict[str, Any] = {"color": AXIS_COLOURS[wall[0]], "ls": "-" if wall.endswith("max") else "--"}
        ax.plot(series["time"], series[f"contact_stress_{wall}"], label=wall, **look)
        if wet:
            ax.plot(series["time"], series[f"total_stress_{wall}"], **(look | _TOTAL))
    label_in_unit(ax.yaxis, "stress on walls", _most(ax.lines), "Pa", " (contacts; broad: total)" if wet else "")


def _strains(ax: Axes, series: np.ndarray, oedometers: Sequence[Oedometer]) -> None:
    for axis, colour in AXIS_COLOURS.items():
        ax.plot(series["time"], 100.0 * series[f"strain_{axis}"], color=colour, label=f"strain {axis}")
    for test in oedometers:
        times = _dense_times(series, test)
        ax.plot(times, 100.0 * test.strain(times), label=f"Terzaghi, strain {AXES[test.axis]}", **_THEORY)
    ax.set_ylabel("settlement, % of the side")
    ax.invert_yaxis()


def _profiles(
    ax: Axes, profiles: np.ndarray, record: RunRecord, tests: LaboratoryTests, oedometers: Sequence[Oedometer]
) -> None:
    """Pressure across the layers, effective stress where there is none, at moments of the last stage that has it.

    The moments are close at first, as it changes then. Walls that hold a pressure are points of the curve.
    """
    wet = not np.isnan(profiles["pressure"]).all()
    quantity = "pressure" if wet else "effective_stress"
    found = profiles[~np.isnan(profiles[quantity])]
    if not len(found):
        ax.set_axis_off()
        return
    number = found["stage"].max()
    found = found[found["stage"] == number]
    axis = record.scene.get("output", {}).get("axis", "z")
    theory = [test for test in oedometers if test.stage == number and AXES[test.axis] == axis]
    times = np.unique(found["time"])
    for time in times[np.unique(np.geomspace(1, len(times), _MOMENTS).round().astype(int)) - 1]:
        layers = found[found["time"] == time]
        values, places = list(layers[quantity]), list(0.5 * (layers["lower"] + layers["upper"]))
        lower, upper = layers["lower"].min(), layers["upper"].max()
        pressures = tests.wall_pressures(time) if wet else {}
        if f"{axis}_min" in pressures:
            values, places = [pressures[f"{axis}_min"], *values], [lower, *places]
        if f"{axis}_max" in pressures:
            values, places = [*values, pressures[f"{axis}_max"]], [*places, upper]
        (line,) = ax.plot(values, places, ".-", label=f"{time:.4g} s")
        for test in theory:
            depth = np.linspace(0.0, 1.0, 101)
            look = _THEORY | {"color": line.get_color()}
            ax.plot(test.pressure(depth, time), lower + depth * (upper - lower), **look)
    stage = record.spans[int(number) - 1].name
    shown = f"{quantity.replace('_', ' ')} by layer"
    remark = f", in {stage}" + ("; dashed: Terzaghi" if theory else "")
    label_in_unit(ax.xaxis, shown, np.nanmax(np.abs(found[quantity])), "Pa", remark)
    label_in_unit(ax.yaxis, "place across the layers", np.abs(found["upper"]).max(), "m")
    ax.grid(alpha=0.3)
    ax.legend(loc="center left", bbox_to_anchor=(1.0, 0.5))


def _triaxial(axes: Sequence[Axes], curves: dict[str, np.ndarray], test: Triaxial, record: RunRecord) -> None:
    """q over axial strain, the path of stresses, and volume over axial strain, in a colour for each stage."""
    deviator, path, volume = axes
    axial, q = 100.0 * curves["axial"], curves["deviator"]
    for number in range(test.stage, len(record.spans) + 1):
        (rows,) = np.nonzero(curves["stage"] == number)
        if not len(rows):
            continue
        rows = np.concatenate([rows[:1] - 1, rows]) if rows[0] > 0 else rows
        name = record.spans[number - 1].name
        (line,) = deviator.plot(axial[rows], q[rows], label=name)
        colour = line.get_color()
        path.plot(curves["effective"][rows], q[rows], color=colour, label=f"{name}, contacts")
        if not np.isnan(curves["total"][rows]).all():
            path.plot(curves["total"][rows], q[rows], color=colour, label=f"{name}, total", **_TOTAL)
        volume.plot(axial[rows], 100.0 * curves["volume"][rows], color=colour, label=name)
    label_in_unit(deviator.yaxis, "deviatoric stress q", _most(deviator.lines), "Pa")
    label_in_unit(path.yaxis, "deviatoric stress q", _most(path.lines), "Pa")
    most = float(np.nanmax(np.abs([curves["effective"], curves["total"]])))
    label_in_unit(path.xaxis, "mean stress p' (broad: total p)", most, "Pa")
    volume.set_ylabel("volumetric strain, %")
    volume.invert_yaxis()
    for ax in (deviator, volume):
        ax.set_xlabel(f"strain {AXES[test.axis]} since the shear began, %")
        ax.legend()
    for ax in axes:
        ax.grid(alpha=0.3)
