"""FlowScene: a steady flow to compute, of what, and where to put it; from a TOML file, checked at the edge."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Self

from pydantic import Field, model_validator

from porefv.conductance.model import ConductanceModel
from porefv.errors import InputError
from porefv.flow.directional_permeabilities import (
    DirectionalPermeabilities,
    directional_permeabilities,
    slip_of_impervious_walls,
)
from porefv.flow.fluid import Fluid
from porefv.flow.inside import FixedPressure, FlowSource, imposed_inside
from porefv.flow.pore_flow import PoreFlow
from porefv.flow.walls import Wall, Walls, condition_text
from porefv.mesh.pore_mesh import PoreMesh
from porefv.packing.box import WALLS, Box
from porefv.packing.free_space import wall_layers, warn_of_free_space
from porefv.packing.packing import Packing
from porefv.results.quantity_tables import Sections
from porefv.results.writing import QUANTITIES, check_target, save, stages, writing
from porefv.scenes.errors import input_error, refused
from porefv.scenes.region_tables import FixedPressureTable, SourceTable
from porefv.scenes.shared_tables import (
    BoxOrFit,
    BoxTable,
    ConductanceTable,
    FluidTable,
    LateralTable,
    PackingFile,
    PathOrTable,
    SixWalls,
)
from porefv.scenes.table import MadeFrom, Scene, Table
from porefv.scenes.toml_file import SceneSource
from porefv.scenes.values import Choice, Choices, Limits, Numbers, ScenePath, Vector, Whole, key
from porefv.solvers.solver import SOLVERS, TOLERANCE
from porefv.system.progress import Progress
from porefv.system.tables import TABLE_FORMATS

PartOfRadius = Annotated[float, Limits("must lie in [0, 1) (a fraction of a radius)", least=0.0, below=1.0)]
# A centre lies in the box: no sphere reaches further beyond a wall than its radius.
Reach = Annotated[float, Limits("must lie in [0, 1] (a fraction of a radius)", least=0.0, most=1.0)]


class WallTable(Table):
    """What a wall does to the fluid."""

    pressure: float | None = key(
        "imposed piezometric pressure. A wall with neither this nor an imposed flow is impervious. Not for `lateral`",
        None,
        unit="Pa",
    )
    slip: bool = key(
        "whether the fluid slips along the wall, as along a plane of symmetry. If not, the wall drags it", False
    )

    inflow: float | None = key(
        "instead of `pressure`: imposed flow into the sample, negative out of it. The wall has "
        "[one pressure, which is found](boundary.md#a-flow-through-a-wall)",
        None,
        unit="m³/s",
    )
    velocity: float | None = key(
        "instead of `inflow`: imposed Darcy velocity into the sample, which is the flow over the area of the wall",
        None,
        unit="m/s",
    )

    def make(self) -> Wall:
        return Wall(self.pressure, self.slip, self.inflow, self.velocity)


class WallsTable(SixWalls[Annotated[Wall, MadeFrom(WallTable)]]):
    """What the walls do to the fluid."""

    lateral: LateralTable = key("all walls that are not named", {})

    def make(self) -> Walls:
        return Walls(**dict.fromkeys(WALLS, Wall(slip=self.lateral.slip)) | self.named())


class MeshOptions(Table):
    """Tolerances of the mesh of pores, as the parameters of `PoreMesh`."""

    unite_tolerance: PartOfRadius = key(
        "cells whose Laguerre vertices are closer than this fraction of the smallest radius around are "
        "[one pore](theory_method.md#united-pores)",
        0.01,
    )
    wall_tolerance: Reach = key("the largest fraction of its radius by which a sphere may reach beyond a wall", 0.05)


@dataclass(frozen=True)
class FlowOptions:
    """As the parameters of `PoreFlow`."""

    conductance: ConductanceModel
    solver: str
    tolerance: float
    gravity: tuple[float, float, float]


class FlowTable(ConductanceTable):
    """How the flow is computed."""

    solver: Annotated[str, Choice(SOLVERS)] = key(
        'how the pressures are solved for: `"direct"`, `"cg"`, or the one fit for the size', "auto"
    )
    tolerance: Annotated[
        float, Limits("must lie between 0 and 1 (a bound on the relative residual)", above=0.0, below=1.0)
    ] = key("bound on the [imbalance](theory_method.md#solver) of the pressures, between 0 and 1", TOLERANCE)
    gravity: Vector = key("acceleration of gravity, for buoyancy", (0.0, 0.0, 0.0), unit="m/s²")

    def make(self) -> FlowOptions:
        return FlowOptions(self.conductance_model(), self.solver, self.tolerance, self.gravity)


class FlowOutput(Table):
    """What is computed and written, and where."""

    directory: ScenePath = key(
        "where the results go. Existing results are replaced with `porefv solve --force` only",
        "results",
    )
    quantities: Annotated[tuple[str, ...], Choices(QUANTITIES)] = key(
        'what is computed: any of `"permeability"`, `"permeabilities"` (along x, y and z, see '
        '[directions](boundary.md#permeabilities-along-all-axes)), `"pressure"`, `"forces"`, and of the '
        '[quantities of the sample](quantities.md) `"profile"`, `"pore_sizes"`, `"constriction_sizes"`, '
        '`"tortuosity"`, `"diffusion"`, `"velocity"`, `"planes"`. An empty list computes the pores alone',
        ("permeability",),
    )
    vtk: bool = key("whether to write the files for [ParaView](paraview.md) and for `porefv plot`, too", False)
    table_format: Annotated[str, Choice(TABLE_FORMATS)] = key(
        'format of the table of forces: `"csv"`, or for many spheres `"npy"` (NumPy) or `"parquet"`, which needs '
        "pyarrow",
        "csv",
    )
    axis: Annotated[str, Choice(("x", "y", "z"))] | None = key(
        'axis normal to the layers and planes, and of `"diffusion"`: `"x"`, `"y"` or `"z"`',
        None,
        shown="the axis of flow",
    )
    layers: Annotated[int, Whole(least=1)] = key('number of equally thick layers of `"profile"`', 10)
    planes: Annotated[tuple[float, ...], Numbers("a list of finite numbers such as [0.25, 0.5]")] | None = key(
        'places of `"planes"` along the axis, inside the box', None, unit="m", shown="between the layers"
    )

    @property
    def sections(self) -> Sections:
        """Layers and planes."""
        return Sections(self.axis, self.layers, self.planes)


class FlowScene(Scene):
    """A steady flow through a packing that does not move.

    Attributes
    ----------
    packing : PackingFile
    box : Box, str or None
        None: the box is in the packing file.
    fluid : Fluid
    walls : Walls
    sources : tuple of FlowSource
    pressures : tuple of FixedPressure
    mesh : MeshOptions
    flow : FlowOptions
    output : FlowOutput
    path : Path or None
        The scene file.

    Examples
    --------
    >>> scene = FlowScene.read("data/scenes/n25.toml")  # doctest: +SKIP
    >>> print(scene.pore_flow().permeability)  # doctest: +SKIP
    """

    packing: Annotated[PackingFile, PathOrTable()] = key("the packing file: a path, or the table `[packing]`")
    box: Annotated[Box | str, BoxOrFit(BoxTable)] | None = key(
        'the box that confines the packing: the table `[box]`, or `"fit"` (each wall touches the outermost sphere), or '
        '`"bed"` (so do walls with free space; the others are those of the file)',
        None,
        shown="from the packing file",
    )
    fluid: Annotated[Fluid, MadeFrom(FluidTable)] = key("the table `[fluid]`: what fills the pores", {})
    walls: Annotated[Walls, MadeFrom(WallsTable)] = key("the table `[walls]`: what the walls do to the fluid", {})
    sources: Annotated[tuple[Annotated[FlowSource, MadeFrom(SourceTable)], ...], Field(strict=False)] = key(
        "a table `[[sources]]` for each flow into a region of the packing", (), shown="none"
    )
    pressures: Annotated[tuple[Annotated[FixedPressure, MadeFrom(FixedPressureTable)], ...], Field(strict=False)] = key(
        "a table `[[pressures]]` for each region whose pores have a given pressure", (), shown="none"
    )
    mesh: MeshOptions = key("the table `[mesh]`: tolerances of the mesh of pores", {})
    flow: Annotated[FlowOptions, MadeFrom(FlowTable)] = key("the table `[flow]`: how the flow is computed", {})
    output: FlowOutput = key("the table `[output]`: what is computed and written, and where", {})

    @model_validator(mode="after")
    def _is_driven(self) -> Self:
        """The walls and regions drive what is asked for."""
        asked = self.output.quantities
        if "permeabilities" in asked:
            try:
                slip_of_impervious_walls(self.walls)
            except InputError as error:
                raise refused(str(error), "walls") from None
        if not self.driven:
            return self
        passed = [
            (name, wall)
            for name, wall in zip(WALLS, self.walls, strict=True)
            if wall.pressure is not None or wall.imposes_flow
        ]
        if not passed and not self.pressures:
            raise refused(
                f"no wall has a pressure, and {', '.join(self.driven)} cannot be computed without. "
                "Give for instance\n[walls]\ny_min = { pressure = 1.0 }\ny_max = { pressure = 0.0 }"
            )
        axis, pressures = self.walls.axis, self.walls.pressures
        stopped = [name for name, wall in passed if 0.0 in (wall.inflow, wall.velocity)]
        if "permeability" in asked and axis is not None and stopped:
            wall = next(wall for name, wall in passed if name == stopped[0])
            raise refused(
                f"the flow imposed on {stopped[0]} is zero: nothing flows from wall to wall, and there is no "
                "permeability. Give a flow other than zero, or drop permeability from the quantities.",
                "walls", stopped[0], "inflow" if wall.inflow is not None else "velocity",
            )  # fmt: skip
        if "permeability" in asked:
            described = ", ".join(f"{name} at {condition_text(vars(wall))}" for name, wall in passed)
            if axis is None or pressures[2 * axis] == pressures[2 * axis + 1]:
                raise refused(
                    "permeability needs exactly two pressure walls, opposite each other and at "
                    f"different pressures; there are {described}. Change [walls], or drop it from the quantities."
                )
            if self.sources or self.pressures:
                raise refused(
                    "permeability is that between two walls, without [[sources]] and [[pressures]]. Drop it from the "
                    "quantities, or drop these tables."
                )
        for quantity in ("profile", "planes", "diffusion"):
            if quantity in asked and axis is None and self.output.axis is None:
                raise refused(
                    f"{quantity} needs an axis, and the pressure walls are not one pair of opposite walls. "
                    'Give in [output] for instance\naxis = "y"'
                )
        if "tortuosity" in asked and (axis is None or self.sources or self.pressures):
            raise refused(
                "tortuosity needs exactly two pressure walls, opposite each other, and no regions that drive. "
                "Change [walls], or drop it from the quantities."
            )
        return self

    @property
    def driven(self) -> tuple[str, ...]:
        """The quantities that need the flow of the walls and regions of the scene."""
        return tuple(name for name in self.output.quantities if name != "permeabilities")

    def ensure_driven_by_pressures_of_walls(self) -> None:
        """InputError if anything but pressures of walls drives the flow."""
        if self.walls.imposes_flow.any() or self.sources or self.pressures:
            raise InputError(
                f"{self.path or 'scene'}: only flows that pressures of walls drive can be compared and resolved; drop "
                "imposed flows, [[sources]] and [[pressures]]"
            )

    def read_packing(self) -> Packing:
        """The packing, in the scene's box or its own."""
        return self.packing.read(self.path, self.box)

    def pore_mesh(self, packing: Packing | None = None) -> PoreMesh:
        """The mesh of the packing, which is read and validated."""
        return PoreMesh(self.read_packing() if packing is None else packing, **dict(self.mesh))

    def pore_flow(self, mesh: PoreMesh | None = None) -> PoreFlow:
        """The flow through the packing: nothing is computed yet.

        Raises
        ------
        InputError
            If what is imposed on walls and regions contradicts itself, or lies outside the box.
        """
        mesh = self.pore_mesh() if mesh is None else mesh
        try:
            return PoreFlow(
                mesh, self.walls, self.fluid, self.flow.conductance, gravity=self.flow.gravity, sources=self.sources,
                fixed_pressures=self.pressures, solver=self.flow.solver, tolerance=self.flow.tolerance,
            )  # fmt: skip
        except InputError as error:
            raise InputError(f"{self.path or 'scene'}: {error}") from None

    def permeabilities(self, mesh: PoreMesh | None = None) -> DirectionalPermeabilities:
        """Permeabilities along all axes, with the slip of the scene's walls that fluid does not pass."""
        return directional_permeabilities(
            self.pore_mesh() if mesh is None else mesh, self.fluid, self.flow.conductance,
            slip=slip_of_impervious_walls(self.walls), solver=self.flow.solver, tolerance=self.flow.tolerance,
        )  # fmt: skip

    def _check_sections(self, box: Box) -> None:
        """InputError, with the line of the key, for planes outside the box."""
        try:
            self.output.sections.check(self.output.quantities, self.walls, box)
        except InputError as error:
            source = SceneSource.read(self.path) if self.path else SceneSource(dict(self.data))
            raise input_error(refused(str(error), "output", "planes"), source) from None

    def solve(self, *, force: bool = False, progress: Progress | None = None) -> Path:
        """Compute what `output` asks for, and write the results directory.

        Parameters
        ----------
        force : bool
            Replace results that exist.
        progress : Progress, optional
            Its stages are those of `stages`.

        Returns
        -------
        Path
            The directory.

        Raises
        ------
        InputError
            If the packing is not fit for use, or the results cannot be written; before anything is computed.
        ComputationError
            If the computation fails; nothing is written.
        """
        progress = progress or Progress(self.stages, quiet=True)
        output = self.output
        with writing(output.directory, force=force, vtk=output.vtk, table_format=output.table_format) as folder:
            with progress.stage("reading"):
                packing = self.read_packing()
            with progress.stage("validation"):
                mesh = self.pore_mesh(packing)
            self._check_sections(mesh.box)
            flow = self.pore_flow(mesh) if self.driven else None
            save(
                folder, mesh, flow, quantities=output.quantities, vtk=output.vtk, table_format=output.table_format,
                sections=output.sections, progress=progress, permeabilities=lambda: self.permeabilities(mesh),
                scene=str(self.path) if self.path else None, packing=str(self.packing.file),
            )  # fmt: skip
        return output.directory

    @property
    def stages(self) -> tuple[str, ...]:
        """Stages of `solve`, in order."""
        return ("reading", "validation", *stages(self.output.quantities, self.output.vtk))

    def check(self) -> Packing:
        """Read and validate everything `solve` would, computing no flow; the packing.

        The mesh is built only if the scene has regions, to find those without pores.

        Raises
        ------
        InputError
            As `solve`, save that results may exist.
        """
        check_target(self.output.directory, vtk=self.output.vtk, table_format=self.output.table_format)
        mesh = self.pore_mesh()
        warn_of_free_space(wall_layers(mesh.packing), mesh.packing)
        if self.driven:
            self.pore_flow(mesh)
            if self.sources or self.pressures:
                try:
                    imposed_inside(mesh, self.walls, self.sources, self.pressures)
                except InputError as error:
                    raise InputError(f"{self.path or 'scene'}: {error}") from None
        self._check_sections(mesh.box)
        return mesh.packing
