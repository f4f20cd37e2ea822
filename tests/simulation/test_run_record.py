"""The record of a run: the state that it loads."""

import pytest
from numpy.testing import assert_array_equal

from porefv import ConductanceModel, InputError, Walls
from porefv.coupling.coupling import Coupling
from porefv.dem.dem import DEM
from porefv.simulation.run_record import RunRecord, StageSpan, read_record
from porefv.simulation.series import SERIES, SeriesMark

MARKS = {SERIES: SeriesMark(0)}


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
