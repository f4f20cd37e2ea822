"""The axis of time of a picture: stages numbered above it, and long dry stages folded."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from porefv.export.picture_style import PALE_INK, SMALL, in_unit, label_in_unit
from porefv.simulation.run_record import StageSpan

if TYPE_CHECKING:
    from matplotlib.axes import Axes

# Width of a folded stage, as a part of the time of all stages with a fluid.
_FOLDED = 0.08
_BAND = "0.95"


@dataclass(frozen=True)
class StageAxis:
    """Where times are along an axis: a dry stage of a run with a fluid takes less of it than its time.

    Attributes
    ----------
    spans : sequence of StageSpan
    dry : sequence of bool
        Whether each has no fluid.
    ends : (S + 1,) float array
        Begin of each stage, and the end of the last, or of the series [s].
    places : (S + 1,) float array
        Where these are along the axis [s].
    folded : (S,) bool array
    """

    spans: Sequence[StageSpan]
    dry: Sequence[bool]
    ends: np.ndarray
    places: np.ndarray
    folded: np.ndarray

    @classmethod
    def of(cls, spans: Sequence[StageSpan], dry: Sequence[bool], until: float) -> StageAxis:
        """The axis of a run that has come to a time [s]."""
        ends = np.array([*(span.begin for span in spans), until])
        lengths = np.maximum(np.diff(ends), 0.0)
        wet = float(lengths[~np.array(dry, bool)].sum())
        folded = np.array(dry, bool) & (lengths > _FOLDED * wet) & (wet > 0.0)
        shown = np.where(folded, _FOLDED * wet, lengths)
        return cls(spans, dry, ends, ends[0] + np.concatenate([[0.0], np.cumsum(shown)]), folded)

    def apply(self, ax: Axes) -> None:
        """Scale and label the axis of time of a diagram, and mark the stages by bands with numbers above them."""
        if self.folded.any():
            ax.set_xscale("function", functions=(self._place, self._time))
        last = max(self.ends[-1], np.nextafter(self.ends[0], np.inf))
        ax.set_xlim(self.ends[0], last)
        self._ticks(ax)
        label_in_unit(ax.xaxis, "time", last, "s")
        for k in range(len(self.spans)):
            begin, end = self.ends[k], self.ends[k + 1]
            if k % 2:
                ax.axvspan(begin, end, color=_BAND, zorder=0)
            if self.folded[k]:
                ax.axvspan(begin, end, fill=False, edgecolor="0.85", hatch="///", lw=0.0, zorder=0)
            middle = self._time(0.5 * (self.places[k] + self.places[k + 1]))
            ax.annotate(
                str(k + 1), (float(middle), 1.02), xycoords=("data", "axes fraction"), ha="center", fontsize=SMALL,
                color=PALE_INK,
            )  # fmt: skip

    def names(self) -> str:
        """The numbers with the names of stages, and the time of those that are folded."""
        return "    ".join(
            f"{k + 1} {span.name}" + (f" (dry, {in_unit(end - begin, 's')}, folded)" if folded else "")
            for k, (span, begin, end, folded) in enumerate(
                zip(self.spans, self.ends[:-1], self.ends[1:], self.folded, strict=True)
            )
        )

    def _place(self, time: np.ndarray) -> np.ndarray:
        return np.interp(time, self.ends, self.places)

    def _time(self, place: np.ndarray | float) -> np.ndarray:
        return np.interp(place, self.places, self.ends)

    def _ticks(self, ax: Axes) -> None:
        """Round times, in stages that are not folded."""
        from matplotlib.ticker import FixedLocator, MaxNLocator

        step = MaxNLocator(6, steps=[1, 2, 2.5, 5, 10]).tick_values(0.0, max(float(np.ptp(self.places)), 1e-300))[1]
        # Not the negative zero that `ceil` gives, which would be written with its sign.
        ticks = (np.arange(np.ceil(self.ends[0] / step - 1e-9), self.ends[-1] / step + 1e-9) + 0.0) * step
        inside = np.searchsorted(self.ends, ticks, side="right").clip(1, len(self.folded)) - 1
        ax.xaxis.set_major_locator(FixedLocator(ticks[~self.folded[inside]]))
