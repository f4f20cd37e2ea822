"""How much memory the process may still take: the least of what machine, container and limits of the process leave."""

from __future__ import annotations

import os
import sys
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path

from porefv.errors import ComputationError
from porefv.system.control_groups import control_groups

LOADED = 200 * 2**20  # B: Python, numpy, scipy, numba and the kernels

# Limits of the process: the place in /proc/self/statm of what counts towards each, and what libraries and each thread
# take of it besides memory that is used. They reserve addresses, a stack of 8 MiB and an arena of 64 MiB a thread:
# 680 MiB at the peak of a flow with one thread, 1750 with sixteen, of which 240 are ever touched.
_LIMITS = {"RLIMIT_AS": (0, 640 * 2**20, 72 * 2**20), "RLIMIT_DATA": (5, 64 * 2**20, 16 * 2**20)}


def available(root: Path = Path("/")) -> int | None:
    """Bytes this process may still take, or None where the system does not say.

    The least of what the machine has, of what each control group around the process (a container, a batch job)
    has left, and of what the process has left of its limits (ulimit -v, ulimit -d).

    Parameters
    ----------
    root : Path
        Where /proc and /sys are.
    """
    return min((*_machine(root), *_control_groups(root), *_process(root)), default=None)


def _machine(root: Path) -> Iterator[int]:
    try:
        for line in (root / "proc/meminfo").read_text(encoding="ascii").splitlines():
            if line.startswith("MemAvailable:"):
                yield 1024 * int(line.split()[1])
                return
    except (OSError, ValueError):
        pass
    with suppress(AttributeError, ValueError, OSError):  # not POSIX
        yield os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE")


def _control_groups(root: Path) -> Iterator[int]:
    """What each group that holds the process has left."""
    for group in control_groups(root, "memory"):
        limit, usage, idle = "memory.max", "memory.current", "inactive_file"
        if group.version == 1:
            limit, usage, idle = "memory.limit_in_bytes", "memory.usage_in_bytes", "total_inactive_file"
        with suppress(OSError, ValueError):
            # "max" is no number: no limit.
            left = int((group.folder / limit).read_text()) - int((group.folder / usage).read_text())
            stat = dict(entry.split() for entry in (group.folder / "memory.stat").read_text().splitlines())
            yield max(0, left + int(stat.get(idle, 0)))  # pages of files, dropped when room is short


def _process(root: Path) -> Iterator[int]:
    try:
        import resource

        used = [int(pages) * resource.getpagesize() for pages in (root / "proc/self/statm").read_text().split()]
        threads = len(os.sched_getaffinity(0))
    except (ImportError, AttributeError, OSError, ValueError):  # not Linux
        return
    for name, (place, libraries, each) in _LIMITS.items():
        limit, _ = resource.getrlimit(getattr(resource, name))
        if limit != resource.RLIM_INFINITY:
            yield max(0, limit - max(used[place], libraries + each * threads))


def resident() -> int | None:
    """Bytes of memory that this process has in use now, or the most so far; None where the system does not say."""
    try:
        pages = int(Path("/proc/self/statm").read_text(encoding="ascii").split()[1])
        return pages * os.sysconf("SC_PAGE_SIZE")
    except (OSError, ValueError, AttributeError):
        return peak_resident()


def peak_resident() -> int | None:
    """The most bytes of memory that this process has had in use so far; None where the system does not say."""
    try:
        import resource
    except ImportError:  # not POSIX
        return None
    unit = 1 if sys.platform == "darwin" else 1024
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * unit


def ensure_libraries() -> None:
    """Raise a ComputationError if not even libraries can be loaded: some of them hang, or end the process."""
    have = available()
    if have is not None and have < LOADED:
        raise ComputationError(
            f"porefv itself needs {size_text(LOADED)} of memory, {size_text(have)} are free: "
            "raise the limit of the process (ulimit -v, ulimit -d), of the container or of the job, or use a machine "
            "with more"
        )


def size_text(size: int) -> str:
    """A number of bytes as shown in an error: ``512 MiB``, ``1.5 GiB``."""
    return f"{size / 2**20:.0f} MiB" if size < 2**30 else f"{size / 2**30:.1f} GiB"
