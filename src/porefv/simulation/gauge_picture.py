"""Diagrams of gauges: their pressures and gradients in time, and stresses across the sample at a few moments."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from porefv.export.picture_style import label_in_unit
from porefv.scenes.simulation_scene import AXES, SimulationScene

if TYPE_CHECKING:
    from matplotlib.axes import Axes

# Moments of which stresses are drawn, as in C14, figure 16.
_MOMENTS = 4
_LOCAL: dict[str, Any] = {"ls": (0, (4, 2)), "lw": 0.8}


@dataclass(frozen=True)
class Gauges:
    """What gauges have measured.

    Attributes
    ----------
    axis : str
        Along which they lie.
    places : (g,) array
        [m]
    times : (r,) array
        Of the rows of the series [s].
    pressures : (r, g) array
        [Pa]
    gradients : (r, g - 1) array
        Fall of the pressure from each gauge to the next one, over their distance [Pa/m].
    critical : (r, g - 1) array or None
        Weight of the grains less their buoyancy in a volume of the mixture between two gauges, the gradient that
        carries them [Pa/m]. None where there is no weight along the axis.
    """

    axis: str
    places: np.ndarray
    times: np.ndarray
    pressures: np.ndarray
    gradients: np.ndarray
    critical: np.ndarray | None

    @classmethod
    def of(cls, scene: SimulationScene, series: np.ndarray) -> Gauges | None:
        """The gauges of a run; None if it has none.

        Parameters
        ----------
        scene : SimulationScene
        series : structured array
            Of the run.
        """
        places, axis, fluid = scene.output.gauges, scene.output.axis, scene.fluid
        if places is None or fluid is None:
            return None
        count = range(1, len(places) + 1)
        pressures = np.stack([series[f"gauge_pressure_{k}"] for k in count], axis=1)
        gradients = -np.diff(pressures) / np.diff(places)
        solid, gravity = scene.material.density, scene.gravity[AXES.index(axis)]
        critical = None
        if len(places) > 1 and gravity != 0.0 and fluid.density > 0.0:
            porosities = np.stack([series[f"gauge_porosity_{k}"] for k in count[:-1]], axis=1)
            # C14, eq. 42, times the weight of the fluid.
            critical = -(1.0 - porosities) * (solid - fluid.density) * gravity
        return cls(axis, np.array(places), series["time"], pressures, gradients, critical)

    @property
    def critical_at_start(self) -> float:
        """The critical gradient between the first and the last gauge at the first row [Pa/m]; NaN if not known."""
        return np.nan if self.critical is None else float(np.average(self.critical[0], weights=np.diff(self.places)))


def draw_gauges(axes: Sequence[Axes], gauges: Gauges) -> None:
    """Draw pressures of gauges, and gradients between neighbours, over time.

    Gradients are over the critical one of the start, where it is known; so are dashed the critical ones of each moment.
    """
    pressure, gradient = axes
    for place, curve in zip(gauges.places, gauges.pressures.T, strict=True):
        pressure.plot(gauges.times, curve, label=f"{place:.4g} m")
    label_in_unit(pressure.yaxis, f"pressure at gauges along {gauges.axis}", _most(gauges.pressures), "Pa")
    scale = gauges.critical_at_start
    relative = np.isfinite(scale) and scale != 0.0
    for k, curve in enumerate(gauges.gradients.T):
        label = f"{gauges.places[k]:.4g} to {gauges.places[k + 1]:.4g} m"
        (line,) = gradient.plot(gauges.times, curve / (scale if relative else 1.0), label=label)
        if relative and gauges.critical is not None:
            gradient.plot(gauges.times, gauges.critical[:, k] / scale, color=line.get_color(), **_LOCAL)
    if relative:
        gradient.set_ylabel("gradient / critical gradient of the start\n(dashed: that of each moment)")
    else:
        label_in_unit(gradient.yaxis, "gradient of the pressure", _most(gauges.gradients), "Pa/m")
    for ax in axes:
        ax.legend()


def draw_stress_profiles(axes: Sequence[Axes], profiles: np.ndarray, axis: str) -> None:
    """Draw total stress, effective stress and pressure over the place along the axis, at up to four moments.

    They are evenly spaced among the profiles with a pressure of the last stage that has it.

    Parameters
    ----------
    axes : three Axes
    profiles : structured array
        Of the run.
    axis : str
    """
    found = profiles[~np.isnan(profiles["pressure"]) & (profiles["time"] > 0.0)]
    names = ("total_stress", "effective_stress", "pressure")
    if len(found):
        found = found[found["stage"] == found["stage"].max()]
    times = np.unique(found["time"])
    for time in times[np.unique(np.linspace(0, len(times) - 1, _MOMENTS).round().astype(int))] if len(times) else ():
        layers = found[found["time"] == time]
        middle = 0.5 * (layers["lower"] + layers["upper"])
        for ax, name in zip(axes, names, strict=True):
            ax.plot(layers[name], middle, ".-", label=f"{time:.3g} s")
    most = max((_most(found[name]) for name in names), default=0.0)
    for ax, name in zip(axes, names, strict=True):
        label_in_unit(ax.xaxis, name.replace("_", " "), most, "Pa")
        label_in_unit(ax.yaxis, f"place along {axis}", _most(found["upper"]), "m")
        ax.grid(alpha=0.3)
    axes[0].legend()


def _most(values: np.ndarray) -> float:
    """The largest size of a value; 0 if there is none."""
    sizes = np.abs(values[np.isfinite(values)])
    return float(sizes.max()) if len(sizes) else 0.0
