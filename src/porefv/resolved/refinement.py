"""The resolved flow through a packing: a coarse and a fine mesh, and contacts closed to two degrees."""

from __future__ import annotations

import time
from contextlib import nullcontext
from dataclasses import dataclass
from importlib.util import find_spec

import numpy as np

from porefv.errors import InputError, MissingExtraError
from porefv.flow.walls import Walls
from porefv.mesh.pore_mesh import PoreMesh
from porefv.resolved.fluid_geometry import REGULARISATIONS, contacts
from porefv.resolved.reference import (
    Run,
    StokesReference,
    Values,
    distances,
    ensure_driven,
    permeability_of,
    read_off,
    versions,
)
from porefv.system.progress import Progress

STAGES = ("meshing", "assembly", "solve", "reading off")


@dataclass(frozen=True)
class Options:
    """How finely to resolve.

    Parameters
    ----------
    order : int
        Of the velocity's polynomials, 2 to 4; the pressure's is one less.
    mesh_size : float
        Elements on a sphere over its radius, on the finer mesh.
    delta : float
        δ of the regularised contacts, the larger one; half of it is the other.
    contacts : str
        caps or bridges.
    single : bool
        One run only, without error bars.
    """

    order: int = 3
    mesh_size: float = 0.5
    delta: float = 0.03
    contacts: str = "caps"
    single: bool = False

    def __post_init__(self) -> None:
        if self.order not in (2, 3, 4):
            raise InputError(f"order must be 2, 3 or 4, not {self.order!r}")
        if not 0.05 <= self.mesh_size <= 2.0:
            raise InputError(f"mesh size must lie between 0.05 and 2 radii, not {self.mesh_size!r}")
        if not 0.001 <= self.delta <= 0.2:
            raise InputError(f"delta must lie between 0.001 and 0.2 radii, not {self.delta!r}")
        if self.contacts not in REGULARISATIONS:
            raise InputError(f"contacts must be one of {', '.join(REGULARISATIONS)}, not {self.contacts!r}")


def stokes_reference(
    mesh: PoreMesh,
    walls: Walls,
    viscosity: float = 1.0,
    options: Options | None = None,
    *,
    name: str = "",
    progress: Progress | None = None,
    threads: int = 1,
) -> StokesReference:
    """Resolved Stokes flow through a packing.

    Three runs, or two where nothing touches: a coarser mesh, the mesh asked for, and δ halved on it. Values are
    extrapolated to δ = 0 by the known exponent; error bars are the difference between the meshes plus half of what the
    extrapolation adds.

    Parameters
    ----------
    mesh : PoreMesh
        Its packing and box bound the fluid; values are read off on its facets and cells.
    walls : Walls
        At least one must have a pressure.
    viscosity : float
        Dynamic viscosity of the fluid [Pa s].
    options : Options, optional
        How finely to resolve; `Options()` by default.
    name : str
        Name of the reference that is returned.
    progress : Progress, optional
        Has the stages `STAGES`; quiet by default.
    threads : int
        Number of threads that NGSolve uses.

    Raises
    ------
    MissingExtraError
        If ngsolve is not installed.
    InputError
        If no wall has a pressure.
    ComputationError
        If meshing or the solution fails, or memory will not do.
    """
    require_ngsolve()
    options = options or Options()
    progress = progress or Progress(STAGES, quiet=True)
    ensure_driven(walls)
    levels = [(options.mesh_size, options.delta)]
    if not options.single:
        levels.insert(0, (1.5 * options.mesh_size, options.delta))
        if _touching(mesh, options.delta):
            levels.append((options.mesh_size, 0.5 * options.delta))
    import ngsolve as ngs

    # Idle threads of NGSolve spin: on a busy machine two of them are slower than one.
    ngs.SetNumThreads(threads)
    with ngs.TaskManager() if threads > 1 else nullcontext():
        found = [_run(mesh, walls, viscosity, options, *level, progress) for level in levels]
    values = found[-1][0]
    if len(levels) == 3:
        factor = 1.0 / (2.0 ** REGULARISATIONS[options.contacts] - 1.0)
        values = values.extrapolated(found[1][0], factor)
    errors = {} if options.single else _errors([v for v, _ in found], values, mesh, walls, viscosity)
    return StokesReference(
        name=name,
        method="finite-elements",
        packing=mesh.packing,
        walls=walls,
        viscosity=viscosity,
        values=values,
        errors=errors,
        permeability=permeability_of(values, mesh, walls, viscosity),
        order=options.order,
        contacts=options.contacts,
        runs=[run for _, run in found],
        cells=mesh.cells,
        facet_vertices=mesh.facets.vertices,
        facet_cells=mesh.facets.cells,
        face_cells=mesh.wall_faces.cells,
        face_walls=mesh.wall_faces.walls,
        versions=versions("numpy", "ngsolve", "netgen-mesher"),
    )


