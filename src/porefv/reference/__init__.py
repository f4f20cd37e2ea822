"""Resolved Stokes flow through the packings of a scene, to judge the finite volumes by: needs `porefv[reference]`.

`porefv reference SCENE.toml` computes it; `StokesReference.read` reads what was computed::

    from porefv.reference import StokesReference

    reference = StokesReference.read("data/reference/stokes/sc8_no_slip.json")
    mesh = reference.pore_mesh()
    reference.permeability, reference.values.sphere_total
    reference.throat_flux(mesh), reference.pore_pressure(mesh), reference.conductances(mesh)
"""

from importlib import import_module
from typing import Any

_HOME = {
    "Options": "study",
    "Run": "result",
    "StokesReference": "result",
    "Values": "result",
    "stokes_reference": "study",
}
__all__ = sorted(_HOME)


def __getattr__(name: str) -> Any:
    if name in _HOME:
        return getattr(import_module(f"porefv.reference.{_HOME[name]}"), name)
    raise AttributeError(f"module 'porefv.reference' has no attribute {name!r}")
