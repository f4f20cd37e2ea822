"""Time series as CSV files: rows are added as the run goes on, and dropped where it is taken up again before them."""

from __future__ import annotations

import math
import os
from collections.abc import Mapping, Sequence
from os import PathLike
from pathlib import Path

import numpy as np

from porefv.errors import FORCE_OPTION, InputError
from porefv.system.atomic_files import atomic_write
from porefv.system.tables import TABLE_FORMATS, write_table

SERIES, PROFILES = "series.csv", "profiles.csv"
FILES = tuple(f"{stem}.{table_format}" for stem in ("series", "profiles") for table_format in TABLE_FORMATS)


class Series:
    """A CSV file of numbers that grows by rows, each on disk when `add` returns.

    Parameters
    ----------
    path : Path
    columns : sequence of str
    size : int, optional
        Bytes of an existing file to keep, what follows being dropped; None to begin anew.
    """

    def __init__(self, path: Path, columns: Sequence[str], size: int | None = None):
        self.columns = tuple(columns)
        try:
            if size is None:
                self._file = path.open("w", encoding="utf-8", newline="\n")
                self._file.write(",".join(columns) + "\n")
                self._file.flush()
            else:
                if path.stat().st_size < size:
                    raise InputError(
                        f"{path} is shorter than at its checkpoint. Start the run anew, with {FORCE_OPTION}"
                    )
                os.truncate(path, size)
                self._file = path.open("a", encoding="utf-8", newline="\n")
        except OSError as error:
            raise InputError(f"cannot write {path}: {error.strerror}") from None

    def add(self, row: Mapping[str, float]) -> None:
        """Add a row; columns that it lacks, and NaN, stay empty."""
        self._file.write(",".join(_cell(row.get(name, math.nan)) for name in self.columns) + "\n")
        self._file.flush()

    @property
    def size(self) -> int:
        """Bytes written."""
        return os.fstat(self._file.fileno()).st_size

    def close(self) -> None:
        """Close the file."""
        self._file.close()


def _cell(value: float) -> str:
    # repr gives the shortest text that reads back to the same number.
    return str(value) if isinstance(value, int) else "" if math.isnan(value) else repr(float(value))


def read_series(directory: str | PathLike[str]) -> np.ndarray:
    """series.csv of a results directory as a structured array, a field for each column; NaN where empty.

    Raises
    ------
    InputError
        If there is none, or it is damaged.
    """
    return _read(Path(directory) / SERIES)


def read_profiles(directory: str | PathLike[str]) -> np.ndarray:
    """profiles.csv, as `read_series`: a row for each layer and moment."""
    return _read(Path(directory) / PROFILES)


def _read(path: Path) -> np.ndarray:
    try:
        header, *lines = path.read_text(encoding="utf-8").splitlines()
        names = header.split(",")
        rows = [tuple(float(cell) if cell else math.nan for cell in line.split(",")) for line in lines]
        return np.array(rows, dtype=[(name, float) for name in names])
    except OSError as error:
        raise InputError(f"cannot read {path}: {error.strerror}") from None
    except ValueError as error:
        raise InputError(f"{path} is damaged: {error}") from None


def copy_tables(directory: Path, table_format: str) -> None:
    """Write the series, and the profiles if there are any, as .npy or Parquet files beside the CSV files.

    Columns are doubles, NaN where a cell of the CSV file is empty.
    """
    for path in (directory / SERIES, directory / PROFILES):
        if path.is_file():
            with atomic_write(path.with_suffix(f".{table_format}")) as temporary:
                write_table(_read(path), temporary)
