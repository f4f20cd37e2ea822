"""Reynolds and Stokes numbers, and the relative motion that a mesh bears."""

import numpy as np
import pytest

from porefv import Fluid, Packing, PoreFlow, PoreMesh, Walls
from porefv.coupling.relative_motion import RelativeMotion
from porefv.coupling.validity import Validity, validity
from porefv.packing.box import Box


class Moved:
    """Grains of a packing and its walls, moved."""

    def __init__(self, packing, grains=0.0, walls=0.0):
        self.positions = packing.centres + grains
        lower, upper = packing.box.lower, packing.box.upper
        self.box = Box(lower + np.minimum(walls, 0.0), upper + np.maximum(walls, 0.0))


def test_numbers_are_those_of_the_fastest_throat_and_grain(reference):
    packing = reference("n54_s1")
    flow = PoreFlow(packing, Walls.along("z", slip=True), Fluid(viscosity=1e-3))
    mesh, fluid, slip = flow.mesh, Fluid(viscosity=0.1, density=500.0), np.ones(6, bool)
    moving = np.zeros((54, 3))
    moving[7] = [0.0, 3.0, 4.0]
    found = validity(mesh, flow.flux, moving, fluid, slip)
    areas = mesh.throats.fluid_areas
    fastest = np.abs(flow.flux[areas > 0.0] / areas[areas > 0.0]).max()
    diameter = 2.0 * packing.radii.mean()
    assert found.reynolds_max == pytest.approx(500.0 * fastest * diameter / 0.1, rel=1e-12)
    assert 0.0 < found.reynolds_mean < found.reynolds_max
    circles = mesh.throats.inscribed_circles(slip)[0]
    width = circles[circles > 0.0].mean()
    assert found.stokes_number == pytest.approx(0.5 * diameter / 5.0 * 0.1 / (500.0 * width**2), rel=1e-12)


def test_grains_and_fluid_at_rest_have_no_inertia(reference):
    mesh = PoreMesh(reference("n25_s1"))
    found = validity(mesh, np.zeros(len(mesh.throats)), np.zeros((25, 3)), Fluid(), np.ones(6, bool))
    assert found == Validity(0.0, 0.0, np.inf)
    assert found.warning is None


def test_the_warning_names_the_number():
    assert Validity(0.9, 0.5, 2.0).warning is None
    assert "Reynolds number is 1.5 (mean 0.5), above 1" in Validity(1.5, 0.5, 2.0).warning
    assert "Stokes number is 0.5, below 1" in Validity(0.5, 0.5, 0.5).warning


def test_common_motion_costs_no_mesh(reference):
    packing = reference("n54_s1")
    motion = RelativeMotion(PoreMesh(packing))
    drift = np.array([0.3, -0.2, 0.1])
    both = Moved(packing, drift)
    both.box = Box(packing.box.lower + drift, packing.box.upper + drift)
    assert motion(both) < 1e-12
    assert motion(Moved(packing)) == 0.0


def test_neighbours_that_part_and_walls_that_move_count(reference):
    packing = reference("n54_s1")
    motion = RelativeMotion(PoreMesh(packing))
    radius = packing.radii.mean()
    one = np.zeros((54, 3))
    one[10, 0] = 0.5 * radius
    # One grain in 54 is more than a hundredth of the edges.
    assert motion(Moved(packing, one)) == pytest.approx(0.5, rel=1e-9)
    wall = Moved(packing, 0.0, np.array([0.0, 0.0, 0.1 * radius]))
    assert motion(wall) == pytest.approx(0.1, rel=1e-9)


def test_one_fast_neighbour_counts_a_fifth(reference):
    packing = reference("n2000_s1")
    one = np.zeros((2000, 3))
    one[10, 0] = packing.radii.mean()
    assert RelativeMotion(PoreMesh(packing))(Moved(packing, one)) == pytest.approx(0.2, rel=1e-9)


def test_packings_without_neighbours_do_not_move():
    packing = Packing([[0.5, 0.5, 0.5]], [0.2], Box([0, 0, 0], [1, 1, 1]))
    assert RelativeMotion(PoreMesh(packing))(Moved(packing)) == 0.0
