"""The cells of a mesh for meshio, and through it for the formats of many other programs."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from porefv.errors import MissingExtraError
from porefv.export.cell_data import values_by_cell
from porefv.mesh.cell_mesh import CellMesh
from porefv.mesh.polyhedra import HEXAHEDRON, TETRA, WEDGE, polyhedra
from porefv.mesh.pore_mesh import PoreMesh

if TYPE_CHECKING:
    import meshio

NAMES = {TETRA: "tetra", WEDGE: "wedge", HEXAHEDRON: "hexahedron"}  # meshio's names of VTK's types


def to_meshio(mesh: CellMesh, **cell_data: Any) -> meshio.Mesh:
    """The cells as a `meshio.Mesh`, in blocks of one type, with the cell data `cell` (id).

    The cells of a `PoreMesh` have the cell data `pore` (id), too.

    Parameters
    ----------
    mesh : CellMesh or PoreMesh
    **cell_data
        Arrays with a row per cell, or per pore of a `PoreMesh`: the cells of a pore then have the same value.

    Raises
    ------
    MissingExtraError
        If meshio is not installed.
    InputError
        If an array has a row for neither each cell nor each pore.
    """
    try:
        import meshio
    except ModuleNotFoundError:
        raise MissingExtraError("meshio", "to_meshio()") from None
    solids = polyhedra(mesh)
    blocks = {NAMES[kind]: solids.of_type(kind) for kind in (TETRA, WEDGE, HEXAHEDRON)}
    ids, wedges = blocks["wedge"]
    # meshio mirrors wedges in VTK files, for the order that VTK had before 9.7. Mirrored here, they are right there.
    blocks["wedge"] = ids, wedges[:, [0, 2, 1, 3, 5, 4]]
    blocks = {name: block for name, block in blocks.items() if len(block[0])}
    data = {"cell": [ids for ids, _ in blocks.values()]}
    if isinstance(mesh, PoreMesh):
        data["pore"] = [mesh.cell_pore[ids] for ids, _ in blocks.values()]
    for name, values in cell_data.items():
        by_cell = values_by_cell(mesh, name, np.asarray(values))
        data[name] = [by_cell[ids] for ids, _ in blocks.values()]
    return meshio.Mesh(solids.points, [(name, nodes) for name, (_, nodes) in blocks.items()], cell_data=data)
