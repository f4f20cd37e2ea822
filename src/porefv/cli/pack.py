"""The command `porefv pack`: make a packing of spheres, and write its file."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING, Any

from porefv.cli.options import add_command, add_run_options
from porefv.cli.text import say
from porefv.errors import counted

if TYPE_CHECKING:
    from porefv.packing.packing import Packing
    from porefv.scenes.packing_scene import PackingScene


def register(commands: Any) -> None:
    """Add the command to the command line."""
    parser = add_command(
        commands, "pack", "make a packing of spheres, and write its file",
        "porefv pack packing.toml", "pack.md",
    )  # fmt: skip
    add_run_options(parser, force="replace a file that exists")
    parser.set_defaults(command=run)


def run(options: argparse.Namespace) -> None:
    """Run the command."""
    from porefv.cli.compilation import announce_compilation
    from porefv.scenes.packing_scene import PackingScene
    from porefv.system.progress import Progress
    from porefv.system.threads import limit_threads

    scene = PackingScene.read(options.scene)
    limit_threads(options.threads)
    progress = Progress(scene.stages, quiet=options.quiet)
    announce_compilation(progress)
    packing = scene.pack(force=options.force, progress=progress)
    if not options.quiet:
        say(outcome_text(packing, scene.output))


def outcome_text(packing: Packing, output: Path) -> str:
    """What the command says when it is done."""
    found = packing.metadata
    said = [
        f"{counted(len(packing), 'sphere')}, radii {packing.radii.min():.4g} to {packing.radii.max():.4g} m",
        f"porosity {packing.porosity:.4f}",
    ]
    if "mean_stress" in found:
        said[1] += f", mean stress {found['mean_stress']}"
        said.append(f"coordination {float(found['coordination']):.2f}, unbalanced force {found['unbalanced']}")
    return "\n".join([*said, f"packing in {output}"])


def scene_text(scene: PackingScene) -> str:
    """What `porefv check` says of the scene."""
    size = " × ".join(f"{length:g}" for length in scene.box.size)
    method = type(scene.method).__name__.lower()
    return f"{counted(scene.number, 'grain')} in a box of {size} m by {method}, seed {scene.seed}, to {scene.output}"
