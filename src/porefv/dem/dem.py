"""DEM: grains that move under contact forces, gravity and whatever is applied to them (C14 §2.1)."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

import numpy as np
from numba import get_num_threads

from porefv.dem.contacts import grain_contacts, wall_contacts
from porefv.dem.material import Material
from porefv.dem.measurements import Contacts, Energies
from porefv.dem.motion import CROWDED, FORCES, MOTION, RUNAWAY, WHOLE, advance, wall_excess
from porefv.dem.plate import Plate
from porefv.errors import ComputationError, InputError
from porefv.packing.box import WALL_AXES, WALL_NORMALS, WALL_SENSES, WALLS, Box
from porefv.packing.neighbours import neighbour_pairs
from porefv.packing.packing import Packing
from porefv.system.kernels import njit
from porefv.system.number_checks import check_number
from porefv.system.threads import threads
from porefv.tessellation.ordering import morton_codes

# The step, as a part of the critical one √(m/k): motion was stable to 0.85 of it or more in a dense packing, whatever
# its friction (benchmarks/dem.py).
SAFETY = 0.5
# A grain that covers more than this part of the smallest radius in one step has passed others unseen.
_RUNAWAY = 0.1
# Part of the way to balance, by the stiffness of its contacts, that a pressing wall moves in one step.
_GAIN = 0.8
# Part of the smallest radius that grains may come closer before pairs are listed anew.
_SKIN = 0.2


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
    threads : int, optional
        Threads to share the work between; results depend on it by rounding. All of numba's by default, as far as
        there are 1000 grains for each.

    Attributes
    ----------
    applied : (n, 3) array
        Force on each grain from outside, by id, kept until changed [N].
    steps : int
        Steps taken.

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
        threads: int | None = None,
    ):
        self.material = material if material is not None else Material()
        self.gravity = np.array(gravity, float)
        if self.gravity.shape != (3,) or not np.isfinite(self.gravity).all():
            raise InputError(f"gravity must be three finite numbers in m/s², not {gravity!r}")
        check_number(damping, "damping", "a number in [0, 1)", lambda x: 0.0 <= x < 1.0)
        self.damping = float(damping)
        _check_grains(packing)
        assert packing.box is not None  # _check_grains has seen to it
        n = len(packing)
        most = get_num_threads() if threads is None else threads
        if not (isinstance(most, int) and most >= 1):
            raise InputError(f"threads must be a whole number, 1 or more, not {threads!r}")
        self.threads = most if threads is not None else max(1, min(most, n // 1000))

        # Inside, grains are numbered along a space-filling curve: near in space, near in memory.
        self._order = np.argsort(morton_codes(np.asarray(packing.centres)), kind="stable")
        self._rank = np.empty(n, np.int64)
        self._rank[self._order] = np.arange(n)
        self._state = np.zeros((n, 10))
        self._state[:, :3] = packing.centres[self._order]
        self._state[:, 3] = packing.radii[self._order]
        self._applied = np.zeros((n, 3))
        self.places = packing.box.wall_places
        self.wall_velocities = np.zeros((6, 3))
        self._wall_forces, self._wall_yields = np.zeros((6, 3)), np.zeros(6)
        self._pairs, self._others = np.empty((0, 2), np.int32), np.empty(0, np.int32)
        self._shear, self._touching = np.empty((0, 3)), np.empty(0, bool)
        self._wall_pairs = np.empty((0, 2), np.int32)
        self._wall_pair_shear, self._wall_pair_touching = np.empty((0, 3)), np.empty(0, bool)
        self._work = np.zeros(3)
        self._applied_work = 0.0
        self._loads = np.zeros((self.threads, n, 6))
        self._wall_loads = np.zeros((self.threads, 6, 4))
        self._halfway = False
        self.steps = 0
        self.time = 0.0
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

    # ---- set-up -------------------------------------------------------------------------------------------------

    def set_plates(self, plates: Mapping[str, Plate]) -> None:
        """Change what walls do; walls that are not named stand still."""
        unknown = set(plates) - set(WALLS)
        if unknown:
            raise InputError(f"unknown wall {sorted(unknown)[0]!r}; known: {', '.join(WALLS)}")
        self.plates = {name: plates.get(name, Plate()) for name in WALLS}
        self.wall_velocities[:] = [plate.velocity for plate in self.plates.values()]
        self._targets = np.array([np.nan if p.stress is None else p.stress for p in self.plates.values()])
        self._top_speeds = np.array([p.top_speed or 0.0 for p in self.plates.values()])
        self._wall_friction = np.array([math.tan(math.radians(p.friction_angle)) for p in self.plates.values()])

    def set_material(self, material: Material) -> None:
        """Change what the grains are made of, for instance their friction once a packing has its density."""
        # √(m/k) goes with √(ρ/E), whatever the grains.
        change = math.sqrt(material.density / material.young * self.material.young / self.material.density)
        critical = change * self.critical_step
        if self.step >= critical:
            raise InputError(f"the step of {self.step:.4g} s is above this material's critical one, {critical:.4g} s")
        self.material = material
        self._measure_grains()
        self._stiffness = _pair_stiffness(material.young, self._pairs, self._state)
        self._wall_pair_stiffness = material.young * self._state[self._wall_pairs[:, 0], 3]

    def scale_radii(self, factor: float) -> None:
        """Grow or shrink all grains about their centres; the step keeps its part of the critical one."""
        check_number(factor, "factor", "a positive number", lambda x: x > 0.0)
        part = self.step / self.critical_step
        self._state[:, 3] *= factor
        self._measure_grains()
        self.step = part * self.critical_step
        self.list_pairs()

    def _measure_grains(self) -> None:
        r = self._state[:, 3]
        mass = 4.0 / 3.0 * np.pi * r**3 * self.material.density
        self._inverse_mass = 1.0 / mass
        self._inverse_inertia = 1.0 / (0.4 * mass * r**2)

    @property
    def critical_step(self) -> float:
        """Least √(m/k) of a grain and the stiffest contact it may have, with the largest grain [s]."""
        r = self._state[:, 3]
        stiffest = 2.0 * self.material.young * r * r.max() / (r + r.max())
        return float(np.sqrt(1.0 / (self._inverse_mass * stiffest)).min())

    def list_pairs(self) -> None:
        """List the pairs that may touch before any grain has moved by half the skin, and keep what contacts hold."""
        x, r = np.ascontiguousarray(self._state[:, :3]), np.ascontiguousarray(self._state[:, 3])
        skin = _SKIN * float(r.min())
        pairs = neighbour_pairs(x, r, skin)
        shear, touching = np.zeros((len(pairs), 3)), np.zeros(len(pairs), bool)
        _carry(self._pairs, self._shear, self._touching, pairs, shear, touching)
        near = np.stack([x - self.places[0::2] < r[:, None] + skin, self.places[1::2] - x < r[:, None] + skin], axis=2)
        wall_pairs = np.ascontiguousarray(np.argwhere(near.reshape(-1, 6)), dtype=np.int32)
        wall_shear, wall_touching = np.zeros((len(wall_pairs), 3)), np.zeros(len(wall_pairs), bool)
        _carry(
            self._wall_pairs, self._wall_pair_shear, self._wall_pair_touching, wall_pairs, wall_shear, wall_touching
        )  # fmt: skip
        self._pairs, self._shear, self._touching = pairs, shear, touching
        self._wall_pairs, self._wall_pair_shear, self._wall_pair_touching = wall_pairs, wall_shear, wall_touching
        self._stiffness = _pair_stiffness(self.material.young, pairs, self._state)
        self._wall_pair_stiffness = self.material.young * r[wall_pairs[:, 0]]
        # Pairs of each grain with later ones, in a row; for each thread a range of grains with about as many pairs.
        self._starts = np.searchsorted(pairs[:, 0], np.arange(len(self) + 1))
        self._others = np.ascontiguousarray(pairs[:, 1])
        self._grain_ranges = np.searchsorted(self._starts, np.linspace(0, len(pairs), self.threads + 1))
        self._grain_ranges[-1] = len(self)
        self._wall_pair_ranges = np.linspace(0, len(wall_pairs), self.threads + 1).astype(np.int64)
        self._start, self._wall_start = x, self.places.copy()
        self._slack = skin

    # ---- motion -------------------------------------------------------------------------------------------------

    def run(self, steps: int) -> None:
        """Take so many steps.

        Raises
        ------
        ComputationError
            If the motion runs away: a grain crosses a tenth of the smallest radius in one step, or is nowhere.
        """
        if self._halfway:
            raise InputError("a step is half taken: finish it with `correct` before the next")
        before = self._state[:, :3].copy() if self._applied.any() else None
        done = 0
        while done < steps:
            done += self._advance(WHOLE, steps - done, self._applied, np.zeros(6))
        if before is not None:
            self._applied_work += float((self._applied * (self._state[:, :3] - before)).sum())

    def predict(self) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """Take the first half of a step: contact forces, but no motion; `correct` takes the other.

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
        if not self._halfway:
            self._advance(FORCES, 1, self._applied, np.zeros(6))
            self._halfway = True
        mobilities = self.step * self._inverse_mass
        velocities = _free_velocities(self._state, self._loads, self._applied, mobilities, self.step * self.gravity)
        speeds = self.wall_velocities[np.arange(6), WALL_AXES] * WALL_SENSES
        for w in np.flatnonzero(~np.isnan(self._targets)):
            speeds[w] = self._wall_yields[w] * wall_excess(w, self.places, self._targets, self._wall_forces)
        return velocities, speeds, mobilities, self._wall_yields

    def correct(self, forces: np.ndarray, thrusts: np.ndarray) -> None:
        """Take the second half of a step, after `predict`, under forces on grains and walls besides all others.

        Parameters
        ----------
        forces : (n, 3) array
            On grain i in row `rows[i]`, over this step alone [N].
        thrusts : (6,) array
            On the walls, along their outward normals [N].
        """
        if not self._halfway:
            raise InputError("`correct` ends a step that `predict` has begun")
        self._halfway = False
        self._advance(MOTION, 1, self._applied + forces, np.asarray(thrusts, float))
        self._applied_work += self.step * float(np.vdot(self._applied + forces, self._state[:, 4:7]))

    def _advance(self, half: int, steps: int, applied: np.ndarray, thrusts: np.ndarray) -> int:
        """Take steps until pairs must be listed anew; returns how many."""
        with threads(self.threads):
            taken, reason = advance(
                steps, half, self.step, self._state, self._inverse_mass, self._inverse_inertia, applied,
                self.gravity, self.damping,
                self._starts, self._others, self._stiffness, self._shear, self._touching, self._grain_ranges,
                self._wall_pairs, self._wall_pair_stiffness, self._wall_pair_shear, self._wall_pair_touching,
                self._wall_pair_ranges,
                self.material.stiffness_ratio, self.material.friction, self._wall_friction,
                self.places, self.wall_velocities, self._targets, self._top_speeds, _GAIN, self._wall_yields, thrusts,
                self._loads, self._wall_loads, self._wall_forces, self._start, self._wall_start, self._slack,
                self.fastest, self._work,
            )  # fmt: skip
        self.steps += taken
        self.time += taken * self.step
        if reason == RUNAWAY:
            self._fail()
        if reason == CROWDED:
            self.list_pairs()
        return taken

    @property
    def moved_since_listing(self) -> float:
        """Largest distance that a grain has moved since the pairs that may touch were listed [m]."""
        return float(np.sqrt(((self._state[:, :3] - self._start) ** 2).sum(axis=1).max()))

    @property
    def fastest(self) -> float:
        """Speed at which the motion counts as runaway [m/s]."""
        return _RUNAWAY * float(self._state[:, 3].min()) / self.step

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
        speed = np.sqrt((self._state[:, 4:7] ** 2).sum(axis=1))
        worst = int(np.argmax(np.where(np.isfinite(speed), speed, np.inf)))
        if np.isinf(speed[worst]):
            raise ComputationError(
                f"grain {self._order[worst]} has left the box at step {self.steps}: its centre has passed a wall. "
                "Walls yield like grains, k = E r: a larger young, a slower wall or less load keeps them apart"
            )
        raise ComputationError(
            f"the motion runs away at step {self.steps}: grain {self._order[worst]} moves at {speed[worst]:.3g} m/s, "
            f"over {_RUNAWAY} of the smallest radius in one step. A start with deep overlaps, a wall that is too fast "
            "or forces applied from outside that grow do this; so does a step near the critical one. Grains that are "
            "fast for their stiffness need a larger young, or a smaller step"
        )

    def apply(self, forces: np.ndarray) -> None:
        """Forces on the grains from outside, (n, 3) by id, until changed [N]."""
        forces = np.asarray(forces, float)
        if forces.shape != (len(self), 3) or not np.isfinite(forces).all():
            raise InputError(f"forces must be ({len(self)}, 3) finite numbers, one row per grain")
        self._applied = np.ascontiguousarray(forces[self._order])

    @property
    def applied(self) -> np.ndarray:
        return self._applied[self._rank]

    # ---- what there is ------------------------------------------------------------------------------------------

    def __len__(self) -> int:
        return len(self._state)

    @property
    def positions(self) -> np.ndarray:
        """(n, 3): centres at time t [m]."""
        return self._state[self._rank, :3]

    @property
    def rows(self) -> np.ndarray:
        """(n,): row of each grain in the arrays of `predict` and `correct`."""
        return self._rank

    @property
    def radii(self) -> np.ndarray:
        """(n,): radii [m]."""
        return self._state[self._rank, 3]

    @property
    def velocities(self) -> np.ndarray:
        """(n, 3): velocities at time t - dt/2 [m/s]."""
        return self._state[self._rank, 4:7]

    @velocities.setter
    def velocities(self, values: np.ndarray) -> None:
        self._state[:, 4:7] = np.broadcast_to(values, (len(self), 3))[self._order]

    @property
    def spins(self) -> np.ndarray:
        """(n, 3): angular velocities at time t - dt/2 [rad/s]."""
        return self._state[self._rank, 7:10]

    @spins.setter
    def spins(self, values: np.ndarray) -> None:
        self._state[:, 7:10] = np.broadcast_to(values, (len(self), 3))[self._order]

    @property
    def masses(self) -> np.ndarray:
        """(n,): masses [kg]."""
        return 1.0 / self._inverse_mass[self._rank]

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
        return 1.0 - float((4.0 / 3.0 * np.pi * self._state[:, 3] ** 3).sum()) / self.box.volume

    @property
    def contacts(self) -> Contacts:
        """Contacts between grains, and then between grains and walls."""
        x, r = self._state[:, :3], self._state[:, 3]
        held = np.flatnonzero(self._overlaps() > 0.0)
        i, j = self._pairs[held].T
        branch = x[j] - x[i]
        distance = np.sqrt((branch**2).sum(axis=1))
        normals = branch / distance[:, None]
        overlaps = r[i] + r[j] - distance
        forces = _across(self._shear[held], normals) - (self._stiffness[held] * overlaps)[:, None] * normals
        points = x[i] + (r[i] - 0.5 * overlaps)[:, None] * normals

        walled = np.flatnonzero(self._wall_pair_overlaps() > 0.0)
        k, w = self._wall_pairs[walled].T
        wall_normals = WALL_NORMALS[w]
        wall_overlaps = self._wall_pair_overlaps()[walled]
        wall_forces = _across(self._wall_pair_shear[walled], wall_normals)
        wall_forces -= (self._wall_pair_stiffness[walled] * wall_overlaps)[:, None] * wall_normals
        wall_points = x[k] + (r[k] - wall_overlaps)[:, None] * wall_normals
        return Contacts(
            np.concatenate(
                [self._order[self._pairs[held]], np.stack([self._order[k], len(self) + w.astype(np.int64)], axis=1)]
            ),
            np.concatenate([normals, wall_normals]),
            np.concatenate([points, wall_points]),
            np.concatenate([forces, wall_forces]),
            np.concatenate([overlaps, wall_overlaps]),
        )

    def _overlaps(self) -> np.ndarray:
        x, r = self._state[:, :3], self._state[:, 3]
        i, j = self._pairs.T
        return r[i] + r[j] - np.sqrt(((x[j] - x[i]) ** 2).sum(axis=1))

    def _wall_pair_overlaps(self) -> np.ndarray:
        k, w = self._wall_pairs.T
        return self._state[k, 3] - WALL_SENSES[w] * (self.places[w] - self._state[k, WALL_AXES[w]])

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
        return self._wall_forces.copy()

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
        loads = self._forces()
        total = loads[:, :3] + self._applied + self.gravity / self._inverse_mass[:, None]
        return float(np.sqrt((total**2).sum(axis=1)).mean()) / mean

    @property
    def energies(self) -> Energies:
        """Energies at time t."""
        s = self._state
        loads = self._forces()
        accelerations = (loads[:, :3] + self._applied) * self._inverse_mass[:, None] + self.gravity
        turns = loads[:, 3:] * self._inverse_inertia[:, None]
        v, w = s[:, 4:7], s[:, 7:10]
        kinetic = 0.5 * ((v * (v + self.step * accelerations)).sum(axis=1) / self._inverse_mass).sum()
        kinetic += 0.5 * ((w * (w + self.step * turns)).sum(axis=1) / self._inverse_inertia).sum()
        elastic = 0.0
        for overlaps, shear, stiffness in (
            (self._overlaps(), self._shear, self._stiffness),
            (self._wall_pair_overlaps(), self._wall_pair_shear, self._wall_pair_stiffness),
        ):
            elastic += 0.5 * float((stiffness * np.maximum(overlaps, 0.0) ** 2).sum())
            if self.material.stiffness_ratio > 0.0:
                tangential = self.material.stiffness_ratio * stiffness
                elastic += 0.5 * float(((shear**2).sum(axis=1) / tangential)[overlaps > 0.0].sum())
        potential = -float(((s[:, :3] @ self.gravity) / self._inverse_mass).sum())
        sliding, walls, damped = self._work
        return Energies(float(kinetic), elastic, potential, sliding, damped, walls, self._applied_work)

    def _forces(self) -> np.ndarray:
        """Contact loads on grains (n, 6), inside numbering; tangential forces as they stand."""
        loads = np.zeros((len(self), 6))
        grain_contacts(
            0, len(self), self._state, self._starts, self._others, self._stiffness, self.material.stiffness_ratio,
            self.material.friction, 0.0, self._shear.copy(), self._touching.copy(), loads,
        )  # fmt: skip
        wall_contacts(
            0, len(self._wall_pairs), self._state, self._wall_pairs, self._wall_pair_stiffness,
            self.material.stiffness_ratio, self._wall_friction, 0.0, self.places, self.wall_velocities,
            self._wall_pair_shear.copy(), self._wall_pair_touching.copy(), loads, np.zeros((6, 4)),
        )  # fmt: skip
        return loads

    def __repr__(self) -> str:
        return f"DEM({len(self)} grains, {self.steps} steps of {self.step:.3g} s, porosity {self.porosity:.4f})"


