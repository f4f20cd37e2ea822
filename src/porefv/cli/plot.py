"""The command `porefv plot`: draw results, simulations and packing files."""

from __future__ import annotations

import argparse
import re
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any

from porefv.cli.options import add_command
from porefv.cli.packing_text import is_packing_file
from porefv.errors import InputError

if TYPE_CHECKING:
    from porefv.export.picture_output import Picture

# Kinds of pictures: as `porefv.results.drawing.PICTURES`, which is slow to import.
KINDS = (
    "forces", "pressure", "network", "throats", "paths", "packing", "section", "velocity",
    "profile", "pore_sizes", "constriction_sizes",
)  # fmt: skip
_OF_A_PACKING = ("packing", "section")


def register(commands: Any) -> None:
    """Add the command to the command line."""
    parser = add_command(
        commands, "plot", "draw results: grains and pores of solve, time series of simulate; or a packing file",
        "porefv plot results --out picture.png\nporefv plot packing.csv --out packing.png", "quickstart.md",
    )  # fmt: skip
    parser.add_argument("results", metavar="RESULTS", type=Path, help="results directory, or packing file")
    parser.add_argument(
        "--out", metavar="FILE", type=Path, required=True,
        help="picture to write: .png; .svg or .pdf of sections and curves; .html of what is in three dimensions",
    )  # fmt: skip
    parser.add_argument(
        "--what", choices=KINDS, metavar="KIND",
        help=f"what to draw of the results of solve: {', '.join(KINDS)}; by default what shows most",
    )  # fmt: skip
    parser.add_argument("--axis", choices=("x", "y", "z"), help="of section and velocity: the plane is normal to it")
    parser.add_argument("--at", metavar="PLACE", type=float, help="of section and velocity: place of the plane, m")
    parser.add_argument(
        "--size", metavar="WIDTHxHEIGHT", type=_size, help="width and height in pixels, 1600x1200 by default"
    )
    parser.add_argument("--dpi", type=float, help="pixels per inch, 200 by default: the more, the larger the letters")
    parser.add_argument("--force", action="store_true", help="replace a picture that exists")
    parser.set_defaults(command=run)


def _size(text: str) -> tuple[int, int]:
    found = re.fullmatch(r"(\d{1,6})[x×](\d{1,6})", text)
    if not found:
        raise argparse.ArgumentTypeError(f"a size is two numbers of pixels, such as 1600x1200, not {text!r}")
    return int(found[1]), int(found[2])


def run(options: argparse.Namespace) -> None:
    """Run the command."""
    from porefv.simulation.run_record import is_simulation
    from porefv.system.progress import Progress

    if options.out.exists() and not options.force:
        raise InputError(f"{options.out} exists already: choose another with --out, or add --force")
    given = {name: getattr(options, name) for name in ("axis", "at", "size", "dpi")}
    given = {name: value for name, value in given.items() if value is not None}
    with Progress().stage("drawing"):
        if is_packing_file(options.results):
            picture = _draw_packing(options.results, options.out, options.what or "packing", given)
        elif is_simulation(options.results):
            for option in ("what", "axis", "at"):
                if getattr(options, option) is not None:
                    raise InputError(f"{options.results} holds a simulation; --{option} is for results of porefv solve")
            from porefv.simulation.series_picture import draw_series

            picture = draw_series(options.results, options.out, **given)
        else:
            if options.what in KINDS[-3:] and {"axis", "at"} & set(given):
                raise InputError(f"--axis and --at are those of section and velocity; {options.what} has none")
            picture = _draw_results(options.results, options.out, options.what, given)
    for note in picture.notes:
        print(f"porefv plot: {note}", file=sys.stderr)


def _draw_results(directory: Path, out: Path, what: str | None, given: dict[str, Any]) -> Picture:
    from porefv.results.drawing import draw, formats_of, title_of
    from porefv.results.reading import read
    from porefv.system.atomic_files import picture_target

    results = read(directory)
    if what != "paths":
        return draw(results, out, what, **given)
    from porefv.export.pictures import picture
    from porefv.scenes.flow_of_results import flow_of_results

    picture_target(out, formats_of(what))
    found = picture(flow_of_results(results), what, title=title_of(results), **given)
    found.save(out)
    return found


def _draw_packing(path: Path, out: Path, what: str, given: dict[str, Any]) -> Picture:
    if what not in _OF_A_PACKING:
        raise InputError(
            f"{path} is a packing file: --what can be {' or '.join(_OF_A_PACKING)}; {what} is for results of porefv "
            "solve"
        )
    from porefv.export.pictures import picture
    from porefv.packing.packing import Packing
    from porefv.results.drawing import formats_of
    from porefv.system.atomic_files import picture_target

    picture_target(out, formats_of(what))
    packing = Packing.read(path)
    found = picture(packing, what, title=f"{path.stem}: {len(packing)} spheres", **given)
    found.save(out)
    return found
