"""Simulations in stages: grains, dry or in a fluid, from a scene to time series (`porefv simulate SCENE.toml`).

In Python::

    from porefv.simulation import SimulationScene, read_series

    directory = SimulationScene.read("data/scenes/oedometer.toml").run()
    series = read_series(directory)
    series["time"], series["mean_pressure"]
"""

from importlib import import_module
from typing import Any

_HOME = {
    "SimulationScene": "scene",
    "read_profiles": "series",
    "read_series": "series",
}
__all__ = sorted(_HOME)


def __getattr__(name: str) -> Any:
    if name in _HOME:
        return getattr(import_module(f"porefv.simulation.{_HOME[name]}"), name)
    raise AttributeError(f"module 'porefv.simulation' has no attribute {name!r}")
