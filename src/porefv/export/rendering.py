"""Rendering without a display, and the view of a sample: parallel projection, so that one length scale holds."""

from __future__ import annotations

import ctypes
import os
import sys
from typing import Any

import numpy as np

from porefv.errors import ComputationError
from porefv.export.picture_style import PictureSize
from porefv.packing.box import Box
from porefv.system.optional_imports import load


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


class View:
    """A sample seen from above one of its upright edges.

    Places in the view are measured from the middle of the box, in units of its longest side: the graphics compute in
    single precision, which metres of very small or distant boxes would exceed.

    Parameters
    ----------
    box : Box
    axis : int
        The axis that stands upright.

    Attributes
    ----------
    axis, left, right : int
        The upright axis, and those to the left and right of the upright edge in front.
    scale : float
        Longest side [m].
    half : (3,) array
        Half the sides of the box, in the view [-].
    """

    def __init__(self, box: Box, axis: int):
        self.axis, self.left, self.right = axis, (axis + 1) % 3, (axis + 2) % 3
        self.middle = 0.5 * (box.lower + box.upper)
        self.scale = float(box.size.max())
        self.half = 0.5 * box.size / self.scale
        towards = self.normal(self.left) + 0.9 * self.normal(self.right) + 0.5 * self.normal(axis)
        self.towards = towards / np.linalg.norm(towards)
        across = np.cross(self.normal(axis), self.towards)
        self.across = across / np.linalg.norm(across)
        self.up = np.cross(self.towards, self.across)

    def normal(self, axis: int) -> np.ndarray:
        """(3,): unit vector along an axis."""
        return np.eye(3)[axis]

    def place(self, points: np.ndarray) -> np.ndarray:
        """Points [m] in the view."""
        return (np.asarray(points) - self.middle) / self.scale

    def corner(self, left: float, right: float, upright: float) -> np.ndarray:
        """(3,): a point of the view by its coordinates relative to half the sides: 1, 1, 1 is the corner on top."""
        point = np.empty(3)
        point[[self.left, self.right, self.axis]] = left, right, upright
        return point * self.half

    def flat(self, points: np.ndarray) -> np.ndarray:
        """(..., 2): points of the view as they are projected, across and up."""
        return np.stack([points @ self.across, points @ self.up], axis=-1)


class Projection:
    """How a view fills a part of a picture.

    Parameters
    ----------
    view : View
    extent : (p, 3) array
        Points of the view that must be seen.
    size : PictureSize
    free : (4,) sequence of float
        Left, right, bottom and top of the part of the picture that they may fill, as fractions.
    margin : float
        Room around these points.
    """

    def __init__(
        self,
        view: View,
        extent: np.ndarray,
        size: PictureSize,
        free: tuple[float, float, float, float],
        *,
        margin: float = 0.0,
    ):
        flat = view.flat(extent)
        low, high = flat.min(axis=0) - margin, flat.max(axis=0) + margin
        pixels = np.array([size.width, size.height])
        left, right, bottom, top = free
        self.per_unit = float((np.array([right - left, top - bottom]) * pixels / (high - low)).min())
        self._view, self._pixels = view, pixels
        # What is projected to the middle of the picture.
        wanted = np.array([0.5 * (left + right), 0.5 * (bottom + top)])
        self._centre = 0.5 * (low + high) - (wanted - 0.5) * pixels / self.per_unit

    def fraction(self, point: np.ndarray) -> tuple[float, float]:
        """Where a point of the view is in the picture, as fractions of its width and height."""
        x, y = (self._view.flat(point) - self._centre) * self.per_unit / self._pixels + 0.5
        return float(x), float(y)

    def aim(self, plotter: Any) -> None:
        """Point the camera of a plotter."""
        view, camera = self._view, plotter.camera
        focus = self._centre[0] * view.across + self._centre[1] * view.up
        camera.parallel_projection = True
        camera.focal_point = focus
        camera.position = focus + 5.0 * view.towards
        camera.up = view.up
        camera.parallel_scale = 0.5 * self._pixels[1] / self.per_unit
        camera.clipping_range = (0.1, 10.0)
