"""Resistance of grains that move past each other: invariance, dissipation, decay; clouds and single grains."""

import sys
from importlib.util import module_from_spec, spec_from_file_location
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.testing import assert_allclose

from porefv import Box, Fluid, Packing, PoreMesh, Walls
from porefv.conductance.section_friction.model import SectionFriction
from porefv.coupling import Coupling, PairLaw, PairResistance, checkpoint
from porefv.coupling.open_throats import open_throats
from porefv.dem.dem import DEM
from porefv.dem.material import Material
from porefv.dem.random_placement import cloud
from porefv.dem.sizes import UniformSizes
from porefv.errors import InputError
from porefv.resolved.reference import StokesReference

SLIPPING = {"lateral": {"slip": True}}
NO_WALLS = np.zeros(6, bool)


@pytest.fixture(scope="module")
def settling():
    """The benchmark, whose functions make the static checks."""
    path = Path(__file__).resolve().parents[2] / "benchmarks" / "settling.py"
    spec = spec_from_file_location("settling_benchmark", path)
    module = module_from_spec(spec)
    sys.modules[spec.name] = module
    spec.loader.exec_module(module)
    return module


def motion(velocities, spins):
    """Velocities and spins by row, walls at rest."""
    return np.concatenate([np.concatenate([velocities, spins], axis=1), np.zeros((6, 6))])


# ---- the operator ----------------------------------------------------------------------------------------------


@given(st.integers(0, 2**32 - 1), st.integers(2, 20))
def test_rigid_motions_meet_no_resistance(random_packing, seed, n):
    packing = random_packing(n, 0.2, seed)
    n = len(packing)
    resistance = PairResistance(PoreMesh(packing), NO_WALLS, PairLaw(1.0, 0.02))
    rng = np.random.default_rng(seed)
    drift, spin = rng.normal(size=(2, 3))
    moves = motion(drift + np.cross(spin, packing.centres), np.tile(spin, (n, 1)))
    pairs = resistance.pairs
    speed = np.abs(moves[:, :3]).max() + np.abs(spin).max() * pairs.arms.max(initial=0.0)
    scale = speed * (pairs.normal.sum() + pairs.tangential.sum() + 1e-300)
    resisted = resistance.multiply(moves)
    arm = pairs.arms.max(initial=1.0)
    assert np.abs(resisted[:, :3]).max() <= 1e-13 * scale
    assert np.abs(resisted[:, 3:]).max() <= 1e-13 * scale * arm + 1e-13 * np.abs(spin).max() * pairs.rolling.sum()


@given(st.integers(0, 2**32 - 1), st.integers(1, 12))
def test_it_is_symmetric_and_takes_power(random_packing, seed, n):
    packing = random_packing(n, 0.2, seed)
    n = len(packing)
    resistance = PairResistance(PoreMesh(packing), np.ones(6, bool), PairLaw(1.0, 0.02))
    units = np.eye(6 * (n + 6)).reshape(-1, n + 6, 6)
    matrix = np.stack([resistance.multiply(unit).ravel() for unit in units])
    assert_allclose(matrix, matrix.T, atol=1e-13 * np.abs(matrix).max())
    assert np.linalg.eigvalsh(matrix)[0] >= -1e-12 * np.abs(matrix).max()


@given(st.integers(0, 2**32 - 1), st.integers(1, 12))
def test_forces_and_torques_of_pairs_add_up_to_nothing(random_packing, seed, n):
    packing = random_packing(n, 0.2, seed)
    n = len(packing)
    resistance = PairResistance(PoreMesh(packing), NO_WALLS, PairLaw(1.0, 0.02))
    rng = np.random.default_rng(seed)
    loads = resistance.multiply(motion(*rng.normal(size=(2, n, 3))))[:n]
    scale = np.abs(loads).sum() + 1e-300
    assert_allclose(loads[:, :3].sum(axis=0), 0.0, atol=1e-12 * scale)
    moments = loads[:, 3:] + np.cross(packing.centres, loads[:, :3])
    assert_allclose(moments.sum(axis=0), 0.0, atol=1e-12 * scale)


def test_far_walls_resist_motion_past_them_and_no_other():
    packing = cloud(20, UniformSizes(0.5), Box([0, 0, 0], [1, 1, 1]), 0.95, 1)
    mesh, dragging, n = PoreMesh(packing), np.array([False, False, True, True, True, False]), 20
    far = open_throats(mesh, SectionFriction(), ~dragging, 1.0).far_walls
    assert (far.coefficients > 0.0).all() and set(far.members[:, 1] - n) == {2, 3, 4}
    resistance = PairResistance(mesh, NO_WALLS, PairLaw(1.0, 0.02, growth=0.0, contact=0.0, lubricated=1e-9), None, far)
    moves = np.zeros((n + 6, 6))
    moves[:, :3] = 1.0, 2.0, 3.0
    scale = far.coefficients.sum()
    assert np.abs(resistance.multiply(moves)).max() <= 1e-13 * scale
    rng = np.random.default_rng(1)
    for moves in rng.normal(size=(10, n + 6, 6)):
        resisted = resistance.multiply(moves)
        assert np.vdot(moves, resisted) > 0.0
        assert_allclose(resisted.sum(axis=0), 0.0, atol=1e-12 * scale)
        assert (resisted[:, 3:] == 0.0).all()


