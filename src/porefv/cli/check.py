"""The command `porefv check`: validate a scene and its packing without computing."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING, Any

from porefv.cli.options import add_command
from porefv.cli.packing_text import is_packing_file, packing_text
from porefv.cli.text import count_text, path_text, range_text, rows_text, say, vector_text, walls_text

if TYPE_CHECKING:
    from porefv.packing.packing import Packing
    from porefv.scenes.flow_scene import FlowScene


def register(commands: Any) -> None:
    """Add the command to the command line."""
    parser = add_command(
        commands, "check", "validate a scene and its packing, or a packing file, without computing",
        "porefv check scene.toml\nporefv check packing.csv", "formats.md",
    )  # fmt: skip
    parser.add_argument("scene", metavar="SCENE.toml", type=Path, help="scene, or packing file")
    parser.set_defaults(command=run)


def run(options: argparse.Namespace) -> None:
    """Run the command."""
    from porefv.cli.compilation import announce_compilation
    from porefv.scenes.toml_file import SceneSource
    from porefv.system.progress import Progress

    progress = Progress()
    announce_compilation(progress)
    if is_packing_file(options.scene):
        from porefv.packing.packing import Packing

        packing = Packing.read(options.scene)
        if packing.walled_box is not None:
            packing.validate()
        say(f"{packing_text(packing, options.scene)}\nno errors")
        return
    keys = SceneSource.read(options.scene).data
    if "stages" in keys:
        from porefv.cli import simulate
        from porefv.scenes.simulation_scene import SimulationScene
        from porefv.simulation.simulate import check

        simulation = SimulationScene.read(options.scene)
        with progress.stage("validation"):
            packing = simulation.read_packing()
            grains = check(simulation, packing)
        say(simulate.scene_text(simulation, packing, grains))
    elif "grains" in keys:
        from porefv.cli import pack
        from porefv.scenes.packing_scene import PackingScene

        say(pack.scene_text(PackingScene.read(options.scene)))
    else:
        from porefv.scenes.flow_scene import FlowScene

        scene = FlowScene.read(options.scene)
        with progress.stage("validation"):
            packing = scene.check()
        say(scene_text(scene, packing))


def scene_text(scene: FlowScene, packing: Packing) -> str:
    """What a scene asks for, and the packing it is about."""
    from porefv.flow.regions import region_text
    from porefv.packing.box import WALLS
    from porefv.packing.memory_estimate import required
    from porefv.system.memory import available

    overlaps = packing.overlaps
    box = packing.walled_box
    assert box is not None  # the scene has seen to it
    walls = {name: vars(wall) for name, wall in zip(WALLS, scene.walls, strict=True)}
    fluid, flow, output = scene.fluid, scene.flow, scene.output
    asked = ", ".join(output.quantities) or "the pores alone"
    directory = output.directory
    exists = " (exists: solve needs --force)" if directory.is_dir() and any(directory.iterdir()) else ""
    rows = [
        (
            "packing",
            f"{path_text(scene.packing.file)}: {count_text(len(packing))} spheres, radii {range_text(packing.radii)} m",
        ),
        ("reading", str(packing.reading)),
        (
            "overlaps",
            f"{count_text(len(overlaps.pairs))} pairs of spheres, {count_text(len(overlaps.wall_ids))} across walls",
        ),
        ("box", f"{vector_text(box.lower)} to {vector_text(box.upper)} m"),
        ("fluid", f"viscosity {fluid.viscosity:g} Pa s, density {fluid.density:g} kg/m³"),
        ("walls", walls_text(walls)),
        *(("source", f"{source.flow:g} m³/s in {region_text(source.region)}") for source in scene.sources),
        *(("fixed pressure", f"{p.pressure:g} Pa in {region_text(p.region)}") for p in scene.pressures),
        ("flow", f"{flow.conductance.name}, solver {flow.solver}, gravity {vector_text(flow.gravity)} m/s²"),
        (
            "output",
            f"{asked}{'; VTK files' if output.vtk else ''}, in {path_text(directory)}{exists}",
        ),
    ]
    free = available()
    needed = f"about {required(len(packing)) / 2**30:.1f} GiB at the most"
    rows.append(("memory", needed if free is None else f"{needed}, {free / 2**30:.1f} GiB free"))
    return "\n".join([f"{path_text(scene.path or 'scene')} has no errors", *rows_text(rows)])
