"""Decorators of the functions that numba compiles: kernels, which Python calls, and their helpers.

A kernel is kept on disk once it is compiled, and many are compiled already when the package is built
(`porefv.system.kernel_files`). It releases Python's lock while it runs, so that threads run kernels side by side
(`porefv.system.threads`). Arrays and named tuples of arrays come in; results are filled into arrays that come in,
or are numbers.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numba
import numpy as np

from porefv.system.kernel_files import KernelFiles

__all__ = ["all_kernels", "helper", "kernel", "read_only", "unsigned_range"]

_kernels: dict[str, Any] = {}
_njit: Any = numba.njit  # which has more options than it says


def kernel(function: Callable[..., Any] | None = None, *, allocates: bool = True, **options: Any) -> Any:
    """`numba.njit` for a function that Python calls, kept on disk. `options` are numba's, as of `helper`.

    Parameters
    ----------
    function : callable
    allocates : bool
        Whether it makes arrays. References to arrays are not counted in a kernel that makes none: in a loop whose
        steps are helpers, counting may take longer than they do.
    **options

    Examples
    --------
    >>> import numpy as np
    >>> @kernel(error_model="numpy")
    ... def invert(first, last, values, inverses):
    ...     for i in range(first, last):
    ...         inverses[i] = 1.0 / values[i]
    >>> found = np.empty(2)
    >>> invert(0, 2, np.array([2.0, 0.5]), found)
    >>> found
    array([0.5, 2. ])
    """
    if function is None:
        return lambda function: kernel(function, allocates=allocates, **options)
    if not allocates:
        options["_nrt"] = False
    # Nobody calls it by way of ctypes: one wrapper less to compile.
    compiled = _njit(nogil=True, no_cfunc_wrapper=True, **options)(function)
    if compiled is not function:  # as it is where compiling is disabled
        compiled._cache = KernelFiles(compiled)  # what numba's own option `cache` sets, to its own kind of cache
        _kernels[f"{function.__module__}.{function.__qualname__}"] = compiled
    return compiled


def helper(function: Callable[..., Any] | None = None, **options: Any) -> Any:
    """`numba.njit` for a function that kernels call: it is part of their machine code, and not kept by itself.

    Parameters
    ----------
    function : callable
    **options
        Of numba: `error_model`, `fastmath`, `inline`, `forceinline`. LLVM puts it in place of each call, by default:
        many arguments, as of named tuples of arrays, take longer to hand over than a formula to work out. What is long
        and seldom called, as exact arithmetic, compiles quicker with `forceinline=False`.
    """
    if function is None:
        return lambda function: helper(function, **options)
    options.setdefault("forceinline", "inline" not in options)
    if not options["forceinline"] and "inline" not in options:
        options["_nrt"] = True  # it may make arrays, whoever calls it
    return _njit(nogil=True, no_cfunc_wrapper=True, **options)(function)


@helper
def unsigned_range(first: int, last: int) -> range:
    """range(first, last), of numbers without sign: an array needs no look at whether they count from its end.

    Arithmetic with such a number and one with sign gives a float.
    """
    return range(np.uint64(first), np.uint64(last))  # type: ignore[arg-type]


def read_only(array: np.ndarray) -> np.ndarray:
    """A view that is read-only: a kernel takes the same type, whether the array is or not."""
    view = array.view()
    view.flags.writeable = False
    return view


def all_kernels() -> dict[str, Any]:
    """The kernels of all modules imported so far, by module and name."""
    return dict(_kernels)
