"""The pore mesh as VTK sees it: tetrahedra, wedges and hexahedra that fill the box and share their nodes.

A cell is its spheres' centres swept to its walls. Its nodes are sphere centres, their projections on walls
and on edges of the box, and corners of the box: one node for all cells that have it, so the mesh conforms.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from porefv import extras
from porefv.errors import InputError, MissingExtraError
from porefv.mesh import PoreMesh

if TYPE_CHECKING:
    import meshio
    import pyvista
    from vtkmodules.vtkCommonDataModel import vtkPolyData, vtkUnstructuredGrid

    from porefv.packing import Packing
    from porefv.throats import Throats

TETRA, WEDGE, HEXAHEDRON = 10, 13, 12  # VTK's cell types
NAMES = {TETRA: "tetra", WEDGE: "wedge", HEXAHEDRON: "hexahedron"}  # meshio's

# A node of a cell as (the sphere's place in the cell or -1, the places of its walls): see `_wall_cells`.
_Recipe = list[tuple[int, tuple[int, ...]]]
_WEDGE: _Recipe = [(0, ()), (1, ()), (2, ()), (0, (3,)), (1, (3,)), (2, (3,))]
_SWEPT_EDGE: _Recipe = [(k, walls) for k in (0, 1) for walls in ((), (2,), (2, 3), (3,))]
_CORNER_BOX: _Recipe = [(0, walls) for walls in ((), (1,), (1, 2), (2,), (3,), (1, 3), (1, 2, 3), (2, 3))]


@dataclass(frozen=True, eq=False)
class Polyhedra:
    """Cells of a mesh in VTK's terms.

    Attributes
    ----------
    points : (p, 3) array
        Nodes; node k < n_spheres is the centre of sphere k [m].
    types : (m,) uint8 array
        VTK's type of each cell.
    offsets : (m + 1,) int64 array
        Where each cell starts in `connectivity`.
    connectivity : (c,) int64 array
        Nodes of the cells, one after the other, positively oriented.
    """

    points: np.ndarray
    types: np.ndarray
    offsets: np.ndarray
    connectivity: np.ndarray

    def of_type(self, kind: int) -> tuple[np.ndarray, np.ndarray]:
        """Ids (k,) and nodes (k, 4, 6 or 8) of the cells of one type."""
        ids = np.flatnonzero(self.types == kind)
        width = {TETRA: 4, WEDGE: 6, HEXAHEDRON: 8}[kind]
        return ids, self.connectivity[self.offsets[ids][:, None] + np.arange(width)]


def polyhedra(mesh: PoreMesh) -> Polyhedra:
    """The cells of a mesh as VTK's: tetrahedra, wedges (3 spheres, a wall), hexahedra (2 and 2, 1 and 3)."""
    n = mesh.n_spheres
    n_walls = np.count_nonzero(mesh.cells >= n, axis=1)
    types = np.array([TETRA, WEDGE, HEXAHEDRON, HEXAHEDRON], np.uint8)[n_walls]
    offsets = np.zeros(mesh.n_cells + 1, np.int64)
    np.cumsum(np.array([4, 6, 8, 8])[n_walls], out=offsets[1:])
    connectivity = np.empty(offsets[-1], np.int64)

    tetrahedra = np.flatnonzero(n_walls == 0)
    connectivity[offsets[tetrahedra][:, None] + np.arange(4)] = mesh.cells[tetrahedra][:, [1, 0, 2, 3]]
    for count, recipe in ((1, _WEDGE), (2, _SWEPT_EDGE), (3, _CORNER_BOX)):
        ids = np.flatnonzero(n_walls == count)
        nodes = _wall_cells(mesh.cells[ids], n, recipe)
        connectivity[offsets[ids][:, None] + np.arange(len(recipe))] = nodes

    # Nodes on walls have been given as keys beyond n: number those in use after the spheres.
    on_walls = np.flatnonzero(connectivity >= n)
    keys, connectivity[on_walls] = np.unique(connectivity[on_walls], return_inverse=True)
    connectivity[on_walls] += n
    return Polyhedra(_points(mesh, keys), types, offsets, connectivity)


