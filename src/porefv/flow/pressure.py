"""The pressure of every pore, from the conductances of the throats and the pressures imposed on the walls."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from porefv.conductance.conductances import check_conductances
from porefv.errors import InputError, counted
from porefv.flow.inside import refuse_sources_without_outlet
from porefv.flow.walls import Walls, ensure_no_imposed_flow
from porefv.mesh.cell_mesh import ensure_walls
from porefv.mesh.pore_mesh import PoreMesh
from porefv.solvers.pressure_equation import reached, solve_network
from porefv.solvers.solver import TOLERANCE, SolverReport
from porefv.system.number_checks import one_value_each


@dataclass(frozen=True, eq=False)
class PressureField:
    """Piezometric pressure of every pore.

    Attributes
    ----------
    reference : float
        The lowest imposed pressure, kept apart so that a small drop on a large pressure keeps its digits [Pa].
    relative : (n_pores,) array
        Pressure of each pore above the reference [Pa].
    remainder : (n_pores,) array
        What rounding has left of each pressure: differences of `relative` plus those of `remainder` drive the fluxes,
        also through throats that are many decades more conductive than others [Pa].
    isolated : (n_pores,) bool array
        Pores from which no flow reaches a pore of imposed pressure.
    report : SolverReport
    """

    reference: float
    relative: np.ndarray
    remainder: np.ndarray
    isolated: np.ndarray
    report: SolverReport

    @property
    def pressure(self) -> np.ndarray:
        """(n_pores,): pressure of each pore [Pa]."""
        return self.relative + self.reference

    def drops(self, pairs: np.ndarray) -> np.ndarray:
        """(t,): fall of pressure from the first to the second pore of each pair (t, 2) [Pa]."""
        i, j = pairs.T
        return (self.relative[i] - self.relative[j]) + (self.remainder[i] - self.remainder[j])


def as_field(mesh: PoreMesh, pressure: PressureField | np.ndarray) -> PressureField:
    """The field; an array (n_pores,) of pressures [Pa] as a field without a reference.

    Raises
    ------
    InputError
        For an array of the wrong shape, or with values that are not finite.
    """
    ensure_walls(mesh)
    if isinstance(pressure, PressureField):
        return pressure
    values = check_by_pore(mesh, pressure)
    n = mesh.n_pores
    report = SolverReport("given", n, 0, 0.0, float("nan"), 0.0, 0.0)
    return PressureField(0.0, values, np.zeros(n), np.zeros(n, bool), report)


def check_by_pore(mesh: PoreMesh, values: ArrayLike, what: str = "pressure") -> np.ndarray:
    """(n_pores,) float array; InputError if the shape is another, or a value is not finite."""
    ensure_walls(mesh)
    found = one_value_each(values, mesh.n_pores, "pore", what)
    if not np.isfinite(found).all():
        bad = np.flatnonzero(~np.isfinite(found))
        raise InputError(
            f"{what} must be finite: {counted(len(bad), 'pore')} have {found[bad[0]]}, pore {bad[0]} first"
        )
    return found


def held_pressures(mesh: PoreMesh, pressures: np.ndarray, inside: np.ndarray | None = None) -> np.ndarray:
    """(n_pores,): pressure of the pores on walls of given pressure (6,), NaN elsewhere [Pa].

    Pores that touch several such walls take the mean of theirs. Pores with a pressure `inside`, (n_pores,), NaN
    elsewhere, have that [Pa].
    """
    faces = mesh.wall_faces
    held = ~np.isnan(pressures[faces.walls])
    pores = mesh.cell_pore[faces.cells[held]]
    pairs = np.unique(np.stack([pores, faces.walls[held]], axis=1), axis=0)
    count = np.bincount(pairs[:, 0], minlength=mesh.n_pores)
    total = np.bincount(pairs[:, 0], pressures[pairs[:, 1]], mesh.n_pores)
    found = np.divide(total, count, out=np.full(mesh.n_pores, np.nan), where=count > 0)
    return found if inside is None else np.where(np.isnan(inside), found, inside)


def pores_of_several_pressures(mesh: PoreMesh, walls: Walls) -> np.ndarray:
    """(n_pores,) bool: pores that touch walls of different imposed pressures."""
    faces = mesh.wall_faces
    imposed = walls.pressures[faces.walls]
    held = ~np.isnan(imposed)
    pores = mesh.cell_pore[faces.cells[held]]
    lowest, highest = np.full(mesh.n_pores, np.inf), np.full(mesh.n_pores, -np.inf)
    np.minimum.at(lowest, pores, imposed[held])
    np.maximum.at(highest, pores, imposed[held])
    return lowest < highest


def reference_pressure(walls: Walls, inside: np.ndarray | None = None) -> float:
    """The lowest pressure imposed on walls, and `inside` on pores, (n_pores,), NaN where there is none [Pa].

    Raises
    ------
    InputError
        If there is none.
    """
    imposed = walls.pressures if inside is None else np.concatenate([walls.pressures, inside])
    if np.isnan(imposed).all():
        raise InputError("no wall has a pressure: give at least one, for instance y_min = { pressure = 1.0 }")
    return float(np.nanmin(imposed))


def solve_pressure(
    mesh: PoreMesh,
    conductances: np.ndarray,
    walls: Walls,
    *,
    sources: np.ndarray | None = None,
    inside: np.ndarray | None = None,
    solver: str = "auto",
    tolerance: float = TOLERANCE,
) -> PressureField:
    """Solve Σ_j K_ij (p_i - p_j) = source_i for the pores that are not on a wall of imposed pressure (C12 eq. 20).

    Parameters
    ----------
    mesh : PoreMesh
    conductances : (t,) array
        K of each throat [m³/(Pa s)], from `porefv.conductance.conductances` or elsewhere; zero where closed.
    walls : Walls
        At least one must have a pressure, if no pore has one `inside`. For walls of imposed flow see
        `porefv.flow.solve_imposed_flow`.
    sources : (n_pores,) array, optional
        Volume injected into each pore per unit time. What is injected into a pore on a wall of imposed pressure leaves
        through the wall, and changes no pressure [m³/s].
    inside : (n_pores,) array, optional
        Pressure imposed on pores, NaN where there is none [Pa].
    solver, tolerance
        See `porefv.solvers.Solver`.

    Raises
    ------
    InputError
        If no wall has a pressure, a wall has an imposed flow, or an argument has the wrong shape.
    ComputationError
        If the solver fails, or an isolated pore has a source.

    Notes
    -----
    Theory, method: :eq:`eq-pressure`.

    Examples
    --------
    >>> mesh, walls = PoreMesh(Packing.read("data/packings/n25_s1.csv")), Walls.along("y")
    >>> conductances = throat_conductances(mesh, SectionFriction(), walls.slip, viscosity=1e-3)
    >>> solve_pressure(mesh, conductances, walls).pressure.shape
    (122,)
    """
    ensure_walls(mesh)
    conductances = check_conductances(mesh, conductances)
    if sources is not None:
        sources = check_by_pore(mesh, sources, "sources")
    ensure_no_imposed_flow(walls)
    reference = reference_pressure(walls, inside)
    relative = None if inside is None else inside - reference
    held = held_pressures(mesh, walls.pressures - reference, relative)
    if sources is not None and sources.any():
        refuse_sources_without_outlet(mesh, sources, reached(mesh.throats.pores, conductances, ~np.isnan(held)))
    found = solve_network(
        mesh.throats.pores,
        conductances,
        held,
        links=lambda: mesh.throats.areas,
        sources=sources,
        solver=solver,
        tolerance=tolerance,
    )
    return PressureField(reference, found.pressure, found.rest, found.isolated, found.report)
