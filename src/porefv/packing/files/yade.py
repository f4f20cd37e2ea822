"""Yade text: written as Yade's ymport.textExt reads it, ``x y z r`` a line."""

from itertools import chain

from porefv.packing.files.metadata import metadata_comments
from porefv.packing.files.text import AnyPath, format_rows, write_lines
from porefv.packing.packing import Packing


def write(packing: Packing, path: AnyPath) -> None:
    """Write a file that Yade's ymport.textExt reads; it reads back here to the same numbers."""
    write_lines(path, chain(["#format x_y_z_r"], metadata_comments(packing, path), format_rows(packing, "\t")))
