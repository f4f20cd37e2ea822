"""A picture of a flow: the sample cut open, grains coloured by the force on them, pores by their pressure.

Typically: `porefv.export.flow_picture(flow).screenshot("flow.png")`.
"""

from __future__ import annotations

import ctypes
import os
import sys
from typing import TYPE_CHECKING, Any

import numpy as np

from porefv.errors import ComputationError
from porefv.export.vtk_datasets import spheres_polydata
from porefv.flow.walls import Walls
from porefv.system.optional_imports import load

if TYPE_CHECKING:
    import pyvista

    from porefv.flow.pore_flow import PoreFlow

SIZE = (1600, 1200)  # pixels
_TRIANGLES = 1_500_000  # about as many as all balls together may have
_FORCES, _PRESSURES = "YlOrRd", "viridis"  # two families of colours that are not taken for one another
_GRAIN, _SECTION, _INK, _FLOW = "#d9d4cc", "#ece8e1", "#222222", "#1f5a99"


def flow_picture(
    flow: PoreFlow, *, forces: bool = True, title: str = "", size: tuple[int, int] = SIZE
) -> pyvista.Plotter:
    """The `picture` of a flow, whose pressures and, if asked for, forces are computed if they are not yet.

    Parameters
    ----------
    flow : PoreFlow
    forces : bool
        Colour the grains by the force on them.
    title, size
        As for `picture`.

    Returns
    -------
    pyvista.Plotter
        As of `picture`.
    """
    pv = load_pyvista()
    data = {"fluid_force": flow.forces.total} if forces else {}
    spheres = pv.PolyData(spheres_polydata(flow.mesh.packing, **data))
    return picture(spheres, flow.mesh.to_pyvista(pressure=flow.pressure), walls=flow.walls, title=title, size=size)


def picture(
    spheres: pyvista.PolyData,
    pores: pyvista.UnstructuredGrid,
    *,
    walls: Walls | None = None,
    upright: int = 1,
    title: str = "",
    size: tuple[int, int] = SIZE,
) -> pyvista.Plotter:
    """The sample, flow axis upright; if the pores have pressures, its front quarter is cut out to show them.

    Parameters
    ----------
    spheres : pyvista.PolyData
        Centres with the point data `radius` and, to be coloured by its size, `fluid_force` [N].
    pores : pyvista.UnstructuredGrid
        The mesh, with or without the cell data `pressure` [Pa].
    walls : Walls, optional
        Say which way the flow goes, for an arrow.
    upright : int
        Axis that is upright where there is no axis of flow.
    title : str
    size : (int, int)
        Width and height of the picture, in pixels.

    Returns
    -------
    pyvista.Plotter
        Off-screen; its `screenshot(path)` writes a file.

    Raises
    ------
    MissingExtraError
        If pyvista is not installed.
    ComputationError
        If this machine cannot draw.
    """
    pv = load_pyvista()
    plotter = pv.Plotter(off_screen=True, window_size=size)
    plotter.set_background("white")
    axis = upright if walls is None or walls.axis is None else walls.axis
    view = _View(np.asarray(pores.bounds, float).reshape(3, 2), axis)
    _add_spheres(pv, plotter, spheres, view, opened="pressure" in pores.cell_data)
    if "pressure" in pores.cell_data:
        _add_pressures(pv, plotter, spheres, pores, view)
    plotter.add_mesh(pv.Box(view.bounds.ravel()).extract_all_edges(), color=_INK, line_width=1.5)
    if walls is not None and walls.axis is not None:
        _add_arrow(pv, plotter, walls, view)
    if title:
        plotter.add_text(title, position=(0.03, 0.935), viewport=True, font_size=_font(size, 17), color=_INK)
    _aim(plotter, view)
    plotter.enable_anti_aliasing("msaa", multi_samples=8)
    return plotter


