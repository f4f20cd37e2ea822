"""numba's `njit` and `prange`, for kernels that are kept on disk where they can be, and compiled anew where not.

numba alone gives up where no directory can be written to, or where the disk is full: a kernel that is compiled
already need not fail because it cannot be kept. Only the cache of a kernel of this package is another one than
numba's own; nothing of numba itself is changed.
"""

from __future__ import annotations

import warnings
from collections.abc import Callable
from functools import cache
from typing import Any

import numba
from numba import prange
from numba.core import caching

from porefv.errors import CompilationWarning

__all__ = ["njit", "prange"]


def njit(*, cache: bool = False, **options: Any) -> Callable[[Callable[..., Any]], Any]:
    """`numba.njit` with the same options; with `cache` compiled kernels are kept on disk as long as there is room."""

    def decorate(function: Callable[..., Any]) -> Any:
        kernel = numba.njit(**options)(function)
        if cache and kernel is not function:  # as it is where compiling is disabled
            kernel._cache = _cache_of(function)  # what numba's own option sets, to its own kind of cache
        return kernel

    return decorate


class _Cache(caching.FunctionCache):
    """On disk, as long as there is room."""

    def save_overload(self, sig: Any, data: Any) -> None:
        try:
            super().save_overload(sig, data)
        except OSError as error:
            self.disable()
            _warn(error.strerror or type(error).__name__)


def _cache_of(function: Callable[..., Any]) -> caching._Cache:
    """The cache of a function that numba is to compile."""
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
        CompilationWarning,
        stacklevel=1,
    )
