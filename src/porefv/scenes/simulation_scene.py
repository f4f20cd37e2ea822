"""Simulation scene: grains, fluid, walls and the stages they go through, from a TOML file, checked at the edge."""

from __future__ import annotations

import itertools
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Annotated, Any, ClassVar, Self

from pydantic import Field, ValidationInfo, field_validator, model_validator

from porefv.conductance.model import ConductanceModel
from porefv.coupling.coupling_settings import MOST_STRIDE, SCHEMES
from porefv.coupling.exchange import EXCHANGES
from porefv.coupling.walls_in_time import WallHistories, WallHistory
from porefv.dem.dem import DEM
from porefv.dem.material import Material
from porefv.errors import InputError
from porefv.flow.fluid import Fluid
from porefv.packing.box import Box
from porefv.packing.packing import Packing
from porefv.scenes.errors import refused
from porefv.scenes.material_table import MaterialTable
from porefv.scenes.shared_tables import (
    BoxFromOriginTable,
    BoxOrFit,
    ConductanceTable,
    FluidTable,
    PackingFile,
    PathOrTable,
)
from porefv.scenes.stage import Stage
from porefv.scenes.table import MadeFrom, OneOf, Scene, Table
from porefv.scenes.values import Choice, Fraction, Limits, Numbers, ScenePath, Seconds, Vector, Whole, key
from porefv.scenes.walls_in_time_tables import FirstWallsTable, Times
from porefv.system.tables import TABLE_FORMATS

AXES = ("x", "y", "z")
# Intervals of the series in a stage of given duration, and steps between rows of one without.
ROWS, ROW_STEPS = 200, 100


def _increase(places: Sequence[float]) -> bool:
    return len(places) > 0 and all(a < b for a, b in itertools.pairwise(places))


Gauges = Annotated[tuple[float, ...], Numbers("increasing places in m, such as [0.1, 0.2]", holds=_increase)]
Moments = Annotated[
    float | tuple[float, ...],
    OneOf(
        lambda value: "times" if isinstance(value, list | tuple) else "interval",
        interval=Seconds,
        times=Times,
    ),
]


@dataclass(frozen=True)
class CouplingOptions:
    """The conductance model, and the other parameters of `Coupling`."""

    conductance: ConductanceModel
    parameters: Mapping[str, Any]


class CouplingTable(ConductanceTable):
    """How grains and fluid are coupled."""

    scheme: Annotated[str, Choice(SCHEMES)] = key(
        'how a step is taken: `"implicit-drag"`, stable at any viscosity, `"semi-implicit"`, or the one fit for '
        "the case",
        "auto",
    )
    exchange: Annotated[str, Choice(EXCHANGES)] = key(
        'by which sums moving grains change the volumes of pores, and pores press on grains: `"facets"` or `"volumes"`',
        "facets",
    )
    tolerance: Fraction = key("bound on the relative error of the pressures at each step, between 0 and 1", 1.0e-2)
    renewal: Annotated[float, Limits("must lie in (0, 1]", above=0.0, most=1.0)] = key(
        "part of the mean radius, in (0, 1], by which one in a hundred neighbours move past each other, or any by five "
        "times as much, until the mesh is made anew",
        0.02,
    )
    end_correction: bool = key(
        "whether to correct the drainage height for the looser layer of grains at a drained wall", True
    )
    pair_resistance: bool = key(
        "whether grains that move past each other meet [resistance and lubrication](coupling.md#loose-states). Needed "
        "where grains are apart; in a dense skeleton it changes little and each step costs more",
        False,
    )
    roughness: Annotated[float, Limits("must lie in [1e-6, 0.2]", least=1e-6, most=0.2)] = key(
        "gap between two grains, as a part of their mean radius, below which lubrication grows no more", 0.02
    )
    stride: Annotated[int, Whole(least=1, most=MOST_STRIDE)] = key(
        "longest [step of grains and fluid together](coupling.md#long-steps), in steps of the grains, 1 to 20. More "
        "than 1 needs `pair_resistance`",
        1,
    )

    @model_validator(mode="after")
    def _options_agree(self) -> Self:
        """Long steps have pairs that resist and an implicit step, and a roughness has pairs."""
        if self.stride > 1 and not self.pair_resistance:
            raise refused(
                f"a stride of {self.stride} needs pair_resistance = true, which keeps contacts from bouncing in long "
                "steps; set that, or drop stride",
                "stride",
            )
        if self.stride > 1 and self.scheme == "semi-implicit":
            raise refused(
                f"a stride of {self.stride} needs an implicit step; set scheme to 'auto' or 'implicit-drag', or drop "
                "stride",
                "scheme",
            )
        if "roughness" in self.model_fields_set and not self.pair_resistance:
            raise refused("is that of pairs that resist; set pair_resistance = true, or drop it", "roughness")
        return self

    def make(self) -> CouplingOptions:
        parameters = {name: value for name, value in self if name not in ConductanceTable.model_fields}
        return CouplingOptions(self.conductance_model(), parameters)


