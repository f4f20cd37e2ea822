"""Tables as binary files: a structured array as a .npy or a Parquet file, a column for each field."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from porefv.errors import InputError
from porefv.system.optional_imports import ensure_installed

# Extensions of tables. CSV files are written by the modules that know what an empty cell of theirs means.
TABLE_FORMATS = ("csv", "npy", "parquet")


def check_table_format(table_format: str, stem: str) -> None:
    """Refuse, before anything is computed, a format in which a table cannot be written.

    Parameters
    ----------
    table_format : str
    stem : str
        Name of the file without its extension, for the message.

    Raises
    ------
    InputError
        If the format is unknown.
    MissingExtraError
        If it needs pyarrow, which is not installed.
    """
    if table_format not in TABLE_FORMATS:
        raise InputError(f"unknown table_format {table_format!r}; known: {', '.join(TABLE_FORMATS)}")
    if table_format == "parquet":
        ensure_installed("pyarrow", "pyarrow", f"Writing {stem}.parquet")


def write_table(table: np.ndarray, path: Path) -> None:
    """Write a structured array (rows,) of numbers and texts, as the extension .npy or .parquet says."""
    if path.suffix == ".npy":
        np.save(path, table, allow_pickle=False)
        return
    import pyarrow
    from pyarrow import parquet

    columns = {name: table[name] for name in table.dtype.names or ()}
    # Measured numbers hardly repeat: dictionaries of them double the time, and the files are no smaller.
    parquet.write_table(pyarrow.table(columns), path, use_dictionary=False)


def read_table(path: Path) -> np.ndarray:
    """The array of a .npy or Parquet file; any array, if the file is not one that `write_table` has written.

    Raises
    ------
    MissingExtraError
        If pyarrow is needed, and not installed.
    OSError, ValueError
        If the file cannot be read, or is damaged.
    """
    if path.suffix == ".npy":
        with path.open("rb") as file:
            try:
                return np.lib.format.read_array(file, allow_pickle=False)
            except Exception as error:  # the header is Python text, and its parser raises errors of many kinds
                raise ValueError(f"{type(error).__name__}: {error}") from None
    ensure_installed("pyarrow", "pyarrow", f"Reading {path.name}")
    import pyarrow
    from pyarrow import parquet

    try:
        found = parquet.read_table(path)
        columns = {name: found[name].to_numpy() for name in found.column_names}
    except (pyarrow.ArrowException, KeyError) as error:
        raise ValueError(str(error)) from None
    columns = {name: values.astype(str) if values.dtype == object else values for name, values in columns.items()}
    table = np.empty(found.num_rows, dtype=[(name, values.dtype) for name, values in columns.items()])
    for name, values in columns.items():
        table[name] = values
    return table
