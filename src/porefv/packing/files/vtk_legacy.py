"""Legacy VTK files (.vtk), ASCII or binary: points, point data and field data.

Read without VTK, whose own reader crashes, and Python with it, on files that were cut off. Cells are skipped
by looking for the keywords around them.
"""

import re
from collections.abc import Iterator, Mapping
from urllib.parse import unquote

import numpy as np
from numpy.typing import NDArray

from porefv.errors import InputError
from porefv.packing.files.frames import warn_no_end
from porefv.packing.files.text import AnyPath

# Binary legacy files are big-endian.
_TYPES = {
    "float": ">f4",
    "double": ">f8",
    "short": ">i2",
    "int": ">i4",
    "long": ">i8",
    "vtktypeint32": ">i4",
    "vtktypeint64": ">i8",
}
_TYPE = rf"(?P<type>{'|'.join(_TYPES)})".encode()

# An array of point data is SCALARS (one component if none are given) or, like field data, part of a FIELD.
_SCALARS = rb"^SCALARS +(?P<name>[!-~]+) +" + _TYPE + rb"(?: +(?P<components>\d{1,15}))? *\r?\nLOOKUP_TABLE .*\n"
_FIELD = rb"^(?P<name>[!-~]+) +(?P<components>\d{1,15}) +(?P<tuples>\d{1,15}) +" + _TYPE + rb" *\r?\n"


class LegacyMesh:
    """What a legacy file holds, under the names pyvista gives it.

    Parameters
    ----------
    path : path
        Named in errors.
    content : bytes

    Raises
    ------
    InputError
        If there are no points, or they are cut off.
    """

    def __init__(self, path: AnyPath, content: bytes):
        self.title = content.split(b"\n", 2)[1][:256].decode("latin-1").strip() if content.count(b"\n") else ""
        points = re.search(rb"^POINTS +(\d{1,15}) +" + _TYPE + rb" *\r?\n", content, re.MULTILINE)
        if points is None or int(points[1]) == 0:
            raise InputError(f"{path}: no points can be read from it. Is the file damaged?")
        self.n_points = int(points[1])
        self.points = _numbers(path, content, "POINTS", points, 3 * self.n_points).reshape(-1, 3)
        # Data of the points follow the cells, before or after the data of the cells.
        start = content.find(b"\nPOINT_DATA", points.end())
        start = start if start >= 0 else len(content)
        end = content.find(b"\nCELL_DATA", start)
        end = end if end >= 0 else len(content)
        self.point_data = _Arrays(path, content, start, end, self.n_points)
        self.field_data = _Arrays(path, content, 0, points.start(), self.n_points)


class _Arrays(Mapping[str, NDArray[np.float64]]):
    """Arrays whose keywords stand between two places of a file, read when asked for."""

    def __init__(self, path: AnyPath, content: bytes, start: int, end: int, n_points: int):
        self._path, self._content, self._n_points = path, content, n_points
        self._found = {
            unquote(match["name"].decode()): match  # VTK writes a blank as %20
            for pattern in (_SCALARS, _FIELD)
            for match in re.compile(pattern, re.MULTILINE).finditer(content, start, end)
        }

    def __getitem__(self, name: str) -> NDArray[np.float64]:
        match = self._found[name]
        components = int(match["components"] or 1)
        tuples = int(match.groupdict().get("tuples", self._n_points))
        values = _numbers(self._path, self._content, name, match, components * tuples)
        return values if components == 1 else values.reshape(tuples, components)

    def __iter__(self) -> Iterator[str]:
        return iter(self._found)

    def __len__(self) -> int:
        return len(self._found)


def _numbers(path: AnyPath, content: bytes, name: str, keywords: re.Match[bytes], size: int) -> NDArray[np.float64]:
    """The numbers that follow the keywords of an array."""
    if size > len(content):  # of which each takes a byte at least
        raise InputError(f"{path}: {name} is said to have {size:.3g} numbers, more than the file has bytes.")
    binary = content.split(b"\n", 3)[2].strip().upper() == b"BINARY"
    dtype = np.dtype(_TYPES[keywords["type"].decode()])
    if binary:
        # Slicing first: a size that is itself damaged must not be allocated.
        data = content[keywords.end() :][: size * dtype.itemsize]
        values = np.frombuffer(data, dtype, len(data) // dtype.itemsize).astype(np.float64)
    else:
        try:
            words = content[keywords.end() :].split(None, size)
            values = np.array(words[:size], dtype=np.float64)
        except ValueError as error:
            raise InputError(f"{path}: {name} is damaged: {error}.") from None
    if len(values) < size:
        raise InputError(f"{path}: {name} has {len(values)} numbers instead of {size}. Was the file cut off?")
    if not binary and len(words) == size and not content[-1:].isspace():
        warn_no_end(str(path))
    return values
