"""Coupling: grains that move in a viscous fluid, and a fluid that flows as they move (C14 §2.3)."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import cast

import numpy as np

from porefv.conductance.conductances import throat_conductances
from porefv.conductance.model import ConductanceModel, ensure_model
from porefv.conductance.registry import AUTO
from porefv.coupling.anderson_mixing import AndersonMixing
from porefv.coupling.coupled_pressure import CoupledPressure
from porefv.coupling.coupling_settings import CouplingSettings, Effort
from porefv.coupling.coupling_state import CouplingState
from porefv.coupling.end_correction import end_corrected_conductances
from porefv.coupling.exchange import Exchange
from porefv.coupling.free_surface import clear_layers
from porefv.coupling.long_steps import adapt
from porefv.coupling.open_throats import NO_FAR_WALLS, open_throats
from porefv.coupling.pair_motion import PairMotion
from porefv.coupling.pair_resistance import PairLaw, PairResistance
from porefv.coupling.power import Power
from porefv.coupling.relative_motion import RelativeMotion
from porefv.coupling.validity import Validity, validity
from porefv.dem.grain_model import GrainModel, LongStepGrainModel, SpinningGrainModel
from porefv.errors import InputError
from porefv.flow.fluid import Fluid
from porefv.flow.pressure import held_pressures
from porefv.flow.pressure_on_grains import solid_pressure_weights
from porefv.flow.walls import Walls, ensure_no_imposed_flow
from porefv.mesh.pore_mesh import PoreMesh
from porefv.packing.box import WALL_AXES, WALL_SENSES, WALLS
from porefv.packing.packing import Packing
from porefv.system.timer import Timer

# Drag number up to which `auto` is explicit in the drag, and beyond which an explicit step is refused. It is unstable
# from 2 on; below 0.1 the error of being explicit is a few parts in a hundred of the fastest drag.
EXPLICIT, UNSTABLE = 0.1, 1.8
# Bound on the power's relative error where pressures start anew on another mesh.
_ANEW = 1e-8
# Steps after which products of pressures with the matrix are worked out, not carried on, lest rounding gathers.
_ANEW_EVERY = 50
# Tolerance of pairs over that of pressures: with 1 it rules the error of the power, and 0.1 costs a tenth of a step.
_OF_PAIRS = 0.1
# The same in long steps, in which their splitting from pressures rules it.
_OF_PAIRS_IN_LONG_STEPS = 0.3
# Most rounds of pairs and pressures in the first step on a mesh. They end where pressures change by the second part,
# and the power of pairs is wrong by the third part of the fluid's.
_ROUNDS, _SETTLED, _AGREED = 60, 1e-3, 2e-4
# Bound on the relative error of pressures and velocities within these rounds.
_IN_ROUNDS = 1e-5
# Rounds that the next one is extrapolated from. With 8, a stiff drag takes half as many again.
_KEPT = 20
# Steps between two looks at how far grains have moved.
_STRIDE = 10
# (`cast`: to ask each step whether grains are of a protocol takes longer than the step of a few hundred.)
# The rows of the walls in arrays of grains and walls.
_WALL_ROWS = np.arange(-6, 0)


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
        `auto`: the first where the drag number is below 0.1 and pairs do not resist, else the second.
    exchange : {'facets', 'volumes'}
        Volume rates and forces, see `porefv.coupling.exchange`.
    tolerance : float
        Bound on the relative error of the pressures in the norm of power, each step.
    renewal : float
        The mesh is made anew when one in a hundred neighbours has moved past each other by this part of the mean
        radius, or any by five times as much, see `porefv.coupling.relative_motion`.
    end_correction : bool
        Whether to correct the drainage height for the looser layer of grains at a drained wall, see
        `porefv.coupling.end_correction`.
    pair_resistance : bool
        Whether grains that move past each other meet lubrication and viscous resistance, see
        `porefv.coupling.pair_resistance`. Loose states need it; in a dense skeleton it is a part in a hundred of the
        dissipation, and each step costs more.
    roughness : float
        Gap, over the mean radius of a pair, below which lubrication grows no more.
    stride : int
        Length of a step of grains and fluid together, in steps of the grains. In one longer than a step contacts yield
        (`porefv.dem.yielding_contacts`): they are implicit like the resistance of pairs. Where a wall presses with a
        stress, steps are not long.

    Attributes
    ----------
    settings : CouplingSettings
        The options above.
    state : CouplingState
        What it holds between two steps, besides its grains.
    mesh : PoreMesh
        The current one.
    equation : CoupledPressure
        The pressure equation on the current mesh.
    end_depths : (6,) array
        Depth that the end correction adds at each wall on the current mesh, zero where it does not act [m].
    effort : Effort

    Raises
    ------
    InputError
        For an unknown option; if the fluid, incompressible, has nowhere to go where walls move; if the step is
        explicit and unstable.

    Notes
    -----
    Theory, grains and fluid: :eq:`eq-coupled-pressure` and :eq:`eq-coupled-motion`.

    Time is that of the grains. Pressures and forces act over a step, from t - dt to t, and velocities live in its
    middle.
    """

    mesh: PoreMesh
    equation: CoupledPressure
    state: CouplingState
    end_depths: np.ndarray

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
        pair_resistance: bool = False,
        roughness: float = 0.02,
        stride: int = 1,
    ):
        self._set_up(
            grains, walls, fluid if fluid is not None else Fluid(),
            ensure_model(conductance) if conductance is not None else AUTO(),
            CouplingSettings(scheme, exchange, tolerance, renewal, end_correction, pair_resistance, roughness, stride),
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
        if coupling._pairs is not None:
            coupling._pairs.restore(state)
        return coupling

    def _set_up(
        self, grains: GrainModel, walls: Walls, fluid: Fluid, conductance: ConductanceModel, settings: CouplingSettings
    ) -> None:
        ensure_no_imposed_flow(walls)
        self.grains, self.walls, self.fluid = grains, walls, fluid
        self.conductance, self.settings = conductance, settings
        if settings.pair_resistance and not isinstance(grains, SpinningGrainModel):
            raise InputError(
                "pair_resistance needs grains that spin: a grain model with `spins` and `predict_spins`, and with "
                "torques in `correct` (porefv.dem.SpinningGrainModel)"
            )
        if settings.stride > 1 and not isinstance(grains, LongStepGrainModel):
            raise InputError(
                "stride needs grains whose contacts yield within a step (porefv.dem.LongStepGrainModel), as those of "
                "porefv.dem.DEM; with other grains it is 1"
            )
        self.effort = Effort()

    # ---- time ---------------------------------------------------------------------------------------------------

    def run(self, steps: int) -> None:
        """Take so many steps.

        Raises
        ------
        ComputationError
            If the motion runs away, or pressures cannot be found.
        """
        while steps > 0:
            stride = min(self.stride, steps)
            look = self.effort.steps % _STRIDE < stride
            if look and self._relative_motion(self.grains) > self.settings.renewal:
                self.renew_mesh()
            self._step(stride, look)
            steps -= stride

    @property
    def stride(self) -> int:
        """Length of a step now, in steps of the grains."""
        if self.settings.stride == 1:
            return 1
        return 1 if cast(LongStepGrainModel, self.grains).presses else self.state.longest

    def _step(self, stride: int, look: bool) -> None:
        pairs = self._pairs
        with Timer(self.effort.seconds, "grains"):
            if stride == 1:
                predicted, wall_speeds, mobilities, wall_mobilities = self.grains.predict()
            else:
                long = cast(LongStepGrainModel, self.grains)
                predicted, wall_speeds, mobilities, wall_mobilities = long.predict(stride)
            if self.settings.stride > 1:
                self.equation.set_mobilities(mobilities)
                self._change_stride(stride)
            self._refuse_no_way_out(wall_speeds, wall_mobilities)
            moves = self._moves
            moves[:-6], moves[-6:] = predicted, self.grains.wall_velocities
            moves[_WALL_ROWS, WALL_AXES] = WALL_SENSES * wall_speeds
        if pairs is not None:
            with Timer(self.effort.seconds, "pairs"):
                if look:
                    pairs.look(self.grains, self.state)
                pairs.begin(self.grains, moves, mobilities, wall_mobilities, stride)
        if self.scheme == "implicit-drag":
            self._find_implicit_pressure(moves, wall_mobilities)
        else:
            moves[:-6] = self._velocities()[:-6]
            with Timer(self.effort.seconds, "pressure"):
                self._find_pressure(moves, wall_mobilities)
            self._slow_pairs()
        with Timer(self.effort.seconds, "forces"):
            forces = self.equation.forces(self.state.pressure)
            if pairs is not None:
                if self.settings.stride > 1:
                    adapt(self.state, pairs.mismatch(forces, self.state), self.settings.stride)
                forces += pairs.forces[:, :3]
            thrusts = forces[_WALL_ROWS, WALL_AXES] * WALL_SENSES
        with Timer(self.effort.seconds, "grains"):
            if pairs is None:
                self.grains.correct(forces[:-6], thrusts)
            elif stride == 1:
                cast(SpinningGrainModel, self.grains).correct(forces[:-6], thrusts, pairs.forces[:-6, 3:])
            else:
                long = cast(LongStepGrainModel, self.grains)
                long.correct(forces[:-6], thrusts, pairs.forces[:-6, 3:], pairs.yielded)
        self.effort.steps += stride

    def _change_stride(self, stride: int) -> None:
        """Take in the length of a step: another matrix, and what the last step changed in proportion to it."""
        state = self.state
        if stride != state.stride:
            state.rate = state.rate * (stride / state.stride)
            state.products, state.stride = np.zeros((2, 0)), stride

    def _find_implicit_pressure(self, moves: np.ndarray, wall_mobilities: np.ndarray) -> None:
        """Find the pressures of a step that is implicit in the drag, and the resistance of pairs before it.

        Pairs resist the velocities under the pressures before, and the pressures change these further: the incremental
        splitting of projection methods, stable at any step, whose error goes with the change of the pressures. In the
        first step on a mesh there are none before: rounds of both then converge to the step without splitting. Without
        Anderson's extrapolation they would take as many rounds as the drag of a step is stiff.
        """
        first, still = self.state.fresh, moves.copy()
        mixing, anew = AndersonMixing(_KEPT), _ANEW
        for left in range(_ROUNDS if first and self._pairs is not None else 1, 0, -1):
            before = self.state.pressure
            self._slow_pairs()
            if self._pairs is not None:
                np.add(still, self._pairs.changes[:, :3], out=moves)
            with Timer(self.effort.seconds, "pressure"):
                self._find_pressure(moves, wall_mobilities, anew)
            anew = _IN_ROUNDS
            if left == 1 or self._agree(before):
                break
            self.state.start_anew(mixing.next(before, self.state.pressure))

    def _agree(self, before: np.ndarray) -> bool:
        """Whether pairs and pressures agree, after a round that began with these pressures (f,)."""
        pressure = self.state.pressure
        if np.abs(pressure - before).max(initial=0.0) > _SETTLED * np.abs(before).max(initial=0.0):
            return False
        return self._pairs is None or self._pairs.mismatch(self.equation.forces(pressure), self.state) <= _AGREED

    def _slow_pairs(self) -> None:
        """What pairs resist with, under the pressures there are."""
        if self._pairs is not None:
            with Timer(self.effort.seconds, "pairs"):
                state, part = self.state, _OF_PAIRS
                pressure = state.pressure
                if state.stride > 1:
                    # Half of what the last step changed: without, long steps ring; all of it is unstable.
                    pressure, part = pressure + 0.5 * state.rate, _OF_PAIRS_IN_LONG_STEPS
                forces = self.equation.forces(pressure)
                tolerance = _IN_ROUNDS if state.fresh else part * self.settings.tolerance
                self.effort.pair_iterations += self._pairs.resist(forces, tolerance, state)

    def _find_pressure(self, moves: np.ndarray, wall_mobilities: np.ndarray, anew: float = _ANEW) -> None:
        """Find the pressures of a step, and what the next one starts from; on another mesh to a tolerance of `anew`."""
        state, equation, tolerance = self.state, self.equation, self.settings.tolerance
        # Half of what the last step changed: all of it would pass its noise on.
        guess, product = state.pressure + 0.5 * state.rate, None
        steady = equation.is_steady(wall_mobilities)
        if steady and state.products.size and self.effort.steps % (_ANEW_EVERY * state.stride) >= state.stride:
            product = state.products[0] + 0.5 * state.products[1]
        if state.fresh:
            tolerance = min(tolerance, anew)
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
        self.effort.iterations += iterations

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
        same = (
            (np.isnan(walls.pressures) == np.isnan(self.walls.pressures)).all()
            and (walls.slip == self.walls.slip).all()
            and (walls.free == self.walls.free).all()
        )
        self.walls = walls
        if same:
            self.equation.set_pressures(walls.pressures)
        else:
            self.renew_mesh()

    # ---- the mesh -----------------------------------------------------------------------------------------------

    def renew_mesh(self) -> None:
        """Make the mesh anew, with the pressures there were."""
        around, before = _mean_by_vertex(self.mesh, self.cell_pressure), self.state
        self._make_mesh(Packing(self.grains.positions, self.grains.radii, self.grains.box))
        cells = around[self.mesh.cells].mean(axis=1)
        pores = np.bincount(self.mesh.cell_pore, cells, self.mesh.n_pores) / np.bincount(self.mesh.cell_pore)
        self.state.pressure, self.state.pair_velocities = pores[self.equation.free], before.pair_velocities
        self.state.longest, self.state.calm = before.longest, before.calm

    def _make_mesh(self, packing: Packing) -> None:
        """Make the mesh of a packing, its conductances and its exchange with the grains; pressures are zero."""
        with Timer(self.effort.seconds, "mesh"):
            grains, slip, pressures = self.grains, self.walls.slip, self.walls.pressures
            mesh = PoreMesh(packing)
            factors, far_walls, self.end_depths = None, NO_FAR_WALLS, np.zeros(6)
            if self.settings.pair_resistance:
                conductances, factors, far_walls = open_throats(mesh, self.conductance, slip, self.fluid.viscosity)
            else:
                conductances = throat_conductances(mesh, self.conductance, slip, self.fluid.viscosity)
            if self.settings.end_correction:
                conductances, self.end_depths = end_corrected_conductances(
                    mesh, conductances, pressures, self.walls.free
                )
            layers = clear_layers(mesh, self.walls.free)
            held = ~np.isnan(held_pressures(mesh, pressures)) | (layers >= 0)
            weights = solid_pressure_weights(mesh, self.conductance, conductances, slip, held)
            exchange = Exchange.of(
                mesh, self.settings.exchange, slip, grains.rows,
                split=self.conductance.force_split, solid_pressure=weights, wall_factors=factors,
            )  # fmt: skip
            drag = np.empty(len(packing))
            drag[grains.rows] = self.settings.stride * grains.step / grains.masses
            self.equation, scheme, drag_number = self._choose(
                lambda mobilities: CoupledPressure(mesh, exchange, conductances, pressures, mobilities, layers), drag
            )
            self.mesh = mesh
            self.state = CouplingState.of(packing, int(np.count_nonzero(self.equation.free)), scheme, drag_number)
            self.state.stride = self.state.longest = self.settings.stride
            self._relative_motion = RelativeMotion(mesh)
            self._closed = bool(np.isnan(pressures).all())
            self._moves = np.zeros((len(packing) + 6, 3))
            self._pairs = None
            if self.settings.pair_resistance:
                dragging = ~slip & np.isnan(pressures)
                law = PairLaw(self.fluid.viscosity, self.settings.roughness)
                self._pairs = PairMotion(PairResistance(mesh, dragging, law, grains.rows, far_walls))
                self._pairs.look(grains, self.state)
                self.state.pair_velocities = np.zeros((len(packing) + 6, 6))
        self.effort.meshes += 1

    def _choose(
        self, equation: Callable[[np.ndarray], CoupledPressure], drag: np.ndarray
    ) -> tuple[CoupledPressure, str, float | None]:
        """The equation, the scheme and the drag number, where that decides; refuse an unstable scheme.

        `equation` is called with the mobilities of the grains: `drag` (n,), or none for a step explicit in the drag.
        """
        asked = self.settings.scheme
        # Pairs are implicit in any case, and only pressures from the velocities after the step conserve the fluid.
        if asked == "implicit-drag" or (asked == "auto" and self.settings.pair_resistance):
            return equation(drag), "implicit-drag", None
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
        return self._forces()[:-6][self.grains.rows]

    @property
    def wall_fluid_forces(self) -> np.ndarray:
        """(6, 3): force of the fluid on each wall over the last step [N]."""
        return self._forces()[-6:]

    @property
    def pair_resistance(self) -> PairResistance | None:
        """L of the pairs on the current mesh, where they resist."""
        return None if self._pairs is None else self._pairs.resistance

    def _forces(self) -> np.ndarray:
        """(n + 6, 3): force of the fluid on grains, by row, and walls, of pressures and pairs."""
        forces = self.equation.forces(self.state.pressure)
        return forces if self._pairs is None else forces + self._pairs.forces[:, :3]

    @property
    def fluid_torques(self) -> np.ndarray:
        """(n, 3): torque of the fluid on each grain over the last step, by id; of pairs alone [N m]."""
        if self._pairs is None:
            return np.zeros((len(self.grains.radii), 3))
        return self._pairs.forces[:-6, 3:][self.grains.rows]

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
        velocities = self._velocities()
        power = self.equation.power(self.state.pressure, velocities)
        if self._pairs is None:
            return power
        turning = cast(SpinningGrainModel, self.grains).spins
        spins = np.empty_like(turning)
        spins[self.grains.rows] = turning
        grains, walls, pairs = self._pairs.power(velocities, spins, self.state)
        return replace(power, grains=power.grains + grains, walls=power.walls + walls, pairs=pairs)

    @property
    def mass_imbalance(self) -> float:
        """What pores lost or gained unseen over the last step, relative to what flows (`CoupledPressure`)."""
        return self.equation.mass_imbalance(self.state.pressure, self._velocities())

    @property
    def validity(self) -> Validity:
        """Reynolds and Stokes numbers of the last step, which say whether flow without inertia holds."""
        fluxes = self.equation.throat_fluxes(self.state.pressure)
        return validity(self.mesh, fluxes, self.grains.velocities, self.fluid, self.walls.slip)

    def __repr__(self) -> str:
        return f"Coupling({self.grains!r}, {self.scheme}, {self.mesh.n_pores} pores)"


def _mean_by_vertex(mesh: PoreMesh, values: np.ndarray) -> np.ndarray:
    """(n + 6,): mean of the cells' values (m,) around each vertex, weighted by volume."""
    count = mesh.n_spheres + 6
    volumes = np.repeat(mesh.cell_volumes, 4)
    weight = np.bincount(mesh.cells.ravel(), volumes, count)
    total = np.bincount(mesh.cells.ravel(), volumes * np.repeat(values, 4), count)
    return np.divide(total, weight, out=np.zeros(count), where=weight > 0.0)
