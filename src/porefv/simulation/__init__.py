"""Simulations in stages: grains, dry or in a fluid, from a scene to time series (`porefv simulate SCENE.toml`).

In Python::

    from porefv import simulation
    from porefv.scenes import SimulationScene

    directory = simulation.run(SimulationScene.read("data/scenes/oedometer.toml"))
    series = simulation.read_series(directory)
    series["time"], series["mean_pressure"]
"""

from porefv.system.lazy_exports import lazy_exports

__all__ = ["check", "read_profiles", "read_series", "run"]
__getattr__, __dir__ = lazy_exports(
    __name__,
    {
        "check": "porefv.simulation.simulate",
        "read_profiles": "porefv.simulation.reading",
        "read_series": "porefv.simulation.reading",
        "run": "porefv.simulation.simulate",
    },
)
