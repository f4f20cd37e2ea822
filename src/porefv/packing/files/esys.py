"""ESyS-Particle geometry (.geo): a bounding box, and ``x y z r id tag`` a line."""

from __future__ import annotations

import re

import numpy as np

from porefv.errors import InputError
from porefv.packing.files.content import FileContent, periodicity
from porefv.packing.files.frames import chosen_frame
from porefv.packing.files.options import ReadOptions
from porefv.packing.files.text import AnyPath, Corners, Rows, quoted, text_lines

_COUNT = re.compile("[0-9]{1,15}")


def read(path: AnyPath, content: bytes, options: ReadOptions) -> FileContent:
    """Read a geometry; errors name the file and the line."""
    chosen_frame(path, 1, options)
    if options.columns or options.radius is not None:
        raise InputError(f"{path}: an ESyS-Particle file has columns of its own. Drop columns and radius.")
    lines = text_lines(path, content)
    try:
        begin = next(k for k, line in enumerate(lines) if line.strip() == "BeginParticles")
    except StopIteration:
        raise InputError(f"{path}: an ESyS-Particle file needs BeginParticles. Was it cut off?") from None
    header = {words[0]: (k, words[1:]) for k, line in enumerate(lines[:begin], 1) if (words := line.split())}
    line, dimension = header.get("Dimension", (0, ["3D"]))
    if dimension != ["3D"]:
        raise InputError(f"{path}, line {line}: the dimension is {quoted(' '.join(dimension))}. Only 3D is read.")
    rows = Rows(path, lines[begin + 1 :], first=begin + 2)
    if len(rows.texts) < 2 or rows.texts[0].strip() != "Simple":
        raise InputError(f"{path}, line {begin + 2}: particles of the type Simple are expected.")
    end = next((k for k, text in enumerate(rows.texts) if text.strip() == "EndParticles"), len(rows.texts))
    number = rows.texts[1].strip()
    if not _COUNT.fullmatch(number) or int(number) != end - 2 or end == 2:
        raise InputError(
            f"{path}, line {rows.numbers[1]}: {quoted(number)} particles declared, {max(end - 2, 0)} given before "
            "EndParticles. Was the file cut off?"
        )
    del rows.texts[end:], rows.numbers[end:]
    values, numbers = rows.columns({"x": 0, "y": 1, "z": 2, "radius": 3}, 6, skip=2)
    return FileContent(
        "ESyS-Particle geometry", values[:, :3], values[:, 3], _corners(path, header), "BoundingBox", None, numbers,
        {name: name for name in ("x", "y", "z", "radius")}, periodicity=_periodicity(path, header, options),
    )  # fmt: skip


def _corners(path: AnyPath, header: dict[str, tuple[int, list[str]]]) -> Corners | None:
    if "BoundingBox" not in header:
        return None
    line, words = header["BoundingBox"]
    try:
        lower, upper = np.array(words, dtype=np.float64).reshape(2, 3)
    except ValueError:
        raise InputError(f"{path}, line {line}: BoundingBox must be followed by six numbers.") from None
    return lower, upper


def _periodicity(path: AnyPath, header: dict[str, tuple[int, list[str]]], options: ReadOptions) -> str:
    if "PeriodicBoundaries" not in header:
        return ""
    line, words = header["PeriodicBoundaries"]
    if len(words) != 3:
        raise InputError(f"{path}, line {line}: PeriodicBoundaries must be followed by three of 0 and 1.")
    axes = "".join(axis for axis, word in zip("xyz", words, strict=True) if word != "0")
    return periodicity(f"{path}, line {line}", axes, f"PeriodicBoundaries {' '.join(words)[:20]}", options)
