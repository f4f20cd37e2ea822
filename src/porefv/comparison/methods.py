"""The methods that are compared: conductance models, tolerances of the iterative solver, the resolved flow."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

# Spheres up to which the resolved flow is computed unless it is refused.
RESOLVED_UP_TO = 12
# Tolerances of the iterative solver, from coarse to the default.
TOLERANCES = (1e-2, 1e-4, 1e-6, 1e-10)


@dataclass(frozen=True)
class Method:
    """A conductance model with a solver, or the resolved flow.

    Parameters
    ----------
    name : str
    conductance : str or None
        None: the resolved flow.
    solver : str
    tolerance : float or None
        None: the default.
    """

    name: str
    conductance: str | None
    solver: str = "auto"
    tolerance: float | None = None


def methods(conductances: Sequence[str], own: str, iterative: bool, resolved: bool) -> list[Method]:
    """Methods from coarse to fine.

    Parameters
    ----------
    conductances : sequence of str
        Names of the conductance models to compare.
    own : str
        Name of the scene's own model.
    iterative : bool
        Whether to compare tolerances of the iterative solver, with the scene's own model.
    resolved : bool
        Whether to compare with the resolved flow.
    """
    found = [Method(name, name) for name in conductances]
    if iterative:
        found += [Method(f"{own}, cg to {tolerance:.0e}", own, "cg", tolerance) for tolerance in TOLERANCES]
    if resolved:
        found.append(Method("resolved Stokes flow", None))
    return found
