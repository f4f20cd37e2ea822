"""Pressure along an axis: its mean over planes normal to the axis, and over layers between them."""

from __future__ import annotations

from itertools import pairwise
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from porefv.mesh.pore_mesh import PoreMesh

# Distance of planes from walls, as a part of the size of the box: above rounding.
_INSET = 1e-9
# Reach of a facet on either side of its plane, over the radius of its largest sphere: what lies further away is clear
# fluid. Without it pressures of the surface of a cloud would be spread up to the lid. With more a plane above the
# surface reads more of what lies below it: at 2 up to 0.1 diameters of the cloud, at 4 0.25, at 1.5 0.03. With less
# more of a linear pressure is in steps.
_REACH = 2.0


class PlanePressures(NamedTuple):
    """Pressure along an axis, as means over sections of the box.

    A plane divides the cells into those whose Laguerre vertex lies below it, and those above: the facets between the
    two are a surface across the box. The pressure at the plane is the mean over this surface, by areas projected on
    the plane. Between the two Laguerre vertices of a facet the pressure is linear, within a diameter of its largest
    sphere on either side; in the clear fluid beyond it is constant.

    A facet is normal to the line between its Laguerre vertices, so that no area counts against another: a mean lies
    between the least and the largest pressure. Laguerre vertices of cells on a wall lie on the wall: every plane in the
    box has a pressure. One that is linear along the axis is read to rounding (on a wall, to 1e-9 of its drop) where
    no Laguerre vertex is further than a diameter from its facets, else as that of a place nearby: at most 0.01 mean
    radii away in packings, 0.07 in clouds of a solid fraction of 0.25.

    Attributes
    ----------
    lower, upper : (s,) arrays
        Laguerre vertices of each facet along the axis, of those that differ there [m].
    begin, end : (s,) arrays
        Between which the pressure is linear [m].
    areas : (s,) array
        Of each facet, projected on the plane [m²].
    pressures : (s, 2) array
        At the lower and the upper Laguerre vertex [Pa].
    walls : (2,) array
        Places of the lower and the upper wall [m].

    Examples
    --------
    >>> mesh = PoreMesh(Packing.read("data/packings/n200_s1.csv"))
    >>> linear = PlanePressures.of(mesh, 100.0 - 20.0 * mesh.vertices[:, 2], 2)
    >>> linear.at([0.25, 0.5, 0.75]).round(9).tolist()
    [95.0, 90.0, 85.0]
    """

    lower: np.ndarray
    upper: np.ndarray
    begin: np.ndarray
    end: np.ndarray
    areas: np.ndarray
    pressures: np.ndarray
    walls: np.ndarray

    @classmethod
    def of(cls, mesh: PoreMesh, cell_pressure: ArrayLike, axis: int) -> PlanePressures:
        """The pressures of a mesh.

        Parameters
        ----------
        mesh : PoreMesh
        cell_pressure : (m,) array
            Piezometric pressure of each cell, which is that at its Laguerre vertex [Pa].
        axis : int
            0, 1 or 2.
        """
        facets, packing = mesh.facets, mesh.packing
        normals = facets.normals[:, axis]
        z, p = mesh.vertices[facets.cells, axis], np.asarray(cell_pressure, float)[facets.cells]
        # Distances of the Laguerre vertices from the plane of the facet, along its normal.
        on_plane = packing.centres[facets.vertices[:, 0]]
        first, second = (((mesh.vertices[facets.cells[:, k]] - on_plane) * facets.normals).sum(axis=1) for k in (0, 1))
        radii = np.append(packing.radii, np.zeros(6))[facets.vertices].max(axis=1)
        near = np.stack([np.maximum(-_REACH * radii - first, 0.0), np.minimum(_REACH * radii - second, 0.0)], axis=1)
        # A facet far from the line between its Laguerre vertices leaves the pressure as it is.
        near[near[:, 0] - near[:, 1] >= second - first] = 0.0
        linear = z + near * normals[:, None]
        down = z[:, 0] > z[:, 1]
        for ends in (z, p, linear):
            ends[down] = ends[down, ::-1]
        across = (z[:, 0] < z[:, 1]) & (linear[:, 0] < linear[:, 1])
        walls = mesh.box.wall_places[2 * axis : 2 * axis + 2]
        areas = np.abs(facets.areas * normals)[across]
        (lower, upper), (begin, end) = z[across].T, linear[across].T
        return cls(lower, upper, begin, end, areas, p[across], walls)

    def at(self, places: ArrayLike) -> np.ndarray:
        """(k,): mean pressure over the planes at these places along the axis, (k,), in the box [Pa]."""
        # On a wall lie the ends of segments, to rounding: a plane there is a little further in.
        inset = _INSET * (self.walls[1] - self.walls[0])
        planes = np.clip(np.atleast_1d(np.asarray(places, float)), self.walls[0] + inset, self.walls[1] - inset)
        found = np.empty(len(planes))
        for k, place in enumerate(planes):
            (crossed,) = np.nonzero((self.lower <= place) & (place < self.upper))
            found[k] = self._mean(crossed, np.clip(self._part(crossed, place), 0.0, 1.0), self.areas[crossed])
        return found

    def means(self, edges: ArrayLike) -> np.ndarray:
        """(l,): mean of `at` over the planes of each layer between increasing places, (l + 1,), in the box [Pa]."""
        found = []
        for begin, end in pairwise(np.clip(np.asarray(edges, float), *self.walls)):
            if not begin < end:  # beyond a wall
                found.append(self.at(begin)[0])
                continue
            (crossed,) = np.nonzero((self.lower < end) & (begin < self.upper))
            lower, upper = np.maximum(self.lower[crossed], begin), np.minimum(self.upper[crossed], end)
            t, u = self._part(crossed, lower), self._part(crossed, upper)
            parts = (_integral(u) - _integral(t)) / (u - t)
            found.append(self._mean(crossed, parts, self.areas[crossed] * (upper - lower)))
        return np.array(found)

    def _part(self, segments: np.ndarray, place: np.ndarray | float) -> np.ndarray:
        """Where a place is between the ends of the linear part of each segment: 0 and 1 at these."""
        begin, end = self.begin[segments], self.end[segments]
        return (place - begin) / (end - begin)

    def _mean(self, segments: np.ndarray, parts: np.ndarray, weights: np.ndarray) -> float:
        lower, upper = self.pressures[segments].T
        # Above the least pressure, so that a small drop on a large pressure keeps its digits.
        least = min(lower.min(), upper.min())
        return float(least + np.average((1.0 - parts) * (lower - least) + parts * (upper - least), weights=weights))


def _integral(t: np.ndarray) -> np.ndarray:
    """Of clip(t, 0, 1), from 0 on."""
    inside = np.clip(t, 0.0, 1.0)
    return 0.5 * inside**2 + np.maximum(t - 1.0, 0.0)
