"""Long steps of grains and fluid together: the laws that they keep, and how near they are to short ones."""

from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from porefv import Box, Fluid, Packing, Walls
from porefv.coupling import checkpoint
from porefv.coupling.coupling import Coupling
from porefv.coupling.coupling_state import CouplingState
from porefv.coupling.long_steps import adapt
from porefv.dem.dem import DEM
from porefv.dem.material import Material
from porefv.dem.plate import Plate
from porefv.dem.random_placement import cloud
from porefv.dem.sizes import UniformSizes
from porefv.errors import ComputationError, InputError

FILES = Path(__file__).parent / "files"
LID = Walls.from_mapping({"z_max": {"pressure": 0.0, "free": True}, "lateral": {"slip": True}})
RADIUS, YOUNG = 0.03, 15e6


def coupled(packing, plates, **options):
    """Grains under their submerged weight, under a free surface."""
    gravity = (0.0, 0.0, -9.81)
    dem = DEM(packing, Material(YOUNG, 0.5, 30.0, 2600.0), plates, gravity=gravity)
    volumes = 4.0 / 3.0 * np.pi * packing.radii**3
    dem.apply(-1000.0 * volumes[:, None] * np.array(gravity))
    return dem, Coupling(dem, LID, Fluid(100.0, 1000.0), **({"pair_resistance": True, "renewal": 0.1} | options))


def sinking(n=60, **options):
    packing = cloud(n, UniformSizes(1.0), Box([0, 0, 0], [0.25, 0.25, 0.45]), 0.75, 3)
    return coupled(packing, {"z_min": Plate(friction_angle=20.0)}, **options)


def momentum(dem):
    return (dem.masses[:, None] * dem.velocities).sum(axis=0)


@pytest.fixture(scope="module")
def courses():
    """Both runs of half a second: (dem, coupling) by stride."""
    made = {stride: sinking(stride=stride) for stride in (1, 10)}
    for _, coupling in made.values():
        coupling.run(1200)
    return made


def test_grains_settle_as_in_short_steps(courses):
    short, long = (dem for dem, _ in courses.values())
    start = sinking()[0].positions
    fallen = [(start - dem.positions)[:, 2] for dem in (short, long)]
    assert fallen[0].mean() > 0.1 * RADIUS
    assert fallen[1].mean() == pytest.approx(fallen[0].mean(), rel=0.01)
    assert np.abs(fallen[1] - fallen[0]).max() < 0.1 * fallen[0].max()


def test_long_steps_are_taken(courses):
    _, coupling = courses[10]
    assert coupling.effort.steps == 1200
    assert coupling.stride > 1
    assert courses[1][1].state.stride == 1
    _, begun = sinking(stride=10)
    begun.run(100)
    assert begun.state.stride == 10


def test_impulse_and_power_balance_in_each_long_step(courses):
    dem, coupling = sinking(stride=10)
    coupling.run(400)
    errors = []
    for _ in range(40):
        before, time = momentum(dem), dem.time
        coupling.run(coupling.stride)
        rate = (momentum(dem) - before) / (dem.time - time)
        weight = (dem.masses[:, None] * dem.gravity + dem.applied).sum(axis=0)
        on_walls = (dem.last_wall_forces + coupling.wall_fluid_forces).sum(axis=0)
        assert_allclose(rate, weight - on_walls, atol=1e-10 * np.abs(weight).max())
        power = ((dem.masses[:, None] * dem.gravity + dem.applied) * dem.velocities).sum()
        errors.append(abs(coupling.power.lost) / power)
        assert abs(sum(coupling.wall_flux.values())) < 1e-12
    assert np.median(errors) < 1e-3
    assert max(errors) < 1e-2


