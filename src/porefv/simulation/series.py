"""Time series as CSV files: rows are added as the run goes on, and dropped where it is taken up again before them."""

from __future__ import annotations

import hashlib
import math
import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from porefv.errors import FORCE_OPTION, RESUME_OPTION, InputError
from porefv.system.atomic_files import atomic_write
from porefv.system.tables import TABLE_FORMATS, write_table

SERIES, PROFILES = "series.csv", "profiles.csv"
FILES = tuple(f"{stem}.{table_format}" for stem in ("series", "profiles") for table_format in TABLE_FORMATS)

_REMEDY = f"Start the run anew, with {FORCE_OPTION}"


@dataclass(frozen=True)
class SeriesMark:
    """How far a series was written at a checkpoint.

    Attributes
    ----------
    size : int
        Bytes.
    digest : str
        SHA-256 of these bytes; nothing in records of porefv 0.1, which had none.
    """

    size: int
    digest: str = ""

    def check(self, path: Path) -> bytes:
        """The bytes of the file up to here.

        Raises
        ------
        InputError
            If the file is not the one that was written.
        """
        try:
            with path.open("rb") as file:
                content = file.read(min(self.size, os.fstat(file.fileno()).st_size))
        except OSError as error:
            raise InputError(f"cannot read {path}: {error.strerror}") from None
        if len(content) < self.size:
            raise InputError(f"{path} is shorter than at its checkpoint. {_REMEDY}")
        if self.digest and hashlib.sha256(content).hexdigest() != self.digest:
            raise InputError(f"{path} is not as it was written: it is damaged, or was changed. {_REMEDY}")
        return content


class Series:
    """A CSV file of numbers that grows by rows, each handed to the system when `add` returns.

    Parameters
    ----------
    path : Path
    columns : sequence of str
    mark : SeriesMark, optional
        How much of an existing file to keep, what follows being dropped; None to begin anew.

    Raises
    ------
    InputError
        If the file cannot be written, or is not as it was at its mark.
    """

    def __init__(self, path: Path, columns: Sequence[str], mark: SeriesMark | None = None):
        self.columns = tuple(columns)
        try:
            if mark is None:
                self._file = path.open("wb")
                self._digest = hashlib.sha256()
                self._write(",".join(columns) + "\n")
            else:
                self._digest = hashlib.sha256(mark.check(path))
                os.truncate(path, mark.size)
                self._file = path.open("ab")
        except OSError as error:
            raise InputError(f"cannot write {path}: {error.strerror}") from None

    def add(self, row: Mapping[str, float]) -> None:
        """Add a row; columns that it lacks, and NaN, stay empty."""
        self._write(",".join(_cell(row.get(name, math.nan)) for name in self.columns) + "\n")

    def _write(self, line: str) -> None:
        content = line.encode()
        self._file.write(content)
        self._file.flush()
        self._digest.update(content)

    def mark(self) -> SeriesMark:
        """How far it is written; all that is outlasts a loss of power from here on."""
        os.fsync(self._file.fileno())
        return SeriesMark(os.fstat(self._file.fileno()).st_size, self._digest.hexdigest())

    def close(self) -> None:
        """Close the file."""
        self._file.close()


def _cell(value: float) -> str:
    # repr gives the shortest text that reads back to the same number.
    return str(value) if isinstance(value, int) else "" if math.isnan(value) else repr(float(value))


def read_table(path: Path) -> np.ndarray:
    """A CSV file of a run as a structured array, a field for each column; NaN where empty.

    Raises
    ------
    InputError
        If it cannot be read, or is damaged: not a table of numbers, or time goes backwards in it. A last line without
        an end is still being written, and left out.
    """
    try:
        header, *lines = path.read_text(encoding="utf-8").split("\n")[:-1]
        names = header.split(",")
        rows = [tuple(float(cell) if cell else math.nan for cell in line.split(",")) for line in lines]
        table = np.array(rows, dtype=[(name, float) for name in names])
        if "time" in names and (np.diff(table["time"]) < 0.0).any():
            raise ValueError("time goes backwards")
        return table
    except OSError as error:
        raise InputError(f"cannot read {path}: {error.strerror}") from None
    except ValueError as error:
        raise InputError(
            f"{path} is damaged after its last checkpoint: {str(error).rstrip('.')}. Go on from there with "
            f"{RESUME_OPTION}, or start the run anew"
        ) from None


def copy_tables(directory: Path, table_format: str) -> None:
    """Write the series, and the profiles if there are any, as .npy or Parquet files beside the CSV files.

    Columns are doubles, NaN where a cell of the CSV file is empty.
    """
    for path in (directory / SERIES, directory / PROFILES):
        if path.is_file():
            with atomic_write(path.with_suffix(f".{table_format}")) as temporary:
                write_table(read_table(path), temporary)