def has_ngsolve() -> bool:
    """Whether the extra is installed."""
    return all(find_spec(name) is not None for name in ("netgen", "ngsolve"))


def require_ngsolve() -> None:
    """MissingExtraError if the extra is not installed."""
    if not has_ngsolve():
        raise MissingExtraError("ngsolve", "A resolved Stokes reference by finite elements")


def _touching(mesh: PoreMesh, delta: float) -> bool:
    packing, box = mesh.packing, mesh.box
    return bool(contacts(packing.centres, packing.radii, box.lower, box.upper, delta))


def _run(
    mesh: PoreMesh,
    walls: Walls,
    viscosity: float,
    options: Options,
    mesh_size: float,
    delta: float,
    progress: Progress,
) -> tuple[Values, Run]:
    from porefv.resolved.fluid_mesh import fluid_mesh
    from porefv.resolved.stokes import solve_stokes

    begin = time.perf_counter()
    packing, box = mesh.packing, mesh.box
    length = float(box.size.max())
    low = float(np.nanmin(walls.pressures))
    drop = float(np.nanmax(walls.pressures)) - low
    with progress.stage("meshing"):
        domain = fluid_mesh(
            (packing.centres - box.lower) / length, packing.radii / length, np.zeros(3), box.size / length,
            order=options.order, mesh_size=mesh_size, delta=delta, regularisation=options.contacts,
        )  # fmt: skip
    field = solve_stokes(domain, options.order, (walls.pressures - low) / (drop or 1.0), walls.slip, progress)
    with progress.stage("reading off"):
        values, imbalance = read_off(field, mesh, viscosity, low, drop)
    run = Run(
        mesh_size=mesh_size,
        delta=delta,
        elements=domain.mesh.ne,
        unknowns=field.unknowns,
        straightened=domain.straightened,
        seconds=round(time.perf_counter() - begin, 2),
        permeability=permeability_of(values, mesh, walls, viscosity),
        thrust_residual=field.residual,
        flux_imbalance=imbalance,
    )
    progress.note(f"mesh size {mesh_size:g}, δ {delta:g}: permeability {run.permeability:.6g} m², {run.seconds:.0f} s")
    return values, run


def _errors(levels: list[Values], values: Values, mesh: PoreMesh, walls: Walls, viscosity: float) -> dict[str, float]:
    """Error bars: between the two meshes, and half of what was extrapolated."""

    def permeability(of: Values) -> float:
        return permeability_of(of, mesh, walls, viscosity)

    coarse, fine, last = levels[0], levels[1], levels[-1]
    errors = {
        "permeability": abs(permeability(fine) - permeability(coarse))
        + 0.5 * abs(permeability(values) - permeability(last))
    }
    meshes, extrapolation = distances(fine, coarse, values), distances(values, last, values)
    return errors | {name: meshes[name] + 0.5 * extrapolation[name] for name in meshes}
