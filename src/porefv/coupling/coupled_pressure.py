"""CoupledPressure: the pressure of the pores while grains move, (G + E D Eᵀ) p = Q - E ẋ*, on one mesh (C14 eq. 25-28).

ẋ* are the velocities that grains and walls would have after the step without the fluid, D what a force over the step
adds to them: dt / m for a grain. With D = 0 and velocities of half a step ago this is the step of C14.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from porefv.coupling.exchange import Exchange, gather, spread
from porefv.coupling.power import Power
from porefv.coupling.pressure_rule import PressureRule, dot
from porefv.errors import ComputationError, InputError, counted
from porefv.flow.flux import net_outflows, wall_face_fluxes
from porefv.flow.pressure import held_pressures
from porefv.mesh.pore_mesh import PoreMesh
from porefv.packing.box import WALL_AXES
from porefv.solvers.approximate_cholesky import ApproximateCholesky
from porefv.solvers.conjugate_gradients import preconditioned_cg
from porefv.solvers.direct import SparseFactor
from porefv.solvers.network import Network
from porefv.solvers.pressure_equation import free_network, reached
from porefv.solvers.solver import Solver
from porefv.system.kernels import kernel

if TYPE_CHECKING:
    from scipy import sparse

# Part of the drag, lumped on throats, that the preconditioner knows of.
_LUMPED = 0.3
_MOST_ITERATIONS = 2000
# Drag that rules the matrix by this factor takes iterations in hundreds: up to so many unknowns factorise it instead.
_RULING, _FACTORED = 300.0, 15_000
# What a common pressure drives in a closed vessel, by rounding, over what others drive.
_NOTHING = 1e-13


class Links(NamedTuple):
    """G between the free pores, as of `porefv.solvers.network.Network`, with indices without sign.

    Indices without sign need no look at whether they count from the end.

    Attributes
    ----------
    starts : (f + 1,) uint32 array
        Row i holds the entries starts[i] ... starts[i + 1].
    columns : uint32 array
        Pore at the other end of each link.
    weights : array
        Conductance of each link [m³/(Pa s)].
    leaks : (f,) array
        Conductance of each pore's links to pores of imposed pressure [m³/(Pa s)].
    """

    starts: np.ndarray
    columns: np.ndarray
    weights: np.ndarray
    leaks: np.ndarray


class Mobilities(NamedTuple):
    """D: what a force over the step adds to velocities.

    Attributes
    ----------
    grains : (n,) array
        Of each grain, by row [m/(s N)].
    walls : (6,) array
        Of each wall along its normal [m/(s N)].
    """

    grains: np.ndarray
    walls: np.ndarray


class CoupledPressure:
    """The pressure equation of pores whose grains move, on one mesh.

    Parameters
    ----------
    mesh : PoreMesh
    exchange : Exchange
    conductances : (t,) array
        K of each throat [m³/(Pa s)].
    pressures : (6,) array
        Imposed on walls, NaN where impervious [Pa].
    mobilities : (n,) array
        D of each grain, by row; zero for a step that is explicit in the drag [m/(s N)].
    layers : (n_pores,) int array, optional
        Wall whose pressure pores in a clear layer have, -1 for the others (`porefv.coupling.free_surface`).

    Raises
    ------
    InputError
        If walls hold the pressure of every pore.

    Notes
    -----
    Theory, grains and fluid: :eq:`eq-coupled-pressure` and :eq:`eq-implicit-drag`.
    """

    def __init__(
        self,
        mesh: PoreMesh,
        exchange: Exchange,
        conductances: np.ndarray,
        pressures: np.ndarray,
        mobilities: np.ndarray,
        layers: np.ndarray | None = None,
    ):
        self.layers = np.full(mesh.n_pores, -1) if layers is None else layers
        self.mesh, self.exchange, self.conductances, self.mobilities = mesh, exchange, conductances, mobilities
        self._of_factor = mobilities
        self.free = np.isnan(self._of_walls(pressures))
        if not self.free.any():
            raise InputError(
                f"the pressure of each of {counted(mesh.n_pores, 'pore')} is imposed by a wall: nothing is left that "
                "could resist the grains. Take more grains, or fewer walls with a pressure"
            )
        number = np.where(self.free, np.cumsum(self.free) - 1, -1).astype(np.int32)
        self._node = number[mesh.cell_pore]
        self._of_free = exchange.between(self._node)
        self._of_held = exchange.between(np.where(self._node < 0, mesh.cell_pore, -1))
        free = int(np.count_nonzero(self.free))
        self._room, self._room_for_forces = np.empty((3, free)), np.empty((mesh.n_spheres + 6, 3))
        faces = mesh.wall_faces
        self._walls_of_free = np.unique(faces.walls[self._node[faces.cells] >= 0])
        self._factor: ApproximateCholesky | SparseFactor | None = None
        # Of the last solution: what walls yielded, the matrix times 1 in every pore, and the sum of that.
        self._common: tuple[np.ndarray, np.ndarray, float] | None = None
        self.set_pressures(pressures)

    def _of_walls(self, pressures: np.ndarray) -> np.ndarray:
        """(n_pores,): pressure of pores that walls and clear layers hold, NaN elsewhere [Pa]."""
        inside = np.where(self.layers >= 0, pressures[self.layers], np.nan)
        return held_pressures(self.mesh, pressures, inside)

    def set_pressures(self, pressures: np.ndarray) -> None:
        """Change the pressures (6,) imposed on walls; which walls have one, stays."""
        mesh = self.mesh
        self.wall_pressures = pressures
        self._held = np.nan_to_num(self._of_walls(pressures))
        pairs = mesh.throats.pores
        self.network, self._inflow = free_network(
            pairs, self.conductances, self._held, self.free, np.zeros(mesh.n_pores)
        )
        starts, columns = self.network.starts.astype(np.uint32), self.network.columns.astype(np.uint32)
        self._links = Links(starts, columns, self.network.links, self.network.leaks)
        self._held_forces = np.zeros((mesh.n_spheres + 6, 3))
        self._of_held.spread(self._held, self._held_forces)

    def set_mobilities(self, mobilities: np.ndarray) -> None:
        """Change what a force over the step adds to the velocities of grains (n,), as the length of the step does.

        The preconditioner stays that of the mobilities before.
        """
        if not np.array_equal(mobilities, self.mobilities):
            self.mobilities, self._common = mobilities, None

    # ---- solving ------------------------------------------------------------------------------------------------

    def prepare(self, wall_mobilities: np.ndarray) -> None:
        """Make the preconditioner, for walls that yield so much (6,) [m/(s N)]; `solve` does where it is not made."""
        self._factor = self._make_factor(wall_mobilities)

    def solve(
        self,
        velocities: np.ndarray,
        wall_mobilities: np.ndarray,
        guess: np.ndarray,
        tolerance: float,
        product: np.ndarray | None = None,
    ) -> tuple[np.ndarray, np.ndarray, int]:
        """Pressures of the free pores, their product with the matrix, and iterations.

        Parameters
        ----------
        velocities : (n + 6, 3) array
            ẋ* of grains, by row, and of walls [m/s].
        wall_mobilities : (6,) array
            D of walls along their normals [m/(s N)].
        guess : (n_free,) array
            Where to start [Pa].
        tolerance : float
            Bound on the error of the pressures, relative, in the norm √(pᵀ (G + E D Eᵀ) p): that of power.
        product : (n_free,) array, optional
            (G + E D Eᵀ) × guess, where it is known [m³/s].

        Raises
        ------
        ComputationError
            If it is not reached.

        Notes
        -----
        Theory, grains and fluid: :eq:`eq-implicit-drag`.
        """
        if self._factor is None:
            self.prepare(wall_mobilities)
        assert self._factor is not None
        mobilities = Mobilities(self.mobilities, wall_mobilities)
        moved = velocities.copy()
        _yield(mobilities, self._held_forces, moved)
        rhs = np.zeros(len(self.network))
        self._of_free.gather(moved, rhs)
        np.subtract(self._inflow, rhs, out=rhs)
        operator = _StepOperator(self._of_free, self._links, mobilities, self._room_for_forces)
        x = guess.copy()
        if product is None:
            product = np.empty(len(x))
            operator.multiply(x, product)
        r = rhs - product
        rule = PressureRule(x, rhs, r, self.network, self._inflow, tolerance)
        iterations, found = preconditioned_cg(operator, self._factor, x, r, rule, _MOST_ITERATIONS, self._room)
        if not found:
            raise ComputationError(
                f"the pressures of moving pores were not found in {iterations} iterations; a larger tolerance, or a "
                "smaller contrast of grain sizes, makes it easier"
            )
        if self._common is None or not np.array_equal(self._common[0], wall_mobilities):
            self._common = wall_mobilities.copy(), *_common_rates(operator, len(x))
        _balance(x, rhs, r, *self._common[1:])
        return x, rhs - r, iterations

    def is_steady(self, wall_mobilities: np.ndarray) -> bool:
        """Whether the matrix stays as it is from step to step: no wall with free pores on it yields."""
        return not wall_mobilities[self._walls_of_free].any()

    def _make_factor(self, wall_mobilities: np.ndarray) -> ApproximateCholesky | SparseFactor:
        """Of the matrix itself where drag rules it, else of the network with a part of the drag in its throats."""
        mesh = self.mesh
        drags = np.zeros(mesh.n_spheres + 6)
        rows = self.exchange.rows[: mesh.n_cells]  # of the cells themselves; the others are for their neighbours
        drags[mesh.cells.ravel()] = np.append(self._of_factor, np.zeros(6))[rows.ravel()]
        vertices = mesh.facets.vertices[mesh.throats.first_facets]
        drag = drags[vertices].sum(axis=1) * (mesh.throats.areas / 3.0) ** 2
        nothing = np.zeros(mesh.n_pores)
        weights = self.conductances + _LUMPED * drag
        network, _ = free_network(mesh.throats.pores, weights, nothing, self.free, nothing)
        # Walls yield to the pressure on all of them: what each face has of it, lumped.
        faces = mesh.wall_faces
        node = self._node[faces.cells]
        yielding = faces.areas * (wall_mobilities * mesh.box.wall_areas)[faces.walls]
        leaks = np.bincount(node[node >= 0], yielding[node >= 0], len(network))
        if not (leaks.any() or network.leaks.any()):  # pressures are defined up to a constant: any will do
            leaks[0] = network.diagonal[0]
        if len(network) <= _FACTORED and np.median(drag) > _RULING * np.median(self.conductances):
            return SparseFactor(self._matrix(leaks))
        leaks, diagonal = network.leaks + leaks, network.diagonal + leaks
        return ApproximateCholesky.of(Network(network.starts, network.columns, network.links, leaks, diagonal))

    def _matrix(self, leaks: np.ndarray) -> sparse.csr_array:
        """G + E D Eᵀ of the grains, between free pores, and further leaks: pores couple through every grain."""
        from scipy import sparse

        n, free = len(self.mobilities), self._of_free
        columns = (3 * free.rows.astype(np.int64)[:, :, None] + np.arange(3)).ravel()
        rows = np.repeat(free.nodes.astype(np.int64), 12)
        shape = len(self.network), 3 * (n + 6)
        operator = sparse.csr_array((free.gradients.ravel(), (rows, columns)), shape=shape)
        mobilities = np.repeat(np.append(self._of_factor, np.zeros(6)), 3)
        drag = operator @ sparse.diags_array(mobilities) @ operator.T
        return (drag + sparse.diags_array(leaks) + self.network.to_matrix()).tocsr()

    # ---- what follows from the pressures ------------------------------------------------------------------------

    def full(self, pressure: np.ndarray) -> np.ndarray:
        """(n_pores,): pressures of all pores, from those of the free ones [Pa]."""
        full = self._held.copy()
        full[self.free] = pressure
        return full

    def forces(self, pressure: np.ndarray) -> np.ndarray:
        """(n + 6, 3): force on grains, by row, and walls, from the pressures of the free pores [N]."""
        forces = self._held_forces.copy()
        self._of_free.spread(pressure, forces)
        return forces

    def wall_fluxes(self, pressure: np.ndarray, velocities: np.ndarray) -> np.ndarray:
        """(6,): flux into the sample through each wall, grains and walls moving with (n + 6, 3) [m³/s]."""
        return self._wall_fluxes(self._outflows(pressure, velocities))

    def _outflows(self, pressure: np.ndarray, velocities: np.ndarray) -> np.ndarray:
        """(n_pores,): what each pore gives to others, and the rate at which it swells: nothing in free pores [m³/s]."""
        outflows = net_outflows(self.mesh, self.throat_fluxes(pressure))
        self.exchange.between(self.mesh.cell_pore).gather(velocities, outflows)
        return outflows

    def _wall_fluxes(self, outflows: np.ndarray) -> np.ndarray:
        mesh, inside = self.mesh, self.layers >= 0
        held = ~np.isnan(self.wall_pressures)
        of_faces = wall_face_fluxes(mesh, np.where(inside, 0.0, outflows), held)
        fluxes = np.bincount(mesh.wall_faces.walls, of_faces, 6)
        return fluxes + np.bincount(self.layers[inside], outflows[inside], 6)

    def throat_fluxes(self, pressure: np.ndarray) -> np.ndarray:
        """(t,): flux through each throat, from the pressures of the free pores [m³/s]."""
        full = self.full(pressure)
        i, j = self.mesh.throats.pores.T
        return self.conductances * (full[i] - full[j])

    def mass_imbalance(self, pressure: np.ndarray, velocities: np.ndarray) -> float:
        """What free pores lose or gain unseen, Σ|G p - Q + E ẋ|, over what flows.

        That is half of all that passes walls of imposed pressure, or half of all that free pores exchange with others,
        whichever is more; 0 where nothing flows.
        """
        outflows = self._outflows(pressure, velocities)
        passed = 0.5 * np.abs(self._wall_fluxes(outflows)).sum()
        exchanged = 0.5 * np.abs(net_outflows(self.mesh, self.throat_fluxes(pressure))[self.free]).sum()
        flow = max(passed, exchanged)
        return float(np.abs(outflows[self.free]).sum() / flow) if flow > 0.0 else 0.0

    def power(self, pressure: np.ndarray, velocities: np.ndarray) -> Power:
        """Where the power goes, grains and walls moving with (n + 6, 3).

        Theory, grains and fluid: :eq:`eq-power-balance`.
        """
        forces = self.forces(pressure)
        work = (forces * velocities).sum(axis=1)
        full = self.full(pressure)
        i, j = self.mesh.throats.pores.T
        dissipation = (self.throat_fluxes(pressure) * (full[i] - full[j])).sum()
        fluxes = self.wall_fluxes(pressure, velocities)
        boundary = np.dot(fluxes, np.nan_to_num(self.wall_pressures))
        return Power(float(work[:-6].sum()), float(work[-6:].sum()), float(dissipation), float(boundary))

    @property
    def cut_off(self) -> int:
        """Number of free pores from which no throat leads out."""
        return int(np.count_nonzero(~reached(self.mesh.throats.pores, self.conductances, ~self.free)))

    def drag_number(self, mobilities: np.ndarray, enough: float = np.inf) -> float:
        """Largest eigenvalue of D Eᵀ G⁻¹ E, to 1 %, for these mobilities (n,); a lower bound where that is `enough`.

        A step that is explicit in the drag is stable up to 2.

        Theory, grains and fluid: :eq:`eq-drag-number`.
        """
        solver = Solver(self.network)
        moves = np.zeros((len(mobilities) + 6, 3))
        moves[:-6] = np.random.default_rng(0).normal(size=(len(mobilities), 3))
        root = np.sqrt(mobilities)[:, None]
        largest = 0.0
        for _ in range(100):
            rates = np.zeros(len(self.network))
            self._of_free.gather(moves, rates)
            forces = np.zeros_like(moves)
            pressure, _ = solver.solve(rates, 1e-4)
            self._of_free.spread(pressure, forces)
            size = float(np.sqrt((moves[:-6] ** 2 / root**2).sum()))
            before, largest = largest, float(np.sqrt((forces[:-6] ** 2 * root**2).sum())) / size
            if abs(largest - before) <= 1e-3 * largest or largest > enough:
                break
            moves[:-6] = root**2 * forces[:-6] / largest
        return largest


class _StepOperator:
    """G + E D Eᵀ of one step. `forces`, (n + 6, 3), is room to work in."""

    def __init__(self, exchange: Exchange, links: Links, mobilities: Mobilities, forces: np.ndarray):
        self._exchange, self._links, self._mobilities, self._forces = exchange, links, mobilities, forces

    def multiply(self, q: np.ndarray, aq: np.ndarray) -> float:
        """aq = (G + E D Eᵀ) q; returns q·aq."""
        return _multiply(self._exchange, self._links, self._mobilities, self._forces, q, aq)


def _common_rates(operator: _StepOperator, pores: int) -> tuple[np.ndarray, float]:
    """The matrix times 1 in every pore, and the sum of that; zero where a common pressure drives nothing.

    In a closed vessel they are zero but for rounding. Pressures of alternate sign drive as much as there is.
    """
    common, alternate = np.empty(pores), np.empty(pores)
    whole = operator.multiply(np.ones(pores), common)
    most = operator.multiply(np.where(np.arange(pores) % 2, -1.0, 1.0), alternate)
    if whole <= _NOTHING * most:
        return np.zeros(pores), 0.0
    return common, whole


@kernel
def _balance(x, rhs, r, common, whole):
    """Correct pressures x and residual r by a common change and a common factor, so that Σ r = 0 and x·r = 0.

    All pores together then lose no volume, and the power balances: what is wrong of it is x·r. Among all such changes
    these make the error least, in the norm of the power.

    Parameters
    ----------
    x, rhs, r : (f,) arrays
        Pressures, right-hand side, and residual.
    common : (f,) array
        The matrix times 1 in every pore.
    whole : float
        Sum of that.
    """
    lost = wrong = along = power = 0.0
    for i in range(x.shape[0]):
        product = rhs[i] - r[i]
        lost += r[i]
        wrong += x[i] * r[i]
        along += product
        power += x[i] * product
    shift = factor = 0.0
    determinant = whole * power - along * along
    if determinant > 1e-10 * abs(whole * power):
        shift = (power * lost - along * wrong) / determinant
        factor = (whole * wrong - along * lost) / determinant
    elif whole > 0.0:  # pressures are all but the same
        shift = lost / whole
    elif power > 0.0:  # nothing leaves the box: a common pressure drives nothing
        factor = wrong / power
    for i in range(x.shape[0]):
        product = rhs[i] - r[i]
        x[i] += shift + factor * x[i]
        r[i] -= shift * common[i] + factor * product


@kernel
def _yield(mobilities, forces, moves):
    """moves += D forces, both (n + 6, 3); walls yield along their normals alone."""
    n = mobilities.grains.shape[0]
    for k in range(n):
        for axis in range(3):
            moves[k, axis] += mobilities.grains[k] * forces[k, axis]
    for w in range(6):
        moves[n + w, WALL_AXES[w]] += mobilities.walls[w] * forces[n + w, WALL_AXES[w]]


@kernel
def _multiply(exchange, links, mobilities, forces, q, aq):
    """aq = (G + E D Eᵀ) q; returns q·aq.

    Parameters
    ----------
    exchange : Exchange
        E, between grains and the free pores.
    links : Links
        G.
    mobilities : Mobilities
        D.
    forces : (n + 6, 3) array
        Room to work in.
    q, aq : (f,) arrays
        Pressures of the free pores [Pa], and rates [m³/s].
    """
    n = mobilities.grains.shape[0]
    forces[:] = 0.0
    spread(exchange, q, forces)
    for k in range(n):
        for axis in range(3):
            forces[k, axis] *= mobilities.grains[k]
    for w in range(6):
        for axis in range(3):
            forces[n + w, axis] *= mobilities.walls[w] if axis == WALL_AXES[w] else 0.0
    starts, columns, weights, leaks = links
    for i in range(q.shape[0]):
        total = leaks[i] * q[i]
        for k in range(starts[i], starts[i + 1]):
            total += weights[k] * (q[i] - q[columns[k]])
        aq[i] = total
    gather(exchange, forces, aq)
    return dot(q, aq)
