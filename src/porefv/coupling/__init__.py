"""Grains and fluid together: coupled steps, consolidation, stress and strain of the grains."""

from porefv.coupling.consolidation import (
    consolidation_coefficient,
    critical_gradient,
    terzaghi_pressure,
    terzaghi_settlement,
)
from porefv.coupling.coupled_pressure import CoupledPressure, Power
from porefv.coupling.coupling import SCHEMES, Coupling, CouplingSettings, Effort
from porefv.coupling.coupling_state import CouplingState
from porefv.coupling.end_correction import Permeameter, permeameter
from porefv.coupling.exchange import EXCHANGES, Exchange
from porefv.coupling.micromechanics import cell_strains, grain_strains, grain_stresses, layer_means

__all__ = [
    "EXCHANGES", "SCHEMES", "CoupledPressure", "Coupling", "CouplingSettings", "CouplingState", "Effort", "Exchange",
    "Permeameter", "Power", "cell_strains", "consolidation_coefficient", "critical_gradient", "grain_strains",
    "grain_stresses", "layer_means", "permeameter", "terzaghi_pressure", "terzaghi_settlement",
]  # fmt: skip
