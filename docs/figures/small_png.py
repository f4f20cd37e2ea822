"""Figures of the documentation as small PNG files: 256 colours, which is enough for what is drawn."""

from __future__ import annotations

import io
from pathlib import Path
from typing import TYPE_CHECKING

from PIL import Image

if TYPE_CHECKING:
    from matplotlib.figure import Figure

FOLDER = Path(__file__).resolve().parents[1] / "img"


def save(figure: Figure, name: str) -> None:
    """Write docs/img/NAME.png."""
    buffer = io.BytesIO()
    figure.savefig(buffer, format="png", dpi=figure.dpi)
    shrink(buffer, FOLDER / f"{name}.png", Image.Quantize.MEDIANCUT)


def shrink(source: Path | io.BytesIO, path: Path, method: Image.Quantize = Image.Quantize.MAXCOVERAGE) -> None:
    """Write a picture with 256 colours; MAXCOVERAGE keeps the ends of scales, MEDIANCUT shades."""
    image = Image.open(source).convert("RGB")
    # Refined by k-means: pale shades would otherwise take colours of other things.
    image.quantize(256, method=method, kmeans=3, dither=Image.Dither.NONE).save(path, optimize=True)
