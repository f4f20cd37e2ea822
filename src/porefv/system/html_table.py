"""Tables that notebooks show of an object, in place of its `repr`."""

from __future__ import annotations

from collections.abc import Iterable
from html import escape

_STYLE = "text-align:left; padding:2px 12px 2px 0"


def html_table(title: str, rows: Iterable[tuple[str, str]]) -> str:
    """A table of two columns under a title; all texts are escaped.

    Examples
    --------
    >>> html_table("Box", [("x", "1 < 2 m")]).count("&lt;")
    1
    """
    cells = "".join(
        f'<tr><th style="{_STYLE}; font-weight:normal">{escape(name)}</th>'
        f'<td style="{_STYLE}">{escape(value)}</td></tr>'
        for name, value in rows
    )
    return f'<table><caption style="{_STYLE}; font-weight:bold">{escape(title)}</caption>{cells}</table>'


def range_text(values: Iterable[float], unit: str) -> str:
    """The smallest and the largest of some values: ``0.0268 to 0.0536 m``, or one value."""
    found = list(values)
    low, high = min(found), max(found)
    return f"{low:.4g} {unit}" if low == high else f"{low:.4g} to {high:.4g} {unit}"