def test_contacts_that_yield_bring_a_grain_to_rest_in_steps_beyond_the_critical_one():
    packing = Packing([[0.1, 0.1, 0.9 * RADIUS]], [RADIUS], Box([0, 0, 0], [0.3, 0.3, 0.4]))
    dem = DEM(packing, Material(YOUNG, 0.5, 30.0, 2600.0), gravity=(0.0, 0.0, -9.81))
    for _ in range(400):
        velocities, _, mobilities, _ = dem.predict(10)
        contacts = dem.yielding_contacts
        yielded = np.zeros((7, 6))
        if len(contacts.normal):
            assert_array_equal(contacts.members, [[0, 1 + 4]])
            speed = velocities[0, 2] / (1.0 + mobilities[0] * contacts.normal[0])
            yielded[0, 2], yielded[1 + 4, 2] = -contacts.normal[0] * speed, contacts.normal[0] * speed
        dem.correct(np.zeros((1, 3)), np.zeros(6), yielded=yielded)
    weight = dem.masses[0] * 9.81
    assert dem.contacts.overlaps == pytest.approx([weight / (YOUNG * RADIUS)], rel=1e-9)
    assert dem.last_wall_forces[4, 2] == pytest.approx(-weight, rel=1e-9)


@pytest.mark.parametrize("steps", [40, 43])
def test_a_resumed_run_is_the_run_to_the_last_bit(tmp_path, steps):
    dem, coupling = sinking(stride=4)
    coupling.run(steps)
    checkpoint.save(coupling, tmp_path / "state.npz")
    again = checkpoint.load(tmp_path / "state.npz")
    for run in (coupling, again):
        run.run(61)
    assert_array_equal(again.grains.positions, dem.positions)
    assert_array_equal(again.grains.velocities, dem.velocities)
    assert_array_equal(again.grains.spins, dem.spins)
    assert_array_equal(again.pressure, coupling.pressure)
    assert vars(again.state).keys() == vars(coupling.state).keys()
    assert (again.state.longest, again.state.calm) == (coupling.state.longest, coupling.state.calm)


def test_a_dry_run_goes_on_after_a_long_step():
    dem, coupling = sinking(stride=10)
    coupling.run(20)
    assert dem.last_step == pytest.approx(10 * dem.step)
    steps, time = dem.steps, dem.time
    dem.run(7)
    assert (dem.steps, dem.last_step) == (steps + 7, dem.step)
    assert dem.time == pytest.approx(time + 7 * dem.step)


def test_a_long_step_that_runs_away_names_the_stride():
    dem = DEM(Packing([[0.15, 0.15, 0.2]], [RADIUS], Box([0, 0, 0], [0.3, 0.3, 0.4])), Material(YOUNG))
    dem.velocities = [[0.0, 0.0, -0.02 * RADIUS / dem.step]]
    dem.predict(10)
    with pytest.raises(ComputationError, match="runs away .* 10 steps long: a smaller stride may do"):
        dem.correct(np.zeros((1, 3)), np.zeros(6))


def test_steps_are_not_long_where_a_wall_presses():
    dem, coupling = sinking(stride=10)
    assert coupling.stride == 10
    dem.set_plates({"z_max": Plate(stress=100.0, top_speed=0.01)})
    assert coupling.stride == 1
    coupling.run(3)
    assert coupling.state.stride == 1


def test_noticeable_errors_halve_steps_and_calm_lets_them_grow():
    packing = Packing([[0.5] * 3], [0.1], Box([0] * 3, [1] * 3))
    state = CouplingState.of(packing, 1, "implicit-drag", None)
    state.longest = 10
    for _ in range(50):
        adapt(state, 1e-2, 10)
    assert state.longest == 1
    for _ in range(250):
        adapt(state, 0.0, 10)
    assert state.longest == 2
    for _ in range(2000):
        adapt(state, 0.0, 10)
    assert state.longest == 10


@pytest.mark.parametrize(
    ("options", "reason"),
    [
        ({"stride": 0}, "stride must be a whole number of steps, 1 to 20, not 0"),
        ({"stride": 2.0}, "stride must be a whole number"),
        ({"stride": 21}, "stride must be a whole number"),
        ({"stride": 5, "pair_resistance": False}, "a stride of 5 steps is for pair_resistance = true"),
        ({"stride": 5, "scheme": "semi-implicit"}, "scheme = 'auto' or 'implicit-drag'"),
    ],
)
def test_strides_that_do_not_work_are_refused(options, reason):
    with pytest.raises(InputError, match=reason):
        sinking(**options)


def test_a_file_of_version_3_has_short_steps():
    # Written after 40 steps, with pair resistance, by the version of porefv 0.2.0 that had this format.
    again = checkpoint.load(FILES / "version_3.npz")
    assert (again.stride, again.state.stride, again.grains.state.stride) == (1, 1, 1)
    again.run(20)
    assert again.effort.steps == 60
