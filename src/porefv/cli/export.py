"""The command `porefv export`: write results for other programs."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

from porefv.cli.options import add_command
from porefv.cli.text import path_text, say

# As `porefv.results.exporting.FORMATS`, which would be slow to import for the help.
FORMATS = ("openpnm", "csv", "inp", "mesh", "msh", "nas", "vtk", "vtu")


def register(commands: Any) -> None:
    """Add the command to the command line."""
    parser = add_command(
        commands, "export", "write pores and throats of results for other programs",
        "porefv export results --to openpnm --out network.npz", "quantities.md",
    )  # fmt: skip
    parser.add_argument(
        "results", metavar="RESULTS", type=Path,
        help="results of porefv solve with vtk = true; for paraview also those of porefv simulate, with frames",
    )  # fmt: skip
    parser.add_argument(
        "--to", choices=(*FORMATS, "section", "paraview"), required=True,
        help="openpnm: arrays in the names of OpenPNM, a .npz file; csv: pores.csv and throats.csv in a directory; "
        "section: grains and pores cut by a plane, a .vtp file; paraview: a script .py that shows the results there; "
        "others: the mesh of the pores, written by meshio",
    )  # fmt: skip
    parser.add_argument("--out", metavar="FILE", type=Path, required=True, help="file, or directory of csv, to write")
    parser.add_argument("--axis", choices=("x", "y", "z"), default="x", help="section: normal of the plane (x)")
    parser.add_argument("--at", type=float, metavar="PLACE", help="section: place of the plane in m (the middle)")
    parser.add_argument("--force", action="store_true", help="replace files that exist")
    parser.set_defaults(command=run)


def run(options: argparse.Namespace) -> None:
    """Run the command."""
    from porefv.results.exporting import export
    from porefv.results.reading import read

    if options.to == "paraview":
        from porefv.results.paraview import write_script

        say(f"written {path_text(write_script(options.results, options.out, force=options.force))}")
        return
    if options.to == "section":
        from porefv.results.section import write_section

        path = write_section(read(options.results), options.out, options.axis, options.at, force=options.force)
        say(f"written {path_text(path)}")
        return
    for path in export(read(options.results), options.out, options.to, force=options.force):
        say(f"written {path_text(path)}")
