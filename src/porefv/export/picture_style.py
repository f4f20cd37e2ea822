"""The style of all pictures: colours, fonts, sizes, units of scales and round ticks.

Pictures of grains and pores, diagrams of quantities and simulations, and the figures of the documentation use it.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from numbers import Real
from textwrap import fill
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from porefv.errors import InputError
from porefv.system.optional_imports import ensure_installed

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

# Colours of things.
INK, PALE_INK = "#222222", "#6b6b6b"
GRAIN, GRAIN_SECTION = "#d9d4cc", "#ece8e1"
FLOW = "#1f5a99"
# Colours of curves: by number, by weight; one for each axis.
BY_NUMBER, BY_WEIGHT = "tab:blue", "tab:orange"
AXIS_COLOURS = {"x": "tab:green", "y": "tab:orange", "z": "tab:blue"}
# Colour maps: families that are not taken for one another.
FORCES, PRESSURES, SPEEDS, TIMES = "YlOrRd", "viridis", "GnBu", "plasma"
# Part of a colour map that is used: ink remains visible on speeds, and late times on white.
_UP_TO = {SPEEDS: 0.7, TIMES: 0.85}

FONTS: Any = {
    "font.size": 9.0, "axes.titlesize": 9.0, "axes.labelsize": 9.0, "xtick.labelsize": 8.0, "ytick.labelsize": 8.0,
    "legend.fontsize": 8.0, "figure.titlesize": 10.0, "axes.linewidth": 0.6, "axes.edgecolor": INK,
    "axes.labelcolor": INK, "text.color": INK, "xtick.color": INK, "ytick.color": INK, "svg.fonttype": "none",
    "svg.hashsalt": "porefv",  # the same picture is the same file
    "font.family": "DejaVu Sans",
}  # fmt: skip
SMALL = 8.0  # points, of notes
SMALLEST = (3.5, 2.5)  # width and height of a picture [inches]
# Room around what is drawn [inches]: for the scales of colours at the right, the title above, a line of notes below.
_SCALES, _TITLE, _LINE, _EDGE = 1.42, 0.5, 0.15, 0.2

_PREFIXES = {
    -24: "y", -21: "z", -18: "a", -15: "f", -12: "p", -9: "n", -6: "µ", -3: "m", 0: "", 3: "k", 6: "M", 9: "G",
    12: "T", 15: "P", 18: "E", 21: "Z", 24: "Y",
}  # fmt: skip
_POWERS = {"²": 2, "³": 3}
# Of areas and volumes, steps of a thousand along a side are steps of a million or more.
_SMALL_STEPS = {-2: "c", -1: "d"}


class PictureSize(NamedTuple):
    """Size of a picture.

    Attributes
    ----------
    width, height : int
        [pixels]
    dpi : float
        Pixels per inch: how large letters are, whose size is in points.
    """

    width: int = 1600
    height: int = 1200
    dpi: float = 200.0

    @classmethod
    def of(cls, size: Sequence[float], dpi: float | None) -> PictureSize:
        """The size of width and height [pixels], with the usual resolution if none is given.

        Raises
        ------
        InputError
            If these are no numbers, or no picture can have them.
        """
        if isinstance(size, str) or not isinstance(size, Sequence | np.ndarray) or len(size) not in (2, 3):
            raise InputError(f"a size is a width and a height in pixels, such as (1600, 1200), not {size!r}")
        if any(isinstance(side, bool) or not isinstance(side, int | np.integer) for side in size[:2]):
            raise InputError(f"the width and height of a picture must be whole numbers of pixels, not {size!r}")
        if dpi is not None and (isinstance(dpi, bool) or not isinstance(dpi, Real)):
            raise InputError(f"the resolution must be a number of pixels per inch, not {dpi!r}")
        return cls(int(size[0]), int(size[1]), SIZE.dpi if dpi is None else float(dpi)).check()

    @property
    def inches(self) -> tuple[float, float]:
        """Width and height in inches."""
        return self.width / self.dpi, self.height / self.dpi

    def check(self) -> PictureSize:
        """The size itself; InputError if no picture can have it."""
        if not (100 <= self.width <= 10_000 and 100 <= self.height <= 10_000):
            raise InputError(
                f"a picture must have 100 to 10 000 pixels along each side, not {self.width} x {self.height}"
            )
        if not 30 <= self.dpi <= 1200:
            raise InputError(f"the resolution must be 30 to 1200 pixels per inch, not {self.dpi:g}")
        width, height = self.inches
        if width < SMALLEST[0] or height < SMALLEST[1]:
            raise InputError(
                f"{self.width} x {self.height} pixels at {self.dpi:g} pixels per inch are {width:.2g} x {height:.2g} "
                f"inches; the letters need {SMALLEST[0]:g} x {SMALLEST[1]:g}. Give more pixels, or fewer per inch."
            )
        return self


SIZE = PictureSize()


class Layout:
    """Where things are in a picture, whatever its size: letters keep theirs.

    Parameters
    ----------
    size : PictureSize
    notes : sequence of str
        What is written below.

    Attributes
    ----------
    notes : str
        With line breaks.
    free : (4,) tuple of float
        What is left for the sample, as fractions of the picture: left, right, bottom, top.
    """

    def __init__(self, size: PictureSize, notes: Sequence[str] = ()):
        self._width, self._height = size.inches
        letters = int((self._width - 2 * _EDGE) * 72.0 / (0.56 * SMALL))
        self.notes = fill("; ".join(notes), letters)
        lines = self.notes.count("\n") + 1 if notes else 0
        self.free = (
            _EDGE / self._width,
            1.0 - (_SCALES + 2 * _EDGE) / self._width,
            (_EDGE + (lines + 1) * _LINE) / self._height,
            1.0 - _TITLE / self._height,
        )

    def write(self, figure: Figure, title: str = "") -> None:
        """Write the title above and the notes below."""
        left = _EDGE / self._width
        if title:
            top = 1.0 - _EDGE / self._height
            figure.text(left, top, title, va="top", fontsize=FONTS["figure.titlesize"], parse_math=False)
        if self.notes:
            figure.text(left, 0.6 * _EDGE / self._height, self.notes, fontsize=SMALL, color=PALE_INK, parse_math=False)

    def scale(self, place: int, places: int) -> tuple[float, float, float, float]:
        """Left, bottom, width and height of a scale of colours, the first of several above the others."""
        low, high = _EDGE + 2 * _LINE, self._height - 0.3
        each = (high - low) / max(places, 2)
        return (
            1.0 - _SCALES / self._width,
            (high - (place + 1) * each + 0.1) / self._height,
            0.16 / self._width,
            (each - 0.55) / self._height,
        )


class Unit(NamedTuple):
    """A unit with a prefix: `factor` times a value in SI units is the value in this unit."""

    factor: float
    name: str


def unit_for(most: float, unit: str) -> Unit:
    """The unit with the SI prefix in which values up to `most` have few digits.

    Parameters
    ----------
    most : float
        Largest size of a value, in the unit without a prefix.
    unit : str
        For instance "Pa", "m" or "m³/s"; the prefix is that of its first factor.

    Examples
    --------
    >>> unit_for(0.0014, "N")
    Unit(factor=1000.0, name='mN')
    >>> unit_for(2e-7, "m³/s").name, unit_for(2e-6, "m³/s").name
    ('mm³/s', 'cm³/s')
    """
    first = unit.split("/")[0]
    power = _POWERS.get(first[-1], 1)
    most = abs(most)
    if not 1e-300 < most < 1e300:  # beyond, factors would overflow
        return Unit(1.0, unit)
    magnitude = math.log10(most)
    prefixes = _PREFIXES | (_SMALL_STEPS if power > 1 else {})
    # One to a thousand, or as near to it as prefixes are: 1000 Pa is 1 kPa.
    exponent = min(prefixes, key=lambda each: (round(abs(magnitude - power * each - 1.5), 9), -each))
    if abs(magnitude - power * exponent - 1.5) > 1.5 * power + 1e-6:
        exponent = math.floor(magnitude)
        return Unit(10.0**-exponent, f"10^{exponent} {unit}")
    return Unit(10.0 ** (-exponent * power), f"{prefixes[exponent]}{unit}")


def in_unit(value: float, unit: str, digits: int = 3) -> str:
    """A value with its unit, as in a title: ``6.45 mPa``."""
    scale = unit_for(value, unit)
    return f"{value * scale.factor:.{digits}g} {scale.name}"


def round_length(most: float) -> float:
    """The largest of 1, 2 and 5 times a power of ten that is not above `most`."""
    power = 10.0 ** math.floor(math.log10(most))
    return max(step * power for step in (1.0, 2.0, 5.0) if step * power <= most * (1.0 + 1e-9))


@contextmanager
def style() -> Iterator[None]:
    """Within the block, what matplotlib makes has the fonts, line widths and colours of porefv's pictures.

    Raises
    ------
    MissingExtraError
        If matplotlib is not installed.
    """
    ensure_installed("matplotlib", "matplotlib", "Drawing a picture")
    from matplotlib import rc_context

    with rc_context(FONTS):
        yield


def new_figure(size: PictureSize = SIZE, **options: Any) -> Figure:
    """A white `matplotlib.figure.Figure` of a size; to be called within `style`."""
    from matplotlib.figure import Figure

    return Figure(figsize=size.inches, dpi=size.dpi, facecolor="white", **options)


def round_ticks(axis: Any, most: int = 6) -> None:
    """Put an axis' ticks at round values, `most` + 1 at the most."""
    from matplotlib.ticker import MaxNLocator

    axis.set_major_locator(MaxNLocator(most, steps=[1, 2, 2.5, 5, 10]))


