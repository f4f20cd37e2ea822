"""Free surfaces, and where the end correction acts."""

import numpy as np
import pytest

from porefv import Box, Fluid, Packing, PoreFlow, PoreMesh, Wall, Walls
from porefv.coupling import Coupling
from porefv.coupling.end_correction import reached_walls
from porefv.coupling.free_surface import clear_layers
from porefv.dem.dem import DEM
from porefv.dem.material import Material
from porefv.dem.random_placement import cloud
from porefv.dem.sizes import UniformSizes
from porefv.errors import InputError

UP = np.array([False] * 5 + [True])


@pytest.fixture
def bed(reference):
    """bed(height): 200 grains at the bottom of a unit box that is so many times as high."""

    def make(height):
        packing = reference("n200_s1")
        return Packing(packing.centres, packing.radii, Box([0, 0, 0], [1, 1, height]))

    return make


def test_the_clear_layer_is_all_fluid_above_the_grains(bed):
    packing = bed(2.0)
    mesh = PoreMesh(packing)
    layers = clear_layers(mesh, UP)
    top, diameter = packing.centres[:, 2].max(), 2.0 * packing.radii.mean()
    heights = np.full(mesh.n_pores, np.inf)
    np.minimum.at(heights, mesh.cell_pore, mesh.vertices[:, 2])
    assert set(np.unique(layers)) == {-1, 5}
    assert (layers[heights > top + diameter] == 5).all()
    assert (layers[heights < packing.centres[:, 2].mean()] == -1).all()


@pytest.fixture
def dilute():
    """dilute(c, height): 60 grains at random in a cube, whose box is so many times as high."""

    def make(c, height):
        packing = cloud(60, UniformSizes(1.0), Box([0, 0, 0], [1, 1, 1]), 1.0 - c, 1)
        return Packing(packing.centres, packing.radii, Box([0, 0, 0], [1, 1, height]))

    return make


@pytest.mark.parametrize("c", [0.01, 0.05, 0.1])
def test_there_is_no_clear_fluid_between_the_grains_of_a_dilute_cloud(dilute, c):
    packing = dilute(c, 1.6)
    mesh = PoreMesh(packing)
    heights = np.full(mesh.n_pores, np.inf)
    np.minimum.at(heights, mesh.cell_pore, mesh.vertices[:, 2])
    clear = clear_layers(mesh, UP) == 5
    spacing = len(packing) ** (-1.0 / 3.0)
    assert clear.any() and heights[clear].min() > packing.centres[:, 2].max() - spacing
    assert clear[heights > packing.centres[:, 2].max() + 2.0 * packing.radii[0]].all()


@pytest.mark.parametrize("c", [0.01, 0.05, 0.1])
@pytest.mark.parametrize("height", [1.0, 1.6])
def test_a_dilute_cloud_settles_under_a_free_surface_as_in_a_closed_box(dilute, c, height):
    speeds = []
    for lid in ({"slip": True}, {"pressure": 0.0, "free": True}):
        packing = dilute(c, height)
        dem = DEM(packing, Material(young=1e5, density=2600.0), gravity=(0.0, 0.0, -9.81))
        walls = Walls.from_mapping({"z_max": lid, "lateral": {"slip": True}})
        viscosity = 1e6 * packing.radii[0] ** 2  # terminal within the steps
        Coupling(dem, walls, Fluid(viscosity), pair_resistance=True, end_correction=False).run(20)
        speeds.append(-dem.velocities[:, 2].mean())
    assert speeds[1] == pytest.approx(speeds[0], rel=0.2)


def test_no_wall_is_a_free_surface_by_itself(bed):
    assert (clear_layers(PoreMesh(bed(2.0)), np.zeros(6, bool)) == -1).all()


def test_the_sample_reaches_walls_that_it_touches(bed):
    assert reached_walls(bed(1.0)).all()
    assert not reached_walls(bed(2.0))[5]


def sinking(packing, free):
    """Grains at rest with an upward flow, from a pressure below, to clear fluid above."""
    dem = DEM(packing, Material(density=2600.0))
    lid = Wall(pressure=7.0, free=free)
    slip = dict.fromkeys(("x_min", "x_max", "y_min", "y_max"), Wall(slip=True))
    walls = Walls(z_min=Wall(pressure=10.0), z_max=lid, **slip)
    return Coupling(dem, walls, Fluid(viscosity=1.0), scheme="implicit-drag")


def test_clear_fluid_has_the_pressure_of_its_free_surface(bed):
    coupling = sinking(bed(3.0), free=True)
    coupling.run(3)
    mesh = coupling.mesh
    clear = clear_layers(mesh, UP) == 5
    assert (coupling.pressure[clear] == 7.0).all()
    assert coupling.wall_flux["z_max"] == pytest.approx(-coupling.wall_flux["z_min"], rel=1e-9)


@pytest.mark.parametrize("free", [False, True])
def test_the_end_correction_leaves_out_a_lid_that_grains_have_sunk_from(bed, free):
    depths = sinking(bed(2.0), free).end_depths
    assert depths[5] == 0.0


def test_the_end_correction_acts_at_plates_and_says_how_deep(reference):
    packing = reference("n200_s1")
    walls = Walls.from_mapping({"z_min": {"pressure": 0.0}, "z_max": {"pressure": 0.0}, "lateral": {"slip": True}})
    depths = Coupling(DEM(packing), walls, Fluid(viscosity=1.0)).end_depths
    assert (depths[4:] > 0.0).all() and (depths[:4] == 0.0).all()


def test_a_free_surface_needs_a_pressure_and_grains_that_move(reference):
    with pytest.raises(InputError, match="free surface needs a pressure"):
        Wall(free=True)
    with pytest.raises(InputError, match="z_max is a free surface, which is for grains that move"):
        PoreFlow(reference("n25_s1"), Walls(z_max=Wall(pressure=0.0, free=True), z_min=Wall(pressure=1.0)))


def test_what_flows_in_flows_out_at_the_default_tolerance(bed):
    # Drag and weight dwarf the conductances of clear fluid: pressures that are right by their power alone let the two
    # differ by as much as they are.
    packing = bed(2.0)
    dem = DEM(packing, Material(density=2600.0), gravity=(0.0, 0.0, -9.81))
    walls = Walls.from_mapping({"z_min": {"pressure": 10.0}, "z_max": {"pressure": 0.0}, "lateral": {"slip": True}})
    coupling = Coupling(dem, walls, Fluid(viscosity=10.0), scheme="implicit-drag")
    for _ in range(3):
        coupling.run(10)
        fluxes = coupling.wall_flux
        assert abs(sum(fluxes.values())) <= 1e-9 * abs(fluxes["z_max"])
        assert coupling.mass_imbalance < 0.101
