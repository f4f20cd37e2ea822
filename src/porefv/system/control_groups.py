"""The control groups of Linux that hold the process: a container's, a batch job's, their parents'."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple


class ControlGroup(NamedTuple):
    """A folder with the limits of a group, in the terms of version 1 or 2 of control groups."""

    version: int
    folder: Path


def control_groups(root: Path, controller: str) -> Iterator[ControlGroup]:
    """Each group that holds the process and may limit what a controller controls, the process's own first.

    Parameters
    ----------
    root : Path
        Where /proc and /sys are.
    controller : str
        'memory' or 'cpu'.
    """
    try:
        lines = (root / "proc/self/cgroup").read_text(encoding="utf-8").splitlines()
    except (OSError, ValueError):
        return
    for line in lines:
        if line.count(":") < 2:
            continue
        _, controllers, path = line.split(":", 2)
        mount, version = root / "sys/fs/cgroup", 2
        if controllers:
            if controller not in controllers.split(","):
                continue
            mount, version = mount / controller, 1
        # Within a container the path may be the host's, and only the mount itself be there.
        group = mount / path.lstrip("/")
        for folder in (group, *group.parents):
            yield ControlGroup(version, folder)
            if folder == mount:
                break
