"""Pictures of a section: grains as discs, pores coloured by pressure or speed, arrows of the velocity."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from porefv.export.picture_data import PictureData
from porefv.export.picture_output import Picture
from porefv.export.picture_style import (
    GRAIN_SECTION,
    INK,
    PALE_INK,
    PRESSURES,
    SIZE,
    Colours,
    Layout,
    PictureSize,
    Unit,
    in_unit,
    new_figure,
    round_ticks,
    style,
    unit_for,
)
from porefv.export.sections import Discs, Plane, Polygons, cut_cells, cut_spheres, open_points

if TYPE_CHECKING:
    from matplotlib.axes import Axes

# Length of an arrow that is longer than nine tenths of all, relative to the mean radius of the grains.
_ARROW = 0.8
# Room that an arrow needs at its place, from the nearest grain, relative to the same.
_ROOM = 0.08
# Longest arrow, relative to the shorter side of the section, for boxes of few grains.
_ARROW_OF_BOX = 0.1


def section_picture(
    data: PictureData,
    what: str = "section",
    *,
    axis: str | None = None,
    at: float | None = None,
    title: str = "",
    size: PictureSize = SIZE,
) -> Picture:
    """The section of a sample by a plane, to scale.

    Parameters
    ----------
    data : PictureData
    what : {"section", "velocity"}
        Pores coloured by pressure, or by speed with arrows of their mean velocities.
    axis, at
        Normal and place of the plane; see `Plane.through`.
    title, size
        As of `porefv.export.pictures.draw`.
    """
    plane = Plane.through(data.box, axis, at, data.axis)
    discs = cut_spheres(data.centres, data.radii, plane)
    with style():
        figure = new_figure(size)
        axes = figure.add_subplot()
        unit = frame(axes, data, plane)
        notes = [] if len(discs.radii) else ["the plane cuts no grain"]
        colours = None
        if data.cells is None:
            notes.append("grains only: there are no pores in these data")
        else:
            polygons = cut_cells(data.cells.polyhedra, plane)
            pores = data.cells.pore[polygons.cells]
            if what == "velocity" and data.velocity is not None:
                speeds = np.linalg.norm(data.velocity, axis=1)[pores]
                colours = Colours.of_speeds("speed in the\npores", speeds)
                add_cells(axes, polygons, unit, colours.of(speeds))
                notes += add_velocities(axes, data, plane, polygons, discs, unit)
            elif data.pressure is not None:
                values = data.pressure
                colours = Colours.over("pressure", "Pa", values.min(), values.max(), PRESSURES)
                add_cells(axes, polygons, unit, colours.of(values[pores]))
            else:
                add_cells(axes, polygons, unit, None)
                notes.append("cells of the mesh; no pressure in these data")
        add_discs(axes, discs, unit)
        layout = Layout(size, notes)
        _place(axes, layout, size, plane.project(data.box.size[None])[0])
        if colours is not None:
            colours.draw(figure.add_axes(layout.scale(0, 1)))
        place = f"{'xyz'[plane.normal]} = {plane.at * unit.factor:.4g} {unit.name}"
        layout.write(figure, f"{title},  {place}" if title else place)
    return Picture(figure, tuple(notes))


def _place(axes: Axes, layout: Layout, size: PictureSize, sides: np.ndarray) -> None:
    """Put axes to scale into what is free of a picture, with as many ticks as there is room for."""
    left, right, bottom, top = layout.free
    width, height = size.inches
    left, bottom = left + 0.55 / width, bottom + 0.35 / height
    room = np.array([(right - left) * width, (top - bottom) * height])
    inches = sides * (room / sides).min()
    corner = np.array([left * width, bottom * height]) + 0.5 * (room - inches)
    axes.set_position((corner[0] / width, corner[1] / height, inches[0] / width, inches[1] / height))
    for axis, length in ((axes.xaxis, inches[0]), (axes.yaxis, inches[1])):
        round_ticks(axis, int(np.clip(length / 0.5, 1, 6)))


def frame(axes: Axes, data: PictureData, plane: Plane) -> Unit:
    """Axes to scale, limited to the box, in the unit of length that is returned."""
    unit = unit_for(float(data.box.size.max()), "m")
    lower, upper = (plane.project(corner[None])[0] * unit.factor for corner in (data.box.lower, data.box.upper))
    axes.set_aspect("equal")
    axes.set_xlim(lower[0], upper[0])
    axes.set_ylim(lower[1], upper[1])
    for which, name in ((axes.xaxis, plane.across), (axes.yaxis, plane.up)):
        which.set_label_text(f"{'xyz'[name]}, {unit.name}")
    return unit


def add_cells(axes: Axes, polygons: Polygons, unit: Unit, colours: Any) -> None:
    """The cells in their colours (k, 4), or white with their outlines."""
    from matplotlib.collections import PolyCollection

    corners = [corner * unit.factor for corner in polygons.corners]
    # Outlines in a cell's own colour close the hairlines between neighbours.
    kind = {"facecolors": "white", "edgecolors": PALE_INK} if colours is None else {
        "facecolors": colours, "edgecolors": "face"
    }  # fmt: skip
    axes.add_collection(PolyCollection(corners, linewidths=0.3, zorder=1, **kind), autolim=False)


def add_discs(axes: Axes, discs: Discs, unit: Unit, colour: str = GRAIN_SECTION) -> None:
    """The grains as circles of their exact radii in the plane."""
    from matplotlib.collections import PatchCollection
    from matplotlib.patches import Circle

    circles = [
        Circle(tuple(centre), radius)
        for centre, radius in zip(discs.centres * unit.factor, discs.radii * unit.factor, strict=True)
    ]
    width = 0.5 if len(circles) < 500 else 0.25
    collection = PatchCollection(circles, facecolor=colour, edgecolor=INK, linewidth=width, zorder=2)
    axes.add_collection(collection, autolim=False)


def add_velocities(
    axes: Axes, data: PictureData, plane: Plane, polygons: Polygons, discs: Discs, unit: Unit
) -> list[str]:
    """An arrow for each pore that has room in the plane: its mean velocity, projected on the plane."""
    assert data.cells is not None and data.velocity is not None
    points, gaps = open_points(polygons, discs)
    pores = data.cells.pore[polygons.cells]
    # Of a pore of several cells, the cell with most room; then those whose point is in the fluid.
    order = np.lexsort((-gaps, pores))
    best = order[np.unique(pores[order], return_index=True)[1]]
    best = best[gaps[best] > _ROOM * data.radii.mean()]
    vectors = plane.project(data.velocity[pores[best]])
    lengths = np.linalg.norm(vectors, axis=1)
    if not len(best) or not lengths.max() > 0.0:
        return ["no arrows: nothing flows in this plane"]
    sides = plane.project(data.box.size[None])[0]
    usual = np.quantile(lengths, 0.9) or lengths.max()
    longest = min(_ARROW * data.radii.mean() * lengths.max() / usual, _ARROW_OF_BOX * sides.min()) * unit.factor
    x, y = (points[best] * unit.factor).T
    u, v = (vectors * (longest / lengths.max())).T
    arrows = axes.quiver(
        x, y, u, v, angles="xy", scale_units="xy", scale=1.0, color=INK, edgecolor="white",
        linewidth=0.3, pivot="mid", zorder=3, width=0.005 if len(best) < 50 else 0.0022, clip_on=False, headwidth=4.5,
        headlength=5.0, headaxislength=4.5, minlength=0.3,
    )  # fmt: skip
    arrows.set_in_layout(False)
    most = in_unit(float(lengths.max()), "m/s")
    return [f"arrows: mean velocity of each pore with room in the plane, the longest {most}"]
