"""The time series of a results directory read back."""

from __future__ import annotations

from os import PathLike
from pathlib import Path

import numpy as np

from porefv.errors import InputError
from porefv.simulation.run_record import STARTING, RunRecord, read_record
from porefv.simulation.series import PROFILES, SERIES, read_table


def read_series(directory: str | PathLike[str]) -> np.ndarray:
    """series.csv of a results directory as a structured array, a field for each column; NaN where empty.

    Raises
    ------
    InputError
        If there is none, or it is damaged: up to the last checkpoint it must be what was written, to the byte.
    """
    return _read(Path(directory), SERIES)


def read_profiles(directory: str | PathLike[str]) -> np.ndarray:
    """profiles.csv, as `read_series`: a row for each layer and moment."""
    return _read(Path(directory), PROFILES)


def check_series(record: RunRecord, directory: Path) -> None:
    """InputError if the series of a directory are not what was written up to the last checkpoint."""
    point = record.checkpoint
    for name, mark in point.series.items() if point is not None else ():
        content = mark.check(directory / name)
        if record.status == "complete" and (directory / name).stat().st_size > len(content):
            raise InputError(f"{directory / name} has grown since the run was complete: something else writes there")


def _read(directory: Path, name: str) -> np.ndarray:
    record = read_record(directory)
    if record.status == STARTING:
        raise InputError(f"{directory} has no {name} yet: its run has only begun")
    check_series(record, directory)
    return read_table(directory / name)
