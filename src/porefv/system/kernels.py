"""numba's `njit` and `prange`, for kernels that are kept on disk where they can be, and compiled anew where not.

numba alone gives up where no directory can be written to, or where the disk is full: a kernel that is compiled
already need not fail because it cannot be kept. Kernels of other packages are left as they are.
"""

from __future__ import annotations

import warnings
from collections.abc import Callable
from functools import cache
from typing import Any

from numba import njit, prange
from numba.core import caching, dispatcher

__all__ = ["njit", "prange"]


class _Cache(caching.FunctionCache):
    """On disk, as long as there is room."""

    def save_overload(self, sig: Any, data: Any) -> None:
        try:
            super().save_overload(sig, data)
        except OSError as error:
            self.disable()
            _warn(error.strerror or type(error).__name__)


def _cache(function: Callable) -> caching._Cache:
    """The cache of a function that numba is to compile."""
    if not function.__module__.startswith("porefv."):
        return caching.FunctionCache(function)
    try:
        return _Cache(function)
    except RuntimeError:
        _warn("no directory for them can be written to")
        return caching.NullCache()


@cache
def _warn(reason: str) -> None:
    """Once in a process: numba makes Python forget which warnings it has shown."""
    warnings.warn(
        f"compiled kernels cannot be kept ({reason}): every process compiles anew, for a minute. "
        "Name a directory with room in the variable NUMBA_CACHE_DIR",
        stacklevel=1,
    )


dispatcher.FunctionCache = _cache  # type: ignore[attr-defined]
