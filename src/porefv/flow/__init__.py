"""Steady flow: walls and fluid, pressure, fluxes, velocities, and the forces on every sphere and wall."""

from porefv.flow.fluid import Fluid
from porefv.flow.flux import fluxes
from porefv.flow.forces import Forces, grain_forces
from porefv.flow.pore_flow import PoreFlow
from porefv.flow.pressure import PressureField, solve_pressure
from porefv.flow.pressure_on_grains import SolidPressureWeights, acting_pressure, solid_pressure_weights
from porefv.flow.profile import Profile
from porefv.flow.sizes import ConstrictionSizes, Distribution, PoreSizes
from porefv.flow.velocity import pore_velocities
from porefv.flow.walls import Wall, Walls

__all__ = [
    "ConstrictionSizes", "Distribution", "Fluid", "Forces", "PoreFlow", "PoreSizes", "PressureField", "Profile",
    "SolidPressureWeights", "Wall", "Walls", "acting_pressure", "fluxes", "grain_forces", "pore_velocities",
    "solid_pressure_weights", "solve_pressure",
]  # fmt: skip
