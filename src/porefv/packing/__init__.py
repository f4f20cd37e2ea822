"""Packings of spheres: the spheres, their box, what they fill, where they overlap, and their files."""

from porefv.packing.box import WALLS, Box
from porefv.packing.cell import Cell
from porefv.packing.files import read_packing, write_packing
from porefv.packing.overlaps import Overlaps
from porefv.packing.packing import Packing, Source
from porefv.packing.reading import Reading

__all__ = ["WALLS", "Box", "Cell", "Overlaps", "Packing", "Reading", "Source", "read_packing", "write_packing"]
