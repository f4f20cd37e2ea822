"""PeriodicFlow: steady viscous flow through a packing in a periodic cell, driven by a mean pressure gradient."""

from __future__ import annotations

from collections.abc import Sequence
from types import NoneType

import numpy as np

from porefv.conductance.conductances import throat_conductances
from porefv.conductance.model import ConductanceModel, ensure_model
from porefv.conductance.registry import AUTO
from porefv.errors import InputError
from porefv.flow.fluid import Fluid
from porefv.flow.forces import Forces, scatter_forces, unit_forces
from porefv.flow.periodic_pressure import GradientSolutions, mean_conductivity, solve_gradients, throat_steps
from porefv.flow.pressure_on_grains import ACTING
from porefv.flow.velocity import throat_centroids
from porefv.mesh.periodic_mesh import PeriodicMesh
from porefv.packing.packing import Packing
from porefv.solvers.solver import TOLERANCE, SolverReport
from porefv.system.html_table import html_table
from porefv.system.lazy import FixedInputs, lazy_property
from porefv.system.number_checks import ensure_finite, three_numbers

# No wall is one of symmetry, as there is none.
_NO_SLIP = np.zeros(6, bool)
_NO_SLIP.flags.writeable = False


class PeriodicFlow(FixedInputs):
    """Steady flow of a viscous fluid through a packing in a periodic cell.

    The pressure is a periodic one plus one that varies evenly in space, by a mean gradient ∇p. Everything is linear in
    that gradient: three solutions, for a gradient along each axis, give the flow of any other.

    Parameters
    ----------
    mesh : PeriodicMesh or Packing
        A packing in a `Cell`, or its mesh.
    fluid : Fluid
    conductance : ConductanceModel, optional
        `SectionFriction()` by default.
    solver, tolerance
        See `porefv.solvers.solver.Solver`.

    Raises
    ------
    InputError
        If the packing is in no periodic cell, or an argument is of the wrong kind.

    Examples
    --------
    >>> flow = PeriodicFlow(Packing([[0, 0, 0]], [0.5], Cell([1, 1, 1])))
    >>> print(f"{flow.permeability[0, 0]:.4g} m²")
    0.002525 m²
    """

    def __init__(
        self,
        mesh: PeriodicMesh | Packing,
        fluid: Fluid | None = None,
        conductance: ConductanceModel | None = None,
        *,
        solver: str = "auto",
        tolerance: float = TOLERANCE,
    ):
        if not isinstance(mesh, PeriodicMesh | Packing):
            raise InputError(f"mesh must be a PeriodicMesh or a Packing in a Cell, not {mesh!r}")
        if not isinstance(fluid, Fluid | NoneType):
            raise InputError(f"fluid must be a Fluid, such as Fluid(viscosity=1e-3), not {fluid!r}")
        self.mesh = PeriodicMesh(mesh) if isinstance(mesh, Packing) else mesh
        self.fluid = fluid if fluid is not None else Fluid()
        self.conductance = ensure_model(conductance) if conductance is not None else AUTO()
        self.solver = solver
        self.tolerance = tolerance

    # ---- the three solutions ------------------------------------------------------------------------------------

    @lazy_property
    def conductances(self) -> np.ndarray:
        """(t,): K of each throat, q = K (p_i - p_j); zero where closed [m³/(Pa s)]."""
        return throat_conductances(self.mesh, self.conductance, _NO_SLIP, self.fluid.viscosity)

    @lazy_property
    def solutions(self) -> GradientSolutions:
        """Pressures that fall by 1 Pa/m along each axis."""
        return solve_gradients(self.mesh, self.conductances, solver=self.solver, tolerance=self.tolerance)

    @property
    def solver_reports(self) -> tuple[SolverReport, ...]:
        """Solver, iterations and residual of the three solutions."""
        return self.solutions.reports

    # ---- permeability -------------------------------------------------------------------------------------------

    @lazy_property
    def permeability(self) -> np.ndarray:
        """(3, 3): tensor k of U = -k ∇p / μ, with U the flow through a unit of area, symmetric [m²].

        It is that of the power that the flow takes up, k_ab = μ Σ K d_a d_b / V over all throats, with d_a the drop
        along a throat where the pressure falls by 1 Pa/m along a.
        """
        tensor = mean_conductivity(self.mesh, self.conductances, self.solutions.drops)
        return ensure_finite(self.fluid.viscosity * tensor, "permeabilities")

    @lazy_property
    def permeability_by_flux(self) -> np.ndarray:
        """(3, 3): the same tensor from the mean flux, by its axis (row) and that of the gradient (column) [m²].

        Its difference from `permeability` shows how exactly the pressure equation is solved.
        """
        _, steps = throat_steps(self.mesh)
        flux = self.conductances * self.solutions.drops
        return self.fluid.viscosity * (flux @ steps).T / self.mesh.periodic_cell.volume

    @property
    def permeability_error(self) -> float:
        """Largest difference between `permeability` and `permeability_by_flux`, relative to the largest entry."""
        largest = float(np.abs(self.permeability).max())
        return float(np.abs(self.permeability - self.permeability_by_flux).max()) / largest if largest > 0.0 else 0.0

    @lazy_property
    def _principal(self) -> tuple[np.ndarray, np.ndarray]:
        values, axes = np.linalg.eigh(self.permeability)
        # Each axis with its largest component positive: the sense of an eigenvector is arbitrary.
        axes = axes.T[::-1].copy()
        axes *= np.sign(axes[np.arange(3), np.abs(axes).argmax(axis=1)])[:, None]
        return values[::-1].copy(), axes

    @property
    def principal_permeabilities(self) -> np.ndarray:
        """(3,): permeabilities along the principal axes, the largest first [m²]."""
        return self._principal[0]

    @property
    def principal_axes(self) -> np.ndarray:
        """(3, 3): unit vectors along which flow and gradient are parallel, a row each, in the same order.

        Where permeabilities are equal but for rounding, as those of cubic lattices are, axes are arbitrary.
        """
        return self._principal[1]

    @property
    def porosity(self) -> float:
        """Porosity of the packing."""
        return self.mesh.packing.porosity

    # ---- the flow of a gradient -----------------------------------------------------------------------------------

    def pressure(self, gradient: Sequence[float] | np.ndarray) -> np.ndarray:
        """(n_pores,): piezometric pressure of each pore at its place, `mesh.pore_centres` [Pa].

        It is zero on average at the middle of the cell.

        Parameters
        ----------
        gradient : (3,) array
            Mean gradient of the pressure [Pa/m]: the fluid flows the other way.
        """
        return -_checked(gradient) @ self.solutions.pressures

    def flux(self, gradient: Sequence[float] | np.ndarray) -> np.ndarray:
        """(t,): flux through each throat, from its first pore to its second [m³/s]; `gradient` as of `pressure`."""
        return self.conductances * (-_checked(gradient) @ self.solutions.drops)

    def darcy_velocity(self, gradient: Sequence[float] | np.ndarray) -> np.ndarray:
        """(3,): flow through a unit of area, U = -k ∇p / μ [m/s]; `gradient` as of `pressure`."""
        return -self.permeability @ _checked(gradient) / self.fluid.viscosity

    def pore_velocity(self, gradient: Sequence[float] | np.ndarray) -> np.ndarray:
        """(n_pores, 3): mean velocity of each pore, as of `porefv.flow.pore_velocities`; `gradient` as of `pressure`.

        Velocities times volumes add up to the volume of the cell times the `darcy_velocity` [m/s].
        """
        mesh = self.mesh
        pairs, steps = throat_steps(mesh)
        centres = throat_centroids(mesh)
        flux = self.flux(gradient)
        moments = np.zeros((mesh.n_pores, 3))
        for axis in range(3):
            leaving, entering = (flux * place[:, axis] for place in (centres, centres - steps))
            moments[:, axis] = np.bincount(pairs[:, 0], leaving, mesh.n_pores)
            moments[:, axis] -= np.bincount(pairs[:, 1], entering, mesh.n_pores)
        volumes = mesh.pore_volumes[:, None]
        return np.divide(moments, volumes, out=np.zeros_like(moments), where=volumes > 0.0)

    @lazy_property
    def _acting_drops(self) -> np.ndarray:
        """(3, f): drop of the pressure that acts on the grains across each facet, for each solution [Pa]."""
        mesh = self.mesh
        own, steps = mesh.pore_owners
        pores = mesh.cell_pore[mesh.facets.cells]
        away = (steps[pores[:, 1]] - steps[pores[:, 0]]) @ mesh.vectors
        i, j = own[pores].T
        acting = self.solutions.pressures + self._towards_neighbours
        return acting[:, i] - acting[:, j] + away.T

    @property
    def _towards_neighbours(self) -> np.ndarray:
        """(3, n_pores) or 0: what acts on the grains of each pore above its own pressure (`acting_pressure`) [Pa]."""
        beyond = self.conductance.drop_beyond_vertices(self.mesh.throats, _NO_SLIP)
        if beyond is None:
            return np.zeros((3, 1))
        n = self.mesh.n_pores
        pores = throat_steps(self.mesh)[0][beyond.throats]
        weights = np.where(self.conductances[beyond.throats, None] == 0.0, 0.0, ACTING * beyond.parts)
        sums = np.bincount(pores.ravel(), weights.ravel(), n)  # over all images of a pore
        weights = weights / np.maximum(sums, 1.0)[pores]
        return np.stack(
            [
                np.bincount(pores[:, 1], weights[:, 1] * drop, n) - np.bincount(pores[:, 0], weights[:, 0] * drop, n)
                for drop in self.solutions.drops[:, beyond.throats]
            ]
        )

    @lazy_property
    def _unit_forces(self) -> np.ndarray:
        """(3, 2, n, 3): forces by pressure and by drag on each sphere, for each solution [N]."""
        mesh = self.mesh
        found = np.zeros((3, 2, mesh.n_spheres, 3))
        spheres = mesh.sphere_owners.rows
        for rows, forces in unit_forces(mesh, _NO_SLIP, self.conductance.force_split):
            vertices = spheres[mesh.facets.vertices[rows]]
            for drops, (pressure, viscous) in zip(self._acting_drops, found, strict=True):
                scatter_forces(vertices, drops[rows], forces, pressure, viscous)
        return found

    def forces(self, gradient: Sequence[float] | np.ndarray) -> Forces:
        """Forces of the fluid on each sphere; `gradient` as of `pressure`.

        They add up to -∇p V, the thrust: V is the volume of the cell, because the mean gradient acts on the spheres'
        own volume too. There is no buoyancy: pressures are piezometric.
        """
        drive = -_checked(gradient)
        pressure, viscous = np.einsum("a,apni->pni", drive, self._unit_forces)
        none = np.zeros((6, 3))
        volume = self.mesh.periodic_cell.volume
        return Forces(
            pressure=pressure,
            viscous=viscous,
            buoyancy=np.zeros_like(pressure),
            wall_pressure=none,
            wall_viscous=none,
            wall_buoyancy=none,
            thrust=drive * volume,
            scale=float(np.linalg.norm(drive)) * volume or 1.0,
        )

    # ---- for people -------------------------------------------------------------------------------------------------

    def _repr_html_(self) -> str:
        rows = [
            ("cell", self.mesh.periodic_cell.sides),
            ("conductance", self.conductance.name),
            ("principal permeabilities", ", ".join(f"{k:.4g}" for k in self.principal_permeabilities) + " m²"),
        ]
        return html_table("Periodic flow", rows)

    def __repr__(self) -> str:
        return f"PeriodicFlow({self.mesh!r}, {self.conductance.name})"


def _checked(gradient: Sequence[float] | np.ndarray) -> np.ndarray:
    return three_numbers(gradient, "the mean pressure gradient", "Pa/m")
