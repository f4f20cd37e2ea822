"""What the text formats share: lines of a file, columns of numbers, cells and the box."""

import csv
import re
import zlib
from collections.abc import Iterable, Sequence
from os import PathLike
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike, NDArray

from porefv.errors import InputError
from porefv.packing.box import Box
from porefv.packing.packing import Packing
from porefv.system.atomic_files import atomic_write

AnyPath = str | PathLike[str]
Corners = tuple[NDArray[np.float64], NDArray[np.float64]]

_MOST_QUOTED = 40  # characters of a file shown in an error
_MOST_PER_BYTE = 200  # bytes of a decompressed file for each byte of the compressed one: text of numbers has 2 to 30


def text_lines(path: AnyPath, content: bytes) -> list[str]:
    """The lines of UTF-8 text, without their ends (of any system) and without a byte-order mark.

    Raises
    ------
    InputError
        If the content of the file is not text.
    """
    if b"\0" in content:
        raise InputError(f"{path}: not text (it holds zero bytes). Is it binary, compressed, or UTF-16?")
    try:
        text = content.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        line = content.count(b"\n", 0, error.start) + 1
        raise InputError(f"{path}, line {line}: not UTF-8 text. Save it as UTF-8.") from None
    return text.replace("\r\n", "\n").replace("\r", "\n").split("\n")


class CutOffError(InputError):
    """A gzip file that is cut off.

    Parameters
    ----------
    message : str
    beginning : bytes
        What can be decompressed.
    """

    def __init__(self, message: str, beginning: bytes):
        super().__init__(message)
        self.beginning = beginning


def read_bytes(path: AnyPath) -> bytes:
    """The content of a file, decompressed if it is a gzip file; InputError if there is none, or it is cut off."""
    file = Path(path)
    try:
        if file.is_dir():
            raise InputError(f"{path}: is a directory, not a packing file.")
        if file.exists() and not file.is_file():
            raise InputError(f"{path}: is not a regular file.")
        content = file.read_bytes()
    except InputError:
        raise
    except FileNotFoundError:
        raise InputError(f"{path}: there is no such file (looked for {file.absolute()}).") from None
    except (OSError, ValueError) as error:
        raise InputError(f"{path}: cannot be read: {getattr(error, 'strerror', None) or error}.") from None
    if content.startswith(b"\x1f\x8b"):
        content = _decompressed(path, content)
    if not content.strip():
        raise InputError(f"{path}: the file is empty.")
    return content


def _decompressed(path: AnyPath, content: bytes) -> bytes:
    """The content of a gzip file of one or several members."""
    most = _MOST_PER_BYTE * len(content)
    parts: list[bytes] = []
    try:
        while content.strip(b"\0"):
            stream = zlib.decompressobj(wbits=31)
            parts.append(stream.decompress(content, most + 1))
            most -= len(parts[-1])
            if most < 0:
                raise InputError(
                    f"{path}: the file is compressed to less than 1/{_MOST_PER_BYTE} of its size. Decompress it first."
                )
            if not stream.eof:
                raise CutOffError(f"{path}: the gzip file is cut off. Make or fetch it again.", b"".join(parts))
            content = stream.unused_data
    except zlib.error as error:
        raise InputError(f"{path}: the gzip file is damaged ({error}). Make or fetch it again.") from None
    return b"".join(parts)


