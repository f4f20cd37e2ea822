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
_RADIUS = _COLUMNS.index("radius")
# Rows of a CSV file that are text in memory at a time.
_ROWS = 1 << 16


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
    spheres, walls = table[:-6], table[-6:]
    with path.open("w", encoding="utf-8", newline="\n") as file:
        file.write(f"{','.join(_COLUMNS)}\n")
        # repr gives the shortest text that reads back to the same number.
        for first in range(0, len(spheres), _ROWS):
            rows = spheres[first : first + _ROWS].tolist()
            file.writelines(f"{name},{','.join(map(repr, numbers))}\n" for name, *numbers in rows)
        for name, *numbers in walls.tolist():
            cells = [name, *map(repr, numbers)]
            cells[_RADIUS] = ""
            file.write(f"{','.join(cells)}\n")


def _read_csv(path: Path) -> np.ndarray:
    header, *lines = path.read_text(encoding="utf-8").splitlines()
    if header != ",".join(_COLUMNS):
        raise ValueError("its first line does not name the columns")
    lines[-6:] = [line.replace(",,", ",nan,", 1) for line in lines[-6:]]
    return np.loadtxt(lines, _type(_ids(len(lines) - 6)), delimiter=",", comments=None, ndmin=1)
