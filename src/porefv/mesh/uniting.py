"""Which cells share a Laguerre vertex, exactly or nearly, and are united to one pore."""

from __future__ import annotations

import numpy as np

from porefv.system.growing_arrays import doubled
from porefv.system.kernels import kernel
from porefv.system.union_find import join


@kernel
def unite(facets, laguerre_vertices, vertices, tolerance):
    """(m,): label of each cell, equal across facets whose Laguerre vertices nearly coincide.

    They are no further apart than `tolerance` times the smallest radius of the facet's spheres.

    Labels follow the order of the cells.

    Parameters
    ----------
    facets : FacetTopology
    laguerre_vertices : (m, 3) float64 array
        Laguerre vertex of each cell, from the local origin [m].
    vertices : Vertices
    tolerance : float
        Relative to the smallest radius of the facet's spheres.
    """
    parent = np.arange(laguerre_vertices.shape[0], dtype=np.int32)
    for f in range(facets.cells.shape[0]):
        i = facets.cells[f, 0]
        j = facets.cells[f, 1]
        square = 0.0
        for axis in range(3):
            square += (laguerre_vertices[i, axis] - laguerre_vertices[j, axis]) ** 2
        radius = np.inf
        for v in range(3):
            k = facets.vertices[f, v]
            if k < vertices.n_spheres:
                radius = min(radius, vertices.sizes[k])
        if square <= (tolerance * radius) ** 2:
            join(parent, i, j)
    count = 0
    for t in range(parent.shape[0]):  # a root comes before all below it
        if parent[t] == t:
            parent[t] = count
            count += 1
        else:
            parent[t] = parent[parent[t]]
    return parent


@kernel
def tied_facets(facet_cells, cell_node, cell_pore):
    """Facets between two pores both of whose Laguerre vertices are shared by several cells."""
    most = -1
    for t in range(cell_node.shape[0]):
        most = max(most, cell_node[t])
    cells = np.zeros(most + 1, np.int32)
    for t in range(cell_node.shape[0]):
        cells[cell_node[t]] += 1
    found = np.empty(64, np.int64)
    count = 0
    for f in range(facet_cells.shape[0]):
        i = facet_cells[f, 0]
        j = facet_cells[f, 1]
        if cells[cell_node[i]] > 1 and cells[cell_node[j]] > 1 and cell_pore[i] != cell_pore[j]:
            if count == found.shape[0]:
                found = doubled(found)
            found[count] = f
            count += 1
    return found[:count].copy()
