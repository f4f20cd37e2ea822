"""Power: where the power of the fluid goes in a coupled step."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Power:
    """Where the power of the fluid goes [W].

    Attributes
    ----------
    grains, walls : float
        Work of the fluid on grains and walls, a second.
    dissipation : float
        In throats, Σ q² / K.
    boundary : float
        Work of the imposed pressures on what flows in.
    pairs : float
        Dissipated between grains that move past each other, and between grains and walls.

    Notes
    -----
    Theory, grains and fluid: :eq:`eq-power-balance`.
    """

    grains: float
    walls: float
    dissipation: float
    boundary: float
    pairs: float = 0.0

    @property
    def lost(self) -> float:
        """What is lost, or less than zero: made of nothing [W]."""
        return self.boundary - self.dissipation - self.pairs - self.grains - self.walls

    @property
    def imbalance(self) -> float:
        """What is lost or made of nothing, relative to the largest."""
        largest = max(abs(self.grains), abs(self.walls), self.dissipation, abs(self.boundary), self.pairs)
        return abs(self.lost) / largest if largest > 0.0 else 0.0
