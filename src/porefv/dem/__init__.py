"""Discrete element method: grains in contact, moved by explicit steps (C14 §2.1). It knows nothing of fluids."""

from porefv.dem.dem import DEM
from porefv.dem.generation import Grading, PackingState, UniformSizes, cloud, grow, settle
from porefv.dem.material import Material, Plate
from porefv.dem.protocol import GrainModel
from porefv.dem.state import Contacts, Energies

__all__ = [
    "DEM", "Contacts", "Energies", "Grading", "GrainModel", "Material", "PackingState", "Plate", "UniformSizes",
    "cloud", "grow", "settle",
]  # fmt: skip