def label_in_unit(axis: Any, quantity: str, most: float, unit: str, remark: str = "") -> None:
    """Label an axis of data in SI units, and show its numbers in the unit with the prefix for values up to `most`."""
    from matplotlib.ticker import FuncFormatter

    scale = unit_for(most, unit)
    axis.set_label_text(f"{quantity}, {scale.name}{remark}", parse_math=False)
    # Twelve digits hide the rounding of the factor.
    axis.set_major_formatter(FuncFormatter(lambda value, _: f"{value * scale.factor:.12g}"))


class Colours(NamedTuple):
    """A scale of colours.

    Attributes
    ----------
    label : str
        What is shown, without unit.
    unit : Unit
    low, high : float
        Values at the ends, in the unit.
    colour_map : str
        Of matplotlib.
    beyond : bool
        Whether there are values above the upper end: it is pointed then.
    """

    label: str
    unit: Unit
    low: float
    high: float
    colour_map: str
    beyond: bool = False

    @classmethod
    def of_speeds(cls, label: str, speeds: np.ndarray) -> Colours:
        """The scale of speeds from zero; it leaves out the highest hundredth if these are much higher than others."""
        return cls.of_most(label, "m/s", speeds, 0.99, SPEEDS)

    @classmethod
    def of_most(cls, label: str, unit: str, values: np.ndarray, part: float, colour_map: str) -> Colours:
        """The scale of positive values from zero to the largest, or to the quantile `part` if that is much less."""
        most, usual = float(values.max()), float(np.quantile(values, part))
        far = most > 1.5 * usual > 0.0
        return cls.over(label, unit, 0.0, usual if far else most, colour_map)._replace(beyond=far)

    @classmethod
    def over(cls, label: str, unit: str, low: float, high: float, colour_map: str) -> Colours:
        """The scale from `low` to `high`, given in SI units without prefix; a single value is its middle."""
        scale = unit_for(max(abs(low), abs(high)), unit)
        low, high = low * scale.factor, high * scale.factor
        if not high > low:
            half = 0.5 * abs(low) if abs(low) > 1e-300 else 0.5
            low, high = low - half, low + half
        return cls(label, scale, low, high, colour_map)

    @property
    def map(self) -> Any:
        """Matplotlib's colour map."""
        from matplotlib import colormaps
        from matplotlib.colors import LinearSegmentedColormap

        whole = colormaps[self.colour_map]
        if self.colour_map not in _UP_TO:
            return whole
        places = [_UP_TO[self.colour_map] * k / 255 for k in range(256)]
        return LinearSegmentedColormap.from_list(self.colour_map, whole(places))

    @property
    def mappable(self) -> Any:
        """Matplotlib's map from values in the unit to colours."""
        from matplotlib.cm import ScalarMappable
        from matplotlib.colors import Normalize

        return ScalarMappable(Normalize(self.low, self.high), self.map)

    def of(self, values: Any) -> Any:
        """(n, 4): colours of values in SI units without prefix."""
        return self.mappable.to_rgba(values * self.unit.factor)

    def draw(self, axes: Axes) -> None:
        """Fill axes with the scale: its label above, its ticks at the right."""
        bar = axes.figure.colorbar(self.mappable, cax=axes, extend="max" if self.beyond else "neither")  # type: ignore[union-attr]
        round_ticks(bar.ax.yaxis, 5)
        bar.ax.set_title(f"{self.label}, {self.unit.name}", loc="left", pad=7.0)
        bar.outline.set_linewidth(0.0)  # type: ignore[operator]
