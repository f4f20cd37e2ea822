"""Results directories of a steady flow: `write(flow, directory)` and `read(directory)`."""

from porefv.results.drawing import draw
from porefv.results.exporting import export
from porefv.results.quantity_tables import Sections
from porefv.results.reading import Results, read
from porefv.results.writing import QUANTITIES, write

__all__ = ["QUANTITIES", "Results", "Sections", "draw", "export", "read", "write"]
