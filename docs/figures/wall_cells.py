"""The figure of docs/theory_method.md that shows walls as vertices of the triangulation: the four shapes of a cell.

    python docs/figures/wall_cells.py

The cells are of the 25 spheres of data/packings/n25_s1.csv. The picture goes to docs/img/method_walls.png.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
from small_png import save

from porefv import Box, Packing, PoreMesh
from porefv.export.picture_data import cells_of_mesh
from porefv.export.picture_style import GRAIN, INK, PALE_INK, SMALL, PictureSize, new_figure, style
from porefv.export.rendering import Projection, View, load_pyvista

ROOT = Path(__file__).resolve().parents[2]
CELL, WALL = "#7fc4ea", "#e6d8bf"
SIZE = PictureSize(1600, 520, 200)
# The walls behind and below, as seen in the pictures: x_min, y_min, z_min.
WALLS = ((), (0,), (0, 4), (0, 2, 4))
TITLES = ("four spheres", "three spheres, a wall", "two spheres, two walls", "a sphere, three walls")
PLACES = ("among the spheres", "on the wall", "on the edge of two walls", "at the corner of the box")


def main() -> None:
    mesh = PoreMesh(Packing.read(ROOT / "data" / "packings" / "n25_s1.csv"))
    with style():
        figure = new_figure(SIZE)
        for k, walls in enumerate(WALLS):
            image = picture(mesh, chosen(mesh, walls), walls)
            figure.figimage(image, xo=k * SIZE.width // 4, yo=SIZE.height - image.shape[0], origin="upper", zorder=-1)
            figure.text((k + 0.5) / 4, 0.12, TITLES[k], ha="center", va="center")
            figure.text(
                (k + 0.5) / 4, 0.05, f"vertex {PLACES[k]}", ha="center", va="center", fontsize=SMALL, color=PALE_INK
            )
        save(figure, "method_walls")


def chosen(mesh: PoreMesh, walls: tuple[int, ...]) -> int:
    """The largest cell with these walls alone, whose Laguerre vertex is close to the middle of its corners."""
    n = mesh.n_spheres
    solids = cells_of_mesh(mesh).polyhedra
    found = []
    for cell, vertices in enumerate(mesh.cells):
        if sorted(vertices[vertices >= n] - n) == list(walls):
            nodes = solids.points[solids.connectivity[solids.offsets[cell] : solids.offsets[cell + 1]]]
            off = np.linalg.norm(mesh.vertices[cell] - nodes.mean(axis=0)) / np.ptp(nodes, axis=0).max()
            found.append((mesh.cell_volumes[cell] if off < 0.25 or walls else 0.0, cell))
    return max(found)[1]


def picture(mesh: PoreMesh, cell: int, walls: tuple[int, ...]) -> np.ndarray:
    """A cell with its spheres, its walls and its Laguerre vertex, as pixels."""
    pv = load_pyvista()
    size = PictureSize(SIZE.width // 4, int(0.83 * SIZE.height), SIZE.dpi)
    plotter = pv.Plotter(off_screen=True, window_size=size[:2])
    plotter.set_background("white")
    solids = cells_of_mesh(mesh).polyhedra
    nodes = solids.connectivity[solids.offsets[cell] : solids.offsets[cell + 1]]
    spheres = mesh.cells[cell][mesh.cells[cell] < mesh.n_spheres]
    centres, radii = mesh.packing.centres[spheres], mesh.packing.radii[spheres]
    low, high = (centres - radii[:, None]).min(axis=0), (centres + radii[:, None]).max(axis=0)
    for wall in walls:
        low[wall // 2] = mesh.box.lower[wall // 2]
    view = View(Box(low, high), 2)
    for centre, radius in zip(view.place(centres), radii / view.scale, strict=True):
        ball = pv.Sphere(radius=radius, center=centre, theta_resolution=120, phi_resolution=120)
        plotter.add_mesh(ball, color=GRAIN, opacity=0.45, smooth_shading=True, ambient=0.3)
    grid = pv.UnstructuredGrid(
        np.array([len(nodes), *range(len(nodes))]), [solids.types[cell]], view.place(solids.points[nodes])
    )
    plotter.add_mesh(grid, color=CELL, opacity=0.45, lighting=False)
    plotter.add_mesh(grid.extract_all_edges(), color=INK, line_width=2.5, lighting=False)
    ends = view.place(np.array([low, high]))
    for wall in walls:
        pane = np.array([ends[0], ends[1]])
        pane[:, wall // 2] = ends[0, wall // 2] - 2e-3
        plotter.add_mesh(pv.Box(pane.T.ravel()), color=WALL, lighting=False)
    vertex = pv.Sphere(radius=0.03, center=view.place(mesh.vertices[cell]))
    plotter.add_mesh(vertex, color=INK, lighting=False)
    corners = np.array([np.where(bits, ends[1], ends[0]) for bits in np.ndindex(2, 2, 2)])
    Projection(view, corners, size, (0.05, 0.95, 0.03, 0.97)).aim(plotter)
    plotter.enable_depth_peeling(12)
    plotter.enable_anti_aliasing("ssaa")
    image = plotter.screenshot(return_img=True)
    plotter.close()
    return image


if __name__ == "__main__":
    main()
