"""The command `porefv simulate`."""

from __future__ import annotations

import argparse
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from porefv.simulation.ledger import Ledger


def register(commands: Any, add_run_options: Callable[..., None]) -> None:
    """Add the command to the command line."""
    parser = commands.add_parser("simulate", help="move grains, dry or in a fluid, through the stages of a scene")
    add_run_options(parser, force="replace results that exist")
    parser.add_argument("--resume", action="store_true", help="go on from the last checkpoint")
    parser.set_defaults(command=_simulate)


def _simulate(options: argparse.Namespace) -> None:
    from porefv.errors import InputError
    from porefv.simulation import SimulationScene
    from porefv.simulation.ledger import read_ledger
    from porefv.simulation.progress import SimulationProgress

    if options.resume and options.force:
        raise InputError("--resume goes on with results that exist, --force replaces them: give one of the two")
    scene = SimulationScene.read(options.scene)
    if options.threads:
        import numba

        numba.set_num_threads(min(options.threads, numba.get_num_threads()))
    progress = SimulationProgress([stage.name for stage in scene.stages], quiet=options.quiet)
    directory = scene.run(force=options.force, resume=options.resume, progress=progress)
    if not options.quiet:
        print(outcome(read_ledger(directory), directory))


def outcome(ledger: Ledger, directory: Path) -> str:
    """What `porefv simulate` says when it is done."""
    from porefv.errors import counted

    point = ledger.checkpoint
    lines = []
    if point is not None:
        steps = counted(point.step, "step")
        lines.append(f"{counted(len(ledger.spans), 'stage')}, {point.time:.6g} s in {steps}; {ledger.seconds:.2f} s")
    for found in ledger.permeability:
        lines.append(
            f"permeability {found['permeability']:.4g} m², porosity {found['porosity']:.4f} "
            f"{found['when']} {found['stage']}"
        )
    return "\n".join([*lines, f"results in {directory}"])