class SimulationOutput(Table):
    """What is recorded, and where."""

    advice: ClassVar[Mapping[str, str]] = {"parquet": 'write table_format = "parquet" instead of parquet = true'}

    directory: ScenePath = key("where the results go", "results")
    every: Seconds | None = key(
        "interval between rows of the series", None, unit="s", shown="1/200 of the stage; 100 steps in one to rest"
    )
    profiles: Moments | None = key("interval between profiles, or a list of times", None, unit="s")
    layers: Annotated[int, Whole(least=1)] = key("number of layers of the profiles, equally thick", 10)
    axis: Annotated[str, Choice(AXES)] = key("axis across the layers and gauges, and of the permeameter", "z")
    gauges: Gauges | None = key(
        "increasing places along the `axis` at which the [pressure is measured](#gauges) for each row of the series",
        None,
        unit="m",
    )
    frames: Moments | None = key("interval between frames for ParaView, or a list of times", None, unit="s")
    contacts: bool = key("whether frames have the contacts, too", False)
    velocity: bool = key("whether frames have the velocity in the pores, too", False)
    throats: bool = key("whether frames have the throats, with their fluxes, too", False)
    table_format: Annotated[str, Choice(TABLE_FORMATS)] = key(
        'format of the series and profiles when the run is complete: `"npy"` (NumPy) or `"parquet"`, which needs '
        "pyarrow, beside the CSV files, which grow with the run",
        "csv",
    )


class Saving(Table):
    """Interval between checkpoints: steps of the simulation, or else seconds of the clock."""

    seconds: Seconds = key("interval between checkpoints, by the clock", 60.0, unit="s")
    steps: Annotated[int, Whole(least=1)] | None = key(
        "instead of `seconds`: steps between checkpoints, up to 100 more", None
    )

    @classmethod
    def check_keys(cls, keys: Sequence[str]) -> None:
        super().check_keys(keys)
        if "seconds" in keys and "steps" in keys:
            raise refused("seconds and steps exclude each other", "seconds")


