"""FlowScene: a steady flow to compute, of what, and where to put it; from a TOML file, checked at the edge."""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass
from pathlib import Path

from porefv.conductance.model import ConductanceModel
from porefv.errors import InputError
from porefv.flow.fluid import Fluid
from porefv.flow.pore_flow import PoreFlow
from porefv.flow.walls import Walls
from porefv.mesh.pore_mesh import PoreMesh
from porefv.packing.box import WALLS, Box
from porefv.packing.packing import Packing
from porefv.results.writing import QUANTITIES, check_target, save, stages, writing
from porefv.scenes.shared_tables import PackingFile, read_conductance, read_fluid, read_packing_file
from porefv.scenes.table import SceneFile, Table
from porefv.solvers.solver import SOLVERS
from porefv.system.progress import Progress


@dataclass(frozen=True)
class MeshOptions:
    """As the parameters of `PoreMesh`; None leaves its default."""

    unite_tolerance: float | None = None
    wall_tolerance: float | None = None


@dataclass(frozen=True)
class FlowOptions:
    """As the parameters of `PoreFlow`; a `tolerance` of None leaves its default."""

    conductance: ConductanceModel
    solver: str
    tolerance: float | None
    gravity: tuple[float, float, float]


@dataclass(frozen=True)
class Output:
    """Which of `porefv.results.directory.QUANTITIES` to compute, whether to write VTK files, and where."""

    directory: Path
    quantities: tuple[str, ...]
    vtk: bool


@dataclass(frozen=True)
class FlowScene(SceneFile):
    """A computation, ready to run.

    Attributes
    ----------
    packing : PackingFile
    box : Box or None
        None: the box is in the packing file.
    fluid : Fluid
    walls : Walls
    mesh : MeshOptions
    flow : FlowOptions
    output : Output
    path : Path or None
        The scene file.

    Examples
    --------
    >>> scene = FlowScene.read("data/scenes/n25.toml")  # doctest: +SKIP
    >>> print(scene.pore_flow().permeability)  # doctest: +SKIP
    """

    packing: PackingFile
    box: Box | None
    fluid: Fluid
    walls: Walls
    mesh: MeshOptions
    flow: FlowOptions
    output: Output
    path: Path | None = None

    @classmethod
    def from_table(cls, top: Table, directory: Path, path: Path | None = None) -> FlowScene:
        """The scene that a table says; relative paths in it are relative to `directory`."""
        return _scene(top, directory, path)

    def read_packing(self) -> Packing:
        """The packing, in the scene's box or its own."""
        packing = Packing.read(self.packing.file, format=self.packing.format, box=self.box)
        if packing.box is None:
            raise InputError(
                f"{self.path or 'scene'}: {self.packing.file} holds no box; give one in the scene:\n"
                "[box]\nlower = [0.0, 0.0, 0.0]\nupper = [1.0, 1.0, 1.0]"
            )
        return packing

    def pore_mesh(self, packing: Packing | None = None) -> PoreMesh:
        """The mesh of the packing, which is read and validated."""
        options = {name: x for name, x in dataclasses.asdict(self.mesh).items() if x is not None}
        return PoreMesh(self.read_packing() if packing is None else packing, **options)

    def pore_flow(self, mesh: PoreMesh | None = None) -> PoreFlow:
        """The flow through the packing: nothing is computed yet."""
        tolerance = {} if self.flow.tolerance is None else {"tolerance": self.flow.tolerance}
        return PoreFlow(
            self.pore_mesh() if mesh is None else mesh,
            self.walls,
            self.fluid,
            self.flow.conductance,
            gravity=self.flow.gravity,
            solver=self.flow.solver,
            **tolerance,
        )

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
        with writing(output.directory, force=force, vtk=output.vtk) as folder:
            with progress.stage("reading"):
                packing = self.read_packing()
            with progress.stage("validation"):
                mesh = self.pore_mesh(packing)
            flow = self.pore_flow(mesh) if output.quantities else None
            save(
                folder, mesh, flow, quantities=output.quantities, vtk=output.vtk, progress=progress,
                scene=str(self.path) if self.path else None, packing=str(self.packing.file),
            )  # fmt: skip
        return output.directory

    @property
    def stages(self) -> tuple[str, ...]:
        """Stages of `solve`, in order."""
        return ("reading", "validation", *stages(self.output.quantities, self.output.vtk))

    def check(self) -> Packing:
        """Read and validate everything `solve` would, computing nothing; the packing.

        Raises
        ------
        InputError
            As `solve`, save that results may exist.
        """
        check_target(self.output.directory, vtk=self.output.vtk)
        return self.pore_mesh().packing


