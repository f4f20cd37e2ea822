"""The command `porefv reference`: the resolved flow of a scene, beside the scene's own method."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING, Any

from porefv.cli.options import add_command, add_run_options
from porefv.cli.text import say
from porefv.errors import InputError

if TYPE_CHECKING:
    from porefv.flow.pore_flow import PoreFlow
    from porefv.resolved.reference import StokesReference


def register(commands: Any) -> None:
    """Add the command to the command line."""
    parser = add_command(
        commands, "reference", "solve a scene by resolved Stokes flow, slow and exact, beside its own method",
        "porefv reference scene.toml\nporefv reference scene.toml --single --mesh-size 1", "reference.md",
    )  # fmt: skip
    add_run_options(parser, force="replace a file that exists")
    parser.add_argument("--out", metavar="FILE.json", type=Path, help="file to write; by the results directory's name")
    parser.add_argument("--order", type=int, default=3, help="of the velocity's polynomials, 2 to 4 (default 3)")
    parser.add_argument(
        "--mesh-size", type=float, default=0.5, help="of elements on a sphere, over its radius (default 0.5)"
    )
    parser.add_argument("--delta", type=float, default=0.03, help="of regularised contacts, over radii (default 0.03)")
    parser.add_argument("--contacts", default="caps", help="caps or bridges (default caps)")
    parser.add_argument("--single", action="store_true", help="one run, without refinement and error bars")
    parser.set_defaults(command=run)


def run(options: argparse.Namespace) -> None:
    """Run the command."""
    from porefv.resolved.refinement import STAGES, Options, require_ngsolve, stokes_reference
    from porefv.scenes.flow_scene import FlowScene
    from porefv.system.atomic_files import locked
    from porefv.system.progress import Progress

    require_ngsolve()
    fineness = Options(options.order, options.mesh_size, options.delta, options.contacts, options.single)
    scene = FlowScene.read(options.scene)
    scene.ensure_driven_by_pressures_of_walls()
    directory = scene.output.directory
    target = options.out or directory.with_name(f"{directory.name}_stokes.json")
    if options.out and not target.absolute().parent.is_dir():
        raise InputError(f"cannot write {target}: {target.parent} is not a directory")
    with locked(target):
        if target.exists() and not options.force:
            raise InputError(f"{target} exists already: choose another with --out, or add --force")
        mesh = scene.pore_mesh()
        progress = Progress(STAGES, quiet=options.quiet)
        reference = stokes_reference(
            mesh, scene.walls, scene.fluid.viscosity, fineness,
            name=options.scene.stem, progress=progress, threads=options.threads or 1,
        )  # fmt: skip
        reference.write(target)
    if not options.quiet:
        say(comparison_text(reference, scene.pore_flow(mesh)))
        say(f"resolved flow in {target}")


def comparison_text(reference: StokesReference, flow: PoreFlow) -> str:
    """The resolved flow and that of a conductance model, side by side."""
    import numpy as np

    def rms(error: np.ndarray, scale: np.ndarray) -> str:
        return f"{100.0 * np.sqrt((error**2).sum() / (scale**2).sum()):.2g} %"

    lines = [f"{'':24}{'resolved':>12}  {'error bar':>9}  {flow.conductance.name:>16}"]

    def row(title: str, value: float, error: float | None, model: float, unit: str) -> None:
        bar = "" if error is None else f"{100.0 * error / abs(value):.2g} %"
        lines.append(
            f"{title + ', ' + unit:24}{value:12.6g}  {bar:>9}  {model:16.6g}  {100 * (model / value - 1):+.1f} %"
        )

    errors, values, mesh = reference.errors, reference.values, flow.mesh
    if np.isfinite(reference.permeability):
        row("permeability", reference.permeability, errors.get("permeability"), flow.permeability, "m²")
    forces = values.sphere_total
    largest = int(np.linalg.norm(forces, axis=1).argmax())
    axis = int(np.abs(forces[largest]).argmax())
    row(
        f"force on sphere {largest}", forces[largest, axis], None,
        (flow.forces.pressure + flow.forces.viscous)[largest, axis], "N",
    )  # fmt: skip

    def differences(title: str, exact: np.ndarray, model: np.ndarray, error: float | None) -> None:
        bar = "" if error is None else f"{100.0 * error:.2g} %"
        lines.append(f"{title:24}{'':12}  {bar:>9}  {'':16}  {rms(model - exact, exact)}")

    differences("forces, rms", forces, flow.forces.pressure + flow.forces.viscous, errors.get("forces"))
    differences("fluxes of throats, rms", reference.throat_flux(mesh), flow.flux, errors.get("facet_flux"))
    for run in reference.runs:
        lines.append(
            f"mesh size {run.mesh_size:g}, δ {run.delta:g}: {run.elements} elements, {run.unknowns} unknowns, "
            f"permeability {run.permeability:.6g} m², {run.seconds:.0f} s"
        )
    return "\n".join(lines)
