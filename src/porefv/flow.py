"""PoreFlow: steady viscous flow through the pores of a fixed packing, each quantity computed when asked for."""

from __future__ import annotations

import math
import time
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from porefv.boundary import LEAST, MOST, Walls, within_range
from porefv.conductance import AUTO, ConductanceModel
from porefv.errors import ComputationError, InputError
from porefv.forces import Forces, acting_pressure, acting_weights, fluid_forces
from porefv.mesh import PoreMesh
from porefv.packing import WALLS, Packing
from porefv.pressure import PressureSolution, solve_network
from porefv.solvers import TOLERANCE, SolverReport
from porefv.velocity import pore_velocities

if TYPE_CHECKING:
    from porefv.fipy_bridge import FipyProblem

STANDARD_GRAVITY = 9.80665  # m/s², for the hydraulic conductivity k ρ g / μ


@dataclass(frozen=True)
class Fluid:
    """A viscous, incompressible fluid.

    Parameters
    ----------
    viscosity : float
        Dynamic viscosity μ [Pa s].
    density : float
        Density ρ [kg/m³].
    """

    viscosity: float = 1.0e-3
    density: float = 1000.0

    def __post_init__(self) -> None:
        if not (math.isfinite(self.viscosity) and self.viscosity > 0.0):
            raise InputError(f"viscosity must be a positive number of Pa s, not {self.viscosity!r}")
        if not within_range(self.viscosity):
            raise InputError(f"viscosity must lie between {LEAST:g} and {MOST:g} Pa s, not {self.viscosity!r}")
        if not (math.isfinite(self.density) and self.density >= 0.0):
            raise InputError(f"density must be a number of kg/m³, zero or more, not {self.density!r}")
        if self.density > MOST:
            raise InputError(f"density must be at most {MOST:g} kg/m³, not {self.density!r}")


def throat_conductances(mesh: PoreMesh, model: ConductanceModel, slip: np.ndarray, viscosity: float) -> np.ndarray:
    """(t,): K of each throat, q = K (p_i - p_j); zero where closed [m³/(Pa s)]."""
    throats = mesh.throats
    conductivity = model.conductivity(throats, slip)
    lengths = viscosity * throats.effective_lengths
    with np.errstate(over="ignore", invalid="ignore"):  # what is not finite is refused below
        conductances = np.divide(conductivity, lengths, out=lengths)
    conductances[(conductivity <= 0.0) | throats.closed] = 0.0
    return _finite(conductances, f"conductances of {model.name}")


def held_pressures(mesh: PoreMesh, pressures: np.ndarray) -> np.ndarray:
    """(n_pores,): pressure of the pores on walls of given pressure (6,), NaN elsewhere [Pa].

    Pores that touch several such walls take the mean of theirs.
    """
    faces = mesh.wall_faces
    held = ~np.isnan(pressures[faces.walls])
    pores = mesh.cell_pore[faces.cells[held]]
    pairs = np.unique(np.stack([pores, faces.walls[held]], axis=1), axis=0)
    count = np.bincount(pairs[:, 0], minlength=mesh.n_pores)
    total = np.bincount(pairs[:, 0], pressures[pairs[:, 1]], mesh.n_pores)
    return np.divide(total, count, out=np.full(mesh.n_pores, np.nan), where=count > 0)


