"""Coupling: grains that move in a viscous fluid, and a fluid that flows as they move (C14 §2.3)."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from porefv.conductance.conductances import throat_conductances
from porefv.conductance.model import ConductanceModel, ensure_model
from porefv.conductance.registry import AUTO
from porefv.coupling.coupled_pressure import CoupledPressure, Power
from porefv.coupling.coupling_state import CouplingState
from porefv.coupling.end_correction import end_corrected_conductances
from porefv.coupling.exchange import EXCHANGES, Exchange
from porefv.dem.grain_model import GrainModel
from porefv.errors import InputError
from porefv.flow.fluid import Fluid
from porefv.flow.pressure import held_pressures
from porefv.flow.pressure_on_grains import solid_pressure_weights
from porefv.flow.walls import Walls, ensure_no_imposed_flow
from porefv.mesh.pore_mesh import PoreMesh
from porefv.packing.box import WALL_AXES, WALL_SENSES, WALLS
from porefv.packing.packing import Packing
from porefv.system.number_checks import is_finite_number
from porefv.system.timer import Timer

SCHEMES = ("auto", "implicit-drag", "semi-implicit")

# Drag number up to which `auto` is explicit in the drag, and beyond which an explicit step is refused. It is unstable
# from 2 on; below 0.1 the error of being explicit is a few parts in a hundred of the fastest drag.
EXPLICIT, UNSTABLE = 0.1, 1.8
# Bound on the power's relative error where pressures start anew on another mesh.
_ANEW = 1e-8
# Steps after which products of pressures with the matrix are worked out, not carried on, lest rounding gathers.
_ANEW_EVERY = 50
# Steps between two looks at how far grains have moved.
_STRIDE = 10
# The rows of the walls in arrays of grains and walls.
_WALL_ROWS = np.arange(-6, 0)


@dataclass(frozen=True)
class CouplingSettings:
    """How a coupling steps: the parameters of `porefv.coupling.Coupling` of these names."""

    scheme: str = "auto"
    exchange: str = "facets"
    tolerance: float = 1e-2
    renewal: float = 0.02
    end_correction: bool = True

    def __post_init__(self) -> None:
        if self.scheme not in SCHEMES:
            raise InputError(f"unknown scheme {self.scheme!r}; known: {', '.join(SCHEMES)}")
        if self.exchange not in EXCHANGES:
            raise InputError(f"unknown exchange {self.exchange!r}; known: {', '.join(EXCHANGES)}")
        if not 0.0 < self.tolerance < 1.0:
            raise InputError(f"tolerance must lie between 0 and 1, not {self.tolerance!r}")
        if not 0.0 < self.renewal <= 1.0:
            raise InputError(f"renewal must be a part of the mean radius, in (0, 1], not {self.renewal!r}")


@dataclass
class Effort:
    """What a coupled run has taken.

    Attributes
    ----------
    steps, iterations, meshes : int
        Steps, iterations for pressures, meshes made.
    seconds : dict
        Spent on `mesh`, `grains`, `pressure` and `forces`.
    """

    steps: int = 0
    iterations: int = 0
    meshes: int = 0
    seconds: dict[str, float] = field(
        default_factory=lambda: {"mesh": 0.0, "grains": 0.0, "pressure": 0.0, "forces": 0.0}
    )

    def __post_init__(self) -> None:
        counts = (self.steps, self.iterations, self.meshes)
        if not all(type(count) is int and count >= 0 for count in counts):
            raise ValueError(f"steps, iterations and meshes are counts, not {counts}")
        if {*self.seconds} != {"mesh", "grains", "pressure", "forces"}:
            raise ValueError(f"the seconds are of {', '.join(self.seconds)}")
        if not all(is_finite_number(time) for time in self.seconds.values()):
            raise ValueError("the seconds are no numbers")


class Coupling:
    """Grains and the fluid between them, stepped together.

    Parameters
    ----------
    grains : GrainModel
        A `porefv.dem.DEM`, without damping, or what takes its place. Stresses of its plates are total ones: contacts
        and fluid bear them together.
    walls : Walls
        What each wall is to the fluid: drained at a (piezometric) pressure, or impervious.
    fluid : Fluid, optional
    conductance : ConductanceModel, optional
        As of `PoreFlow`.
    scheme : {'auto', 'implicit-drag', 'semi-implicit'}
        `semi-implicit` (C14): pressures from the velocities before the step, forces explicit in it; stable where the
        drag number is below 2. `implicit-drag`: pressures from the velocities after the step; stable at any viscosity.
        `auto`: the first where the drag number is below 0.1, else the second.
    exchange : {'facets', 'volumes'}
        Volume rates and forces, see `porefv.coupling.exchange`.
    tolerance : float
        Bound on the relative error of the pressures in the norm of power, each step.
    renewal : float
        The mesh is made anew when a grain has moved by this part of the mean radius.
    end_correction : bool
        Whether to correct the drainage height for the looser layer of grains at a drained wall, see
        `porefv.coupling.end_correction`.

    Attributes
    ----------
    settings : CouplingSettings
        Scheme, exchange, tolerance, renewal and end correction.
    state : CouplingState
        What it holds between two steps, besides its grains.
    mesh : PoreMesh
        The current one.
    equation : CoupledPressure
        The pressure equation on the current mesh.
    effort : Effort

    Raises
    ------
    InputError
        For an unknown option; if the fluid, incompressible, has nowhere to go where walls move; if the step is
        explicit and unstable.

    Notes
    -----
    Time is that of the grains. Pressures and forces act over a step, from t - dt to t, and velocities live in its
    middle.
    """

    mesh: PoreMesh
    equation: CoupledPressure
    state: CouplingState

    def __init__(
        self,
        grains: GrainModel,
        walls: Walls,
        fluid: Fluid | None = None,
        conductance: ConductanceModel | None = None,
        *,
        scheme: str = "auto",
        exchange: str = "facets",
        tolerance: float = 1e-2,
        renewal: float = 0.02,
        end_correction: bool = True,
    ):
        self._set_up(
            grains, walls, fluid if fluid is not None else Fluid(),
            ensure_model(conductance) if conductance is not None else AUTO(),
            CouplingSettings(scheme, exchange, tolerance, renewal, end_correction),
        )  # fmt: skip
        self._make_mesh(Packing(grains.positions, grains.radii, grains.box))

    @classmethod
    def from_state(
        cls,
        state: CouplingState,
        grains: GrainModel,
        walls: Walls,
        fluid: Fluid,
        conductance: ConductanceModel,
        settings: CouplingSettings,
        effort: Effort,
    ) -> Coupling:
        """The coupling that goes on from a state, to the last bit, with the parameters that belong to it.

        Parameters
        ----------
        state : CouplingState
            Taken as it is, not copied.
        grains, walls, fluid, conductance
            As of `Coupling`, and as they were.
        settings : CouplingSettings
        effort : Effort
            Of the run so far.

        Raises
        ------
        InputError
            If the mesh has another number of free pores than the state.
        """
        coupling = cls.__new__(cls)
        coupling._set_up(grains, walls, fluid, ensure_model(conductance), settings)
        coupling._make_mesh(state.mesh_packing)
        free = len(coupling.state.pressure)
        if len(state.pressure) != free:
            raise InputError(f"the state has pressures of {len(state.pressure)} free pores, its mesh has {free}")
        if len(state.factor_mobilities):
            coupling.equation.prepare(state.factor_mobilities)
        coupling.state, coupling.effort = state, effort
        return coupling

    def _set_up(
        self, grains: GrainModel, walls: Walls, fluid: Fluid, conductance: ConductanceModel, settings: CouplingSettings
    ) -> None:
        ensure_no_imposed_flow(walls)
        self.grains, self.walls, self.fluid = grains, walls, fluid
        self.conductance, self.settings = conductance, settings
        self.effort = Effort()

    # ---- time ---------------------------------------------------------------------------------------------------

    def run(self, steps: int) -> None:
        """Take so many steps.

        Raises
        ------
        ComputationError
            If the motion runs away, or pressures cannot be found.
        """
        for _ in range(steps):
            if self.effort.steps % _STRIDE == 0 and self._moved() > self.settings.renewal:
                self.renew_mesh()
            self._step()

    def _step(self) -> None:
        with Timer(self.effort.seconds, "grains"):
            predicted, wall_speeds, _, wall_mobilities = self.grains.predict()
            self._refuse_no_way_out(wall_speeds, wall_mobilities)
            moves = self._moves
            if self.scheme == "implicit-drag":
                moves[:-6], moves[-6:] = predicted, self.grains.wall_velocities
            else:
                moves[:] = self._velocities()
            moves[_WALL_ROWS, WALL_AXES] = WALL_SENSES * wall_speeds
        with Timer(self.effort.seconds, "pressure"):
            iterations = self._find_pressure(moves, wall_mobilities)
        with Timer(self.effort.seconds, "forces"):
            forces = self.equation.forces(self.state.pressure)
            thrusts = forces[_WALL_ROWS, WALL_AXES] * WALL_SENSES
        with Timer(self.effort.seconds, "grains"):
            self.grains.correct(forces[:-6], thrusts)
        self.effort.steps += 1
        self.effort.iterations += iterations

    def _find_pressure(self, moves: np.ndarray, wall_mobilities: np.ndarray) -> int:
        """Find the pressures of a step, and what the next one starts from; returns the number of iterations."""
        state, equation, tolerance = self.state, self.equation, self.settings.tolerance
        # Half of what the last step changed: all of it would pass its noise on.
        guess, product = state.pressure + 0.5 * state.rate, None
        steady = equation.is_steady(wall_mobilities)
        if steady and state.products.size and self.effort.steps % _ANEW_EVERY:
            product = state.products[0] + 0.5 * state.products[1]
        if state.fresh:
            tolerance = min(tolerance, _ANEW)
        if not len(state.factor_mobilities):
            state.factor_mobilities = wall_mobilities.copy()
            equation.prepare(state.factor_mobilities)
        pressure, product, iterations = equation.solve(moves, wall_mobilities, guess, tolerance, product)
        # The change is kept only where its product with the matrix is known too, or is not needed.
        goes_on = not state.fresh and (state.products.size > 0 or not steady)
        state.rate = pressure - state.pressure if goes_on else np.zeros_like(pressure)
        before, state.products = state.products, np.zeros((2, len(product) if steady else 0))
        if steady:
            state.products[0] = product
            if goes_on:
                np.subtract(product, before[0], out=state.products[1])
        state.pressure, state.fresh = pressure, False
        return iterations

    def _refuse_no_way_out(self, wall_speeds: np.ndarray, wall_mobilities: np.ndarray) -> None:
        """An incompressible fluid needs an open wall, or one that yields, where others move."""
        if self._closed and not wall_mobilities.any():
            sections = self.grains.box.wall_areas
            change = float(np.dot(wall_speeds, sections))
            if abs(change) > 1e-12 * float(np.abs(wall_speeds * sections).sum()):
                raise InputError(
                    "no wall has a pressure and none presses with a stress, but walls move: an incompressible fluid "
                    "has nowhere to go. Give a wall a pressure, or a plate a stress"
                )

    def set_walls(self, walls: Walls) -> None:
        """Change what walls are to the fluid. Pressures of walls that keep having one may change at every step."""
        ensure_no_imposed_flow(walls)
        same = (np.isnan(walls.pressures) == np.isnan(self.walls.pressures)).all() and (
            walls.slip == self.walls.slip
        ).all()
        self.walls = walls
        if same:
            self.equation.set_pressures(walls.pressures)
        else:
            self.renew_mesh()

    # ---- the mesh -----------------------------------------------------------------------------------------------

    def _moved(self) -> float:
        """Largest distance a grain has moved since the mesh was made, relative to the mean radius."""
        way = self.grains.positions - self.mesh.packing.centres
        return math.sqrt(float((way**2).sum(axis=1).max())) / self._mean_radius

    def renew_mesh(self) -> None:
        """Make the mesh anew, with the pressures there were."""
        around = _mean_by_vertex(self.mesh, self.cell_pressure)
        self._make_mesh(Packing(self.grains.positions, self.grains.radii, self.grains.box))
        cells = around[self.mesh.cells].mean(axis=1)
        pores = np.bincount(self.mesh.cell_pore, cells, self.mesh.n_pores) / np.bincount(self.mesh.cell_pore)
        self.state.pressure = pores[self.equation.free]

    def _make_mesh(self, packing: Packing) -> None:
        """Make the mesh of a packing, its conductances and its exchange with the grains; pressures are zero."""
        with Timer(self.effort.seconds, "mesh"):
            grains, slip, pressures = self.grains, self.walls.slip, self.walls.pressures
            mesh = PoreMesh(packing)
            conductances = throat_conductances(mesh, self.conductance, slip, self.fluid.viscosity)
            if self.settings.end_correction:
                conductances = end_corrected_conductances(mesh, conductances, pressures)
            held = ~np.isnan(held_pressures(mesh, pressures))
            weights = solid_pressure_weights(mesh, self.conductance, conductances, slip, held)
            exchange = Exchange.of(
                mesh, self.settings.exchange, slip, grains.rows,
                split=self.conductance.force_split, solid_pressure=weights,
            )  # fmt: skip
            drag = np.empty(len(packing))
            drag[grains.rows] = grains.step / grains.masses
            self.equation, scheme, drag_number = self._choose(
                lambda mobilities: CoupledPressure(mesh, exchange, conductances, pressures, mobilities), drag
            )
            self.mesh = mesh
            self.state = CouplingState.of(packing, int(np.count_nonzero(self.equation.free)), scheme, drag_number)
            self._mean_radius = float(packing.radii.mean())
            self._closed = bool(np.isnan(pressures).all())
            self._moves = np.zeros((len(packing) + 6, 3))
        self.effort.meshes += 1

    def _choose(
        self, equation: Callable[[np.ndarray], CoupledPressure], drag: np.ndarray
    ) -> tuple[CoupledPressure, str, float | None]:
        """The equation, the scheme and the drag number, where that decides; refuse an unstable scheme.

        `equation` is called with the mobilities of the grains: `drag` (n,), or none for a step explicit in the drag.
        """
        asked = self.settings.scheme
        if asked == "implicit-drag":
            return equation(drag), asked, None
        explicit = equation(np.zeros_like(drag))
        if explicit.cut_off:
            if asked == "semi-implicit":
                raise InputError(
                    f"no throat leads out of {explicit.cut_off} pores, whose volume changes as grains move: their "
                    "pressure is not defined in a semi-implicit step. Use scheme = 'implicit-drag'"
                )
            return equation(drag), "implicit-drag", None
        drag_number = explicit.drag_number(drag, EXPLICIT if asked == "auto" else np.inf)
        if asked == "auto" and not drag_number <= EXPLICIT:
            return equation(drag), "implicit-drag", drag_number
        if drag_number > UNSTABLE:
            raise InputError(
                f"a semi-implicit step of {self.grains.step:.3g} s is unstable: its drag number is "
                f"{drag_number:.3g}, {UNSTABLE} at most. Use scheme = 'implicit-drag', or a step below "
                f"{self.grains.step * UNSTABLE / drag_number:.2g} s"
            )
        return explicit, "semi-implicit", drag_number

    # ---- what there is ------------------------------------------------------------------------------------------

    @property
    def scheme(self) -> str:
        """That of the current mesh, `auto` resolved."""
        return self.state.scheme

    @property
    def drag_number(self) -> float | None:
        """Of the current mesh, where the scheme needs it; a lower bound where that was enough for `auto`."""
        return self.state.drag_number

    @property
    def pressure(self) -> np.ndarray:
        """(n_pores,): piezometric pressure of each pore of `mesh` over the last step [Pa]."""
        return self.equation.full(self.state.pressure)

    @property
    def cell_pressure(self) -> np.ndarray:
        """(n_cells,): piezometric pressure of each cell of `mesh` [Pa]."""
        return self.pressure[self.mesh.cell_pore]

    @property
    def fluid_forces(self) -> np.ndarray:
        """(n, 3): force of the fluid on each grain over the last step, by id [N]."""
        return self.equation.forces(self.state.pressure)[:-6][self.grains.rows]

    @property
    def wall_fluid_forces(self) -> np.ndarray:
        """(6, 3): force of the fluid on each wall over the last step [N]."""
        return self.equation.forces(self.state.pressure)[-6:]

    def _velocities(self) -> np.ndarray:
        velocities = np.empty_like(self._moves)
        velocities[:-6][self.grains.rows] = self.grains.velocities
        velocities[-6:] = self.grains.wall_velocities
        return velocities

    @property
    def wall_flux(self) -> dict[str, float]:
        """Flux into the sample through each wall over the last step [m³/s]."""
        fluxes = self.equation.wall_fluxes(self.state.pressure, self._velocities())
        return {name: float(q) for name, q in zip(WALLS, fluxes, strict=True)}

    @property
    def power(self) -> Power:
        """Where the fluid's power went over the last step."""
        return self.equation.power(self.state.pressure, self._velocities())

    def __repr__(self) -> str:
        return f"Coupling({self.grains!r}, {self.scheme}, {self.mesh.n_pores} pores)"


def _mean_by_vertex(mesh: PoreMesh, values: np.ndarray) -> np.ndarray:
    """(n + 6,): mean of the cells' values (m,) around each vertex, weighted by volume."""
    count = mesh.n_spheres + 6
    volumes = np.repeat(mesh.cell_volumes, 4)
    weight = np.bincount(mesh.cells.ravel(), volumes, count)
    total = np.bincount(mesh.cells.ravel(), volumes * np.repeat(values, 4), count)
    return np.divide(total, weight, out=np.zeros(count), where=weight > 0.0)