def test_walls_of_symmetry_are_never_far_walls():
    packing = cloud(20, UniformSizes(1.0), Box([0, 0, 0], [1, 1, 1]), 0.95, 1)
    found = open_throats(PoreMesh(packing), SectionFriction(), np.ones(6, bool), 1.0)
    assert not len(found.far_walls.members) and (found.wall_factors == 1.0).all()


@pytest.mark.parametrize("roughness", [1e-3, 0.05])
def test_lubrication_grows_no_more_below_the_roughness(roughness):
    def normal(gap):
        packing = Packing([[1.0, 2.0, 2.0], [3.0 + gap, 2.0, 2.0]], [1.0, 1.0], Box([0, 0, 0], [5, 4, 4]))
        pairs = PairResistance(PoreMesh(packing), NO_WALLS, PairLaw(1.0, roughness)).pairs
        return pairs.normal[0]

    assert normal(1e-9) == pytest.approx(normal(0.9 * roughness), rel=0.03 * roughness * 40)
    assert normal(roughness) > 1.5 * normal(2.0 * roughness)


def test_pairs_fade_with_distance():
    def tangential(distance):
        size = [distance + 4.0, 4.0, 4.0]
        packing = Packing([[2.0, 2.0, 2.0], [2.0 + distance, 2.0, 2.0]], [1.0, 1.0], Box([0, 0, 0], size))
        return PairResistance(PoreMesh(packing), NO_WALLS, PairLaw(1.0, 0.02)).pairs.tangential[0]

    far = [tangential(distance) for distance in (20.0, 40.0, 80.0)]
    assert far[1] < far[0] / 8.0 and far[2] < far[1] / 8.0


# ---- single grains, pairs and clouds, as in the tables of docs/coupling.md --------------------------------------


@pytest.mark.parametrize("side", [7.0, 13.0, 25.0, 50.0])
def test_a_grain_alone_in_a_cube_of_slip_walls(settling, side):
    # 1 - 3.01 a / L: Hasimoto's cubic array, whose planes of symmetry are the walls.
    assert settling.alone(side) == pytest.approx(1.0 - 3.01 / side, rel=0.2)


@pytest.mark.parametrize("side", [7.0, 13.0, 25.0, 50.0])
def test_a_grain_between_no_slip_walls(settling, side):
    between = {wall: {"slip": True} for wall in ("x_min", "x_max", "y_min", "y_max")}
    assert settling.alone(side, between, 50.0) == pytest.approx(settling.faxen(side), rel=0.2)


@pytest.mark.parametrize("name", [
    "sc8_c0.05_no_slip", "fines_n8_m15_d8_s32_no_slip", "fines_n8_m15_d8_s32_symmetry", "rnd_n12_r5_p0.85_s3_no_slip",
])  # fmt: skip
def test_flow_through_held_grains_is_that_without_pairs(settling, name):
    # All cases: python benchmarks/settling.py permeability.
    path = Path(__file__).resolve().parents[2] / "data" / "reference" / "stokes" / f"{name}.json"
    before, after = settling.permeability_errors(StokesReference.read(path))
    assert after == pytest.approx(before, abs=0.003)


@pytest.mark.parametrize("gap", [0.005, 0.02, 0.1])
def test_two_grains_approach_and_slide(settling, gap):
    assert settling.two(gap, 0) == pytest.approx(settling.jeffrey_onishi(gap, 0), rel=0.15)
    assert settling.two(gap, 1) == pytest.approx(settling.jeffrey_onishi(gap, 1), rel=0.30)


@pytest.mark.parametrize(("c", "seed"), [(0.05, 1), (0.10, 1)])
def test_a_cloud_settles_as_richardson_and_zaki_say(settling, c, seed):
    common, mean, scatter, fastest, least = settling.of_cloud(c, seed)
    assert common == pytest.approx(settling.bed_drag(c), rel=0.12)
    assert mean == pytest.approx(settling.richardson_zaki(c), rel=0.15)
    assert 0.2 < scatter < 1.3
    assert fastest < 4.0
    assert least > 0.05


# ---- steps -----------------------------------------------------------------------------------------------------


