"""How much memory a packing will need, compared first with what machine, container and process may take."""

from __future__ import annotations

import os
from collections.abc import Iterator
from pathlib import Path

from porefv.errors import ComputationError

# Peak resident size of a flow with forces, by benchmarks/scale.py --conductance auto: 6 pores a sphere, 1 kB a pore.
BYTES_PER_SPHERE = 6_800
BYTES_PER_CELL = 1_150
_LOADED = 200 * 2**20  # Python, numpy, scipy, numba and the kernels

# Limits of the process: the place in /proc/self/statm of what counts towards each, and what libraries and each thread
# take of it besides memory that is used. They reserve addresses, a stack of 8 MiB and an arena of 64 MiB a thread:
# 680 MiB at the peak of a flow with one thread, 1750 with sixteen, of which 240 are ever touched.
_LIMITS = {"RLIMIT_AS": (0, 640 * 2**20, 72 * 2**20), "RLIMIT_DATA": (5, 64 * 2**20, 16 * 2**20)}


def required(spheres: int) -> int:
    """Bytes that a flow through so many spheres takes at its peak, forces included."""
    return _LOADED + BYTES_PER_SPHERE * spheres


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
    try:
        yield os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE")
    except (AttributeError, ValueError, OSError):
        pass


def _control_groups(root: Path) -> Iterator[int]:
    """What each group that holds the process has left, the process's own first, version 2 or 1."""
    try:
        lines = (root / "proc/self/cgroup").read_text(encoding="utf-8").splitlines()
    except (OSError, ValueError):
        return
    for line in lines:
        if line.count(":") < 2:
            continue
        _, controllers, path = line.split(":", 2)
        mount = root / "sys/fs/cgroup"
        limit, usage, idle = "memory.max", "memory.current", "inactive_file"
        if controllers:
            if "memory" not in controllers.split(","):
                continue
            mount /= "memory"
            limit, usage, idle = "memory.limit_in_bytes", "memory.usage_in_bytes", "total_inactive_file"
        # Within a container the path may be the host's, and only the mount itself be there.
        group = mount / path.lstrip("/")
        for folder in (group, *group.parents):
            try:
                # "max" is no number: no limit.
                left = int((folder / limit).read_text()) - int((folder / usage).read_text())
                stat = dict(entry.split() for entry in (folder / "memory.stat").read_text().splitlines())
                yield max(0, left + int(stat.get(idle, 0)))  # pages of files, dropped when room is short
            except (OSError, ValueError):
                pass
            if folder == mount:
                break


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


def ensure_libraries() -> None:
    """Raise a ComputationError if not even libraries can be loaded: some of them hang, or end the process."""
    have = available()
    if have is not None and have < _LOADED:
        raise ComputationError(
            f"porefv itself needs {_size(_LOADED)} of memory, {_size(have)} are free: "
            "raise the limit of the process (ulimit -v, ulimit -d), of the container or of the job, or use a machine "
            "with more"
        )


def ensure_cells(cells: int) -> None:
    """Raise a ComputationError if a triangulation of more than so many cells leaves no memory for the flow."""
    have, need = available(), BYTES_PER_CELL * cells
    if have is not None and need > have:
        raise ComputationError(
            f"these spheres make more than {cells} pores, which need {_size(need)} of memory, "
            f"{_size(have)} are free: spheres in lines or on a surface may make as many as the square of "
            "their number; use a part of the packing"
        )


def ensure(spheres: int) -> None:
    """Raise a ComputationError if the memory will not do."""
    have, need = available(), required(spheres)
    if have is not None and need > have:
        raise ComputationError(
            f"{spheres} spheres need about {_size(need)} of memory, {_size(have)} are free: "
            "use a machine with more, or a part of the packing"
        )


def _size(size: int) -> str:
    return f"{size / 2**20:.0f} MiB" if size < 2**30 else f"{size / 2**30:.1f} GiB"
