"""Gauges and profiles of a simulation: what they read, where, and how they are drawn."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from porefv import Box
from porefv.cli.program import main
from porefv.dem.random_placement import cloud
from porefv.dem.sizes import UniformSizes
from porefv.scenes.simulation_scene import SimulationScene
from porefv.simulation import simulate
from porefv.simulation.gauge_picture import Gauges
from porefv.simulation.reading import read_profiles, read_series

SIDE, HEIGHT, FILLED, VISCOSITY = 0.3, 1.2, 0.6, 100.0
WEIGHT = 1600.0 * 9.81  # of a volume of solid, less its buoyancy [N/m³]
GAUGES = [0.1, 0.25, 0.4, 0.9]


@pytest.fixture(scope="module")
def path(tmp_path_factory):
    """A scene: a cloud of 120 grains sinks in the lower half of a vessel."""
    folder = tmp_path_factory.mktemp("gauges")
    grains = cloud(120, UniformSizes(1.0), Box([0, 0, 0], [SIDE, SIDE, FILLED]), 0.75, 1)
    table = np.column_stack([grains.centres, grains.radii])
    np.savetxt(folder / "cloud.csv", table, delimiter=",", header="x,y,z,radius", comments="")
    scene = folder / "scene.toml"
    scene.write_text(f"""\