class PoreFlow:
    """Steady flow of a viscous fluid through the pores of a fixed packing (C12).

    Pressures are piezometric, p = p* - ρ g·x: what drives the flow, without the hydrostatic part that gravity adds.

    Parameters
    ----------
    mesh : PoreMesh or Packing
    walls : Walls
        Condition on each wall; at least one must hold a pressure.
    fluid : Fluid
    conductance : ConductanceModel, optional
        `porefv.conductance.AUTO`, section friction, unless given; `HydraulicRadius()` is the paper's.
    gravity : (3,) sequence of float
        Acceleration of gravity, for buoyancy [m/s²].
    solver, tolerance
        See `porefv.solvers.Solver`.

    Examples
    --------
    >>> flow = PoreFlow(Packing.read("data/packings/n25_s1.csv"), Walls.along("y"))
    >>> print(f"{flow.permeability:.3g} m², {flow.forces}")
    """

    def __init__(
        self,
        mesh: PoreMesh | Packing,
        walls: Walls,
        fluid: Fluid | None = None,
        conductance: ConductanceModel | None = None,
        *,
        gravity: Sequence[float] = (0.0, 0.0, 0.0),
        solver: str = "auto",
        tolerance: float = TOLERANCE,
    ):
        self.mesh = PoreMesh(mesh) if isinstance(mesh, Packing) else mesh
        self.walls = walls
        self.fluid = fluid if fluid is not None else Fluid()
        self.conductance = conductance if conductance is not None else AUTO()
        self.gravity = np.asarray(gravity, float)
        self.solver = solver
        self.tolerance = tolerance
        self.timings: dict[str, float] = {}
        if self.gravity.shape != (3,) or not np.isfinite(self.gravity).all():
            raise InputError(f"gravity must be three finite numbers in m/s², not {gravity!r}")
        if np.abs(self.gravity).max() > MOST:
            raise InputError(f"gravity must be at most {MOST:g} m/s² along each axis, not {gravity!r}")
        if np.isnan(walls.pressures).all():
            raise InputError("no wall has a pressure: give at least one, for instance y_min = { pressure = 1.0 }")

    # ---- pressure -----------------------------------------------------------------------------------------------

    @cached_property
    def _reference(self) -> float:
        """Pressure subtracted from all, so that a small drop on a large pressure keeps its digits."""
        return float(np.nanmin(self.walls.pressures))

    @cached_property
    def _held(self) -> np.ndarray:
        """Imposed pressures less the lowest of them."""
        return held_pressures(self.mesh, self.walls.pressures - self._reference)

    @property
    def pores_of_several_pressures(self) -> np.ndarray:
        """(n_pores,) bool: pores that touch walls of different imposed pressures."""
        faces = self.mesh.wall_faces
        imposed = self.walls.pressures[faces.walls]
        held = ~np.isnan(imposed)
        pores = self.mesh.cell_pore[faces.cells[held]]
        lowest, highest = np.full(self.mesh.n_pores, np.inf), np.full(self.mesh.n_pores, -np.inf)
        np.minimum.at(lowest, pores, imposed[held])
        np.maximum.at(highest, pores, imposed[held])
        return lowest < highest

    @property
    def imposed_pressures(self) -> np.ndarray:
        """(n_pores,): imposed pressure of the pores on pressure walls, NaN elsewhere [Pa].

        Pores that touch several pressure walls take the mean of theirs.
        """
        return self._held + self._reference

    @cached_property
    def conductances(self) -> np.ndarray:
        """(t,): K of each throat, q = K (p_i - p_j); zero where closed [m³/(Pa s)]."""
        with self._timed("throats"):
            return throat_conductances(self.mesh, self.conductance, self.walls.slip, self.fluid.viscosity)

    @cached_property
    def solution(self) -> PressureSolution:
        """The solved network, pressures less the lowest imposed one."""
        conductances = self.conductances
        with self._timed("solve"):
            return solve_network(
                self.mesh.throats.pores,
                conductances,
                self._held,
                links=lambda: self.mesh.throats.areas,
                solver=self.solver,
                tolerance=self.tolerance,
            )

    @cached_property
    def pressure(self) -> np.ndarray:
        """(n_pores,): piezometric pressure of each pore [Pa]."""
        return self.solution.pressure + self._reference

    @cached_property
    def _acting_pressure(self) -> np.ndarray:
        held = ~np.isnan(self._held)
        leaning = acting_weights(self.mesh, self.conductance, self.conductances, self.walls.slip, held)
        return acting_pressure(leaning, self.solution.pressure)

    @property
    def acting_pressure(self) -> np.ndarray:
        """(n_pores,): piezometric pressure that acts on the solid of each pore (`forces.acting_weights`) [Pa]."""
        return self._acting_pressure + self._reference

    @property
    def cell_pressure(self) -> np.ndarray:
        """(n_cells,): piezometric pressure of each cell [Pa]."""
        return self.pressure[self.mesh.cell_pore]

    @property
    def solver_report(self) -> SolverReport:
        """Solver, iterations and residual."""
        return self.solution.report

    # ---- fluxes -------------------------------------------------------------------------------------------------

    @property
    def _drop(self) -> np.ndarray:
        """(t,): fall of pressure along each throat [Pa]."""
        p, rest = self.solution.pressure, self.solution.rest
        i, j = self.mesh.throats.pores.T
        return (p[i] - p[j]) + (rest[i] - rest[j])

    @cached_property
    def flux(self) -> np.ndarray:
        """(t,): flux through each throat, from its first pore to its second [m³/s]."""
        return _finite(self.conductances * self._drop, "fluxes")

    @cached_property
    def _outflow(self) -> np.ndarray:
        """(n_pores,): what each pore gives to its neighbours [m³/s]."""
        i, j = self.mesh.throats.pores.T
        n = self.mesh.n_pores
        return np.bincount(i, self.flux, n) - np.bincount(j, self.flux, n)

    @cached_property
    def _face_flux(self) -> np.ndarray:
        """(w,): flux into the sample through each wall face, shared by area among a pore's open faces [m³/s]."""
        faces = self.mesh.wall_faces
        pores = self.mesh.cell_pore[faces.cells]
        open_area = np.where(np.isnan(self.walls.pressures)[faces.walls], 0.0, faces.areas)
        total = np.bincount(pores, open_area, self.mesh.n_pores)[pores]
        share = np.divide(open_area, total, out=np.zeros(len(pores)), where=total > 0.0)
        return share * self._outflow[pores]

    @property
    def wall_flux(self) -> dict[str, float]:
        """Flux into the sample through each wall [m³/s]; zero through impervious ones."""
        totals = np.bincount(self.mesh.wall_faces.walls, self._face_flux, 6)
        return {name: float(q) for name, q in zip(WALLS, totals, strict=True)}

    @property
    def inflow(self) -> float:
        """Total flux through the walls where fluid enters [m³/s]."""
        return sum(max(q, 0.0) for q in self.wall_flux.values())

    @property
    def outflow(self) -> float:
        """Total flux through the walls where fluid leaves [m³/s]."""
        return sum(max(-q, 0.0) for q in self.wall_flux.values())

    @property
    def imbalance(self) -> float:
        """Inflow less outflow, relative to the larger."""
        larger = max(self.inflow, self.outflow)
        return abs(self.inflow - self.outflow) / larger if larger > 0.0 else 0.0

    @cached_property
    def permeability(self) -> float:
        """k = μ Q h0 / (ΔP S) along the axis of the two pressure walls (C12 §3.3) [m²].

        Raises
        ------
        InputError
            If the pressure walls are not one pair of opposite walls at different pressures.
        """
        axis = self.walls.axis
        pressures = self.walls.pressures
        if axis is None or pressures[2 * axis] == pressures[2 * axis + 1]:
            raise InputError(
                "permeability needs exactly two pressure walls, opposite each other and at different pressures"
            )
        drop = pressures[2 * axis] - pressures[2 * axis + 1]
        flux = math.copysign(0.5 * (self.inflow + self.outflow), drop)
        box = self.mesh.box
        return float(self.fluid.viscosity * flux * box.size[axis] / (drop * box.section(axis)))

    @property
    def hydraulic_conductivity(self) -> float:
        """k ρ g / μ, with standard gravity [m/s]."""
        return self.permeability * self.fluid.density * STANDARD_GRAVITY / self.fluid.viscosity

    @cached_property
    def pore_velocity(self) -> np.ndarray:
        """(n_pores, 3): mean velocity of the fluid in each pore [m/s]."""
        return _finite(pore_velocities(self.mesh, self.flux, self._face_flux), "velocities")

    @property
    def closing_error(self) -> float:
        """Part of the flow that is missing, at most, because throats are closed that may be open; between 0 and 1.

        Throats without conductance that their spheres do not cover are closed for want of a better answer: A^f, φ or Σγ
        came out as zero or less. None is more open than a round hole of all its area A in a thin plate, q = a³ Δp / 3μ
        with π a² = A (Sampson 1891), and by Dirichlet's principle the pressures found without them bound from above
        what power flows would take with them. Between two walls power is in proportion to permeability: with all
        of them open it is k / (1 - closing_error) at most.
        """
        throats = self.mesh.throats
        doubtful = np.flatnonzero((self.conductances == 0.0) & ~throats.covered)
        if len(doubtful) == 0:
            return 0.0
        images = throats.mirror_images(self.walls.slip)[doubtful]
        radii = np.sqrt(images * throats.areas[doubtful] / np.pi)
        holes = radii**3 / (3.0 * self.fluid.viscosity * images)
        range_ = max(float(np.nanmax(self._held)), np.finfo(float).tiny)
        drop = self._drop / range_
        missing = float((holes * drop[doubtful] ** 2).sum())
        power = float((self.conductances * drop**2).sum())
        return missing / (power + missing) if missing > 0.0 else 0.0

    # ---- forces -------------------------------------------------------------------------------------------------

    @cached_property
    def forces(self) -> Forces:
        """Forces on every sphere and wall."""
        _ = self.solution  # timed by itself
        with self._timed("forces"):
            forces = fluid_forces(
                self.mesh,
                self._acting_pressure,
                ~np.isnan(self.walls.pressures),
                self.walls.slip,
                reference=self._reference,
                weight=self.fluid.density * self.gravity,
                shares=getattr(self.conductance, "shares", "surface"),
            )
            _finite(forces.total, "forces")
            return forces

    def to_fipy(self) -> FipyProblem:
        """The same problem posed in FiPy: its mesh, variable, coefficient and equation."""
        from porefv.fipy_bridge import FipyPoreMesh, FipyProblem

        return FipyProblem(self, FipyPoreMesh(self.mesh, ~np.isnan(self._held)))

    # ---- bookkeeping --------------------------------------------------------------------------------------------

    def _timed(self, stage: str):
        return _Timer(self.timings, stage)

    def __repr__(self) -> str:
        held = ", ".join(f"{name} {wall.pressure:g} Pa" for name, wall in zip(WALLS, self.walls, strict=True)
                         if wall.pressure is not None)  # fmt: skip
        return f"PoreFlow({self.mesh!r}, {self.conductance.name}, {held})"


def _finite(values: np.ndarray, what: str) -> np.ndarray:
    """The values, or a ComputationError if any is not finite: nothing else leaves the flow."""
    bad = np.count_nonzero(~np.isfinite(values))
    if bad:
        raise ComputationError(f"{bad} of {values.size} {what} are not finite numbers; nothing can be said of the flow")
    return values


class _Timer:
    def __init__(self, timings: dict[str, float], stage: str):
        self.timings, self.stage = timings, stage

    def __enter__(self) -> None:
        self.begin = time.perf_counter()

    def __exit__(self, *_) -> None:
        self.timings[self.stage] = time.perf_counter() - self.begin
