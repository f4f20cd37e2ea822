"""porefv: viscous flow through packings of spheres, by finite volumes on the mesh of their pores.

Data flow through the folders of the package in this order; a folder imports only from those before it:

    errors          all errors
    system          kernels, threads, memory, progress, files: no physics
    packing         spheres, box, overlaps, neighbours, packing files
    tessellation    exact regular triangulation of spheres and walls
    mesh            cells, facets, throats, pores
    conductance     how much flows through a throat: models
    solvers         the pressure equation on a network
    flow            walls, fluid, pressure, fluxes, velocities, forces
    transport       diffusion and solutes in the pores
    fipy            the fluid as a FiPy mesh
    dem             grains that move: discrete element method
    coupling        grains and fluid together, micromechanics, consolidation
    export          VTK, meshio, pictures, trajectories
    results         results directories
    scenes          scene files
    simulation      runs in stages
    resolved        resolved Stokes flow, as a reference
    comparison      error against time of each method
    cli             the command `porefv`

What most scripts need is reachable from here and loaded when first used::

    from porefv import Packing, PoreFlow, Walls

    flow = PoreFlow(Packing.read("packing.csv"), Walls.along("y"))
    flow.permeability, flow.pressure, flow.forces.total
"""

from typing import TYPE_CHECKING

from porefv.system.lazy_exports import lazy_exports
from porefv.system.version import __version__ as __version__

if TYPE_CHECKING:
    from porefv.conductance.conductances import throat_conductances
    from porefv.conductance.effective_radius import EffectiveRadius
    from porefv.conductance.hydraulic_radius import HydraulicRadius
    from porefv.conductance.model import ConductanceModel
    from porefv.conductance.section_friction.model import SectionFriction
    from porefv.errors import ComputationError, InputError, PorefvError
    from porefv.flow.directional_permeabilities import directional_permeabilities
    from porefv.flow.fluid import Fluid
    from porefv.flow.flux import fluxes
    from porefv.flow.forces import Forces, grain_forces
    from porefv.flow.inside import FixedPressure, FlowSource
    from porefv.flow.periodic_flow import PeriodicFlow
    from porefv.flow.pore_flow import PoreFlow
    from porefv.flow.pressure import PressureField, solve_pressure
    from porefv.flow.pressure_on_grains import acting_pressure
    from porefv.flow.regions import Point, Sphere
    from porefv.flow.walls import Wall, Walls
    from porefv.mesh.cell_mesh import CellMesh
    from porefv.mesh.facets import Facets
    from porefv.mesh.periodic_mesh import PeriodicMesh
    from porefv.mesh.pore_mesh import PoreMesh
    from porefv.mesh.throats import Throats
    from porefv.packing.box import WALLS, Box
    from porefv.packing.cell import Cell
    from porefv.packing.packing import Packing
    from porefv.tessellation.triangulation import RegularTriangulation

_HOMES = {
    "Box": "porefv.packing.box",
    "Cell": "porefv.packing.cell",
    "CellMesh": "porefv.mesh.cell_mesh",
    "ComputationError": "porefv.errors",
    "ConductanceModel": "porefv.conductance.model",
    "EffectiveRadius": "porefv.conductance.effective_radius",
    "Facets": "porefv.mesh.facets",
    "FixedPressure": "porefv.flow.inside",
    "FlowSource": "porefv.flow.inside",
    "Fluid": "porefv.flow.fluid",
    "Forces": "porefv.flow.forces",
    "HydraulicRadius": "porefv.conductance.hydraulic_radius",
    "InputError": "porefv.errors",
    "Packing": "porefv.packing.packing",
    "PeriodicFlow": "porefv.flow.periodic_flow",
    "PeriodicMesh": "porefv.mesh.periodic_mesh",
    "Point": "porefv.flow.regions",
    "PoreFlow": "porefv.flow.pore_flow",
    "PoreMesh": "porefv.mesh.pore_mesh",
    "PorefvError": "porefv.errors",
    "PressureField": "porefv.flow.pressure",
    "RegularTriangulation": "porefv.tessellation.triangulation",
    "SectionFriction": "porefv.conductance.section_friction.model",
    "Sphere": "porefv.flow.regions",
    "Throats": "porefv.mesh.throats",
    "WALLS": "porefv.packing.box",
    "Wall": "porefv.flow.walls",
    "Walls": "porefv.flow.walls",
    "acting_pressure": "porefv.flow.pressure_on_grains",
    "directional_permeabilities": "porefv.flow.directional_permeabilities",
    "fluxes": "porefv.flow.flux",
    "grain_forces": "porefv.flow.forces",
    "solve_pressure": "porefv.flow.pressure",
    "throat_conductances": "porefv.conductance.conductances",
}
__all__ = [
    "WALLS",
    "Box",
    "Cell",
    "CellMesh",
    "ComputationError",
    "ConductanceModel",
    "EffectiveRadius",
    "Facets",
    "FixedPressure",
    "FlowSource",
    "Fluid",
    "Forces",
    "HydraulicRadius",
    "InputError",
    "Packing",
    "PeriodicFlow",
    "PeriodicMesh",
    "Point",
    "PoreFlow",
    "PoreMesh",
    "PorefvError",
    "PressureField",
    "RegularTriangulation",
    "SectionFriction",
    "Sphere",
    "Throats",
    "Wall",
    "Walls",
    "acting_pressure",
    "directional_permeabilities",
    "fluxes",
    "grain_forces",
    "solve_pressure",
    "throat_conductances",
]  # fmt: skip
if not TYPE_CHECKING:  # a type checker would take any name for granted
    __getattr__, __dir__ = lazy_exports(__name__, _HOMES)
