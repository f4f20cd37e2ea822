"""How much memory the flow through a packing needs, compared with what is free before the work begins."""

from __future__ import annotations

from porefv.errors import ComputationError
from porefv.system.memory import LOADED, available, size_text

# Peak resident size of a flow with forces, by benchmarks/scale.py --conductance auto: 6 pores a sphere, 1 kB a pore.
BYTES_PER_SPHERE = 6_800
BYTES_PER_CELL = 1_150


def required(spheres: int) -> int:
    """Bytes that a flow through so many spheres takes at its peak, forces included."""
    return LOADED + BYTES_PER_SPHERE * spheres


def ensure_room_for_spheres(spheres: int) -> None:
    """Raise a ComputationError if a flow through so many spheres needs more memory than is free."""
    have, need = available(), required(spheres)
    if have is not None and need > have:
        raise ComputationError(
            f"{spheres} spheres need about {size_text(need)} of memory, {size_text(have)} are free: "
            "use a machine with more, or a part of the packing"
        )


def ensure_room_for_cells(cells: int) -> None:
    """Raise a ComputationError if a triangulation of more than so many cells leaves no memory for the flow."""
    have, need = available(), BYTES_PER_CELL * cells
    if have is not None and need > have:
        raise ComputationError(
            f"these spheres make more than {cells} pores, which need {size_text(need)} of memory, "
            f"{size_text(have)} are free: spheres in lines or on a surface may make as many as the square of "
            "their number; use a part of the packing"
        )
