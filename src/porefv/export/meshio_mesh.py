"""The cells of a mesh for meshio, and through it for the formats of many other programs."""

from __future__ import annotations

from typing import TYPE_CHECKING

from porefv.errors import MissingExtraError
from porefv.mesh.cell_mesh import CellMesh
from porefv.mesh.polyhedra import HEXAHEDRON, TETRA, WEDGE, polyhedra
from porefv.mesh.pore_mesh import PoreMesh

if TYPE_CHECKING:
    import meshio

NAMES = {TETRA: "tetra", WEDGE: "wedge", HEXAHEDRON: "hexahedron"}  # meshio's names of VTK's types


def to_meshio(mesh: CellMesh) -> meshio.Mesh:
    """The cells as a `meshio.Mesh`, in blocks of one type, with the cell data `cell` (id).

    The cells of a `PoreMesh` have the cell data `pore` (id), too.

    Raises
    ------
    MissingExtraError
        If meshio is not installed.
    """
    try:
        import meshio
    except ModuleNotFoundError:
        raise MissingExtraError("meshio", "to_meshio()") from None
    solids = polyhedra(mesh)
    blocks = {NAMES[kind]: solids.of_type(kind) for kind in (TETRA, WEDGE, HEXAHEDRON)}
    ids, wedges = blocks["wedge"]
    blocks["wedge"] = ids, wedges[:, [0, 2, 1, 3, 5, 4]]  # meshio's wedge is Gmsh's, the mirror image of VTK's
    blocks = {name: block for name, block in blocks.items() if len(block[0])}
    data = {"cell": [ids for ids, _ in blocks.values()]}
    if isinstance(mesh, PoreMesh):
        data["pore"] = [mesh.cell_pore[ids] for ids, _ in blocks.values()]
    return meshio.Mesh(solids.points, [(name, nodes) for name, (_, nodes) in blocks.items()], cell_data=data)
