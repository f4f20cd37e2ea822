"""Scene files: what to compute, from what, and where to put it."""

from porefv.scenes.flow_scene import FlowScene
from porefv.scenes.packing_scene import PackingScene
from porefv.scenes.simulation_scene import SimulationScene

__all__ = ["FlowScene", "PackingScene", "SimulationScene"]
