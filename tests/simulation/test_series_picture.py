"""What pictures of simulations show besides the series: Terzaghi's solution, triaxial curves, stages, drained walls."""

import tomllib
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_allclose

from porefv.scenes.simulation_scene import SimulationScene
from porefv.simulation import simulate
from porefv.simulation.laboratory_tests import LaboratoryTests
from porefv.simulation.reading import read_profiles, read_series
from porefv.simulation.run_record import StageSpan, read_record
from porefv.simulation.stage_axis import StageAxis

pytest.importorskip("matplotlib")
SCENES = Path(__file__).parents[2] / "data" / "scenes"


def results(name, folder, duration=None, **output):
    data = tomllib.loads((SCENES / f"{name}.toml").read_text(encoding="utf-8"))
    for stage in data["stages"]:
        if duration is not None and "duration" in stage:
            stage["duration"] = duration
    data["output"] |= {"directory": str(folder / "results"), **output}
    return simulate.run(SimulationScene.from_mapping(data, directory=SCENES))


@pytest.fixture(scope="module")
def oedometer(tmp_path_factory):
    return results("oedometer", tmp_path_factory.mktemp("oedometer"))


@pytest.fixture(scope="module")
def triaxial(tmp_path_factory):
    return results("triaxial", tmp_path_factory.mktemp("triaxial"), duration=0.004)


def laboratory(directory, change=lambda scene, record: None):
    record = read_record(directory)
    change(record.scene, record)
    return LaboratoryTests(SimulationScene.from_record(record.scene), record)


def picture(directory):
    from porefv.simulation.series_picture import series_picture

    return series_picture(directory)


# ---- oedometer --------------------------------------------------------------------------------------------------


def test_terzaghi_has_the_load_the_strain_and_the_coefficient_of_the_stage(oedometer):
    series, record = read_series(oedometer), read_record(oedometer)
    (test,) = laboratory(oedometer).oedometers(series)
    before = series[series["stage"] == 1][-1]
    assert (test.stage, test.axis, test.base, test.drained) == (2, 2, 0.0, (True, True))
    assert_allclose(test.load, 10.0e3 - before["contact_stress_z_max"])
    height = 0.05 * (1.0 - before["strain_z"])
    modulus = test.load * height / (0.05 * (series[-1]["strain_z"] - before["strain_z"]))
    assert_allclose(test.coefficient, record.permeability[0].permeability * modulus / 10.0)
    assert_allclose(test.drainage, height / 2.0)
    assert_allclose(test.strain(np.array([test.begin, 1e3])), [before["strain_z"], series[-1]["strain_z"]])
    assert_allclose(test.mean_pressure(np.array([test.begin, 1e3])), [test.load, 0.0], atol=1e-9 * test.load)


def test_the_mean_of_the_profile_by_terzaghi_is_its_mean_pressure(oedometer):
    (test,) = laboratory(oedometer).oedometers(read_series(oedometer))
    depth = (np.arange(2000) + 0.5) / 2000
    for drained, drainage in (((True, True), 1.0), ((True, False), 2.0), ((False, True), 2.0)):
        other = replace(test, drained=drained, drainage=drainage * test.drainage)
        for time in test.begin + np.array([1e-3, 5e-3, 2e-2]):
            assert_allclose(other.pressure(depth, time).mean(), other.mean_pressure(time), rtol=1e-5)
    below = replace(test, drained=(True, False)).pressure(np.array([0.0, 0.5, 1.0]), test.begin + 1e-2)
    above = replace(test, drained=(False, True)).pressure(np.array([1.0, 0.5, 0.0]), test.begin + 1e-2)
    assert below[0] == pytest.approx(test.base, abs=1e-9 * test.load) and np.all(np.diff(below) > 0.0)
    assert_allclose(below, above)


def unmeasured(scene, record):
    record.permeability.clear()


def unfinished(scene, record):
    record.spans[1].end = None


def sideways(scene, record):
    scene["stages"][1]["plates"]["x_max"] = {"velocity": [-0.1, 0.0, 0.0]}


def swinging(scene, record):
    scene["walls"]["z_max"]["pressure"] = {"mean": 0.0, "amplitude": 1.0, "period": 1.0}


def through(scene, record):
    scene["walls"]["z_max"]["pressure"] = 100.0


def side_drain(scene, record):
    scene["walls"]["x_max"] = {"pressure": 0.0}


@pytest.mark.parametrize("change", [unmeasured, unfinished, sideways, swinging, through, side_drain])
def test_there_is_no_curve_where_terzaghi_has_no_solution(oedometer, change):
    assert laboratory(oedometer, change).oedometers(read_series(oedometer)) == []


def test_a_stage_that_has_not_ended_consolidated_has_no_curve(tmp_path):
    found = results("oedometer", tmp_path, duration=0.004)
    assert laboratory(found).oedometers(read_series(found)) == []
    assert not any("Terzaghi" in line.get_label() for ax in picture(found).axes for line in ax.lines)


