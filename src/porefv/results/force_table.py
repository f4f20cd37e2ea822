"""The table of forces: on every sphere, then on the six walls; written and read back, in each format."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from porefv.errors import InputError
from porefv.flow.pore_flow import PoreFlow
from porefv.packing.box import WALL_AXES, WALLS
from porefv.system.tables import TABLE_FORMATS, read_table, write_table

PARTS = ("pressure", "viscous", "buoyancy", "total")
FORCE_FILES = {table_format: f"forces.{table_format}" for table_format in TABLE_FORMATS}
_NUMBERS = ("x", "y", "z", "radius", *(f"{part}_{axis}" for part in PARTS for axis in "xyz"))
_COLUMNS = ("id", *_NUMBERS)
# Rows of a CSV file that are Python's objects at the same time; these take four times the memory of an array.
_ROWS_AT_ONCE = 4096


def write_forces(flow: PoreFlow, path: Path) -> None:
    """Write the table of a flow, as the extension of the path says: one of `TABLE_FORMATS`."""
    table = force_table(flow)
    if path.suffix == ".csv":
        _write_csv(table, path)
    else:
        write_table(table, path)


def force_table(flow: PoreFlow) -> np.ndarray:
    """Structured array (n + 6,) of a flow: a row per sphere, then per wall, whose radius is NaN.

    The fields are ``id`` (the number of a sphere, the name of a wall), the position ``x``, ``y``, ``z`` and the
    ``radius`` [m], and the forces ``pressure_x`` ... ``total_z`` [N]. The position of a wall is its middle.
    """
    packing, box, forces = flow.mesh.packing, flow.mesh.box, flow.forces
    n = len(packing)
    ids = _ids(n)
    table = np.empty(n + 6, dtype=_type(ids))
    table["id"] = ids
    positions = np.tile(0.5 * (box.lower + box.upper), (6, 1))
    positions[np.arange(6), WALL_AXES] = box.wall_places
    table["radius"][:n], table["radius"][n:] = packing.radii, np.nan
    vectors = [("", packing.centres, positions)]
    vectors += [(f"{part}_", getattr(forces, part), getattr(forces, f"wall_{part}")) for part in PARTS]
    for prefix, of_spheres, of_walls in vectors:
        for column, axis in enumerate("xyz"):
            values = table[prefix + axis]
            values[:n], values[n:] = of_spheres[:, column], of_walls[:, column]
            values += 0.0  # no -0.0
    return table


def read_forces(path: Path) -> np.ndarray:
    """The table of a file, as `force_table` returns it.

    Raises
    ------
    InputError
        If the table is damaged.
    """
    try:
        table = _read_csv(path) if path.suffix == ".csv" else read_table(path)
        _check(table)
    except InputError:
        raise
    except (OSError, ValueError) as error:
        raise InputError(f"{path} is damaged: {error}. Solve again.") from None
    return table


def _ids(spheres: int) -> np.ndarray:
    """Texts (n + 6,): the numbers of the spheres, then the names of the walls."""
    numbers = np.arange(spheres)
    return np.concatenate([numbers.astype(f"U{len(str(spheres))}"), np.array(WALLS)])


def _type(ids: np.ndarray) -> list[tuple[str, Any]]:
    return [("id", ids.dtype), *((name, float) for name in _NUMBERS)]


def _check(table: np.ndarray) -> None:
    """ValueError if an array is not a table of forces."""
    if table.ndim != 1 or table.dtype.names != _COLUMNS:
        raise ValueError(f"its columns are not {', '.join(_COLUMNS)}")
    if table.dtype["id"].kind != "U" or {table.dtype[name].str for name in _NUMBERS} != {np.dtype(float).str}:
        raise ValueError("its columns are not texts (id) and doubles")
    if not np.array_equal(table["id"], _ids(len(table) - 6)):
        raise ValueError("its rows are not the spheres 0, 1, 2 ... and then the six walls")
    for name in _NUMBERS:
        lacking = np.isnan(table[name][: -6 if name == "radius" else None])
        if lacking.any():
            raise ValueError(f"row {lacking.argmax()} lacks a number ({name})")


# ---- CSV: the radius of a wall is an empty cell ---------------------------------------------------------------------


def _write_csv(table: np.ndarray, path: Path) -> None:
    # repr gives the shortest text that reads back to the same number.
    line = "%s" + ",%r" * len(_NUMBERS) + "\n"
    with path.open("w", encoding="utf-8") as file:
        file.write(",".join(_COLUMNS) + "\n")
        for first in range(0, len(table) - 6, _ROWS_AT_ONCE):
            rows = table[first : min(first + _ROWS_AT_ONCE, len(table) - 6)]
            file.writelines(map(line.__mod__, rows.tolist()))
        file.writelines((line % row).replace(",nan,", ",,", 1) for row in table[-6:].tolist())


def _read_csv(path: Path) -> np.ndarray:
    header, *lines = path.read_text(encoding="utf-8").splitlines()
    if header != ",".join(_COLUMNS):
        raise ValueError("its first line does not name the columns")
    rows = [_row(number, line) for number, line in enumerate(lines, 2)]
    return np.array(rows, dtype=_type(_ids(len(rows) - 6)))


def _row(number: int, line: str) -> tuple[Any, ...]:
    """A line of forces.csv: name and numbers."""
    name, *cells = line.split(",")
    if name in WALLS and len(cells) > 3 and cells[3] == "":
        cells[3] = "nan"
    elif "nan" in cells:
        raise ValueError(f"line {number} lacks a number")
    if len(cells) != len(_NUMBERS):
        raise ValueError(f"line {number} has {len(cells) + 1} cells instead of {len(_COLUMNS)}")
    return name, *map(float, cells)
