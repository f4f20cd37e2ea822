"""Porosity by layer: exact segments, lenses and caps, and their sum."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.testing import assert_allclose
from scipy.integrate import quad

from porefv.errors import InputError
from porefv.packing.box import Box
from porefv.packing.layers import layer_edges, layer_porosities
from porefv.packing.packing import Packing

UNIT = Box([0, 0, 0], [1, 1, 1])


def union_area(discs):
    """Area of the union of two discs (x, y, radius)."""
    (xa, ya, a), (xb, yb, b) = discs
    distance = np.hypot(xb - xa, yb - ya)
    if distance >= a + b or min(a, b) <= 0.0:
        return np.pi * (max(a, 0.0) ** 2 + max(b, 0.0) ** 2)
    if distance <= abs(a - b):
        return np.pi * max(a, b) ** 2
    at_a = np.arccos((distance**2 + a**2 - b**2) / (2 * distance * a))
    at_b = np.arccos((distance**2 + b**2 - a**2) / (2 * distance * b))
    shared = a**2 * (at_a - np.sin(2 * at_a) / 2) + b**2 * (at_b - np.sin(2 * at_b) / 2)
    return np.pi * (a**2 + b**2) - shared


def disc(centre, radius, axis, place):
    x, y = np.delete(centre, axis)
    return x, y, np.sqrt(max(radius**2 - (place - centre[axis]) ** 2, 0.0))


@given(st.integers(0, 10_000), st.integers(1, 20), st.integers(0, 2))
def test_porosities_weighted_with_the_layers_add_up_to_that_of_the_packing(random_packing, seed, layers, axis):
    packing = random_packing(20, ratio=0.2, seed=seed, box=Box([-1, 2, 0], [1, 2.5, 3]))
    edges = layer_edges(packing.box, axis, layers)
    porosities = layer_porosities(packing, axis, edges)
    assert_allclose(np.average(porosities, weights=np.diff(edges)), packing.porosity, rtol=0, atol=1e-13)
    assert ((porosities >= -1e-13) & (porosities <= 1.0 + 1e-13)).all()


@pytest.mark.parametrize("name", ["n54_s1", "n200_s1", "nine_0.72", "sc8"])
@pytest.mark.parametrize("axis", range(3))
def test_they_add_up_with_overlaps_and_spheres_across_walls(reference, name, axis):
    packing = reference(name)
    edges = np.array([0.0, 0.013, 0.3, 0.31, 0.92, 1.0]) * packing.box.size[axis] + packing.box.lower[axis]
    porosities = layer_porosities(packing, axis, edges)
    assert_allclose(np.average(porosities, weights=np.diff(edges)), packing.porosity, rtol=0, atol=1e-13)


@settings(max_examples=40)
@given(st.integers(0, 10_000), st.floats(0.0, 1.0), st.floats(0.02, 0.99))
def test_the_union_of_two_spheres_is_cut_exactly(seed, tilt, lower):
    # Two spheres that overlap, at any angle to the planes, against an integral of the area of their sections.
    rng = np.random.default_rng(seed)
    radii = rng.uniform(0.08, 0.2, 2)
    direction = rng.normal(size=3) * [1.0, tilt, 1.0]
    direction /= np.linalg.norm(direction)
    step = direction * rng.uniform(radii.max() * 1.01, radii.sum())
    packing = Packing([0.5 - step / 2, 0.5 + step / 2], radii, UNIT)
    upper = lower + 0.5 * (1.0 - lower)
    # The section has kinks at the ends of the spheres, and of the circle in which they meet.
    distance = np.linalg.norm(step)
    to_plane = (distance**2 + radii[0] ** 2 - radii[1] ** 2) / (2 * distance)
    extent = np.sqrt((radii[0] ** 2 - to_plane**2) * (1 - direction[1] ** 2))
    middles, extents = [*packing.centres[:, 1], packing.centres[0, 1] + to_plane * direction[1]], [*radii, extent]
    breaks = np.concatenate([np.subtract(middles, extents), np.add(middles, extents)])
    within = breaks[(breaks > lower) & (breaks < upper)]

    def section(y):
        return union_area([disc(c, r, 1, y) for c, r in zip(packing.centres, radii, strict=True)])

    solid = quad(section, lower, upper, points=within if len(within) else None, epsabs=1e-11, limit=400)[0]
    found = layer_porosities(packing, 1, [0.0, lower, upper, 1.0])[1]
    assert_allclose((1.0 - found) * (upper - lower), solid, rtol=0, atol=1e-9)


@pytest.mark.parametrize("axis", range(3))
def test_a_cap_beyond_a_wall_does_not_count_in_any_layer(axis):
    centre = np.full(3, 0.5)
    centre[(axis + 1) % 3] = 0.1
    packing = Packing([centre], [0.12], UNIT)

    def section(z):  # the part of a disc within the wall
        rho = np.sqrt(max(0.12**2 - (z - 0.5) ** 2, 0.0))
        half = np.arccos(min(0.1 / rho, 1.0)) if rho > 0.0 else 0.0
        return np.pi * rho**2 - rho**2 * (half - np.sin(2 * half) / 2)

    edges = [0.0, 0.45, 0.53, 1.0]
    solid = [quad(section, a, b, points=[0.38, 0.62], epsabs=1e-12)[0] for a, b in ((0, 0.45), (0.45, 0.53), (0.53, 1))]
    found = layer_porosities(packing, axis, edges)
    assert_allclose((1.0 - found) * np.diff(edges), solid, rtol=0, atol=1e-9)


def test_a_packing_and_its_mirror_image_have_mirrored_porosities(reference):
    packing = reference("n200_s1")
    mirrored = Packing(packing.centres * [1, -1, 1] + [0, 1, 0], packing.radii, packing.box)
    edges = layer_edges(packing.box, 1, 7)
    found = layer_porosities(mirrored, 1, edges)
    assert_allclose(found[::-1], layer_porosities(packing, 1, edges), rtol=0, atol=1e-12)


@pytest.mark.parametrize("edges", [[0.0, 0.5], [0.0, 0.6, 0.5, 1.0], [1.0], [-0.1, 1.0]])
def test_edges_must_increase_from_wall_to_wall(reference, edges):
    with pytest.raises(InputError, match="edges of layers must"):
        layer_porosities(reference("n25_s1"), 0, edges)


@pytest.mark.parametrize("layers", [0, -1, 2.5, float("nan"), "3"])
def test_a_number_of_layers_is_whole_and_positive(layers):
    with pytest.raises(InputError, match="layers must be a whole number, 1 or more"):
        layer_edges(UNIT, 0, layers)


def test_layers_need_a_box():
    with pytest.raises(InputError, match="no box"):
        layer_porosities(Packing([[0, 0, 0]], [1]), 0, [0, 1])