class Rows:
    """The rows of a file that hold data, and where they stand.

    Parameters
    ----------
    path : path
    lines : sequence of str
        Consecutive lines of the file; blank lines and lines that start with #, after blanks or not, are set aside.
    first : int
        Number of the first of these lines in the file, counted from 1.
    """

    def __init__(self, path: AnyPath, lines: Sequence[str], first: int = 1):
        self.path = path
        self.texts: list[str] = []
        self.numbers: list[int] = []
        self.comments: list[tuple[int, str]] = []
        for number, line in enumerate(lines, first):
            if line.lstrip().startswith("#"):
                self.comments.append((number, line.lstrip()[1:].strip()))
            elif line and not line.isspace():
                self.texts.append(line)
                self.numbers.append(number)

    def columns(
        self, columns: dict[str, int], cells: int, delimiter: str | None = None, skip: int = 0
    ) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
        """Numbers in some columns of the rows.

        Parameters
        ----------
        columns : dict
            Name and position of each column wanted.
        cells : int
            Number of cells every row must have.
        delimiter : str, optional
            Default: any white space.
        skip : int
            Rows to leave out at the start.

        Returns
        -------
        values : (n, number of columns) array
        lines : (n,) array
            Number of the line of each row.

        Raises
        ------
        InputError
            Names the first line that has another number of cells, or a cell that is not a number.
        """
        texts, numbers = self.texts[skip:], self.numbers[skip:]
        if not texts:
            raise InputError(f"{self.path}: there are no spheres after line {self.numbers[-1]}.")
        wanted = list(columns.values())
        lines = np.array(numbers)
        if all(_number_of_cells(text, delimiter) == cells for text in texts):
            try:
                fast = np.loadtxt(texts, delimiter=delimiter, usecols=wanted, comments=None, quotechar='"', ndmin=2)
                return fast, lines
            except ValueError:
                pass  # some cell is not a number: find out which
        values = np.empty((len(texts), len(columns)))
        for row, (text, number) in enumerate(zip(texts, numbers, strict=True)):
            found = split(text, delimiter)
            if len(found) != cells:
                raise InputError(f"{self.path}, line {number}: {len(found)} cells instead of {cells}: {quoted(text)}.")
            for column, (name, position) in enumerate(columns.items()):
                values[row, column] = self._number(found[position], name, number)
        return values, lines

    def _number(self, cell: str, name: str, line: int) -> float:
        try:
            if "_" in cell:  # Python's digit grouping, not a number in a file
                raise ValueError
            return float(cell)
        except ValueError:
            if not cell.strip():
                raise InputError(f"{self.path}, line {line}: the cell of '{name}' is empty.") from None
            hint = " Write decimals with a point." if "," in cell else ""
            if re.fullmatch(r"\s*[+-]?[0-9.]+[dD][+-]?[0-9]+\s*", cell):
                hint = " Write exponents with E instead of D."
            raise InputError(f"{self.path}, line {line}: {name} is {quoted(cell)}, not a number.{hint}") from None


def split(text: str, delimiter: str | None) -> list[str]:
    """The cells of a row; a delimiter inside double quotes does not count."""
    if delimiter is None:
        return text.split()
    try:
        return next(csv.reader([text], delimiter=delimiter, skipinitialspace=True))
    except csv.Error:  # a cell longer than any number
        return text.split(delimiter)


def _number_of_cells(text: str, delimiter: str | None) -> int:
    # Counting characters is fast. It is wrong only where delimiters are quoted; `split` then corrects it.
    return len(text.split()) if delimiter is None else text.count(delimiter) + 1


def quoted(text: str) -> str:
    """Text of a file as shown in an error: one short printable line."""
    return repr(text if len(text) <= _MOST_QUOTED else text[: _MOST_QUOTED - 3] + "...")


def make_box(path: AnyPath, lower: ArrayLike, upper: ArrayLike) -> Box:
    """The box given in a file; InputError names the file."""
    try:
        return Box(np.array(lower), np.array(upper))
    except InputError as error:
        raise InputError(f"{path}: {error}") from None


def format_rows(packing: Packing, delimiter: str) -> Iterable[str]:
    """One line x, y, z, radius per sphere, with digits enough to read back the same numbers."""
    for x, y, z, r in np.column_stack((packing.centres, packing.radii)).tolist():
        yield f"{x!r}{delimiter}{y!r}{delimiter}{z!r}{delimiter}{r!r}"


def write_lines(path: AnyPath, lines: Iterable[str]) -> None:
    """Write a UTF-8 text file, all of it or nothing."""
    with atomic_write(path) as temporary, temporary.open("w", encoding="utf-8", newline="\n") as file:
        file.writelines(f"{line}\n" for line in lines)
