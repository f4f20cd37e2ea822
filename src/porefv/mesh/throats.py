"""Throats: the geometry of every passage between two pores (C12 §2.2.2)."""

from __future__ import annotations

from collections.abc import Callable
from itertools import combinations
from typing import TYPE_CHECKING, Any, NamedTuple, TypeVar

import numpy as np

from porefv.errors import InputError
from porefv.mesh.facet_kernels import row_sums, sector_angles
from porefv.mesh.inscribed_circles import Circles, TiedCircles, circles_of_throats, inscribed_circles
from porefv.mesh.uniting import tied_facets
from porefv.system.kernels import read_only
from porefv.system.lazy import FixedInputs, lazy_property
from porefv.system.threads import for_rows

if TYPE_CHECKING:
    from porefv.mesh.pore_mesh import PoreMesh

Derived = TypeVar("Derived")


class ThroatFacets(NamedTuple):
    """The facets of each throat: throat t has the entries starts[t] ... starts[t + 1] - 1 of `facets`.

    Attributes
    ----------
    facets : (k,) int array
        The first facet of each throat comes first.
    starts : (t + 1,) int array
    """

    facets: np.ndarray
    starts: np.ndarray


class Throats(FixedInputs):
    """Throats of a mesh: one row per Laguerre edge between two pores, dual to one facet.

    Facets that share their Laguerre edge (the triangles into which a tie cuts a polygon) are one throat. Facets
    inside a united pore belong to no throat. Geometry that needs solid angles is computed only when it is needed.

    Parameters
    ----------
    mesh : PoreMesh

    Notes
    -----
    Theory, method: :eq:`eq-throat`.

    Values of a throat are sums over its facets, and signed like theirs (`Facets`). Where spheres overlap, or a throat
    is nearly closed, φ, Σγ or A^f may be zero or negative: nothing flows through such throats, and they are counted.
    """

    def __init__(self, mesh: PoreMesh):
        self.mesh = mesh
        self._inscribed: dict[bytes, tuple[np.ndarray, np.ndarray]] = {}  # by walls with slip
        self._derived: dict[Callable[[Throats], Any], Any] = {}

    def __getstate__(self) -> dict[str, Any]:
        # What functions have derived is computed anew: a function may be one that cannot be pickled.
        return {**vars(self), "_derived": {}}

    def derived(self, function: Callable[[Throats], Derived]) -> Derived:
        """function(throats), computed once and kept: for what a model needs of throats more than once."""
        if function not in self._derived:
            self._derived[function] = function(self)
        return self._derived[function]

    # ---- which facets belong to which throat --------------------------------------------------------------------

    @lazy_property
    def first_facets(self) -> np.ndarray:
        """(t,): a facet of each throat; the throat takes its sense."""
        first, second = self.mesh.facets.cells.T
        passes = self.mesh.cell_pore[first] != self.mesh.cell_pore[second]
        passes[self._further[0]] = False
        return np.flatnonzero(passes)

    @lazy_property
    def _further(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """The further facets of throats that a tie has cut in several: their ids, first facets and senses."""
        mesh = self.mesh
        # Only between two Laguerre vertices that are both tied can there be more facets than one.
        several = tied_facets(mesh.facets.cells, mesh.cell_node, mesh.cell_pore)
        nodes = mesh.cell_node[mesh.facets.cells[several]].astype(np.int64)
        keys = nodes.min(axis=1) * len(mesh.cells) + nodes.max(axis=1)
        _, first, inverse = np.unique(keys, return_index=True, return_inverse=True)
        first = first[inverse]
        further = np.flatnonzero(first != np.arange(len(several)))
        sense = np.where(nodes[further, 0] == nodes[first[further], 0], 1.0, -1.0)
        return several[further], several[first[further]], sense

    @lazy_property
    def facet_throat(self) -> np.ndarray:
        """(f,) int: throat of each facet, -1 inside a united pore."""
        throat = np.full(len(self.mesh.facets.cells), -1)
        throat[self.first_facets] = np.arange(len(self))
        further, first, _ = self._further
        throat[further] = throat[first]
        return throat

    @lazy_property
    def facets_of_throats(self) -> ThroatFacets:
        """The facets of each throat."""
        further, first, _ = self._further
        facets = np.concatenate([self.first_facets, further])
        throat = np.concatenate([np.arange(len(self)), self.facet_throat[first]])
        order = np.argsort(throat, kind="stable")
        return ThroatFacets(facets[order], np.searchsorted(throat[order], np.arange(len(self) + 1)))

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

    # ---- geometry -------------------------------------------------------------------------------------------------

    @lazy_property
    def pores(self) -> np.ndarray:
        """(t, 2) int32: the two pores of each throat."""
        return self.mesh.cell_pore[self.mesh.facets.cells[self.first_facets]]

    @lazy_property
    def spheres(self) -> np.ndarray:
        """(t, 3) int32: vertices of the first facet of each throat, spheres first; n_spheres + w for wall w."""
        return self.mesh.facets.vertices[self.first_facets]

    def between(self, i: int, j: int, k: int) -> int:
        """The throat between three vertices of the mesh, in any order.

        Parameters
        ----------
        i, j, k : int
            Ids of spheres, or n_spheres + w for wall w of `porefv.WALLS`.

        Raises
        ------
        InputError
            If the triangulation has no facet of these three, or it lies inside a united pore.

        Examples
        --------
        >>> throats = PoreMesh(Packing.read("data/packings/n25_s1.csv")).throats
        >>> throats.between(*throats.spheres[7])
        7
        """
        wanted = sorted(int(vertex) for vertex in (i, j, k))
        found = np.flatnonzero((np.sort(self.mesh.facets.vertices, axis=1) == wanted).all(axis=1))
        if len(found) == 0:
            raise InputError(f"there is no facet of the vertices {i}, {j} and {k}: `spheres` has those of all throats")
        throat = int(self.facet_throat[found[0]])
        if throat < 0:
            raise InputError(f"the facet of the vertices {i}, {j} and {k} lies inside a united pore: it is no throat")
        return throat

    @lazy_property
    def normals(self) -> np.ndarray:
        """(t, 3): unit normal of each throat, from its first pore to its second."""
        return self.mesh.facets.normals[self.first_facets]

    @lazy_property
    def lengths(self) -> np.ndarray:
        """(t,): length L of each throat, between its Laguerre vertices [m]."""
        return self.mesh.facets.lengths[self.first_facets]

    @property
    def effective_lengths(self) -> np.ndarray:
        """(t,): lengths, those at the level of rounding or below as 2.2e-16 of the smallest radius [m]."""
        return np.maximum(self.lengths, np.finfo(float).eps * float(self.mesh.packing.radii.min()))

    @lazy_property
    def doubling_heights(self) -> np.ndarray:
        """(f,): height over the constriction at which the section of each facet's throat has twice its fluid area [m].

        The section at height s is A^f + Σ θ s² / 2, with θ the angles of the spheres. Zero where A^f is not positive.

        Theory, forces: :eq:`eq-pressure-along-throat`.
        """
        facets = self.mesh.facets
        angles = np.empty(len(facets))
        for_rows(sector_angles, len(angles), facets.vertices, facets.sectors, self.mesh.cell_vertices, angles)
        angles = self.total_by_facet(angles)
        areas = np.maximum(self.total_by_facet(facets.fluid_areas), 0.0)
        return np.sqrt(np.divide(2.0 * areas, angles, out=np.zeros_like(areas), where=angles > 0.0))

    @lazy_property
    def areas(self) -> np.ndarray:
        """(t,): cross-section A of each throat, solid and fluid [m²]."""
        return self._total(self.mesh.facets.areas)

    @lazy_property
    def fluid_areas(self) -> np.ndarray:
        """(t,): fluid cross-section A^f of each throat [m²]."""
        return self._total(self.mesh.facets.fluid_areas)

    @lazy_property
    def volumes(self) -> np.ndarray:
        """(t,): void volume φ of each throat [m³]."""
        return self._total(self.mesh.facets.volumes)

    def wetted_surfaces(self, slip: np.ndarray) -> np.ndarray:
        """(t,): Σγ^k of each throat over its spheres and no-slip walls [m²]."""
        return self._total(row_sums(read_only(self.mesh.facets.wetted_surfaces(slip))))

    def hydraulic_radii(self, slip: np.ndarray) -> np.ndarray:
        """(t,): φ / Σγ of each throat, zero where Σγ is not positive [m]; `slip` as for `wetted_surfaces`."""
        surfaces = self.wetted_surfaces(slip)
        return np.divide(self.volumes, surfaces, out=np.zeros(len(self)), where=surfaces > 0.0)

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
        radii, portions = np.empty((2, len(self)))
        for_rows(
            circles_of_throats, len(self), self.facets_of_throats, mesh.facets.vertices, mesh.cell_vertices, slip,
            self._tied_circles(slip), radii, portions,
        )  # fmt: skip
        whole = 1.0 / self.mirror_images(slip)
        portions = np.where(radii > 0.0, np.clip(portions, 0.05 * whole, whole), whole)
        return self._inscribed.setdefault(slip.tobytes(), (radii, portions))

    def inscribed_centres(self, slip: np.ndarray) -> np.ndarray:
        """(t, 3): centres of the circles of `inscribed_radii`; a corner's where there is no circle [m]."""
        slip = np.asarray(slip, bool)
        mesh = self.mesh
        circles = Circles(np.empty(len(self)), np.empty((len(self), 3)))
        for_rows(inscribed_circles, len(self), self.spheres, mesh.cell_vertices, slip, circles)
        tied = self._tied_circles(slip)
        circles.centres[tied.throats] = tied.centres
        return circles.centres + mesh.triangulation.origin

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

    def _tied_circles(self, slip: np.ndarray) -> TiedCircles:
        """Circles of the throats that a tie has cut: of each the least that three of its vertices have."""
        throat, corners = self._tied_corner_triples
        found = Circles(np.empty(len(corners)), np.empty((len(corners), 3)))
        for_rows(inscribed_circles, len(corners), corners, self.mesh.cell_vertices, slip, found)
        order = np.lexsort((np.where(found.radii > 0.0, found.radii, np.inf), throat))
        tied, first = np.unique(throat[order], return_index=True)
        return TiedCircles(tied, found.radii[order][first], found.centres[order][first])

    @lazy_property
    def _tied_corner_triples(self) -> tuple[np.ndarray, np.ndarray]:
        """All triples of vertices, a sphere first, of each throat that a tie has cut: throats (p,), vertices (p, 3)."""
        mesh = self.mesh
        polygons: dict[int, set[int]] = {}
        further, first, _ = self._further
        for facet, start in zip(further, first, strict=True):
            corners = polygons.setdefault(int(start), set(mesh.facets.vertices[start].tolist()))
            corners.update(mesh.facets.vertices[facet].tolist())
        rows = [
            (start, *triple)
            for start, corners in polygons.items()
            for triple in combinations(sorted(corners), 3)  # walls come last: their numbers follow the spheres'
            if triple[0] < mesh.cell_vertices.n_spheres
        ]
        table = np.array(rows, np.int32).reshape(-1, 4)
        return self.facet_throat[table[:, 0]], table[:, 1:].copy()

    def mirror_images(self, slip: np.ndarray) -> np.ndarray:
        """(t,): 1, 2 or 4: how many images of itself a throat makes up with its walls of symmetry, (6,) bool."""
        images = np.ones(len(self))
        for wall in np.flatnonzero(slip):
            has = (self.mesh.facets.vertices == self.mesh.n_spheres + wall).any(axis=1)
            images[self._total(has.astype(float)) > 0.0] *= 2.0
        return images

    @property
    def covered(self) -> np.ndarray:
        """(t,) bool: throats whose spheres cover the facet between them."""
        return self.mesh.facets.covered[self.first_facets]

    @lazy_property
    def closed(self) -> np.ndarray:
        """(t,) bool: throats without a fluid cross-section: A^f <= 0, or covered by their spheres. Nothing flows."""
        return (self.fluid_areas <= 0.0) | self.covered

    def __repr__(self) -> str:
        return f"Throats({len(self)} throats between {self.mesh.n_pores} pores)"
