"""Resolved Stokes flow through the packings of a scene, a reference for the finite volumes.

By a lattice-Boltzmann method, or by finite elements: these need `porefv[reference]`.

`porefv reference SCENE.toml` computes it; `StokesReference.read` reads what was computed::

    from porefv.resolved import StokesReference

    reference = StokesReference.read("data/reference/stokes/sc8_no_slip.json")
    mesh = reference.pore_mesh()
    reference.permeability, reference.values.sphere_total
    reference.throat_flux(mesh), reference.pore_pressure(mesh), reference.conductances(mesh)
"""

from porefv.system.lazy_exports import lazy_exports

__all__ = [
    "LatticeOptions", "LatticeRun", "Options", "Run", "StokesReference", "Values", "lattice_reference",
    "stokes_reference",
]  # fmt: skip
__getattr__, __dir__ = lazy_exports(
    __name__,
    {
        "LatticeOptions": "porefv.resolved.lattice_reference",
        "LatticeRun": "porefv.resolved.reference",
        "Options": "porefv.resolved.refinement",
        "Run": "porefv.resolved.reference",
        "StokesReference": "porefv.resolved.reference",
        "Values": "porefv.resolved.reference",
        "lattice_reference": "porefv.resolved.lattice_reference",
        "stokes_reference": "porefv.resolved.refinement",
    },
)
