"""Scenes in three dimensions as HTML files that a browser turns, without a network."""

from __future__ import annotations

import io
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from signal import getsignal, signal
from typing import TYPE_CHECKING, Any

import numpy as np

from porefv.system.optional_imports import ensure_installed
from porefv.system.signals import ENDING

if TYPE_CHECKING:
    from matplotlib.figure import Figure

# Angle of view of vtk.js [degrees].
_VIEW_ANGLE = 30.0
# The scales of colours lie over the scene, and let the mouse through.
_LEGEND = """<div style="position:fixed;top:0;right:0;height:100%;z-index:10;pointer-events:none">
<style>.porefv svg {{ height: 100vh; width: auto; }}</style><div class="porefv">
{svg}
</div></div>
</body>"""


@contextmanager
def _signals_kept() -> Iterator[None]:
    """The server that trame starts for the export replaces how the process handles signals; it is put back."""
    before = {number: getsignal(number) for number in ENDING}
    try:
        yield
    finally:
        for number, handler in before.items():
            if getsignal(number) is not handler:
                signal(number, handler)


def _see_in_perspective(camera: Any) -> None:
    """What a browser is given of a camera is its place alone: put it where as much is seen in vtk.js's perspective."""
    focus, position = np.array(camera.focal_point), np.array(camera.position)
    towards = (position - focus) / np.linalg.norm(position - focus)
    # A little farther: what is in front looks larger.
    camera.position = focus + 1.12 * towards * camera.parallel_scale / np.tan(np.radians(0.5 * _VIEW_ANGLE))
    camera.parallel_projection = False
    camera.view_angle = _VIEW_ANGLE
    camera.clipping_range = (0.05, 20.0)


def write_html(plotter: Any, legend: Figure, path: Path) -> None:
    """Write the scene of a plotter, with a figure that explains it, as one file.

    Raises
    ------
    MissingExtraError
        If trame-pyvista is not installed.
    """
    ensure_installed("trame_pyvista", "trame-pyvista", "Writing an HTML picture")
    _see_in_perspective(plotter.camera)
    with _signals_kept():
        page = plotter.trame.export_html(None).getvalue()
    plotter.close()
    drawing = io.StringIO()
    legend.savefig(drawing, format="svg", metadata={"Date": None})
    svg = drawing.getvalue()
    svg = svg[svg.index("<svg") :]
    before, end, after = page.rpartition("</body>")
    assert end, "the page of trame-pyvista has a body"
    path.write_text(before + _LEGEND.format(svg=svg) + after, encoding="utf-8")
