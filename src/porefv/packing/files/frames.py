"""Which frame of a file with several is read."""

from __future__ import annotations

import warnings

from porefv.errors import InputError, PackingFileWarning
from porefv.packing.files.options import ReadOptions
from porefv.packing.files.text import AnyPath


def chosen_frame(path: AnyPath, frames: int, options: ReadOptions) -> int:
    """The position of the frame to read among those of a file, counted from 0."""
    if frames == 0:
        raise InputError(f"{path}: the file has no frame.")
    if options.frame is None:
        return frames - 1
    if not -frames <= options.frame < frames:
        which = "one frame, 0" if frames == 1 else f"{frames} frames, 0 to {frames - 1} (-1 is the last)"
        raise InputError(f"{path}: frame {options.frame} is asked for, and the file has {which}.")
    return options.frame % frames


def warn_no_end(place: str) -> str:
    """Warn that the last number of a file that is read has no end of line after it; the note about it."""
    note = "the last line has no line end: if the file was cut off, its last number may have lost digits"
    warnings.warn(
        f"{place}: {note}. Compare it with its source, and end the line if it is whole.",
        PackingFileWarning,
        stacklevel=3,
    )
    return note


def warn_cut_off(place: str, whole: int) -> str:
    """Warn that the last frame of a file is not whole; the note about it."""
    note = (
        f"the last frame is cut off, and the {whole} whole before it are kept"
        if whole > 1
        else ("the last frame is cut off, and the whole one before it is kept")
    )
    warnings.warn(f"{place}: {note}.", PackingFileWarning, stacklevel=3)
    return note
