"""The command `porefv plot`: draw results."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

from porefv.cli.packing_text import is_packing_file
from porefv.errors import InputError


def register(commands: Any) -> None:
    """Add the command to the command line."""
    parser = commands.add_parser(
        "plot", help="draw results: grains and pores of solve, time series of simulate; or a packing file"
    )
    parser.add_argument("results", metavar="RESULTS", type=Path, help="results directory, or packing file")
    parser.add_argument("--out", metavar="FILE.png", type=Path, required=True, help="picture to write")
    parser.add_argument(
        "--what", choices=("profile", "pore_sizes", "constriction_sizes"),
        help="draw this quantity of solve in place of the grains and pores",
    )  # fmt: skip
    parser.add_argument("--force", action="store_true", help="replace a picture that exists")
    parser.set_defaults(command=run)


def run(options: argparse.Namespace) -> None:
    """Run the command."""
    from porefv.simulation.run_record import is_simulation
    from porefv.system.progress import Progress

    if options.out.exists() and not options.force:
        raise InputError(f"{options.out} exists already: choose another with --out, or add --force")
    with Progress().stage("drawing"):
        if is_packing_file(options.results):
            if options.what:
                raise InputError(f"{options.results} is a packing file; --what is for results of porefv solve")
            from porefv.packing.packing import Packing
            from porefv.results.drawing import draw_packing

            draw_packing(Packing.read(options.results), options.results.stem, options.out)
        elif is_simulation(options.results):
            if options.what:
                raise InputError(f"{options.results} holds a simulation; --what is for results of porefv solve")
            from porefv.simulation.series_picture import draw_series

            draw_series(options.results, options.out)
        elif options.what:
            from porefv.results.quantity_pictures import draw_quantity
            from porefv.results.reading import read

            draw_quantity(read(options.results), options.what, options.out)
        else:
            from porefv.results.drawing import draw
            from porefv.results.reading import read

            draw(read(options.results), options.out)
