"""Which cells share a Laguerre vertex, exactly or nearly, and are united to one pore."""

from __future__ import annotations

import numpy as np

from porefv.system.growing_arrays import doubled
from porefv.system.kernels import helper, kernel
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
    _label(parent)
    return parent


@kernel
def join_with_steps(cells, neighbours, jumps, parent, steps):
    """Join cells to their neighbours some steps away, label them, and fill in the steps to beside the first of each.

    Parameters
    ----------
    cells, neighbours : (k,) int arrays
    jumps : (k, 3) int array
        Steps to the image of the neighbour that is joined.
    parent : (m,) int32 array
        The number of each cell; to be changed to labels, in the order of the cells.
    steps : (m, 3) int array
        Zero.

    Returns
    -------
    int
        A cell that is joined to an image of itself, -1 if there is none.
    """
    for link in range(cells.shape[0]):
        i, x, y, z = _root(cells[link], parent, steps)
        j, u, v, w = _root(neighbours[link], parent, steps)
        # A cell's image, `steps` away from it, is beside its root.
        u, v, w = x + jumps[link, 0] - u, y + jumps[link, 1] - v, z + jumps[link, 2] - w
        if i == j:
            if u != 0 or v != 0 or w != 0:
                return cells[link]
        elif i < j:
            parent[j] = i
            steps[j, 0], steps[j, 1], steps[j, 2] = u, v, w
        else:
            parent[i] = j
            steps[i, 0], steps[i, 1], steps[i, 2] = -u, -v, -w
    for t in range(parent.shape[0]):
        root, x, y, z = _root(t, parent, steps)
        if root != t:
            parent[t] = root
            steps[t, 0], steps[t, 1], steps[t, 2] = x, y, z
    _label(parent)
    return -1


@helper
def _label(parent):
    """Parents to labels, in the order of the roots."""
    count = 0
    for t in range(parent.shape[0]):  # a root comes before all below it
        if parent[t] == t:
            parent[t] = count
            count += 1
        else:
            parent[t] = parent[parent[t]]


@helper
def _root(i, parent, steps):
    """Root of i, and the steps from i to its image beside that."""
    x = y = z = 0
    while parent[i] != i:
        up = parent[i]
        if parent[up] != up:  # halve the path
            steps[i, 0] += steps[up, 0]
            steps[i, 1] += steps[up, 1]
            steps[i, 2] += steps[up, 2]
            parent[i] = parent[up]
        x += steps[i, 0]
        y += steps[i, 1]
        z += steps[i, 2]
        i = parent[i]
    return i, x, y, z


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
