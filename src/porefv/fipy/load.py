"""FiPy, imported when it is first needed."""

from __future__ import annotations

import os
import sys
from typing import Any

from porefv.errors import MissingExtraError


def load_fipy() -> Any:
    """FiPy, with its scipy solvers unless the user chose others; it reads its options from the command line."""
    if "fipy" not in sys.modules:
        os.environ.setdefault("FIPY_SOLVERS", "scipy")
        argv, sys.argv = sys.argv, sys.argv[:1]
        try:
            import fipy
        except ModuleNotFoundError:
            raise MissingExtraError("fipy", "A FiPy mesh") from None
        finally:
            sys.argv = argv
    import fipy

    return fipy