def _wall_cells(cells: np.ndarray, n: int, recipe: _Recipe) -> np.ndarray:
    """Nodes of cells of one kind: ids of spheres, or keys 27 n + 27 k + code of sphere k's image on walls.

    The code has a digit in base 3 for each axis: 0, or 1 (2) for its lower (upper) wall. Corners belong to no
    sphere: their k is 0.
    """
    cells = _walls_last(cells, n)
    codes = np.array([1, 2, 3, 6, 9, 18])
    nodes = np.empty((len(cells), len(recipe)), np.int64)
    for column, (sphere, walls) in enumerate(recipe):
        nodes[:, column] = cells[:, sphere]
        if walls:
            if len(walls) == 3:
                nodes[:, column] = 0
            code = sum(codes[cells[:, wall] - n] for wall in walls)
            nodes[:, column] = 27 * (n + nodes[:, column]) + code
    return nodes


def _walls_last(cells: np.ndarray, n: int) -> np.ndarray:
    """The cells, spheres first, by odd permutations: the triangulation's orientation is opposite to VTK's."""
    order = np.argsort(cells >= n, axis=1, kind="stable")
    inversions = sum((order[:, i] > order[:, j]).astype(int) for i in range(4) for j in range(i + 1, 4))
    cells = np.take_along_axis(cells, order, axis=1)
    even = np.flatnonzero(inversions % 2 == 0)
    # Two spheres change places, or two walls.
    i = np.where(cells[even, 1] < n, 0, 2)
    cells[even, i], cells[even, i + 1] = cells[even, i + 1], cells[even, i]
    return cells


def _points(mesh: PoreMesh, keys: np.ndarray) -> np.ndarray:
    n = mesh.n_spheres
    sphere, code = np.divmod(keys - 27 * n, 27)
    points = np.concatenate([mesh.packing.centres, mesh.packing.centres[sphere]])
    for axis in range(3):
        digit = code // 3**axis % 3
        points[n:, axis] = np.choose(digit, [points[n:, axis], mesh.box.lower[axis], mesh.box.upper[axis]])
    return points


# ---- for meshio, pyvista and VTK's own writers ---------------------------------------------------------


def to_meshio(mesh: PoreMesh) -> meshio.Mesh:
    """The cells as a `meshio.Mesh`, in blocks of one type, with the cell data `cell` and `pore` (ids).

    Raises
    ------
    MissingExtraError
        If meshio is not installed.
    """
    try:
        import meshio
    except ModuleNotFoundError:
        raise MissingExtraError("meshio", "PoreMesh.to_meshio()") from None
    solids = polyhedra(mesh)
    blocks = {NAMES[kind]: solids.of_type(kind) for kind in (TETRA, WEDGE, HEXAHEDRON)}
    ids, wedges = blocks["wedge"]
    blocks["wedge"] = (
        ids,
        wedges[:, [0, 2, 1, 3, 5, 4]],
    )  # meshio's wedge is Gmsh's, the mirror image of VTK's
    blocks = {name: block for name, block in blocks.items() if len(block[0])}
    return meshio.Mesh(
        solids.points,
        [(name, nodes) for name, (_, nodes) in blocks.items()],
        cell_data={
            "cell": [ids for ids, _ in blocks.values()],
            "pore": [mesh.cell_pore[ids] for ids, _ in blocks.values()],
        },
    )


def to_pyvista(mesh: PoreMesh, **cell_data: Any) -> pyvista.UnstructuredGrid:
    """The cells as a `pyvista.UnstructuredGrid`, in order, with the cell data `pore` (id) and those given.

    Parameters
    ----------
    mesh : PoreMesh
    **cell_data
        Arrays with a row per cell, or per pore: the cells of a pore then share its value.

    Raises
    ------
    MissingExtraError
        If pyvista is not installed.
    InputError
        If an array has a row for neither each cell nor each pore.
    """
    pyvista = extras.load("pyvista", "PoreMesh.to_pyvista()")
    return pyvista.UnstructuredGrid(cells_grid(mesh, **cell_data))


