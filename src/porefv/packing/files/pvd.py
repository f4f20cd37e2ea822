"""ParaView's list of frames (.pvd), such as the ``grains.pvd`` of `porefv.export.Trajectory`: one frame is read."""

from __future__ import annotations

import re
from collections.abc import Iterable
from dataclasses import replace
from pathlib import Path
from xml.etree import ElementTree

from porefv.errors import InputError
from porefv.packing.files import vtk
from porefv.packing.files.content import FileContent
from porefv.packing.files.frames import chosen_frame, warn_cut_off
from porefv.packing.files.options import ReadOptions
from porefv.packing.files.text import AnyPath, quoted, read_bytes


def read(path: AnyPath, content: bytes, options: ReadOptions) -> FileContent:
    """Read the VTK file of a frame; errors name the list and that file."""
    notes: tuple[str, ...] = ()
    try:
        whole = b"</VTKFile>" in content
        entries = [entry.attrib for entry in _entries(content, whole)]
        times = sorted((float(entry.get("timestep", "0")), entry["file"]) for entry in entries)
    except (ElementTree.ParseError, KeyError, ValueError, LookupError) as error:
        raise InputError(f"{path}: not a list of frames of ParaView, or damaged ({error}).") from None
    if not times:
        raise InputError(f"{path}: the list has no frames.{'' if whole else ' Was it cut off?'}")
    if not whole:
        last = content.count(b"\n") + 1
        notes = (warn_cut_off(f"{path}, line {last}", len(times)),)
    if len({time for time, _ in times}) < len(times):
        raise InputError(f"{path}: the list has several files of the same time. Read one of these files instead.")
    chosen = chosen_frame(path, len(times), options)
    try:
        found = _frame(path, times, chosen, options)
        return replace(found, notes=(*found.notes, *notes))
    except InputError:
        # A program that still writes, or was stopped, leaves the last file of the list cut off.
        if options.frame is not None or chosen == 0 or not (Path(path).parent / times[chosen][1]).is_file():
            raise
        try:
            found = _frame(path, times, chosen - 1, options)
        except InputError:
            found = None
        if found is None:
            raise
    note = warn_cut_off(f"{path}: {quoted(times[chosen][1])}", chosen)
    return replace(found, frames=chosen, notes=(*found.notes, *notes, note))


def _entries(content: bytes, whole: bool) -> Iterable[ElementTree.Element]:
    """The entries of a list; of one that is cut off, those before its end."""
    if whole:
        return ElementTree.fromstring(content).iter("DataSet")
    return [ElementTree.fromstring(entry) for entry in re.findall(rb"<DataSet\b[^<>]*/>", content)]


def _frame(path: AnyPath, times: list[tuple[float, str]], chosen: int, options: ReadOptions) -> FileContent:
    file = Path(path).parent / times[chosen][1]
    if file.suffix.lower() not in (".vtp", ".vtu", ".vtk"):
        raise InputError(f"{path}: its frame {quoted(times[chosen][1])} is no .vtp, .vtu or .vtk file.")
    try:
        found = vtk.read(file, read_bytes(file), replace(options, frame=None))
    except InputError as error:
        raise InputError(f"{path}: its frame {chosen} cannot be read: {error}") from None
    return replace(found, format=f"{found.format} in a .pvd list", frame=chosen, frames=len(times))
