"""Throats: the geometry of every passage between two pores (C12 §2.2.2)."""

from __future__ import annotations

from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from porefv.facets import facet_sections, facet_volumes, inscribed_circles

if TYPE_CHECKING:
    from porefv.mesh import PoreMesh


class Throats:
    """Throats of a mesh: one row per Laguerre edge between two pores, dual to one facet.

    Facets that share their Laguerre edge (the triangles into which a tie cuts a polygon) are one throat. Facets
    inside a united pore belong to no throat. Geometry that needs solid angles is computed only when asked for.

    Parameters
    ----------
    mesh : PoreMesh

    Notes
    -----
    Signed values make the sums over all facets exact: Σφ is the void volume, Σγ^k the free surface of sphere k.
    Where spheres overlap, or a throat is nearly closed, single values of φ, γ or A^f may be zero or negative: such
    throats carry no flow, and are counted.
    """

    def __init__(self, mesh: PoreMesh):
        self.mesh = mesh

    # ---- facets: geometry as computed ---------------------------------------------------------------------------

    @cached_property
    def _sections(self) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        mesh = self.mesh
        f = len(mesh.facet_cells)
        arrays = np.empty((f, 3)), np.empty(f), np.empty(f), np.empty((f, 3))
        facet_sections(
            mesh.facet_cells, mesh.facet_vertices, mesh.local_vertices, mesh.n_spheres, mesh.local_points,
            mesh.sizes, *arrays,
        )  # fmt: skip
        return arrays

    @cached_property
    def _volumes(self) -> tuple[np.ndarray, np.ndarray]:
        mesh = self.mesh
        arrays = np.empty(len(mesh.facet_cells)), np.empty((len(mesh.facet_cells), 3))
        facet_volumes(
            mesh.facet_cells, mesh.facet_vertices, mesh.local_vertices, mesh.n_spheres, mesh.local_points,
            mesh.sizes, *arrays,
        )  # fmt: skip
        return arrays

    @property
    def facet_normals(self) -> np.ndarray:
        """(f, 3): unit normal of each facet, from its first cell to its second."""
        return self._sections[0]

    @property
    def facet_lengths(self) -> np.ndarray:
        """(f,): L = (P_j - P_i)·n of each facet [m]."""
        return self._sections[1]

    @property
    def facet_areas(self) -> np.ndarray:
        """(f,): area A of each facet, solid and fluid [m²]."""
        return self._sections[2]

    @property
    def facet_sectors(self) -> np.ndarray:
        """(f, 3): area A^k of each facet inside each of its vertices' spheres, 0 for walls [m²]."""
        return self._sections[3]

    @property
    def facet_volumes(self) -> np.ndarray:
        """(f,): void volume φ of each facet's pair of pyramids Ω_ij [m³]."""
        return self._volumes[0]

    @property
    def facet_surfaces(self) -> np.ndarray:
        """(f, 3): solid surface γ^k of each facet's vertices within Ω_ij, walls included [m²]."""
        return self._volumes[1]

    # ---- from facets to throats ---------------------------------------------------------------------------------

    @cached_property
    def _groups(self) -> tuple[np.ndarray | None, np.ndarray | None, np.ndarray]:
        """(throat of each facet or -1, sense of those that have one, first facet of each); None where trivial."""
        mesh = self.mesh
        if mesh.n_united == 0:
            return None, None, np.arange(len(mesh.facet_cells))
        passes = np.flatnonzero(np.not_equal(*mesh.cell_pore[mesh.facet_cells].T))
        throat = np.full(len(mesh.facet_cells), -1)
        if mesh.cell_node.max() + 1 < mesh.n_cells:  # there are ties
            nodes = mesh.cell_node[mesh.facet_cells[passes]].astype(np.int64)
            low, high = nodes.min(axis=1), nodes.max(axis=1)
            _, first, throat[passes] = np.unique(low * mesh.n_cells + high, return_index=True, return_inverse=True)
            sense = np.where(nodes[:, 0] == nodes[first[throat[passes]], 0], 1.0, -1.0)
            return throat, sense, passes[first]
        throat[passes] = np.arange(len(passes))
        return throat, None, passes

    @property
    def first_facets(self) -> np.ndarray:
        """(t,): a facet of each throat, of the same sense."""
        return self._groups[2]

    @property
    def facet_throat(self) -> np.ndarray:
        """(f,): throat of each facet, -1 inside a united pore."""
        throat = self._groups[0]
        return np.arange(len(self)) if throat is None else throat

    def _first(self, values: np.ndarray) -> np.ndarray:
        return values if self._groups[0] is None else values[self._groups[2]]

    def _total(self, values: np.ndarray) -> np.ndarray:
        throat = self._groups[0]
        if throat is None:
            return values
        passes = throat >= 0
        return np.bincount(throat[passes], values[passes], len(self))

    def total_by_facet(self, values: np.ndarray) -> np.ndarray:
        """(f,): each facet's share widened to the total over its throat (itself inside a united pore)."""
        throat = self._groups[0]
        if throat is None:
            return values
        return np.where(throat >= 0, self._total(values)[throat], values)

    def total_vectors(self, vectors: np.ndarray) -> np.ndarray:
        """(f, 3): sum of facet vectors (along facet normals) over each facet's throat, in the facet's own sense."""
        throat, sense, _ = self._groups
        if throat is None or sense is None:
            return vectors
        passes = np.flatnonzero(throat >= 0)
        along = sense[:, None] * vectors[passes]
        sums = np.stack([np.bincount(throat[passes], column, len(self)) for column in along.T], axis=1)
        totals = vectors.copy()
        totals[passes] = sense[:, None] * sums[throat[passes]]
        return totals

    def __len__(self) -> int:
        return len(self._groups[2])

    @cached_property
    def pores(self) -> np.ndarray:
        """(t, 2) int32: the two pores of each throat."""
        return self.mesh.cell_pore[self.mesh.facet_cells[self._groups[2]]]

    @cached_property
    def normals(self) -> np.ndarray:
        """(t, 3): unit normal of each throat, from its first pore to its second."""
        return self._first(self.facet_normals)

    @cached_property
    def lengths(self) -> np.ndarray:
        """(t,): length L of each throat, between its Laguerre vertices [m]."""
        return self._first(self.facet_lengths)

    @cached_property
    def areas(self) -> np.ndarray:
        """(t,): cross-section A of each throat, solid and fluid [m²]."""
        return self._total(self.facet_areas)

    @cached_property
    def fluid_areas(self) -> np.ndarray:
        """(t,): fluid cross-section A^f of each throat [m²]."""
        return self._total(self.facet_areas - self.facet_sectors.sum(axis=1))

    @cached_property
    def volumes(self) -> np.ndarray:
        """(t,): void volume φ of each throat [m³]."""
        return self._total(self.facet_volumes)

    def facet_wetted_surfaces(self, slip: np.ndarray) -> np.ndarray:
        """(f, 3): γ^k of spheres and no-slip walls; walls with slip, (6,) bool, count for nothing (C12 §3.1) [m²]."""
        if not slip.any():
            return self.facet_surfaces
        drags = np.concatenate([np.ones(self.mesh.n_spheres, bool), ~slip])
        return self.facet_surfaces * drags[self.mesh.facet_vertices]

    def wetted_surfaces(self, slip: np.ndarray) -> np.ndarray:
        """(t,): Σγ^k of each throat over its spheres and no-slip walls [m²]."""
        return self._total(self.facet_wetted_surfaces(slip).sum(axis=1))

    def inscribed_radii(self, slip: np.ndarray) -> np.ndarray:
        """(t,): radius of the circle in the throat's plane tangent to its spheres and no-slip walls [m].

        On walls with slip, (6,) bool, the circle is centred. Zero where there is no such circle; of a throat of
        several facets, the least.
        """
        mesh = self.mesh
        radii = inscribed_circles(mesh.facet_vertices, mesh.n_spheres, mesh.local_points, mesh.sizes, np.asarray(slip))
        throat, _, first = self._groups
        least = radii[first]
        if throat is not None:
            passes = throat >= 0
            np.minimum.at(least, throat[passes], radii[passes])
        return least

    def mirror_images(self, slip: np.ndarray) -> np.ndarray:
        """(t,): 1, 2 or 4: how many images of itself a throat makes up with its walls of symmetry, (6,) bool."""
        mirrors = np.concatenate([np.zeros(self.mesh.n_spheres, bool), slip])
        return 2.0 ** mirrors[self._first(self.mesh.facet_vertices)].sum(axis=1)

    @cached_property
    def closed(self) -> np.ndarray:
        """(t,) bool: throats without a fluid cross-section, A^f <= 0: nothing flows through them."""
        return self.fluid_areas <= 0.0

    def __repr__(self) -> str:
        return f"Throats({len(self)} throats between {self.mesh.n_pores} pores)"
