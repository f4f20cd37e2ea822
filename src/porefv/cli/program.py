"""The command `porefv`: its commands, one module each, import what they need when they run, so that help is quick."""

from __future__ import annotations

import argparse
import difflib
import os
import signal
import sys
import warnings
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any, NoReturn

from porefv.cli import check, export, info, pack, plot, reference, simulate, solve, trade
from porefv.cli.text import flush, say
from porefv.errors import InputError, PorefvError, printable
from porefv.system import memory
from porefv.system.signals import ENDING, Terminated, end, handled
from porefv.system.version import __version__

# What `porefv` alone prints: what to do first.
_FIRST = """porefv: packings of spheres, the flow through them, and the force on every grain.

With a packing file:
  porefv check packing.csv                      what is in it, and whether it is fit
  porefv plot packing.csv --out packing.png     how it looks
With a scene, which names a packing, what drives the flow and what is wanted:
  porefv solve scene.toml                       permeability, pressures, forces
  porefv plot results --out picture.png         a picture of them
  porefv simulate scene.toml                    grains that move, dry or in a fluid

The smallest scene:
  packing = "packing.csv"
  [walls]
  y_min = { pressure = 1.0 }
  y_max = { pressure = 0.0 }

porefv --help lists all commands, porefv COMMAND --help says more of one.
First steps in the documentation: docs/quickstart.md"""


def main(arguments: Sequence[str] | None = None) -> int:
    """Run a command; its exit status: 0, 1 (failed computation), 2 (bad input), 130 (interrupted) or 143 (SIGTERM)."""
    came: list[int] = []

    def interrupted(number: int, _: Any) -> None:
        came.append(number)
        end(number)

    with handled(interrupted, *ENDING):
        try:
            given = sys.argv[1:] if arguments is None else arguments
            if not given:
                say(_FIRST)
                return 0
            options = _parser().parse_args(given)
            _check_arguments(options)
            with _warnings_in_a_line(quiet=getattr(options, "quiet", False)):
                if options.command is not info.run:
                    memory.ensure_libraries()
                options.command(options)
            return 0
        except (Exception, KeyboardInterrupt, Terminated) as error:
            return _failed(error, came)


def _check_arguments(options: argparse.Namespace) -> None:
    """InputError if a path has a line break: it would look like a line of ours."""
    for path in vars(options).values():
        if isinstance(path, Path) and len(str(path).splitlines()) > 1:
            raise InputError(f"a path in one line is needed, not {str(path)!r}")


def _failed(error: BaseException, signals: Sequence[int] = ()) -> int:
    """Say what went wrong, and give the exit status; `signals` have come meanwhile."""
    if signals and not isinstance(error, KeyboardInterrupt | Terminated | PorefvError):
        # Libraries turn one that comes while they load, or hand arrays over, into errors of their own.
        error = Terminated() if signals[0] == signal.SIGTERM else KeyboardInterrupt()
    # Where one comes while text is decoded, Python replaces its message, and names the first as the cause.
    ours = str(error) if error.__cause__ is None else ""
    match error:
        case PorefvError():
            return _fail(str(error), error.exit_status)
        case KeyboardInterrupt():
            return _fail(ours or "interrupted; nothing was written", 130)
        case Terminated():
            return _fail(ours or "terminated; nothing was written", 143)
        case BrokenPipeError():
            return 0  # whoever read our output has gone (porefv info results | head)
        case ModuleNotFoundError():
            return _fail(f"the installation is incomplete: {error}. Install porefv again with pip", 1)
        case ImportError():  # of a library that is there
            remedy = "Allow more memory (ulimit -v), or install porefv again with pip"
            return _fail(f"a library cannot be loaded: {error}. {remedy}", 1)
        case MemoryError():
            return _fail("not enough memory; ask for less (quantities, vtk), or use a larger machine", 1)
    if os.environ.get("POREFV_DEBUG"):  # the user gets a line, the developer a traceback
        raise error
    return _fail(
        f"unexpected {type(error).__name__}: {printable(str(error), 500)}\nThis is a defect of porefv. Please report "
        "it, with the scene and what the same command prints with POREFV_DEBUG=1 in the environment.",
        1,
    )


def command() -> NoReturn:
    """The command `porefv`: run it, and end the process.

    Everything is written by then. To take down what has been loaded would take as long again as a small computation.
    """
    _open_closed_streams()
    try:
        status: Any = main()
    except SystemExit as ended:  # argparse's, after help or the usage
        status = ended.code
    try:
        flush()
        sys.stderr.flush()
    except PorefvError as error:
        status = _failed(error)
    except OSError:
        pass  # nobody can be told, but the status still says it
    os._exit(status if isinstance(status, int) else 0)


def _open_closed_streams() -> None:
    """Have numbers 0 to 2 taken where the process was started without, so that no file that is written gets them."""
    while (number := os.open(os.devnull, os.O_RDWR)) <= 2:
        pass
    os.close(number)
    if sys.stderr is None:
        sys.stderr = open(os.devnull, "w")  # noqa: SIM115 - for as long as the process lives


@contextmanager
def _warnings_in_a_line(quiet: bool) -> Iterator[None]:
    """Say warnings as errors are said, each once, or not at all."""
    said: set[str] = set()

    def show(message: Warning | str, *_: Any, **__: Any) -> None:
        # Where a packing is validated twice, the same is found twice.
        if not quiet and str(message) not in said:
            said.add(str(message))
            _complain(f"porefv: {message}")

    with warnings.catch_warnings():
        warnings.showwarning = show
        yield


def _fail(message: str, status: int) -> int:
    _complain(f"porefv: error: {message}")
    return status


def _complain(line: str) -> None:
    with suppress(OSError, ValueError):  # where nobody can be told, the status still says it
        print(printable(line), file=sys.stderr)


class _CommandParser(argparse.ArgumentParser):
    """The parser of one command, which refuses what it does not know itself, with its own usage."""

    def parse_known_args(self, args: Any = None, namespace: Any = None) -> Any:
        known, unknown = super().parse_known_args(args, namespace)
        if unknown:
            self.error(f"unrecognized arguments: {' '.join(unknown)}")
        return known, unknown

    def error(self, message: str) -> NoReturn:
        super().error(printable(message, 500))

    def _check_value(self, action: Any, value: Any) -> None:
        """As argparse, with what is meant where that can be guessed."""
        if action.choices is not None and value not in action.choices:
            known = [str(choice) for choice in action.choices]
            near = difflib.get_close_matches(str(value), known, 1)
            guess = f"did you mean '{near[0]}'? " if near else ""
            raise argparse.ArgumentError(action, f"invalid choice: '{value}'; {guess}known: {', '.join(known)}")

    def _print_message(self, message: str, file: Any = None) -> None:
        """As argparse, which takes no notice of an output that cannot be written to."""
        if file is sys.stderr:
            super()._print_message(message, file)
        else:
            say(message.rstrip("\n"))


def _parser() -> argparse.ArgumentParser:
    parser = _CommandParser(
        prog="porefv",
        description="Packings of spheres, and flow through them: permeability, pressures, forces on every grain.",
        epilog="A scene says what is wanted, and only that is computed. "
        "Exit status: 0 done, 1 the computation failed, 2 bad input, 130 interrupted, 143 terminated.",
    )
    parser.add_argument("--version", action="version", version=f"porefv {__version__}")
    commands = parser.add_subparsers(title="commands", metavar="COMMAND", required=True, parser_class=_CommandParser)
    for command in (pack, solve, simulate, reference, trade, check, info, plot, export):
        command.register(commands)
    return parser
