"""Numbers, paths and walls in words, as several commands print them."""

from __future__ import annotations

import os
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any


def walls_text(walls: Mapping[str, Mapping[str, Any]]) -> str:
    """Walls that have the same condition together."""
    groups: dict[str, list[str]] = {}
    for name, wall in walls.items():
        kind = "no-flux" if wall["pressure"] is None else f"{wall['pressure']:g} Pa"
        groups.setdefault(f"{kind}, {'slip' if wall['slip'] else 'no-slip'}", []).append(name)
    return "; ".join(f"{' '.join(names)}: {kind}" for kind, names in groups.items())


def rows_text(rows: Iterable[tuple[str, Any]]) -> list[str]:
    """Rows of a name and a value, aligned; rows whose value is None are left out."""
    rows = [(name, value) for name, value in rows if value is not None]
    width = max(len(name) for name, _ in rows)
    return [f"  {name:{width}}  {value}" for name, value in rows]


def count_text(number: int) -> str:
    """A number with its thousands apart: ``12 627``."""
    return f"{number:,}".replace(",", " ")


def range_text(values: Iterable[float]) -> str:
    """The least and the largest of some values, or their one value."""
    lowest, highest = min(values), max(values)
    return f"{lowest:.4g}" if lowest == highest else f"{lowest:.4g} to {highest:.4g}"


def vector_text(values: Iterable[float]) -> str:
    """Numbers with commas between them."""
    return ", ".join(f"{value:.6g}" for value in values)


def path_text(path: str | os.PathLike[str]) -> str:
    """A path without redundant parts."""
    return str(Path(os.path.normpath(path)))
