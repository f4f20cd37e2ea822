"""Conductance models against closed forms, hand values and the paper's table."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from porefv.conductance.effective_radius import EffectiveRadius
from porefv.conductance.hydraulic_radius import HydraulicRadius
from porefv.conductance.model import ConductanceModel
from porefv.conductance.registry import conductance_model
from porefv.errors import InputError
from porefv.flow.walls import Walls
from porefv.mesh.pore_mesh import PoreMesh
from porefv.packing.box import Box
from porefv.packing.packing import Packing

NO_SLIP = np.zeros(6, bool)
SYMMETRY = np.ones(6, bool)
UNIT = Box([0, 0, 0], [1, 1, 1])


@pytest.fixture
def paper_flow(unit_flow):
    """paper_flow(mesh, walls, model=None): `unit_flow` with the paper's model unless told."""
    return lambda mesh, walls, model=None: unit_flow(mesh, walls, HydraulicRadius() if model is None else model)


def simple_cubic(spacing, radius):
    """k of the periodic simple cubic lattice with a linear pressure, design §3.6."""
    fluid_area = spacing**2 - np.pi * radius**2
    hydraulic_radius = (spacing**3 - 4 / 3 * np.pi * radius**3) / (4 * np.pi * radius**2)
    return fluid_area * hydraulic_radius**2 / (2 * spacing**2)


# ---- simple cubic lattices ----------


# Touching, and the loose states of design §3.6; radii as fractions of the touching one.
@pytest.mark.parametrize("concentration", [np.pi / 6, 0.45, 0.343, 0.216, 0.125, 0.064, 1e-3])
@pytest.mark.parametrize("m", [2, 3, 6])
def test_simple_cubic_lattice_has_the_closed_form(lattice, paper_flow, concentration, m):
    radius = np.cbrt(concentration / (np.pi / 6))
    packing = lattice("sc", m, radius, spacing=0.7)
    flow = paper_flow(PoreMesh(packing), Walls.along("y", slip=True))
    # All throats are equal and the pressure is linear: nothing but rounding is left. The issue asks for 1e-10.
    assert_allclose(flow.permeability, simple_cubic(0.7, packing.radii[0]), rtol=1e-12)


def test_simple_cubic_lattice_of_8000_spheres_has_the_closed_form(lattice, paper_flow):
    packing = lattice("sc", 20, spacing=0.05)
    flow = paper_flow(PoreMesh(packing), Walls.along("y", slip=True))
    assert flow.mesh.n_pores == 21**3
    assert flow.solver_report.name == "cg"
    assert_allclose(flow.permeability, simple_cubic(0.05, 0.025), rtol=1e-10)


@pytest.mark.parametrize("axis", "xyz")
def test_simple_cubic_lattice_is_isotropic(lattice, paper_flow, axis):
    mesh = PoreMesh(lattice("sc", 3, 0.8))
    flow = paper_flow(mesh, Walls.along(axis, slip=True))
    assert_allclose(flow.permeability, simple_cubic(1.0, 0.4), rtol=1e-12)


def test_touching_simple_cubic_lattice_agrees_with_the_known_drag():
    # Zick and Homsy (1982): K = 42.1 at closest packing, k = 2 a² / (9 c K); the scheme gives 0.979 of it.
    exact = 2 * 0.5**2 / (9 * np.pi / 6 * 42.1)
    assert_allclose(simple_cubic(1.0, 0.5) / exact, 0.979, rtol=0, atol=5e-4)


# ---- hydraulic radius ----------


def test_hydraulic_radius_of_one_sphere_between_no_slip_walls(paper_flow):
    # A sphere in a cube of side 1: four throats along the flow, each with a twelfth of the void and of the sphere,
    # and a twelfth of the surface of the box.
    r = 0.3
    mesh = PoreMesh(Packing([[0.5, 0.5, 0.5]], [r], UNIT))
    radius = (1 - 4 / 3 * np.pi * r**3) / (4 * np.pi * r**2 + 6)
    # Pressure walls drag too, unless they slip: `Walls.along` makes them impermeable to neither.
    flow = paper_flow(mesh, Walls.along("y"))
    assert_allclose(flow.permeability, (1 - np.pi * r**2) * radius**2 / 2, rtol=1e-13)
    flow = paper_flow(mesh, Walls.along("y", slip=True))
    assert_allclose(flow.permeability, simple_cubic(1.0, r), rtol=1e-13)


