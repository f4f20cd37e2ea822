"""Steady flow: walls and fluid, pressure, fluxes, velocities, and the forces on every sphere and wall."""

from porefv.flow.directional_permeabilities import DirectionalPermeabilities, directional_permeabilities
from porefv.flow.fluid import Fluid
from porefv.flow.flux import fluxes
from porefv.flow.forces import Forces, grain_forces
from porefv.flow.imposed_flow import FlowAtWalls, solve_imposed_flow
from porefv.flow.inside import FixedPressure, FlowSource
from porefv.flow.paths import Paths
from porefv.flow.periodic_flow import PeriodicFlow
from porefv.flow.pore_flow import PoreFlow
from porefv.flow.pressure import PressureField, solve_pressure
from porefv.flow.pressure_on_grains import SolidPressureWeights, acting_pressure, solid_pressure_weights
from porefv.flow.profile import Profile
from porefv.flow.regions import Point, Sphere
from porefv.flow.sizes import ConstrictionSizes, Distribution, PoreSizes
from porefv.flow.velocity import pore_velocities
from porefv.flow.walls import Wall, Walls

__all__ = [
    "ConstrictionSizes", "DirectionalPermeabilities", "Distribution", "FixedPressure", "FlowAtWalls", "FlowSource",
    "Fluid", "Forces", "Paths", "PeriodicFlow", "Point", "PoreFlow", "PoreSizes", "PressureField", "Profile",
    "SolidPressureWeights", "Sphere", "Wall", "Walls", "acting_pressure", "directional_permeabilities", "fluxes",
    "grain_forces", "pore_velocities", "solid_pressure_weights", "solve_imposed_flow", "solve_pressure",
]  # fmt: skip
