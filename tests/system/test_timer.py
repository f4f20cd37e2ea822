"""The wall time of a block is added to an entry of a dictionary."""

import time

import pytest

from porefv.system.timer import Timer


def test_times_of_blocks_add_up():
    seconds = {"reading": 1.0}
    for _ in range(2):
        with Timer(seconds, "reading"), Timer(seconds, "waiting"):
            time.sleep(0.01)
    assert seconds["waiting"] >= 0.02
    assert seconds["reading"] >= 1.0 + seconds["waiting"]


def test_a_block_that_fails_is_timed():
    seconds = {}
    with pytest.raises(ZeroDivisionError), Timer(seconds, "failing"):
        time.sleep(0.01)
        1 / 0  # noqa: B018
    assert seconds["failing"] >= 0.01


def test_a_block_that_runs_shows_its_time_so_far():
    with Timer({}, "waiting") as timer:
        time.sleep(0.01)
        assert timer.elapsed >= 0.01
