"""Data of cells from values by cell or by pore."""

from __future__ import annotations

import numpy as np

from porefv.errors import InputError
from porefv.mesh.cell_mesh import CellMesh
from porefv.mesh.pore_mesh import PoreMesh


def values_by_cell(mesh: CellMesh, name: str, values: np.ndarray) -> np.ndarray:
    """Values with a row per cell, from one per cell or per pore."""
    if len(values) == mesh.n_cells:
        return values
    pores = ""
    if isinstance(mesh, PoreMesh):
        if len(values) == mesh.n_pores:
            return values[mesh.cell_pore[: mesh.n_cells]]
        pores = f" or per pore ({mesh.n_pores})"
    raise InputError(f"cell data {name!r} has {len(values)} rows: needed is one per cell ({mesh.n_cells}){pores}")