@pytest.mark.parametrize("alpha", [0.562, 1.2])
def test_permeability_is_proportional_to_alpha(mesh_of, paper_flow, alpha):
    mesh, walls = mesh_of("n54_s1"), Walls.along("y")
    k = paper_flow(mesh, walls).permeability
    assert paper_flow(mesh, walls, HydraulicRadius(0.5)).permeability == k
    assert_allclose(paper_flow(mesh, walls, HydraulicRadius(alpha)).permeability, 2 * alpha * k, rtol=1e-12)


@pytest.mark.parametrize("alpha", [0.0, -0.5, np.inf, np.nan, "half", None])
def test_alpha_that_is_not_a_positive_number_is_refused(alpha):
    with pytest.raises(InputError, match="alpha"):
        HydraulicRadius(alpha)


def test_symmetry_walls_let_more_through(mesh_of, paper_flow):
    for name in ("sc8", "nine_0.72", "n25_s1", "n54_s1", "n200_s1"):
        for model in (HydraulicRadius(), EffectiveRadius()):
            drag, free = (
                paper_flow(mesh_of(name), Walls.along("y", slip=slip), model).permeability for slip in (False, True)
            )
            assert free > drag > 0.0


# ---- effective radius ----------


def conductivity(mesh, slip, *vertices):
    """μ g by the effective radius of the facet of these vertices."""
    facet = np.flatnonzero((np.sort(mesh.facets.vertices, axis=1) == sorted(vertices)).all(axis=1))
    return EffectiveRadius().conductivity(mesh.throats, slip)[mesh.throats.facet_throat[facet[0]]]


def test_effective_radius_between_three_touching_equal_spheres():
    r = 0.1
    corners = np.array([[0.3, 0.3, 0.5], [0.5, 0.3, 0.5], [0.4, 0.3 + 0.1 * np.sqrt(3), 0.5]])
    mesh = PoreMesh(Packing(corners, [r] * 3, UNIT))
    equivalent = np.sqrt((np.sqrt(3) - np.pi / 2) / np.pi) * r
    inscribed = (2 / np.sqrt(3) - 1) * r
    expected = 2 * np.pi * ((equivalent + inscribed) / 4) ** 4
    assert_allclose(conductivity(mesh, NO_SLIP, 0, 1, 2), expected, rtol=1e-11)


@pytest.mark.parametrize(("a", "b"), [(0.2, 0.2), (0.2, 0.35)], ids=["square", "rectangle"])
def test_effective_radius_between_a_sphere_and_two_walls(a, b):
    r = 0.15
    mesh = PoreMesh(Packing([[a, 0.5, b]], [r], UNIT))
    facet = (0, 1 + 0, 1 + 4)
    area = a * b - np.pi * r**2 / 4
    # No-slip: the circle touches both walls and the sphere, (a - ρ)² + (b - ρ)² = (r + ρ)².
    half = a + b + r
    inscribed = half - np.sqrt(half**2 - (a**2 + b**2 - r**2))
    expected = 2 * np.pi * ((np.sqrt(area / np.pi) + inscribed) / 4) ** 4
    assert_allclose(conductivity(mesh, NO_SLIP, *facet), expected, rtol=1e-12)
    # Symmetry: a quarter of the throat between four spheres, whose circle stands on the edge of the box.
    inscribed = np.hypot(a, b) - r
    expected = 2 * np.pi * ((np.sqrt(4 * area / np.pi) + inscribed) / 4) ** 4 / 4
    assert_allclose(conductivity(mesh, SYMMETRY, *facet), expected, rtol=1e-12)


def test_effective_radius_between_two_spheres_and_a_wall_of_symmetry_is_half_of_that_between_four():
    r, h, side = 0.1, 0.15, 0.3
    mesh = PoreMesh(Packing([[0.5, 0.4, h], [0.5 + side, 0.4, h]], [r] * 2, Box([0, 0, 0], [1.3, 1, 1])))
    area = h * side - np.pi * r**2 / 2
    inscribed = np.hypot(h, side / 2) - r
    expected = 2 * np.pi * ((np.sqrt(2 * area / np.pi) + inscribed) / 4) ** 4 / 2
    assert_allclose(conductivity(mesh, SYMMETRY, 0, 1, 2 + 4), expected, rtol=1e-12)


