"""The table [material]: what grains are made of. Scenes of a steady flow do not have it, and do not import grains."""

from __future__ import annotations

from typing import Annotated

from porefv.dem.material import Material
from porefv.scenes.table import Table
from porefv.scenes.values import Limits, key


class MaterialTable(Table):
    """What grains are made of."""

    young: Annotated[float, Limits(above=0.0)] = key(
        "modulus E of the contact stiffness k_n = 2 E r_i r_j / (r_i + r_j)", Material.young, unit="Pa"
    )
    stiffness_ratio: Annotated[float, Limits(least=0.0)] = key(
        "tangential over normal contact stiffness, k_s / k_n", Material.stiffness_ratio
    )
    friction_angle: Annotated[float, Limits(least=0.0, most=89.0)] = key(
        "angle of friction between grains, 0 to 89", Material.friction_angle, unit="degrees"
    )
    density: Annotated[float, Limits(above=0.0)] = key("density of the solid", Material.density, unit="kg/m³")

    def make(self) -> Material:
        return Material(**dict(self))
