"""Conductance models: how much flows through a throat per unit of pressure gradient."""

from porefv.conductance.conductances import throat_conductances
from porefv.conductance.effective_radius import EffectiveRadius
from porefv.conductance.hydraulic_radius import HydraulicRadius
from porefv.conductance.model import ConductanceModel, DropBeyondVertices
from porefv.conductance.registry import AUTO, MODELS, conductance_model
from porefv.conductance.section_friction.model import SectionFriction

__all__ = [
    "AUTO", "MODELS", "ConductanceModel", "DropBeyondVertices", "EffectiveRadius", "HydraulicRadius", "SectionFriction",
    "conductance_model", "throat_conductances",
]  # fmt: skip
