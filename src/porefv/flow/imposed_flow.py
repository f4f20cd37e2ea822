"""Walls of imposed flow: the pressures at which the imposed flows pass, and the flow at these pressures."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from porefv.errors import ComputationError
from porefv.flow.flux import fluxes, net_outflows, wall_face_fluxes, wall_fluxes
from porefv.flow.pressure import PressureField, held_pressures, reference_pressure, solve_pressure
from porefv.flow.walls import Walls
from porefv.mesh.pore_mesh import PoreMesh
from porefv.packing.box import WALLS
from porefv.solvers.pressure_equation import reached
from porefv.solvers.solver import TOLERANCE

# Solutions at corrected pressures, at most. Two are usual: the error of each correction is that of the solver.
CORRECTIONS = 6
# How far the flow through a wall may be from the imposed one: tolerances of the solver, relative to that flow, or to
# the largest flow where corrections do not help any more.
SHORT = 10.0


@dataclass(frozen=True, eq=False)
class FlowAtWalls:
    """The flow with pressures found at the walls of imposed flow.

    Attributes
    ----------
    field : PressureField
    walls : Walls
        The walls with the pressures found in place of the imposed flows.
    relative : (6,) array
        Pressure of each wall above the reference of the field, NaN where it has none [Pa].
    """

    field: PressureField
    walls: Walls
    relative: np.ndarray


def solve_imposed_flow(
    mesh: PoreMesh,
    conductances: np.ndarray,
    walls: Walls,
    *,
    sources: np.ndarray | None = None,
    inside: np.ndarray | None = None,
    solver: str = "auto",
    tolerance: float = TOLERANCE,
) -> FlowAtWalls:
    """Find the pressures of the walls of imposed flow, and the pressure of every pore.

    Each such wall has one pressure. Flows are linear in these pressures, Q = Q_0 + G p. Column j of G has the flows at
    unit pressure on wall j, and Q_0 those without pressures on the walls of imposed flow. The pressure equation is
    solved once for each column, then at the pressures p = G⁻¹ (Q - Q_0).

    Parameters
    ----------
    mesh : PoreMesh
    conductances : (t,) array
        K of each throat [m³/(Pa s)].
    walls : Walls
        Where no wall, and no pore `inside`, has a pressure, the imposed flows and sources must add up to zero. The last
        wall of imposed flow then has the pressure 0.
    sources, inside, solver, tolerance
        See `solve_pressure`.

    Raises
    ------
    InputError
        For arguments that `solve_pressure` does not allow.
    ComputationError
        If the solver fails, or no open path leads from a wall of imposed flow to an imposed pressure.

    Notes
    -----
    Theory, method: :eq:`eq-imposed-flow`.

    Examples
    --------
    >>> mesh = PoreMesh(Packing.read("data/packings/n25_s1.csv"))
    >>> walls = Walls(y_min=Wall(inflow=1e-3), y_max=Wall(pressure=0.0))
    >>> conductances = throat_conductances(mesh, SectionFriction(), walls.slip, viscosity=1e-3)
    >>> found = solve_imposed_flow(mesh, conductances, walls)
    >>> print(f"{found.walls.y_min.pressure:.3g} Pa")
    0.00526 Pa
    """
    flows = walls.imposed_flows(mesh.box)
    unknown = np.flatnonzero(walls.imposes_flow)
    known = walls.pressures
    if not walls.held.any() and (inside is None or np.isnan(inside).all()):
        known[unknown[-1]] = 0.0
        unknown = unknown[:-1]
    reference = reference_pressure(walls.with_pressures(known), inside)
    known -= reference
    inside = None if inside is None else inside - reference
    _refuse_walls_without_outlet(mesh, conductances, known, unknown, inside)

    injected = np.zeros(mesh.n_pores) if sources is None else sources

    def solve(pressures: np.ndarray, *, unit: bool = False) -> tuple[PressureField, np.ndarray]:
        """The flow at pressures of all walls (6,), and its flux through each wall (6,) [m³/s]."""
        at = walls.with_pressures(pressures)
        given = None if inside is None else (np.where(np.isnan(inside), inside, 0.0) if unit else inside)
        field = solve_pressure(
            mesh, conductances, at, sources=None if unit else sources, inside=given, solver=solver,
            tolerance=tolerance,
        )  # fmt: skip
        outflows = net_outflows(mesh, fluxes(mesh, conductances, field))
        faces = wall_face_fluxes(mesh, outflows if unit else outflows - injected, at.held)
        return field, wall_fluxes(mesh, faces)

    found, base = known.copy(), np.where(np.isnan(known), known, 0.0)
    found[unknown], base[unknown] = 0.0, 0.0
    columns = np.empty((len(unknown), len(unknown)))
    for j, wall in enumerate(unknown):
        one = base.copy()
        one[wall] = 1.0
        columns[:, j] = solve(one, unit=True)[1][unknown]
    asked, before = flows[unknown], np.inf
    for _ in range(CORRECTIONS):
        field, through = solve(found)
        short = asked - through[unknown]
        missing = float(np.abs(short).max(initial=0.0))
        size = max(np.abs(through).max(), np.abs(asked).max(initial=0.0))
        exact = np.abs(short) <= SHORT * tolerance * np.where(asked != 0.0, np.abs(asked), size)
        if exact.all() or missing > 0.5 * before:
            break
        before = missing
        found[unknown] += np.linalg.solve(columns, short)
    if missing > SHORT * tolerance * size:
        worst = int(unknown[np.argmax(np.abs(short))])
        raise ComputationError(
            f"the flow through {WALLS[worst]} is {through[worst]:.6g} m³/s instead of {flows[worst]:.6g} m³/s, and "
            "correcting its pressure does not help; try a smaller tolerance, or solver = 'direct'"
        )
    lowest = reference_pressure(walls.with_pressures(found), inside)
    return FlowAtWalls(
        replace(field, reference=reference + lowest),
        walls.with_pressures(found + reference),
        found - lowest,
    )


def _refuse_walls_without_outlet(
    mesh: PoreMesh, conductances: np.ndarray, known: np.ndarray, unknown: np.ndarray, inside: np.ndarray | None
) -> None:
    """ComputationError if no open path leads from a wall of unknown pressure to a known one.

    A wall is taken as one more pore, to which all pores on it are joined.
    """
    faces, n = mesh.wall_faces, mesh.n_pores
    on_unknown = np.isin(faces.walls, unknown)
    joined = np.stack([mesh.cell_pore[faces.cells[on_unknown]], n + faces.walls[on_unknown]], axis=1)
    pairs = np.concatenate([mesh.throats.pores, joined.astype(mesh.throats.pores.dtype)])
    weights = np.concatenate([conductances, np.ones(len(joined))])
    held = np.concatenate([~np.isnan(held_pressures(mesh, known, inside)), np.zeros(6, bool)])
    has_outlet = reached(pairs, weights, held)
    closed = [WALLS[wall] for wall in unknown if not has_outlet[n + wall]]
    if closed:
        raise ComputationError(
            f"no open path leads from {closed[0]}, which has an imposed flow, to an imposed pressure: no flow can pass"
        )