class _View:
    """The box, which axis stands upright, and the two others: the viewer stands where both are greatest."""

    def __init__(self, bounds: np.ndarray, axis: int):
        self.bounds = bounds
        self.axis = axis
        self.left, self.right = (axis + 1) % 3, (axis + 2) % 3
        self.middle = bounds.mean(axis=1)
        self.size = np.ptp(bounds, axis=1)

    def normal(self, axis: int) -> np.ndarray:
        return np.eye(3)[axis]


def _add_spheres(pv: Any, plotter: Any, spheres: Any, view: _View, opened: bool) -> None:
    points, radii = spheres.points, spheres["radius"]
    colours: dict[str, Any] = {"color": _GRAIN}
    values = np.zeros(len(radii))
    if "fluid_force" in spheres.point_data:
        values = np.linalg.norm(spheres["fluid_force"], axis=1)
        colours = {
            "scalars": "force", "cmap": _FORCES, "clim": [0.0, values.max() or 1.0],
            "scalar_bar_args": _bar("force on a grain [N]", 0, plotter),
        }  # fmt: skip
    # The cut leaves whole balls, and parts of those that reach across its two planes.
    reach = points[:, [view.left, view.right]] - view.middle[[view.left, view.right]]
    cut = opened & (reach + radii[:, None] > 0.0).all(axis=1)
    gone = opened & (reach - radii[:, None] >= 0.0).all(axis=1)
    # The finer the fewer; a grain of 9 spheres deserves a smooth outline, one of 10^5 is a few pixels wide.
    resolution = int(np.clip(np.sqrt(_TRIANGLES / len(radii) / 2), 8, 60))
    ball = pv.Sphere(radius=1.0, theta_resolution=resolution, phi_resolution=resolution)

    def balls(chosen: np.ndarray) -> Any:
        centres = pv.PolyData(points[chosen])
        centres["radius"], centres["force"] = radii[chosen], values[chosen]
        return centres.glyph(scale="radius", geom=ball, orient=False)

    surface = balls(~cut)
    if np.any(cut & ~gone):
        crossing = balls(cut & ~gone)
        left, right = view.normal(view.left), view.normal(view.right)
        behind, before = crossing.clip(left, origin=view.middle, return_clipped=True)
        surface = surface.append_polydata(behind, before.clip(right, origin=view.middle))
    if surface.n_points:
        plotter.add_mesh(surface, smooth_shading=True, ambient=0.15, specular=0.25, specular_power=20, **colours)


def _add_pressures(pv: Any, plotter: Any, spheres: Any, pores: Any, view: _View) -> None:
    """The two faces of the cut: the pores' pressures, and the grains' sections laid upon them."""
    bar = _bar("pressure [Pa]", 1, plotter)
    values = pores["pressure"]
    clim = [float(values.min()), float(values.max()) if np.ptp(values) > 0.0 else float(values.min()) + 1.0]
    for axis, other in ((view.left, view.right), (view.right, view.left)):
        normal, beyond = view.normal(axis), view.normal(other)
        section = pores.slice(normal=normal, origin=view.middle).clip(-beyond, origin=view.middle)
        plotter.add_mesh(section, scalars="pressure", cmap=_PRESSURES, clim=clim, lighting=False, scalar_bar_args=bar)
        points, radii = spheres.points, spheres["radius"]
        heights = view.middle[axis] - points[:, axis]
        crossed = np.flatnonzero(np.abs(heights) < radii)
        if len(crossed) == 0:
            continue
        centres = pv.PolyData(points[crossed])
        centres.points[:, axis] = view.middle[axis] + 1e-3 * view.size[axis]  # just before the pores
        centres["radius"] = np.sqrt(radii[crossed] ** 2 - heights[crossed] ** 2)
        disc = pv.Disc(inner=0.0, outer=1.0, normal=normal, c_res=60)
        discs = centres.glyph(scale="radius", geom=disc, orient=False).clip(-beyond, origin=view.middle)
        plotter.add_mesh(discs, color=_SECTION, lighting=False)


