"""Whether an open path leads through a sample, from one imposed pressure to another."""

from __future__ import annotations

import numpy as np

from porefv.errors import counted
from porefv.flow.pressure import held_pressures, pores_of_several_pressures
from porefv.flow.walls import Walls
from porefv.mesh.pore_mesh import PoreMesh
from porefv.solvers.pressure_equation import joined_parts, pressures_of_parts


def has_open_path(mesh: PoreMesh, conductances: np.ndarray, walls: Walls, inside: np.ndarray | None = None) -> bool:
    """Whether an open path joins two different imposed pressures; also true where all imposed pressures are the same.

    A path leads through throats whose conductance is not zero, or through a pore that touches walls of different
    pressures.

    Parameters
    ----------
    mesh : PoreMesh
    conductances : (t,) array
        K of each throat [m³/(Pa s)].
    walls : Walls
        Without imposed flows.
    inside : (n_pores,) array, optional
        Pressure imposed on pores, NaN where there is none [Pa].
    """
    held = held_pressures(mesh, walls.pressures, inside)
    known = held[~np.isnan(held)]
    if (known == known[:1]).all() or pores_of_several_pressures(mesh, walls).any():
        return True
    lowest, highest = pressures_of_parts(joined_parts(mesh.throats.pores, conductances, mesh.n_pores), held)
    return bool((lowest < highest).any())


def no_open_path_text(mesh: PoreMesh, conductances: np.ndarray, between: str) -> str:
    """What is to be said where no open path leads through a sample, with the numbers of closed throats.

    Parameters
    ----------
    mesh : PoreMesh
    conductances : (t,) array
        K of each throat [m³/(Pa s)].
    between : str
        Names of inlet and outlet.
    """
    closed = conductances == 0.0
    covered = int(np.count_nonzero(closed & mesh.throats.covered))
    return (
        f"no open path leads from the inlet to the outlet ({between}): {counted(len(closed), 'throat')}, of which "
        f"{int(np.count_nonzero(closed))} are closed, {covered} of them because their spheres cover them. No fluid "
        "passes between them"
    )
