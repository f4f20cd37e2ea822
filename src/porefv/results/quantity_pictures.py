"""Pictures of the quantities of a sample: its profile, and the distributions of pore and constriction sizes."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from porefv.errors import InputError
from porefv.export.picture_output import Picture
from porefv.export.picture_style import (
    BY_NUMBER,
    BY_WEIGHT,
    PALE_INK,
    SIZE,
    PictureSize,
    new_figure,
    round_ticks,
    style,
    unit_for,
)
from porefv.flow.sizes import ConstrictionSizes, Distribution, PoreSizes
from porefv.results.reading import Results

if TYPE_CHECKING:
    from matplotlib.axes import Axes

# Quantities of which there is a picture.
QUANTITY_PICTURES = ("profile", "pore_sizes", "constriction_sizes")


def quantity_picture(
    results: Results, quantity: str, *, size: PictureSize | tuple[int, int] = SIZE, dpi: float | None = None
) -> Picture:
    """The picture of a quantity, one of `QUANTITY_PICTURES`.

    Raises
    ------
    InputError
        If the results do not have the quantity.
    MissingExtraError
        If matplotlib is not installed.
    """
    if quantity not in QUANTITY_PICTURES:
        raise InputError(f"there is no picture of {quantity!r}; there are: {', '.join(QUANTITY_PICTURES)}")
    size = PictureSize.of(size, dpi)
    with style():
        figure = new_figure(size, layout="constrained")
        axes = figure.subplots(1, 2 if quantity == "profile" else 1, sharey=True, squeeze=False)[0]
        if quantity == "profile":
            _profile(axes, results)
        elif quantity == "pore_sizes":
            table = results.pore_sizes
            sizes = PoreSizes(table["void_volume"], np.stack([table[x] for x in "xyz"], axis=1), table["radius"])
            found = {"by number": sizes.by_number, "by void volume": sizes.by_volume}
            _distributions(axes[0], found, "radius of the inscribed sphere of a pore")
            axes[0].set_ylabel("part of the pores that is not larger")
        else:
            throats = ConstrictionSizes(results.constriction_sizes["radius"], results.constriction_sizes["flux"])
            found = {"by number": throats.by_number, "by flux": throats.by_flux}
            _distributions(axes[0], found, "radius of the inscribed circle of a throat")
            axes[0].set_ylabel("part of the throats that is not larger")
        for ax in axes:
            ax.grid(alpha=0.3)
            round_ticks(ax.xaxis, 6)
        scene, spheres = results.summary.get("scene"), results.summary["packing"]["spheres"]
        title = f"{Path(scene).stem}: {spheres} spheres" if scene else f"{spheres} spheres"
        figure.suptitle(title, parse_math=False)
    return Picture(figure)


def _profile(axes: np.ndarray, results: Results) -> None:
    table, axis = results.profile, results.summary["profile"]["axis"]
    edges = np.append(table["lower"], table["upper"][-1])
    length, pressure = unit_for(float(np.abs(edges).max()), "m"), unit_for(float(np.abs(table["pressure"]).max()), "Pa")
    edges, middles = length.factor * edges, 0.5 * length.factor * (table["lower"] + table["upper"])
    axes[0].stairs(table["porosity"], edges, orientation="horizontal", color=BY_NUMBER, baseline=None)
    axes[0].axvline(results.summary["packing"]["porosity"], color="0.4", lw=0.9, ls="--", label="whole sample")
    axes[0].legend()
    axes[0].set_xlabel("porosity")
    axes[0].set_ylabel(f"{axis}, {length.name}")
    axes[1].plot(pressure.factor * table["pressure"], middles, ".-", color=BY_WEIGHT)
    axes[1].set_xlabel(f"mean pressure, {pressure.name}")
    axes[0].set_ylim(edges[0], edges[-1])


def _distributions(ax: Axes, found: dict[str, Distribution], label: str) -> None:
    """Curves of the fractions, with the median of each marked."""
    drawn = {name: each for name, each in found.items() if len(each.values)}
    unit = unit_for(max((float(each.values.max()) for each in drawn.values()), default=0.0), "m")
    for (name, distribution), colour in zip(found.items(), (BY_NUMBER, BY_WEIGHT), strict=True):
        if name not in drawn:
            continue
        median = unit.factor * distribution.quantile(0.5)
        ax.step(unit.factor * distribution.values, distribution.fractions, where="post", color=colour, label=name)
        ax.plot([median], [0.5], "o", color=colour, ms=5, label=f"median {median:.3g} {unit.name}")
    ax.set_xlabel(f"{label}, {unit.name}")
    ax.set_ylim(0.0, 1.0)
    ax.set_xlim(left=0.0)
    if drawn:
        ax.legend(loc="lower right")
    else:
        ax.text(0.5, 0.5, "none has a size", transform=ax.transAxes, ha="center", color=PALE_INK)
