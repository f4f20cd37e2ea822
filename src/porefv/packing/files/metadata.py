"""The box and the metadata of a packing as comments ``# key = value`` of a table."""

import re
from collections.abc import Iterable

import numpy as np

from porefv.errors import InputError
from porefv.packing.files.length_units import stated_unit
from porefv.packing.files.periodic_words import stated_axes
from porefv.packing.files.text import AnyPath, Corners, quoted
from porefv.packing.packing import Packing


def read_metadata(path: AnyPath, comments: Iterable[tuple[int, str]]) -> tuple[Corners | None, dict[str, str]]:
    """The corners of the box and the other values given by comments ``# key = value``; other comments are ignored.

    Raises
    ------
    InputError
        If ``box_lower`` or ``box_upper`` stands alone, twice, or is not three numbers.
    """
    metadata: dict[str, str] = {}
    corners: dict[str, list[float]] = {}
    for line, comment in comments:
        match = re.fullmatch(r"(\w+)\s*=\s*(.*)", comment)
        if match is None:
            continue
        key, value = match.groups()
        if key not in ("box_lower", "box_upper"):
            metadata[key] = value
            continue
        if key in corners:
            raise InputError(f"{path}, line {line}: {key} is given twice.")
        try:
            corners[key] = [float(number) for number in re.split(r"[\s,;]+", value.strip("[]() "))]
        except ValueError:
            corners[key] = []
        if len(corners[key]) != 3:
            raise InputError(f"{path}, line {line}: {key} must be three numbers x y z, not {quoted(value)}.")
    if not corners:
        return None, metadata
    if len(corners) == 1:
        missing = ({"box_lower", "box_upper"} - set(corners)).pop()
        raise InputError(f"{path}: a line '# {missing} = x y z' is missing.")
    return (np.array(corners["box_lower"]), np.array(corners["box_upper"])), metadata


def metadata_comments(packing: Packing, path: AnyPath) -> list[str]:
    """The lines that `read_metadata` reads back.

    Raises
    ------
    InputError
        If a value of the metadata would be read as a unit other than m, or as a periodic boundary.
    """
    lines = []
    if packing.walled_box is not None:
        for key, corner in (("box_lower", packing.walled_box.lower), ("box_upper", packing.walled_box.upper)):
            lines.append(f"# {key} = " + " ".join(repr(value) for value in corner.tolist()))
    values = [f"{key} = {' '.join(value.split())}" for key, value in packing.metadata.items()]
    units = [(value, unit) for value in values if (unit := stated_unit(f"{path}", value)) is not None]
    for value in [value for value in values if stated_axes(value)] + [
        value for value, unit in units if unit.clear and unit.metres != 1.0
    ]:
        raise InputError(
            f"{path}: the metadata {quoted(value)} would be read as a statement about the spheres, whose lengths are "
            "written in m, in a box with walls. Give it another key or value."
        )
    # Values that name other units say nothing of the spheres beside a statement that is clear.
    return lines + (["# units = m"] if units else []) + [f"# {value}" for value in values]
