"""The command `porefv trade`."""

from __future__ import annotations

import argparse
import os
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

# Spheres up to which the resolved flow is computed unasked.
SMALL = 12


def register(commands: Any, add_run_options: Callable[..., None]) -> None:
    """Add the command to the command line."""
    parser = commands.add_parser("trade", help="what each method costs on a scene, and how far it is off")
    add_run_options(parser, force="replace results that exist")
    parser.add_argument("--out", metavar="DIRECTORY", type=Path, help="table and picture; by the scene's results")
    parser.add_argument(
        "--resolved", action=argparse.BooleanOptionalAction,
        help=f"compute the resolved Stokes flow, or do not (default: up to {SMALL} spheres)",
    )  # fmt: skip
    parser.set_defaults(command=_trade)


def _trade(options: argparse.Namespace) -> None:
    from porefv.io.atomic import atomic_directory
    from porefv.scene import Scene
    from porefv.trade.ladder import save, table, trade

    directory = Scene.read(options.scene).output.directory
    target = options.out or directory.with_name(f"{directory.name}_trade")
    if options.threads:
        os.environ["NUMBA_NUM_THREADS"] = str(options.threads)
    say = None if options.quiet else (lambda name: print(f"  {name} ...", file=sys.stderr, flush=True))
    with atomic_directory(target, force=options.force) as folder:
        found = trade(options.scene, resolved=options.resolved, report=say)
        save(found, folder)
    if not options.quiet:
        print(table(found))
        print(f"table and picture in {target}")
