"""Pictures of packings, meshes and flows: the kinds that `porefv plot` draws, too.

Typically: `flow.plot("section", axis="x").save("section.svg")`.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import product
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from porefv.errors import InputError
from porefv.export.html_scenes import write_html
from porefv.export.picture_data import (
    KINDS,
    SECTIONS,
    PictureData,
    check_kind,
    data_of_flow,
    data_of_mesh,
    data_of_packing,
)
from porefv.export.picture_output import Picture
from porefv.export.picture_style import (
    FLOW,
    INK,
    SIZE,
    Colours,
    Layout,
    PictureSize,
    new_figure,
    round_length,
    style,
    unit_for,
)
from porefv.export.rendering import Projection, View, load_pyvista
from porefv.export.scenes_3d import TRIANGLES, Scene
from porefv.export.section_pictures import section_picture
from porefv.flow.pore_flow import PoreFlow
from porefv.mesh.pore_mesh import PoreMesh
from porefv.packing.packing import Packing

if TYPE_CHECKING:
    from matplotlib.figure import Figure

__all__ = ["KINDS", "draw", "picture"]


def picture(
    sample: PoreFlow | PoreMesh | Packing,
    what: str | None = None,
    *,
    axis: str | None = None,
    at: float | None = None,
    title: str = "",
    size: PictureSize | tuple[int, int] = SIZE,
    dpi: float | None = None,
) -> Picture:
    """A picture of a flow, a mesh or a packing; what it shows is computed, if it is not yet.

    Parameters
    ----------
    sample : PoreFlow, PoreMesh or Packing
    what : str, optional
        One of `KINDS`. In three dimensions: "packing" (grains), "forces" (grains coloured by the force on them, cut
        open to show the pressures), "pressure" (the same with grey grains), "network" (throats as wide as their flux,
        coloured by pressure), "throats" (as wide as their constrictions, coloured by the mean speed there), "paths"
        (200 paths of particles, coloured by the time since they entered; of a flow). In a
        plane: "section" (grains as discs, pores coloured by pressure), "velocity" (pores coloured by speed, with
        arrows). By default "forces" of a flow, "section" of a mesh, "packing" of a packing.
    axis, at
        Of a section: the axis to which its plane is normal, "x", "y" or "z", and its place along it [m].
    title : str
    size : (int, int)
        Width and height [pixels].
    dpi : float, optional
        Pixels per inch: how large letters and lines are.

    Returns
    -------
    Picture

    Raises
    ------
    InputError
        For an unknown kind, what the sample does not have, or a plane outside the box.
    MissingExtraError
        If matplotlib is not installed, or pyvista for pictures in three dimensions.
    ComputationError
        If this machine cannot draw in three dimensions.

    Examples
    --------
    >>> mesh = PoreMesh(Packing.read("data/packings/n25_s1.csv"))
    >>> mesh.plot("section", axis="z", at=0.4, size=(800, 600), dpi=100)
    Picture(800 x 600 pixels)
    """
    if isinstance(sample, PoreFlow):
        data = data_of_flow(sample, what := what or "forces")
    elif isinstance(sample, PoreMesh):
        data = data_of_mesh(sample, what := what or "section")
    elif isinstance(sample, Packing):
        data = data_of_packing(sample, what := what or "packing")
    else:
        raise InputError(f"there are pictures of a PoreFlow, a PoreMesh and a Packing, not of {sample!r}")
    return draw(data, what, axis=axis, at=at, title=title, size=size, dpi=dpi)


def draw(
    data: PictureData,
    what: str,
    *,
    axis: str | None = None,
    at: float | None = None,
    title: str = "",
    size: PictureSize | tuple[int, int] = SIZE,
    dpi: float | None = None,
) -> Picture:
    """A picture of data; parameters and errors as of `picture`."""
    check_kind(what)
    size = PictureSize.of(size, dpi)
    if what in SECTIONS:
        return section_picture(data, what, axis=axis, at=at, title=title, size=size)
    if axis is not None or at is not None:
        raise InputError(f"axis and at are those of a plane ({' and '.join(SECTIONS)}); the picture {what} has none")
    return _picture_3d(data, what, title, size)


def _picture_3d(data: PictureData, what: str, title: str, size: PictureSize) -> Picture:
    """The sample, flow axis upright, rendered, with its scales drawn around it."""
    load_pyvista()
    plotter, scene, marks = _plotter(data, what, size, TRIANGLES)
    image = plotter.screenshot(return_img=True)
    plotter.close()
    notes = tuple(scene.notes)

    def html(path: Path) -> None:
        # What a browser turns is lighter.
        plotter, scene, _ = _plotter(data, what, size, TRIANGLES // 5)
        with style():
            legend = new_figure(size)
            legend.patch.set_alpha(0.0)
            _explain(legend, size, title, scene.colours, (*scene.notes, f"the bar is {marks['bar'].text} long"))
        write_html(plotter, legend, path, title)

    with style():
        figure = new_figure(size)
        figure.figimage(image, origin="upper", zorder=-1)
        _explain(figure, size, title, scene.colours, notes)
        for mark in marks.values():
            x, y = mark.place
            figure.text(x, y, mark.text, color=mark.colour, ha=mark.across, va=mark.upwards)
    return Picture(figure, notes, html)


class _Mark(NamedTuple):
    """A text beside the sample: its place in the view or, as fractions, in the picture; its colour and alignment."""

    place: Any
    text: str
    colour: str
    across: str
    upwards: str


def _plotter(data: PictureData, what: str, size: PictureSize, triangles: int) -> tuple[Any, Scene, dict[str, _Mark]]:
    """A plotter with the sample in it, and the texts beside it."""
    pv = load_pyvista()
    plotter = pv.Plotter(off_screen=True, window_size=(size.width, size.height))
    plotter.set_background("white")
    view = View(data.box, 2 if data.axis is None else data.axis)
    scene = Scene(pv, plotter, data, view, triangles, line_width=1.5 * size.dpi / SIZE.dpi)
    scene.fill(what)
    # Of the box from what stands beside it: in a small picture letters are larger.
    gap = 0.06 * max(1.0, SIZE.inches[0] / size.inches[0]) + scene.margin
    extent = [view.corner(*signs) for signs in product((-1, 1), repeat=3)]
    # A bar of a round length, below the lower edge at the right.
    side = float(2.0 * view.half[view.left])
    length = round_length(0.5 * side * view.scale)
    start = view.corner(1, 1, -1) + gap * view.normal(view.right) - gap * view.normal(view.axis)
    end = start - view.normal(view.left) * length / view.scale
    scene.add_length_bar(start, end)
    unit = unit_for(length, "m")
    below = 0.5 * (start + end) + 0.03 * view.across - 0.015 * view.up
    marks = {"bar": _Mark(below, f"{length * unit.factor:.6g} {unit.name}", INK, "left", "top")}
    extent += [start, end, below - 0.05 * view.up]
    if (sense := _sense(data)) != 0.0:
        arrow = 0.3 * min(2.0 * view.half[view.axis], 1.0)
        tail = view.corner(1, -1, 0) + gap * view.normal(view.left) - gap * view.normal(view.right)
        tail = tail - 0.5 * sense * arrow * view.normal(view.axis)
        scene.add_arrow(tail, sense * arrow * view.normal(view.axis))
        below = tail - 0.03 * sense * view.normal(view.axis)
        marks["flow"] = _Mark(below, "flow", FLOW, "center", "top" if sense > 0.0 else "bottom")
        extent += [tail - 0.06 * view.across, tail - 0.06 * view.up * sense]
    projection = Projection(view, np.array(extent), size, Layout(size, scene.notes).free, margin=scene.margin)
    projection.aim(plotter)
    plotter.enable_anti_aliasing("msaa", multi_samples=8)
    return plotter, scene, {name: mark._replace(place=projection.fraction(mark.place)) for name, mark in marks.items()}


def _sense(data: PictureData) -> float:
    """1 where fluid flows up the upright axis, -1 where it flows down; 0 if the walls drive no flow along it."""
    if data.walls is None or data.axis is None:
        return 0.0
    lower, upper = data.walls.pressures[2 * data.axis : 2 * data.axis + 2]
    return float(np.sign(lower - upper))


def _explain(figure: Figure, size: PictureSize, title: str, colours: list[Colours], notes: Sequence[str]) -> None:
    """Title, scales of colours one above the other, and notes."""
    layout = Layout(size, notes)
    layout.write(figure, title)
    for place, scale in enumerate(colours):
        scale.draw(figure.add_axes(layout.scale(place, len(colours))))
