"""Stage: a part of a simulation, and its tables."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Annotated

from porefv.coupling.walls_in_time import WallHistory
from porefv.dem.plate import Plate
from porefv.scenes.errors import refused
from porefv.scenes.shared_tables import SixWalls
from porefv.scenes.table import MadeFrom, Table
from porefv.scenes.values import Fraction, Limits, Seconds, Text, Unbalanced, Vector, key
from porefv.scenes.walls_in_time_tables import StageWallsTable


class Rest(Table):
    """When the grains count as at rest, as the parameters of `DEM.run_to_rest`.

    `limit` is a time in s; None stands for 200 000 steps.
    """

    unbalanced: Unbalanced = key(
        "bound on the mean resultant force on a grain, forces of the fluid included, over the mean contact force",
        1.0e-3,
    )
    stress: Fraction = key(
        "bound on the relative difference between the stress of a pressing wall and its target", 1.0e-2
    )
    limit: Seconds | None = key(
        "time after which a stage that is not at rest fails", None, unit="s", shown="200 000 steps"
    )


class PlateTable(Table):
    """What a wall does to the grains: it stands, moves, or presses."""

    velocity: Vector = key(
        "velocity of the wall. Its component along the wall shears what touches it", Plate.velocity, unit="m/s"
    )
    stress: Annotated[float, Limits(least=0.0)] | None = key(
        "normal stress that the wall is to press with, of contacts and fluid together, positive in compression",
        None,
        unit="Pa",
    )
    top_speed: Annotated[float, Limits(above=0.0)] | None = key(
        "largest speed of a pressing wall, required with a `stress`", None, unit="m/s"
    )
    friction_angle: Annotated[float, Limits(least=0.0, most=89.0)] = key(
        "angle of friction between the wall and the grains, 0 to 89", Plate.friction_angle, unit="degrees"
    )

    @classmethod
    def check_keys(cls, keys: Sequence[str]) -> None:
        super().check_keys(keys)
        if "top_speed" in keys and "stress" not in keys:
            raise refused("is that of a plate that presses; give a stress, or drop it", "top_speed")

    def make(self) -> Plate:
        return Plate(**dict(self))


class PlatesTable(SixWalls[Annotated[Plate, MadeFrom(PlateTable)]]):
    """What the walls do to the grains."""

    def make(self) -> dict[str, Plate]:
        return self.named()


class Stage(Table):
    """A part of a simulation. Plates, walls and friction that it does not name stay as they were."""

    name: Text = key("name of the stage, different from those of the others", "", shown="`stage 1`, `stage 2`, ...")
    duration: Seconds | None = key("how long the stage lasts. Either this or `rest` is required", None, unit="s")
    rest: Rest | None = key("instead of `duration`, a table: the stage lasts until the grains count as at rest", None)
    plates: Annotated[Mapping[str, Plate], MadeFrom(PlatesTable)] = key(
        "what walls do to the grains: a table for each wall", {}
    )
    walls: Annotated[Mapping[str, WallHistory], MadeFrom(StageWallsTable)] = key(
        "what walls do to the fluid, as in `[walls]`, without `lateral`", {}
    )
    friction_angle: Annotated[float, Limits("must lie between 0 and 89 degrees", least=0.0, most=89.0)] | None = key(
        "angle of friction between grains, from here on, 0 to 89", None, unit="degrees", shown="unchanged"
    )
    fluid: bool = key(
        "whether the fluid is there. A stage without it is dry", True, shown="true, where there is `[fluid]`"
    )
    damping: Annotated[float, Limits("must lie in [0, 1)", least=0.0, below=1.0)] = key(
        "local damping, of this stage alone; dry stages only", 0.0
    )
    permeameter: bool = key(
        "whether to measure the permeability by steady flow along the `axis`, before and after the stage", False
    )
    every: Seconds | None = key("interval between rows of the series", None, unit="s", shown="that of `[output]`")

    @classmethod
    def check_keys(cls, keys: Sequence[str]) -> None:
        super().check_keys(keys)
        if "duration" in keys and "rest" in keys:
            raise refused("duration and rest exclude each other; rest has a limit, in s", "duration")
        if "duration" not in keys and "rest" not in keys:
            raise refused("missing; give a duration in s, or a table rest", "duration")

    @property
    def end(self) -> float | Rest:
        """Duration [s], or when the stage counts as at rest."""
        end = self.duration if self.rest is None else self.rest
        assert end is not None  # the keys have been checked
        return end

    def in_scene(self, number: int, fluid: bool) -> Stage:
        """The stage with what depends on its scene: its name, and whether the fluid is there.

        Parameters
        ----------
        number : int
            Of the stage, from 1 on.
        fluid : bool
            Whether the scene has a fluid.

        Raises
        ------
        ValidationError
            About a key of a stage of the list.
        """
        wet = self.fluid if "fluid" in self.model_fields_set else fluid
        if wet and not fluid:
            raise refused("there is no table [fluid] that says what it is", number - 1, "fluid")
        if "walls" in self.model_fields_set and not fluid:
            message = "is about the fluid, and there is none; what walls do to grains is said by plates"
            raise refused(message, number - 1, "walls")
        if wet and self.damping > 0.0:
            message = "is for dry stages: where the fluid is, it damps; drop it, or set fluid = false"
            raise refused(message, number - 1, "damping")
        name = self.name if "name" in self.model_fields_set else f"stage {number}"
        return self.model_copy(update={"name": name, "fluid": wet})
