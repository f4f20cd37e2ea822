"""Optional packages: loaded when needed, and not half loaded when someone presses Ctrl-C meanwhile."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from importlib import import_module
from importlib.util import find_spec
from signal import getsignal, raise_signal
from typing import Any

from porefv.errors import MissingExtraError
from porefv.system.signals import ENDING, handled


def load(module: str, purpose: str) -> Any:
    """A module of pyvista or of VTK, which comes with it.

    Raises
    ------
    MissingExtraError
        If it is not installed; the message begins with the purpose.
    """
    try:
        with _interruptions_held_back():
            return import_module(module)
    except ModuleNotFoundError:
        raise MissingExtraError("pyvista", purpose) from None


def ensure_installed(module: str, package: str, purpose: str) -> None:
    """MissingExtraError, whose message begins with the purpose, if a module of a package is not installed."""
    if find_spec(module) is None:
        raise MissingExtraError(package, purpose)


@contextmanager
def _interruptions_held_back() -> Iterator[None]:
    """Ctrl-C waits for the end of the block: interrupted while its libraries load, VTK ends the process by a crash."""
    came: list[int] = []
    with handled(lambda number, _: came.append(number), *(number for number in ENDING if callable(getsignal(number)))):
        yield
    if came:
        raise_signal(came[0])
