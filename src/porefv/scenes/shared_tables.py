"""Tables that several kinds of scene have: the packing file, the box, the fluid, the conductance model, the walls."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Annotated, Any, ClassVar, Generic, TypeVar

from pydantic import AfterValidator, GetCoreSchemaHandler, ValidationInfo
from pydantic_core import core_schema

from porefv.conductance.model import ConductanceModel
from porefv.conductance.registry import MODELS, conductance_model
from porefv.errors import InputError
from porefv.flow.fluid import Fluid
from porefv.packing.box import WALLS, Box
from porefv.packing.files.registry import FORMATS
from porefv.packing.free_space import FITS, fitted
from porefv.packing.packing import Packing
from porefv.scenes.errors import refused
from porefv.scenes.table import MadeFrom, OneOf, Table
from porefv.scenes.values import Choice, Integer, Limits, ScenePath, Text, Vector, key

CONDUCTANCES = ("auto", *MODELS)

_Condition = TypeVar("_Condition")


def _existing(path: Path, info: ValidationInfo) -> Path:
    if (info.context or {}).get("recorded"):  # what was run is no longer read
        return path
    try:
        if not path.is_file():
            what = "is not a file" if path.exists() else "does not exist"
            raise ValueError(f"{path} {what}; paths are relative to the scene file")
    except OSError as error:
        raise ValueError(f"{path} cannot be read: {error.strerror}") from None
    return path


ExistingFile = Annotated[ScenePath, AfterValidator(_existing)]


class ColumnsTable(Table):
    """The columns of the packing file, by their names in its header, or by their places counted from 1, as texts."""

    noun: ClassVar[str] = "column"

    x: Text | None = key("column of the coordinate x of centres", None, shown="by its name")
    y: Text | None = key("column of the coordinate y of centres", None, shown="by its name")
    z: Text | None = key("column of the coordinate z of centres", None, shown="by its name")
    radius: Text | None = key("column of the radii", None, shown="by its name")
    diameter: Text | None = key("instead of `radius`: column of the diameters", None, shown="by its name")

    @classmethod
    def check_keys(cls, keys: Sequence[str]) -> None:
        super().check_keys(keys)
        if "radius" in keys and "diameter" in keys:
            raise refused("radius and diameter exclude each other", "diameter")


class PackingFile(Table):
    """The packing file, and [how it is read](formats.md)."""

    file: ExistingFile = key("path of the packing file")
    format: Annotated[str, Choice(FORMATS)] | None = key(
        "[format](formats.md) of the file: " + ", ".join(f'`"{name}"`' for name in FORMATS),
        None,
        shown="by the content, then by the extension",
    )
    columns: ColumnsTable | None = key(
        'columns of the file, as in `{ x = "X", radius = "R" }`, with the keys `x`, `y`, `z`, `radius` or `diameter`',
        None,
        shown="by their names",
    )
    radius: Annotated[float, Limits("must be a positive number of m", above=0.0)] | None = key(
        "radius of all spheres of a file without radii", None, unit="m"
    )
    scale: Annotated[float, Limits("must be a positive number of m", above=0.0)] | None = key(
        "unit of lengths in the file, its box included: the factor by which they are multiplied to be in m",
        None,
        unit="m",
        shown="by the unit that the file states, or 1",
    )
    frame: Integer | None = key("frame to read of a file with several: 0 is the first, -1 the last", None, shown="-1")
    periodic: Annotated[str, Choice(("ignore",))] | None = key(
        'with `"ignore"`, a periodic packing is read into a box with six walls. Flow near these walls is not that of '
        "the bulk",
        None,
        shown="a periodic packing is an error",
    )

    def read(self, scene: Path | None, box: Box | str | None) -> Packing:
        """The packing in the box given, or in that of the file; a word places walls by the spheres (`fitted`).

        Parameters
        ----------
        scene : Path or None
            The scene file, for errors.
        box : Box, str or None

        Raises
        ------
        InputError
            If the file cannot be read, or no box is known.
        """
        columns = {} if self.columns is None else {role: name for role, name in self.columns if name is not None}
        packing = Packing.read(
            self.file, self.format, None if isinstance(box, str) else box,
            columns=columns, radius=self.radius, scale=self.scale, frame=self.frame, periodic=self.periodic,
        )  # fmt: skip
        if isinstance(box, str) and (packing.box is not None or box == "fit"):
            return fitted(packing, box)
        if packing.box is None:
            around = packing.bounding_box
            lower, upper = (
                ", ".join(repr(float(f"{c:.12g}")) for c in corner) for corner in (around.lower, around.upper)
            )
            raise InputError(
                f"{scene or 'scene'}: {self.file} holds no box; place its walls at the outermost spheres with "
                f'box = "fit", or give one in the scene, such as that of the spheres:\n'
                f"[box]\nlower = [{lower}]\nupper = [{upper}]"
            )
        return packing


class BoxOrFit:
    """A field whose value is the table [box], or a word that places the walls by the spheres."""

    def __init__(self, table: type[BoxTable]):
        self.table = table

    def __get_pydantic_core_schema__(self, source: Any, handler: GetCoreSchemaHandler) -> core_schema.CoreSchema:
        kinds = OneOf(
            lambda value: "word" if isinstance(value, str) else "table",
            word=Annotated[str, Choice(FITS)],
            table=Annotated[Box, MadeFrom(self.table)],
        )
        return kinds.__get_pydantic_core_schema__(source, handler)


class PathOrTable:
    """A field whose value is a table like [packing], or the path that is its key `file`."""

    def __get_pydantic_core_schema__(self, source: Any, handler: GetCoreSchemaHandler) -> core_schema.CoreSchema:
        kinds = OneOf(
            lambda value: "table" if isinstance(value, Mapping | Table) else "path",
            path=Annotated[ExistingFile, AfterValidator(lambda path: source.model_construct(file=path))],
            table=source,
        )
        return kinds.__get_pydantic_core_schema__(source, handler)


class BoxTable(Table):
    """The axis-aligned box whose six walls confine the packing."""

    lower: Vector = key("corner where all coordinates are least", unit="m")
    upper: Vector = key("corner where all coordinates are largest", unit="m")

    def make(self) -> Box:
        return Box(self.lower, self.upper)


class BoxFromOriginTable(BoxTable):
    """The axis-aligned box whose six walls confine the grains."""

    lower: Vector = key("corner where all coordinates are least", (0.0, 0.0, 0.0), unit="m")


class FluidTable(Table):
    """The fluid in the pores, viscous and incompressible."""

    viscosity: Annotated[float, Limits(above=0.0)] = key("dynamic viscosity, positive", Fluid.viscosity, unit="Pa s")
    density: Annotated[float, Limits(least=0.0)] = key(
        "density, for the hydraulic conductivity and for buoyancy; if it is given, for the Reynolds number, too",
        float(Fluid.density), unit="kg/m³",
    )  # fmt: skip

    def make(self) -> Fluid:
        given = "density" in self.model_fields_set
        return Fluid(self.viscosity, self.density) if given else Fluid(self.viscosity)


class ConductanceTable(Table):
    """A table with the keys of a conductance model."""

    conductance: Annotated[str, Choice(CONDUCTANCES)] = key(
        '[model of the conductance](theory_method.md#conductance) of throats: `"section-friction"`, which `"auto"` '
        'stands for, or the paper\'s `"hydraulic-radius"` and `"effective-radius"`. The errors of each are on the page '
        "[Accuracy](accuracy.md)",
        "auto",
    )
    alpha: Annotated[float, Limits(above=0.0)] | None = key(
        'shape factor of the hydraulic radius, positive. With any other model, `"auto"` among them, an error',
        None,
        shown="0.5",
    )

    def conductance_model(self) -> ConductanceModel:
        """The model that the keys say."""
        try:
            return conductance_model(self.conductance, **({} if self.alpha is None else {"alpha": self.alpha}))
        except InputError as error:
            raise refused(str(error), "alpha") from None


class LateralTable(Table):
    """What all walls that are not named do to the fluid."""

    advice: ClassVar[Mapping[str, str]] = {
        name: "the lateral walls have none; give it wall by wall (x_min = ...)"
        for name in ("pressure", "inflow", "velocity")
    }

    slip: bool = key(
        "whether the fluid slips along these walls, as along a plane of symmetry. If not, the walls drag it", False
    )


class SixWalls(Table, Generic[_Condition]):
    """Conditions on walls, by name; None for the walls that are not named."""

    noun: ClassVar[str] = "wall"

    x_min: _Condition | None = key("the wall where x is least", None)
    x_max: _Condition | None = key("the wall where x is largest", None)
    y_min: _Condition | None = key("the wall where y is least", None)
    y_max: _Condition | None = key("the wall where y is largest", None)
    z_min: _Condition | None = key("the wall where z is least", None)
    z_max: _Condition | None = key("the wall where z is largest", None)

    def named(self) -> dict[str, _Condition]:
        """The conditions on the walls that are named."""
        return {name: condition for name in WALLS if (condition := getattr(self, name)) is not None}