def sinking(n=60, viscosity=100.0, lateral=SLIPPING["lateral"], **options):
    """A cloud under its submerged weight, under a lid at pressure 0."""
    packing = cloud(n, UniformSizes(1.0), Box([0, 0, 0], [0.25, 0.25, 0.45]), 0.75, 3)
    dem = DEM(packing, Material(density=2600.0), gravity=(0.0, 0.0, -9.81))
    dem.apply(1000.0 * 9.81 * 4.0 / 3.0 * np.pi * packing.radii[:, None] ** 3 * [0.0, 0.0, 1.0])
    walls = Walls.from_mapping({"z_max": {"pressure": 0.0}, "lateral": lateral})
    return dem, Coupling(dem, walls, Fluid(viscosity=viscosity), pair_resistance=True, **options)


@pytest.mark.parametrize("viscosity", [1e-3, 100.0, 1e4])
def test_momentum_balances_with_pairs_to_rounding(viscosity):
    dem, coupling = sinking(viscosity=viscosity)
    for _ in range(5):
        before = (dem.masses[:, None] * dem.velocities).sum(axis=0)
        coupling.run(1)
        rate = ((dem.masses[:, None] * dem.velocities).sum(axis=0) - before) / dem.step
        weight = (dem.masses[:, None] * dem.gravity + dem.applied).sum(axis=0)
        on_walls = (dem.last_wall_forces + coupling.wall_fluid_forces).sum(axis=0)
        assert_allclose(rate, weight - on_walls, atol=1e-11 * np.abs(weight).max())


@pytest.mark.parametrize("slip", [True, False])
def test_the_power_of_pairs_closes_the_balance(slip):
    dem, coupling = sinking(tolerance=1e-4, lateral={"slip": slip})
    coupling.run(200)
    power = coupling.power
    weight = ((dem.masses[:, None] * dem.gravity + dem.applied) * dem.velocities).sum()
    assert power.pairs > 0.0
    assert abs(power.lost) < 1e-3 * weight


def test_a_step_is_stable_whatever_the_viscosity():
    # Explicit lubrication diverges at a viscosity of 100 Pa s already.
    dem, coupling = sinking(viscosity=1e4, roughness=1e-3)
    coupling.run(100)
    stokes = 2.0 / 9.0 * 1600.0 * 9.81 * dem.radii[0] ** 2 / 1e4
    assert np.abs(dem.velocities).max() < stokes


@pytest.mark.parametrize("viscosity", [1e2, 1e4, 1e5])
def test_the_first_step_on_a_mesh_is_right_however_stiff_the_drag(viscosity):
    # In plain rounds of pairs and pressures the power would be wrong by 3e-3 and 6e-2 at 1e4 and 1e5 Pa s.
    dem, coupling = sinking(viscosity=viscosity)
    coupling.run(1)
    first = dem.velocities[:, 2].mean()
    weight = ((dem.masses[:, None] * dem.gravity + dem.applied) * dem.velocities).sum()
    assert abs(coupling.power.lost) < 1e-3 * weight
    if viscosity >= 1e4:  # the inertia of grains lasts for less than a step
        coupling.run(200)
        assert first == pytest.approx(dem.velocities[:, 2].mean(), rel=0.1 if viscosity == 1e4 else 0.03)


def test_half_the_step_changes_a_settling_cloud_little():
    fallen = []
    for part in (1, 2):
        dem, _ = sinking()
        packing = dem.packing
        dem = DEM(packing, Material(density=2600.0), gravity=(0.0, 0.0, -9.81), step=dem.step / part)
        dem.apply(1000.0 * 9.81 * 4.0 / 3.0 * np.pi * packing.radii[:, None] ** 3 * [0.0, 0.0, 1.0])
        walls = Walls.from_mapping({"z_max": {"pressure": 0.0}, **SLIPPING})
        coupling = Coupling(dem, walls, Fluid(viscosity=100.0), pair_resistance=True)
        coupling.run(100 * part)
        fallen.append((packing.centres - dem.positions)[:, 2].mean())
    assert fallen[1] == pytest.approx(fallen[0], rel=0.02)


def test_grains_that_do_not_spin_are_refused():
    class Still:
        def __getattr__(self, name):
            raise AttributeError(name)

    with pytest.raises(InputError, match="pair_resistance needs grains that spin"):
        Coupling(Still(), Walls(), pair_resistance=True)


@pytest.mark.parametrize("roughness", [0.0, 0.5])
def test_a_roughness_out_of_range_is_refused(roughness):
    with pytest.raises(InputError, match="roughness must be"):
        sinking(roughness=roughness)


@settings(max_examples=5)
@given(st.integers(1, 25))
def test_a_run_with_pairs_goes_on_to_the_last_bit(tmp_path_factory, steps):
    path = tmp_path_factory.mktemp("pairs") / "run.npz"
    dem, coupling = sinking(n=20, renewal=0.001)
    coupling.run(steps)
    checkpoint.save(coupling, path)
    again = checkpoint.load(path)
    torques = coupling.fluid_torques
    assert_allclose(again.fluid_torques, torques, atol=1e-12 * np.abs(torques).max())
    for each in (coupling, again):
        each.run(15)
    assert (again.grains.positions == dem.positions).all()
    assert (again.pressure == coupling.pressure).all()