def test_the_picture_of_an_oedometer_has_the_solution_and_the_drained_walls(oedometer):
    pressures, _, strains, profiles = picture(oedometer).axes
    (test,) = laboratory(oedometer).oedometers(read_series(oedometer))
    (mean,) = (line for line in pressures.lines if "Terzaghi" in line.get_label())
    assert_allclose(mean.get_ydata(), test.mean_pressure(mean.get_xdata()))
    (strain,) = (line for line in strains.lines if "Terzaghi" in line.get_label())
    assert_allclose(strain.get_ydata(), 100.0 * test.strain(strain.get_xdata()))
    measured = [line for line in profiles.lines if line.get_marker() == "."]
    layers = read_profiles(oedometer)
    for line in measured:
        values, places = line.get_data()
        assert (values[0], values[-1]) == (0.0, 0.0)
        assert places[0] == layers["lower"].min() and places[-1] <= layers["upper"].max()
    assert len(profiles.lines) == 2 * len(measured)


# ---- triaxial ---------------------------------------------------------------------------------------------------


def test_triaxial_curves_are_those_of_the_series(triaxial):
    series = read_series(triaxial)
    test = laboratory(triaxial).triaxial()
    assert (test.stage, test.axis) == (2, 2)
    curves, last = test.curves(series), series[-1]
    start = series[series["stage"] == 1][-1]
    by_axis = {a: 0.5 * (last[f"contact_stress_{a}_min"] + last[f"contact_stress_{a}_max"]) for a in "xyz"}
    total = [0.5 * (last[f"total_stress_{a}_min"] + last[f"total_stress_{a}_max"]) for a in "xyz"]
    assert_allclose(curves["deviator"][-1], by_axis["z"] - 0.5 * (by_axis["x"] + by_axis["y"]))
    assert_allclose(curves["effective"][-1], sum(by_axis.values()) / 3.0)
    assert_allclose(curves["total"][-1], np.mean(total))
    sides = [(1.0 - last[f"strain_{a}"]) / (1.0 - start[f"strain_{a}"]) for a in "xyz"]
    assert_allclose(curves["axial"][-1], 1.0 - sides[2])
    assert_allclose(curves["volume"][-1], 1.0 - np.prod(sides))


def test_undrained_shear_of_an_incompressible_fluid_keeps_the_volume(triaxial):
    curves = laboratory(triaxial).triaxial().curves(read_series(triaxial))
    sheared = curves["stage"] == 2
    assert np.abs(curves["volume"][sheared]).max() < 0.05 * curves["axial"][sheared].max()


def test_the_picture_of_a_triaxial_test_has_its_three_diagrams(triaxial):
    axes = picture(triaxial).axes
    assert [ax.get_ylabel().split(",")[0] for ax in axes[-3:]] == ["deviatoric stress q"] * 2 + ["volumetric strain"]
    curves = laboratory(triaxial).triaxial().curves(read_series(triaxial))
    drawn = np.concatenate([line.get_ydata() for line in axes[-3].lines])
    assert set(curves["deviator"]) <= set(drawn)


def test_stresses_alone_can_shear(triaxial):
    def pressed(scene, record):
        scene["stages"][1]["plates"]["z_max"] = {"stress": 40.0e3, "top_speed": 0.01}

    def equal(scene, record):
        scene["stages"][1]["plates"]["z_max"] = {"stress": 20.0e3, "top_speed": 0.01}

    assert laboratory(triaxial, pressed).triaxial().axis == 2
    assert laboratory(triaxial, equal).triaxial() is None


def test_an_oedometer_is_no_triaxial_test(oedometer):
    assert laboratory(oedometer).triaxial() is None


# ---- stages -----------------------------------------------------------------------------------------------------


def spans(*begins):
    return [StageSpan(f"stage {k}", 0, begin) for k, begin in enumerate(begins, 1)]


def test_a_long_dry_stage_is_folded_and_others_keep_their_time():
    axis = StageAxis.of(spans(0.0, 10.0, 11.0, 11.01), [True, False, True, False], 12.01)
    assert axis.folded.tolist() == [True, False, False, False]
    lengths = np.diff(axis.places)
    assert_allclose(lengths[1:], [1.0, 0.01, 1.0])
    assert lengths[0] < 0.2
    assert "stage 1 (dry, 10 s, folded)" in axis.names() and axis.names().count("folded") == 1


@pytest.mark.parametrize("dry", [[True, True], [False, False]])
def test_nothing_is_folded_where_all_stages_are_alike(dry):
    axis = StageAxis.of(spans(0.0, 10.0), dry, 11.0)
    assert not axis.folded.any()
    assert_allclose(axis.places, axis.ends)


def test_a_run_without_time_can_be_drawn():
    from matplotlib.figure import Figure

    ax = Figure().add_subplot()
    StageAxis.of(spans(0.0), [False], 0.0).apply(ax)
    assert ax.get_xlim()[1] > ax.get_xlim()[0]


def test_names_of_stages_do_not_lie_on_curves(triaxial):
    for ax in picture(triaxial).axes[:3]:
        assert [text.get_text() for text in ax.texts] == ["1", "2", "3"]
        assert all(text.xyann[1] > 1.0 for text in ax.texts)


def test_results_are_drawn_where_the_packing_is_gone(oedometer):
    scene = read_record(oedometer).scene
    scene["packing"]["file"] = "nowhere.csv"
    assert SimulationScene.from_record(scene).stages[1].name == "consolidation"
