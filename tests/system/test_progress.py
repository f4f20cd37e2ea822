"""Progress on a terminal: one line that fits, whose values are whole."""

import io
import re

import pytest

from porefv.system.progress import Progress, fitted


def test_values_give_way_whole():
    state = "n 0.4012  unbalanced 3e-03  kinetic 1e-05"
    assert fitted(state, 80) == state
    assert fitted(state, len(state) - 1) == "n 0.4012  unbalanced 3e-03"
    assert fitted(state, 3) == ""


class Terminal(io.StringIO):
    def isatty(self):
        return True


@pytest.mark.parametrize("columns", [40, 70, 100])
def test_the_line_fits_the_terminal(columns, monkeypatch):
    monkeypatch.setenv("COLUMNS", str(columns))
    monkeypatch.setenv("TERM", "xterm")
    stream = Terminal()
    progress = Progress(["growth", "writing"], stream=stream)
    with progress.stage("growth"):
        progress.show("n 0.4012  unbalanced 3e-03  kinetic 1e-05  imbalance 2e-10", 0.5)
    drawn = re.sub(r"\x1b\[[0-9;?]*[A-Za-z]", "", stream.getvalue()).replace("\r", "\n")
    lines = [line for line in drawn.splitlines() if "growth" in line]
    assert lines
    assert max(map(len, lines)) <= columns
    assert not any("…" in line for line in lines)
    assert "1/2 growth" in lines[-1]
