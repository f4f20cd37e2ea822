"""How many threads a computation takes, and the pool of threads to which it hands blocks of rows.

Kernels release Python's lock, so that threads of one process run them side by side. A thread that has nothing to do
sleeps: on a busy machine, or in a container with a quota, waiting takes no time from those that compute. The thread
that asks for the work takes part in it, and waits only for blocks that another thread has begun.
"""

from __future__ import annotations

import math
import os
import sys
import time
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import Future, ThreadPoolExecutor, wait
from contextlib import contextmanager, suppress
from functools import cache
from pathlib import Path
from typing import Any, TypeVar

from porefv.system.control_groups import control_groups

T = TypeVar("T")
R = TypeVar("R")

# Rows of a block at most: between two blocks Ctrl-C is looked at.
_MOST_ROWS = 1 << 16
# Blocks that each thread should get, so that one that is held up leaves the rest to the others.
_BLOCKS_EACH = 4

# Where others are waited for so long, and for half as long as this thread has worked, they have been held up: the
# processors are busy with other processes. This thread then works alone, for so many times as long, or so many seconds
# at most, for such waits to be a small part of all.
_HELD_UP = 1e-3
_ALONE = 100.0
_MOST_ALONE = 2.0

_limit: int | None = None
_alone_until = 0.0


def thread_count() -> int:
    """How many threads a computation may take.

    The least of the processors that the process may use, of the quota of its control groups (a container, a batch
    job), of the variables OMP_NUM_THREADS and NUMBA_NUM_THREADS, and of what `limit_threads` was given.
    """
    allowed = min(processors(), lasting_limit())
    return max(1, allowed if _limit is None else min(allowed, _limit))


def limit_threads(count: int | None) -> None:
    """No more than so many threads from here on; None takes the limit away."""
    global _limit
    _limit = count


@contextmanager
def limited_threads(count: int) -> Iterator[None]:
    """No more than so many threads within this block."""
    before = _limit
    limit_threads(count if before is None else min(count, before))
    try:
        yield
    finally:
        limit_threads(before)


def for_each(work: Callable[[T], R], items: Sequence[T]) -> list[R]:
    """[work(item) for item in items], by as many threads as there may be.

    An exception, of `work` or by Ctrl-C, ends it as soon as the items that were begun are done.
    """
    global _alone_until
    others = min(thread_count(), len(items)) - 1
    if others <= 0 or time.perf_counter() < _alone_until:
        return [work(item) for item in items]
    results: list[Any] = [None] * len(items)
    left = enumerate(items)  # the threads have it in common: each item is taken once
    failed = False

    def take() -> None:
        nonlocal failed
        try:
            for index, item in left:
                results[index] = work(item)
                if failed:
                    return
        except BaseException:
            failed = True
            raise

    futures: list[Future[None]] = []
    begin = done = time.perf_counter()
    try:
        futures.extend(pool().submit(take) for _ in range(others))
        take()
        done = time.perf_counter()
    finally:
        # A thread that has not begun yet is not waited for.
        begun = [future for future in futures if not future.cancel()]
        wait(begun)
    for future in begun:
        future.result()
    waited = time.perf_counter() - done
    if waited > max(_HELD_UP, 0.5 * (done - begin)):
        _alone_until = time.perf_counter() + min(_ALONE * waited, _MOST_ALONE)
    return results


def for_rows(kernel: Callable[..., None], rows: int, *arguments: Any, least: int = 1024) -> None:
    """kernel(first, last, *arguments) for ranges of rows, first ... last - 1, that are all the rows together.

    Parameters
    ----------
    kernel : callable
        Does each row by itself: results must not depend on how rows are cut.
    rows : int
    *arguments
        Of the kernel.
    least : int
        Rows of a block at least: as many as take some 0.1 ms, several times as long as handing them over.
    """
    size = max(least, min(_MOST_ROWS, math.ceil(rows / (_BLOCKS_EACH * thread_count()))))
    for_blocks(kernel, rows, size, *arguments)


def for_blocks(kernel: Callable[..., R], rows: int, size: int, *arguments: Any) -> list[R]:
    """What kernel(first, last, *arguments) returns for blocks of so many rows, in their order.

    Blocks of a fixed size have the same sums with any number of threads.
    """
    return for_each(lambda first: kernel(first, min(first + size, rows), *arguments), range(0, rows, size))


@cache
def pool() -> ThreadPoolExecutor:
    """Threads are started when they are first needed, and sleep between."""
    return ThreadPoolExecutor(os.cpu_count(), thread_name_prefix="porefv")


if hasattr(os, "register_at_fork"):
    # A child process has none of its parent's threads.
    os.register_at_fork(after_in_child=pool.cache_clear)


def processors() -> int:
    """How many the process may use."""
    try:
        return len(os.sched_getaffinity(0))
    except AttributeError:  # not Linux
        return os.cpu_count() or 1


@cache
def lasting_limit() -> int:
    """What the quota and the variables of the process allow, looked at once: it takes longer than handing work over."""
    return min(quota(), *_variables(), sys.maxsize)


def _variables() -> Iterator[int]:
    for name in ("OMP_NUM_THREADS", "NUMBA_NUM_THREADS"):
        # OpenMP allows a list, one number for each level of nesting.
        with suppress(ValueError):
            count = int(os.environ.get(name, "").split(",")[0])
            if count > 0:
                yield count


def quota(root: Path = Path("/")) -> int:
    """Processors' worth of time that the least quota of a control group grants; `sys.maxsize` without one.

    Parameters
    ----------
    root : Path
        Where /proc and /sys are.
    """
    return min((math.ceil(share) for share in _quotas(root)), default=sys.maxsize)


def _quotas(root: Path) -> Iterator[float]:
    for group in control_groups(root, "cpu"):
        with suppress(OSError, ValueError):  # no such file, or "max": no limit
            if group.version == 2:
                granted, period = (group.folder / "cpu.max").read_text().split()
            else:
                granted = (group.folder / "cpu.cfs_quota_us").read_text()
                period = (group.folder / "cpu.cfs_period_us").read_text()
            if int(granted) > 0:  # -1: no limit
                yield int(granted) / int(period)
