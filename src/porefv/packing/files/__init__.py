"""Packing files: one module per format, with `read(path, content, options)` and, if it can, `write(packing, path)`."""

from porefv.packing.files.detection import EXTENSIONS
from porefv.packing.files.registry import FORMATS, read_packing, write_packing

__all__ = ["EXTENSIONS", "FORMATS", "read_packing", "write_packing"]
