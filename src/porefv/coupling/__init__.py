"""Grains and fluid together."""

from porefv.coupling.coupled import SCHEMES, Coupling, Effort
from porefv.coupling.exchange import EXCHANGES, Exchange
from porefv.coupling.fluid import PoreFluid, Power

__all__ = ["EXCHANGES", "SCHEMES", "Coupling", "Effort", "Exchange", "PoreFluid", "Power"]
