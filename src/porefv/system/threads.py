"""How many threads a computation takes."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import AbstractContextManager, contextmanager

from numba import get_num_threads, set_num_threads

# Up to so many unknowns threads gain less than waiting for each other costs; on a busy machine it costs most of all.
_ALONE = 30_000


def limit_threads(count: int | None) -> None:
    """No more than so many threads from here on, if a number is given."""
    if count:
        set_num_threads(min(count, get_num_threads()))


def threads_for(unknowns: int) -> AbstractContextManager[None]:
    """As many threads in this block as pay for so many unknowns."""
    return threads(1 if unknowns <= _ALONE else get_num_threads())


@contextmanager
def threads(count: int) -> Iterator[None]:
    """No more than so many threads in this block."""
    before = get_num_threads()
    set_num_threads(min(count, before))
    try:
        yield
    finally:
        set_num_threads(before)
