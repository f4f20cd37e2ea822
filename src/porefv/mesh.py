"""PoreMesh: the packing's void as a finite-volume mesh of pores (cells) joined across facets."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from porefv import memory
from porefv.cells import cell_solids, enumerate_wall_faces, polyhedron_volumes, volume_gradients
from porefv.errors import InputError
from porefv.facets import enumerate_facets, laguerre_volumes, unite
from porefv.flat_cells import settle_flat_cells
from porefv.packing import Box, Packing
from porefv.tessellation import RegularTriangulation
from porefv.tessellation.triangulation import wall_normals

if TYPE_CHECKING:
    import meshio
    import pyvista

    from porefv.fipy_bridge import FipyPoreMesh
    from porefv.throats import Throats

# Laguerre vertices this close, relative to the smallest sphere of the facet between them, coincide but for rounding.
TIE_TOLERANCE = 1e-9


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


class PoreMesh:
    """Pores of a packing: the cells of its regular triangulation, with those that share a Laguerre vertex united.

    Everything is computed when first asked for.

    Parameters
    ----------
    packing : Packing
        Spheres, validated on the way in.
    box : Box, optional
        Replaces the packing's own box.
    unite_tolerance : float
        Cells whose Laguerre vertices are closer than this fraction of the smallest sphere radius of the facet
        between them are one pore: there is next to no length to resist flow along. 0 unites exact ties only.
    wall_tolerance : float
        Largest fraction of its radius by which a sphere may cross a wall.

    Raises
    ------
    InputError
        If the packing is not fit for use (see `Packing.validate`), or has no box.
    """

    def __init__(
        self,
        packing: Packing,
        box: Box | None = None,
        *,
        unite_tolerance: float = 0.01,
        wall_tolerance: float = 0.05,
    ):
        if not 0.0 <= unite_tolerance < 1.0:
            raise InputError(f"unite_tolerance must lie in [0, 1), not {unite_tolerance!r}")
        if box is not None:
            packing = packing.with_box(box)
        self.packing = packing.validate(wall_tolerance)
        assert packing.box is not None  # validate has seen to it
        self.box: Box = packing.box
        self.unite_tolerance = unite_tolerance

    # ---- topology ---------------------------------------------------------------------------------------------

    @cached_property
    def triangulation(self) -> RegularTriangulation:
        """The regular triangulation the mesh is made of."""
        memory.ensure(self.n_spheres)
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
        return len(self.packing)

    @property
    def n_cells(self) -> int:
        return len(self.cells)

    @cached_property
    def _facets(self) -> tuple[np.ndarray, np.ndarray]:
        # Every cell has four facets, each shared by two, but for the eight at the corners of the box.
        count = (4 * self.n_cells - 8) // 2
        facet_cells, vertices = np.empty((count, 2), np.int32), np.empty((count, 3), np.int32)
        enumerate_facets(self.cells, self.neighbours, self.n_spheres, facet_cells, vertices)
        return facet_cells, vertices

    @property
    def facet_cells(self) -> np.ndarray:
        """(f, 2) int32: the two cells of each facet; its normal points from the first to the second."""
        return self._facets[0]

    @property
    def facet_vertices(self) -> np.ndarray:
        """(f, 3) int32: vertices of each facet, spheres first, right-handed about its normal."""
        return self._facets[1]

    @cached_property
    def _united(self) -> tuple[np.ndarray, np.ndarray]:
        return tuple(
            unite(self.facet_cells, self.facet_vertices, self.local_vertices, self.n_spheres, self.sizes, tolerance)
            for tolerance in (TIE_TOLERANCE, max(self.unite_tolerance, TIE_TOLERANCE))
        )

    @property
    def cell_node(self) -> np.ndarray:
        """(m,) int32: Laguerre vertex of each cell; cells of a tie (cospherical spheres) share one."""
        return self._united[0]

    @property
    def cell_pore(self) -> np.ndarray:
        """(m,) int32: pore of each cell."""
        return self._united[1]

    @cached_property
    def n_pores(self) -> int:
        return int(self.cell_pore.max()) + 1

    @cached_property
    def cells_of_pores(self) -> tuple[np.ndarray, np.ndarray]:
        """Cells in the order of their pores (m,), and where those of each pore begin (n_pores + 1,)."""
        order = np.argsort(self.cell_pore, kind="stable")
        return order, np.searchsorted(self.cell_pore[order], np.arange(self.n_pores + 1))

    @property
    def n_united(self) -> int:
        """Number of pores lost to uniting: cells less pores."""
        return self.n_cells - self.n_pores

    # ---- geometry ---------------------------------------------------------------------------------------------

    @cached_property
    def local_points(self) -> np.ndarray:
        """(n + 6, 3): sphere centres from the local origin, then the walls' outward normals [m, -]."""
        return np.concatenate([self.packing.centres - self.triangulation.origin, wall_normals()])

    @cached_property
    def sizes(self) -> np.ndarray:
        """(n + 6,): sphere radii, then the walls' offsets along their normals from the local origin [m]."""
        lower = self.box.lower - self.triangulation.origin
        upper = self.box.upper - self.triangulation.origin
        return np.concatenate([self.packing.radii, np.stack([-lower, upper], axis=1).ravel()])

    @cached_property
    def local_vertices(self) -> np.ndarray:
        """(m, 3): Laguerre vertex of each cell from the local origin, that of a flat cell being a neighbour's [m]."""
        vertices = self.triangulation.local_vertices.copy()
        settle_flat_cells(self.cells, self.neighbours, self.local_points, self.n_spheres, vertices)
        return vertices

    @cached_property
    def vertices(self) -> np.ndarray:
        """(m, 3): Laguerre vertex (power centre) of each cell [m]."""
        return self.local_vertices + self.triangulation.origin

    @cached_property
    def cell_volumes(self) -> np.ndarray:
        """(m,): volume of each cell, tetrahedron, wedge or hexahedron; they fill the box [m³]."""
        return polyhedron_volumes(self.cells, self.n_spheres, self.local_points, self.sizes)

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
        outward = np.asarray(wall_speeds, float)[:, None] * wall_normals()
        moves = np.concatenate([np.broadcast_to(velocities, (self.n_spheres, 3)), outward])
        return np.einsum("tia,tia->t", self.volume_gradients, moves[self.cells])

    @property
    def volume_gradients(self) -> np.ndarray:
        """(m, 4, 3): derivative of each cell's volume by the place of each of its vertices [m²].

        A wall's place is that along its outward normal: its derivative is the cell's face on it, times that normal.
        """
        return volume_gradients(self.cells, self.n_spheres, self.local_points, self.sizes)

    @cached_property
    def cell_void_volumes(self) -> np.ndarray:
        """(m,): volume of each cell outside the spheres [m³]."""
        return self.cell_volumes - cell_solids(self.cells, self.n_spheres, self.local_points, self.sizes)

    @cached_property
    def pore_volumes(self) -> np.ndarray:
        """(n_pores,): void volume of each pore [m³]."""
        return np.bincount(self.cell_pore, self.cell_void_volumes, self.n_pores)

    @cached_property
    def laguerre_volumes(self) -> np.ndarray:
        """(n,): volume of each sphere's Laguerre cell, all that is nearer to it, in power, than to others [m³].

        They fill the box: each sphere with its share of the void.
        """
        return laguerre_volumes(
            self.facet_cells, self.facet_vertices, self.local_vertices, self.n_spheres, self.local_points, self.sizes
        )

    @cached_property
    def wall_faces(self) -> WallFaces:
        """The faces of the cells on the walls: they tile the box's surface."""
        return WallFaces(*enumerate_wall_faces(self.cells, self.n_spheres, self.local_points, self.sizes))

    @cached_property
    def throats(self) -> Throats:
        """The throats between the pores."""
        from porefv.throats import Throats

        return Throats(self)

    # ---- the mesh for others ------------------------------------------------------------------------------------

    def to_meshio(self) -> meshio.Mesh:
        """The cells as a `meshio.Mesh` of tetrahedra, wedges and hexahedra; cell data `cell`, `pore`."""
        from porefv.vtk_mesh import to_meshio

        return to_meshio(self)

    def to_pyvista(self, **cell_data: Any) -> pyvista.UnstructuredGrid:
        """The cells as a `pyvista.UnstructuredGrid`, in order, with the given arrays as cell data."""
        from porefv.vtk_mesh import to_pyvista

        return to_pyvista(self, **cell_data)

    def to_fipy(self, held: np.ndarray | None = None) -> FipyPoreMesh:
        """The pores as a `fipy` mesh (see `porefv.fipy_bridge`).

        Parameters
        ----------
        held : (n_pores,) bool array, optional
            Pores of imposed value: left out of the mesh, their throats become exterior faces.
        """
        from porefv.fipy_bridge import FipyPoreMesh

        return FipyPoreMesh(self, held)

    def __repr__(self) -> str:
        size = "×".join(f"{s:g}" for s in self.box.size)
        return f"PoreMesh({self.n_spheres} spheres, {self.n_pores} pores, {len(self.throats)} throats, box {size} m)"
