"""Packing files: one module per format, each with `read(path)` and, if it can, `write(packing, path)`."""

from porefv.packing.files.registry import EXTENSIONS, read_packing, write_packing

__all__ = ["EXTENSIONS", "read_packing", "write_packing"]
