"""CellMesh: the regular triangulation of a packing as a mesh of cells that fill the box."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from porefv.errors import InputError
from porefv.mesh.cell_kernels import cell_solids, enumerate_wall_faces, polyhedron_volumes, volume_gradients
from porefv.mesh.facets import Facets
from porefv.mesh.flat_cells import settle_flat_cells
from porefv.mesh.laguerre import laguerre_volumes
from porefv.packing.box import WALL_NORMALS, Box
from porefv.packing.memory_estimate import ensure_room_for_spheres
from porefv.packing.packing import Packing
from porefv.system.lazy import FixedInputs, lazy_property
from porefv.system.threads import for_rows
from porefv.tessellation.triangulation import RegularTriangulation, wall_offsets
from porefv.tessellation.vertices import Vertices

if TYPE_CHECKING:
    import meshio
    import pyvista


@dataclass(frozen=True, eq=False)
class WallFaces:
    """Faces of cells on the walls of the box.

    Attributes
    ----------
    cells, walls : (w,) int32 arrays
        Cell and wall (0 ... 5: x_min, x_max, y_min, ...) of each face.
    areas : (w,) array
        Area [m²].
    centroids : (w, 3) array
        Centroid, from the mesh's local origin [m].
    """

    cells: np.ndarray
    walls: np.ndarray
    areas: np.ndarray
    centroids: np.ndarray


NO_WALLS = (
    "a periodic mesh has no walls, which this needs: use PeriodicFlow for its flow, or put the packing in a box with "
    "walls, and use PoreMesh"
)


class CellMesh(FixedInputs):
    """Cells of the regular triangulation of a packing: tetrahedra, wedges and hexahedra that fill the box.

    A cell is the centres of its spheres, swept to its walls. Everything is computed when it is first needed.

    Parameters
    ----------
    packing : Packing
        Spheres, validated on the way in.
    box : Box, optional
        Replaces the packing's own box.
    wall_tolerance : float
        Largest fraction of its radius by which a sphere may cross a wall.

    Raises
    ------
    InputError
        If the packing is not fit for use (see `Packing.validate`), or has no box.
    """

    # Whether rows of cells, spheres and pores include images of others (`porefv.mesh.PeriodicMesh`).
    periodic = False

    def __init__(self, packing: Packing, box: Box | None = None, *, wall_tolerance: float = 0.05):
        if box is not None:
            packing = packing.with_box(box)
        self.packing = packing.validate(wall_tolerance)
        self.wall_tolerance = wall_tolerance
        assert packing.walled_box is not None  # validate has seen to it
        self.box: Box = packing.walled_box

    # ---- topology ---------------------------------------------------------------------------------------------

    @lazy_property
    def triangulation(self) -> RegularTriangulation:
        """The regular triangulation the mesh is made of."""
        ensure_room_for_spheres(self.n_spheres)
        return RegularTriangulation(self.packing.centres, self.packing.radii, self.box)

    @property
    def cells(self) -> np.ndarray:
        """(m, 4) int32: vertices of each cell, spheres (ids < n_spheres) or walls (n_spheres + w)."""
        return self.triangulation.cells

    @property
    def neighbours(self) -> np.ndarray:
        """(m, 4) int32: cell across the facet opposite to each vertex, -1 at the box's corners."""
        return self.triangulation.neighbours

    @property
    def n_spheres(self) -> int:
        """Number of spheres."""
        return len(self.packing)

    @property
    def n_cells(self) -> int:
        """Number of cells."""
        return len(self.cells)

    @lazy_property
    def facets(self) -> Facets:
        """The facets between the cells."""
        return Facets(self)

    # ---- geometry ---------------------------------------------------------------------------------------------

    @lazy_property
    def local_points(self) -> np.ndarray:
        """(n + 6, 3): sphere centres from the local origin, then the walls' outward normals [m, -]."""
        return np.concatenate([self.packing.centres - self.triangulation.origin, WALL_NORMALS])

    @lazy_property
    def sizes(self) -> np.ndarray:
        """(n + 6,): sphere radii, then the walls' offsets along their normals from the local origin [m]."""
        return np.concatenate([self.packing.radii, wall_offsets(self.box, self.triangulation.origin)])

    @lazy_property
    def cell_vertices(self) -> Vertices:
        """The spheres and walls that are the vertices of the cells, as kernels take them."""
        return Vertices(self.n_spheres, self.local_points, self.sizes)

    @lazy_property
    def local_vertices(self) -> np.ndarray:
        """(m, 3): Laguerre vertex of each cell from the local origin, that of a flat cell being a neighbour's [m]."""
        vertices = self.triangulation.local_vertices.copy()
        settle_flat_cells(self.cells, self.neighbours, self.cell_vertices, vertices)
        return vertices

    @lazy_property
    def vertices(self) -> np.ndarray:
        """(m, 3): Laguerre vertex (power centre) of each cell [m]."""
        return self.local_vertices[: self.n_cells] + self.triangulation.origin

    @lazy_property
    def cell_volumes(self) -> np.ndarray:
        """(m,): volume of each cell, tetrahedron, wedge or hexahedron; they fill the box [m³]."""
        volumes = np.empty(self.n_cells)
        for_rows(polyhedron_volumes, self.n_cells, self.cells, self.cell_vertices, volumes)
        return volumes

    def cell_volume_rates(self, velocities: np.ndarray, wall_speeds: np.ndarray) -> np.ndarray:
        """Rate of the volume of each cell where spheres and walls move, at fixed topology (C14 eq. 25).

        It is the exact derivative of `cell_volumes`, solid included, so that the rates add up to the box's.

        Parameters
        ----------
        velocities : (n, 3) array
            Of the spheres' centres [m/s].
        wall_speeds : (6,) array
            Of the walls along their outward normals, in the order x_min, x_max, y_min, ... [m/s].

        Returns
        -------
        (m,) array [m³/s]
        """
        outward = np.asarray(wall_speeds, float)[:, None] * WALL_NORMALS
        moves = np.concatenate([np.broadcast_to(velocities, (self.n_spheres, 3)), outward])
        return np.einsum("tia,tia->t", self.volume_gradients, moves[self.cells])

    @property
    def volume_gradients(self) -> np.ndarray:
        """(m, 4, 3): derivative of each cell's volume by the place of each of its vertices [m²].

        A wall's place is that along its outward normal: its derivative is the cell's face on it, times that normal.
        """
        gradients = np.empty((self.n_cells, 4, 3))
        for_rows(volume_gradients, self.n_cells, self.cells, self.cell_vertices, gradients)
        return gradients

    @lazy_property
    def cell_void_volumes(self) -> np.ndarray:
        """(m,): volume of each cell outside the spheres [m³]."""
        return self.cell_volumes - self._cell_solids[0]

    @lazy_property
    def cell_surfaces(self) -> np.ndarray:
        """(m,): surface of the spheres in each cell, without what other spheres and walls cover [m²]."""
        return self._cell_solids[1]

    @lazy_property
    def _cell_solids(self) -> tuple[np.ndarray, np.ndarray]:
        """(m,): volume and surface of the solid in each cell [m³, m²]."""
        if self.packing.triple_overlaps:
            facets = self.facets
            cells = facets.cells.ravel()
            return (
                np.bincount(cells, facets.solids.ravel(), self.n_cells),
                np.bincount(cells, facets.solid_surfaces.ravel(), self.n_cells),
            )
        solids, surfaces = np.empty((2, self.n_cells))
        for_rows(cell_solids, self.n_cells, self.cells, self.cell_vertices, solids, surfaces)
        return solids, surfaces

    @lazy_property
    def laguerre_volumes(self) -> np.ndarray:
        """(n,): volume of each sphere's Laguerre cell, all that is nearer to it, in power, than to others [m³].

        They fill the box: each sphere with its share of the void.
        """
        return laguerre_volumes(self.facets.topology, self.local_vertices, self.cell_vertices)

    @lazy_property
    def wall_faces(self) -> WallFaces:
        """The faces of the cells on the walls: they tile the box's surface."""
        return WallFaces(*enumerate_wall_faces(self.cells, self.cell_vertices))

    # ---- the mesh for others ------------------------------------------------------------------------------------

    def to_meshio(self, **cell_data: Any) -> meshio.Mesh:
        """The cells as a `meshio.Mesh` with the given arrays (see `porefv.export.to_meshio`)."""
        from porefv.export.meshio_mesh import to_meshio

        return to_meshio(self, **cell_data)

    def to_pyvista(self, **cell_data: Any) -> pyvista.UnstructuredGrid:
        """The cells as a `pyvista.UnstructuredGrid` with the given arrays (see `porefv.export.to_pyvista`)."""
        from porefv.export.vtk_datasets import to_pyvista

        return to_pyvista(self, **cell_data)

    def __repr__(self) -> str:
        return f"CellMesh({self.n_spheres} spheres, {self.n_cells} cells, box {self.box.sides})"


def ensure_walls(mesh: CellMesh) -> None:
    """InputError if a mesh is periodic: for what needs walls, or takes every row for a cell or pore of its own."""
    if mesh.periodic:
        raise InputError(NO_WALLS)
