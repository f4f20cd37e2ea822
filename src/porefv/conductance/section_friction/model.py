"""SectionFriction: the conductance model that sums friction over the cross-sections of a throat, the default."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from porefv.conductance.model import ConductanceModel, DropBeyondVertices
from porefv.conductance.section_friction.friction_kernels import (
    Drag,
    Ends,
    Necks,
    centres_beyond_vertices,
    section_friction,
)
from porefv.conductance.section_friction.pore_centres import centres_of_pores
from porefv.errors import InputError
from porefv.mesh.throats import Throats
from porefv.system.number_checks import LEAST, MOST, within_range
from porefv.system.threads import for_rows


@dataclass(frozen=True)
class SectionFriction(ConductanceModel):
    """Friction summed over the cross-sections of a throat: L / g = ∫ (c₁ P + 2 c₂ A / r) / (A² w) ds.

    A(s) and P(s) are a section's fluid area and wetted perimeter, w its opening, and r a mean radius of the spheres,
    ∛r² weighed by their angles. Fluid that passes with q / A on average and is at rest on the perimeter is sheared
    by q / (A w), which on all of the perimeter makes the first part. The second, for round bodies, is greater the
    further they are apart, and alone is left where there is much more room than grains: a drag in proportion to r.

    s runs between √½ times the heights of the pore centres (`centres_of_pores`). On its way to a centre at h the
    section grows by 1 - 2 s / 3 h of what the prism's does.

    w = λ^{3/2} max(√(A / (π χ)), 2 A / P). λ, the radius of the circle inscribed in the neck over that of the circle of
    the neck's area, keeps the flow out of cusps; χ is the part of the inscribed circle that lies within the throat, the
    rest being that of mirror images or of a neighbour that shares its neck. P counts no-slip walls.

    Parameters
    ----------
    friction, curvature : float
        c₁, c₂: fitted to permeabilities by resolved Stokes flow (docs/accuracy.md).

    Notes
    -----
    Theory, section friction: :eq:`eq-section-friction` and :eq:`eq-sections`.
    """

    friction: float = 1.35
    curvature: float = 1.74
    name = "section-friction"
    force_split = "drag"

    def __post_init__(self) -> None:
        for what in ("friction", "curvature"):
            value = getattr(self, what)
            if not (isinstance(value, (int, float)) and 0.0 < value < np.inf and within_range(value)):
                raise InputError(f"{what} must be a positive number between {LEAST:g} and {MOST:g}, not {value!r}")

    def conductivity(self, throats: Throats, slip: np.ndarray) -> np.ndarray:
        """(t,): conductivity g of each throat [m⁴]; `slip` (6,) bool marks the walls of symmetry."""
        return self._friction(throats, slip, np.arange(len(throats)), beyond=False)[0]

    def drop_beyond_vertices(self, throats: Throats, slip: np.ndarray) -> DropBeyondVertices:
        """The part of each throat's drop that is lost between a pore's Laguerre vertex and its centre, if beyond."""
        mesh = throats.mesh
        away = np.empty(len(throats), bool)
        ends = Ends(mesh.local_vertices, throats.derived(centres_of_pores))
        for_rows(centres_beyond_vertices, len(throats), throats.first_facets, mesh.facets.planes, ends, away)
        which = np.flatnonzero(away)
        return DropBeyondVertices(which, self._friction(throats, slip, which, beyond=True)[1])

    def _friction(
        self, throats: Throats, slip: np.ndarray, which: np.ndarray, *, beyond: bool
    ) -> tuple[np.ndarray, np.ndarray]:
        """Of some throats (u,): conductivity (u,), and parts of the drop beyond the vertices (u, 2) where asked for."""
        mesh = throats.mesh
        ends = Ends(mesh.local_vertices, throats.derived(centres_of_pores))
        necks = Necks(
            throats.effective_lengths,
            throats.fluid_areas,
            throats.roundness(slip),
            throats.inscribed_circles(slip)[1],
        )
        conductivity, parts = np.empty(len(which)), np.empty((len(which) if beyond else 0, 2))
        radii = mesh.cell_vertices.sizes[: mesh.cell_vertices.n_spheres]
        for_rows(
            section_friction,
            len(which),
            which,
            throats.facets_of_throats,
            mesh.facets.planes,
            mesh.cell_vertices,
            ends,
            necks,
            Drag(float(self.friction), float(self.curvature), np.asarray(slip, bool), np.cbrt(radii) ** 2),
            conductivity,
            parts,
        )
        return conductivity, parts
