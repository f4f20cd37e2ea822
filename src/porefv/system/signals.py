"""SIGTERM, which batch systems send: porefv ends as after Ctrl-C, with a status of its own."""

from __future__ import annotations

import signal
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any, NoReturn

# What people and batch systems send to a process that shall end.
ENDING = (signal.SIGINT, signal.SIGTERM)


class Terminated(SystemExit):
    """SIGTERM has come: the process ends with status 143 (128 + 15), after what it has begun is cleaned up."""

    def __init__(self, message: str = ""):
        super().__init__(128 + signal.SIGTERM)
        self.message = message

    def __str__(self) -> str:
        return self.message


def end(number: int, message: str = "") -> NoReturn:
    """Raise what a signal means: KeyboardInterrupt, or `Terminated`."""
    raise Terminated(message) if number == signal.SIGTERM else KeyboardInterrupt(message)


@contextmanager
def handled(handler: Callable[[int, Any], Any], *numbers: int) -> Iterator[None]:
    """Have signals handled by a function while the block runs; outside the main thread, where none come, do nothing.

    Signals that the process ignores stay ignored.
    """
    before: dict[int, Any] = {}
    if threading.current_thread() is threading.main_thread():
        for number in numbers:
            if signal.getsignal(number) not in (signal.SIG_IGN, None):
                before[number] = signal.signal(number, handler)
    try:
        yield
    finally:
        for number, handler_before in before.items():
            signal.signal(number, handler_before)
