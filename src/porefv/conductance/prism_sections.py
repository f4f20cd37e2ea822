"""Diffusion through a throat: sections of the prism over its facet, one after another from vertex to vertex.

A substance diffuses through the sections A(s) of a throat one after another,

    1 / g = ∫ ds / A(s),    A(s) = A^f + ½ Σ θ min(|s|, r)²,

with s the height over the facet, between those of the two Laguerre vertices. A(s) is the section of the prism over the
facet, less the discs of its spheres: each has the angle θ there and the radius √(r² - s²), and is gone beyond its pole.
Where spheres overlap, θ is 2 A^k / r², the angle of the sector that is left of sphere k: A(s) grows from A^f to the
area A of the whole facet. Without spheres g is A / L, for which the Delaunay triangulation and its Laguerre dual are
exact.
"""

from __future__ import annotations

import numpy as np

from porefv.mesh.throats import Throats
from porefv.mesh.vectors import dot, minus, vector_at
from porefv.system.kernels import helper, kernel, unsigned_range
from porefv.system.threads import for_rows


def diffusive_conductances(throats: Throats) -> np.ndarray:
    """g of each throat: a substance of diffusivity D passes with D g (c_i - c_j).

    The same g holds for heat in the fluid, with its thermal conductivity, and for a current in a conducting fluid
    between insulating grains.

    Parameters
    ----------
    throats : Throats

    Returns
    -------
    (t,) array
        Zero where a throat is closed (`Throats.closed`), or has no fluid area somewhere between the two vertices [m].

    Notes
    -----
    Theory, diffusion: :eq:`eq-prism`.

    There is no parameter. A throat that is closed in its facet's plane passes nothing, even if both its vertices lie on
    the same side of the facet, where the section may be open. Where three spheres overlap in the facet, A^f counts
    what they share more than once, and may be negative: such a throat is closed, as for the flow.
    """
    mesh = throats.mesh
    facets = mesh.facets
    found = np.empty(len(throats))
    for_rows(
        prism_sections, len(throats), throats.facets_of_throats, facets.planes, facets.sectors, mesh.cell_vertices,
        mesh.local_vertices, throats.effective_lengths, throats.fluid_areas, found,
    )  # fmt: skip
    found[throats.closed] = 0.0
    return found


@kernel(error_model="numpy")
def prism_sections(
    first, last, throats, facets, sectors, vertices, laguerre_vertices, lengths, fluid_areas, conductances
):
    """Fill in g of throats first ... last - 1.

    Parameters
    ----------
    first, last : int
        Rows to treat: first ... last - 1.
    throats : ThroatFacets
    facets : FacetPlanes
    sectors : (f, 3) array
        A^k, inside the sphere of each vertex of each facet, 0 for walls [m²].
    vertices : Vertices
    laguerre_vertices : (m, 3) array
        Laguerre vertex of each cell, from the local origin [m].
    lengths : (t,) array
        L of each throat, positive [m].
    fluid_areas : (t,) array
        A^f of each throat [m²].
    conductances : (t,) array
        To be filled [m].
    """
    most = 0
    for t in range(first, last):
        most = max(most, throats.starts[t + 1] - throats.starts[t])
    radii = np.empty(3 * most)
    halves = np.empty(3 * most)
    for t in unsigned_range(first, last):
        count = _discs(t, throats, facets, sectors, vertices, radii, halves)
        f = throats.facets[throats.starts[t]]
        a = vector_at(facets.vertices[f, 0], vertices.points)
        normal = vector_at(f, facets.normals)
        low = dot(normal, minus(vector_at(facets.cells[f, 0], laguerre_vertices), a))
        high = dot(normal, minus(vector_at(facets.cells[f, 1], laguerre_vertices), a))
        neck = fluid_areas[t]
        # The section depends on |s| alone.
        if low < 0.0 < high:
            resistance = _resistance(0.0, -low, neck, radii, halves, count)
            resistance += _resistance(0.0, high, neck, radii, halves, count)
        else:
            begin, end = min(abs(low), abs(high)), max(abs(low), abs(high))
            # Two vertices that coincide but for rounding: the section there, over the throat's effective length.
            span = max(end - begin, 1e-9 * (end + lengths[t]))
            resistance = _resistance(begin, begin + span, neck, radii, halves, count)
            if span > end - begin:
                resistance *= lengths[t] / span
        conductances[t] = 1.0 / resistance


@helper
def _discs(t, throats, facets, sectors, vertices, radii, halves):
    """Fill in r and θ / 2 of each disc of throat t, the smallest first; how many there are."""
    count = 0
    for i in range(throats.starts[t], throats.starts[t + 1]):
        f = throats.facets[i]
        for v in range(3):
            k = facets.vertices[f, v]
            if k >= vertices.n_spheres:
                continue
            r = vertices.sizes[k]
            place = count
            while place > 0 and radii[place - 1] > r:
                radii[place] = radii[place - 1]
                halves[place] = halves[place - 1]
                place -= 1
            radii[place] = r
            halves[place] = sectors[f, v] / (r * r)
            count += 1
    return count


@helper(error_model="numpy")
def _resistance(begin, end, neck, radii, halves, count):
    """∫ ds / A(s) over 0 ≤ begin ≤ s ≤ end; infinite where a section has no area."""
    growth = 0.0
    for i in range(count):
        growth += halves[i]
    # Between two radii the section is constant + growth s²: discs beyond their poles have left their whole area.
    constant, total, s = neck, 0.0, begin
    for i in range(count + 1):
        upper = end if i == count else min(radii[i], end)
        if upper > s:
            total += _between(s, upper, constant, growth)
            s = upper
        if i < count:
            constant += halves[i] * radii[i] * radii[i]
            growth -= halves[i]
    return total


@helper(error_model="numpy")
def _between(s0, s1, constant, growth):
    """∫ ds / (constant + growth s²) from s0 to s1: the difference of two arctangents, or of two area tangents."""
    if constant + growth * s0 * s0 <= 0.0 or constant + growth * s1 * s1 <= 0.0:
        return np.inf
    y = (s1 - s0) * np.sqrt(abs(constant * growth))
    x = constant + growth * s0 * s1
    if y < 1e-8 * x:
        return (s1 - s0) / x
    angle = np.arctan2(y, x) if (constant > 0.0) == (growth > 0.0) else np.arctanh(y / x)
    return (s1 - s0) * angle / y
