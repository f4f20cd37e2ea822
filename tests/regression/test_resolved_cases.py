"""Regression: errors of the models on resolved cases are what they were when they were recorded (record.py).

These values are those of this version. They tell that nothing has changed without intention, not that it is right.
"""

import importlib.util
import json
from pathlib import Path

import pytest

SPECIFICATION = importlib.util.spec_from_file_location("record", Path(__file__).with_name("record.py"))
record = importlib.util.module_from_spec(SPECIFICATION)
SPECIFICATION.loader.exec_module(record)
RECORDED = json.loads(record.RECORD.read_text(encoding="utf-8"))


@pytest.mark.parametrize("name", sorted(RECORDED))
def test_errors_are_as_recorded(name):
    for model, (permeability, forces) in record.errors(name).items():
        assert permeability == pytest.approx(RECORDED[name][model][0], abs=2e-5)
        assert forces == pytest.approx(RECORDED[name][model][1], abs=2e-5)


def test_every_resolved_case_is_recorded():
    assert set(RECORDED) == {path.stem for path in record.STOKES.glob("*.json")}


def test_where_the_papers_model_is_closer():
    # In one of 101 small samples.
    closer = [
        name for name, found in RECORDED.items()
        if abs(found["hydraulic-radius"][0]) <= abs(found["section-friction"][0])
    ]  # fmt: skip
    assert closer == ["press_n18_r8_s25_no_slip"]
