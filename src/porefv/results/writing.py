"""A results directory: written whole or not at all.

A directory holds what was asked for of::

    summary.json   numbers of the whole sample, what was done and how long it took
    forces.csv     forces on every sphere, then on the six walls; or forces.npy, forces.parquet
    pores.vtu      the space-filling mesh: pressure, void volume and velocity of the pores
    profile.csv, pore_sizes.csv, constriction_sizes.csv, planes.csv   the tables of these quantities
    spheres.vtp    centres with radii and forces
    throats.vtp    the network: flux, conductance, hydraulic radius and length of the throats
"""

from __future__ import annotations

import os
import warnings
from collections.abc import Callable, Collection, Iterator
from contextlib import contextmanager
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Any

from porefv.errors import InputError, OutOfRangeWarning
from porefv.export.vtk_datasets import cells_grid, flux_data, spheres_polydata, throats_polydata
from porefv.export.vtk_files import attach_provenance, vtk_data_model, write_xml
from porefv.flow.directional_permeabilities import (
    DirectionalPermeabilities,
    directional_permeabilities,
    slip_of_impervious_walls,
)
from porefv.flow.pore_flow import PoreFlow
from porefv.flow.reynolds import inertia_warning
from porefv.mesh.pore_mesh import PoreMesh
from porefv.packing.free_space import wall_layers, warn_of_free_space
from porefv.results.force_table import FORCE_FILES, PARTS, write_forces
from porefv.results.quantity_tables import (
    SAMPLE_QUANTITIES,
    TABLES,
    TEN_LAYERS,
    Sections,
    compute_tables,
    quantity_summaries,
    write_tables,
)
from porefv.results.summary import summary_json, tested_reliability
from porefv.system.atomic_files import atomic_directory, check_is_no_root
from porefv.system.progress import Progress
from porefv.system.tables import check_table_format

if TYPE_CHECKING:
    from vtkmodules.vtkCommonDataModel import vtkPolyData, vtkUnstructuredGrid

# What `write` computes unless it is told.
USUAL_QUANTITIES = ("permeability", "pressure", "forces")
QUANTITIES = ("permeability", "permeabilities", *USUAL_QUANTITIES[1:], *SAMPLE_QUANTITIES)
FILES = (
    "summary.json", *FORCE_FILES.values(), *(table.file for table in TABLES.values()),
    "pores.vtu", "spheres.vtp", "throats.vtp",
)  # fmt: skip


def write(
    flow: PoreFlow,
    directory: str | PathLike[str],
    *,
    quantities: Collection[str] = USUAL_QUANTITIES,
    vtk: bool = True,
    table_format: str = "csv",
    sections: Sections = TEN_LAYERS,
    force: bool = False,
) -> Path:
    """Compute what is asked for, as far as it is not yet, and write a results directory.

    Parameters
    ----------
    flow : PoreFlow
    directory : path
        Made with its parents; must not exist, or be empty.
    quantities : collection of str
        Among `QUANTITIES`. "permeabilities" is as of `directional_permeabilities`, with the slip of the walls that
        fluid does not pass.
    vtk : bool
        Write pores.vtu, spheres.vtp and throats.vtp.
    table_format : str
        Of the table of forces: "csv", "npy" (an array of NumPy, as `Results.forces` is) or "parquet".
    sections : Sections
        Layers of the profile, and planes.
    force : bool
        Replace results that exist.

    Raises
    ------
    InputError
        For an unknown quantity or format, or if the results cannot be written: before anything is computed.
    """
    unknown = [quantity for quantity in quantities if quantity not in QUANTITIES]
    if unknown:
        raise InputError(f"unknown quantity {unknown[0]!r}; known: {', '.join(QUANTITIES)}")
    with writing(directory, force=force, vtk=vtk, table_format=table_format) as folder:
        save(
            folder, flow.mesh, flow, quantities=quantities, vtk=vtk, table_format=table_format, sections=sections,
            permeabilities=lambda: directional_permeabilities(
                flow.mesh, flow.fluid, flow.conductance, slip=slip_of_impervious_walls(flow.walls),
                solver=flow.solver, tolerance=flow.tolerance,
            ),
        )  # fmt: skip
    return Path(directory)


@contextmanager
def writing(directory: str | PathLike[str], *, force: bool, vtk: bool, table_format: str) -> Iterator[Path]:
    """A temporary folder that becomes the results directory if the block succeeds; see `check_target`."""
    check_target(directory, vtk=vtk, table_format=table_format)
    with atomic_directory(directory, force=force) as folder:
        yield folder


def check_target(directory: str | PathLike[str], *, vtk: bool, table_format: str) -> None:
    """Refuse, before anything is computed, a directory or files that cannot be written or replaced.

    Raises
    ------
    InputError
        If it holds results and other things besides, its parent is not writable, or the format is unknown.
    MissingExtraError
        If VTK or pyarrow is needed, and not installed.
    """
    check_table_format(table_format, "forces")
    if vtk:
        vtk_data_model()
    check_is_no_root(directory)
    directory = Path(directory)
    try:
        content = sorted(os.listdir(directory)) if directory.is_dir() else []
        existing = next(parent for parent in directory.absolute().parents if parent.exists())
    except OSError as error:
        raise InputError(f"cannot write {directory}: {error.strerror}.") from None
    foreign = [name for name in content if name not in FILES]
    if "summary.json" in content and foreign:
        raise InputError(
            f"{directory} holds {foreign[0]}, which is not a file of the results, and would be lost. "
            "Move it, or choose another directory."
        )
    if not (existing.is_dir() and os.access(existing, os.W_OK)):
        raise InputError(f"cannot write {directory}: {existing} is not a directory that may be written to.")