def _across(vectors: np.ndarray, normals: np.ndarray) -> np.ndarray:
    """Tangential forces, known in the plane of a step ago, in the plane of now."""
    return vectors - (vectors * normals).sum(axis=1)[:, None] * normals


def _check_grains(packing: Packing) -> None:
    """Grains must have a box, their centres in it, and none of their centres inside another grain."""
    if packing.box is None:
        raise InputError("the packing has no box; give it one: its walls hold the grains")
    outside = ((packing.centres <= packing.box.lower) | (packing.centres >= packing.box.upper)).any(axis=1)
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


@njit(cache=True)
def _free_velocities(state, loads, applied, mobilities, fall):
    """Velocities after a step under the loads there are; `fall` is what gravity adds."""
    velocities = np.empty((state.shape[0], 3))
    for i in range(state.shape[0]):
        for a in range(3):
            force = applied[i, a]
            for s in range(loads.shape[0]):
                force += loads[s, i, a]
            velocities[i, a] = state[i, 4 + a] + mobilities[i] * force + fall[a]
    return velocities


@njit(cache=True)
def _pair_stiffness(young, pairs, state):
    """k_n = 2 E r_i r_j / (r_i + r_j) of each pair (C14 eq. 10)."""
    stiffness = np.empty(pairs.shape[0])
    for c in range(pairs.shape[0]):
        a = state[pairs[c, 0], 3]
        b = state[pairs[c, 1], 3]
        stiffness[c] = 2.0 * young * a * b / (a + b)
    return stiffness


@njit(cache=True)
def _carry(old_pairs, old_shear, old_touching, pairs, shear, touching):
    """Hand what contacts hold from one sorted list of pairs to another."""
    o = 0
    for c in range(pairs.shape[0]):
        while o < old_pairs.shape[0] and (
            old_pairs[o, 0] < pairs[c, 0] or (old_pairs[o, 0] == pairs[c, 0] and old_pairs[o, 1] < pairs[c, 1])
        ):
            o += 1
        if o < old_pairs.shape[0] and old_pairs[o, 0] == pairs[c, 0] and old_pairs[o, 1] == pairs[c, 1]:
            touching[c] = old_touching[o]
            for a in range(3):
                shear[c, a] = old_shear[o, a]