def _scene(top: Table, directory: Path, path: Path | None) -> FlowScene:
    top.only("packing", "box", "fluid", "walls", "mesh", "flow", "output")
    scene = FlowScene(
        packing=read_packing_file(top, directory),
        box=top.table("box").box() if "box" in top.data else None,
        fluid=read_fluid(top.table("fluid")),
        walls=_walls(top.table("walls")),
        mesh=_mesh(top.table("mesh")),
        flow=_flow(top.table("flow")),
        output=_output(top.table("output"), directory),
        path=path,
    )
    _check_driven(scene, top.source)
    return scene


def _walls(table: Table) -> Walls:
    table.only(*WALLS, "lateral", noun="wall")
    for name in table.data:
        wall = table.table(name).only("pressure", "slip")
        wall.number("pressure", None)
        wall.flag("slip", False)
        if name == "lateral" and "pressure" in wall.data:
            raise wall.error("pressure", "the lateral walls have none; give it wall by wall (x_min = ...)")
    try:
        return Walls.from_mapping(table.data)
    except InputError as error:
        raise InputError(f"{table.source}: {error}") from None


def _mesh(table: Table) -> MeshOptions:
    table.only("unite_tolerance", "wall_tolerance")
    options = MeshOptions(table.number("unite_tolerance", None), table.number("wall_tolerance", None))
    for key, value in dataclasses.asdict(options).items():
        if value is not None and not 0.0 <= value < 1.0:
            raise table.error(key, f"must lie in [0, 1), not {value!r}: a fraction of a radius")
    return options


def _flow(table: Table) -> FlowOptions:
    table.only("conductance", "alpha", "solver", "tolerance", "gravity")
    conductance = read_conductance(table)
    tolerance = table.number("tolerance", None)
    if tolerance is not None and not 0.0 < tolerance < 1.0:
        raise table.error("tolerance", f"must lie between 0 and 1, not {tolerance!r}: a bound on the relative residual")
    return FlowOptions(
        conductance=conductance,
        solver=table.string("solver", "auto", choices=SOLVERS),
        tolerance=tolerance,
        gravity=table.vector("gravity", (0.0, 0.0, 0.0)),
    )


def _output(table: Table, directory: Path) -> Output:
    table.only("directory", "quantities", "vtk")
    return Output(
        directory=directory / table.string("directory", "results"),
        quantities=table.strings("quantities", ("permeability",), choices=QUANTITIES),
        vtk=table.flag("vtk", False),
    )


def _check_driven(scene: FlowScene, source: str) -> None:
    """The walls drive what is asked for."""
    asked = scene.output.quantities
    held = [(name, wall) for name, wall in zip(WALLS, scene.walls, strict=True) if wall.pressure is not None]
    if asked and not held:
        raise InputError(
            f"{source}: no wall has a pressure, and {', '.join(asked)} cannot be computed without. "
            "Give for instance\n[walls]\ny_min = { pressure = 1.0 }\ny_max = { pressure = 0.0 }"
        )
    if "permeability" in asked:
        described = ", ".join(f"{name} at {wall.pressure:g} Pa" for name, wall in held)
        axis = scene.walls.axis
        pressures = scene.walls.pressures
        if axis is None or pressures[2 * axis] == pressures[2 * axis + 1]:
            raise InputError(
                f"{source}: permeability needs exactly two pressure walls, opposite each other and at "
                f"different pressures; there are {described}. Change [walls], or drop it from the quantities."
            )
