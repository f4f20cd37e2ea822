"""PoreFlow: steady viscous flow through the pores of a fixed packing, each quantity computed when it is first needed.

The functions that it calls can be used without it: `throat_conductances`, `solve_pressure`, `fluxes`,
`acting_pressure`, `grain_forces`, `pore_velocities`.
"""

from __future__ import annotations

import math
import warnings
from collections.abc import Collection, Sequence
from types import NoneType
from typing import TYPE_CHECKING, Any

import numpy as np

from porefv.conductance.conductances import throat_conductances
from porefv.conductance.model import ConductanceModel, ensure_model
from porefv.conductance.registry import AUTO
from porefv.errors import InputError, NoOpenPathWarning, counted
from porefv.flow.fluid import Fluid
from porefv.flow.flux import fluxes, net_outflows, wall_face_fluxes, wall_fluxes
from porefv.flow.forces import Forces, grain_forces
from porefv.flow.given_pressure import given_pressure
from porefv.flow.imposed_flow import FlowAtWalls, solve_imposed_flow
from porefv.flow.inside import FixedPressure, FlowSource, ImposedInside, check_imposed, imposed_inside
from porefv.flow.interior import Interior, interior
from porefv.flow.open_path import has_open_path, no_open_path_text
from porefv.flow.paths import Paths, paths
from porefv.flow.pressure import (
    PressureField,
    held_pressures,
    pores_of_several_pressures,
    reference_pressure,
    solve_pressure,
)
from porefv.flow.pressure_on_grains import acting_pressure
from porefv.flow.profile import Profile, axis_number, plane_fluxes, profile
from porefv.flow.regions import region_text
from porefv.flow.reliability import Reliability, reliability
from porefv.flow.reynolds import reynolds_number
from porefv.flow.sizes import ConstrictionSizes, PoreSizes, constriction_sizes, pore_sizes
from porefv.flow.tortuosity import hydraulic_tortuosity
from porefv.flow.velocity import darcy_velocity, pore_velocities
from porefv.flow.walls import Walls, condition_text, ensure_no_free_surface, ensure_no_imposed_flow
from porefv.mesh.pore_mesh import PoreMesh
from porefv.packing.box import WALLS
from porefv.packing.packing import Packing
from porefv.solvers.solver import TOLERANCE, SolverReport
from porefv.system.html_table import html_table
from porefv.system.lazy import FixedInputs, lazy_property
from porefv.system.number_checks import MOST, ensure_finite, three_numbers
from porefv.system.timer import Timer

if TYPE_CHECKING:
    import pyvista

    from porefv.export.picture_output import Picture
    from porefv.fipy.flow_problem import FlowProblem

STANDARD_GRAVITY = 9.80665  # m/s², for the hydraulic conductivity k ρ g / μ


