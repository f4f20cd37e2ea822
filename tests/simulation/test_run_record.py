"""The record of a run: the state that it loads."""

import json

import pytest
from numpy.testing import assert_array_equal

from porefv import ConductanceModel, InputError, Walls
from porefv.cli.program import main
from porefv.cli.simulate import outcome_text
from porefv.coupling.coupling import Coupling
from porefv.dem.dem import DEM
from porefv.simulation.run_record import RunRecord, StageSpan, read_record
from porefv.simulation.series import SERIES, SeriesMark

MARKS = {SERIES: SeriesMark(0, "e3b0")}


def record_of(dem):
    return RunRecord({"stages": [{}]}, None, dem.box.size.tolist(), spans=[StageSpan("only", 0, 0.0)])


class Slits(ConductanceModel):
    name = "slits"

    def conductivity(self, throats, slip):
        return throats.fluid_areas * (throats.volumes / throats.wetted_surfaces(slip)) ** 2 / 3


@pytest.mark.parametrize("model", [None, Slits()])
def test_a_coupled_state_is_loaded_with_its_conductance_model(reference, tmp_path, model):
    dem = DEM(reference("n25_s1"))
    coupling = Coupling(dem, Walls.along("z"), conductance=model)
    coupling.run(3)
    record_of(dem).save(tmp_path, dem, coupling, False, MARKS, {})
    grains, again = read_record(tmp_path).load(tmp_path, coupling.conductance)
    assert again.grains is grains and again.conductance == coupling.conductance
    assert_array_equal(again.pressure, coupling.pressure)
    if model is not None:
        with pytest.raises(InputError, match="Give the model"):
            read_record(tmp_path).load(tmp_path)


def test_a_state_of_grains_alone_is_loaded(reference, tmp_path):
    dem = DEM(reference("n25_s1"))
    dem.run(3)
    record_of(dem).save(tmp_path, dem, None, False, MARKS, {})
    grains, coupling = read_record(tmp_path).load(tmp_path, Slits())
    assert coupling is None
    assert_array_equal(grains.positions, dem.positions)


# ---- records that somebody has changed --------------------------------------------------------------------------


@pytest.fixture
def changed(reference, tmp_path):
    """changed(place, value): read a record in which the value at a place (keys and numbers) is another."""
    dem = DEM(reference("n25_s1"))
    record_of(dem).save(tmp_path, dem, None, False, MARKS, {3: 0.5})
    sound = (tmp_path / "simulation.json").read_text()

    def changed(place, value):
        content = part = json.loads(sound)
        for step in place[:-1]:
            part = part[step]
        if value is GONE:
            part.pop(place[-1], None) if isinstance(part, dict) else part.pop()
        else:
            part[place[-1]] = value
        (tmp_path / "simulation.json").write_text(json.dumps(content))
        return read_record(tmp_path)

    return changed


GONE = object()
VALUES = [GONE, None, -1, 1.5, float("nan"), float("inf"), 10**400, True, "x", "../../x.npz", [], {}, [1], {"a": 1}]
PLACES = [
    ["format"], ["version"], ["porefv"], ["scene"], ["scene", "stages"], ["path"], ["box"], ["box", 0], ["status"],
    ["spans"], ["spans", 0], ["spans", 0, "name"], ["spans", 0, "begin_step"], ["spans", 0, "begin"],
    ["spans", 0, "end"], ["permeability"], ["seconds"], ["checkpoint"], ["checkpoint", "file"],
    ["checkpoint", "coupled"], ["checkpoint", "step"], ["checkpoint", "time"], ["checkpoint", "ended"],
    ["checkpoint", "series"], ["checkpoint", "series", "series.csv"], ["checkpoint", "series", "series.csv", "size"],
    ["checkpoint", "series", "series.csv", "digest"], ["checkpoint", "frames"], ["checkpoint", "frames", "3"],
    ["checkpoint", "more"], ["more"],
]  # fmt: skip


@pytest.mark.parametrize("place", PLACES, ids=lambda place: ".".join(map(str, place)))
def test_a_record_is_what_a_record_can_be_or_refused(changed, place, tmp_path, capsys):
    for value in VALUES:
        try:
            record = changed(place, value)
        except InputError as error:
            assert "simulation.json" in str(error) and len(str(error)) < 2100
        else:
            assert isinstance(outcome_text(record, tmp_path), str)
        assert main(["info", str(tmp_path)]) in (0, 2)
        assert "defect" not in capsys.readouterr().err


def test_a_checkpoint_is_of_this_directory(changed):
    with pytest.raises(InputError, match="no checkpoint is called"):
        changed(["checkpoint", "file"], "../../elsewhere/checkpoint_1.npz")


def test_a_record_of_the_first_version_is_read(reference, tmp_path):
    dem = DEM(reference("n25_s1"))
    record = record_of(dem)
    record.save(tmp_path, dem, None, False, {SERIES: SeriesMark(17, "ab")}, {})
    content = json.loads((tmp_path / "simulation.json").read_text())
    content["version"] = 1
    content["checkpoint"]["sizes"] = {"series.csv": 17}
    del content["checkpoint"]["series"]
    (tmp_path / "simulation.json").write_text(json.dumps(content))
    assert read_record(tmp_path).checkpoint.series == {SERIES: SeriesMark(17)}