def _add_arrow(pv: Any, plotter: Any, walls: Walls, view: _View) -> None:
    """An arrow down the pressure, beside the sample."""
    axis = view.axis
    lower, upper = walls.pressures[2 * axis : 2 * axis + 2]
    if lower == upper:
        return
    sense = 1.0 if lower > upper else -1.0
    length = 0.3 * min(view.size[axis], max(view.size[view.left], view.size[view.right]))
    start = view.middle.copy()
    start[view.left] = view.bounds[view.left, 1] + 0.06 * view.size[view.left]
    start[view.right] = view.bounds[view.right, 0] - 0.06 * view.size[view.right]
    start[axis] -= 0.5 * sense * length
    arrow = pv.Arrow(
        start=start, direction=sense * view.normal(axis), scale=length,
        shaft_radius=0.03, tip_radius=0.09, tip_length=0.3, tip_resolution=40, shaft_resolution=40,
    )  # fmt: skip
    plotter.add_mesh(arrow, color=_FLOW, ambient=0.3)
    tail = start - 0.05 * sense * length * view.normal(axis)
    plotter.add_point_labels(
        tail[None], ["flow"], shape=None, show_points=False, always_visible=True, bold=False,
        text_color=_FLOW, font_size=_font(plotter.window_size, 30), justification_horizontal="center",
        justification_vertical="top" if sense > 0.0 else "bottom",
    )  # fmt: skip


def _aim(plotter: Any, view: _View) -> None:
    direction = view.normal(view.left) + 0.9 * view.normal(view.right) + 0.5 * view.normal(view.axis)
    plotter.camera.focal_point = view.middle
    plotter.camera.position = view.middle + direction
    plotter.camera.up = view.normal(view.axis)
    plotter.camera.view_angle = 20.0
    plotter.reset_camera(bounds=view.bounds.ravel())
    plotter.camera.SetWindowCenter(0.17, 0.0)  # room for the scales on the right, the title above
    plotter.camera.zoom(0.97)


def _bar(title: str, place: int, plotter: Any) -> dict[str, Any]:
    """An upright scale of colours on the right, one above the other."""
    size = plotter.window_size
    return {
        "title": f"{title}\n", "vertical": True, "width": 0.045, "height": 0.34,
        "position_x": 0.84, "position_y": (0.55, 0.1)[place], "color": _INK, "n_labels": 5, "fmt": "%.3g",
        "title_font_size": _font(size, 26), "label_font_size": _font(size, 24),
    }  # fmt: skip


def _font(size: tuple[int, int], points: int) -> int:
    return max(6, round(points * size[1] / SIZE[1]))


def load_pyvista() -> Any:
    """The module pyvista, on a machine that can draw."""
    # Without a display VTK would first try, and complain.
    if sys.platform.startswith("linux") and not os.environ.get("DISPLAY"):
        os.environ.setdefault("VTK_DEFAULT_OPENGL_WINDOW", "vtkEGLRenderWindow")
    pyvista = load("pyvista", "Drawing a picture")
    ensure_drawing()
    return pyvista


def ensure_drawing() -> None:
    """VTK's last resort is OSMesa, and a crash without it."""
    from vtkmodules.vtkCommonCore import vtkObject
    from vtkmodules.vtkRenderingCore import vtkRenderWindow

    warns = vtkObject.GetGlobalWarningDisplay()
    vtkObject.SetGlobalWarningDisplay(0)
    window = vtkRenderWindow().GetClassName()
    vtkObject.SetGlobalWarningDisplay(warns)
    if window == "vtkOSOpenGLRenderWindow" and not any(
        map(library_loads, ("libOSMesa.so.8", "libOSMesa.so.6", "libOSMesa.so"))
    ):
        raise ComputationError(
            "cannot draw: there is no display, and neither EGL nor OSMesa is installed to draw without one. "
            "Install Mesa (Debian and Ubuntu: apt install libegl1 libgl1-mesa-dri)"
        )


def library_loads(library: str) -> bool:
    """Whether the system finds a shared library."""
    try:
        ctypes.CDLL(library)
    except OSError:
        return False
    return True
