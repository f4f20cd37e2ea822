"""Scene files: what to compute, from what, and where to put it.

Scenes are imported when they are first used: a steady flow needs neither grains that move nor their coupling.
"""

from typing import TYPE_CHECKING

from porefv.system.lazy_exports import lazy_exports

if TYPE_CHECKING:
    from porefv.scenes.flow_scene import FlowScene
    from porefv.scenes.packing_scene import PackingScene
    from porefv.scenes.simulation_scene import SimulationScene

__all__ = ["FlowScene", "PackingScene", "SimulationScene"]
__getattr__, __dir__ = lazy_exports(
    __name__,
    {
        "FlowScene": "porefv.scenes.flow_scene",
        "PackingScene": "porefv.scenes.packing_scene",
        "SimulationScene": "porefv.scenes.simulation_scene",
    },
)
