"""The command `porefv trade`: what each method costs on a scene, and how far it is off."""

from __future__ import annotations

import argparse
import os
from pathlib import Path
from typing import Any

from porefv.cli.options import add_command, add_run_options
from porefv.cli.text import say
from porefv.comparison.methods import RESOLVED_UP_TO


def register(commands: Any) -> None:
    """Add the command to the command line."""
    parser = add_command(
        commands, "trade", "what each method costs on a scene, and how far it is off",
        "porefv trade scene.toml\nporefv trade scene.toml --no-resolved --out trade", "trade.md",
    )  # fmt: skip
    add_run_options(parser, force="replace results that exist")
    parser.add_argument("--out", metavar="DIRECTORY", type=Path, help="table and picture; by the scene's results")
    parser.add_argument(
        "--resolved", action=argparse.BooleanOptionalAction,
        help=f"compute the resolved Stokes flow, or do not (default: up to {RESOLVED_UP_TO} spheres)",
    )  # fmt: skip
    parser.set_defaults(command=run)


def run(options: argparse.Namespace) -> None:
    """Run the command."""
    from porefv.comparison.comparison import compare
    from porefv.comparison.output import save, table
    from porefv.scenes.flow_scene import FlowScene
    from porefv.system.atomic_files import atomic_directory
    from porefv.system.progress import Progress

    directory = FlowScene.read(options.scene).output.directory
    target = options.out or directory.with_name(f"{directory.name}_trade")
    if options.threads:
        os.environ["NUMBA_NUM_THREADS"] = str(options.threads)
    progress = Progress(quiet=options.quiet)
    with atomic_directory(target, force=options.force) as folder:
        found = compare(options.scene, resolved=options.resolved, progress=progress)
        save(found, folder)
    if not options.quiet:
        say(table(found))
        say(f"table and picture in {target}")
