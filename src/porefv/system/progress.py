"""Progress of a computation in stages: a bar on a terminal, nothing in a log; and the time each takes."""

from __future__ import annotations

import shutil
import sys
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from threading import Event, Thread
from typing import TextIO

from porefv.system.timer import Timer

_BAR = 20  # characters
_PERIOD = 0.1  # s between two drawings


class Progress:
    """Stages of a computation.

    Parameters
    ----------
    stages : sequence of str
        Names of the stages to come, in order.
    stream : text stream, optional
        Where the bar is drawn if it is a terminal; standard error by default.
    quiet : bool
        Never draw.

    Attributes
    ----------
    seconds : dict of str to float
        Wall time of each stage that has ended [s].

    Examples
    --------
    >>> progress = Progress(["reading", "writing"], quiet=True)
    >>> with progress.stage("reading"):
    ...     pass
    >>> list(progress.seconds)
    ['reading']
    """

    def __init__(self, stages: Sequence[str] = (), stream: TextIO | None = None, quiet: bool = False):
        self.stages = tuple(stages)
        self.seconds: dict[str, float] = {}
        self._stream = sys.stderr if stream is None else stream
        self._draws = not quiet and self._stream.isatty()

    @contextmanager
    def stage(self, name: str) -> Iterator[None]:
        """Time a stage, and show it while it lasts."""
        done = Event()
        try:
            with Timer(self.seconds, name) as timer:
                painter = Thread(target=self._paint, args=(name, timer, done), daemon=True)
                if self._draws:
                    painter.start()
                yield
        finally:
            if self._draws:
                done.set()
                painter.join()
                self._stream.write("\r\x1b[K")
                self._stream.flush()

    def note(self, text: str) -> None:
        """A line that stays on the terminal; nothing in a log."""
        if self._draws:
            self._stream.write(f"porefv: {text}\n")
            self._stream.flush()

    def _paint(self, name: str, timer: Timer, done: Event) -> None:
        # A compiled kernel may hold the interpreter's lock: the line then stands still, but it stands.
        while True:
            line = self.line(name, timer.elapsed)
            self._stream.write("\r\x1b[K" + line[: shutil.get_terminal_size().columns - 1])
            self._stream.flush()
            if done.wait(_PERIOD):
                return

    def line(self, name: str, seconds: float) -> str:
        if name not in self.stages:
            return f"porefv: {name}  {seconds:.1f} s"
        number, total = self.stages.index(name), len(self.stages)
        filled = _BAR * number // total
        return f"porefv: [{'#' * filled}{'.' * (_BAR - filled)}] {number + 1}/{total} {name}  {seconds:.1f} s"
