"""Effective diffusivity: steady diffusion through the pores, from wall to wall of a box or in a periodic cell."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from porefv.conductance.conductances import check_conductances, ensure_pore_mesh
from porefv.conductance.prism_sections import diffusive_conductances
from porefv.errors import InputError
from porefv.flow.flux import net_outflows
from porefv.flow.periodic_pressure import mean_conductivity, solve_gradients
from porefv.mesh.cell_mesh import ensure_walls
from porefv.mesh.periodic_mesh import PeriodicMesh
from porefv.mesh.pore_mesh import PoreMesh
from porefv.solvers.pressure_equation import reached, solve_network
from porefv.solvers.solver import TOLERANCE


@dataclass(frozen=True, eq=False)
class EffectiveDiffusion:
    """Steady diffusion along an axis of the box.

    The numbers are those of a solute in the fluid, of heat in the fluid alone, and of a current in a conducting fluid
    between insulating grains.

    Attributes
    ----------
    axis : {"x", "y", "z"}
    relative_diffusivity : float
        D_eff / D, referred to the whole section of the box; 0 if no open path joins the two walls [-].
    porosity : float
        ε of the packing [-].
    concentration : (n_pores,) array
        Of each pore: 1 on the lower wall, 0 on the upper one, values of neighbours where nothing diffuses [-].
    """

    axis: str
    relative_diffusivity: float
    porosity: float
    concentration: np.ndarray

    @property
    def formation_factor(self) -> float:
        """D / D_eff, resistance of the sample over that of the fluid without grains; infinite if nothing passes [-]."""
        return 1.0 / self.relative_diffusivity if self.relative_diffusivity > 0.0 else np.inf

    @property
    def diffusive_tortuosity(self) -> float:
        """Diffusive tortuosity ε / (D_eff / D); NaN if nothing passes [-].

        It is not the hydraulic tortuosity (`PoreFlow.tortuosity`). Others name its square root so.
        """
        return self.porosity / self.relative_diffusivity if self.relative_diffusivity > 0.0 else np.nan


def effective_diffusion(
    mesh: PoreMesh,
    axis: str,
    *,
    conductances: ArrayLike | None = None,
    solver: str = "auto",
    tolerance: float = TOLERANCE,
) -> EffectiveDiffusion:
    """Diffusion between the two walls across an axis, held at concentrations 1 and 0; nothing passes the other walls.

    The pores on the two walls have the concentration of the wall, as they have its pressure in a flow.

    Parameters
    ----------
    mesh : PoreMesh
    axis : {"x", "y", "z"}
    conductances : (t,) array, optional
        g of each throat, which passes D g (c_i - c_j); by default `diffusive_conductances(mesh.throats)` [m].
    solver, tolerance
        See `porefv.solvers.solver.Solver`.

    Raises
    ------
    InputError
        If the axis is unknown, or a pore touches both walls: the sample is too thin. If conductances are negative or
        not finite.
    ComputationError
        If the solver fails.

    Notes
    -----
    Theory, diffusion: :eq:`eq-diffusion`.

    Examples
    --------
    >>> from porefv import Box, Packing, PoreMesh
    >>> lattice = PoreMesh(Packing([[0.5, 0.5, 0.5]], [0.5], Box([0, 0, 0], [1, 1, 1])))
    >>> found = effective_diffusion(lattice, "z")  # touching spheres in a simple cubic lattice: 0.344 resolved
    >>> round(found.relative_diffusivity, 3), round(found.formation_factor, 2), round(found.diffusive_tortuosity, 2)
    (0.377, 2.65, 1.26)
    """
    ensure_pore_mesh(mesh)
    ensure_walls(mesh)
    if axis not in ("x", "y", "z"):
        raise InputError(f"axis must be 'x', 'y' or 'z', not {axis!r}")
    number = "xyz".index(axis)
    enters, leaves = ((mesh.pore_walls & (1 << wall)) != 0 for wall in (2 * number, 2 * number + 1))
    if (enters & leaves).any():
        pore = int(np.argmax(enters & leaves))
        raise InputError(
            f"pore {pore} touches both {axis}_min and {axis}_max: nothing is left between the two walls to diffuse "
            "through. Choose another axis, or a packing with more spheres between the walls"
        )
    given = diffusive_conductances(mesh.throats) if conductances is None else conductances
    pairs, passes = mesh.throats.pores, check_conductances(mesh, given, "m")
    held = np.select([enters, leaves], [1.0, 0.0], np.nan)
    found = solve_network(pairs, passes, held, solver=solver, tolerance=tolerance)
    relative = 0.0
    if reached(pairs, passes, enters)[leaves].any():
        i, j = pairs.T
        drops = (found.pressure[i] - found.pressure[j]) + (found.rest[i] - found.rest[j])
        passing = net_outflows(mesh, passes * drops)[enters].sum()
        relative = float(passing * mesh.box.size[number] / mesh.box.section(number))
    return EffectiveDiffusion(axis, relative, mesh.packing.porosity, found.pressure)


def periodic_diffusivity(
    mesh: PeriodicMesh,
    *,
    conductances: ArrayLike | None = None,
    solver: str = "auto",
    tolerance: float = TOLERANCE,
) -> np.ndarray:
    """Tensor D_eff / D of a packing in a periodic cell, referred to the whole section, (3, 3), symmetric [-].

    Parameters
    ----------
    mesh : PeriodicMesh
    conductances, solver, tolerance
        As of `effective_diffusion`.

    Raises
    ------
    InputError
        If the mesh is not periodic; if conductances are negative or not finite.
    ComputationError
        If the solver fails.

    Examples
    --------
    >>> from porefv import Cell, Packing, PeriodicMesh
    >>> lattice = PeriodicMesh(Packing([[0, 0, 0]], [0.5], Cell([1, 1, 1])))
    >>> np.diag(periodic_diffusivity(lattice)).round(3)  # touching spheres in a simple cubic lattice: 0.344 resolved
    array([0.377, 0.377, 0.377])
    """
    if not isinstance(mesh, PeriodicMesh):
        raise InputError("mesh must be a PeriodicMesh; for a packing in a box there is effective_diffusion")
    given = diffusive_conductances(mesh.throats) if conductances is None else conductances
    passes = check_conductances(mesh, given, "m")
    return mean_conductivity(mesh, passes, solve_gradients(mesh, passes, solver=solver, tolerance=tolerance).drops)
