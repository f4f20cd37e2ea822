"""The command `porefv solve`: compute what a scene asks for, and write its results."""

from __future__ import annotations

import argparse
from typing import TYPE_CHECKING, Any

from porefv.cli.options import add_command, add_run_options
from porefv.cli.text import axes_text, count_text, path_text, say

if TYPE_CHECKING:
    from porefv.results.reading import Results


def register(commands: Any) -> None:
    """Add the command to the command line."""
    parser = add_command(
        commands, "solve", "compute what a scene asks for, and write its results",
        "porefv solve scene.toml\nporefv solve scene.toml --force --threads 1", "scene.md",
    )  # fmt: skip
    add_run_options(parser, force="replace results that exist")
    parser.set_defaults(command=run)


def run(options: argparse.Namespace) -> None:
    """Run the command."""
    from porefv.cli.compilation import announce_compilation
    from porefv.results.reading import read
    from porefv.scenes.flow_scene import FlowScene
    from porefv.system.progress import Progress
    from porefv.system.threads import limit_threads

    scene = FlowScene.read(options.scene)
    limit_threads(options.threads)
    progress = Progress(scene.stages, quiet=options.quiet)
    announce_compilation(progress)
    directory = scene.solve(force=options.force, progress=progress)
    if not options.quiet:
        say(outcome_text(read(directory)))


def outcome_text(results: Results) -> str:
    """What the command says when it is done."""
    summary = results.summary
    found = [f"{count_text(summary['packing']['spheres'])} spheres, {count_text(summary['mesh']['pores'])} pores"]
    if "permeability" in summary:
        found.append(f"permeability {summary['permeability']:.6g} m²")
    if "permeabilities" in summary:
        found.append(f"permeabilities {axes_text(summary['permeabilities'])} m²")
    if "forces" in summary:
        found.append(f"force balance {summary['forces']['conservation_residual']:.1e}")
    return f"{', '.join(found)}; {summary['seconds']['total']:.2f} s\nresults in {path_text(results.directory)}"