@pytest.mark.parametrize("radius", [1.0, 0.7])
def test_effective_radius_of_the_simple_cubic_lattice_has_its_closed_form(lattice, paper_flow, radius):
    # The throat between four spheres: the circle in the middle of the square.
    r = radius / 2
    flow = paper_flow(PoreMesh(lattice("sc", 4, radius)), Walls.along("y", slip=True), EffectiveRadius())
    effective = (np.sqrt((1 - np.pi * r**2) / np.pi) + np.sqrt(0.5) - r) / 4
    assert_allclose(flow.permeability, 2 * np.pi * effective**4, rtol=1e-12)


# ---- models of one's own ----------


class Slits(ConductanceModel):
    """Parallel plates: α = 1/3 (the example of `porefv.conductance.model`)."""

    name = "slits"

    def conductivity(self, throats, slip):
        return throats.fluid_areas * (throats.volumes / throats.wetted_surfaces(slip)) ** 2 / 3


def test_a_third_model_takes_ten_lines(mesh_of, paper_flow):
    mesh, walls = mesh_of("n54_s1"), Walls.along("y")
    flow = paper_flow(mesh, walls, Slits())
    assert_allclose(flow.permeability, 2 / 3 * paper_flow(mesh, walls).permeability, rtol=1e-12)
    assert "slits" in repr(flow)
    assert flow.forces.conservation_residual < 1e-12


def test_models_are_known_by_name():
    assert conductance_model("hydraulic-radius") == HydraulicRadius()
    assert conductance_model("hydraulic-radius", alpha=0.6) == HydraulicRadius(0.6)
    assert conductance_model("effective-radius") == EffectiveRadius()
    with pytest.raises(InputError, match="unknown conductance 'poiseuille'.*hydraulic-radius"):
        conductance_model("poiseuille")
    with pytest.raises(InputError, match="no parameter alpha"):
        conductance_model("effective-radius", alpha=1.0)


# ---- the paper ----------


def test_forces_on_nine_spheres_are_those_of_the_papers_table_2(mesh_of, paper_flow, values):
    forces = paper_flow(mesh_of("nine_0.72"), Walls.along("y")).forces
    fem = values("c12_table2")["fem"]
    total = forces.total[:, 1]
    # 2 % is what issue and paper claim for totals; pressure and viscous parts err by up to 25 % in opposite senses.
    assert_allclose(total[:8], fem["big"]["total"], rtol=0.02)
    assert_allclose(total[8], fem["small"]["total"], rtol=0.02)
    assert_allclose(forces.wall_viscous[0, 1], fem["wall"]["viscous"], rtol=0.05)
    # With pressures 1 and 0 at the ends, the wall x = 0 carries half of S ΔP, outwards.
    assert_allclose(-forces.wall_pressure[0, 0], fem["wall"]["pressure_x"], rtol=0.01)


def test_forces_on_nine_spheres_are_near_our_own_finite_elements(mesh_of, paper_flow, values):
    fem = values("fem_nine_spheres")["nine_spheres"]
    for slip, kind in ((False, "no_slip"), (True, "symmetry")):
        total = paper_flow(mesh_of("nine_0.72"), Walls.along("y", slip=slip)).forces.total[:, 1]
        assert_allclose(total[:8], fem[kind]["0.72"]["big_total"][0], rtol=0.02)
        assert_allclose(total[8], fem[kind]["0.72"]["centre_total"][0], rtol=0.02)


def test_permeability_of_nine_spheres_between_symmetry_walls_is_that_of_finite_elements(mesh_of, paper_flow, values):
    fem = values("fem_nine_spheres")["nine_spheres"]["symmetry"]
    for ratio in ("0.0", "0.2", "0.4", "0.5", "0.72"):
        name = "sc8" if ratio == "0.0" else f"nine_{ratio}"
        k = paper_flow(mesh_of(name), Walls.along("y", slip=True)).permeability
        # The scheme's own error: -2 % to +3.4 %, greatest around the smallest sphere.
        assert_allclose(k, fem[ratio]["K"][0], rtol=0.035)
