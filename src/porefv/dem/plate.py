"""Plate: what a wall of a sample does."""

from __future__ import annotations

from dataclasses import dataclass

from porefv.errors import InputError
from porefv.system.number_checks import check_number, three_numbers


@dataclass(frozen=True)
class Plate:
    """What a wall does: stand (the default), move, or press.

    Parameters
    ----------
    velocity : (3,) sequence of float
        Of the wall; its component along the wall shears what touches it [m/s].
    stress : float, optional
        Normal stress the wall is to press with, positive in compression: it then moves as it must, by
        servo-control, and its normal velocity is not given [Pa].
    top_speed : float, optional
        Largest speed of a pressing wall [m/s].
    friction_angle : float
        Between wall and grains [degrees].
    """

    velocity: tuple[float, float, float] = (0.0, 0.0, 0.0)
    stress: float | None = None
    top_speed: float | None = None
    friction_angle: float = 0.0

    def __post_init__(self) -> None:
        three_numbers(self.velocity, "the velocity of a wall", "m/s")
        check_number(self.friction_angle, "friction_angle", "an angle from 0 to 89 degrees", lambda x: 0.0 <= x <= 89.0)
        if self.stress is not None:
            check_number(self.stress, "stress", "a stress in Pa, zero or more (compression)", lambda x: x >= 0.0)
            if self.top_speed is None:
                raise InputError("a wall with a stress needs a top_speed in m/s")
            check_number(self.top_speed, "top_speed", "a positive speed in m/s", lambda x: x > 0.0)
