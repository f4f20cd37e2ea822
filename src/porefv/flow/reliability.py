"""How much of a flow is in throats of a kind that the conductance model was not tested on.

The model was tested on the 101 packings of docs/accuracy.md, against resolved flow: grains that touch or nearly do,
clouds, and voids full of fines. A throat can be outside that range in four ways.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from porefv.mesh.pore_mesh import PoreMesh
from porefv.mesh.vectors import dot, towards, wall_distance
from porefv.system.kernels import kernel, unsigned_range
from porefv.system.threads import for_rows

# Largest overlap of two spheres, over the radius of the smaller, and reach of a sphere beyond a no-slip wall, over its
# radius. The tested packings have 0.004. The error found at 0.18 is -8 % and grows in proportion: 2 % here.
OVERLAP, CUT = 0.05, 0.05
# Largest radius of the circle inscribed in a neck, over that of its largest sphere: among grains, and along a no-slip
# wall. 95 % of the dissipation of the tested clouds is below 2.6 and 1.9; at walls errors grow beyond 1.
OPEN, OPEN_AT_WALL = 2.5, 1.0
# Largest ratio of the radii of a throat's spheres: that of the tested packings.
RATIO = 20.0
# Part of the dissipation outside the range from which on a warning is given.
WARNED = 0.1

# What was found outside, by the names of the fields of `Reliability`.
ERRORS = {
    "overlap": "-8, -23 and -38 % for a cubic lattice whose radii are 1.1, 1.2 and 1.3 of touching ones",
    "cut": "-52 % for discs between two plates",
    "openness": "-12 % for clouds along walls, -44 % for free fluid along a bed",
    "size_ratio": "none measured beyond a ratio of 20",
}

_OVERLAP, _CUT, _OPEN, _RATIO = 1, 2, 4, 8


@dataclass(frozen=True)
class Reliability:
    """Parts of the dissipated power of a flow in throats outside the range where the model was tested.

    Where no open path leads through the sample nothing flows: they are parts of the number of throats then.

    Attributes
    ----------
    overlap : float
        In throats between spheres that overlap one another, or their mirror images behind a wall with slip, by more
        than 0.05 of the smaller radius.
    cut : float
        In throats of spheres that reach beyond a no-slip wall by more than 0.05 of their radius.
    openness : float
        In throats with more room than grains: the radius of the circle inscribed in the neck is more than 2.5 of that
        of the largest sphere, along a no-slip wall more than 1.
    size_ratio : float
        In throats between spheres whose radii have a ratio of more than 20.
    outside : float
        In throats of any of these kinds.
    of : {"dissipation", "throats"}
        What the parts are parts of.
    """

    overlap: float
    cut: float
    openness: float
    size_ratio: float
    outside: float
    of: str = "dissipation"

    @property
    def warning(self) -> str | None:
        """What is to be said of the flow; None if most of it is within the range."""
        if self.outside <= WARNED:
            return None
        parts = {name: getattr(self, name) for name in ERRORS}
        worst = max(parts, key=lambda name: parts[name])
        what = "flow's dissipation is in throats" if self.of == "dissipation" else "throats are"
        return (
            f"{100 * self.outside:.0f} % of the {what} outside the range where the conductance model was tested, "
            f"most of it by {worst.replace('_', ' ')}. Errors of the permeability found there: {ERRORS[worst]}"
        )


def reliability(
    mesh: PoreMesh, conductances: np.ndarray, flux: np.ndarray, slip: np.ndarray, *, of_throats: bool = False
) -> Reliability:
    """The parts of the dissipated power of a flow that are outside the tested range; zero where nothing flows.

    Parameters
    ----------
    mesh : PoreMesh
    conductances, flux : (t,) arrays
        Of the throats [m³/(Pa s), m³/s].
    slip : (6,) bool array
        Walls of symmetry.
    of_throats : bool
        Whether to find the parts of the number of throats where nothing flows, because the throats are closed.
    """
    throats = mesh.throats
    power = np.divide(flux**2, conductances, out=np.zeros(len(throats)), where=conductances > 0.0)
    kinds = np.empty(len(throats), np.uint8)
    for_rows(
        kinds_of_throats, len(throats), throats.first_facets, mesh.facets.vertices, mesh.cell_vertices,
        throats.inscribed_circles(slip)[0], np.asarray(slip, bool), kinds,
    )  # fmt: skip
    of_throats = of_throats and not power.any()
    if of_throats:
        power = np.ones(len(throats))
    total = power.sum()
    by_kinds = np.bincount(kinds, power, 16) / (total if total > 0.0 else 1.0)
    bits = np.arange(16)
    overlap, cut, openness, ratio = (float(by_kinds[bits & bit > 0].sum()) for bit in (_OVERLAP, _CUT, _OPEN, _RATIO))
    of = "throats" if of_throats else "dissipation"
    return Reliability(overlap, cut, openness, ratio, outside=float(by_kinds[1:].sum()), of=of)


@kernel(error_model="numpy")
def kinds_of_throats(first, last, first_facets, facet_vertices, vertices, inscribed, slip, kinds):
    """Fill in (t,) uint8: in which ways throats first ... last - 1 are outside the tested range, a bit for each.

    Parameters
    ----------
    first, last : int
    first_facets : (t,) int array
    facet_vertices : (f, 3) int32 array
    vertices : Vertices
    inscribed : (t,) array
        Radius of the circle inscribed in each neck [m].
    slip : (6,) bool array
    kinds : (t,) uint8 array
    """
    n, sizes = vertices.n_spheres, vertices.sizes
    for t in unsigned_range(first, last):
        f = first_facets[t]
        least, most = np.inf, 0.0
        kind = 0
        at_wall = False
        for v in range(3):
            k = facet_vertices[f, v]
            if k >= n:
                at_wall = at_wall or not slip[k - n]
                continue
            r = sizes[k]
            least, most = min(least, r), max(most, r)
            for w in range(3):
                m = facet_vertices[f, w]
                if m >= n:
                    beyond = r - wall_distance(k, m, vertices)
                    if slip[m - n]:
                        if 2.0 * beyond > OVERLAP * r:
                            kind |= _OVERLAP
                    elif beyond > CUT * r:
                        kind |= _CUT
                elif m != k:
                    u = towards(k, m, vertices)
                    if r + sizes[m] - np.sqrt(dot(u, u)) > OVERLAP * min(r, sizes[m]):
                        kind |= _OVERLAP
        if inscribed[t] > (OPEN_AT_WALL if at_wall else OPEN) * most:
            kind |= _OPEN
        if most > RATIO * least:
            kind |= _RATIO
        kinds[t] = kind
