"""Contacts and steps against mechanics: collisions, sliding, rolling, stacks, conservation."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from porefv import Box, ComputationError, InputError, Packing
from porefv.dem.contacts import StepParameters, grain_contacts
from porefv.dem.dem import DEM
from porefv.dem.grain_state import GrainPairs, Grains
from porefv.dem.material import Material
from porefv.dem.plate import Plate
from porefv.system import threads

E = 1.0e6
SMOOTH = Material(young=E, stiffness_ratio=0.0, friction_angle=0.0, density=1000.0)


def mass(r, density=1000.0):
    return density * 4.0 / 3.0 * np.pi * r**3


def grains(centres, radii, size=10.0, **options):
    """Grains in a large box."""
    return DEM(Packing(centres, radii, Box([-size] * 3, [size] * 3)), **options)


# ---- two grains ----------


@pytest.mark.parametrize(("a", "b"), [(0.1, 0.1), (0.1, 0.3)])
def test_a_central_collision_takes_half_a_period_and_loses_nothing(a, b):
    # A linear spring: contact time π √(m_eff / k), restitution 1.
    k = 2.0 * E * a * b / (a + b)
    reduced = mass(a) * mass(b) / (mass(a) + mass(b))
    duration = np.pi * np.sqrt(reduced / k)
    step = duration / 20_000
    dem = grains([[0, 0, 0], [a + b, 0, 0]], [a, b], material=SMOOTH, step=step)
    dem.velocities = [[1.0, 0, 0], [-0.5, 0, 0]]
    dem.run(10_000)
    depth = a + b - (dem.positions[1] - dem.positions[0])[0]
    assert_allclose(depth, 1.5 * np.sqrt(reduced / k), rtol=1e-6)  # greatest at half the time
    dem.run(9_990)
    assert len(dem.contacts) == 1
    dem.run(20)
    assert len(dem.contacts) == 0
    v = dem.velocities[:, 0]
    assert_allclose(v[1] - v[0], 1.5, rtol=1e-3)
    assert_allclose(mass(a) * v[0] + mass(b) * v[1], mass(a) - 0.5 * mass(b), rtol=1e-12)
    assert_allclose(dem.velocities[:, 1:], 0.0, atol=0.0)


def test_restitution_tends_to_one_as_the_step_shrinks():
    errors = []
    for steps in (100, 1000, 10_000):
        duration = np.pi * np.sqrt(0.5 * mass(0.1) / (E * 0.1))
        dem = grains([[0, 0, 0], [0.2, 0, 0]], [0.1, 0.1], material=SMOOTH, step=duration / steps)
        dem.velocities = [[1.0, 0, 0], [-1.0, 0, 0]]
        dem.run(2 * steps)
        errors.append(abs(dem.velocities[1, 0] - 1.0))
    assert errors[2] < 1e-6
    assert errors[1] < 0.2 * errors[0] + 1e-12


def test_an_oblique_impact_that_slides_throughout_has_the_impulses_of_coulomb():
    # Tangential impulse = tan φ times normal impulse while sliding does not stop (Walton's gross sliding).
    rough = Material(young=E, stiffness_ratio=0.8, friction_angle=np.degrees(np.arctan(0.05)), density=1000.0)
    r, m = 0.1, mass(0.1)
    duration = np.pi * np.sqrt(m / (E * r))
    box = Box([-1, -1, 0], [1, 1, 1])
    wall = {"z_min": Plate(friction_angle=rough.friction_angle)}
    dem = DEM(Packing([[0, 0, r]], [r], box), rough, wall, step=duration / 20_000)
    v = 0.01  # slow, so that the overlap hardly shortens the arm
    dem.velocities = [[v, 0, -v]]
    dem.run(22_000)
    assert len(dem.contacts) == 0
    assert_allclose(dem.velocities[0, 2], v, rtol=1e-3)
    slip_loss = 0.05 * 2.0 * m * v  # tan φ (1 + e) m v_n
    assert_allclose(dem.velocities[0, 0], v - slip_loss / m, rtol=2e-3)
    # The same force at the arm r: spin = impulse r / (0.4 m r²), turning with the sliding.
    assert_allclose(dem.spins[0, 1], slip_loss * r / (0.4 * m * r**2), rtol=2e-3)
    energies = dem.energies
    assert energies.sliding > 0.0
    assert_allclose(energies.balance, m * v**2, rtol=1e-4)


@pytest.mark.parametrize("spin", [[0.0, 0.0, 3.0], [2.0, 1.0, 0.5]])
def test_tangential_force_turns_with_a_pair_that_turns_as_one(spin):
    # A rigid rotation makes no slip: the tangential force keeps its size and turns along.
    spin = np.array(spin)
    grains = Grains(np.zeros((2, 10)), inverse_mass=np.ones(2), inverse_inertia=np.ones(2))
    grains.motion[:, 3] = 0.1
    grains.motion[:, 7:] = spin
    branch, shear0 = np.array([0.19, 0.0, 0.0]), np.array([0.0, 1.0e-3, 0.5e-3])
    pairs = GrainPairs(
        grains=np.array([[0, 1]], np.int32),
        starts=np.array([0, 1, 1]),
        others=np.array([1], np.int32),
        stiffness=np.array([1.0e-7]),  # next to none: what is there only turns
        shear=shear0[None].copy(),
        touching=np.array([True]),
        ranges=np.array([0, 2]),
    )
    dt, steps = 1.0e-4, 20_000
    parameters = StepParameters(dt, 0.5, friction=1e12, gravity=np.zeros(3), damping=0.0, gain=0.0, fastest=np.inf)
    rate = np.sqrt(spin @ spin)
    axis = spin / rate

    def turned(v, angle):
        return v * np.cos(angle) + np.cross(axis, v) * np.sin(angle) + axis * (axis @ v) * (1 - np.cos(angle))

    for step in range(1, steps + 1):
        # Velocities at the half step, places at the whole.
        half, whole = turned(branch, rate * dt * (step - 0.5)), turned(branch, rate * dt * step)
        grains.motion[1, :3] = whole
        grains.motion[1, 4:7] = np.cross(spin, half)
        grain_contacts(0, 1, parameters, grains, pairs, np.zeros((2, 6)))
    # To first order in the 3e-4 that it turns in a step.
    shear = pairs.shear
    assert_allclose(shear[0], turned(shear0, rate * dt * steps), atol=1e-3 * np.abs(shear0).max())
    assert_allclose(shear[0] @ shear[0], shear0 @ shear0, rtol=1e-6)


# ---- a grain and a plane ----------


@pytest.mark.parametrize("slope", [10.0, 25.0])
def test_a_grain_held_from_turning_slides_only_on_slopes_steeper_than_its_friction(slope):
    # Two grains abreast and a lid would do as well; here the spin is stopped by hand.
    angle = 20.0
    rough = Material(young=E, stiffness_ratio=0.5, friction_angle=angle, density=1000.0)
    r, g = 0.1, 10.0
    tilt = np.radians(slope)
    depth = mass(r) * g * np.cos(tilt) / (E * r)
    dem = DEM(
        Packing([[0, 0, r - depth]], [r], Box([-50, -1, 0], [50, 1, 1])),
        rough,
        {"z_min": Plate(friction_angle=angle)},
        gravity=(g * np.sin(tilt), 0.0, -g * np.cos(tilt)),
    )
    speeds = []
    for _ in range(2):
        for _ in range(int(0.3 / dem.step)):
            dem.run(1)
            dem.spins = [[0.0, 0.0, 0.0]]
        speeds.append(dem.velocities[0, 0])
    sliding = g * max(np.sin(tilt) - np.tan(np.radians(angle)) * np.cos(tilt), 0.0)
    if sliding > 0.0:
        assert_allclose((speeds[1] - speeds[0]) / (0.5 * dem.time), sliding, rtol=1e-3)
    else:  # it swings about where the tangential force holds it, and goes nowhere
        assert abs(dem.positions[0, 0]) < 2.01 * mass(r) * g * np.sin(tilt) / (0.5 * E * r)


@pytest.mark.parametrize("slope", [10.0, 60.0])
def test_a_grain_rolls_down_a_slope_until_friction_cannot_turn_it(slope):
    # Rolling: a = 5/7 g sin; beyond tan slope = 7/2 tan φ it slides too: a = g (sin - tan φ cos).
    angle = 20.0
    rough = Material(young=1e7, stiffness_ratio=0.5, friction_angle=angle, density=1000.0)
    r, g = 0.1, 10.0
    tilt = np.radians(slope)
    depth = mass(r) * g * np.cos(tilt) / (1e7 * r)
    dem = DEM(
        Packing([[0, 0, r - depth]], [r], Box([-50, -1, 0], [50, 1, 1])),
        rough,
        {"z_min": Plate(friction_angle=angle)},
        gravity=(g * np.sin(tilt), 0.0, -g * np.cos(tilt)),
    )
    dem.run(int(0.5 / dem.step))
    friction = np.tan(np.radians(angle))
    rolls = np.tan(tilt) <= 3.5 * friction
    expected = 5.0 / 7.0 * g * np.sin(tilt) if rolls else g * (np.sin(tilt) - friction * np.cos(tilt))
    assert_allclose(dem.velocities[0, 0], expected * dem.time, rtol=0.01)
    if rolls:
        assert_allclose(dem.spins[0, 1] * r, dem.velocities[0, 0], rtol=0.01)


def test_a_grain_alone_falls_on_the_floor_and_bounces():
    # It falls by nine radii first: contacts are looked for on the way, though there is no other grain.
    r, height = 0.1, 1.0
    hard = Material(young=1.0e8, stiffness_ratio=0.0, friction_angle=0.0, density=1000.0)
    dem = DEM(Packing([[1, 1, height]], [r], Box([0, 0, 0], [2, 2, 2])), hard, gravity=(0.0, 0.0, -9.81))
    fall = np.sqrt(2.0 * (height - r) / 9.81)
    lowest = height
    while dem.time < 1.5 * fall:
        dem.run(1)
        lowest = min(lowest, dem.positions[0, 2])
    assert 0.9 * r < lowest < r
    assert dem.velocities[0, 2] > 0.0
    assert dem.positions[0, 2] > 0.5 * height


def test_a_stack_under_gravity_bears_the_weight_above_each_contact():
    r, g, count = 0.1, 10.0, 5
    weight = mass(r) * g
    k_grain, k_wall = E * r, E * r
    overlaps = [count * weight / k_wall] + [(count - 1 - i) * weight / k_grain for i in range(count - 1)]
    heights = r - overlaps[0] + np.concatenate([[0.0], np.cumsum(2 * r - np.array(overlaps[1:]))])
    dem = DEM(
        Packing(np.column_stack([np.zeros((count, 2)), heights]), np.full(count, r), Box([-1, -1, 0], [1, 1, 2])),
        SMOOTH,
        gravity=(0, 0, -g),
    )
    dem.run(2000)
    contacts = dem.contacts
    bears = {tuple(sorted(pair)): abs(f[2]) for pair, f in zip(contacts.grains.tolist(), contacts.forces, strict=True)}
    assert_allclose(bears[0, count + 4], count * weight, rtol=1e-6)  # 4: z_min
    for i in range(count - 1):
        assert_allclose(bears[i, i + 1], (count - 1 - i) * weight, rtol=1e-6)
    assert_allclose(dem.wall_forces[4], [0, 0, -count * weight], rtol=1e-6, atol=1e-9)


# ---- conservation ----------


def gas(seed=0, **options):
    rng = np.random.default_rng(seed)
    n = 40
    cells = np.stack(np.meshgrid(*[np.arange(4)] * 3, indexing="ij"), axis=-1).reshape(-1, 3)[:n]
    centres = 0.5 * cells - 0.75 + rng.uniform(-0.05, 0.05, (n, 3))
    dem = grains(centres, rng.uniform(0.1, 0.2, n), **{"size": 1.0, **options})
    dem.velocities = rng.normal(size=(n, 3))
    return dem


def test_energy_is_conserved_without_friction():
    dem = gas(material=SMOOTH, step=2e-6)
    start = dem.energies.balance
    hits = 0
    for _ in range(10):
        dem.run(10_000)
        hits += len(dem.contacts)
        assert_allclose(dem.energies.balance, start, rtol=1e-6)
    assert hits > 20  # there were collisions to conserve it through


def test_momentum_and_angular_momentum_are_conserved_to_rounding():
    rough = Material(young=E, stiffness_ratio=0.5, friction_angle=30.0, density=1000.0)
    dem = gas(material=rough, size=100.0)
    dem.velocities = np.cross([0.0, 0.0, 1.0], dem.positions) - 2.0 * dem.positions  # they meet in the middle
    m = dem.masses[:, None]
    inertia = 0.4 * m * dem.radii[:, None] ** 2

    def momenta():
        # The leapfrog keeps both exactly: what a step adds to x is along v, and forces are opposite on one line.
        x, v = dem.positions, dem.velocities
        return (m * v).sum(axis=0), (m * np.cross(x, v) + inertia * dem.spins).sum(axis=0)

    before = momenta()
    scale = np.abs(m * dem.velocities).sum()
    touching = 0
    for _ in range(40):
        dem.run(10)
        touching += len(dem.contacts)
        after = momenta()
        assert_allclose(after[0], before[0], atol=1e-12 * scale)
        assert_allclose(after[1], before[1], atol=1e-12 * scale)
    assert touching > 20
    assert dem.energies.sliding > 0.0


def test_with_friction_what_is_lost_is_what_sliding_takes():
    rough = Material(young=E, stiffness_ratio=0.5, friction_angle=20.0, density=1000.0)
    dem = gas(material=rough, step=5e-6)
    start = dem.energies.balance
    dem.run(40_000)
    energies = dem.energies
    assert energies.sliding > 0.02 * start
    assert_allclose(energies.balance, start, rtol=2e-3)


# ---- walls ----------


def test_a_moving_wall_does_the_work_that_the_grains_gain():
    dem = gas(material=SMOOTH, step=5e-6, plates={"x_min": Plate(velocity=(0.2, 0.0, 0.0))})
    start = dem.energies.balance
    dem.run(40_000)
    energies = dem.energies
    assert_allclose(dem.box.lower[0], -1.0 + 0.2 * dem.time, rtol=1e-10)
    assert abs(energies.walls) > 0.01 * start
    assert_allclose(energies.balance, start, rtol=1e-4)


def test_a_pressing_wall_reaches_its_stress():
    # A chain of three grains between two walls.
    r = 0.1
    dem = DEM(
        Packing([[0.1, 0.1, 0.1], [0.3, 0.1, 0.1], [0.5, 0.1, 0.1]], [r] * 3, Box([0, 0, 0], [0.61, 0.2, 0.2])),
        SMOOTH,
        {"x_max": Plate(stress=2000.0, top_speed=0.05)},
        damping=0.3,
    )
    dem.run(60_000)
    assert_allclose(dem.wall_stress["x_max"], 2000.0, rtol=1e-3)
    assert_allclose(dem.wall_stress["x_min"], 2000.0, rtol=1e-3)
    # Compression of four contacts in series: two of grains, two of walls, each of stiffness E r.
    force = 2000.0 * 0.2 * 0.2
    assert_allclose(dem.box.size[0], 6 * r - 4 * force / (E * r), rtol=1e-5)


# ---- bad input, blow-up ----------


def test_bad_starts_are_refused_with_the_grain_named():
    with pytest.raises(InputError, match="grain 1 has its centre outside"):
        grains([[0, 0, 0], [20, 0, 0]], [0.1, 0.1])
    with pytest.raises(InputError, match="grains 0 and 1 overlap"):
        grains([[0, 0, 0], [0.05, 0, 0]], [0.1, 0.1])
    with pytest.raises(InputError, match="no box"):
        DEM(Packing([[0, 0, 0]], [0.1]))


def test_a_step_above_the_critical_one_is_refused():
    with pytest.raises(InputError, match="critical"):
        grains([[0, 0, 0]], [0.1], material=SMOOTH, step=1.0)


@pytest.mark.parametrize(
    ("name", "value"),
    [("young", 0.0), ("young", -1.0), ("stiffness_ratio", -0.1), ("friction_angle", 90.0), ("density", 0.0)],
)
def test_materials_out_of_range_are_refused(name, value):
    with pytest.raises(InputError, match=name):
        Material(**{name: value})


def test_runaway_motion_is_stopped_and_says_which_grain():
    dem = grains([[0, 0, 0], [1, 0, 0]], [0.1, 0.1], material=SMOOTH)
    dem.velocities = [[0, 0, 0], [1e5, 0, 0]]
    with pytest.raises(ComputationError, match="grain 1 moves at"):
        dem.run(10)
    dem = grains([[0, 0, 0], [1, 0, 0]], [0.1, 0.1], material=SMOOTH)
    dem.velocities = [[np.nan, 0, 0], [0, 0, 0]]
    with pytest.raises(ComputationError, match="grain 0"):
        dem.run(10)


def test_a_grain_that_is_pushed_through_a_wall_stops_the_run():
    dem = DEM(Packing([[0, 0, 0.1]], [0.1], Box([-1, -1, 0], [1, 1, 1])), SMOOTH, gravity=(0, 0, -1500.0), step=2e-4)
    with pytest.raises(ComputationError, match="grain 0 has left the box"):
        dem.run(10_000)


def test_a_wall_that_cannot_reach_its_stress_says_what_it_reached():
    box = Box([0, 0, 0], [0.2, 0.2, 0.2])
    # One grain of two pressing walls: no rest at two different stresses.
    plates = {"x_min": Plate(stress=1000.0, top_speed=0.05), "x_max": Plate(stress=3000.0, top_speed=0.05)}
    dem = DEM(Packing([[0.1, 0.1, 0.1]], [0.1], box), SMOOTH, plates, damping=0.3)
    with pytest.raises(ComputationError, match=r"wall x_m.. presses with .* Pa, not the .* Pa asked"):
        dem.run_to_rest(most=2000)


def test_grains_that_swing_for_ever_are_not_at_rest():
    dem = DEM(Packing([[0, 0, 0.095]], [0.1], Box([-1, -1, 0], [1, 1, 1])), SMOOTH, gravity=(0, 0, -10.0))
    with pytest.raises(ComputationError, match="not at rest"):
        dem.run_to_rest(most=1000)
    dem = DEM(Packing([[0, 0, 0.095]], [0.1], Box([-1, -1, 0], [1, 1, 1])), SMOOTH, gravity=(0, 0, -10.0), damping=0.3)
    assert dem.run_to_rest() < 10_000
    assert_allclose(dem.wall_stress["z_min"], mass(0.1) * 10.0 / 4.0, rtol=1e-2)


# ---- the same on any number of threads ----------


def test_a_run_is_the_same_to_the_bit_on_any_number_of_threads(reference, monkeypatch):
    rough = Material(young=E, stiffness_ratio=0.5, friction_angle=30.0, density=1000.0)
    monkeypatch.setattr(threads, "processors", lambda: 3)

    def final(count):
        with threads.limited_threads(count):
            dem = DEM(reference("n5000_s1"), rough, {"z_max": Plate(stress=100.0, top_speed=0.1)}, damping=0.1)
            dem.velocities = np.random.default_rng(0).normal(scale=0.01, size=(len(dem), 3))
            dem.run(100)
            return dem.positions, dem.contacts.forces, dem.energies

    one = final(1)
    for other in (final(1), final(2), final(3)):
        assert np.array_equal(one[0], other[0]) and np.array_equal(one[1], other[1])
        assert one[2] == other[2]
