"""Grains and fluid together: coupled steps, consolidation, stress and strain of the grains."""

from porefv.coupling.consolidation import (
    consolidation_coefficient,
    critical_gradient,
    terzaghi_pressure,
    terzaghi_settlement,
)
from porefv.coupling.coupled_pressure import CoupledPressure
from porefv.coupling.coupling import Coupling
from porefv.coupling.coupling_settings import SCHEMES, CouplingSettings, Effort
from porefv.coupling.coupling_state import CouplingState
from porefv.coupling.end_correction import Permeameter, permeameter
from porefv.coupling.exchange import EXCHANGES, Exchange
from porefv.coupling.micromechanics import cell_strains, grain_strains, grain_stresses, layer_means
from porefv.coupling.pair_resistance import PairLaw, PairResistance, Pairs
from porefv.coupling.power import Power

__all__ = [
    "EXCHANGES", "SCHEMES", "CoupledPressure", "Coupling", "CouplingSettings", "CouplingState", "Effort", "Exchange",
    "PairLaw", "PairResistance", "Pairs", "Permeameter", "Power", "cell_strains", "consolidation_coefficient",
    "critical_gradient", "grain_strains", "grain_stresses", "layer_means", "permeameter", "terzaghi_pressure",
    "terzaghi_settlement",
]  # fmt: skip
