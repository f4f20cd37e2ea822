"""The command `porefv simulate`."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING, Any

from porefv.cli.options import add_command, add_run_options
from porefv.cli.text import path_text, say
from porefv.errors import InputError, counted

if TYPE_CHECKING:
    from porefv.dem.dem import DEM
    from porefv.packing.packing import Packing
    from porefv.scenes.simulation_scene import SimulationScene
    from porefv.simulation.run_record import RunRecord


def register(commands: Any) -> None:
    """Add the command to the command line."""
    parser = add_command(
        commands, "simulate", "move grains, dry or in a fluid, through the stages of a scene",
        "porefv simulate scene.toml\nporefv simulate scene.toml --resume", "simulate.md",
    )  # fmt: skip
    add_run_options(parser, force="replace results that exist")
    parser.add_argument("--resume", action="store_true", help="go on from the last checkpoint")
    parser.set_defaults(command=run)


def run(options: argparse.Namespace) -> None:
    """Run the command."""
    from porefv.cli.compilation import announce_compilation
    from porefv.scenes.simulation_scene import SimulationScene
    from porefv.simulation import simulate
    from porefv.simulation.run_record import read_record
    from porefv.system.progress import Progress
    from porefv.system.threads import limit_threads

    if options.resume and options.force:
        raise InputError("--resume goes on with results that exist, --force replaces them: give one of the two")
    scene = SimulationScene.read(options.scene)
    limit_threads(options.threads)
    progress = Progress([stage.name for stage in scene.stages], quiet=options.quiet)
    announce_compilation(progress)
    directory = simulate.run(scene, force=options.force, resume=options.resume, progress=progress)
    if not options.quiet:
        say(outcome_text(read_record(directory), directory))


def outcome_text(record: RunRecord, directory: Path) -> str:
    """What the command says when it is done."""
    point = record.checkpoint
    lines = []
    if point is not None:
        steps = counted(point.step, "step")
        lines.append(f"{counted(len(record.spans), 'stage')}, {point.time:.6g} s in {steps}; {record.seconds:.2f} s")
    for found in record.permeability:
        lines.append(
            f"permeability {found.permeability:.4g} m², porosity {found.porosity:.4f} {found.when} {found.stage}"
        )
    if record.end_correction:
        where = ", ".join(f"{wall} by {depth:.3g} m" for wall, depth in record.end_correction.items())
        lines.append(f"end correction: {where} of the sample more")
    if record.validity:
        numbers = record.validity
        stokes = f", Stokes number at least {numbers['stokes_number']:.3g}" if "stokes_number" in numbers else ""
        lines.append(
            f"Reynolds number at most {numbers['reynolds_max']:.3g} (mean {numbers['reynolds_mean']:.3g}){stokes}"
        )
    if record.status != "complete":
        states = {"running": "running, or killed", "starting": "has only begun"}
        lines.append(f"not complete: {states.get(record.status, record.status)}")
    return "\n".join([*lines, f"results in {path_text(directory)}"])


def scene_text(scene: SimulationScene, packing: Packing, grains: DEM) -> str:
    """What `porefv check` says of a simulation."""
    size = " × ".join(f"{length:g}" for length in grains.box.size)
    lines = [
        f"read as {packing.reading}",
        f"{counted(len(grains), 'grain')} in a box of {size} m, porosity {grains.porosity:.4f}, "
        f"{grains.coordination:.1f} contacts a grain",
        f"steps of {grains.step:.3g} s; results to {scene.output.directory}",
    ]
    for number, stage in enumerate(scene.stages, 1):
        end = f"{stage.end:g} s" if isinstance(stage.end, float) else "until at rest"
        plates = ", ".join(
            f"{wall} {f'presses with {plate.stress:g} Pa' if plate.stress is not None else 'moves'}"
            for wall, plate in stage.plates.items()
        )
        what = "with fluid" if stage.fluid else "dry"
        lines.append(f"  {number}. {stage.name}: {what}, {end}{f'; {plates}' if plates else ''}")
    return "\n".join(lines)
