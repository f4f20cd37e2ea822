"""Routes through the void, and whether straight lines meet spheres."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from porefv import Box, Packing, PoreMesh
from porefv.mesh.void_routes import SpheresOnLines, routes_to_necks, routes_to_walls


def depth(packing, begin, end):
    """(k,): largest depth of each line in a sphere, over its radius, by brute force."""
    along = end - begin
    towards = packing.centres[None] - begin[:, None]
    place = np.clip((towards * along[:, None]).sum(axis=2) / np.maximum((along**2).sum(axis=1), 1e-300)[:, None], 0, 1)
    nearest = np.linalg.norm(towards - place[:, :, None] * along[:, None], axis=2)
    return (1.0 - nearest / packing.radii).max(axis=1)


@given(st.integers(0, 10_000))
def test_lines_meet_the_spheres_that_a_search_through_all_finds(random_packing, seed):
    packing = random_packing(60, ratio=0.05, seed=seed)
    random = np.random.default_rng(seed)
    box = packing.box
    ends = box.lower + box.size * random.random((2, 200, 3))
    ends[1, :100] = ends[0, :100] + 0.1 * (ends[1, :100] - ends[0, :100])
    found = SpheresOnLines(packing).cut(*ends)
    depths = depth(packing, *ends)
    clear = np.abs(depths) > 1e-9
    assert (found == (depths > 0.0))[clear].all()


def test_a_line_that_touches_a_sphere_does_not_cut_it():
    packing = Packing([[0.5, 0.5, 0.5]], [0.25], Box([0, 0, 0], [1, 1, 1]))
    begin = np.array([[0.0, 0.5, 0.75], [0.0, 0.5, 0.7499]])
    end = begin + np.array([1.0, 0.0, 0.0])
    assert SpheresOnLines(packing).cut(begin, end).tolist() == [False, True]
    assert SpheresOnLines(packing).cut(np.full((1, 3), np.nan), end[:1]).all()


@given(st.integers(0, 10_000))
def test_routes_say_truly_whether_they_cut(random_packing, seed):
    mesh = PoreMesh(random_packing(20, ratio=0.1, seed=seed))
    throats = np.flatnonzero(~mesh.throats.closed)
    for routes in (
        *routes_to_necks(mesh, throats, np.zeros(6, bool)),
        routes_to_walls(mesh, np.arange(len(mesh.wall_faces.cells))),
    ):
        points = routes.points
        depths = np.maximum(*(depth(mesh.packing, points[:, k], points[:, k + 1]) for k in (0, 1)))
        clear = np.abs(depths) > 1e-9
        assert (routes.cut == (depths > 0.0))[clear].all()


def test_both_routes_of_a_throat_begin_at_its_neck(mesh_of):
    mesh = mesh_of("n200_s1")
    first, second = routes_to_necks(mesh, np.arange(len(mesh.throats)), np.zeros(6, bool))
    assert (first.points[:, 0] == second.points[:, 0]).all()
    assert (first.points[:, 2] == mesh.inscribed_spheres.centres[mesh.throats.pores[:, 0]]).all()
