"""The contents of pictures in three dimensions: grains, sections of pores, and networks, as PyVista's meshes."""

from __future__ import annotations

from typing import Any

import numpy as np

from porefv.errors import InputError, counted
from porefv.export.picture_data import Cells, Network, PictureData
from porefv.export.picture_style import (
    FLOW,
    FORCES,
    GRAIN,
    GRAIN_SECTION,
    INK,
    PRESSURES,
    TIMES,
    Colours,
    in_unit,
)
from porefv.export.rendering import View
from porefv.flow.paths import Paths

TRIANGLES = 1_500_000  # about as many as all balls together may have
# Grains are translucent around a network of at most so many of them, and left out around a larger one.
_GRAINS_AROUND_NETWORK = 60
# Radius of the widest tube of a network, relative to the mean radius of the grains.
_WIDEST = 0.3
# The same relative to the longest side of the box, for boxes of few grains.
_WIDEST_OF_BOX = 0.04
# The same of the paths of particles.
_PATH, _PATH_OF_BOX = 0.05, 0.004


class Scene:
    """What a plotter is filled with.

    Parameters
    ----------
    pyvista : module
    plotter : pyvista.Plotter
    data : PictureData
    view : View
    triangles : int
        About as many as all balls together may have.
    line_width : float
        Of thin lines [pixels].

    Attributes
    ----------
    colours : list of Colours
        The scales that explain what was added.
    notes : list of str
        What was left out, and why.
    margin : float
        How far what was added may reach beyond the box, in the view.
    """

    def __init__(self, pyvista: Any, plotter: Any, data: PictureData, view: View, triangles: int, line_width: float):
        self.pv, self.plotter, self.data, self.view = pyvista, plotter, data, view
        self.triangles, self.line_width = triangles, line_width
        self.colours: list[Colours] = []
        self.notes: list[str] = []
        self.margin = 0.0
        self._points = view.place(data.centres)
        self._radii = data.radii / view.scale

    # ---- kinds of pictures ------------------------------------------------------------------------------------

    def fill(self, what: str) -> None:
        """Add all that a kind of picture shows."""
        if what in ("forces", "pressure"):
            opened = self.data.pressure is not None
            self._add_grains(opened, by_force=what == "forces")
            if self.data.cells is not None and self.data.pressure is not None:
                self._add_pressures(self.data.cells, self.data.pressure)
            else:
                self.notes.append("not cut open: there is no pressure in these results")
        elif what == "packing":
            self._add_grains(opened=False, by_force=False)
        else:
            if len(self._radii) <= _GRAINS_AROUND_NETWORK:
                self._add_grains(opened=False, by_force=False, opacity=0.15)
            else:
                self.notes.append("grains are left out")
            if self.data.paths is not None:
                self._add_paths(self.data.paths)
            elif self.data.network is not None:
                self._add_network(self.data.network, what)
        self.plotter.add_mesh(
            self.pv.Box(np.stack([-self.view.half, self.view.half], axis=1).ravel()).extract_all_edges(),
            color=INK, line_width=self.line_width, lighting=False,
        )  # fmt: skip

    # ---- grains and pores -------------------------------------------------------------------------------------

    def _add_grains(self, opened: bool, by_force: bool, opacity: float = 1.0) -> None:
        view, points, radii = self.view, self._points, self._radii
        look: dict[str, Any] = {"color": GRAIN}
        values = np.zeros(len(radii))
        if by_force and self.data.force is not None:
            sizes = np.linalg.norm(self.data.force, axis=1)
            if not sizes.max() > 0.0:
                self.notes.append("no force acts on any grain")
            scale = Colours.over("force on a grain", "N", 0.0, float(sizes.max()), FORCES)
            self.colours.append(scale)
            values = sizes * scale.unit.factor
            look = _by_scalars("force", scale)
        # The cut leaves whole balls, and parts of those that reach across its two planes.
        reach = points[:, [view.left, view.right]]
        cut, gone = np.zeros((2, len(radii)), bool)
        if opened:
            cut[:] = (reach + radii[:, None] > 0.0).all(axis=1)
            gone[:] = (reach - radii[:, None] >= 0.0).all(axis=1)
        # The finer the fewer; a grain of 9 spheres deserves a smooth outline, one of 10^5 is a few pixels wide.
        resolution = int(np.clip(np.sqrt(self.triangles / len(radii) / 2), 8, 60))
        ball = self.pv.Sphere(radius=1.0, theta_resolution=resolution, phi_resolution=resolution)

        def balls(chosen: np.ndarray) -> Any:
            centres = self.pv.PolyData(points[chosen])
            centres["radius"], centres["force"] = radii[chosen], values[chosen]
            return centres.glyph(scale="radius", geom=ball, orient=False)

        surface = self.pv.PolyData()
        if (~cut).any():
            surface = balls(~cut)
        if np.any(cut & ~gone):
            crossing = balls(cut & ~gone)
            behind, before = crossing.clip(view.normal(view.left), origin=(0, 0, 0), return_clipped=True)
            parts = behind.append_polydata(before.clip(view.normal(view.right), origin=(0, 0, 0)))
            surface = surface.append_polydata(parts) if surface.n_points else parts
        if surface.n_points:
            self.plotter.add_mesh(
                surface, smooth_shading=True, ambient=0.15, specular=0.25, specular_power=20, opacity=opacity, **look
            )

    def _add_pressures(self, cells: Cells, pressure: np.ndarray) -> None:
        """The two faces of the cut: the pores' pressures, and the grains' sections laid upon them."""
        view, solids = self.view, cells.polyhedra
        scale = Colours.over("pressure", "Pa", float(pressure.min()), float(pressure.max()), PRESSURES)
        self.colours.append(scale)
        sizes = np.diff(solids.offsets)
        connectivity = np.insert(solids.connectivity, solids.offsets[:-1], sizes)
        grid = self.pv.UnstructuredGrid(connectivity, solids.types, view.place(solids.points))
        grid["pressure"] = pressure[cells.pore] * scale.unit.factor
        look = _by_scalars("pressure", scale) | {"lighting": False}
        for axis, other in ((view.left, view.right), (view.right, view.left)):
            normal, beyond = view.normal(axis), view.normal(other)
            section = grid.slice(normal=normal, origin=(0, 0, 0)).clip(-beyond, origin=(0, 0, 0))
            self.plotter.add_mesh(section, **look)
            heights = self._points[:, axis]
            crossed = np.flatnonzero(np.abs(heights) < self._radii)
            if len(crossed) == 0:
                continue
            centres = self.pv.PolyData(self._points[crossed])
            centres.points[:, axis] = 1e-3  # just before the pores
            centres["radius"] = np.sqrt(self._radii[crossed] ** 2 - heights[crossed] ** 2)
            disc = self.pv.Disc(inner=0.0, outer=1.0, normal=normal, c_res=60)
            discs = centres.glyph(scale="radius", geom=disc, orient=False).clip(-beyond, origin=(0, 0, 0))
            self.plotter.add_mesh(discs, color=GRAIN_SECTION, lighting=False)

    # ---- networks ---------------------------------------------------------------------------------------------

    def _add_network(self, network: Network, what: str) -> None:
        """Throats as tubes: as wide as their flux, or as their constriction."""
        flux, pressure = self.data.flux, self.data.pressure
        count, is_open = len(network.pores), network.fluid_areas > 0.0
        if not is_open.any():
            raise InputError(
                f"nothing to draw: of {counted(count, 'throat')} none is open (A^f is zero or less, or its spheres "
                "cover it)"
            )
        shown, without = is_open, "closed"
        if flux is not None:
            if not np.abs(flux).max() > 0.0:
                raise InputError(f"nothing to draw: nothing flows through any of {counted(count, 'throat')}")
            shown, without = is_open & (flux != 0.0), "without flow"
        if (missing := count - int(np.count_nonzero(shown))) > 0:
            self.notes.append(f"{missing} of {counted(count, 'throat')} left out: {without}")
        widest = min(_WIDEST * float(self._radii.mean()), _WIDEST_OF_BOX)
        if what == "throats":
            widths = np.sqrt(network.fluid_areas / np.pi) / self.view.scale
        elif flux is None:
            widths = np.full(count, 0.3 * widest)
            self.notes.append("all throats have one width: there is no flux in these data")
        else:
            sizes = np.abs(flux)
            widths = widest * sizes / sizes.max()
            self.notes.append(f"width in proportion to the flux, the widest {in_unit(float(sizes.max()), 'm³/s')}")
        self.margin = float(widths[shown].max())
        ends = network.pores[shown]
        look: dict[str, Any] = {"color": FLOW}
        values = np.zeros((len(ends), 2))
        if what == "network" and pressure is not None:
            scale = Colours.over("pressure", "Pa", float(pressure.min()), float(pressure.max()), PRESSURES)
            self.colours.append(scale)
            values, look = pressure[ends] * scale.unit.factor, _by_scalars("value", scale)
        elif what == "throats" and flux is not None:
            speeds = np.abs(flux[shown]) / network.fluid_areas[shown]
            scale = Colours.of_speeds("mean speed in the\nconstriction", speeds)
            self.colours.append(scale)
            values, look = np.repeat(speeds[:, None] * scale.unit.factor, 2, axis=1), _by_scalars("value", scale)
        lines = self.pv.PolyData(self.view.place(network.points)[ends].reshape(-1, 3))
        lines.lines = np.column_stack([np.full(len(ends), 2), np.arange(2 * len(ends)).reshape(-1, 2)]).ravel()
        lines["value"] = values.ravel()
        lines["width"] = np.repeat(widths[shown], 2)
        sides = int(np.clip(self.triangles / (4 * len(ends)), 6, 24))
        tubes = lines.tube(scalars="width", absolute=True, n_sides=sides, capping=True)
        self.plotter.add_mesh(tubes, smooth_shading=True, ambient=0.2, specular=0.2, **look)

    def _add_paths(self, paths: Paths) -> None:
        """Paths as thin tubes, coloured by the time since the particle entered."""
        # A particle that stays long in a corner would leave one colour to all others.
        scale = Colours.of_most("time since entry", "s", paths.residence_times, 0.9, TIMES)
        self.colours.append(scale)
        self.notes.append(f"{counted(len(paths), 'path')} of particles, sampled by flux")
        radius = min(_PATH * float(self._radii.mean()), _PATH_OF_BOX)
        lines = self.pv.PolyData(self.view.place(paths.points))
        sizes = np.diff(paths.offsets)
        lines.lines = np.insert(np.arange(len(paths.points)), paths.offsets[:-1], sizes)
        lines["time"] = paths.times * scale.unit.factor
        sides = int(np.clip(self.triangles / (4 * len(paths.points)), 6, 16))
        tubes = lines.tube(radius=radius, n_sides=sides, capping=True)
        self.margin = radius
        self.plotter.add_mesh(tubes, smooth_shading=True, ambient=0.2, specular=0.2, **_by_scalars("time", scale))

    # ---- what explains ----------------------------------------------------------------------------------------

    def add_arrow(self, start: np.ndarray, direction: np.ndarray) -> None:
        """An arrow of the flow, from a point of the view."""
        length = float(np.linalg.norm(direction))
        arrow = self.pv.Arrow(
            start=start, direction=direction, scale=length, shaft_radius=0.03, tip_radius=0.09, tip_length=0.3,
            tip_resolution=40, shaft_resolution=40,
        )  # fmt: skip
        self.plotter.add_mesh(arrow, color=FLOW, ambient=0.3)

    def add_length_bar(self, start: np.ndarray, end: np.ndarray) -> None:
        """A bar of a round length beside the box."""
        self.plotter.add_mesh(self.pv.Line(start, end), color=INK, line_width=3.5 * self.line_width, lighting=False)


def _by_scalars(name: str, scale: Colours) -> dict[str, Any]:
    return {
        "scalars": name, "cmap": scale.map, "clim": [scale.low, scale.high], "show_scalar_bar": False,
    }  # fmt: skip
