"""porefv: viscous flow through packings of spheres, by finite volumes on the mesh of their pores.

Everything public is reachable from here and loaded when first used::

    from porefv import Packing, PoreFlow, Walls

    flow = PoreFlow(Packing.read("packing.csv"), Walls.along("y"))
    flow.permeability, flow.pressure, flow.forces.total
"""

import os
from importlib import import_module
from typing import Any

__version__ = "0.1.0"

# With TBB, which numba would take first, every call of a parallel kernel is slower than the one before.
os.environ.setdefault("NUMBA_THREADING_LAYER_PRIORITY", "omp tbb workqueue")

_HOME = {
    "Box": "packing",
    "ComputationError": "errors",
    "EffectiveRadius": "conductance",
    "Fluid": "flow",
    "Forces": "forces",
    "HydraulicRadius": "conductance",
    "InputError": "errors",
    "Packing": "packing",
    "PoreFlow": "flow",
    "PoreMesh": "mesh",
    "PorefvError": "errors",
    "RegularTriangulation": "tessellation",
    "SectionFriction": "conductance",
    "Throats": "throats",
    "WALLS": "packing",
    "Wall": "boundary",
    "Walls": "boundary",
}
__all__ = sorted(_HOME)


def __getattr__(name: str) -> Any:
    if name in _HOME:
        return getattr(import_module(f"porefv.{_HOME[name]}"), name)
    raise AttributeError(f"module 'porefv' has no attribute {name!r}")


def __dir__() -> list[str]:
    return [*__all__, "__version__"]
