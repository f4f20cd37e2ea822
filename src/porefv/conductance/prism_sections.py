"""Diffusion through a throat: sections of the prism over its facet, one after another from vertex to vertex.

A substance diffuses through the sections A(s) of a throat one after another,

    1 / g = ∫ ds / A(s),    A(s) = A^f + ½ Σ θ min(|s|, r)²,

with s the height over the facet, between those of the two Laguerre vertices. A(s) is the section of the prism over the
facet, less the discs of its spheres: each has the angle θ there and the radius √(r² - s²), and is gone beyond its pole.
Without spheres g is A / L, for which the Delaunay triangulation and its Laguerre dual are exact.
"""

from __future__ import annotations

import numpy as np

from porefv.mesh.facet_kernels import facet_angles, frame_of
from porefv.mesh.throats import Throats
from porefv.mesh.vectors import dot, minus, vector_at
from porefv.system.kernels import helper, kernel, unsigned_range
from porefv.system.threads import for_rows


def diffusive_conductances(throats: Throats) -> np.ndarray:
    """g of each throat: a substance of diffusivity D passes with D g (c_i - c_j).

    The same g is that of heat in the fluid, with its thermal conductivity, and of a current in a pore fluid between
    insulating grains.

    Parameters
    ----------
    throats : Throats

    Returns
    -------
    (t,) array
        Zero where a throat is closed, or has no fluid area between the two vertices [m].

    Notes
    -----
    It has no parameter. Its error against resolved diffusion is in `docs/transport.md`.
    """
    mesh = throats.mesh
    found = np.empty(len(throats))
    for_rows(
        prism_sections, len(throats), throats.facets_of_throats, mesh.facets.planes, mesh.cell_vertices,
        mesh.local_vertices, throats.effective_lengths, throats.fluid_areas, found,
    )  # fmt: skip
    found[throats.closed] = 0.0
    return found


@kernel(error_model="numpy")
def prism_sections(first, last, throats, facets, vertices, laguerre_vertices, lengths, fluid_areas, conductances):
    """Fill in g of throats first ... last - 1.

    Parameters
    ----------
    first, last : int
        Rows to treat: first ... last - 1.
    throats : ThroatFacets
    facets : FacetPlanes
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
    angles = np.empty(3 * most)
    for t in unsigned_range(first, last):
        count = _discs(t, throats, facets, vertices, radii, angles)
        f = throats.facets[throats.starts[t]]
        a = vector_at(facets.vertices[f, 0], vertices.points)
        normal = vector_at(f, facets.normals)
        low = dot(normal, minus(vector_at(facets.cells[f, 0], laguerre_vertices), a))
        high = dot(normal, minus(vector_at(facets.cells[f, 1], laguerre_vertices), a))
        # Both parts of the way lie over the facet: the section depends on |s| alone.
        if low < 0.0 < high:
            resistance = _resistance(0.0, -low, fluid_areas[t], radii, angles, count)
            resistance += _resistance(0.0, high, fluid_areas[t], radii, angles, count)
        else:
            begin, end = min(abs(low), abs(high)), max(abs(low), abs(high))
            if end - begin < 1e-9 * (end + lengths[t]):  # a difference of rounding
                end = begin + max(end - begin, 1e-9 * (end + lengths[t]))
                resistance = _resistance(begin, end, fluid_areas[t], radii, angles, count) * lengths[t] / (end - begin)
            else:
                resistance = _resistance(begin, end, fluid_areas[t], radii, angles, count)
        conductances[t] = 1.0 / resistance


@helper
def _discs(t, throats, facets, vertices, radii, angles):
    """Fill in radius and angle of each disc of throat t, the smallest first; how many there are."""
    count = 0
    for i in range(throats.starts[t], throats.starts[t + 1]):
        f = throats.facets[i]
        of_vertices = facet_angles(frame_of(f, facets, vertices), vertices.n_spheres)
        for v in range(3):
            k = facets.vertices[f, v]
            if k >= vertices.n_spheres:
                continue
            r, angle = vertices.sizes[k], of_vertices[v]
            place = count
            while place > 0 and radii[place - 1] > r:
                radii[place] = radii[place - 1]
                angles[place] = angles[place - 1]
                place -= 1
            radii[place] = r
            angles[place] = angle
            count += 1
    return count


@helper(error_model="numpy")
def _resistance(begin, end, neck, radii, angles, count):
    """∫ ds / A(s) over 0 ≤ begin ≤ s ≤ end; infinite where a section has no area."""
    slope = 0.0
    for i in range(count):
        slope += 0.5 * angles[i]
    # Between two radii the section is constant + slope s²: discs beyond their poles have left their whole area.
    constant, total, s = neck, 0.0, begin
    for i in range(count + 1):
        upper = end if i == count else min(radii[i], end)
        if upper > s:
            total += _between(s, upper, constant, slope)
            s = upper
        if i < count:
            constant += 0.5 * angles[i] * radii[i] * radii[i]
            slope -= 0.5 * angles[i]
    return total


@helper(error_model="numpy")
def _between(s0, s1, constant, slope):
    """∫ ds / (constant + slope s²) over s0 ... s1, the difference of two arctangents, or of their hyperbolic kind."""
    slope = max(slope, 0.0)  # the last radius leaves rounding
    if constant + slope * s0 * s0 <= 0.0:
        return np.inf
    y = (s1 - s0) * np.sqrt(abs(constant) * slope)
    x = constant + slope * s0 * s1
    if y < 1e-8 * x:
        return (s1 - s0) / x
    angle = np.arctan2(y, x) if constant > 0.0 else np.arctanh(y / x)
    return (s1 - s0) * angle / y
