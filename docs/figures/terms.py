"""The figure of docs/glossary.md that shows what the terms of the mesh name, in one small monolayer.

    python docs/figures/terms.py

The centres of 18 spheres lie in one plane, midway between two walls that cut the spheres. Seen along the normal of the
plane, the method is two-dimensional: cells are triangles, facets are lines between two centres. The mesh says which
cells are tied or united, which pores are held, and which throat is covered. The picture goes to docs/img/terms.png.
"""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Circle, Polygon
from small_png import save

from porefv import Box, Packing, PoreMesh, Wall, Walls
from porefv.export.picture_style import FLOW, GRAIN_SECTION, INK, PALE_INK, PictureSize, new_figure, style
from porefv.export.sections import Plane, cut_cells
from porefv.flow.pressure import held_pressures
from porefv.mesh.polyhedra import polyhedra
from porefv.packing.box import WALLS

MM = 1e-3  # m
SIDES = 10.0, 5.0, 0.75  # mm; the walls below and above cut the spheres, so that an overlap can cover a facet
RADIUS = 0.72  # mm
# Places of the spheres in the plane [mm]: four on a square, four nearly on one, two that overlap, and others.
TIED = (2.4, 0.95), (4.1, 0.95), (2.4, 2.65), (4.1, 2.65)
UNITED = (6.1, 2.35), (7.8, 2.352), (6.1, 4.05), (7.803, 4.05)
COVERED = (9.15, 1.25), (9.2, 2.3)
OTHERS = (0.85, 0.85), (0.8, 2.55), (0.9, 4.2), (2.6, 4.25), (4.35, 4.25), (5.8, 0.75), (7.45, 0.8), (9.2, 4.05)
# The spheres around what shows a cell, a pore and a throat: numbers in the order above.
CELL, PORE, THROAT = (15, 16, 4), (2, 3, 13), (3, 4)

ORANGE, BLUE, VIOLET, GREEN, YELLOW = "#f0a64d", "#8fc7e8", "#b7a0da", "#97cf98", "#f5e38c"
NECK, CLOSED = "#c2185b", "#c0392b"
WORDS = 8.2  # points


class Monolayer:
    """The mesh of the spheres at the wall z_min, which has one cell for each triangle of the plane."""

    def __init__(self) -> None:
        self.places = np.array([*TIED, *UNITED, *COVERED, *OTHERS])
        centres = np.column_stack([self.places, np.full(len(self.places), 0.5 * SIDES[2])])
        box = Box([0, 0, 0], np.multiply(SIDES, MM))
        packing = Packing(centres * MM, np.full(len(centres), RADIUS * MM), box)
        self.mesh = PoreMesh(packing, wall_tolerance=1.0)
        self.held = ~np.isnan(held_pressures(self.mesh, Walls(x_min=Wall(pressure=1.0)).pressures))
        self.floor = self.mesh.n_spheres + WALLS.index("z_min")
        found = cut_cells(polyhedra(self.mesh), Plane.through(box, "z", 0.25 * SIDES[2] * MM, upright=1))
        self.triangles = dict(zip(found.cells.tolist(), [corners / MM for corners in found.corners], strict=True))
        self.vertices = self.mesh.vertices[:, :2] / MM

    def cell(self, spheres: tuple[int, ...]) -> int:
        """The cell between three spheres and the floor."""
        return next(c for c in self.triangles if {*spheres, self.floor} == set(self.mesh.cells[c]))

    def throat(self, spheres: tuple[int, ...]) -> int:
        """The throat between two spheres and the floor."""
        return self.mesh.throats.between(*spheres, self.floor)

    def groups(self) -> tuple[list[int], list[int]]:
        """The cells of the tie, and those of the pore that is united without being tied."""
        mesh, cells = self.mesh, np.array(list(self.triangles))
        together = [cells[mesh.cell_pore[cells] == pore] for pore in np.unique(mesh.cell_pore[cells])]
        tied, united = [], []
        for group in (each for each in together if len(each) > 1):
            (tied if len(np.unique(mesh.cell_node[group])) == 1 else united).extend(group.tolist())
        return tied, united

    def ends(self, throat: int) -> np.ndarray:
        """(2, 2): the two Laguerre vertices of a throat [mm]."""
        return self.vertices[self.mesh.facets.cells[self.mesh.throats.first_facets[throat]]]


def main() -> None:
    layer = Monolayer()
    with style():
        figure = new_figure(PictureSize(1600, 1080, 200))
        axes = figure.add_axes((0.01, 0.145, 0.98, 0.71))
        axes.set_xlim(-0.06, SIDES[0] + 0.06)
        axes.set_ylim(-0.06, SIDES[1] + 0.06)
        axes.set_aspect("equal")
        axes.set_axis_off()
        draw(axes, layer)
        label(figure, axes, layer)
        save(figure, "terms")


