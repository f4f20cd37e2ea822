"""Pore centres: where they differ from the Laguerre vertices, and by how much."""

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from porefv.conductance.section_friction.pore_centres import centres_of_pores
from porefv.mesh.pore_mesh import PoreMesh
from porefv.packing.packing import Packing


def test_centres_are_vertices_among_equal_spheres(reference):
    packing = reference("n25_s1")
    mesh = PoreMesh(Packing(packing.centres, np.full(25, packing.radii.min()), packing.box))
    assert_array_equal(centres_of_pores(mesh.throats), mesh.local_vertices)


@pytest.mark.parametrize("radius", [1e-12, 0.05, 0.1])
def test_a_speck_moves_the_centres_of_the_pores_around_it(reference, radius):
    # Between eight spheres of 0.25 on a lattice: six pores around it, cut in two, with their vertices in square necks.
    eight = reference("sc8")
    mesh = PoreMesh(Packing(np.vstack([eight.centres, [[0.5] * 3]]), np.append(eight.radii, radius), eight.box))
    around = (mesh.cells == 8).any(axis=1)
    assert around.sum() == 12
    place = mesh.local_points[8]
    vertices = mesh.local_vertices[around] - place
    heights = np.abs(vertices).max(axis=1)
    moves = np.where(heights > 0.25, 1.0, 0.0)  # the vertex of a speck with a surface lies beyond the neck
    wanted = 0.5 * (1.0 - radius / 0.25) * 0.25
    part = (wanted - (0.25 - heights)) / heights
    assert moves.all() or radius < 1e-6
    assert_allclose(centres_of_pores(mesh.throats)[around] - place, vertices * (1.0 - part)[:, None], atol=1e-12)
    assert_array_equal(centres_of_pores(mesh.throats)[~around], mesh.local_vertices[~around])


def test_centres_move_as_far_as_documented(reference):
    # Once more, pore by pore, for those of one cell.
    mesh = PoreMesh(reference("n54_s1"))
    centres, n = centres_of_pores(mesh.throats), mesh.n_spheres
    alone = np.bincount(mesh.cell_pore)[mesh.cell_pore] == 1
    moving = short = 0
    for c in np.flatnonzero(alone):
        vertex = mesh.local_vertices[c]
        parts, ways = [], np.zeros((0, 3))
        for f, side in zip(*np.nonzero(mesh.facets.cells == c), strict=True):
            (apex,) = set(mesh.cells[c]) - set(mesh.facets.vertices[f])
            spheres = [k for k in mesh.facets.vertices[f] if k < n]
            if apex >= n or mesh.sizes[apex] >= min(mesh.sizes[spheres]):
                continue
            inward = mesh.facets.normals[f] * (1 if side == 1 else -1)
            height, above = ((x - mesh.local_points[spheres[0]]) @ inward for x in (vertex, mesh.local_points[apex]))
            wanted = 0.5 * (1 - mesh.sizes[apex] / min(mesh.sizes[spheres])) * above
            if height < wanted:
                demand = min(1, mesh.facets.lengths[f] / (0.1 * min(mesh.sizes[spheres])))
                short += demand < 1
                parts.append(demand * min(1, above / mesh.sizes[apex]) * (wanted - height) / (above - height))
                ways = np.vstack([ways, parts[-1] * (mesh.local_points[apex] - vertex)])
        moved = np.average(ways, axis=0, weights=parts) if parts else np.zeros(3)
        moved[(mesh.cells[c][mesh.cells[c] >= n] - n) // 2] = (
            0.0  # on a wall, the image behind the wall cancels that part
        )
        assert_allclose(centres[c], vertex + moved, atol=1e-14)
        moving += len(parts) > 0
    assert moving > 20 and short > 2
