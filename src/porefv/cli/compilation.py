"""Whether kernels are compiled already, so that a command can say what it waits for."""

from __future__ import annotations

from pathlib import Path
from typing import Any

# numba is imported from here, where few functions are on the stack. CPython 3.11 allocates memory when calls cross a
# multiple of 16 kB of stack, and frees it when they return. A loop of numba's that happens to be there, within many
# imports of ours, does so 15 000 times, which takes 0.15 s.
import numba  # noqa: F401

from porefv.system.progress import Progress


def announce_compilation(progress: Progress, kernel: Any, time: str) -> None:
    """Say that kernels are compiled, where this one was not compiled in an earlier run; `time` is how long it takes."""
    name = f"{kernel.__module__.rpartition('.')[2]}.{kernel.__name__}"
    if not any(Path(kernel.stats.cache_path or "").glob(f"{name}-*.nbi")):
        progress.note(f"compiling for this machine, this once; it takes about {time}")


def announce_compilation_of_flow(progress: Progress) -> None:
    """The same of the kernels of a steady flow."""
    from porefv.tessellation import insertion

    announce_compilation(progress, insertion.insert, "a minute")
