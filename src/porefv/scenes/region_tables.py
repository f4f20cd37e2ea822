"""Tables of what is imposed inside a packing: [[sources]] and [[pressures]]."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Annotated

from porefv.flow.inside import FixedPressure, FlowSource
from porefv.flow.regions import Point, Region, Sphere
from porefv.packing.box import Box
from porefv.scenes.errors import refused
from porefv.scenes.shared_tables import BoxTable
from porefv.scenes.table import MadeFrom, Table
from porefv.scenes.values import Limits, Vector, key

KINDS = ("point", "box", "sphere")


class SphereTable(Table):
    """A sphere, which stands for the pores whose Laguerre vertices it contains."""

    centre: Vector = key("centre of the sphere", unit="m")
    radius: Annotated[float, Limits("must be a positive number of m", above=0.0)] = key(
        "radius of the sphere, positive", unit="m"
    )

    def make(self) -> Sphere:
        return Sphere(self.centre, self.radius)


class RegionTable(Table):
    """A table with the keys of a region."""

    point: Vector | None = key(
        "a point: the pore whose cell contains it or, in a grain, the pore whose Laguerre vertex is nearest. Exactly "
        "one of `point`, `box` and `sphere` is required",
        None,
        unit="m",
    )
    box: Annotated[Box, MadeFrom(BoxTable)] | None = key(
        "a table with `lower` and `upper`, two corners: the pores whose Laguerre vertices lie between them", None
    )
    sphere: Annotated[Sphere, MadeFrom(SphereTable)] | None = key(
        "a table with `centre` and `radius`: the pores whose Laguerre vertices lie in the sphere", None
    )

    @classmethod
    def check_keys(cls, keys: Sequence[str]) -> None:
        super().check_keys(keys)
        given = [name for name in keys if name in KINDS]
        if not given:
            raise refused("one of point, box and sphere is needed: it says where", "point")
        if len(given) > 1:
            raise refused(f"{given[0]} and {given[1]} exclude each other: give one table for each region", given[1])

    def region(self) -> Region:
        """The region that the keys say."""
        found = (None if self.point is None else Point(self.point)) or self.box or self.sphere
        assert found is not None  # the keys have been checked
        return found


class SourceTable(RegionTable):
    """A flow into the pores of a region, divided among them in proportion to their void volumes."""

    flow: float = key("flow into the sample. A negative one leaves it", unit="m³/s")

    def make(self) -> FlowSource:
        return FlowSource(self.region(), self.flow)


class FixedPressureTable(RegionTable):
    """A pressure of all pores of a region, through which fluid enters or leaves the sample."""

    pressure: float = key("imposed piezometric pressure", unit="Pa")

    def make(self) -> FixedPressure:
        return FixedPressure(self.region(), self.pressure)
