"""Optional packages: loaded when needed, and not half loaded when someone presses Ctrl-C meanwhile."""

from __future__ import annotations

import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from importlib import import_module
from importlib.util import find_spec
from typing import Any

from porefv.errors import MissingExtraError


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
    if threading.current_thread() is not threading.main_thread() or not callable(signal.getsignal(signal.SIGINT)):
        yield  # signals come elsewhere, or not at all
        return
    came: list[Any] = []
    before = signal.signal(signal.SIGINT, lambda *signals: came.append(signals))
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, before)
    if came:
        before(*came[0])  # type: ignore[operator, misc]
