"""Throats: the geometry of every passage between two pores (C12 §2.2.2)."""

from __future__ import annotations

from functools import cached_property
from itertools import combinations
from typing import TYPE_CHECKING

import numpy as np

from porefv.centres import drawn_parts, pore_centres
from porefv.circles import circle_portions, inscribed_circles
from porefv.facets import facet_sections, facet_volumes, row_sums, tied_facets

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
        self._inscribed: dict[bytes, tuple[np.ndarray, np.ndarray]] = {}  # by walls with slip

    # ---- facets: geometry as computed ---------------------------------------------------------------------------

    @cached_property
    def _sections(self) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        mesh = self.mesh
        f = len(mesh.facet_cells)
        arrays = np.empty((f, 3)), np.empty(f), np.empty(f), np.empty((f, 3)), np.empty(f, bool)
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
    def facet_fluid_areas(self) -> np.ndarray:
        """(f,): A^f = A - Σ A^k of each facet [m²]."""
        return self._sections[2]

    @property
    def facet_areas(self) -> np.ndarray:
        """(f,): area A of each facet, solid and fluid [m²]."""
        return self.facet_fluid_areas + row_sums(self.facet_sectors)

    @property
    def facet_sectors(self) -> np.ndarray:
        """(f, 3): area A^k of each facet inside each of its vertices' spheres, 0 for walls [m²]."""
        return self._sections[3]

    @cached_property
    def facet_necks(self) -> np.ndarray:
        """(f,): height over its neck at which the section of each facet's throat is twice as wide [m].

        A^f + Σ θ s² / 2 with θ the angles of spheres; zero where there is no fluid area.
        """
        mesh = self.mesh
        of_spheres = mesh.facet_vertices < mesh.n_spheres
        radii = mesh.sizes[np.where(of_spheres, mesh.facet_vertices, 0)]
        angles = self.total_by_facet(2.0 * (self.facet_sectors / radii**2 * of_spheres).sum(axis=1))
        areas = np.maximum(self.total_by_facet(self.facet_fluid_areas), 0.0)
        return np.sqrt(np.divide(2.0 * areas, angles, out=np.zeros_like(areas), where=angles > 0.0))

    @property
    def facet_covered(self) -> np.ndarray:
        """(f,) bool: facets covered by their spheres, all of which hold the facet's radical centre."""
        return self._sections[4]

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
    def first_facets(self) -> np.ndarray:
        """(t,): a facet of each throat; the throat takes its sense."""
        first, second = self.mesh.facet_cells.T
        passes = self.mesh.cell_pore[first] != self.mesh.cell_pore[second]
        passes[self._further[0]] = False
        return np.flatnonzero(passes)

    @cached_property
    def _further(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """The further facets of throats that a tie has cut in several: their ids, first facets and senses."""
        mesh = self.mesh
        # Only between two Laguerre vertices that are both tied can there be more facets than one.
        several = tied_facets(mesh.facet_cells, mesh.cell_node, mesh.cell_pore)
        nodes = mesh.cell_node[mesh.facet_cells[several]].astype(np.int64)
        keys = nodes.min(axis=1) * mesh.n_cells + nodes.max(axis=1)
        _, first, inverse = np.unique(keys, return_index=True, return_inverse=True)
        first = first[inverse]
        further = np.flatnonzero(first != np.arange(len(several)))
        sense = np.where(nodes[further, 0] == nodes[first[further], 0], 1.0, -1.0)
        return several[further], several[first[further]], sense

    @cached_property
    def facet_throat(self) -> np.ndarray:
        """(f,) int: throat of each facet, -1 inside a united pore."""
        throat = np.full(len(self.mesh.facet_cells), -1)
        throat[self.first_facets] = np.arange(len(self))
        further, first, _ = self._further
        throat[further] = throat[first]
        return throat

    @cached_property
    def facets_of_throats(self) -> tuple[np.ndarray, np.ndarray]:
        """Facets in the order of their throats, each's first one first, and where those of each start (t + 1,)."""
        further, first, _ = self._further
        facets = np.concatenate([self.first_facets, further])
        throat = np.concatenate([np.arange(len(self)), self.facet_throat[first]])
        order = np.argsort(throat, kind="stable")
        return facets[order], np.searchsorted(throat[order], np.arange(len(self) + 1))

    @cached_property
    def centres(self) -> np.ndarray:
        """(m, 3): centre of each cell's pore from the local origin: its vertex, drawn towards small spheres [m]."""
        mesh = self.mesh
        order, firsts = mesh.cells_of_pores
        facets, starts = self.facets_of_throats
        parts, centres = np.zeros((mesh.n_cells, 4)), np.empty((mesh.n_cells, 3))
        drawn_parts(
            facets, starts, mesh.facet_cells, mesh.facet_vertices, mesh.cells, order, firsts, mesh.cell_pore,
            mesh.n_spheres, mesh.local_points, mesh.sizes, mesh.local_vertices, self.facet_normals,
            self.effective_lengths, parts,
        )  # fmt: skip
        pore_centres(mesh.cells, order, firsts, mesh.n_spheres, mesh.local_points, mesh.local_vertices, parts, centres)
        return centres

    def _total(self, values: np.ndarray) -> np.ndarray:
        """(t,): sum of facet values (f,) over each throat."""
        totals = values[self.first_facets]
        further, first, _ = self._further
        np.add.at(totals, np.searchsorted(self.first_facets, first), values[further])
        return totals

    def total_by_facet(self, values: np.ndarray) -> np.ndarray:
        """(f, ...): sum of facet values over each facet's throat."""
        further, first, _ = self._further
        if len(further) == 0:
            return values
        totals = values.copy()
        np.add.at(totals, first, values[further])
        totals[further] = totals[first]
        return totals

    def total_vectors(self, vectors: np.ndarray) -> np.ndarray:
        """(f, 3): sum of facet vectors, along facet normals, over each facet's throat, in the facet's own sense."""
        further, first, sense = self._further
        if len(further) == 0:
            return vectors
        totals = vectors.copy()
        np.add.at(totals, first, sense[:, None] * vectors[further])
        totals[further] = sense[:, None] * totals[first]
        return totals

    def __len__(self) -> int:
        return len(self.first_facets)

    @cached_property
    def pores(self) -> np.ndarray:
        """(t, 2) int32: the two pores of each throat."""
        return self.mesh.cell_pore[self.mesh.facet_cells[self.first_facets]]

    @cached_property
    def normals(self) -> np.ndarray:
        """(t, 3): unit normal of each throat, from its first pore to its second."""
        return self.facet_normals[self.first_facets]

    @cached_property
    def lengths(self) -> np.ndarray:
        """(t,): length L of each throat, between its Laguerre vertices [m]."""
        return self.facet_lengths[self.first_facets]

    @property
    def effective_lengths(self) -> np.ndarray:
        """(t,): lengths, those at the level of rounding or below as 2.2e-16 of the smallest radius [m]."""
        return np.maximum(self.lengths, np.finfo(float).eps * float(self.mesh.packing.radii.min()))

    @cached_property
    def areas(self) -> np.ndarray:
        """(t,): cross-section A of each throat, solid and fluid [m²]."""
        return self._total(self.facet_areas)

    @cached_property
    def fluid_areas(self) -> np.ndarray:
        """(t,): fluid cross-section A^f of each throat [m²]."""
        return self._total(self.facet_fluid_areas)

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
        return self._total(row_sums(self.facet_wetted_surfaces(slip)))

    def inscribed_radii(self, slip: np.ndarray) -> np.ndarray:
        """(t,): radius of the circle in the throat's plane tangent to its spheres and no-slip walls [m].

        On walls with slip, (6,) bool, the circle is centred. Zero where there is no such circle. A throat with more
        than three vertices has the least circle of any three of them, however a tie has cut it.
        """
        return self.inscribed_circles(slip)[0]

    def inscribed_circles(self, slip: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Radii (t,) as of `inscribed_radii`, and the part (t,) of each circle's area within its throat's facets.

        A wall with slip leaves half of the circle; so does a neck of four spheres to either of two throats that
        nearly are one. It is taken for at least a twentieth, should the circle lie beyond the throat's facets. Where
        there is no circle the part is what walls with slip leave of the throat.
        """
        slip = np.asarray(slip, bool)
        if slip.tobytes() in self._inscribed:
            return self._inscribed[slip.tobytes()]
        mesh = self.mesh
        radii, centres = self._circles(mesh.facet_vertices[self.first_facets], slip)
        throat, triples = self._triples
        if len(throat):
            found, places = self._circles(triples, slip)
            order = np.lexsort((np.where(found > 0.0, found, np.inf), throat))
            tied, first = np.unique(throat[order], return_index=True)
            radii[tied], centres[tied] = found[order][first], places[order][first]
        portions = np.zeros(len(mesh.facet_vertices))
        of_throat = self.facet_throat  # -1, the row appended below, within a pore
        circle_portions(
            mesh.facet_vertices, mesh.n_spheres, mesh.local_points, mesh.sizes,
            np.append(radii, 0.0)[of_throat], np.append(centres, np.zeros((1, 3)), axis=0)[of_throat], portions,
        )  # fmt: skip
        whole = 1.0 / self.mirror_images(slip)
        portions = np.where(radii > 0.0, np.clip(self._total(portions), 0.05 * whole, whole), whole)
        return self._inscribed.setdefault(slip.tobytes(), (radii, portions))

    def roundness(self, slip: np.ndarray) -> np.ndarray:
        """(t,): λ, radius of the inscribed circle over that of the circle of the neck's area; 1 without either.

        The inscribed circle's part within the throat's facets stands for that of the neck. 1 at most: that part is a
        guess where the circle lies beyond the facets.
        """
        radii, portions = self.inscribed_circles(slip)
        areas = np.maximum(self.fluid_areas, 0.0)
        known = (radii > 0.0) & (areas > 0.0)
        return np.minimum(
            np.divide(radii, np.sqrt(areas / (np.pi * portions)), out=np.ones(len(self)), where=known), 1.0
        )

    def _circles(self, vertices: np.ndarray, slip: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        mesh = self.mesh
        found = np.empty(len(vertices)), np.zeros((len(vertices), 3))
        inscribed_circles(vertices, mesh.n_spheres, mesh.local_points, mesh.sizes, slip, *found)
        return found

    @cached_property
    def _triples(self) -> tuple[np.ndarray, np.ndarray]:
        """All triples of vertices, a sphere first, of each throat that a tie has cut: throats (p,), vertices (p, 3)."""
        mesh = self.mesh
        polygons: dict[int, set[int]] = {}
        further, first, _ = self._further
        for facet, start in zip(further, first, strict=True):
            corners = polygons.setdefault(int(start), set(mesh.facet_vertices[start].tolist()))
            corners.update(mesh.facet_vertices[facet].tolist())
        rows = [
            (start, *triple)
            for start, corners in polygons.items()
            for triple in combinations(sorted(corners), 3)  # walls come last: their numbers follow the spheres'
            if triple[0] < mesh.n_spheres
        ]
        table = np.array(rows, np.int32).reshape(-1, 4)
        return self.facet_throat[table[:, 0]], table[:, 1:].copy()

    def mirror_images(self, slip: np.ndarray) -> np.ndarray:
        """(t,): 1, 2 or 4: how many images of itself a throat makes up with its walls of symmetry, (6,) bool."""
        images = np.ones(len(self))
        for wall in np.flatnonzero(slip):
            has = (self.mesh.facet_vertices == self.mesh.n_spheres + wall).any(axis=1)
            images[self._total(has.astype(float)) > 0.0] *= 2.0
        return images

    @property
    def covered(self) -> np.ndarray:
        """(t,) bool: throats whose spheres cover the facet between them."""
        return self.facet_covered[self.first_facets]

    @cached_property
    def closed(self) -> np.ndarray:
        """(t,) bool: throats without a fluid cross-section: A^f <= 0, or covered by their spheres. Nothing flows."""
        return (self.fluid_areas <= 0.0) | self.covered

    def __repr__(self) -> str:
        return f"Throats({len(self)} throats between {self.mesh.n_pores} pores)"
