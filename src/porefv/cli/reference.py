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


# Spheres up to which finite elements are the default, where they are installed.
_ELEMENTS_UP_TO = 50


def register(commands: Any) -> None:
    """Add the command to the command line."""
    parser = add_command(
        commands, "reference", "solve a scene by resolved Stokes flow, slow and exact, beside its own method",
        "porefv reference scene.toml\nporefv reference scene.toml --single --mesh-size 1", "reference.md",
    )  # fmt: skip
    add_run_options(parser, force="replace a file that exists")
    parser.add_argument("--out", metavar="FILE.json", type=Path, help="file to write; by the results directory's name")
    parser.add_argument(
        "--method", choices=("auto", "finite-elements", "lattice-boltzmann"), default="auto",
        help="auto: finite elements up to 50 spheres where they are installed, or else a lattice",
    )  # fmt: skip
    parser.add_argument("--nodes", type=float, default=12.0, help="of the lattice in the mean radius (default 12)")
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
    from porefv.resolved.lattice_reference import STAGES as LATTICE_STAGES
    from porefv.resolved.lattice_reference import LatticeOptions, cost, lattice_reference
    from porefv.resolved.refinement import STAGES, Options, has_ngsolve, require_ngsolve, stokes_reference
    from porefv.scenes.flow_scene import FlowScene
    from porefv.system.atomic_files import locked
    from porefv.system.progress import Progress

    if options.method == "finite-elements":
        require_ngsolve()
    fineness = Options(options.order, options.mesh_size, options.delta, options.contacts, options.single)
    lattice = LatticeOptions(options.nodes, options.single)
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
        by_elements = options.method == "finite-elements" or (
            options.method == "auto" and mesh.n_spheres <= _ELEMENTS_UP_TO and has_ngsolve()
        )
        if by_elements:
            reference = stokes_reference(
                mesh, scene.walls, scene.fluid.viscosity, fineness, name=options.scene.stem,
                progress=Progress(STAGES, quiet=options.quiet), threads=options.threads or 1,
            )  # fmt: skip
        else:
            if not options.quiet:
                say(f"lattice: {cost(mesh, lattice)}")
            reference = lattice_reference(
                mesh, scene.walls, scene.fluid.viscosity, lattice, name=options.scene.stem,
                progress=Progress(LATTICE_STAGES, quiet=options.quiet), threads=options.threads,
                state=target.with_name(f".{target.name}.porefv-state"),
            )  # fmt: skip
        reference.write(target)
    if not options.quiet:
        say(comparison_text(reference, scene.pore_flow(mesh)))
        say(f"resolved flow in {target}")


def comparison_text(reference: StokesReference, flow: PoreFlow) -> str:
    """The resolved flow and that of a conductance model, side by side."""
    import numpy as np

    from porefv.resolved.reference import LatticeRun

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
        if isinstance(run, LatticeRun):
            how = f"{run.nodes:g} nodes in a radius: {run.fluid_nodes} nodes in the fluid, {run.steps} steps"
        else:
            how = f"mesh size {run.mesh_size:g}, δ {run.delta:g}: {run.elements} elements, {run.unknowns} unknowns"
        lines.append(f"{how}, permeability {run.permeability:.6g} m², {run.seconds:.0f} s")
    return "\n".join(lines)
