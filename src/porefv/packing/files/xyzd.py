"""Baranau's packing-generation: .xyzd, little-endian doubles ``x y z diameter``, and a .nfo beside it with the box.

The program packs spheres in a periodic box, which its files do not state. It writes the diameters that it started
from; those of the packing follow from the porosities in the .nfo file.
"""

from __future__ import annotations

import re
import warnings
from pathlib import Path

import numpy as np

from porefv.errors import InputError, PackingFileWarning
from porefv.packing.files.content import FileContent
from porefv.packing.files.frames import chosen_frame
from porefv.packing.files.options import ReadOptions
from porefv.packing.files.text import AnyPath, Corners, quoted, read_bytes, text_lines

_BYTES = 32  # of a sphere


def read(path: AnyPath, content: bytes, options: ReadOptions) -> FileContent:
    """Read spheres and, if there is a .nfo file of the same name, the box; errors name the file."""
    chosen_frame(path, 1, options)
    if options.columns or options.radius is not None:
        raise InputError(f"{path}: an .xyzd file has columns of its own. Drop columns and radius.")
    if len(content) % _BYTES:
        raise InputError(f"{path}: {len(content)} bytes are no multiple of the {_BYTES} of a sphere. Was it cut off?")
    if content.isascii():  # as no file of doubles is
        raise InputError(f"{path}: text, and an .xyzd file holds binary numbers. Give the format of the file.")
    values = np.frombuffer(content, "<f8").reshape(-1, 4)
    nfo = (
        Path(path).with_suffix("").with_suffix(".nfo") if str(path).endswith(".gz") else Path(path).with_suffix(".nfo")
    )
    corners, growth = _nfo(path, nfo, len(values)) if nfo.is_file() else (None, 1.0)
    notes = (f"diameters multiplied by {growth:.9g}, by the final porosity in {nfo.name}",) if growth != 1.0 else ()
    with np.errstate(over="ignore"):  # what is not finite is refused later
        radii = values[:, 3] * (growth / 2)
    note = "packing-generation makes periodic packings: the box has walls, and flow near them is not the bulk's"
    if options.periodic == "cell":
        note = "packing-generation makes periodic packings: read into a periodic cell"
    elif options.periodic is None:
        warnings.warn(f'{path}: {note}. Give periodic = "ignore" to accept this.', PackingFileWarning, stacklevel=2)
    return FileContent(
        "packing-generation .xyzd", values[:, :3], radii, corners, f"Dimensions in {nfo.name}",
        columns={"x": "x", "y": "y", "z": "z", "radius": "diameter (halved)"}, periodicity=note, notes=notes,
    )  # fmt: skip


def _nfo(path: AnyPath, nfo: Path, spheres: int) -> tuple[Corners | None, float]:
    """Corners of the box, from the origin, and the factor from the diameters in the file to those of the packing."""
    try:
        lines = text_lines(nfo, read_bytes(nfo))
    except InputError as error:
        raise InputError(f"{path}: the file beside it cannot be read: {error}") from None
    found = {
        match[1].lower(): (line, match[2].strip())
        for line, text in enumerate(lines, 1)
        if (match := re.match(r"([^:]+?)\s*:\s*(.*)", text))
    }
    if "n" in found and found["n"][1] != str(spheres):
        line, number = found["n"]
        raise InputError(f"{path}: it has {spheres} spheres, and {nfo}, line {line}, says {quoted(number)}.")
    keys = {"dimensions": 3, "theoretical porosity": 1, "final porosity": 1}
    numbers = {key: _numbers(path, nfo, *found[key], count) for key, count in keys.items() if key in found}
    growth = 1.0
    if len(numbers.keys() - {"dimensions"}) == 2:
        theoretical, final = (float(numbers[key][0]) for key in ("theoretical porosity", "final porosity"))
        if not (theoretical < 1 and final < 1):
            raise InputError(f"{path}: {nfo} states porosities {theoretical:g} and {final:g}, not below 1.")
        growth = ((1 - final) / (1 - theoretical)) ** (1 / 3)
    return (np.zeros(3), numbers["dimensions"]) if "dimensions" in numbers else None, growth


def _numbers(path: AnyPath, nfo: Path, line: int, text: str, count: int) -> np.ndarray:
    try:
        return np.array(text.split(), dtype=np.float64).reshape(count)
    except ValueError:
        raise InputError(f"{path}: {nfo}, line {line}: {count} numbers are expected, not {quoted(text)}.") from None
