"""The command `porefv`: its commands, one module each, import what they need when they run, so that help is quick."""

from __future__ import annotations

import argparse
import os
import sys
import warnings
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from typing import Any, NoReturn

from porefv.cli import check, info, pack, plot, reference, simulate, solve, trade
from porefv.errors import PorefvError
from porefv.system import memory
from porefv.system.version import __version__


def main(arguments: Sequence[str] | None = None) -> int:
    """Run a command; its exit status: 0, 1 (failed computation), 2 (bad input) or 130 (interrupted)."""
    try:
        options = _parser().parse_args(arguments)
        with _warnings_in_a_line(quiet=getattr(options, "quiet", False)):
            if options.command is not info.run:
                memory.ensure_libraries()
            options.command(options)
        sys.stdout.flush()
        return 0
    except PorefvError as error:
        return _fail(str(error), error.exit_status)
    except KeyboardInterrupt as interruption:
        return _fail(str(interruption) or "interrupted; nothing was written", 130)
    except BrokenPipeError:
        # Whoever read our output has gone (porefv info results | head): no complaint on the way out.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 0
    except ModuleNotFoundError as error:
        return _fail(f"the installation is incomplete: {error}. Install porefv again with pip", 1)
    except ImportError as error:  # of a library that is there
        return _fail(
            f"a library cannot be loaded: {error}. Allow more memory (ulimit -v), or install porefv again with pip", 1
        )
    except MemoryError:
        return _fail("not enough memory; ask for less (quantities, vtk), or use a larger machine", 1)
    except Exception as error:  # the user gets a line, the developer a traceback
        if os.environ.get("POREFV_DEBUG"):
            raise
        return _fail(
            f"unexpected {type(error).__name__}: {error}\nThis is a defect of porefv. Please report it, with "
            "the scene and what the same command prints with POREFV_DEBUG=1 in the environment.",
            1,
        )


def command() -> NoReturn:
    """The command `porefv`: run it, and end the process.

    Everything is written by then. To take down what has been loaded would take as long again as a small computation.
    """
    status = main()
    try:
        sys.stdout.flush()
        sys.stderr.flush()
    except OSError:
        sys.exit(status)  # Python says what it could not write
    os._exit(status)


@contextmanager
def _warnings_in_a_line(quiet: bool) -> Iterator[None]:
    """Say warnings as errors are said, or not at all."""
    with warnings.catch_warnings():
        warnings.showwarning = lambda message, *_: None if quiet else print(f"porefv: {message}", file=sys.stderr)
        yield


def _fail(message: str, status: int) -> int:
    print(f"porefv: error: {message}", file=sys.stderr)
    return status


class _CommandParser(argparse.ArgumentParser):
    """The parser of one command, which refuses what it does not know itself, with its own usage."""

    def parse_known_args(self, args: Any = None, namespace: Any = None) -> Any:
        known, unknown = super().parse_known_args(args, namespace)
        if unknown:
            self.error(f"unrecognized arguments: {' '.join(unknown)}")
        return known, unknown


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="porefv",
        description="Packings of spheres, and flow through them: permeability, pressures, forces on every grain.",
        epilog="A scene says what is wanted, and only that is computed. "
        "Exit status: 0 done, 1 the computation failed, 2 bad input.",
    )
    parser.add_argument("--version", action="version", version=f"porefv {__version__}")
    commands = parser.add_subparsers(title="commands", metavar="COMMAND", required=True, parser_class=_CommandParser)
    for command in (pack, solve, simulate, reference, trade, check, info, plot):
        command.register(commands)
    return parser
