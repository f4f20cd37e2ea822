"""Scenes in three dimensions as HTML files that a browser turns, without a network."""

from __future__ import annotations

import io
import re
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from html import escape
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
# The viewer puts the scene in place of what it finds in the element of this class, or else in the body. The scales of
# colours lie over the scene, and let the mouse through. In a narrow window both are as wide as it.
_SCENE = """
<style>
.content, .porefv svg {{ height: min(100vh, {height:.4f} * 100vw); }}
.content {{ position: absolute; top: 0; left: 0; right: 0; }}
.porefv {{ position: fixed; top: 0; right: 0; z-index: 10; pointer-events: none; }}
.porefv svg {{ width: auto; display: block; }}
</style>
<div class="content"></div>
"""
_LEGEND = """<div class="porefv">
{svg}
</div>
"""
_TITLE = re.compile("<title>.*?</title>", re.DOTALL)


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


@contextmanager
def _nothing_downloaded() -> Iterator[None]:
    """The server would load trame-vtklocal, which downloads files that the page does not use; it can do without."""
    name = "trame.widgets.vtklocal"
    loaded = sys.modules.get(name)
    sys.modules[name] = None  # type: ignore[assignment]
    try:
        yield
    finally:
        del sys.modules[name]
        if loaded is not None:
            sys.modules[name] = loaded


def _see_in_perspective(camera: Any) -> None:
    """What a browser is given of a camera is its place alone: put it where as much is seen in vtk.js's perspective."""
    focus, position = np.array(camera.focal_point), np.array(camera.position)
    towards = (position - focus) / np.linalg.norm(position - focus)
    # A little farther: what is in front looks larger.
    camera.position = focus + 1.12 * towards * camera.parallel_scale / np.tan(np.radians(0.5 * _VIEW_ANGLE))
    camera.parallel_projection = False
    camera.view_angle = _VIEW_ANGLE
    camera.clipping_range = (0.05, 20.0)


def write_html(plotter: Any, legend: Figure, path: Path, title: str = "") -> None:
    """Write the scene of a plotter, with a figure that explains it, as one file with a title.

    Raises
    ------
    MissingExtraError
        If trame-pyvista is not installed.
    """
    ensure_installed("trame_pyvista", "trame-pyvista", "Writing an HTML picture")
    _see_in_perspective(plotter.camera)
    with _signals_kept(), _nothing_downloaded():
        page = plotter.trame.export_html(None).getvalue()
    plotter.close()
    drawing = io.StringIO()
    legend.savefig(drawing, format="svg", metadata={"Date": None})
    svg = drawing.getvalue()
    svg = svg[svg.index("<svg") :]
    page = _TITLE.sub(lambda _: f"<title>{escape(title or 'porefv')}</title>", page, count=1)
    head, body, page = page.partition("<body>")
    before, end, after = page.rpartition("</body>")
    assert body and end, "the page of trame-pyvista has a body"
    width, height = legend.get_size_inches()
    scene = _SCENE.format(height=height / width)
    path.write_text(f"{head}{body}{scene}{before}{_LEGEND.format(svg=svg)}{end}{after}", encoding="utf-8")