packing = "cloud.csv"
gravity = [0.0, 0.0, -9.81]
[box]
lower = [0.0, 0.0, 0.0]
upper = [{SIDE}, {SIDE}, {HEIGHT}]
[material]
density = 2600.0
[fluid]
viscosity = {VISCOSITY}
density = 1000.0
[walls]
z_max = {{ pressure = 20.0, free = true }}
lateral = {{ slip = true }}
[coupling]
pair_resistance = true
[[stages]]
name = "fall"
duration = 0.1
every = 0.025
[[stages]]
name = "dry"
fluid = false
duration = 0.002
[output]
gauges = {GAUGES}
profiles = 0.05
layers = 24
""")
    return scene


@pytest.fixture(scope="module")
def found(path):
    return simulate.run(SimulationScene.read(path))


def test_the_gradient_is_the_weight_of_the_grains_between_two_gauges(found):
    series = read_series(found)
    last = series[series["stage"] == 1][-1]
    pressures = np.array([last[f"gauge_pressure_{k}"] for k in (1, 2, 3)])
    porosities = np.array([last[f"gauge_porosity_{k}"] for k in (1, 2)])
    gradients = -np.diff(pressures) / np.diff(GAUGES[:3])
    # Grains have inertia, and pairs of them bear a little between planes.
    assert_allclose(gradients, (1.0 - porosities) * WEIGHT, rtol=0.05)


def test_clear_fluid_has_the_pressure_of_the_free_surface(found):
    series, profiles = read_series(found), read_profiles(found)
    wet = series[(series["stage"] == 1) & (series["time"] > 0.0)]
    assert_allclose(wet["gauge_pressure_4"], 20.0, atol=1e-9)
    clear = profiles[(profiles["stage"] == 1) & (profiles["time"] > 0.0) & (profiles["lower"] > FILLED + 0.2)]
    assert len(clear) > 5
    for column, value in (("pressure", 20.0), ("total_stress", 20.0), ("effective_stress", 0.0), ("porosity", 1.0)):
        assert_allclose(clear[column], value, atol=1e-9)


def test_profiles_have_no_gaps_and_the_total_stress_is_the_weight_above(found):
    profiles = read_profiles(found)
    last = profiles[profiles["stage"] == 1][-24:]
    assert all(np.isfinite(last[name]).all() for name in last.dtype.names)
    assert_allclose(last["total_stress"], last["pressure"] + last["effective_stress"])
    weights = (1.0 - last["porosity"]) * (last["upper"] - last["lower"]) * WEIGHT
    above = np.cumsum(weights[::-1])[::-1] - 0.5 * weights
    assert np.abs(last["total_stress"] - 20.0 - above).max() < 0.05 * weights.sum()
    assert weights.sum() * SIDE**2 == pytest.approx(120 * 4.0 / 3.0 * np.pi * 0.03**3 * WEIGHT, rel=0.03)


def test_without_fluid_there_are_porosities_alone(found):
    series = read_series(found)
    dry = series[series["stage"] == 2]
    assert len(dry) and np.isnan(dry["gauge_pressure_1"]).all() and np.isfinite(dry["gauge_porosity_3"]).all()


def test_a_gauge_that_a_wall_has_passed_has_nothing(path):
    scene = path.read_text().split("[[stages]]")
    moving = scene[1] + "plates = { z_max = { velocity = [0.0, 0.0, -100.0] } }\n"
    path.with_name("moving.toml").write_text(
        "[[stages]]".join([scene[0], moving.replace("0.1\n", "0.004\n"), scene[2]]).replace(
            "gauges = [", 'directory = "moving"\ngauges = ['
        )
    )
    series = read_series(simulate.run(SimulationScene.read(path.with_name("moving.toml"))))
    last = series[series["stage"] == 1][-1]
    assert last["place_z_max"] < GAUGES[-1]
    assert np.isfinite(last["gauge_pressure_3"]) and np.isfinite(last["gauge_porosity_2"])
    assert np.isnan(last["gauge_pressure_4"]) and np.isnan(last["gauge_porosity_3"])


@pytest.mark.parametrize(
    ("gauges", "said"),
    [
        ("[0.1, 1.3]", "[output] gauges: 1.3 m is outside the box, which goes from 0 to 1.2 m along z"),
        ("[-0.1]", "[output] gauges: -0.1 m is outside the box"),
        ("[0.2, 0.1]", "[output] gauges: expected increasing places in m"),
        ("[]", "[output] gauges: expected increasing places in m"),
    ],
)
def test_a_gauge_that_cannot_be_is_refused_before_the_run(path, capsys, gauges, said):
    scene = path.with_name("refused.toml")
    scene.write_text(path.read_text().replace(str(GAUGES), gauges).replace("profiles", 'directory = "no"\nprofiles'))
    assert main(["simulate", str(scene)]) == 2
    error = capsys.readouterr().err
    assert said in error and "refused.toml" in error
    assert not path.with_name("no").exists()


def test_gauges_need_a_fluid(path, capsys):
    text = path.read_text()
    dry = text.split("[fluid]")[0] + "[[stages]]\nduration = 0.1\n[output]\ngauges = [0.1]\n"
    path.with_name("dry.toml").write_text(dry)
    assert main(["simulate", str(path.with_name("dry.toml"))]) == 2
    assert "[output] gauges measure the pressure of the fluid, and there is none" in capsys.readouterr().err


def test_the_picture_has_gradients_over_the_critical_one_and_stresses_at_four_moments(found):
    pytest.importorskip("matplotlib")
    from porefv.simulation.run_record import read_record
    from porefv.simulation.series_picture import series_picture

    series = read_series(found)
    gauges = Gauges.of(SimulationScene.from_record(read_record(found).scene), series)
    solid = np.average([1.0 - series[0][f"gauge_porosity_{k}"] for k in (1, 2, 3)], weights=np.diff(GAUGES))
    assert gauges.critical_at_start == pytest.approx(solid * WEIGHT)
    *_, pressures, gradients, total, effective, pressure = series_picture(found).axes
    assert [line.get_label() for line in pressures.lines] == [f"{place} m" for place in GAUGES]
    first, critical = gradients.lines[:2]
    assert_allclose(first.get_ydata() * gauges.critical_at_start, gauges.gradients[:, 0], equal_nan=True)
    assert_allclose(critical.get_ydata() * gauges.critical_at_start, (1.0 - series["gauge_porosity_1"]) * WEIGHT)
    profiles = read_profiles(found)
    for ax, name in ((total, "total_stress"), (effective, "effective_stress"), (pressure, "pressure")):
        assert 2 <= len(ax.lines) <= 4
        assert set(ax.lines[-1].get_xdata()) <= set(profiles[name])
