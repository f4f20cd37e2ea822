"""The figure of docs/theory_section_friction.md: one throat with its facet, its length, its surfaces, its sections.

    python docs/figures/throat.py

The throat is one of the 25 spheres of data/packings/n25_s1.csv. Left: the pair of pyramids from the facet to the two
Laguerre vertices. Right: the plane of the facet, seen along the axis of the throat. The picture goes to
docs/img/method_throat.png.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Arc, Circle, Polygon
from small_png import save

from porefv import Box, Packing, PoreMesh
from porefv.conductance.section_friction import centres_of_pores
from porefv.export.picture_style import GRAIN, GRAIN_SECTION, INK, PALE_INK, SMALL, PictureSize, new_figure, style
from porefv.export.rendering import Projection, View, load_pyvista

ROOT = Path(__file__).resolve().parents[2]
FLUID, WETTED, CENTRE, VOID = "#7fc4ea", "#e8743b", "#c2185b", "#bfe0f3"
SIZE = PictureSize(1600, 860, 200)
# Heights of the sections that the right part shows, relative to the radius of the smallest sphere.
HEIGHTS = (0.4, 0.7)


class Throat:
    """A throat between spheres alone, in a frame with the facet in the plane z = 0 and the axis along z."""

    def __init__(self, mesh: PoreMesh, pore_centres: np.ndarray, number: int):
        facet = mesh.throats.first_facets[number]
        self.spheres = mesh.facets.vertices[facet]
        cells = mesh.facets.cells[facet]
        centres, axis = mesh.packing.centres[self.spheres], mesh.throats.normals[number]
        origin = centres.mean(axis=0)
        self.radii = mesh.packing.radii[self.spheres]
        # The viewer stands towards (1, 0.9): the largest sphere is behind, the gap between the others in front.
        behind = centres[self.radii.argmax()] - origin
        behind, beside = behind / np.linalg.norm(behind), np.cross(axis, behind) / np.linalg.norm(behind)
        turn = -np.array([1.0, 0.9]) / np.hypot(1.0, 0.9)
        frame = np.array([turn[0] * behind - turn[1] * beside, turn[1] * behind + turn[0] * beside, axis])
        self.centres = (centres - origin) @ frame.T
        self.vertices = (mesh.vertices[cells] - origin) @ frame.T
        self.pore_centres = (pore_centres[cells] + mesh.triangulation.origin - origin) @ frame.T
        shifts = np.linalg.norm(self.pore_centres - self.vertices, axis=1)
        self.shift = shifts.max() / self.radii.min()

    @property
    def corners(self) -> np.ndarray:
        """(3, 2): the facet."""
        return self.centres[:, :2]

    def holds(self, point: np.ndarray) -> bool:
        """Whether a point of the plane lies well inside the facet."""
        a, b = self.corners, np.roll(self.corners, -1, axis=0)
        side, out = b - a, point - a
        areas = side[:, 0] * out[:, 1] - side[:, 1] * out[:, 0]
        return bool(np.abs(np.sign(areas).sum()) == 3 and np.abs(areas).min() > 0.15 * np.abs(areas).sum())


def main() -> None:
    mesh = PoreMesh(Packing.read(ROOT / "data" / "packings" / "n25_s1.csv"))
    throat = chosen(mesh)
    with style():
        figure = new_figure(SIZE)
        draw_solid(figure, throat)
        draw_plan(figure.add_axes((0.63, 0.1, 0.36, 0.8)), throat)
        save(figure, "method_throat")


def chosen(mesh: PoreMesh) -> Throat:
    """A long, open throat between spheres whose axis passes through its facet, one of its pore centres moved."""
    pore_centres = centres_of_pores(mesh.throats)
    found = []
    for number in np.flatnonzero(~mesh.throats.closed):
        if (mesh.facets.vertices[mesh.throats.first_facets[number]] >= mesh.n_spheres).any():
            continue
        throat = Throat(mesh, pore_centres, number)
        low, high = throat.vertices[:, 2] / throat.radii.min()
        if throat.holds(throat.vertices[0, :2]) and low < -0.2 and high > 0.2 and 0.1 < throat.shift < 0.6:
            found.append((min(-low, high), throat))
    print(f"{len(found)} throats to choose from")
    return max(found, key=lambda each: each[0])[1]


def draw_solid(figure: Figure, throat: Throat) -> None:
    """The pair of pyramids with the wetted surfaces, and what the symbols name."""
    pv = load_pyvista()
    plotter = pv.Plotter(off_screen=True, window_size=(SIZE.width, SIZE.height))
    plotter.set_background("white")
    points = np.concatenate([throat.centres, throat.vertices, throat.pore_centres])
    view = View(Box(points.min(axis=0) - throat.radii.max(), points.max(axis=0) + throat.radii.max()), 2)
    place, size = view.place, throat.radii.max() / view.scale
    triangle = place(throat.centres)

    for centre, radius in zip(triangle, throat.radii / view.scale, strict=True):
        ball = pv.Sphere(radius=radius, center=centre, theta_resolution=160, phi_resolution=160)
        plotter.add_mesh(ball, color=GRAIN, opacity=0.22, smooth_shading=True, lighting=True, ambient=0.4)
    middle = triangle.mean(axis=0)
    for vertex in place(throat.vertices):
        apex = triangle.mean(axis=0) + (vertex - middle)
        faces = [(*pair, apex) for pair in zip(triangle, np.roll(triangle, -1, axis=0), strict=True)]
        for corners in faces:
            plotter.add_mesh(
                pv.PolyData(np.array(corners), faces=[3, 0, 1, 2]), color=VOID, opacity=0.3, lighting=False
            )
            plotter.add_mesh(pv.Line(corners[0], apex), color=PALE_INK, line_width=2.0, lighting=False)
        inner = 0.25 * (triangle.sum(axis=0) + apex)
        for centre, radius in zip(triangle, throat.radii / view.scale, strict=True):
            patch = pv.Sphere(radius=1.004 * radius, center=centre, theta_resolution=500, phi_resolution=500)
            for corners in (*faces, tuple(triangle)):
                normal = np.cross(corners[1] - corners[0], corners[2] - corners[0])
                patch = patch.clip(normal * np.sign(normal @ (inner - corners[0])), origin=corners[0], invert=False)
            if patch.n_points:
                plotter.add_mesh(patch, color=WETTED, opacity=0.85, lighting=True, ambient=0.3)
    facet = pv.PolyData(triangle, faces=[3, 0, 1, 2])
    plotter.add_mesh(facet, color=FLUID, lighting=False)
    for k, (centre, radius) in enumerate(zip(triangle, throat.radii / view.scale, strict=True)):
        for side in (-1e-3, 1e-3):  # the solid part of the facet, seen from above and from below
            sector = pv.Disc(center=np.add(centre, (0.0, 0.0, side)), inner=0.0, outer=radius, c_res=400)
            for other in (triangle[(k + 1) % 3], triangle[(k + 2) % 3]):
                normal = np.cross(other - centre, [0.0, 0.0, 1.0])
                sector = sector.clip(normal * np.sign(normal @ (middle - centre)), origin=centre, invert=False)
            plotter.add_mesh(sector, color=GRAIN_SECTION, lighting=False)
    plotter.add_mesh(pv.lines_from_points(triangle, close=True), color=INK, line_width=4.0, lighting=False)
    low, high = place(throat.vertices)
    plotter.add_mesh(pv.Line(low, high), color=INK, line_width=3.0, lighting=False)
    moved = int(np.abs(throat.pore_centres - throat.vertices).sum(axis=1).argmax())
    centre_of_pore = place(throat.pore_centres)[moved]
    for point, colour in ((low, INK), (high, INK), (centre_of_pore, CENTRE)):
        plotter.add_mesh(pv.Sphere(radius=0.035 * size, center=point), color=colour, lighting=False)

    extent = np.concatenate(
        [triangle - size * axis for axis in np.vstack([view.across, -view.across, view.up, -view.up])]
    )
    extent = np.concatenate([extent, [low, high]])
    projection = Projection(view, extent, SIZE, (0.02, 0.6, 0.1, 0.98))
    projection.aim(plotter)
    plotter.enable_depth_peeling(12)
    plotter.enable_anti_aliasing("ssaa")
    figure.figimage(plotter.screenshot(return_img=True), origin="upper", zorder=-1)
    plotter.close()

    def label(point: np.ndarray, text: str, dx: float, dy: float, colour: str = INK) -> None:
        x, y = projection.fraction(point)
        figure.text(x + dx, y + dy, text, color=colour, ha="center", va="center", fontsize=10.0)

    label(high, "$P_j$", 0.0, 0.035)
    label(low, "$P_i$", 0.0, -0.035)
    label(0.6 * high + 0.4 * middle, "$L$", -0.014, 0.0)
    label(centre_of_pore, "pore centre", -0.062, 0.0, CENTRE)
    back = int((triangle @ view.towards).argmin())
    front = [k for k in range(3) if k != back]
    opening = projection.fraction(place(throat.vertices * [1, 1, 0])[0])
    figure.text(opening[0] - 0.2, opening[1] + 0.02, "$A^f$", ha="center", va="center", fontsize=10.0)
    figure.add_artist(Line2D([opening[0] - 0.185, opening[0] - 0.014], [opening[1] + 0.02, opening[1] + 0.004],
                             color=INK, lw=0.6))  # fmt: skip
    label(0.75 * triangle[front[0]] + 0.25 * triangle[front[1]], "$A$", 0.0, 0.025)
    label(0.45 * triangle[back] + 0.55 * high, "$\\gamma$", 0.004, -0.035)
    label(0.8 * low + 0.2 * middle, "$\\varphi$", 0.018, 0.0)
    for k in range(3):
        label(triangle[k], f"$c_{k + 1}$", 0.055 if k == back else 0.0, 0.035 if k == back else -0.03)
    figure.text(
        0.3, 0.045, "Blue: the void $\\varphi$ is in the pair of pyramids, outside the spheres.\n"
        "Orange: the wetted surfaces $\\gamma$ of the three spheres.",
        ha="center", va="center", fontsize=SMALL, color=PALE_INK,
    )  # fmt: skip


def draw_plan(axes: Axes, throat: Throat) -> None:
    """The facet from above: A^f, A^k, θ, and the discs of the spheres at two heights."""
    corners, radii = throat.corners, throat.radii
    axes.add_patch(Polygon(corners, facecolor=FLUID, edgecolor="none", zorder=1))
    inside = Polygon(corners, facecolor="none", edgecolor=INK, lw=1.0, zorder=4)
    for k, (corner, radius) in enumerate(zip(corners, radii, strict=True)):
        axes.add_patch(Circle(corner, radius, facecolor=GRAIN_SECTION, edgecolor=INK, lw=0.8, zorder=2))
        for height in HEIGHTS:
            disc = np.sqrt(radius**2 - (height * radii.min()) ** 2)
            axes.add_patch(Circle(corner, disc, facecolor="none", edgecolor=PALE_INK, lw=0.6, ls="--", zorder=3))
        before, after = (corners[j] - corner for j in ((k + 1) % 3, (k + 2) % 3))
        angles = np.sort(np.degrees([np.arctan2(*side[::-1]) for side in (before, after)]))
        if angles[1] - angles[0] > 180.0:
            angles = np.array([angles[1], angles[0] + 360.0])
        half = np.radians(angles.mean())
        towards = np.array([np.cos(half), np.sin(half)])
        axes.text(*(corner + 0.39 * radius * towards), f"$\\theta_{k + 1}$", ha="center", va="center", fontsize=SMALL)
        axes.text(*(corner + 0.62 * radius * towards), f"$A^{k + 1}$", ha="center", va="center", zorder=6)
        away = corner - 0.14 * radii.max() * towards
        axes.text(*away, f"$c_{k + 1}$", ha="center", va="center")
        axes.add_patch(Arc(corner, 0.5 * radius, 0.5 * radius, theta1=angles[0], theta2=angles[1], lw=0.8, zorder=5))
    axes.add_patch(inside)
    axes.set_aspect("equal")
    low, high = corners.min(axis=0), corners.max(axis=0)
    room = 0.35 * radii.max()
    axes.set_xlim(low[0] - room, high[0] + room)
    axes.set_ylim(low[1] - room, high[1] + room)
    axes.set_axis_off()
    axes.text(*throat.vertices[0, :2], "$A^f$", ha="center", va="center", fontsize=10.0)
    heights = " and ".join(f"{height:g}" for height in HEIGHTS)
    axes.text(
        0.5, -0.02, f"The plane of the facet. Dashed: the discs at heights\nof {heights} of the smallest radius.",
        ha="center", va="top", transform=axes.transAxes, fontsize=SMALL, color=PALE_INK,
    )  # fmt: skip


if __name__ == "__main__":
    main()
