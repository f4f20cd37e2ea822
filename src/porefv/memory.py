"""How much memory a packing will need, compared with what the machine has before work starts."""

from __future__ import annotations

import os
from pathlib import Path

from porefv.errors import ComputationError

# Peak resident size of a flow with forces, measured by benchmarks/scale.py: about 6 pores a sphere, 0.8 kB a pore.
BYTES_PER_SPHERE = 5_500
BYTES_PER_CELL = 800
_LOADED = 200 * 2**20  # Python, numpy, scipy, numba and the kernels


def required(spheres: int) -> int:
    """Bytes that a flow through so many spheres takes at its peak, forces included."""
    return _LOADED + BYTES_PER_SPHERE * spheres


def available() -> int | None:
    """Bytes this process may still take, or None where the system does not say."""
    try:
        for line in Path("/proc/meminfo").read_text(encoding="ascii").splitlines():
            if line.startswith("MemAvailable:"):
                return 1024 * int(line.split()[1])
    except (OSError, ValueError):
        pass
    try:
        return os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE")
    except (AttributeError, ValueError, OSError):
        return None


def ensure_cells(cells: int) -> None:
    """Raise a ComputationError if a triangulation of more than so many cells leaves no memory for the flow."""
    have, need = available(), BYTES_PER_CELL * cells
    if have is not None and need > have:
        raise ComputationError(
            f"these spheres make more than {cells} pores, which need {need / 2**30:.1f} GiB of memory, "
            f"{have / 2**30:.1f} GiB are free: spheres in lines or on a surface may make as many as the square of "
            "their number; use a part of the packing"
        )


def ensure(spheres: int) -> None:
    """Raise a ComputationError if the memory will not do."""
    have, need = available(), required(spheres)
    if have is not None and need > have:
        raise ComputationError(
            f"{spheres} spheres need about {need / 2**30:.1f} GiB of memory, {have / 2**30:.1f} GiB are free: "
            "use a machine with more, or a part of the packing"
        )
