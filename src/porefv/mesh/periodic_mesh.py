"""PeriodicMesh: the pores of a packing in a periodic cell."""

from __future__ import annotations

import numpy as np

from porefv.errors import InputError, counted
from porefv.mesh.cell_mesh import NO_WALLS, WallFaces
from porefv.mesh.facet_kernels import FacetTopology
from porefv.mesh.facets import Facets
from porefv.mesh.inscribed_spheres import InscribedSpheres
from porefv.mesh.laguerre import laguerre_volumes
from porefv.mesh.pore_mesh import TIE_TOLERANCE, PoreMesh
from porefv.mesh.torus_rows import Owners, TorusRows, settled_vertices, torus_rows, unite_on_torus
from porefv.packing.box import Box
from porefv.packing.cell import Cell
from porefv.packing.memory_estimate import ensure_room_for_spheres
from porefv.packing.packing import Packing
from porefv.system.lazy import lazy_property
from porefv.tessellation.torus import TorusTriangulation
from porefv.tessellation.vertices import Vertices


class PeriodicFacets(Facets):
    """Facets of one period of a periodic mesh: `cells` and `vertices` are rows of the mesh, images included."""

    mesh: PeriodicMesh

    @property
    def topology(self) -> FacetTopology:
        """Cells and vertices of each facet, as kernels take them."""
        return self.mesh.rows.facets