class PoreFlow(FixedInputs):
    """Steady flow of a viscous fluid through the pores of a fixed packing (C12).

    Pressures are piezometric, p = p* - ρ g·x: what drives the flow, without the hydrostatic part that gravity adds.

    Parameters
    ----------
    mesh : PoreMesh or Packing
    walls : Walls
        Condition on each wall. At least one must have a pressure, unless there are fixed pressures, or imposed flows
        that add up to zero.
    fluid : Fluid
    conductance : ConductanceModel, optional
        `SectionFriction()` by default; `HydraulicRadius()` is the model of C12.
    gravity : (3,) sequence of float
        Acceleration of gravity, for buoyancy [m/s²].
    sources : sequence of FlowSource
        Flows into regions of the packing.
    fixed_pressures : sequence of FixedPressure
        Pressures of regions of the packing.
    solver, tolerance
        See `porefv.solvers.solver.Solver`.

    Examples
    --------
    >>> oil = Fluid(viscosity=10.0, density=970.0)
    >>> flow = PoreFlow(Packing.read("data/packings/n25_s1.csv"), Walls.along("y"), oil)
    >>> print(f"{flow.permeability:.3g} m², {flow.inflow:.3g} m³/s, Reynolds number {flow.reynolds:.1g}")
    0.00019 m², 1.9e-05 m³/s, Reynolds number 0.0006
    """

    def __init__(
        self,
        mesh: PoreMesh | Packing,
        walls: Walls,
        fluid: Fluid | None = None,
        conductance: ConductanceModel | None = None,
        *,
        gravity: Sequence[float] = (0.0, 0.0, 0.0),
        sources: Sequence[FlowSource] = (),
        fixed_pressures: Sequence[FixedPressure] = (),
        solver: str = "auto",
        tolerance: float = TOLERANCE,
    ):
        for given, kinds, what in (
            (mesh, (PoreMesh, Packing), "mesh must be a PoreMesh or a Packing (Packing.read reads a file)"),
            (walls, Walls, "walls must be Walls, such as Walls.along('y')"),
            (fluid, (Fluid, NoneType), "fluid must be a Fluid, such as Fluid(viscosity=1e-3)"),
        ):
            if not isinstance(given, kinds):
                raise InputError(f"{what}, not {given!r}")
        ensure_no_free_surface(walls)
        self.mesh = PoreMesh(mesh) if isinstance(mesh, Packing) else mesh
        self.walls = walls
        self.fluid = fluid if fluid is not None else Fluid()
        self.conductance = ensure_model(conductance) if conductance is not None else AUTO()
        self.gravity = three_numbers(gravity, "gravity", "m/s²")
        self.sources = tuple(sources)
        self.fixed_pressures = tuple(fixed_pressures)
        self.solver = solver
        self.tolerance = tolerance
        self.timings: dict[str, float] = {}
        if np.abs(self.gravity).max() > MOST:
            raise InputError(f"gravity must be at most {MOST:g} m/s² along each axis, not {gravity!r}")
        check_imposed(walls, self.mesh.box, self.sources, self.fixed_pressures)
        self._given: PressureField | None = None

    @classmethod
    def from_pressure(
        cls,
        mesh: PoreMesh | Packing,
        pressure: np.ndarray,
        walls: Walls,
        fluid: Fluid | None = None,
        conductance: ConductanceModel | None = None,
        *,
        gravity: Sequence[float] = (0.0, 0.0, 0.0),
        sources: Sequence[FlowSource] = (),
        fixed_pressures: Sequence[FixedPressure] = (),
    ) -> PoreFlow:
        """The flow of a pressure found elsewhere, for instance by FiPy: its fluxes, forces and files.

        Parameters
        ----------
        mesh : PoreMesh or Packing
        pressure : (n_pores,) array
            Piezometric pressure of each pore [Pa]. Pores on walls of imposed pressure must have that pressure, to
            1e-6 of the range of the imposed pressures.
        walls, fluid, conductance, gravity, sources, fixed_pressures
            As of `PoreFlow`: those with which the pressure was found. In place of imposed flows, walls must have
            pressures, such as `walls_at_pressures` has.

        Warns
        -----
        ImbalanceWarning
            If the pressure leaves more than 1e-3 of the flow out of balance.

        Raises
        ------
        InputError
            For pressures of the wrong shape, not finite, or other than those imposed; for a wall of imposed flow.

        Examples
        --------
        >>> flow = PoreFlow(Packing.read("data/packings/n25_s1.csv"), Walls.along("y"))
        >>> same = PoreFlow.from_pressure(flow.mesh, flow.pressure, flow.walls)
        >>> np.allclose(same.forces.total, flow.forces.total)
        True
        """
        ensure_no_imposed_flow(walls)
        flow = cls(
            mesh, walls, fluid, conductance, gravity=gravity, sources=sources, fixed_pressures=fixed_pressures
        )  # fmt: skip
        inside, injected = flow._inside_pressures, flow._sources
        flow._given = given_pressure(flow.mesh, flow.conductances, pressure, walls, sources=injected, inside=inside)
        return flow

    # ---- pressure -----------------------------------------------------------------------------------------------

    @lazy_property
    def _inside(self) -> ImposedInside | None:
        """What regions impose on each pore; None without regions."""
        if not (self.sources or self.fixed_pressures):
            return None
        return imposed_inside(self.mesh, self.walls, self.sources, self.fixed_pressures)

    @property
    def _sources(self) -> np.ndarray | None:
        """(n_pores,): volume injected into each pore per unit time; None without sources [m³/s]."""
        return self._inside.sources if self.sources and self._inside is not None else None

    @property
    def flow_of_sources(self) -> np.ndarray:
        """(n_pores,): volume that sources inject into each pore per unit time [m³/s]."""
        return np.zeros(self.mesh.n_pores) if self._sources is None else self._sources

    @property
    def _inside_pressures(self) -> np.ndarray | None:
        """(n_pores,): fixed pressure of each pore, NaN where there is none; None without fixed pressures [Pa]."""
        return self._inside.pressures if self.fixed_pressures and self._inside is not None else None

    @lazy_property
    def _at_walls(self) -> FlowAtWalls | None:
        """The flow with pressures found at walls of imposed flow; None where no wall has such."""
        if not self.walls.imposes_flow.any():
            return None
        conductances = self.conductances
        with Timer(self.timings, "solve"):
            return solve_imposed_flow(
                self.mesh, conductances, self.walls, sources=self._sources, inside=self._inside_pressures,
                solver=self.solver, tolerance=self.tolerance,
            )  # fmt: skip

    @property
    def walls_at_pressures(self) -> Walls:
        """The walls, with the pressures that were found in place of imposed flows."""
        return self.walls if self._at_walls is None else self._at_walls.walls

    @property
    def wall_pressure(self) -> dict[str, float]:
        """Pressure of each wall that fluid passes, imposed or found from the imposed flow [Pa]."""
        walls = self.walls_at_pressures
        return {name: wall.pressure for name, wall in zip(WALLS, walls, strict=True) if wall.pressure is not None}

    @lazy_property
    def _reference(self) -> float:
        """The lowest pressure of walls and regions [Pa]."""
        if self._at_walls is not None:
            return self._at_walls.field.reference
        return reference_pressure(self.walls, self._inside_pressures)

    @lazy_property
    def _held(self) -> np.ndarray:
        """Imposed pressures less the lowest of them."""
        on_walls = self.walls.pressures - self._reference if self._at_walls is None else self._at_walls.relative
        inside = self._inside_pressures
        return held_pressures(self.mesh, on_walls, None if inside is None else inside - self._reference)

    @property
    def pores_of_several_pressures(self) -> np.ndarray:
        """(n_pores,) bool: pores that touch walls of different imposed pressures."""
        return pores_of_several_pressures(self.mesh, self.walls_at_pressures)

    @property
    def imposed_pressures(self) -> np.ndarray:
        """(n_pores,): imposed pressure of the pores on pressure walls and of fixed pressure, NaN elsewhere [Pa].

        Pores that touch several pressure walls take the mean of theirs. A wall of imposed flow has the pressure found.
        """
        return self._held + self._reference

    @lazy_property
    def conductances(self) -> np.ndarray:
        """(t,): K of each throat, q = K (p_i - p_j); zero where closed [m³/(Pa s)]."""
        with Timer(self.timings, "throats"):
            return throat_conductances(self.mesh, self.conductance, self.walls.slip, self.fluid.viscosity)

    @lazy_property
    def has_open_path(self) -> bool:
        """Whether an open path joins two different imposed pressures (`flow.open_path.has_open_path`)."""
        return has_open_path(self.mesh, self.conductances, self.walls_at_pressures, self._inside_pressures)

    @lazy_property
    def solution(self) -> PressureField:
        """The pressure field, with the solver's report and the isolated pores.

        Warns
        -----
        NoOpenPathWarning
            If no open path leads from one imposed pressure to another.
        """
        if self._given is not None:
            return self._given
        if self._at_walls is not None:
            return self._at_walls.field
        conductances = self.conductances
        if not self.has_open_path:
            passed = [name for name, held in zip(WALLS, self.walls.held, strict=True) if held]
            inside = [region_text(fixed.region) for fixed in self.fixed_pressures]
            said = no_open_path_text(self.mesh, conductances, ", ".join([*passed, *inside]))
            warnings.warn(said, NoOpenPathWarning, stacklevel=2)
        with Timer(self.timings, "solve"):
            return solve_pressure(
                self.mesh, conductances, self.walls, sources=self._sources, inside=self._inside_pressures,
                solver=self.solver, tolerance=self.tolerance,
            )  # fmt: skip

    @lazy_property
    def pressure(self) -> np.ndarray:
        """(n_pores,): piezometric pressure of each pore [Pa]."""
        return self.solution.pressure

    @lazy_property
    def _acting(self) -> PressureField:
        solution = self.solution
        return acting_pressure(
            self.mesh, self.conductance, self.conductances, self.walls_at_pressures, solution,
            inside=self._inside_pressures,
        )  # fmt: skip

    @property
    def acting_pressure(self) -> np.ndarray:
        """(n_pores,): piezometric pressure that acts on the grains of each pore (`flow.acting_pressure`) [Pa]."""
        return self._acting.pressure

    @property
    def cell_pressure(self) -> np.ndarray:
        """(n_cells,): piezometric pressure of each cell [Pa]."""
        return self.pressure[self.mesh.cell_pore]

    @property
    def solver_report(self) -> SolverReport:
        """Solver, iterations and residual."""
        return self.solution.report

    # ---- fluxes -------------------------------------------------------------------------------------------------

    @lazy_property
    def flux(self) -> np.ndarray:
        """(t,): flux through each throat, from its first pore to its second [m³/s]."""
        return fluxes(self.mesh, self.conductances, self.solution)

    @lazy_property
    def _outflow_of_pores(self) -> np.ndarray:
        """(n_pores,): what each pore gives to its neighbours, less what sources inject into it [m³/s]."""
        outflows = net_outflows(self.mesh, self.flux)
        return outflows if self._sources is None else outflows - self._sources

    @lazy_property
    def face_flux(self) -> np.ndarray:
        """(w,): flux into the sample through each of `mesh.wall_faces` [m³/s]."""
        return wall_face_fluxes(self.mesh, self._outflow_of_pores, self.walls_at_pressures.held)

    @property
    def wall_flux(self) -> dict[str, float]:
        """Flux into the sample through each wall [m³/s]; zero through impervious ones."""
        totals = wall_fluxes(self.mesh, self.face_flux)
        return {name: float(q) for name, q in zip(WALLS, totals, strict=True)}

    @property
    def fixed_pressure_flux(self) -> list[float]:
        """Flux into the sample through the pores of each fixed pressure [m³/s].

        A pore of several fixed pressures counts with the first. Pores that are also on a wall of that pressure count
        with the wall.
        """
        if not self.fixed_pressures or self._inside is None:
            return []
        number = np.where(self._on_passed_walls, -1, self._inside.number)
        return np.bincount(number + 1, self._outflow_of_pores, len(self.fixed_pressures) + 1)[1:].tolist()

    @property
    def _on_passed_walls(self) -> np.ndarray:
        """(n_pores,) bool: pores on walls that fluid passes."""
        return ~np.isnan(held_pressures(self.mesh, self.walls_at_pressures.pressures))

    @property
    def _entering(self) -> list[float]:
        """Flux into the sample through each wall, and with each source and fixed pressure [m³/s]."""
        return [*self.wall_flux.values(), *self.fixed_pressure_flux, *(source.flow for source in self.sources)]

    @property
    def inflow(self) -> float:
        """Total flux where fluid enters: through walls, and with sources and fixed pressures [m³/s]."""
        return sum(max(q, 0.0) for q in self._entering)

    @property
    def outflow(self) -> float:
        """Total flux where fluid leaves: through walls, and with sources and fixed pressures [m³/s]."""
        return sum(max(-q, 0.0) for q in self._entering)

    @property
    def imbalance(self) -> float:
        """Inflow less outflow, relative to the larger."""
        larger = max(self.inflow, self.outflow)
        return abs(self.inflow - self.outflow) / larger if larger > 0.0 else 0.0

    @lazy_property
    def permeability(self) -> float:
        """k = μ Q h0 / (ΔP S) along the axis of the two pressure walls (C12 §3.3) [m²].

        Raises
        ------
        InputError
            If the walls that fluid passes are not one pair of opposite walls at different pressures, or there are
            sources or fixed pressures.

        Notes
        -----
        Theory, method: :eq:`eq-permeability`.
        """
        if self.sources or self.fixed_pressures:
            raise InputError("permeability is that between two walls, without sources and fixed pressures")
        axis = self.walls.axis
        pressures = self.walls.pressures if self._at_walls is None else self._at_walls.relative
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

    @lazy_property
    def _injected(self) -> np.ndarray | None:
        """(n_pores,): volume that enters each pore per unit time other than through a wall; None without regions."""
        if self._inside is None:
            return None
        through_walls = np.bincount(self.mesh.cell_pore[self.mesh.wall_faces.cells], self.face_flux, self.mesh.n_pores)
        driven = (self.flow_of_sources != 0.0) | ~np.isnan(self._inside.pressures)
        return np.where(driven, net_outflows(self.mesh, self.flux) - through_walls, 0.0)

    @lazy_property
    def pore_velocity(self) -> np.ndarray:
        """(n_pores, 3): mean velocity of the fluid in each pore [m/s]."""
        velocities = pore_velocities(self.mesh, self.flux, self.face_flux, self._injected)
        return ensure_finite(velocities, "velocities")

    @property
    def closing_error(self) -> float:
        """Part of the flow that is missing, at most, because throats are closed that may be open; between 0 and 1.

        Throats without conductance that their spheres do not cover are closed because A^f, φ or Σγ came out as zero
        or less. None is more open than a round hole of all its area A in a thin plate, q = a³ Δp / 3μ
        with π a² = A (Sampson 1891), and by Dirichlet's principle the pressures found without them bound from above
        what power flows would take with them. Between two walls power is in proportion to permeability: with all
        of them open it is k / (1 - closing_error) at most.

        Theory, method: :eq:`eq-closing-error`.
        """
        throats = self.mesh.throats
        doubtful = np.flatnonzero((self.conductances == 0.0) & ~throats.covered)
        if len(doubtful) == 0:
            return 0.0
        images = throats.mirror_images(self.walls.slip)[doubtful]
        radii = np.sqrt(images * throats.areas[doubtful] / np.pi)
        holes = radii**3 / (3.0 * self.fluid.viscosity * images)
        range_ = float(np.nanmax(self._held)) or float(np.ptp(self.solution.relative)) or np.finfo(float).tiny
        drop = self.solution.drops(throats.pores) / range_
        missing = float((holes * drop[doubtful] ** 2).sum())
        power = float((self.conductances * drop**2).sum())
        return missing / (power + missing) if missing > 0.0 else 0.0

    @lazy_property
    def interior(self) -> Interior | None:
        """Porosity and permeability two mean diameters away from walls and free space; None in small samples.

        Raises
        ------
        InputError
            If the pressure walls are not one pair of opposite walls.
        """
        axis = axis_number(None, self.walls)
        return interior(self.mesh, self.pressure, self.pore_velocity, axis, self.fluid.viscosity)

    @lazy_property
    def reliability(self) -> Reliability:
        """Parts of the dissipation in throats outside the range where the conductance model was tested.

        Where no open path leads through the sample, and nothing flows, parts of the number of throats.
        """
        return reliability(
            self.mesh, self.conductances, self.flux, self.walls.slip, of_throats=not self.has_open_path
        )  # fmt: skip

    # ---- quantities of the sample ---------------------------------------------------------------------------------

    @lazy_property
    def darcy_velocity(self) -> np.ndarray:
        """(3,): mean velocity over the box, grains at rest included (`flow.velocity.darcy_velocity`) [m/s]."""
        if self._inside is not None:  # fluid enters inside the box, too
            return (self.pore_velocity * self.mesh.pore_volumes[:, None]).sum(axis=0) / self.mesh.box.volume
        return darcy_velocity(self.mesh, self.face_flux)

    @property
    def porosity(self) -> float:
        """Porosity of the packing in its box (`Packing.porosity`)."""
        return self.mesh.packing.porosity

    @property
    def reynolds(self) -> float | None:
        """Re = ρ U d / μ, with U the size of the Darcy velocity and d the mean diameter; None without a given density.

        The flow is computed without inertia, as if Re were zero.
        """
        return reynolds_number(self.fluid, self.mesh.packing, float(np.linalg.norm(self.darcy_velocity)))

    @property
    def pore_reynolds(self) -> float | None:
        """The largest ρ u d / μ of a pore, with u the size of its mean velocity; None without a given density."""
        speeds = np.linalg.norm(self.pore_velocity, axis=1)
        return reynolds_number(self.fluid, self.mesh.packing, float(speeds.max()))

    @property
    def interstitial_velocity(self) -> np.ndarray:
        """(3,): mean velocity of the fluid, the Darcy velocity over the porosity [m/s]."""
        return self.darcy_velocity / self.porosity

    @lazy_property
    def tortuosity(self) -> float:
        """Hydraulic tortuosity (`flow.tortuosity.hydraulic_tortuosity`); NaN if nothing flows.

        Raises
        ------
        InputError
            If the pressure walls are not one pair of opposite walls.
        """
        if self.walls.axis is None or self._inside is not None:
            raise InputError(
                "tortuosity needs exactly two pressure walls, opposite each other, and no regions that drive"
            )
        return hydraulic_tortuosity(self.mesh, self.flux, self.face_flux, self.walls.axis)

    @lazy_property
    def pore_sizes(self) -> PoreSizes:
        """Void volume and largest inscribed sphere of each pore."""
        return pore_sizes(self.mesh)

    @lazy_property
    def constriction_sizes(self) -> ConstrictionSizes:
        """Largest inscribed circle of each throat, and the size of its flux."""
        return constriction_sizes(self.mesh, self.flux, self.walls.slip)

    def paths(self, count: int, seed: int = 0) -> Paths:
        """Paths of particles through the network, drawn by flux, with residence times (`flow.paths.paths`).

        Examples
        --------
        >>> flow = PoreFlow(Packing.read("data/packings/n25_s1.csv"), Walls.along("y"), Fluid(viscosity=10.0))
        >>> found = flow.paths(1000, seed=1)
        >>> print(f"path tortuosity {found.path_tortuosity:.2f} ± {found.path_tortuosity_scatter:.2f}")
        path tortuosity 1.27 ± 0.17
        """
        return paths(self, self.face_flux, self._injected, count, seed)

    def profile(self, layers: int = 10, axis: str | None = None) -> Profile:
        """Porosity and mean pressure of equally thick layers along "x", "y" or "z", the axis of flow by default."""
        return profile(self.mesh, self.pressure, axis_number(axis, self.walls), layers)

    def plane_fluxes(self, places: Sequence[float] | np.ndarray, axis: str | None = None) -> np.ndarray:
        """(p,): flux through planes at places (p,) along an axis, that of flow by default (`flow.profile`) [m³/s]."""
        return plane_fluxes(self.mesh, self.flux, self.face_flux, axis_number(axis, self.walls), places)

    # ---- forces -------------------------------------------------------------------------------------------------

    @lazy_property
    def forces(self) -> Forces:
        """Forces on every sphere and wall."""
        _ = self.solution  # timed by itself
        with Timer(self.timings, "forces"):
            forces = grain_forces(
                self.mesh,
                self._acting,
                self.walls_at_pressures,
                self.conductance.force_split,
                weight=self.fluid.density * self.gravity,
            )
            ensure_finite(forces.total, "forces")
            return forces

    def plot(self, what: str = "forces", **options: Any) -> Picture:
        """A picture of the flow (see `porefv.export.picture`): "forces", "pressure", "network", "section" and others.

        Examples
        --------
        >>> flow = PoreFlow(Packing.read("data/packings/n25_s1.csv"), Walls.along("y"), Fluid(viscosity=10.0))
        >>> flow.plot("section", axis="z").save("section.svg")
        """
        from porefv.export.pictures import picture

        return picture(self, what, **options)

    def to_fipy(self, without: Collection[str] = ()) -> FlowProblem:
        """The flow in FiPy: its mesh, velocity, and pressure equation (see `porefv.fipy`).

        Parameters
        ----------
        without : collection of str
            Walls whose pores are left out of the mesh.
        """
        from porefv.fipy.flow_problem import FlowProblem

        return FlowProblem(self, without)

    def to_pyvista(self) -> pyvista.UnstructuredGrid:
        """The cells as a `pyvista.UnstructuredGrid` with the pores' `volume`, `pressure` and `velocity`."""
        mesh = self.mesh
        return mesh.to_pyvista(volume=mesh.pore_volumes, pressure=self.pressure, velocity=self.pore_velocity)

    def to_openpnm(self) -> dict[str, np.ndarray]:
        """The network with its conductances in the names of OpenPNM (see `porefv.export.openpnm_network`)."""
        from porefv.export.openpnm_network import flow_to_openpnm

        return flow_to_openpnm(self)

    # ---- bookkeeping --------------------------------------------------------------------------------------------

    def _repr_html_(self) -> str:
        """What was given, and what has been computed: showing a flow computes nothing."""
        rows = [
            ("packing", repr(self.mesh.packing)),
            ("fluid", f"viscosity {self.fluid.viscosity:g} Pa s, density {self.fluid.density:g} kg/m³"),
            *((name, condition_text(vars(wall))) for name, wall in zip(WALLS, self.walls, strict=True)),
            *((name, str(len(given))) for name, given in
              (("sources", self.sources), ("fixed pressures", self.fixed_pressures)) if given),
            ("conductance", self.conductance.name),
        ]  # fmt: skip
        if "solution" in vars(self):
            rows += [("inflow", f"{self.inflow:.6g} m³/s"), ("outflow", f"{self.outflow:.6g} m³/s")]
        if "permeability" in vars(self):
            rows.append(("permeability", f"{self.permeability:.6g} m²"))
        if "forces" in vars(self):
            rows.append(("force on all spheres", ", ".join(f"{x:.4g}" for x in self.forces.total.sum(axis=0)) + " N"))
        return html_table("Flow", rows)

    def __repr__(self) -> str:
        passed = [f"{name} {condition_text(vars(wall))}" for name, wall in zip(WALLS, self.walls, strict=True)
                  if wall.pressure is not None or wall.imposes_flow]  # fmt: skip
        inside = [counted(len(given), name) for given, name in
                  ((self.sources, "source"), (self.fixed_pressures, "fixed pressure")) if given]  # fmt: skip
        return f"PoreFlow({', '.join([repr(self.mesh), self.conductance.name, *passed, *inside])})"
