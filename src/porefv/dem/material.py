"""Material: what grains are made of."""

from __future__ import annotations

import math
from dataclasses import dataclass

from porefv.system.number_checks import check_number


@dataclass(frozen=True)
class Material:
    """What grains are made of.

    Parameters
    ----------
    young : float
        E of the contact stiffness k_n = 2 E r_i r_j / (r_i + r_j) [Pa].
    stiffness_ratio : float
        k_s / k_n.
    friction_angle : float
        φ between grains [degrees].
    density : float
        Of the solid [kg/m³].
    """

    young: float = 15.0e6
    stiffness_ratio: float = 0.5
    friction_angle: float = 30.0
    density: float = 2600.0

    def __post_init__(self) -> None:
        check_number(self.young, "young", "a positive modulus in Pa", lambda x: x > 0.0)
        check_number(self.stiffness_ratio, "stiffness_ratio", "zero or a positive number", lambda x: x >= 0.0)
        check_number(self.friction_angle, "friction_angle", "an angle from 0 to 89 degrees", lambda x: 0.0 <= x <= 89.0)
        check_number(self.density, "density", "a positive density in kg/m³", lambda x: x > 0.0)

    @property
    def friction(self) -> float:
        """tan φ."""
        return math.tan(math.radians(self.friction_angle))