def cells_grid(mesh: PoreMesh, **cell_data: Any) -> vtkUnstructuredGrid:
    """As `to_pyvista`, but VTK's own object: what the results are written from, without pyvista."""
    vtk = vtk_data_model()
    solids = polyhedra(mesh)
    grid = vtk.vtkUnstructuredGrid()
    grid.SetPoints(vtk_points(solids.points))
    cells = vtk.vtkCellArray()
    cells.SetData(_vtk_array(solids.offsets), _vtk_array(solids.connectivity))
    grid.SetCells(_vtk_array(solids.types), cells)
    data = {"pore": mesh.cell_pore}
    for name, values in cell_data.items():
        values = np.asarray(values)
        if len(values) not in (mesh.n_cells, mesh.n_pores):
            raise InputError(
                f"cell data {name!r} has {len(values)} rows: needed is one per cell ({mesh.n_cells}) "
                f"or per pore ({mesh.n_pores})"
            )
        data[name] = values if len(values) == mesh.n_cells else values[mesh.cell_pore]
    attach(grid.GetCellData(), data)
    return grid


def spheres_polydata(packing: Packing, **point_data: np.ndarray) -> vtkPolyData:
    """The spheres' centres as vertices with the point data `id`, `radius` and those given (n rows)."""
    n = len(packing)
    polydata = vtk_data_model().vtkPolyData()
    polydata.SetPoints(vtk_points(packing.centres))
    polydata.SetVerts(cell_array(np.arange(n)[:, None]))
    attach(polydata.GetPointData(), {"id": np.arange(n), "radius": packing.radii, **point_data})
    return polydata


def throats_polydata(throats: Throats, **cell_data: np.ndarray) -> vtkPolyData:
    """The network: a point per pore, a line per throat with the cell data given (t rows).

    Points are Laguerre vertices, that of a united pore the mean of several.
    """
    mesh = throats.mesh
    points = mesh.vertices
    if mesh.n_united:
        count = np.bincount(mesh.cell_pore, minlength=mesh.n_pores)
        points = np.stack([np.bincount(mesh.cell_pore, x, mesh.n_pores) / count for x in points.T], axis=1)
    polydata = vtk_data_model().vtkPolyData()
    polydata.SetPoints(vtk_points(points))
    polydata.SetLines(cell_array(throats.pores))
    attach(polydata.GetCellData(), cell_data)
    return polydata


def vtk_data_model() -> Any:
    """VTK's data structures; MissingExtraError if VTK is not installed."""
    return _vtk("vtkCommonDataModel")


def _vtk(module: str) -> Any:
    # vtkmodules loads in half the time of pyvista, which is not needed to write files.
    return extras.load(f"vtkmodules.{module}", "Writing VTK files")


def write_xml(dataset: vtkUnstructuredGrid | vtkPolyData, path: Path) -> None:
    """Write a .vtu or .vtp file: appended, binary, compressed.

    LZ4 makes files hardly larger than zlib does, ten times as quickly.

    Raises
    ------
    OSError
        If the file cannot be written.
    """
    writers = _vtk("vtkIOXML")
    writer = writers.vtkXMLUnstructuredGridWriter() if path.suffix == ".vtu" else writers.vtkXMLPolyDataWriter()
    writer.SetInputData(dataset)
    writer.SetFileName(str(path))
    writer.SetDataModeToAppended()
    writer.SetEncodeAppendedData(False)
    writer.SetHeaderTypeToUInt64()
    writer.SetCompressorTypeToLZ4()
    if not writer.Write():
        raise OSError(f"VTK could not write {path.name}")


def _vtk_array(values: np.ndarray):
    return _vtk("util.numpy_support").numpy_to_vtk(np.ascontiguousarray(values))


def vtk_points(points: np.ndarray):
    vtk_points = _vtk("vtkCommonCore").vtkPoints()
    vtk_points.SetData(_vtk_array(points))
    return vtk_points


def cell_array(rows: np.ndarray):
    """Cells of one size: their points are the rows."""
    cells = vtk_data_model().vtkCellArray()
    cells.SetData(rows.shape[1], _vtk_array(rows.ravel().astype(np.int64)))
    return cells


def attach(attributes, arrays: dict[str, np.ndarray]) -> None:
    for name, values in arrays.items():
        array = _vtk_array(values)
        array.SetName(name)
        attributes.AddArray(array)