class PeriodicMesh(PoreMesh):
    """Pores of a packing in a periodic cell: one period of its regular triangulation, without walls.

    Cells, spheres and pores of the period are rows of arrays, and after them come images of some, which are beyond the
    boundary and neighbours of the others. Rows are what `cells`, `facets.cells`, `facets.vertices`, `cell_pore`,
    `throats.pores` and `throats.spheres` name. `sphere_owners`, `cell_owners` and `pore_owners` say what each row
    repeats, and how many steps of the lattice `vectors` away. Volumes, surfaces and centres are those of the period,
    a row each. Everything is computed when it is first needed.

    Parameters
    ----------
    packing : Packing
        Spheres in a `Cell`, each given by any of its images; validated on the way in.
    unite_tolerance : float
        As of `PoreMesh`.

    Raises
    ------
    InputError
        If the packing is not fit for use (see `Packing.validate`), or is in no periodic cell.

    Examples
    --------
    >>> PeriodicMesh(Packing([[0, 0, 0]], [0.5], Cell([1, 1, 1])))
    PeriodicMesh(1 sphere, 1 pore, 3 throats, cell 1×1×1 m)
    """

    periodic = True

    _title = "Periodic pore mesh"

    def __init__(self, packing: Packing, *, unite_tolerance: float = 0.01):
        if not 0.0 <= unite_tolerance < 1.0:
            raise InputError(f"unite_tolerance must lie in [0, 1), not {unite_tolerance!r}")
        if not isinstance(packing, Packing):
            raise InputError(f"packing must be a Packing in a Cell, not {packing!r}")
        self.periodic_cell: Cell = packing.require_cell()
        self.packing = packing.validate()
        self.unite_tolerance = unite_tolerance

    @property
    def box(self) -> Box:  # type: ignore[override]
        """A periodic mesh has none: an InputError."""
        raise InputError(NO_WALLS)

    # ---- topology ---------------------------------------------------------------------------------------------

    @lazy_property
    def triangulation(self) -> TorusTriangulation:  # type: ignore[override]
        """The periodic triangulation that the mesh is made of."""
        ensure_room_for_spheres(self.n_spheres)
        return TorusTriangulation(self.packing.centres, self.packing.radii, self.periodic_cell)

    @lazy_property
    def rows(self) -> TorusRows:
        """The rows of the mesh, those of images included."""
        torus, radii = self.triangulation, self.packing.radii
        vertices = settled_vertices(torus, radii)
        exact, united = (
            unite_on_torus(torus, vertices, radii, tolerance)
            for tolerance in (TIE_TOLERANCE, max(self.unite_tolerance, TIE_TOLERANCE))
        )
        return torus_rows(torus, vertices, exact, united)

    @property
    def vectors(self) -> np.ndarray:
        """(3, 3): the lattice vectors that steps count, a row each: short ones of the cell's lattice [m]."""
        return self.triangulation.vectors

    @property
    def sphere_owners(self) -> Owners:
        """Sphere of each row of spheres, and the steps to its image."""
        return self.rows.spheres

    @property
    def cell_owners(self) -> Owners:
        """Cell of the period for each row of cells, and the steps to its image."""
        return self.rows.cells

    @property
    def pore_owners(self) -> Owners:
        """Pore of the period for each row of pores, and the steps to its image."""
        return self.rows.pores

    @property
    def cells(self) -> np.ndarray:
        """(k, 4) int32: rows of the spheres of each cell, those of images of cells included."""
        return self.rows.vertices

    @property
    def neighbours(self) -> np.ndarray:
        """(m, 4) int32: cell of the period, or of which an image is, across the facet opposite to each vertex."""
        return self.triangulation.neighbours

    @property
    def n_cells(self) -> int:
        """Number of cells of the period."""
        return len(self.triangulation.cells)

    @property
    def n_pores(self) -> int:  # type: ignore[override]
        """Number of pores of the period."""
        return int(self.rows.cell_pore[: self.n_cells].max()) + 1

    @lazy_property
    def facets(self) -> PeriodicFacets:
        """The facets of the period, each once."""
        return PeriodicFacets(self)

    @property
    def _united(self) -> tuple[np.ndarray, np.ndarray]:  # type: ignore[override]
        return self.rows.nodes, self.rows.cell_pore

    def greatest_of_images(self, values: np.ndarray) -> np.ndarray:
        """Values of rows of cells (k, ...), those of a cell and its images as the greatest of them."""
        owners = self.cell_owners.rows
        found = values[: self.n_cells].copy()
        np.maximum.at(found, owners[self.n_cells :], values[self.n_cells :])
        return found[owners]

    # ---- geometry ---------------------------------------------------------------------------------------------

    @lazy_property
    def local_points(self) -> np.ndarray:
        """(k, 3): centre of each row of spheres, from the cell's origin [m]."""
        spheres, steps = self.sphere_owners
        return self.triangulation.points[spheres] + steps @ self.vectors

    @lazy_property
    def sizes(self) -> np.ndarray:
        """(k,): radius of each row of spheres [m]."""
        return self.packing.radii[self.sphere_owners.rows]

    @lazy_property
    def cell_vertices(self) -> Vertices:
        """The rows of spheres, as kernels take them."""
        return Vertices(len(self.sizes), self.local_points, self.sizes)

    @property
    def local_vertices(self) -> np.ndarray:  # type: ignore[override]
        """(k, 3): Laguerre vertex of each row of cells, from the cell's origin [m]."""
        return self.rows.local_vertices

    @lazy_property
    def laguerre_volumes(self) -> np.ndarray:
        """(n,): volume of each sphere's Laguerre cell; they fill the periodic cell [m³]."""
        of_rows = laguerre_volumes(self.facets.topology, self.local_vertices, self.cell_vertices)
        return np.bincount(self.sphere_owners.rows, of_rows, self.n_spheres)

    @lazy_property
    def _cell_solids(self) -> tuple[np.ndarray, np.ndarray]:
        if not self.packing.triple_overlaps:
            return super()._cell_solids
        facets = self.facets
        cells = self.cell_owners.rows[facets.cells.ravel()]
        return (
            np.bincount(cells, facets.solids.ravel(), self.n_cells),
            np.bincount(cells, facets.solid_surfaces.ravel(), self.n_cells),
        )

    @lazy_property
    def wall_faces(self) -> WallFaces:
        """None: there are no walls."""
        return WallFaces(np.empty(0, np.int32), np.empty(0, np.int32), np.empty(0), np.empty((0, 3)))

    # ---- what needs walls, or is not there yet ------------------------------------------------------------------

    @property
    def inscribed_spheres(self) -> InscribedSpheres:  # type: ignore[override]
        """Not there for periodic meshes: an InputError."""
        raise InputError(NO_WALLS)

    def cell_volume_rates(self, velocities: np.ndarray, wall_speeds: np.ndarray) -> np.ndarray:
        """Not there for periodic meshes: an InputError."""
        raise InputError(NO_WALLS)

    @property
    def _enclosure(self) -> tuple[str, str]:
        return "periodic cell", self.periodic_cell.sides

    def __repr__(self) -> str:
        return (
            f"PeriodicMesh({counted(self.n_spheres, 'sphere')}, {counted(self.n_pores, 'pore')}, "
            f"{counted(len(self.throats), 'throat')}, cell {self.periodic_cell.sides})"
        )
