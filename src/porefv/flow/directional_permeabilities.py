"""The permeabilities along the three axes of a box."""

from __future__ import annotations

import warnings
from dataclasses import dataclass

import numpy as np

from porefv.conductance.conductances import throat_conductances
from porefv.conductance.model import ConductanceModel, ensure_model
from porefv.conductance.registry import AUTO
from porefv.errors import InputError, NoOpenPathWarning
from porefv.flow.fluid import Fluid
from porefv.flow.flux import fluxes, net_outflows, wall_face_fluxes, wall_fluxes
from porefv.flow.open_path import has_open_path, no_open_path_text
from porefv.flow.pressure import solve_pressure
from porefv.flow.walls import Walls
from porefv.mesh.cell_mesh import ensure_walls
from porefv.mesh.pore_mesh import PoreMesh
from porefv.solvers.solver import TOLERANCE


@dataclass(frozen=True)
class DirectionalPermeabilities:
    """Permeabilities along the axes, each between the two walls across its axis.

    Attributes
    ----------
    x, y, z : float
        k = μ Q h0 / (ΔP S) along each axis (C12 §3.3) [m²].
    slip : bool
        Whether the four walls beside the flow were planes of symmetry; if not, they dragged the fluid.
    """

    x: float
    y: float
    z: float
    slip: bool


def directional_permeabilities(
    mesh: PoreMesh,
    fluid: Fluid | None = None,
    conductance: ConductanceModel | None = None,
    *,
    slip: bool = False,
    solver: str = "auto",
    tolerance: float = TOLERANCE,
) -> DirectionalPermeabilities:
    """Permeabilities of a packing along x, y and z, each as of `PoreFlow(mesh, Walls.along(axis, slip=slip))`.

    The mesh is made once. Conductances are computed once if they do not depend on the direction, which is so without
    `slip`.

    Parameters
    ----------
    mesh : PoreMesh
    fluid : Fluid, optional
    conductance : ConductanceModel, optional
        `SectionFriction()` by default.
    slip : bool
        Whether the four walls beside the flow are planes of symmetry. If not, they drag the fluid.
    solver, tolerance
        See `porefv.solvers.solver.Solver`.

    Raises
    ------
    InputError, ComputationError
        As of `PoreFlow`.

    Warns
    -----
    NoOpenPathWarning
        If there are axes along which no open path leads through the packing. These permeabilities are 0.

    Examples
    --------
    >>> mesh = PoreMesh(Packing.read("data/packings/n25_s1.csv"))
    >>> found = directional_permeabilities(mesh)
    >>> print(f"{found.x:.3g}, {found.y:.3g}, {found.z:.3g} m²")
    0.000236, 0.00019, 0.000281 m²
    """
    fluid = fluid if fluid is not None else Fluid()
    ensure_walls(mesh)
    model = ensure_model(conductance) if conductance is not None else AUTO()
    found, conductances, walls_before = [], np.empty(0), None
    closed: list[str] = []
    text = ""
    for axis, name in enumerate("xyz"):
        walls = Walls.along(name, slip=slip)
        if walls_before is None or (walls.slip != walls_before.slip).any():
            conductances = throat_conductances(mesh, model, walls.slip, fluid.viscosity)
        walls_before = walls
        if not has_open_path(mesh, conductances, walls):
            closed.append(name)
            text = no_open_path_text(mesh, conductances, f"along {', '.join(closed)}")
        field = solve_pressure(mesh, conductances, walls, solver=solver, tolerance=tolerance)
        outflows = net_outflows(mesh, fluxes(mesh, conductances, field))
        through = wall_fluxes(mesh, wall_face_fluxes(mesh, outflows, walls.held))[2 * axis : 2 * axis + 2]
        flux = 0.5 * (max(through[0], 0.0) + max(-through[1], 0.0))
        found.append(float(fluid.viscosity * flux * mesh.box.size[axis] / mesh.box.section(axis)))
    if closed:
        warnings.warn(text, NoOpenPathWarning, stacklevel=2)
    x, y, z = found
    return DirectionalPermeabilities(x, y, z, bool(slip))


def slip_of_impervious_walls(walls: Walls) -> bool:
    """Whether the fluid slips along the walls that it does not pass: false where there are none.

    Raises
    ------
    InputError
        If it slips along some of them only.
    """
    slips = walls.slip[~(walls.held | walls.imposes_flow)]
    if len(slips) and slips.any() != slips.all():
        raise InputError(
            "permeabilities along all axes need the same slip on all walls that fluid does not pass; give it in "
            "lateral, or give the same to each wall"
        )
    return bool(slips.any())
