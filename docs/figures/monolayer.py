"""The figure of docs/theory_method.md that shows the method in two dimensions: a monolayer between slip walls.

    python docs/figures/monolayer.py

All centres lie in one plane, midway between two walls with slip. In this plane the method is two-dimensional: cells are
triangles, throats are the gaps between two discs. The picture goes to docs/img/method_monolayer.png.
"""

from __future__ import annotations

import numpy as np
from small_png import save

from porefv import Box, Fluid, Packing, PoreFlow, Walls
from porefv.export.picture_data import data_of_flow
from porefv.export.picture_style import FLOW, INK, PRESSURES, Colours, PictureSize, new_figure, style
from porefv.export.section_pictures import add_cells, add_discs, frame
from porefv.export.sections import Plane, cut_cells, cut_spheres

LENGTH, HEIGHT, THICKNESS = 12e-3, 6e-3, 2.2e-3  # m
GRAINS, SOLID = 60, 0.74  # number, and part of the plane that is solid
PRESSURE = 1e-3  # Pa


def main() -> None:
    packing = monolayer()
    walls = Walls.from_mapping({
        "x_min": {"pressure": PRESSURE}, "x_max": {"pressure": 0.0}, "y_min": {"slip": False},
        "y_max": {"slip": False}, "z_min": {"slip": True}, "z_max": {"slip": True},
    })  # fmt: skip
    flow = PoreFlow(packing, walls, Fluid(viscosity=1e-3))
    mesh, throats = flow.mesh, flow.mesh.throats
    # Each triangle is the base of two cells, one to either wall; those at z_min make the picture.
    below = Plane.through(mesh.box, "z", 0.25 * THICKNESS, upright=1)
    middle = Plane.through(mesh.box, "z", upright=1)
    data = data_of_flow(flow, "section")
    polygons = cut_cells(data.cells.polyhedra, below)
    pores = np.unique(mesh.cell_pore[polygons.cells])

    with style():
        figure = new_figure(PictureSize(1500, 700, 200))
        axes = figure.add_axes((0.055, 0.115, 0.79, 0.87))
        unit = frame(axes, data, middle)
        scale = Colours.over("pressure", "Pa", 0.0, PRESSURE, PRESSURES)
        add_cells(axes, polygons, unit, scale.of(flow.pressure[mesh.cell_pore[polygons.cells]]))
        add_discs(axes, cut_spheres(packing.centres, packing.radii, middle), unit)
        for corners in polygons.corners:  # the triangulation
            loop = np.vstack([corners, corners[:1]]) * unit.factor
            axes.plot(*loop.T, color=INK, lw=0.35, zorder=3)
        inside = np.isin(throats.pores, pores).all(axis=1) & (flow.flux != 0.0)
        points = middle.project(mesh.pore_centres) * unit.factor
        widest = np.abs(flow.flux[inside]).max()
        for (i, j), flux in zip(throats.pores[inside], np.abs(flow.flux[inside]), strict=True):
            axes.plot(*points[[i, j]].T, color=FLOW, lw=9.0 * flux / widest, zorder=4, solid_capstyle="round")
        axes.plot(*points[pores].T, "o", color="white", mec=INK, mew=0.6, ms=3.2, zorder=5, clip_on=False)
        scale.draw(figure.add_axes((0.875, 0.2, 0.015, 0.6)))
        save(figure, "method_monolayer")


def monolayer() -> Packing:
    """Discs of three sizes, moved apart until none overlaps."""
    random = np.random.default_rng(7)
    sizes = random.choice([0.6, 0.8, 1.0], GRAINS)
    radii = sizes * np.sqrt(SOLID * LENGTH * HEIGHT / (np.pi * (sizes**2).sum()))
    places = random.uniform(size=(GRAINS, 2)) * [LENGTH, HEIGHT]
    for _ in range(20_000):
        between = places[:, None] - places
        distances = np.linalg.norm(between, axis=2) + np.eye(GRAINS)
        depths = np.maximum(1.02 * (radii[:, None] + radii) - distances, 0.0) * (1.0 - np.eye(GRAINS))
        if depths.max() < 0.019 * radii.min():
            break
        places += 0.3 * (between / distances[..., None] * depths[..., None]).sum(axis=1)
        places = np.clip(places, radii[:, None], np.array([LENGTH, HEIGHT]) - radii[:, None])
    else:
        raise RuntimeError("the discs still overlap: take a smaller part of solid")
    centres = np.column_stack([places, np.full(GRAINS, 0.5 * THICKNESS)])
    return Packing(centres, radii, Box([0, 0, 0], [LENGTH, HEIGHT, THICKNESS]))


if __name__ == "__main__":
    main()
