"""PoreMesh: the void of a packing as a finite-volume mesh of pores, joined by throats."""

from __future__ import annotations

from collections.abc import Collection
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from porefv.errors import InputError
from porefv.mesh.cell_mesh import CellMesh
from porefv.mesh.inscribed_spheres import InscribedSpheres, inscribed_spheres
from porefv.mesh.throats import Throats
from porefv.mesh.uniting import unite
from porefv.packing.box import Box
from porefv.packing.packing import Packing
from porefv.system.html_table import html_table
from porefv.system.lazy import lazy_property

if TYPE_CHECKING:
    from porefv.export.picture_output import Picture
    from porefv.fipy.fluid_mesh import FluidMesh

# Laguerre vertices this close, relative to the smallest sphere of the facet between them, coincide but for rounding.
TIE_TOLERANCE = 1e-9


class PoreCells(NamedTuple):
    """The cells of each pore: pore i has the entries starts[i] ... starts[i + 1] - 1 of `cells`.

    Attributes
    ----------
    cells : (m,) int array
    starts : (n_pores + 1,) int array
    """

    cells: np.ndarray
    starts: np.ndarray


class PoreMesh(CellMesh):
    """Pores of a packing: the cells of its regular triangulation, with those that share a Laguerre vertex united.

    Everything is computed when it is first needed.

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

    _title = "Pore mesh"

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
        super().__init__(packing, box, wall_tolerance=wall_tolerance)
        self.unite_tolerance = unite_tolerance

    @lazy_property
    def _united(self) -> tuple[np.ndarray, np.ndarray]:
        exact, united = (
            unite(self.facets.topology, self.local_vertices, self.cell_vertices, tolerance)
            for tolerance in (TIE_TOLERANCE, max(self.unite_tolerance, TIE_TOLERANCE))
        )
        return exact, united

    @property
    def cell_node(self) -> np.ndarray:
        """(m,) int32: Laguerre vertex of each cell; cells of a tie (cospherical spheres) share one."""
        return self._united[0]

    @property
    def cell_pore(self) -> np.ndarray:
        """(m,) int32: pore of each cell."""
        return self._united[1]

    @lazy_property
    def n_pores(self) -> int:
        """Number of pores."""
        return int(self.cell_pore.max()) + 1

    @lazy_property
    def cells_of_pores(self) -> PoreCells:
        """The cells of each pore."""
        order = np.argsort(self.cell_pore, kind="stable")
        return PoreCells(order, np.searchsorted(self.cell_pore[order], np.arange(self.cell_pore.max() + 2)))

    def greatest_of_images(self, values: np.ndarray) -> np.ndarray:
        """Values of cells (m, ...); in a periodic cell, those of a cell and its images as the greatest of them."""
        return values

    @property
    def n_united(self) -> int:
        """Number of pores lost to uniting: cells less pores."""
        return self.n_cells - self.n_pores

    @lazy_property
    def pore_volumes(self) -> np.ndarray:
        """(n_pores,): void volume of each pore [m³]."""
        return np.bincount(self.cell_pore[: self.n_cells], self.cell_void_volumes, self.n_pores)

    @lazy_property
    def pore_surfaces(self) -> np.ndarray:
        """(n_pores,): surface of the grains in each pore, without what other grains and walls cover [m²].

        They add up to the surface of the union of the spheres within the box. Without overlap none is negative. With
        overlap, caps that reach out of a cell count against it, as in `cell_void_volumes`: single flat cells may have
        less than nothing, and a neighbour as much more (docs/theory_method.md, Surfaces of pores).
        """
        return np.bincount(self.cell_pore[: self.n_cells], self.cell_surfaces, self.n_pores)

    @lazy_property
    def pore_centres(self) -> np.ndarray:
        """(n_pores, 3): Laguerre vertex of each pore, that of a united pore the mean of those of its cells [m]."""
        if not self.n_united:
            return self.vertices
        pores, vertices = self.cell_pore[: self.n_cells], self.vertices
        count = np.bincount(pores, minlength=self.n_pores)
        return np.stack([np.bincount(pores, x, self.n_pores) / count for x in vertices.T], axis=1)

    @lazy_property
    def pore_walls(self) -> np.ndarray:
        """(n_pores,) uint8: the walls on which each pore has a face, as the sum of 2^w over them (w = 0: x_min)."""
        found = np.zeros(self.n_pores, np.uint8)
        faces = self.wall_faces
        np.bitwise_or.at(found, self.cell_pore[faces.cells], (1 << faces.walls).astype(np.uint8))
        return found

    @lazy_property
    def inscribed_spheres(self) -> InscribedSpheres:
        """The largest sphere that was found in the void of each pore, at or near its Laguerre vertices."""
        return inscribed_spheres(self)

    @lazy_property
    def throats(self) -> Throats:
        """The throats between the pores."""
        return Throats(self)

    def plot(self, what: str = "section", **options: Any) -> Picture:
        """A picture of the mesh (see `porefv.export.picture`): "section", "network", "throats" or "packing"."""
        from porefv.export.pictures import picture

        return picture(self, what, **options)

    def to_fipy(self, without: Collection[str] = ()) -> FluidMesh:
        """The fluid in the pores as a FiPy mesh (see `porefv.fipy`).

        Parameters
        ----------
        without : collection of str
            Walls whose pores are left out, such as ("y_min", "y_max"): their throats become exterior faces.
        """
        from porefv.fipy.fluid_mesh import FluidMesh

        return FluidMesh(self, without)

    def to_openpnm(self) -> dict[str, np.ndarray]:
        """The pores and throats as a plain dictionary in the names of OpenPNM (see `porefv.export.openpnm_network`)."""
        from porefv.export.openpnm_network import mesh_to_openpnm

        return mesh_to_openpnm(self)

    @property
    def _enclosure(self) -> tuple[str, str]:
        """What encloses the fluid, and its sides."""
        return "box", self.box.sides

    def _repr_html_(self) -> str:
        rows = [
            ("spheres", str(self.n_spheres)),
            ("pores", f"{self.n_pores}, of {self.n_cells} cells"),
            ("throats", f"{len(self.throats)}, {np.count_nonzero(self.throats.closed)} of them closed"),
            ("void volume", f"{self.pore_volumes.sum():.4g} m³"),
            self._enclosure,
        ]
        return html_table(self._title, rows)

    def __repr__(self) -> str:
        return (
            f"PoreMesh({self.n_spheres} spheres, {self.n_pores} pores, {len(self.throats)} throats, "
            f"box {self.box.sides})"
        )
