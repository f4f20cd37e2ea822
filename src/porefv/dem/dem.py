"""DEM: grains that move under contact forces, gravity and whatever is applied to them (C14 §2.1)."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

import numpy as np

from porefv.dem.contacts import StepParameters
from porefv.dem.grain_state import GrainState
from porefv.dem.material import Material
from porefv.dem.measurements import Contacts, Energies, contact_loads
from porefv.dem.motion import CROWDED, FORCES, MOTION, RUNAWAY, WHOLE, Found, Loads, Motion, advance, free_motion
from porefv.dem.pair_listing import list_pairs, ranges_for, set_stiffness
from porefv.dem.plate import Plate
from porefv.dem.yielding_contacts import YieldingContacts, find_yielding
from porefv.errors import ComputationError, InputError
from porefv.packing.box import WALL_AXES, WALL_SENSES, WALLS, Box
from porefv.packing.neighbours import neighbour_pairs
from porefv.packing.overlaps import sphere_volumes
from porefv.packing.packing import Packing
from porefv.system.number_checks import check_number, three_numbers

# The step, as a part of the critical one √(m/k): motion was stable to 0.85 of it or more in a dense packing, whatever
# its friction (benchmarks/dem.py).
SAFETY = 0.5
# A grain that covers more than this part of the smallest radius in one step has passed others unseen.
_RUNAWAY = 0.1
# Part of the way to balance, by the stiffness of its contacts, that a pressing wall moves in one step.
_GAIN = 0.8


class DEM:
    """Spherical grains between six walls, moved by an explicit discrete element method.

    Parameters
    ----------
    packing : Packing
        Grains in a box; the box's walls are plates. Ids are positions in the packing.
    material : Material
    plates : mapping from wall names to Plate, optional
        Walls that are not named stand still, without friction.
    gravity : (3,) sequence of float
        [m/s²]
    damping : float
        Local non-viscous damping (Cundall), for dry preparation only: part of each acceleration, in [0, 1).
    step : float, optional
        Time step [s]; `SAFETY` times the critical one by default.

    Attributes
    ----------
    state : GrainState
        Everything that it holds between two steps, besides its parameters: `material`, `plates` by wall, `gravity`,
        `damping` and `step`.
    halfway : bool
        Whether `predict` has begun a step that `correct` must end.

    Raises
    ------
    InputError
        For a packing without a box, grains outside of it or nested in others, a step above the critical one, or a
        parameter out of range.

    Notes
    -----
    Any `porefv.dem.GrainModel` can take its place in a coupling.
    """

    def __init__(
        self,
        packing: Packing,
        material: Material | None = None,
        plates: Mapping[str, Plate] | None = None,
        *,
        gravity: Sequence[float] = (0.0, 0.0, 0.0),
        damping: float = 0.0,
        step: float | None = None,
    ):
        self.material = material if material is not None else Material()
        self.gravity = three_numbers(gravity, "gravity", "m/s²")
        check_number(damping, "damping", "a number in [0, 1)", lambda x: 0.0 <= x < 1.0)
        self.damping = float(damping)
        _check_grains(packing)
        assert packing.walled_box is not None  # _check_grains has seen to it

        self.state = GrainState.of(packing)
        self._make_room()
        self.set_plates(plates or {})
        self._measure_grains()
        critical = self.critical_step
        if step is None:
            step = SAFETY * critical
        check_number(step, "step", "a positive time in s", lambda x: x > 0.0)
        if step >= critical:
            raise InputError(
                f"a step of {step:.4g} s is above the critical one, {critical:.4g} s (√(m/k) of the lightest grain and "
                f"its stiffest contact); leave it out to have {SAFETY} of that"
            )
        self.step = float(step)
        self.list_pairs()

    @classmethod
    def from_state(
        cls,
        state: GrainState,
        material: Material,
        plates: Mapping[str, Plate],
        *,
        gravity: Sequence[float],
        damping: float,
        step: float,
    ) -> DEM:
        """The DEM that goes on from a state, to the last bit, with the parameters that belong to it.

        Parameters
        ----------
        state : GrainState
            Taken as it is, not copied.
        material, plates, gravity, damping, step
            As of `DEM`, and as they were: stiffnesses and masses, and what plates do, are in the state.
        """
        dem = cls.__new__(cls)
        dem.material, dem.plates = material, {name: plates[name] for name in WALLS}
        dem.gravity, dem.damping = np.array(gravity, float), damping
        dem.step = step
        dem.state = state
        dem._make_room()
        return dem

    def _make_room(self) -> None:
        self._smallest = float(self.state.grains.motion[:, 3].min())
        # Loads of contacts: zero between two steps.
        ranges = ranges_for(len(self))
        self._contact_loads = np.zeros((ranges, len(self), 6)), np.zeros((ranges, 6, 4))
        self.halfway = False
        self._yielding = YieldingContacts.room(0)

    # ---- set-up -------------------------------------------------------------------------------------------------

    def set_plates(self, plates: Mapping[str, Plate]) -> None:
        """Change what walls do; walls that are not named stand still."""
        unknown = set(plates) - set(WALLS)
        if unknown:
            raise InputError(f"unknown wall {sorted(unknown)[0]!r}; known: {', '.join(WALLS)}")
        self.plates = {name: plates.get(name, Plate()) for name in WALLS}
        walls = self.state.walls
        walls.velocities[:] = [plate.velocity for plate in self.plates.values()]
        walls.targets[:] = [np.nan if plate.stress is None else plate.stress for plate in self.plates.values()]
        walls.top_speeds[:] = [plate.top_speed or 0.0 for plate in self.plates.values()]
        walls.friction[:] = [math.tan(math.radians(plate.friction_angle)) for plate in self.plates.values()]

    def set_material(self, material: Material) -> None:
        """Change what the grains are made of, for instance their friction once a packing has its density."""
        # √(m/k) goes with √(ρ/E), whatever the grains.
        change = math.sqrt(material.density / material.young * self.material.young / self.material.density)
        critical = change * self.critical_step
        if self.step >= critical:
            raise InputError(f"the step of {self.step:.4g} s is above this material's critical one, {critical:.4g} s")
        self.material = material
        self._measure_grains()
        set_stiffness(self.state, material.young)

    def scale_radii(self, factor: float) -> None:
        """Grow or shrink all grains about their centres; the step keeps its part of the critical one."""
        check_number(factor, "factor", "a positive number", lambda x: x > 0.0)
        part = self.step / self.critical_step
        self.state.grains.motion[:, 3] *= factor
        self._smallest = float(self.state.grains.motion[:, 3].min())
        self._measure_grains()
        self.step = part * self.critical_step
        self.list_pairs()

    def _measure_grains(self) -> None:
        motion, inverse_mass, inverse_inertia = self.state.grains
        r = motion[:, 3]
        mass = sphere_volumes(r) * self.material.density
        inverse_mass[:] = 1.0 / mass
        inverse_inertia[:] = 1.0 / (0.4 * mass * r**2)

    @property
    def critical_step(self) -> float:
        """Least √(m/k) of a grain and the stiffest contact it may have, with the largest grain [s]."""
        r = self.state.grains.motion[:, 3]
        stiffest = 2.0 * self.material.young * r * r.max() / (r + r.max())
        return float(np.sqrt(1.0 / (self.state.grains.inverse_mass * stiffest)).min())

    def list_pairs(self) -> None:
        """List the pairs that may touch before any grain has moved by half the margin, and keep what contacts hold."""
        list_pairs(self.state, self.material.young)

    # ---- motion -------------------------------------------------------------------------------------------------

    def run(self, steps: int) -> None:
        """Take so many steps.

        Raises
        ------
        ComputationError
            If the motion runs away: a grain crosses a tenth of the smallest radius in one step, or is nowhere.
        """
        if self.halfway:
            raise InputError("a step is half taken: finish it with `correct` before the next")
        state = self.state
        before = state.grains.motion[:, :3].copy() if state.applied.any() else None
        done = 0
        if steps > 0 and state.stride > 1:  # contacts slip over the whole of a long step before
            self._advance(FORCES, 1, state.applied, np.zeros(6))
            state.stride = 1
            done += self._advance(MOTION, 1, state.applied, np.zeros(6))
        while done < steps:
            done += self._advance(WHOLE, steps - done, state.applied, np.zeros(6))
        if before is not None:
            state.applied_work += float((state.applied * (state.grains.motion[:, :3] - before)).sum())

    def predict(self, stride: int = 1) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """Take the first half of a step: contact forces, but no motion; `correct` takes the other.

        Parameters
        ----------
        stride : int
            Length of the step, in steps. In one longer than a step contacts must yield: see `yielding_contacts`.

        Returns
        -------
        velocities (n, 3) array
            That grains would have after the step, grain i in row `rows[i]` [m/s].
        wall_speeds (6,) array
            That walls would have, along their outward normals [m/s].
        mobilities (n,), wall_mobilities (6,) arrays
            What a force applied over the step adds to them: dt / m for grains, in the same rows; for pressing walls
            what they yield, for other walls nothing [m/(s N)].

        Raises
        ------
        InputError
            With damping, which would not see the forces that are still to come.
        """
        if self.damping > 0.0:
            raise InputError("damping is for dry preparation: set it to 0 where a fluid moves with the grains")
        state = self.state
        if not self.halfway:
            self._advance(FORCES, 1, state.applied, np.zeros(6))
            state.stride, self.halfway = stride, True
            self._yielding = self._find_yielding() if stride > 1 else YieldingContacts.room(0)
        loads = Loads(*self._contact_loads, state.applied, np.zeros(6))
        velocities, speeds, mobilities = free_motion(self._parameters(), state.grains, state.walls, loads)
        return velocities, speeds, mobilities, state.walls.yields

    @property
    def yielding_contacts(self) -> YieldingContacts:
        """Contacts that yield within the long step that `predict` has begun; none in another."""
        return self._yielding

    def _find_yielding(self) -> YieldingContacts:
        state = self.state
        room = YieldingContacts.room(len(state.pairs.others) + len(state.wall_pairs.members))
        found = find_yielding(
            self._parameters(), state.grains, state.pairs, state.wall_pairs, state.walls, self._contact_loads[0][0],
            room,
        )  # fmt: skip
        return room.first(found)

    def predict_spins(self) -> tuple[np.ndarray, np.ndarray]:
        """Spins (n, 3) after the step that `predict` has begun, and dt / I (n,), grain i in row `rows[i]`.

        Returns
        -------
        spins (n, 3) array
            [rad/s]
        mobilities (n,) array
            What a torque over the step adds to them [rad/(s N m)].
        """
        if not self.halfway:
            raise InputError("`predict_spins` is for a step that `predict` has begun")
        grains = self.state.grains
        mobilities = self.state.stride * self.step * grains.inverse_inertia
        torques = self._contact_loads[0][:, :, 3:].sum(axis=0)
        return grains.motion[:, 7:10] + mobilities[:, None] * torques, mobilities

    def correct(
        self,
        forces: np.ndarray,
        thrusts: np.ndarray,
        torques: np.ndarray | None = None,
        yielded: np.ndarray | None = None,
    ) -> None:
        """Take the second half of a step, after `predict`, under forces on grains and walls besides all others.

        Parameters
        ----------
        forces : (n, 3) array
            On grain i in row `rows[i]`, over this step alone [N].
        thrusts : (6,) array
            On the walls, along their outward normals [N].
        torques : (n, 3) array, optional
            On the grains, in the same rows, over this step alone [N m].
        yielded : (n + 6, 6) array, optional
            What contacts that yield add to forces and torques on grains, in the same rows, and walls [N, N m].
        """
        if not self.halfway:
            raise InputError("`correct` ends a step that `predict` has begun")
        self.halfway = False
        if torques is not None:
            self._contact_loads[0][0, :, 3:] += torques
        if yielded is not None:
            self._contact_loads[0][0] += yielded[:-6]
            self.state.walls.forces[:] += yielded[-6:, :3]
        applied = self.state.applied + forces
        self._advance(MOTION, 1, applied, np.asarray(thrusts, float))
        dt = self.state.stride * self.step
        self.state.applied_work += dt * float((applied * self.state.grains.motion[:, 4:7]).sum())
        if torques is not None:
            self.state.applied_work += dt * float((torques * self.state.grains.motion[:, 7:10]).sum())

    def _advance(self, half: int, steps: int, applied: np.ndarray, thrusts: np.ndarray) -> int:
        """Take steps until pairs must be listed anew; returns how many."""
        state = self.state
        loads = Loads(*self._contact_loads, applied, thrusts)
        taken, reason = advance(
            steps,
            half,
            Motion(
                self._parameters(), state.grains, state.pairs, state.wall_pairs, state.walls, state.listing, loads,
                Found.of(ranges_for(len(self))), state.work,
            ),
        )  # fmt: skip
        state.steps += taken * state.stride
        state.time += taken * state.stride * self.step
        if reason == RUNAWAY:
            self._fail()
        if reason == CROWDED:
            self.list_pairs()
        return taken

    def _parameters(self) -> StepParameters:
        # Integers among them would compile the kernels anew.
        step = float(self.state.stride * self.step)
        ratio, friction = float(self.material.stiffness_ratio), self.material.friction
        return StepParameters(step, ratio, friction, self.gravity, float(self.damping), _GAIN, self.fastest)

    @property
    def moved_since_listing(self) -> float:
        """Largest distance that a grain has moved since the pairs that may touch were listed [m]."""
        return float(np.sqrt(((self.state.grains.motion[:, :3] - self.state.listing.centres) ** 2).sum(axis=1).max()))

    @property
    def fastest(self) -> float:
        """Speed at which the motion counts as runaway [m/s]."""
        return _RUNAWAY * self._smallest / (self.state.stride * self.step)

    def run_to_rest(self, unbalanced: float = 1e-3, stress: float = 1e-2, most: int = 200_000) -> int:
        """Take steps until the grains are at rest and walls press with their stresses; returns how many.

        Parameters
        ----------
        unbalanced : float
            Bound on the mean resultant on a grain, relative to the mean contact force.
        stress : float
            Bound on the distance of each pressing wall's stress from its target, relative to it.
        most : int
            Steps after which to give up.

        Raises
        ------
        ComputationError
            If there is no rest by then; for a wall that does not reach its stress, with what it reached.
        """
        begin = self.steps
        while self.steps - begin < most:
            self.run(min(100, most - (self.steps - begin)))
            if self.unbalanced <= unbalanced and not self._short_of_stress(stress):
                return self.steps - begin
        short = self._short_of_stress(stress)
        if short:
            walls = self.wall_stress
            raise ComputationError(
                f"after {most} steps wall {short} presses with {walls[short]:.4g} Pa, not the "
                f"{self.plates[short].stress:.4g} Pa asked: are there grains before it that can bear that, and can it "
                f"reach them at its top speed of {self.plates[short].top_speed:.3g} m/s?"
            )
        raise ComputationError(
            f"after {most} steps the grains are not at rest: the unbalanced force is {self.unbalanced:.2g} of the mean "
            f"contact force, {unbalanced:.2g} asked. Damping, or friction, is what brings them to rest"
        )

    def _short_of_stress(self, tolerance: float) -> str | None:
        """A wall that presses with less or more than it should, by more than a part `tolerance`."""
        walls = self.wall_stress
        for name, plate in self.plates.items():
            if plate.stress is not None and abs(walls[name] - plate.stress) > tolerance * plate.stress:
                return name
        return None

    def _fail(self) -> None:
        state = self.state
        speed = np.sqrt((state.grains.motion[:, 4:7] ** 2).sum(axis=1))
        worst = int(np.argmax(np.where(np.isfinite(speed), speed, np.inf)))
        if np.isinf(speed[worst]):
            raise ComputationError(
                f"grain {state.order[worst]} has left the box at step {state.steps}: its centre has passed a wall. "
                "Walls yield like grains, k = E r: a larger young, a slower wall or less load keeps them apart"
            )
        raise ComputationError(
            f"the motion runs away at step {state.steps}: grain {state.order[worst]} moves at {speed[worst]:.3g} m/s, "
            f"over {_RUNAWAY} of the smallest radius in one step. A start with deep overlaps, a wall that is too fast "
            "or forces applied from outside that grow do this; so does a step near the critical one. Grains that are "
            "fast for their stiffness need a larger young, or a smaller step"
            + (f". This step is {state.stride} steps long: a smaller stride may do" if state.stride > 1 else "")
        )

    def apply(self, forces: np.ndarray) -> None:
        """Forces on the grains from outside, (n, 3) by id, until changed [N]."""
        forces = np.asarray(forces, float)
        if forces.shape != (len(self), 3) or not np.isfinite(forces).all():
            raise InputError(f"forces must be ({len(self)}, 3) finite numbers, one row per grain")
        self.state.applied = np.ascontiguousarray(forces[self.state.order])

    @property
    def applied(self) -> np.ndarray:
        """(n, 3): force on each grain from outside, by id, kept until changed [N]."""
        return self.state.applied[self.state.rank]

    # ---- what there is ------------------------------------------------------------------------------------------

    def __len__(self) -> int:
        return len(self.state)

    @property
    def steps(self) -> int:
        """Steps taken."""
        return self.state.steps

    @property
    def time(self) -> float:
        """t [s]."""
        return self.state.time

    @property
    def places(self) -> np.ndarray:
        """(6,): coordinate of each wall along its axis [m]."""
        return self.state.walls.places

    @property
    def presses(self) -> bool:
        """Whether a wall presses with a given stress."""
        return not np.isnan(self.state.walls.targets).all()

    @property
    def last_step(self) -> float:
        """Length of the last step: `step`, or several of it where grains and fluid took a long one [s]."""
        return self.state.stride * self.step

    @property
    def wall_velocities(self) -> np.ndarray:
        """(6, 3): velocities of the walls over the last step [m/s]."""
        return self.state.walls.velocities

    @property
    def positions(self) -> np.ndarray:
        """(n, 3): centres at time t [m]."""
        return self.state.grains.motion[self.state.rank, :3]

    @property
    def rows(self) -> np.ndarray:
        """(n,): row of each grain in the arrays of `predict` and `correct`."""
        return self.state.rank

    @property
    def radii(self) -> np.ndarray:
        """(n,): radii [m]."""
        return self.state.grains.motion[self.state.rank, 3]

    @property
    def velocities(self) -> np.ndarray:
        """(n, 3): velocities at time t - dt/2 [m/s]."""
        return self.state.grains.motion[self.state.rank, 4:7]

    @velocities.setter
    def velocities(self, values: np.ndarray) -> None:
        self.state.grains.motion[:, 4:7] = np.broadcast_to(values, (len(self), 3))[self.state.order]

    @property
    def spins(self) -> np.ndarray:
        """(n, 3): angular velocities at time t - dt/2 [rad/s]."""
        return self.state.grains.motion[self.state.rank, 7:10]

    @spins.setter
    def spins(self, values: np.ndarray) -> None:
        self.state.grains.motion[:, 7:10] = np.broadcast_to(values, (len(self), 3))[self.state.order]

    @property
    def masses(self) -> np.ndarray:
        """(n,): masses [kg]."""
        return 1.0 / self.state.grains.inverse_mass[self.state.rank]

    @property
    def box(self) -> Box:
        """The box that the walls make now."""
        return Box.between(self.places.copy())

    @property
    def packing(self) -> Packing:
        """The grains where they are now, in their box."""
        return Packing(self.positions, self.radii, self.box)

    @property
    def porosity(self) -> float:
        """1 - Σ 4/3 π r³ / V: overlaps count twice, as they weigh."""
        return 1.0 - float(sphere_volumes(self.state.grains.motion[:, 3]).sum()) / self.box.volume

    @property
    def contacts(self) -> Contacts:
        """Contacts between grains, and then between grains and walls."""
        return Contacts.of(self.state)

    @property
    def coordination(self) -> float:
        """Mean number of contacts of a grain, with grains and walls."""
        grains = self.contacts.grains
        return float(np.count_nonzero(grains < len(self)) / len(self))

    @property
    def stress(self) -> np.ndarray:
        """(3, 3): mean stress of the grains, Σ f ⊗ (branch) / V over contacts, positive in compression [Pa]."""
        contacts = self.contacts
        x = self.positions
        i, j = contacts.grains.T
        ends = np.where((j < len(self))[:, None], x[np.minimum(j, len(self) - 1)], contacts.points)
        return -np.einsum("ca,cb->ab", contacts.forces, ends - x[i]) / self.box.volume

    @property
    def wall_forces(self) -> np.ndarray:
        """(6, 3): force of the grains on each wall [N]."""
        contacts = self.contacts
        forces = np.zeros((6, 3))
        walled = contacts.grains[:, 1] >= len(self)
        np.add.at(forces, contacts.grains[walled, 1] - len(self), -contacts.forces[walled])
        return forces

    @property
    def last_wall_forces(self) -> np.ndarray:
        """(6, 3): force of the grains on each wall over the last step, from t - dt to t [N]."""
        return self.state.walls.forces.copy()

    @property
    def wall_stress(self) -> dict[str, float]:
        """Normal stress on each wall, positive in compression [Pa]."""
        thrusts = WALL_SENSES * self.wall_forces[np.arange(6), WALL_AXES]
        return {name: thrust / area for name, thrust, area in zip(WALLS, thrusts, self.box.wall_areas, strict=True)}

    @property
    def unbalanced(self) -> float:
        """Mean resultant force on a grain, relative to the mean contact force."""
        contacts = self.contacts
        if len(contacts) == 0:
            return math.inf
        mean = float(np.sqrt((contacts.forces**2).sum(axis=1)).mean())
        loads = contact_loads(self.state, self._parameters())
        total = loads[:, :3] + self.state.applied + self.gravity / self.state.grains.inverse_mass[:, None]
        return float(np.sqrt((total**2).sum(axis=1)).mean()) / mean

    @property
    def energies(self) -> Energies:
        """Energies at time t."""
        return Energies.of(self.state, self._parameters()._replace(dt=float(self.step)))

    def __repr__(self) -> str:
        return f"DEM({len(self)} grains, {self.steps} steps of {self.step:.3g} s, porosity {self.porosity:.4f})"


def _check_grains(packing: Packing) -> None:
    """Grains must have a box, their centres in it, and none of their centres inside another grain."""
    if packing.walled_box is None:
        raise InputError("the packing has no box; give it one: its walls hold the grains")
    outside = (packing.walled_box.wall_distances(packing.centres) <= 0.0).any(axis=1)
    if outside.any():
        grain = int(np.argmax(outside))
        raise InputError(f"grain {grain} has its centre outside the box; move it, or enlarge the box")
    pairs = neighbour_pairs(packing.centres, packing.radii)
    i, j = pairs.T
    depth = packing.radii[i] + packing.radii[j]
    depth = depth - np.sqrt(((packing.centres[i] - packing.centres[j]) ** 2).sum(axis=1))
    deep = depth > np.minimum(packing.radii[i], packing.radii[j])
    if deep.any():
        pair = int(np.argmax(deep))
        raise InputError(
            f"grains {i[pair]} and {j[pair]} overlap by {depth[pair]:.3g} m, more than the smaller's radius: contact "
            "forces would throw them apart. Start from grains apart, or grow them (porefv.dem.grow)"
        )
