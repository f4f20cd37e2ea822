"""Discrete element method: grains in contact, moved by explicit steps (C14 §2.1). It knows nothing of fluids."""

from porefv.dem.dem import DEM
from porefv.dem.grain_model import GrainModel, LongStepGrainModel, SpinningGrainModel
from porefv.dem.growth import grow
from porefv.dem.material import Material
from porefv.dem.measurements import Contacts, Energies
from porefv.dem.plate import Plate
from porefv.dem.random_placement import cloud
from porefv.dem.settling import settle
from porefv.dem.sizes import Grading, UniformSizes
from porefv.dem.strided_run import PackingState, mean_stress

__all__ = [
    "DEM", "Contacts", "Energies", "Grading", "GrainModel", "LongStepGrainModel", "Material", "PackingState", "Plate",
    "SpinningGrainModel",
    "UniformSizes", "cloud", "grow", "mean_stress", "settle",
]  # fmt: skip
