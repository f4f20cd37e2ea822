"""Progress of a computation in stages: a bar on a terminal, nothing in a log; and the time each takes."""

from __future__ import annotations

import sys
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from typing import TYPE_CHECKING, TextIO

from porefv.system import locks
from porefv.system.timer import Timer

if TYPE_CHECKING:
    from rich.progress import Progress as Bar


def fitted(state: str, width: int) -> str:
    """As many values of a state, set apart by two spaces, as a width has room for; the first ones come first.

    >>> fitted("unbalanced 3e-03  kinetic 1e-05  imbalance 2e-10", 34)
    'unbalanced 3e-03  kinetic 1e-05'
    """
    values = state.split("  ")
    while len("  ".join(values)) > width:
        values.pop()
    return "  ".join(values)


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
    draws : bool
        Whether anything is drawn.

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
        self.draws = not quiet and self._stream.isatty()
        self._bar: Bar | None = None  # of the stage that lasts
        self._fixed = 0  # columns that are taken by all but the state

    @contextmanager
    def stage(self, name: str) -> Iterator[None]:
        """Time a stage, and show it while it lasts."""
        locks.touch()
        with Timer(self.seconds, name):
            if not self.draws:
                yield
                return
            # A compiled kernel may hold the interpreter's lock: the line then stands still, but it stands.
            title = f"{self.stages.index(name) + 1}/{len(self.stages)} {name}" if name in self.stages else name
            with self._new_bar(title) as self._bar:
                self._bar.add_task(title, total=None, state="")
                try:
                    yield
                finally:
                    self._bar = None

    def show(self, state: str, part: float | None = None) -> None:
        """Show what is known of the stage that lasts, and which part of it is done if that is known."""
        if self._bar is not None:
            state = fitted(state, self._bar.console.width - self._fixed)
            # The first part shown is where the stage goes on from: rich tells what remains by the clock from the next.
            total = None if part is None else 1.0
            self._bar.update(self._bar.task_ids[0], state=state, completed=part, total=total)

    def note(self, text: str) -> None:
        """Write a line that stays on the terminal; nothing in a log."""
        if self.draws:
            self._stream.write(f"porefv: {text}\n")
            self._stream.flush()

    def _new_bar(self, title: str) -> Bar:
        # rich is loaded for a terminal only. It does not take standard output and error into its hands.
        from rich.console import Console
        from rich.progress import BarColumn, TextColumn, TimeElapsedColumn, TimeRemainingColumn
        from rich.progress import Progress as Bar
        from rich.table import Column

        console = Console(file=self._stream, highlight=False)
        # Where a terminal is narrow, columns give way, and values of the state one by one: none is cut.
        others = [
            (BarColumn(bar_width=8, table_column=Column(min_width=8)), 8),
            (TimeElapsedColumn(table_column=Column(min_width=7)), 7),
            (TimeRemainingColumn(compact=True, table_column=Column(min_width=5)), 5),
        ]
        shown = [column for column, _ in others] if console.width >= 60 else [others[1][0]]
        self._fixed = len(title) + sum(1 + width for column, width in others if column in shown) + 1
        columns = (
            TextColumn("{task.description}", markup=False, table_column=Column(no_wrap=True)),
            *shown,
            TextColumn("{task.fields[state]}", markup=False, table_column=Column(no_wrap=True, ratio=1)),
        )
        return Bar(*columns, console=console, transient=True, redirect_stdout=False, redirect_stderr=False)
