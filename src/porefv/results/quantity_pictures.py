"""Pictures of the quantities of a sample: its profile, and the distributions of pore and constriction sizes."""

from __future__ import annotations

from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from porefv.errors import InputError, MissingExtraError
from porefv.flow.sizes import ConstrictionSizes, Distribution, PoreSizes
from porefv.results.reading import Results
from porefv.system.atomic_files import atomic_write, locked, picture_target

if TYPE_CHECKING:
    from matplotlib.axes import Axes

# Quantities of which there is a picture.
PICTURES = ("profile", "pore_sizes", "constriction_sizes")
# A colour for counts, and one for volumes and fluxes.
_BY_NUMBER, _BY_WEIGHT = "tab:blue", "tab:orange"


def draw_quantity(results: Results, quantity: str, path: str | PathLike[str]) -> None:
    """Write a PNG picture of a quantity, one of `PICTURES`.

    Raises
    ------
    InputError
        If the results do not have the quantity, or the picture cannot be written.
    MissingExtraError
        If matplotlib is not installed.
    """
    path = picture_target(path)
    picture = quantity_picture(results, quantity)
    with locked(path), atomic_write(path) as temporary:
        picture.savefig(temporary, dpi=150)


def quantity_picture(results: Results, quantity: str) -> Any:
    """The picture, a `matplotlib.figure.Figure`; errors as `draw_quantity`."""
    if quantity not in PICTURES:
        raise InputError(f"there is no picture of {quantity!r}; there are: {', '.join(PICTURES)}")
    try:
        from matplotlib.figure import Figure
    except ModuleNotFoundError:
        raise MissingExtraError("matplotlib", "Drawing quantities") from None
    panels = 2 if quantity == "profile" else 1
    figure = Figure(figsize=(5.0 * panels, 4.2) if panels == 2 else (7.0, 4.5), layout="constrained")
    axes = np.atleast_1d(figure.subplots(1, panels, sharey=True))
    if quantity == "profile":
        _profile(axes, results)
    elif quantity == "pore_sizes":
        table = results.pore_sizes
        sizes = PoreSizes(table["void_volume"], np.stack([table[x] for x in "xyz"], axis=1), table["radius"])
        _distributions(axes[0], {"by number": sizes.by_number, "by void volume": sizes.by_volume})
        axes[0].set_xlabel("radius of the inscribed sphere of a pore, m")
        axes[0].set_ylabel("part of the pores that is not larger")
    else:
        throats = ConstrictionSizes(results.constriction_sizes["radius"], results.constriction_sizes["flux"])
        _distributions(axes[0], {"by number": throats.by_number, "by flux": throats.by_flux})
        axes[0].set_xlabel("radius of the inscribed circle of a throat, m")
        axes[0].set_ylabel("part of the throats that is not larger")
    for ax in axes:
        ax.grid(alpha=0.3)
    scene, spheres = results.summary.get("scene"), results.summary["packing"]["spheres"]
    figure.suptitle(f"{Path(scene).stem}: {spheres} spheres" if scene else f"{spheres} spheres")
    return figure


def _profile(axes: np.ndarray, results: Results) -> None:
    table, axis = results.profile, results.summary["profile"]["axis"]
    edges = np.append(table["lower"], table["upper"][-1])
    axes[0].stairs(table["porosity"], edges, orientation="horizontal", color=_BY_NUMBER, baseline=None)
    axes[0].axvline(results.summary["packing"]["porosity"], color="0.4", lw=0.9, ls="--", label="whole sample")
    axes[0].legend(fontsize=8)
    axes[0].set_xlabel("porosity")
    axes[0].set_ylabel(f"{axis}, m")
    axes[1].plot(table["pressure"], 0.5 * (table["lower"] + table["upper"]), ".-", color=_BY_WEIGHT)
    axes[1].set_xlabel("mean pressure, Pa")
    axes[0].set_ylim(edges[0], edges[-1])


def _distributions(ax: Axes, found: dict[str, Distribution]) -> None:
    """Curves of the fractions, with the median of each marked."""
    for (label, distribution), colour in zip(found.items(), (_BY_NUMBER, _BY_WEIGHT), strict=True):
        if len(distribution.values) == 0:
            continue
        median = distribution.quantile(0.5)
        ax.step(distribution.values, distribution.fractions, where="post", color=colour, label=label)
        ax.plot([median], [0.5], "o", color=colour, ms=5, label=f"median {median:.3g} m")
    ax.set_ylim(0.0, 1.0)
    ax.set_xlim(left=0.0)
    ax.legend(fontsize=8, loc="lower right")
