"""Facets: the faces between the cells of a mesh, and the solid in them."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from porefv.mesh.facet_cross_sections import CrossSections, facet_cross_sections
from porefv.mesh.facet_kernels import FacetPlanes, FacetTopology, enumerate_facets, facet_centroids
from porefv.mesh.facet_volumes import facet_volumes
from porefv.mesh.union_volumes import union_volumes
from porefv.system.lazy import FixedInputs, lazy_property
from porefv.system.threads import for_rows

if TYPE_CHECKING:
    from porefv.mesh.cell_mesh import CellMesh


class Facets(FixedInputs):
    """Facets between the cells of a mesh, one row each; everything is computed when it is first needed.

    A facet is a triangle (three spheres), a trapezoid (two spheres and a wall) or a rectangle (one sphere and two
    walls). It is normal to the line between the Laguerre vertices P_i and P_j of its two cells.

    Parameters
    ----------
    mesh : CellMesh

    Notes
    -----
    Theory, method: :eq:`eq-throat` and :eq:`eq-exact-sums`.

    Values are signed, which makes sums over all facets exact: Σφ is the void volume, Σγ^k the free surface of sphere k.
    Where spheres overlap, single values of A^f, φ or γ may be zero or negative.
    """

    def __init__(self, mesh: CellMesh):
        self.mesh = mesh

    # ---- topology -------------------------------------------------------------------------------------------------

    @lazy_property
    def topology(self) -> FacetTopology:
        """Cells and vertices of each facet, as kernels take them."""
        mesh = self.mesh
        # Every cell has four facets, each shared by two, but for the eight at the corners of the box.
        found = FacetTopology.of((4 * mesh.n_cells - 8) // 2)
        enumerate_facets(mesh.cells, mesh.neighbours, mesh.n_spheres, found)
        return found

    @property
    def cells(self) -> np.ndarray:
        """(f, 2) int32: the two cells of each facet; its normal points from the first to the second."""
        return self.topology.cells

    @property
    def vertices(self) -> np.ndarray:
        """(f, 3) int32: vertices of each facet, spheres first, right-handed about its normal."""
        return self.topology.vertices

    def __len__(self) -> int:
        return len(self.cells)

    # ---- the facet as a cross-section -------------------------------------------------------------------------------

    @lazy_property
    def _cross_sections(self) -> CrossSections:
        f = len(self)
        found = CrossSections(
            normals=np.empty((f, 3)), lengths=np.empty(f), areas=np.empty(f), fluid_areas=np.empty(f),
            sectors=np.empty((f, 3)), covered=np.empty(f, bool),
        )  # fmt: skip
        for_rows(facet_cross_sections, f, self.topology, self.mesh.local_vertices, self.mesh.cell_vertices, found)
        return found

    @property
    def planes(self) -> FacetPlanes:
        """Cells, vertices and normal of each facet, as kernels take them."""
        return FacetPlanes(self.cells, self.vertices, self.normals)

    @property
    def normals(self) -> np.ndarray:
        """(f, 3): unit normal of each facet, from its first cell to its second."""
        return self._cross_sections.normals

    @property
    def lengths(self) -> np.ndarray:
        """(f,): L = (P_j - P_i)·n of each facet [m]."""
        return self._cross_sections.lengths

    @property
    def fluid_areas(self) -> np.ndarray:
        """(f,): A^f = A - Σ A^k of each facet [m²]."""
        return self._cross_sections.fluid_areas

    @property
    def sectors(self) -> np.ndarray:
        """(f, 3): area A^k of each facet inside each of its vertices' spheres, 0 for walls [m²]."""
        return self._cross_sections.sectors

    @property
    def covered(self) -> np.ndarray:
        """(f,) bool: facets covered by their spheres, all of which hold the facet's radical centre."""
        return self._cross_sections.covered

    @property
    def areas(self) -> np.ndarray:
        """(f,): area A of each facet, solid and fluid [m²]."""
        return self._cross_sections.areas

    @property
    def centroids(self) -> np.ndarray:
        """(f, 3): centroid of each facet, from the mesh's local origin [m]."""
        return facet_centroids(self.vertices, self.mesh.cell_vertices)

    # ---- the space between the two Laguerre vertices ----------------------------------------------------------------

    @lazy_property
    def _volumes(self) -> tuple[np.ndarray, np.ndarray]:
        if self.mesh.packing.triple_overlaps:
            return self._union[:2]
        volumes, surfaces = np.empty(len(self)), np.empty((len(self), 3))
        for_rows(
            facet_volumes, len(self), self.topology, self.mesh.local_vertices, self.mesh.cell_vertices, volumes,
            surfaces,
        )  # fmt: skip
        return volumes, surfaces

    @lazy_property
    def _union(self) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        volumes, surfaces = np.empty(len(self)), np.empty((len(self), 3))
        solids, solid_surfaces = np.empty((2, len(self), 2))
        for_rows(
            union_volumes, len(self), self.topology, self.mesh.local_vertices, self.mesh.cell_vertices, volumes,
            surfaces, solids, solid_surfaces,
        )  # fmt: skip
        return volumes, surfaces, solids, solid_surfaces

    @property
    def solids(self) -> np.ndarray:
        """(f, 2): solid from each facet to the Laguerre vertex of its first, and of its second cell, signed [m³]."""
        return self._union[2]

    @property
    def solid_surfaces(self) -> np.ndarray:
        """(f, 2): surface of spheres from each facet to its first, and to its second Laguerre vertex, signed [m²]."""
        return self._union[3]

    @property
    def volumes(self) -> np.ndarray:
        """(f,): void volume φ of each facet's pair of pyramids Ω_ij [m³]."""
        return self._volumes[0]

    @property
    def surfaces(self) -> np.ndarray:
        """(f, 3): solid surface γ^k of each facet's vertices within Ω_ij, walls included [m²]."""
        return self._volumes[1]

    def wetted_surfaces(self, slip: np.ndarray) -> np.ndarray:
        """(f, 3): γ^k of spheres and no-slip walls; walls with slip, (6,) bool, count as zero (C12 §3.1) [m²]."""
        if not slip.any():
            return self.surfaces
        drags = np.concatenate([np.ones(self.mesh.n_spheres, bool), ~slip])
        return self.surfaces * drags[self.vertices]

    def __repr__(self) -> str:
        return f"Facets({len(self)} facets between {self.mesh.n_cells} cells)"