def stages(quantities: Collection[str], vtk: bool) -> tuple[str, ...]:
    """Stages of `save`, in order."""
    driven = any(quantity != "permeabilities" for quantity in quantities)
    asked = {
        "throats": driven,
        "pressure": driven,
        "forces": "forces" in quantities,
        "velocities": vtk and "pressure" in quantities,
        "quantities": bool(set(quantities) & set(SAMPLE_QUANTITIES)),
        "permeabilities": "permeabilities" in quantities,
    }
    return ("triangulation", *(stage for stage, wanted in asked.items() if wanted), "writing")


def save(
    folder: Path,
    mesh: PoreMesh,
    flow: PoreFlow | None,
    *,
    quantities: Collection[str],
    vtk: bool,
    table_format: str,
    sections: Sections = TEN_LAYERS,
    progress: Progress | None = None,
    permeabilities: Callable[[], DirectionalPermeabilities] | None = None,
    scene: str | None = None,
    packing: str | None = None,
) -> None:
    """Compute, stage by stage, and write into an empty folder; without a flow, the mesh alone.

    Parameters
    ----------
    folder : Path
        Exists, and is empty.
    mesh : PoreMesh
    flow : PoreFlow or None
        None: the mesh alone.
    quantities, vtk, table_format, sections
        As for `write`.
    progress : Progress, optional
        Has the stages that `stages` returns; quiet by default.
    permeabilities : function, optional
        Computes the permeabilities along all axes, if they are asked for.
    scene, packing : str, optional
        Names of the files, for summary.json.
    """
    progress = progress or Progress(quiet=True)
    tables, sample = {}, {}
    if flow is not None:
        sections.check(quantities, flow.walls, mesh.box)
    with progress.stage("triangulation"):
        mesh.n_pores  # noqa: B018 - computed here
    if flow is not None:
        with progress.stage("throats"):
            flow.conductances  # noqa: B018
        with progress.stage("pressure"):
            flow.solution  # noqa: B018
        if "forces" in quantities:
            with progress.stage("forces"):
                flow.forces  # noqa: B018
        if vtk and "pressure" in quantities:
            with progress.stage("velocities"):
                flow.pore_velocity  # noqa: B018
        if set(quantities) & set(SAMPLE_QUANTITIES):
            with progress.stage("quantities"):
                tables = compute_tables(flow, quantities, sections)
                sample = quantity_summaries(flow, quantities, tables, sections)
    along_axes = None
    if permeabilities is not None and "permeabilities" in quantities:
        with progress.stage("permeabilities"):
            along_axes = permeabilities()
    with progress.stage("writing"):
        if flow is not None and "forces" in quantities:
            write_forces(flow, folder / FORCE_FILES[table_format])
        write_tables(tables, folder)
        if vtk:
            _write_vtk(folder, mesh, flow, quantities, scene)
    reliability = None if flow is None else tested_reliability(flow)
    if reliability is not None and (said := reliability.warning):
        warnings.warn(said, OutOfRangeWarning, stacklevel=2)
    if flow is not None and flow.reynolds is not None and (said := inertia_warning(flow.reynolds)):
        warnings.warn(said, OutOfRangeWarning, stacklevel=2)
    layers = wall_layers(mesh.packing)
    warn_of_free_space(layers, mesh.packing)
    text = summary_json(
        mesh, flow, quantities=quantities, vtk=vtk, table_format=table_format, seconds=progress.seconds,
        layers=layers, sample=sample, permeabilities=along_axes, scene=scene, packing=packing,
    )  # fmt: skip
    (folder / "summary.json").write_text(text, encoding="utf-8")


def _write_vtk(
    folder: Path, mesh: PoreMesh, flow: PoreFlow | None, quantities: Collection[str], scene: str | None
) -> None:
    pores = {"volume": mesh.pore_volumes, "walls": mesh.pore_walls}
    throats = {
        "length": mesh.throats.lengths,
        "area": mesh.throats.areas,
        "fluid_area": mesh.throats.fluid_areas,
    }
    spheres, points = {}, {}
    provenance: dict[str, Any] = {"box_lower": mesh.box.lower, "box_upper": mesh.box.upper}
    if scene is not None:
        provenance["scene"] = scene
    if flow is not None:
        throats["hydraulic_radius"] = mesh.throats.hydraulic_radii(flow.walls.slip)
        throats["conductance"] = flow.conductances
        throats |= flux_data(mesh.throats, flow.flux, flow.walls.slip)
        provenance["viscosity"] = flow.fluid.viscosity
        if "pressure" in quantities:
            pores["pressure"] = points["pressure"] = flow.pressure
            pores["velocity"] = flow.pore_velocity
        if "forces" in quantities:
            # The names of the frames of `simulate`, where contacts press on grains, too.
            names = {part: "fluid_force" if part == "total" else f"{part}_force" for part in PARTS}
            spheres = {name: getattr(flow.forces, part) for part, name in names.items()}
    datasets: dict[str, vtkUnstructuredGrid | vtkPolyData] = {
        "pores.vtu": cells_grid(mesh, **pores),
        "spheres.vtp": spheres_polydata(mesh.packing, **spheres),
        "throats.vtp": throats_polydata(mesh.throats, points, **throats),
    }
    for name, dataset in datasets.items():
        attach_provenance(dataset, provenance)
        write_xml(dataset, folder / name)
