"""forces.csv: the forces on every sphere, then on the six walls, written and read back."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from porefv.errors import InputError
from porefv.flow.pore_flow import PoreFlow
from porefv.packing.box import WALL_AXES, WALLS

PARTS = ("pressure", "viscous", "buoyancy", "total")
_COLUMNS = ("id", "x", "y", "z", "radius", *(f"{part}_{axis}" for part in PARTS for axis in "xyz"))


def write_forces(flow: PoreFlow, path: Path) -> None:
    """Write the table of a flow."""
    packing, box, forces = flow.mesh.packing, flow.mesh.box, flow.forces
    positions = np.tile(0.5 * (box.lower + box.upper), (6, 1))
    positions[np.arange(6), WALL_AXES] = box.wall_places
    on_spheres = np.column_stack([packing.centres, packing.radii, *(getattr(forces, part) for part in PARTS)]) + 0.0
    on_walls = np.column_stack([positions, *(getattr(forces, f"wall_{part}") for part in PARTS)]) + 0.0  # no -0.0
    with path.open("w", encoding="utf-8") as file:
        file.write(",".join(_COLUMNS) + "\n")
        # repr gives the shortest text that reads back to the same number.
        file.writelines(f"{k},{','.join(map(repr, row))}\n" for k, row in enumerate(on_spheres.tolist()))
        for name, row in zip(WALLS, on_walls.tolist(), strict=True):
            file.write(",".join([name, *map(repr, row[:3]), "", *map(repr, row[3:])]) + "\n")


def read_forces(path: Path) -> np.ndarray:
    """Structured array of a table: a row per sphere, then per wall, whose radius is NaN.

    Raises
    ------
    InputError
        If the table is damaged.
    """
    try:
        header, *lines = path.read_text(encoding="utf-8").splitlines()
        if header != ",".join(_COLUMNS):
            raise ValueError("its first line does not name the columns")
        rows = [_force_row(number, line) for number, line in enumerate(lines, 2)]
        if [row[0] for row in rows[-6:]] != list(WALLS):
            raise ValueError("it does not end with the six walls")
    except (OSError, ValueError) as error:
        raise InputError(f"{path} is damaged: {error}. Solve again.") from None
    return np.array(rows, dtype=[("id", "U16"), *((name, float) for name in _COLUMNS[1:])])


def _force_row(number: int, line: str) -> tuple[Any, ...]:
    """A line of forces.csv: name and numbers."""
    name, *cells = line.split(",")
    if name in WALLS and len(cells) > 3 and cells[3] == "":
        cells[3] = "nan"
    elif "nan" in cells:
        raise ValueError(f"line {number} lacks a number")
    if len(cells) != len(_COLUMNS) - 1:
        raise ValueError(f"line {number} has {len(cells) + 1} cells instead of {len(_COLUMNS)}")
    return name, *map(float, cells)