def draw(axes: Axes, layer: Monolayer) -> None:
    """Voids in the colours of their terms under the spheres, lines over them."""
    mesh, throats = layer.mesh, layer.mesh.throats
    tied, united = layer.groups()
    colours = dict.fromkeys(layer.triangles, "white")
    colours |= {c: YELLOW for c in layer.triangles if layer.held[mesh.cell_pore[c]]}
    colours |= dict.fromkeys(tied, VIOLET) | dict.fromkeys(united, GREEN) | {layer.cell(PORE): BLUE}
    for cell, corners in layer.triangles.items():
        axes.add_patch(Polygon(corners, facecolor=colours[cell], edgecolor="none", zorder=1))
        axes.add_patch(Polygon(corners, facecolor="none", edgecolor=PALE_INK, lw=0.5, zorder=3))
    for place in layer.places:
        axes.add_patch(Circle(place, RADIUS, facecolor=GRAIN_SECTION, edgecolor=INK, lw=0.6, zorder=2))
    axes.add_patch(
        Polygon(layer.triangles[layer.cell(CELL)], facecolor=ORANGE, alpha=0.55, edgecolor=INK, lw=1.2, zorder=4)
    )
    first, second = layer.places[list(THROAT)]
    along = (second - first) / np.linalg.norm(second - first)
    axes.plot(*np.array([first, second]).T, color=INK, lw=2.2, zorder=5, solid_capstyle="butt")
    neck = np.array([first + RADIUS * along, second - RADIUS * along])
    axes.plot(*neck.T, color=NECK, lw=4.5, zorder=6, solid_capstyle="butt")
    axes.plot(*layer.ends(layer.throat(THROAT)).T, color=FLOW, lw=2.2, zorder=7)
    (covered,) = (t for t in np.flatnonzero(throats.covered) if layer.floor in throats.spheres[t])
    axes.plot(*layer.ends(covered).T, color=CLOSED, lw=1.8, ls=(0, (3, 1.5)), zorder=6)
    points = layer.vertices[list(layer.triangles)]
    axes.plot(*points.T, "o", color="white", mec=INK, mew=0.7, ms=3.6, zorder=8, clip_on=False)
    axes.plot([0, 0], [0, SIDES[1]], color=INK, lw=3.0, zorder=9)
    axes.plot([0, SIDES[0], SIDES[0], 0], [0, 0, SIDES[1], SIDES[1]], color=INK, lw=0.8, zorder=0)


def label(figure: Figure, axes: Axes, layer: Monolayer) -> None:
    """Each term with what it means, in two rows, and a line to what it names."""
    first, second = layer.places[list(THROAT)]
    ends = layer.ends(layer.throat(THROAT))
    pair = layer.places[[8, 9]]
    above = (
        ("held", "a pore on a wall\nwith a pressure", (0.4, 3.38)),
        ("pore", "the void of a cell,\nor of united cells", layer.places[list(PORE)].mean(axis=0)),
        ("throat", "joins the Laguerre\nvertices of two pores", 0.25 * ends[0] + 0.75 * ends[1]),
        ("facet", "the face between\ntwo cells", 0.25 * first + 0.75 * second),
        ("united", "two cells, one pore:\nvertices nearly coincide", layer.places[4:8].mean(axis=0)),
    )
    below = (
        ("tied", "two cells, one pore:\nvertices coincide", layer.places[:4].mean(axis=0)),
        ("neck", "the open part\nof a facet", 0.6 * first + 0.4 * second),
        ("cell", "a triangle between\nthree centres", layer.places[list(CELL)].mean(axis=0)),
        ("covered", "its spheres leave\nthe facet no opening", pair.mean(axis=0)),
        ("closed", "a throat without flow,\nhere a covered one", (9.7, 1.75)),
    )
    for terms, name_at, words_at, start in ((above, 0.972, 0.945, 0.876), (below, 0.1, 0.075, 0.122)):
        for column, (name, words, point) in enumerate(terms):
            x = 0.1 + 0.2 * column
            figure.text(x, name_at, name, ha="center", va="center", fontsize=10.0, fontweight="bold")
            figure.text(x, words_at, words, ha="center", va="top", fontsize=WORDS, linespacing=1.15)
            axes.annotate(
                "", point, (x, start), xycoords="data", textcoords="figure fraction", zorder=10, annotation_clip=False,
                arrowprops={"arrowstyle": "-", "color": INK, "lw": 0.8, "shrinkA": 0, "shrinkB": 0},
            )  # fmt: skip


if __name__ == "__main__":
    main()
