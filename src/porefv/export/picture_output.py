"""A picture that can be shown in a notebook and saved as a file."""

from __future__ import annotations

import io
from collections.abc import Callable
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from porefv.export.picture_style import style
from porefv.system.atomic_files import atomic_write, locked, picture_target

if TYPE_CHECKING:
    from matplotlib.figure import Figure

FORMATS_2D = (".png", ".svg", ".pdf")
FORMATS_3D = (".png", ".html")


class Picture:
    """A picture: a notebook shows it, `save` writes it.

    Parameters
    ----------
    figure : matplotlib.figure.Figure
        What a PNG file shows.
    notes : sequence of str
        What is not shown, and why; also written in the picture.
    write_html : function, optional
        Writes the scene in three dimensions to a path; only a picture in three dimensions has it.

    Attributes
    ----------
    figure, notes
        As given.
    """

    def __init__(
        self, figure: Figure, notes: tuple[str, ...] = (), write_html: Callable[[Path], None] | None = None
    ) -> None:
        self.figure = figure
        self.notes = notes
        self._write_html = write_html

    @property
    def formats(self) -> tuple[str, ...]:
        """Endings of the files that `save` writes."""
        return FORMATS_2D if self._write_html is None else FORMATS_3D

    def save(self, path: str | PathLike[str]) -> None:
        """Write a file, whose ending tells the format: .png; .svg or .pdf of a diagram; .html of a 3D picture.

        Raises
        ------
        InputError
            If the picture cannot have the format, or cannot be written there.
        MissingExtraError
            If trame-pyvista is needed, and not installed.
        """
        path = picture_target(path, self.formats)
        with locked(path), atomic_write(path) as temporary:
            if path.suffix.lower() == ".html" and self._write_html is not None:
                self._write_html(temporary)
            else:
                with style():
                    self.figure.savefig(temporary, dpi=self.figure.dpi, metadata=_undated(path))

    def image(self) -> np.ndarray:
        """(height, width, 3) uint8 array: the pixels."""
        from matplotlib.backends.backend_agg import FigureCanvasAgg

        canvas = FigureCanvasAgg(self.figure)
        canvas.draw()
        return np.asarray(canvas.buffer_rgba())[..., :3].copy()

    def _repr_png_(self) -> bytes:
        buffer = io.BytesIO()
        self.figure.savefig(buffer, format="png", dpi=self.figure.dpi)
        return buffer.getvalue()

    def __repr__(self) -> str:
        width, height = (self.figure.get_size_inches() * self.figure.dpi).round().astype(int)
        return f"Picture({width} x {height} pixels)"


def _undated(path: Path) -> dict[str, Any]:
    """Metadata without the date, so that the same results make the same file."""
    return {".svg": {"Date": None}, ".pdf": {"CreationDate": None}}.get(path.suffix.lower(), {})
