"""Resolved Stokes flow through the packings of a scene, a reference for the finite volumes: needs `porefv[reference]`.

`porefv reference SCENE.toml` computes it; `StokesReference.read` reads what was computed::

    from porefv.resolved import StokesReference

    reference = StokesReference.read("data/reference/stokes/sc8_no_slip.json")
    mesh = reference.pore_mesh()
    reference.permeability, reference.values.sphere_total
    reference.throat_flux(mesh), reference.pore_pressure(mesh), reference.conductances(mesh)
"""

from porefv.system.lazy_exports import lazy_exports

__all__ = ["Options", "Run", "StokesReference", "Values", "stokes_reference"]
__getattr__, __dir__ = lazy_exports(
    __name__,
    {
        "Options": "porefv.resolved.refinement",
        "Run": "porefv.resolved.reference",
        "StokesReference": "porefv.resolved.reference",
        "Values": "porefv.resolved.reference",
        "stokes_reference": "porefv.resolved.refinement",
    },
)
