"""Whether kernels are compiled already, so that a command can say what it waits for."""

from __future__ import annotations

from pathlib import Path
from typing import Any

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
