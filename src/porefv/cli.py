"""The command `porefv` and its commands, which import what they need: help comes at once."""

from __future__ import annotations

import argparse
import os
import sys
import warnings
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

from porefv import __version__, memory
from porefv.errors import PorefvError

if TYPE_CHECKING:
    from porefv.progress import Progress


def main(arguments: Sequence[str] | None = None) -> int:
    """Run a command; its exit status: 0, 1 (failed computation), 2 (bad input) or 130 (interrupted)."""
    try:
        options = _parser().parse_args(arguments)
        with _warnings_in_a_line(quiet=getattr(options, "quiet", False)):
            if options.command is not _info:
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
    from porefv.reference import command as reference
    from porefv.simulation import command as simulation
    from porefv.trade import command as trade

    parser = argparse.ArgumentParser(
        prog="porefv",
        description="Packings of spheres, and flow through them: permeability, pressures, forces on every grain.",
        epilog="A scene says what is wanted, and only that is computed. "
        "Exit status: 0 done, 1 the computation failed, 2 bad input.",
    )
    parser.add_argument("--version", action="version", version=f"porefv {__version__}")
    commands = parser.add_subparsers(title="commands", metavar="COMMAND", required=True, parser_class=_CommandParser)

    pack = commands.add_parser("pack", help="make a packing of spheres, and write its file")
    _add_run_options(pack, force="replace a file that exists")
    pack.set_defaults(command=_pack)

    solve = commands.add_parser("solve", help="compute what a scene asks for, and write its results")
    _add_run_options(solve, force="replace results that exist")
    solve.set_defaults(command=_solve)

    simulation.register(commands, _add_run_options)
    reference.register(commands, _add_run_options)
    trade.register(commands, _add_run_options)

    check = commands.add_parser("check", help="validate a scene and its packing without computing")
    check.add_argument("scene", metavar="SCENE.toml", type=Path)
    check.set_defaults(command=_check)

    info = commands.add_parser("info", help="print a summary of results")
    info.add_argument("results", metavar="RESULTS", type=Path)
    info.set_defaults(command=_info)

    plot = commands.add_parser("plot", help="draw results: grains and pores of solve, time series of simulate")
    plot.add_argument("results", metavar="RESULTS", type=Path)
    plot.add_argument("--out", metavar="FILE.png", type=Path, required=True, help="picture to write")
    plot.set_defaults(command=_plot)
    return parser


def _add_run_options(parser: argparse.ArgumentParser, force: str) -> None:
    """What commands take that compute from a scene."""
    parser.add_argument("scene", metavar="SCENE.toml", type=Path)
    parser.add_argument("--force", action="store_true", help=force)
    parser.add_argument("--threads", metavar="N", type=_count, help="compute with at most N threads")
    parser.add_argument("--quiet", action="store_true", help="print errors only")


def _count(text: str) -> int:
    if not (text.isascii() and text.isdigit() and int(text) > 0):
        raise argparse.ArgumentTypeError(f"expected a number of threads, 1 or more, not '{text}'")
    return int(text)


# ---- commands ------------------------------------------------------------------------------------------


def _pack(options: argparse.Namespace) -> None:
    from porefv.dem import motion
    from porefv.pack_scene import PackProgress, PackScene, outcome
    from porefv.threads import limit_threads

    scene = PackScene.read(options.scene)
    limit_threads(options.threads)
    progress = PackProgress(scene.stages, quiet=options.quiet)
    if not _compiled(motion.advance):
        progress.note("compiling for this machine, this once; it takes about half a minute")
    packing = scene.pack(force=options.force, progress=progress)
    if not options.quiet:
        print(outcome(packing, scene.output))


def _solve(options: argparse.Namespace) -> None:
    from porefv.progress import Progress
    from porefv.report import outcome
    from porefv.results import read
    from porefv.scene import Scene
    from porefv.threads import limit_threads

    scene = Scene.read(options.scene)
    limit_threads(options.threads)
    progress = Progress(scene.stages, quiet=options.quiet)
    _announce_compilation(progress)
    directory = scene.solve(force=options.force, progress=progress)
    if not options.quiet:
        print(outcome(read(directory)))


def _check(options: argparse.Namespace) -> None:
    from porefv.progress import Progress
    from porefv.scene_table import Table

    progress = Progress()
    _announce_compilation(progress)
    keys = Table.read(options.scene).data
    if "stages" in keys:
        from porefv.simulation.command import described
        from porefv.simulation.scene import SimulationScene

        simulation = SimulationScene.read(options.scene)
        with progress.stage("validation"):
            grains = simulation.check()
        print(described(simulation, grains))
    elif "grains" in keys:
        from porefv.pack_scene import PackScene

        print(PackScene.read(options.scene).described)
    else:
        from porefv.report import scene_text
        from porefv.scene import Scene

        scene = Scene.read(options.scene)
        with progress.stage("validation"):
            packing = scene.check()
        print(scene_text(scene, packing))


def _info(options: argparse.Namespace) -> None:
    from porefv.report import summary_text
    from porefv.results import read
    from porefv.simulation.ledger import is_simulation, read_ledger

    if is_simulation(options.results):
        from porefv.simulation.command import outcome

        print(outcome(read_ledger(options.results), options.results))
    else:
        print(summary_text(read(options.results)))


def _plot(options: argparse.Namespace) -> None:
    from porefv.progress import Progress
    from porefv.results import read
    from porefv.simulation.ledger import is_simulation

    with Progress().stage("drawing"):
        if is_simulation(options.results):
            from porefv.simulation.plot import draw_series

            draw_series(options.results, options.out)
        else:
            from porefv.viz import draw

            draw(read(options.results), options.out)


def _announce_compilation(progress: Progress) -> None:
    """Say what is waited for, where numba has no compiled kernels from an earlier run."""
    from porefv.tessellation import insertion

    if not _compiled(insertion.insert):
        progress.note("compiling for this machine, this once; it takes about a minute")


def _compiled(kernel: Any) -> bool:
    """Whether numba has a kernel compiled in an earlier run."""
    name = f"{kernel.__module__.rpartition('.')[2]}.{kernel.__name__}"
    return any(Path(kernel.stats.cache_path or "").glob(f"{name}-*.nbi"))
