"""Locks on results: one process at a time writes a file or a directory.

The lock of `results` is a hidden file beside it, `.results.porefv-lock`, that says which process holds it. The system
locks that file for as long as the process lives, so that nothing has to be cleaned up after a kill: whoever comes next
takes the lock over. Where a file system knows no locks, or only those of its own host, the file's age decides: who
holds a lock touches its file now and then.
"""

from __future__ import annotations

import hashlib
import json
import os
import socket
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from datetime import datetime
from pathlib import Path
from typing import Any

from porefv.errors import InputError

try:
    import fcntl
except ImportError:  # not POSIX
    fcntl = None  # type: ignore[assignment]

# Seconds between two touches of the file of a lock at the least, and after how many without one its holder, on another
# host, is taken to be gone. The longest time between two touches is that of a stage: 40 s with a million spheres.
TOUCHED, GONE = 15.0, 600.0

# When each lock that this process holds was last touched, by its file.
_HELD: dict[Path, float] = {}

# Most bytes read of the file of a lock.
_MOST = 4096


@contextmanager
def lock(target: Path) -> Iterator[None]:
    """Hold the lock of a file or directory while the block runs.

    Parameters
    ----------
    target : Path
        Absolute, without links. It need not exist; missing parents are made, and removed again if they stay empty.

    Raises
    ------
    InputError
        If another process, or another thread, holds it.
    OSError
        If the file of the lock cannot be written.
    """
    path = hidden_sibling(target, "lock")
    made = [parent for parent in target.parents if not parent.exists()]
    path.parent.mkdir(parents=True, exist_ok=True)
    try:
        file = _taken(path, target)
        _HELD[path] = time.monotonic()
        try:
            yield
        finally:
            del _HELD[path]
            # Removed while it is held: who waits for this very file sees that it is not there any more.
            with suppress(OSError):
                path.unlink()
            _release(file)
    finally:
        for parent in made:
            with suppress(OSError):
                parent.rmdir()


def touch() -> None:
    """Say that the locks that this process holds are still held; called on the way through long computations."""
    now = time.monotonic()
    for path, before in list(_HELD.items()):
        if now - before > TOUCHED:
            _HELD[path] = now
            with suppress(OSError):
                os.utime(path)


def hidden_sibling(target: Path, ending: str) -> Path:
    """A hidden name beside a file or directory: `.results.porefv-lock`, say."""
    name = target.name
    if len(os.fsencode(name)) > 200:  # of the 255 bytes that a name may have
        name = f"{name[:40]}-{hashlib.sha256(os.fsencode(name)).hexdigest()[:16]}"
    return target.parent / f".{name}.porefv-{ending}"


def _taken(path: Path, target: Path) -> int:
    """Take the lock; its file, open."""
    flags = os.O_RDWR | os.O_CREAT | getattr(os, "O_NOFOLLOW", 0)
    while True:
        file = os.open(path, flags, 0o644)
        try:
            locked = _system_lock(file)
            if locked is False:
                raise _held(target, _holder_in_a_moment(file))
            if not _is_still(file, path):  # its holder has removed it meanwhile
                os.close(file)
                continue
            holder = _holder(file)
            if holder and not _is_gone(holder, locked is True) and _age(file, path.parent) < GONE:
                raise _held(target, holder)
            try:
                _describe(file, locked is True)
            except BaseException:  # the disk is full, say
                path.unlink(missing_ok=True)
                raise
            return file
        except BaseException:
            _release(file)
            raise


def _system_lock(file: int) -> bool | None:
    """Lock a file: whether that succeeded, or another has locked it; None where there are no locks of the system."""
    if fcntl is None:
        return None
    try:
        fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        return True
    except BlockingIOError:
        return False
    except OSError:
        return None


def _release(file: int) -> None:
    """Unlock a file, also where processes made by fork share it, and close it."""
    if fcntl is not None:
        with suppress(OSError):
            fcntl.flock(file, fcntl.LOCK_UN)
    with suppress(OSError):
        os.close(file)


def _is_gone(holder: dict[str, Any], locked: bool) -> bool:
    """Whether a holder is known to be gone; of other hosts that is not known."""
    if holder.get("host") != socket.gethostname():
        return False
    if locked and holder.get("locked") is True:
        return True  # had it lived, the lock of the system would not be ours
    if os.name != "posix" or not isinstance(holder.get("process"), int):
        return False
    try:
        os.kill(holder["process"], 0)
    except ProcessLookupError:
        return True
    except (OSError, OverflowError):
        return False
    return False


def _is_still(file: int, path: Path) -> bool:
    try:
        return os.path.samestat(os.fstat(file), os.stat(path, follow_symlinks=False))
    except OSError:
        return False


def _age(file: int, folder: Path) -> float:
    """Seconds since a file was touched, by the clock of its file system, which may be another host's."""
    with tempfile.TemporaryFile(dir=folder) as now:
        return os.fstat(now.fileno()).st_mtime - os.fstat(file).st_mtime


def _describe(file: int, locked: bool) -> None:
    """Write who holds the lock."""
    holder = {
        "host": socket.gethostname(),
        "process": os.getpid(),
        "since": datetime.now().astimezone().isoformat(timespec="seconds"),
        "locked": locked,
    }
    os.ftruncate(file, 0)
    os.lseek(file, 0, os.SEEK_SET)
    os.write(file, json.dumps(holder).encode())


def _holder(file: int) -> dict[str, Any]:
    """Who holds the lock, as far as its file says."""
    try:
        os.lseek(file, 0, os.SEEK_SET)
        found = json.loads(os.read(file, _MOST))
    except (OSError, ValueError, RecursionError):
        return {}
    return found if isinstance(found, dict) else {}


def _holder_in_a_moment(file: int) -> dict[str, Any]:
    """Who holds the lock, who may be about to write it."""
    for _ in range(20):
        if holder := _holder(file):
            return holder
        time.sleep(0.02)
    return {}


def _held(target: Path, holder: dict[str, Any]) -> InputError:
    who = "another process"
    if holder:
        who = f"process {holder.get('process')} on {holder.get('host')}, since {holder.get('since')}"
    return InputError(f"{target} is being written by {who}. Wait for its end, or choose another place for the results")
