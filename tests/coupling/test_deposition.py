"""Immersed deposition of 200 grains (C14 §4): what must hold at every step, from the cloud on."""

import numpy as np
import pytest

from porefv import Box, Fluid, Walls
from porefv.coupling import Coupling
from porefv.dem.dem import DEM
from porefv.dem.material import Material
from porefv.dem.random_placement import cloud
from porefv.dem.sizes import UniformSizes

SIDE, HEIGHT, VISCOSITY = 0.33, 0.83, 10.0
LID = Walls.from_mapping({"z_max": {"pressure": 0.0, "free": True}, "lateral": {"slip": True}})


@pytest.fixture(scope="module")
def course():
    """Rows of numbers every hundred steps of the first two seconds, 7 times the fall of a grain alone by its size."""
    packing = cloud(200, UniformSizes(1.0), Box([0, 0, 0], [SIDE, SIDE, HEIGHT]), 0.75, 1)
    dem = DEM(packing, Material(15e6, 0.5, 30.0, 2600.0), gravity=(0.0, 0.0, -9.81))
    weights = 4.0 / 3.0 * np.pi * packing.radii**3 * 1600.0 * 9.81
    dem.apply(np.outer(weights * 1000.0 / 1600.0, [0.0, 0.0, 1.0]))
    coupling = Coupling(dem, LID, Fluid(VISCOSITY), pair_resistance=True, renewal=0.1)
    stokes = weights[0] / (6.0 * np.pi * VISCOSITY * packing.radii[0])
    rows = []
    while dem.time < 2.0:
        coupling.run(99)
        before = (dem.masses * dem.velocities[:, 2]).sum()
        coupling.run(1)
        rate = ((dem.masses * dem.velocities[:, 2]).sum() - before) / dem.step
        floor = -(dem.last_wall_forces[4, 2] + coupling.wall_fluid_forces[4, 2])
        down = -dem.velocities[:, 2]
        clear = coupling.mesh.vertices[:, 2] > dem.positions[:, 2].max() + 0.06
        rows.append(
            {
                "time": dem.time,
                "momentum": (floor - weights.sum() - rate) / weights.sum(),
                "power": coupling.power.lost / (weights * down).sum(),
                "fallen": (packing.centres - dem.positions)[:, 2].mean() / stokes,
                "fastest": np.abs(dem.velocities).max() / stokes,
                "floor": coupling.pressure.max() * SIDE**2 / weights.sum(),
                "clear": np.abs(coupling.cell_pressure[clear]).max(initial=0.0),
                "out": abs(sum(coupling.wall_flux.values())) / np.abs(down * np.pi * packing.radii**2).sum(),
                "imbalance": coupling.mass_imbalance,
                "top": dem.positions[:, 2].max(),
            }
        )
    return {name: np.array([row[name] for row in rows]) for name in rows[0]} | {"effort": coupling.effort}


def test_fluid_and_contacts_bear_the_weight_less_the_rate_of_momentum(course):
    assert np.abs(course["momentum"]).max() < 1e-10


def test_the_power_balances(course):
    moving = course["time"] > 0.1
    assert np.abs(course["power"][moving]).max() < 1e-3


def test_what_flows_in_flows_out(course):
    assert course["out"].max() < 1e-10
    assert course["imbalance"].max() < 0.101


def test_the_fluid_bears_the_cloud_at_first(course):
    assert course["floor"][(course["time"] > 0.1) & (course["time"] < 0.3)] == pytest.approx(1.0, abs=0.1)


def test_clear_fluid_above_the_front_has_no_excess_pressure(course):
    assert (course["clear"] == 0.0).all()
    assert course["top"][-1] < course["top"][0] - 0.06


def test_the_cloud_settles_hindered(course):
    # Grains alone would fall by 1 s in 1 s; by Richardson and Zaki a cloud of this density does by 0.26 s.
    time, fallen = course["time"], course["fallen"]
    rate = np.interp(0.6, time, fallen) - np.interp(0.1, time, fallen)
    assert rate / 0.5 == pytest.approx(0.75**4.65, rel=0.3)
    assert course["fastest"].max() < 1.5


def test_meshes_are_few(course):
    assert course["effort"].steps > 40 * course["effort"].meshes
