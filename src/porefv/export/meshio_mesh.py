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
    import pyvista

NAMES = {TETRA: "tetra", WEDGE: "wedge", HEXAHEDRON: "hexahedron"}  # meshio's names of VTK's types
# meshio mirrors wedges in VTK files, for the order that VTK had before 9.7. Mirrored here, they are right there.
_WEDGE_NODES = [0, 2, 1, 3, 5, 4]


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
    meshio = _meshio("to_meshio()")
    solids = polyhedra(mesh)
    blocks = {NAMES[kind]: solids.of_type(kind) for kind in (TETRA, WEDGE, HEXAHEDRON)}
    ids, wedges = blocks["wedge"]
    blocks["wedge"] = ids, wedges[:, _WEDGE_NODES]
    blocks = {name: block for name, block in blocks.items() if len(block[0])}
    data = {"cell": [ids for ids, _ in blocks.values()]}
    if isinstance(mesh, PoreMesh):
        data["pore"] = [mesh.cell_pore[ids] for ids, _ in blocks.values()]
    for name, values in cell_data.items():
        by_cell = values_by_cell(mesh, name, np.asarray(values))
        data[name] = [by_cell[ids] for ids, _ in blocks.values()]
    return meshio.Mesh(solids.points, [(name, nodes) for name, (_, nodes) in blocks.items()], cell_data=data)


def meshio_from_vtk(grid: pyvista.UnstructuredGrid) -> meshio.Mesh:
    """The cells of pores.vtu with their cell data as a `meshio.Mesh`, in blocks of one type.

    Nodes are in the order of meshio, which is that of Gmsh and Abaqus: before it writes a VTK file, see
    `mirror_wedges`.

    Raises
    ------
    MissingExtraError
        If meshio is not installed.
    """
    meshio = _meshio("Writing meshes in other formats")
    blocks, data = [], {name: list[np.ndarray]() for name in grid.cell_data}
    for kind, name in NAMES.items():
        cells = np.flatnonzero(grid.celltypes == kind)
        if len(cells):
            blocks.append((name, grid.cells_dict[np.uint8(kind)]))
            for array, parts in data.items():
                parts.append(np.asarray(grid.cell_data[array])[cells])
    return meshio.Mesh(np.asarray(grid.points), blocks, cell_data=data)


def mirror_wedges(mesh: meshio.Mesh) -> None:
    """Exchange nodes of the wedges of a mesh, so that they are right in VTK files that meshio writes."""
    for block in mesh.cells:
        if block.type == "wedge":
            block.data = block.data[:, _WEDGE_NODES]


def _meshio(purpose: str) -> Any:
    try:
        import meshio
    except ModuleNotFoundError:
        raise MissingExtraError("meshio", purpose) from None
    return meshio
