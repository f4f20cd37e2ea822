"""CSV: written with the header x,y,z,radius, one sphere a line; the box and the metadata are comments."""

from itertools import chain

from porefv.packing.files.metadata import metadata_comments
from porefv.packing.files.text import AnyPath, format_rows, write_lines
from porefv.packing.packing import Packing


def write(packing: Packing, path: AnyPath) -> None:
    """Write a CSV file with the box and the metadata as comments; it reads back to the same numbers."""
    write_lines(path, chain(metadata_comments(packing, path), ["x,y,z,radius"], format_rows(packing, ",")))
