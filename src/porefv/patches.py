"""Pressure on the patches of spheres that line a throat, which falls along it from pore to pore.

A pore's part of a throat is the pyramid from the throat's facet to the pore's Laguerre vertex. It cuts a patch from
each of the facet's spheres, a spherical triangle. One pressure for all of a pore (C12 eq. 14) leaves the whole of the
fall in the facet's plane; here pressure depends on the height s over that plane, as friction in the sections of a
hyperboloid has it: what is left of the drop from the vertex at height h to the neck is

    1 - Φ(s) / Φ(h),    Φ(s) = t - t³/3,    t = x / √(1 + x²),    x = β s / e,

for dΦ/dx = (1 + x²)^{-5/2}, as A^{-5/2} of a section A = A^f (1 + s² / e²).
"""

from __future__ import annotations

import numpy as np

from porefv.conductance.sections import STRETCH
from porefv.facets import _at, _cross, _dot, _minus, _towards, _unit
from porefv.kernels import njit, prange

# Points on each triangle, towards its pore's vertex and across: 3 % of what they move, in the mean square.
_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(2)
_NODES, _WEIGHTS = 0.5 * (_NODES + 1.0), 0.5 * _WEIGHTS
_ACROSS, _SHARES = np.polynomial.legendre.leggauss(3)
_ACROSS, _SHARES = 0.5 * (_ACROSS + 1.0), 0.5 * _SHARES


@njit(cache=True, parallel=True, error_model="numpy")
def add_patches(
    facets, facet_cells, facet_vertices, n, points, sizes, vertices, normals, necks, shares, pressure, drag
):  # fmt: skip
    """Move, for a unit drop across each of `facets`, what patches take of it from drag to pressure.

    Parameters
    ----------
    necks : (f,) array
        e, the height at which the section of each facet's throat is twice its neck's; not positive: left out [m].
    shares : (f, 3) array
        Of drag, among the vertices of each facet.
    pressure, drag : (m, 3, 3) arrays
        Forces on the vertices of each of `facets`, added to in place [m²]. Their sum stays as it is.
    """
    for i in prange(facets.shape[0]):
        f = facets[i]
        if not necks[f] > 0.0:
            continue
        scale = STRETCH / necks[f]
        first = _at(facet_vertices[f, 0], points)
        normal = _at(f, normals)
        # The vertex of a pore beyond the facet's plane leaves no part of the throat to that pore.
        low = min(_fall(scale * _dot(_minus(_at(facet_cells[f, 0], vertices), first), normal)), 0.0)
        high = max(_fall(scale * _dot(_minus(_at(facet_cells[f, 1], vertices), first), normal)), 0.0)
        if not high - low > 0.0:
            continue
        moved = np.zeros(3)
        for side in range(2):
            drop = (high if side == 1 else -low) / (high - low)
            if drop == 0.0:
                continue
            for v in range(3):
                k = facet_vertices[f, v]
                if k < n:
                    patch = _patch(f, v, facet_cells[f, side], drop, scale, facet_vertices, n, points, sizes, vertices,
                                   normal)  # fmt: skip
                    for axis in range(3):
                        pressure[i, v, axis] += patch[axis]
                        moved[axis] += patch[axis]
        whole = shares[f, 0] + shares[f, 1] + shares[f, 2]
        for v in range(3):
            share = shares[f, v] / whole if whole > 0.0 else 1.0 / 3.0
            for axis in range(3):
                drag[i, v, axis] -= share * moved[axis]


@njit(cache=True)
def _fall(x):
    """Φ: friction from the neck to a height over it."""
    t = x / np.sqrt(1.0 + x * x)
    return t - t * t * t / 3.0


@njit(cache=True)
def _patch(f, v, cell, drop, scale, facet_vertices, n, points, sizes, vertices, normal):
    """Force on a sphere's patch by the pressure's fall between a pore's vertex and the neck, `drop` in all."""
    k = facet_vertices[f, v]
    a = _unit(_towards(k, facet_vertices[f, (v + 1) % 3], n, points))
    b = _unit(_towards(k, facet_vertices[f, (v + 2) % 3], n, points))
    to_vertex = _minus(_at(cell, vertices), _at(k, points))
    c = _unit(to_vertex)
    square = sizes[k] * sizes[k]
    steep = _dot(c, normal)
    # Positive along the facet's normal, where pressure is lower than at the neck, negative on the other side of it.
    volume = _dot(_cross(a, b), c)
    end = _fall(scale * _dot(to_vertex, normal))
    x = 0.0
    y = 0.0
    z = 0.0
    for i in range(_NODES.shape[0]):
        for j in range(_ACROSS.shape[0]):
            wc = _NODES[i]
            wb = (1.0 - wc) * _ACROSS[j]
            wa = 1.0 - wc - wb
            u = wa * a[0] + wb * b[0] + wc * c[0]
            w = wa * a[1] + wb * b[1] + wc * c[1]
            q = wa * a[2] + wb * b[2] + wc * c[2]
            inverse = 1.0 / np.sqrt(u * u + w * w + q * q)
            left = max(1.0 - _fall(scale * sizes[k] * wc * steep * inverse) / end, 0.0)
            # dA of a point of the flat triangle abc, seen from the centre: volume / distance³.
            weight = left * _WEIGHTS[i] * _SHARES[j] * (1.0 - wc) * volume * inverse**4
            x += weight * u
            y += weight * w
            z += weight * q
    factor = -drop * square
    return factor * x, factor * y, factor * z
