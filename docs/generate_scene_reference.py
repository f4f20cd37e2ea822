"""Write the tables of keys on the pages about scenes, from the models of the scenes.

    python docs/generate_scene_reference.py

On a page, a table stands between `<!-- keys of FluidTable, ... -->` and `<!-- end of keys -->`. The name is that of a
class in `porefv.scenes`.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from pydantic.fields import FieldInfo

from porefv.scenes import schema
from porefv.scenes.table import Table

DOCS = Path(__file__).resolve().parent
PAGES = (DOCS / "scene.md", DOCS / "pack.md", DOCS / "simulate.md")
_MARKED = re.compile(r"(<!-- keys of (\w+), .*?-->\n).*?(<!-- end of keys -->)", re.DOTALL)


def with_tables(page: str) -> str:
    """The text of a page, with its tables of keys as the models have them."""
    tables = {table.__name__: table for table in _derived(Table)}
    return _MARKED.sub(lambda found: f"{found[1]}\n{keys_of(tables[found[2]])}\n{found[3]}", page)


def keys_of(table: type[Table]) -> str:
    """The Markdown table of the keys of a table; it has a column of units if any key has a unit."""
    rows = [["key", "default", "unit", "meaning"], []]
    for name, field in table.model_fields.items():
        rows.append([f"`{name}`", _default(field), _extra(field)["unit"], field.description or ""])
    if not any(_extra(field)["unit"] for field in table.model_fields.values()):
        rows = [row[:2] + row[3:] for row in rows]
    rows[1] = ["---"] * len(rows[0])
    return "".join(f"|{''.join(f'{_cell(text)}|' for text in row)}\n" for row in rows)


def _cell(text: str) -> str:
    return text if text == "---" else f" {text} " if text else " "


def _derived(base: type[Table]) -> Iterator[type[Table]]:
    for table in base.__subclasses__():
        yield table
        yield from _derived(table)


def _extra(field: FieldInfo) -> dict[str, Any]:
    assert isinstance(field.json_schema_extra, dict)
    return field.json_schema_extra


def _default(field: FieldInfo) -> str:
    if shown := _extra(field)["shown"]:
        return shown
    if field.is_required():
        return "required"
    if field.default is None:
        return "none"
    text = "" if field.default == {} else toml(field.default)
    return f"`{text}`" if '"' in text else text


def toml(value: Any) -> str:
    """A value as it stands in a scene file."""
    if isinstance(value, str):
        return f'"{value}"'
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, tuple):
        return f"[{', '.join(map(toml, value))}]"
    if isinstance(value, float) and value != 0.0 and not 1e-2 <= abs(value) < 1e6:
        power = math.floor(math.log10(abs(value)))
        power -= power % 3 if power > 0 else 0
        return f"{round(value / 10.0**power, 10)}e{power}"
    return repr(value)


def main() -> None:
    """Rewrite the pages."""
    assert schema.KINDS  # all models are known once they are imported
    for page in PAGES:
        page.write_text(with_tables(page.read_text(encoding="utf-8")), encoding="utf-8")


if __name__ == "__main__":
    main()
