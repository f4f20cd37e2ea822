"""FiPy, imported when it is first needed."""

from __future__ import annotations

import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

from porefv.errors import MissingExtraError


def load_fipy() -> Any:
    """FiPy, with its scipy solvers unless the environment names others.

    Raises
    ------
    MissingExtraError
        If it is not installed.
    """
    try:
        if "fipy" not in sys.modules:
            with _options_of_fipy():
                import fipy
        import fipy
    except ModuleNotFoundError:
        raise MissingExtraError("fipy", "A FiPy mesh") from None
    return fipy


@contextmanager
def _options_of_fipy() -> Iterator[None]:
    """While FiPy is imported, it reads options from the command line and the environment: none, and scipy."""
    argv, chosen = sys.argv, os.environ.get("FIPY_SOLVERS")
    sys.argv = sys.argv[:1]
    os.environ.setdefault("FIPY_SOLVERS", "scipy")
    try:
        yield
    finally:
        sys.argv = argv
        if chosen is None:
            del os.environ["FIPY_SOLVERS"]
