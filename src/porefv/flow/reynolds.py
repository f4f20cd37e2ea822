"""The Reynolds number of a flow: how far inertia, which is left out, counts."""

from __future__ import annotations

from porefv.flow.fluid import Fluid
from porefv.packing.packing import Packing

# Departures from Darcy's law begin between 1 and 10 (Bear 1972, §5.11).
WARNED = 1.0


def reynolds_number(fluid: Fluid, packing: Packing, speed: float) -> float | None:
    """Re = ρ U d / μ, with d the mean diameter of the spheres; None where no density is given.

    Parameters
    ----------
    fluid : Fluid
    packing : Packing
    speed : float
        U [m/s].
    """
    if not fluid.density_given:
        return None
    return fluid.density * speed * 2.0 * float(packing.radii.mean()) / fluid.viscosity


def inertia_warning(reynolds: float) -> str | None:
    """What is to be said of a flow with this Reynolds number of the Darcy velocity; None up to 1.

    References
    ----------
    J. Bear: Dynamics of Fluids in Porous Media. Elsevier (1972), §5.11.
    """
    if reynolds <= WARNED:
        return None
    return (
        f"the Reynolds number ρ U d / μ is {reynolds:.3g}. The flow is computed without inertia, by which flux and "
        "pressure are in proportion (Darcy's law). From a Reynolds number of 1 to 10 on inertia counts, and the fluxes "
        "here are too large. Use smaller grains, a smaller pressure drop or a more viscous fluid"
    )
