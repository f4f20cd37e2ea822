"""The pressure of every pore of a periodic mesh under a mean gradient, for a unit gradient along each axis."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from porefv.conductance.conductances import check_conductances
from porefv.mesh.periodic_mesh import PeriodicMesh
from porefv.solvers.pressure_equation import free_network, joined_parts
from porefv.solvers.solver import TOLERANCE, Solver, SolverReport


@dataclass(frozen=True, eq=False)
class GradientSolutions:
    """Pressures that fall by 1 Pa/m along x, along y and along z, on average.

    Attributes
    ----------
    pressures : (3, n_pores) array
        Piezometric pressure of each pore at its place; it is zero on average at the middle of the cell. An image of a
        pore has a pressure lower by what the mean gradient makes of the steps to it [Pa].
    drops : (3, t) array
        Fall of the pressure along each throat, from its first pore to its second [Pa].
    parts : (n_pores,) int array
        Equal for pores that open throats join.
    reports : tuple of SolverReport
        Of the three solutions.
    """

    pressures: np.ndarray
    drops: np.ndarray
    parts: np.ndarray
    reports: tuple[SolverReport, ...]


def mean_conductivity(mesh: PeriodicMesh, conductances: np.ndarray, drops: np.ndarray) -> np.ndarray:
    """(3, 3): tensor Σ K d_a d_b / V, flow through a unit of area for a unit gradient, from the drops (3, t)."""
    tensor = (drops * conductances) @ drops.T / mesh.periodic_cell.volume
    return 0.5 * (tensor + tensor.T)


def throat_steps(mesh: PeriodicMesh) -> tuple[np.ndarray, np.ndarray]:
    """Pores (t, 2) of the period that throats join, and the vector (t, 3) to the image that is the second [m]."""
    pores, steps = mesh.pore_owners
    rows = mesh.throats.pores
    return pores[rows], (steps[rows[:, 1]] - steps[rows[:, 0]]) @ mesh.vectors


def solve_gradients(
    mesh: PeriodicMesh, conductances: np.ndarray, *, solver: str = "auto", tolerance: float = TOLERANCE
) -> GradientSolutions:
    """Solve Σ_j K_ij (p_i - p_j + G·s_ij) = 0 for G = 1 Pa/m along each axis, s_ij being the steps across the boundary.

    The pressure of one pore is held in each part of the network that open throats join. Each part is then raised or
    lowered as a whole, such that nothing would flow from part to part if closed throats conducted by their areas: this
    changes no flow, but keeps the pressure of closed pores and pockets within that of their surroundings.

    Parameters
    ----------
    mesh : PeriodicMesh
    conductances : (t,) array
        K of each throat, zero where closed [m³/(Pa s)].
    solver, tolerance
        See `porefv.solvers.Solver`.

    Raises
    ------
    InputError
        If an argument has the wrong shape, or values that are not allowed.
    ComputationError
        If the solver fails.
    """
    conductances = check_conductances(mesh, conductances)
    pairs, steps = throat_steps(mesh)
    n = mesh.n_pores
    # A throat from a pore to an image of itself has the same flux into it and out of it.
    links = np.where(pairs[:, 0] == pairs[:, 1], 0.0, conductances)
    parts = joined_parts(pairs, links, n)
    free = np.ones(n, bool)
    free[_best_joined(parts, pairs, links)] = False
    network, _ = free_network(pairs, links, np.zeros(n), free, np.zeros(n))
    ready = Solver(network, solver, many=True)
    pressures, drops, reports = np.zeros((3, n)), np.empty((3, len(pairs))), []
    i, j = pairs.T
    size = float(np.abs(mesh.vectors).max())
    for axis in range(3):
        crossing = links * steps[:, axis]
        sources = np.bincount(j, crossing, n) - np.bincount(i, crossing, n)
        # A unit gradient makes a pressure of the order of the cell's size.
        found = ready.solve_split(np.zeros(len(network)), sources[free], tolerance, drive=size)
        rest = np.zeros(n)
        pressures[axis, free], rest[free] = found.pressure, found.rest
        drops[axis] = (pressures[axis, i] - pressures[axis, j]) + (rest[i] - rest[j]) + steps[:, axis]
        reports.append(found.report)
    between = parts[i] != parts[j]
    if between.any():
        levels = _levels(parts[pairs[between]], mesh.throats.areas[between], drops[:, between], parts, tolerance)
        pressures += levels
        drops[:, between] += levels[:, i[between]] - levels[:, j[between]]
    middle = 0.5 * mesh.vectors.sum(axis=0)
    volumes = np.maximum(mesh.pore_volumes, 0.0)
    periodic = pressures + (mesh.pore_centres - mesh.triangulation.origin - middle).T
    pressures -= (periodic @ volumes / volumes.sum())[:, None]
    return GradientSolutions(pressures, drops, parts, tuple(reports))


def _best_joined(parts: np.ndarray, pairs: np.ndarray, conductances: np.ndarray) -> np.ndarray:
    """The pore of each part whose throats conduct most: all others' pressures follow well from that of this one."""
    totals = np.bincount(pairs.ravel(), np.repeat(conductances, 2), len(parts))
    order = np.lexsort((-totals, parts))
    _, first = np.unique(parts[order], return_index=True)
    return order[first]


def _levels(pairs: np.ndarray, areas: np.ndarray, drops: np.ndarray, parts: np.ndarray, tolerance: float) -> np.ndarray:
    """(3, n_pores): what the pressure of each part is raised by, from drops (3, c) between pairs (c, 2) of parts."""
    n = len(parts)
    first = np.bincount(parts, minlength=n).argmax()  # the largest part stays
    free = np.zeros(n, bool)
    free[np.unique(pairs)] = True
    free[first] = False
    network, _ = free_network(pairs, areas, np.zeros(n), free, np.zeros(n))
    ready = Solver(network, many=True)
    levels = np.zeros((3, n))
    for axis in range(3):
        driving = areas * drops[axis]
        sources = np.bincount(pairs[:, 1], driving, n) - np.bincount(pairs[:, 0], driving, n)
        levels[axis, free] = ready.solve_split(np.zeros(len(network)), sources[free], tolerance).pressure
    return levels[:, parts]
