"""Simulation scene: grains, fluid, walls and the stages they go through, from a TOML file, checked at the edge."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from porefv.conductance.model import ConductanceModel
from porefv.coupling.coupling import SCHEMES
from porefv.coupling.exchange import EXCHANGES
from porefv.coupling.walls_in_time import ConstantPressure, PressureHistory, PressureTable, SinePressure, WallHistory
from porefv.dem.dem import DEM
from porefv.dem.material import Material
from porefv.dem.plate import Plate
from porefv.errors import InputError
from porefv.flow.fluid import Fluid
from porefv.flow.walls import Wall
from porefv.packing.box import WALLS, Box
from porefv.packing.packing import Packing
from porefv.scenes.shared_tables import PackingFile, read_conductance, read_fluid, read_material, read_packing_file
from porefv.scenes.table import SceneFile, Table

AXES = ("x", "y", "z")
# Intervals of the series in a stage of given duration, and steps between rows of one without.
ROWS, ROW_STEPS = 200, 100


@dataclass(frozen=True)
class Rest:
    """When a stage ends at rest: as the parameters of `DEM.run_to_rest`, the limit in s (None: 200 000 steps)."""

    unbalanced: float
    stress: float
    limit: float | None


@dataclass(frozen=True)
class Stage:
    """A part of a simulation. Plates, walls and friction that it does not name stay as they were.

    Attributes
    ----------
    name : str
    end : float or Rest
        Duration [s], or when it counts as at rest.
    plates : dict of Plate
        By wall.
    walls : dict of WallHistory
        By wall.
    friction_angle : float or None
        Between grains, from here on [degrees].
    damping : float
        Of this stage alone.
    fluid : bool
        Whether the fluid is there.
    permeameter : bool
        Whether to measure permeability before and after.
    every : float or None
        Between rows of the series [s].
    """

    name: str
    end: float | Rest
    plates: Mapping[str, Plate]
    walls: Mapping[str, WallHistory]
    friction_angle: float | None
    damping: float
    fluid: bool
    permeameter: bool
    every: float | None


@dataclass(frozen=True)
class CouplingOptions:
    """As the parameters of `Coupling`; `given` has those that the scene names."""

    conductance: ConductanceModel
    given: Mapping[str, Any]


@dataclass(frozen=True)
class Output:
    """What is recorded, and where.

    Attributes
    ----------
    directory : Path
    every : float or None
        Between rows of the series [s].
    profiles, frames : float, tuple of float, or None
        Interval or times [s]; None for none.
    layers : int
        Of the profiles.
    axis : {'x', 'y', 'z'}
        Across the layers, and of the permeameter.
    contacts, parquet : bool
        Whether frames have contacts; whether the series is also a Parquet file.
    """

    directory: Path
    every: float | None
    profiles: float | tuple[float, ...] | None
    frames: float | tuple[float, ...] | None
    layers: int
    axis: str
    contacts: bool
    parquet: bool


@dataclass(frozen=True)
class Saving:
    """Interval between checkpoints: steps of the simulation, or seconds of the clock."""

    steps: int | None
    seconds: float | None


@dataclass(frozen=True)
class SimulationScene(SceneFile):
    """A simulation, ready to run.

    Attributes
    ----------
    packing : PackingFile
    scale : float
        What lengths in the packing file are multiplied with to be metres.
    box : Box or None
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
    output : Output
    saving : Saving
    data : dict
        What the scene says, as plain data.
    path : Path or None
        The scene file.

    Examples
    --------
    >>> scene = SimulationScene.read("data/scenes/oedometer.toml")  # doctest: +SKIP
    >>> porefv.simulation.run(scene, force=True)  # doctest: +SKIP
    """

    packing: PackingFile
    scale: float
    box: Box | None
    material: Material
    gravity: tuple[float, float, float]
    step: float | None
    fluid: Fluid | None
    walls: Mapping[str, WallHistory]
    coupling: CouplingOptions
    stages: tuple[Stage, ...]
    output: Output
    saving: Saving
    data: Mapping[str, Any]
    path: Path | None = None

    @classmethod
    def from_table(cls, top: Table, directory: Path, path: Path | None = None) -> SimulationScene:
        """The scene that a table says; relative paths in it are relative to `directory`."""
        return _scene(top, directory, path)

    def grains(self) -> DEM:
        """The grains at the start, between walls that stand."""
        found = Packing.read(self.packing.file, format=self.packing.format)
        box = self.box
        if box is None and found.box is not None:
            box = Box(self.scale * found.box.lower, self.scale * found.box.upper)
        if box is None:
            raise InputError(
                f"{self.path or 'scene'}: {self.packing.file} holds no box; give one in the scene:\n"
                "[box]\nlower = [0.0, 0.0, 0.0]\nupper = [1.0, 1.0, 1.0]"
            )
        packing = Packing(self.scale * found.centres, self.scale * found.radii, box, found.source)
        return DEM(packing, self.material, gravity=self.gravity, step=self.step)


# ---- reading ----------------------------------------------------------------------------------------------------


def _scene(top: Table, directory: Path, path: Path | None) -> SimulationScene:
    top.only(
        "packing", "box", "material", "gravity", "step", "fluid", "walls", "coupling", "stages", "output", "checkpoint"
    )
    fluid = read_fluid(top.table("fluid")) if "fluid" in top.data else None
    if fluid is None:
        for key in ("walls", "coupling"):
            if key in top.data:
                raise top.error(key, f"[{key}] is about the fluid, and there is none; give a table [fluid], or drop it")
    return SimulationScene(
        packing=read_packing_file(top, directory, "scale"),
        scale=_scale(top),
        box=top.table("box").box(lower=(0.0, 0.0, 0.0)) if "box" in top.data else None,
        material=read_material(top.table("material")),
        gravity=top.vector("gravity", (0.0, 0.0, 0.0)),
        step=_positive(top, "step", "s", None),
        fluid=fluid,
        walls=_first_walls(top.table("walls")),
        coupling=_coupling(top.table("coupling")),
        stages=_stages(top, fluid is not None),
        output=_output(top.table("output"), directory),
        saving=_saving(top.table("checkpoint")),
        data=top.data,
        path=path,
    )


def _scale(top: Table) -> float:
    table = top.table("packing") if isinstance(top.data.get("packing"), Mapping) else Table({}, top.source)
    return _positive(table, "scale", "m", 1.0)


def _first_walls(table: Table) -> dict[str, WallHistory]:
    table.only(*WALLS, "lateral", noun="wall")
    lateral = WallHistory()
    if "lateral" in table.data:
        lateral = WallHistory(slip=table.table("lateral").only("slip").flag("slip", False))
    return dict.fromkeys(WALLS, lateral) | _walls(table)


def _walls(table: Table) -> dict[str, WallHistory]:
    return {name: _wall_history(table.table(name)) for name in WALLS if name in table.data}


def _wall_history(wall: Table) -> WallHistory:
    wall.only("pressure", "slip")
    slip = wall.flag("slip", False)
    if "pressure" not in wall.data:
        return WallHistory(None, slip)
    if isinstance(wall.data["pressure"], Mapping):
        return WallHistory(_pressure_history(wall.table("pressure")), slip)
    return WallHistory(ConstantPressure(_pressure(wall, "pressure", wall.number("pressure"))), slip)


def _pressure_history(table: Table) -> PressureHistory:
    """A pressure in time: a table of times and pressures, or a sine."""
    if "period" in table.data:
        table.only("mean", "amplitude", "period")
        mean = _pressure(table, "mean", table.number("mean", 0.0))
        amplitude = _pressure(table, "amplitude", table.number("amplitude"))
        return SinePressure(mean, amplitude, _positive(table, "period", "s"))
    table.only("times", "pressures")
    times, pressures = _times(table, "times"), table.numbers("pressures")
    if len(times) != len(pressures):
        raise table.error("pressures", f"{len(times)} times need as many pressures, not {len(pressures)}")
    return PressureTable(times, tuple(_pressure(table, "pressures", value) for value in pressures))


def _pressure(table: Table, key: str, value: float) -> float:
    try:
        Wall(value)
    except InputError as error:
        raise table.error(key, str(error)) from None
    return value


def _coupling(table: Table) -> CouplingOptions:
    table.only("scheme", "exchange", "tolerance", "renewal", "end_correction", "conductance", "alpha")
    given: dict[str, Any] = {}
    if "scheme" in table.data:
        given["scheme"] = table.string("scheme", choices=SCHEMES)
    if "exchange" in table.data:
        given["exchange"] = table.string("exchange", choices=EXCHANGES)
    if "tolerance" in table.data:
        given["tolerance"] = _between(table, "tolerance", lambda x: 0.0 < x < 1.0, "between 0 and 1")
    if "renewal" in table.data:
        given["renewal"] = _between(table, "renewal", lambda x: 0.0 < x <= 1.0, "in (0, 1]")
    if "end_correction" in table.data:
        given["end_correction"] = table.flag("end_correction", True)
    return CouplingOptions(read_conductance(table), given)


def _stages(top: Table, fluid: bool) -> tuple[Stage, ...]:
    tables = top.tables("stages")
    if not tables:
        raise top.error("stages", "at least one is needed, such as\n[[stages]]\nduration = 0.1")
    stages = [_stage(table, number, fluid) for number, table in enumerate(tables, 1)]
    names = [stage.name for stage in stages]
    for table, stage in zip(tables, stages, strict=True):
        if names.count(stage.name) > 1:
            raise table.error("name", f"two stages are called '{stage.name}'")
    return tuple(stages)


def _stage(table: Table, number: int, fluid: bool) -> Stage:
    table.only(
        "name", "duration", "rest", "plates", "walls", "friction_angle", "damping", "fluid", "permeameter", "every"
    )
    wet = table.flag("fluid", fluid)
    if wet and not fluid:
        raise table.error("fluid", "there is no table [fluid] that says what it is")
    if "walls" in table.data and not fluid:
        raise table.error("walls", "is about the fluid, and there is none; what walls do to grains is said by plates")
    damping = _between(table, "damping", lambda x: 0.0 <= x < 1.0, "in [0, 1)", 0.0)
    if wet and damping > 0.0:
        raise table.error("damping", "is for dry stages: where the fluid is, it damps; drop it, or set fluid = false")
    angle = None
    if "friction_angle" in table.data:
        angle = _between(table, "friction_angle", lambda x: 0.0 <= x <= 89.0, "between 0 and 89 degrees")
    walls = table.table("walls").only(*WALLS, noun="wall")
    return Stage(
        name=table.string("name", f"stage {number}"),
        end=_end(table),
        plates=_plates(table.table("plates")),
        walls=_walls(walls),
        friction_angle=angle,
        damping=damping,
        fluid=wet,
        permeameter=table.flag("permeameter", False),
        every=_positive(table, "every", "s", None),
    )


def _end(table: Table) -> float | Rest:
    if "rest" not in table.data:
        return _positive(table, "duration", "s")
    if "duration" in table.data:
        raise table.error("duration", "duration and rest exclude each other; rest has a limit, in s")
    rest = table.table("rest").only("unbalanced", "stress", "limit")
    return Rest(
        _between(rest, "unbalanced", lambda x: 1e-8 <= x < 1.0, "between 1e-8 and 1", 1e-3),
        _between(rest, "stress", lambda x: 0.0 < x < 1.0, "between 0 and 1", 1e-2),
        _positive(rest, "limit", "s", None),
    )


def _plates(table: Table) -> dict[str, Plate]:
    table.only(*WALLS, noun="wall")
    return {name: _plate(table.table(name)) for name in table.data}


def _plate(table: Table) -> Plate:
    table.only("velocity", "stress", "top_speed", "friction_angle")
    given: dict[str, Any] = {key: table.vector(key) if key == "velocity" else table.number(key) for key in table.data}
    if "top_speed" in given and "stress" not in given:
        raise table.error("top_speed", "is that of a plate that presses; give a stress, or drop it")
    return table.make(Plate, **given) if given else Plate()


def _output(table: Table, directory: Path) -> Output:
    table.only("directory", "every", "profiles", "frames", "layers", "axis", "contacts", "parquet")
    return Output(
        directory=directory / table.string("directory", "results"),
        every=_positive(table, "every", "s", None),
        profiles=_moments(table, "profiles"),
        frames=_moments(table, "frames"),
        layers=table.whole("layers", least=1, default=10),
        axis=table.string("axis", "z", choices=AXES),
        contacts=table.flag("contacts", False),
        parquet=table.flag("parquet", False),
    )


def _saving(table: Table) -> Saving:
    table.only("steps", "seconds")
    if len(table.data) == 2:
        raise table.error("seconds", "seconds and steps exclude each other")
    if "steps" in table.data:
        return Saving(table.whole("steps", least=1), None)
    return Saving(None, _positive(table, "seconds", "s", 60.0))


def _moments(table: Table, key: str) -> float | tuple[float, ...] | None:
    """An interval, or a list of times."""
    return _times(table, key) if isinstance(table.data.get(key), list | tuple) else _positive(table, key, "s", None)


def _times(table: Table, key: str) -> tuple[float, ...]:
    times = table.numbers(key)
    if not times or times[0] < 0.0 or any(b <= a for a, b in zip(times, times[1:], strict=False)):
        raise table.error(key, f"expected increasing times in s, from 0 on, not {table.data[key]!r}")
    return times


def _positive(table: Table, key: str, unit: str, *default: Any) -> Any:
    value = table.number(key, *default)
    if value is not None and not value > 0.0:
        raise table.error(key, f"must be a positive number of {unit}, not {value!r}")
    return value


def _between(table: Table, key: str, holds: Any, where: str, *default: float) -> float:
    value = table.number(key, *default)
    if not holds(value):
        raise table.error(key, f"must lie {where}, not {value!r}")
    return value