class SimulationScene(Scene):
    """A simulation in stages: grains, dry or in a fluid.

    Attributes
    ----------
    packing : PackingFile
    box : Box, str or None
        None: the box is in the packing file [m].
    material : Material
    gravity : (float, float, float)
        [m/s²]
    step : float or None
        Of time [s]; None: the default of the DEM.
    fluid : Fluid or None
        None: grains alone.
    walls : dict of WallHistory
        By wall, at the start.
    coupling : CouplingOptions
    stages : tuple of Stage
    output : SimulationOutput
    checkpoint : Saving
    data : dict
        What the scene says, as plain data.
    path : Path or None
        The scene file.

    Examples
    --------
    >>> scene = SimulationScene.read("data/scenes/oedometer.toml")  # doctest: +SKIP
    >>> porefv.simulation.run(scene, force=True)  # doctest: +SKIP
    """

    packing: Annotated[PackingFile, PathOrTable()] = key("the packing file: a path, or the table `[packing]`")
    box: Annotated[Box | str, BoxOrFit(BoxFromOriginTable)] | None = key(
        'the box that confines the packing: the table `[box]`, or `"fit"` (each wall touches the outermost sphere), '
        'or `"bed"` (so do walls with free space; the others are those of the file)',
        None,
        shown="from the packing file",
    )
    material: Annotated[Material, MadeFrom(MaterialTable)] = key("the table `[material]`: what grains are made of", {})
    gravity: Vector = key("acceleration of gravity, of grains and fluid", (0.0, 0.0, 0.0), unit="m/s²")
    step: Seconds | None = key("time step of the grains", None, unit="s", shown="half the critical one")
    fluid: Annotated[Fluid, MadeFrom(FluidTable)] | None = key(
        "the table `[fluid]`. Without it the run is dry, and nothing of a fluid is computed", None
    )
    walls: Annotated[Mapping[str, WallHistory], MadeFrom(FirstWallsTable)] = key(
        "the table `[walls]`: what walls do to the fluid at the start", {}
    )
    coupling: Annotated[CouplingOptions, MadeFrom(CouplingTable)] = key(
        "the table `[coupling]`: how grains and fluid are coupled", {}
    )
    stages: Annotated[tuple[Stage, ...], Field(strict=False, min_length=1)] = key(
        "a table `[[stages]]` for each stage, one at least"
    )
    output: SimulationOutput = key("the table `[output]`: what is recorded, and where", {})
    checkpoint: Saving = key("the table `[checkpoint]`: how often the state is saved", {})

    @classmethod
    def check_keys(cls, keys: Sequence[str]) -> None:
        super().check_keys(keys)
        if "fluid" not in keys:
            for name in ("walls", "coupling"):
                if name in keys:
                    message = f"[{name}] is about the fluid, and there is none; give a table [fluid], or drop it"
                    raise refused(message, name)
        if "stages" not in keys:
            raise refused("at least one is needed, such as\n[[stages]]\nduration = 0.1", "stages")

    @field_validator("stages")
    @classmethod
    def _complete(cls, stages: tuple[Stage, ...], info: ValidationInfo) -> tuple[Stage, ...]:
        """The stages with what depends on the scene; it has been validated before them."""
        if "fluid" not in info.data:  # it is wrong itself
            return stages
        fluid = info.data["fluid"] is not None
        complete = tuple(stage.in_scene(number, fluid) for number, stage in enumerate(stages, 1))
        names = [stage.name for stage in complete]
        for k, name in enumerate(names):
            if names.count(name) > 1:
                raise refused(f"two stages are called '{name}'", k, "name")
        return complete

    @field_validator("output")
    @classmethod
    def _gauges_need_fluid(cls, output: SimulationOutput, info: ValidationInfo) -> SimulationOutput:
        if output.gauges is not None and info.data.get("fluid", ...) is None:
            raise refused("gauges measure the pressure of the fluid, and there is none; give a table [fluid]", "gauges")
        return output

    @property
    def saving(self) -> Saving:
        """Interval between checkpoints."""
        return self.checkpoint

    def walls_in_time(self, begins: Iterable[float]) -> WallHistories:
        """The walls since the start, of a run whose stages have begun at these times, the first ones first [s]."""
        walls = WallHistories()
        walls.set(self.walls, 0.0)
        for stage, begin in zip(self.stages, begins, strict=False):
            walls.set(stage.walls, begin)
        return walls

    def read_packing(self) -> Packing:
        """The packing, in the scene's box or its own."""
        return self.packing.read(self.path, self.box)

    def grains(self, packing: Packing | None = None) -> DEM:
        """The grains at the start, between walls that stand; of the packing, which is read if it is not given.

        Raises
        ------
        InputError
            If the packing cannot be read, or a gauge is outside its box.
        """
        packing = self.read_packing() if packing is None else packing
        grains = DEM(packing, self.material, gravity=self.gravity, step=self.step)
        self._check_gauges(grains.box)
        return grains

    def _check_gauges(self, box: Box) -> None:
        """InputError for a gauge outside the box."""
        axis = self.output.axis
        lower, upper = (float(corner[AXES.index(axis)]) for corner in (box.lower, box.upper))
        for place in self.output.gauges or ():
            if not lower <= place <= upper:
                raise InputError(
                    f"{self.path or 'the scene'}: [output] gauges: {place:.6g} m is outside the box, which goes from "
                    f"{lower:.6g} to {upper:.6g} m along {axis}"
                )
