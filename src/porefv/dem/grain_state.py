"""GrainState: everything that a DEM holds between two steps, besides its parameters.

The groups of arrays are named tuples: the kernels of `porefv.dem.contacts` and `porefv.dem.motion` take them as they
are. Kernels on disk do not notice that fields of one dtype and shape have changed places here: whoever reorders fields
deletes the `__pycache__` folders.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, NamedTuple

import numpy as np

from porefv.dem.state_files import ArrayOf
from porefv.packing.packing import Packing
from porefv.system.number_checks import must
from porefv.tessellation.ordering import morton_codes


class Grains(NamedTuple):
    """Grains as rigid bodies, in inside numbering.

    Attributes
    ----------
    motion : (n, 10) array
        x y z r, vx vy vz, wx wy wz: centre [m] and radius [m] at time t, velocity [m/s] and spin [rad/s] at t - dt/2.
    inverse_mass : (n,) array
        [1/kg]
    inverse_inertia : (n,) array
        One over 2/5 m r² [1/(kg m²)].
    """

    motion: Annotated[np.ndarray, ArrayOf("f8", ("n", 10))]
    inverse_mass: Annotated[np.ndarray, ArrayOf("f8", ("n",))]
    inverse_inertia: Annotated[np.ndarray, ArrayOf("f8", ("n",))]


class GrainPairs(NamedTuple):
    """Pairs of grains i < j that may touch, sorted by i and then j.

    Attributes
    ----------
    grains : (p, 2) int32 array
        i, j.
    starts : (n + 1,) int64 array
        Pairs of grain i with later ones are starts[i] ... starts[i + 1] - 1.
    others : (p,) int32 array
        j.
    stiffness : (p,) array
        k_n [N/m].
    shear : (p, 3) array
        Tangential force on i, zero unless the pair touches [N].
    touching : (p,) bool array
        Whether the pair touches.
    ranges : (s + 1,) int64 array
        Grain at which each range starts (`porefv.dem.pair_listing`).
    """

    grains: Annotated[np.ndarray, ArrayOf("i4", ("p", 2))]
    starts: Annotated[np.ndarray, ArrayOf("i8", ("n + 1",))]
    others: Annotated[np.ndarray, ArrayOf("i4", ("p",))]
    stiffness: Annotated[np.ndarray, ArrayOf("f8", ("p",))]
    shear: Annotated[np.ndarray, ArrayOf("f8", ("p", 3))]
    touching: Annotated[np.ndarray, ArrayOf("?", ("p",))]
    ranges: Annotated[np.ndarray, ArrayOf("i8", ("s + 1",))]


class WallPairs(NamedTuple):
    """Pairs of a grain and a wall that may touch, sorted by grain and then wall.

    Attributes
    ----------
    members : (k, 2) int32 array
        Grain, wall.
    stiffness : (k,) array
        k_n [N/m].
    shear : (k, 3) array
        Tangential force on the grain, zero unless the pair touches [N].
    touching : (k,) bool array
        Whether the pair touches.
    ranges : (s + 1,) int64 array
        Pair at which the range of each thread starts.
    """

    members: Annotated[np.ndarray, ArrayOf("i4", ("k", 2))]
    stiffness: Annotated[np.ndarray, ArrayOf("f8", ("k",))]
    shear: Annotated[np.ndarray, ArrayOf("f8", ("k", 3))]
    touching: Annotated[np.ndarray, ArrayOf("?", ("k",))]
    ranges: Annotated[np.ndarray, ArrayOf("i8", ("s + 1",))]


class MovingWalls(NamedTuple):
    """The six walls, in the order of `porefv.WALLS`.

    Attributes
    ----------
    places : (6,) array
        Coordinate of each along its axis [m].
    velocities : (6, 3) array
        Over the last step [m/s].
    targets : (6,) array
        Stress that a wall presses with, NaN for walls whose velocity is given [Pa].
    top_speeds : (6,) array
        Of walls that press, zero for the others [m/s].
    friction : (6,) array
        tan φ.
    forces : (6, 3) array
        Of the grains on each wall over the last step [N].
    yields : (6,) array
        What a force over the step adds to the outward velocity of a wall that presses, zero for the others [m/(s N)].
    """

    places: Annotated[np.ndarray, ArrayOf("f8", (6,))]
    velocities: Annotated[np.ndarray, ArrayOf("f8", (6, 3))]
    targets: Annotated[np.ndarray, ArrayOf("f8", (6,))]
    top_speeds: Annotated[np.ndarray, ArrayOf("f8", (6,))]
    friction: Annotated[np.ndarray, ArrayOf("f8", (6,))]
    forces: Annotated[np.ndarray, ArrayOf("f8", (6, 3))]
    yields: Annotated[np.ndarray, ArrayOf("f8", (6,))]


class Listing(NamedTuple):
    """Where grains and walls were when the pairs that may touch were listed, and for how long the lists hold.

    Attributes
    ----------
    centres : (n, 3) array
        [m]
    walls : (6,) array
        [m]
    slack : float
        How much nearer the members of a pair may have come since [m].
    """

    centres: Annotated[np.ndarray, ArrayOf("f8", ("n", 3))]
    walls: Annotated[np.ndarray, ArrayOf("f8", (6,))]
    slack: float


@dataclass
class GrainState:
    """Everything that a DEM holds between two steps, besides its parameters.

    Sizes: n grains, p pairs of grains, k pairs of a grain and a wall, s ranges. Inside, grains are numbered along a
    space-filling curve: near in space, near in memory.

    Attributes
    ----------
    order : (n,) int64 array
        Id of each grain in inside numbering.
    rank : (n,) int64 array
        Number inside of the grain of each id.
    grains : Grains
    applied : (n, 3) array
        Force on each grain from outside, in inside numbering [N].
    pairs : GrainPairs
    wall_pairs : WallPairs
    walls : MovingWalls
    listing : Listing
    work : (3,) array
        Since the start: dissipated by sliding, put in by walls, taken by damping [J].
    applied_work : float
        Put in by applied forces since the start [J].
    steps : int
        Taken since the start.
    time : float
        t [s].
    stride : int
        Length of the last step, in steps: more than 1 where grains and fluid have taken a long one.
    """

    order: Annotated[np.ndarray, ArrayOf("i8", ("n",))]
    rank: Annotated[np.ndarray, ArrayOf("i8", ("n",))]
    grains: Grains
    applied: Annotated[np.ndarray, ArrayOf("f8", ("n", 3))]
    pairs: GrainPairs
    wall_pairs: WallPairs
    walls: MovingWalls
    listing: Listing
    work: Annotated[np.ndarray, ArrayOf("f8", (3,))]
    applied_work: float
    steps: int
    time: float
    stride: int

    @classmethod
    def of(cls, packing: Packing) -> GrainState:
        """Grains at rest at time 0, in the box of a packing; masses, stiffnesses and pairs are still to be found."""
        assert packing.walled_box is not None  # a DEM has seen to it
        n = len(packing)
        order = np.argsort(morton_codes(np.asarray(packing.centres)), kind="stable")
        rank = np.empty(n, np.int64)
        rank[order] = np.arange(n)
        motion = np.zeros((n, 10))
        motion[:, :3] = packing.centres[order]
        motion[:, 3] = packing.radii[order]
        places = packing.walled_box.wall_places
        none, nothing, not_one = np.zeros((0, 2), np.int32), np.zeros(0), np.zeros(0, bool)
        return cls(
            order=order,
            rank=rank,
            grains=Grains(motion, np.zeros(n), np.zeros(n)),
            applied=np.zeros((n, 3)),
            pairs=GrainPairs(
                none, np.zeros(n + 1, np.int64), none[:, 0].copy(), nothing, np.zeros((0, 3)), not_one,
                np.zeros(2, np.int64),
            ),
            wall_pairs=WallPairs(none, nothing, np.zeros((0, 3)), not_one, np.zeros(2, np.int64)),
            walls=MovingWalls(
                places, np.zeros((6, 3)), np.full(6, np.nan), np.zeros(6), np.zeros(6), np.zeros((6, 3)), np.zeros(6)
            ),
            listing=Listing(motion[:, :3].copy(), places.copy(), 0.0),
            work=np.zeros(3),
            applied_work=0.0,
            steps=0,
            time=0.0,
            stride=1,
        )  # fmt: skip

    def __len__(self) -> int:
        return len(self.order)

    def check(self) -> None:
        """Raise ValueError unless kernels can take the state: no index leads out of an array, and numbers are finite.

        Dtypes and shapes are those of the fields. Ranges are not looked at: whoever loads a state makes them anew.
        """
        n, motion, pairs, members = len(self), self.grains.motion, self.pairs, self.wall_pairs.members
        everyone = np.arange(n)
        must(n > 0, "there are no grains")
        must(np.array_equal(np.sort(self.order), everyone), "order is no numbering of the grains")
        must(np.array_equal(self.rank[self.order], everyone), "rank is not the inverse of order")
        i, j = pairs.grains.T.astype(np.int64)
        must(bool(((i >= 0) & (i < j) & (j < n)).all()), "pairs_grains are not pairs of two grains")
        must(bool((np.diff(i * n + j) > 0).all()), "pairs_grains are not sorted")
        must(np.array_equal(pairs.starts, np.searchsorted(i, np.arange(n + 1))), "pairs_starts are not those of pairs")
        must(np.array_equal(pairs.others, j), "pairs_others are not those of pairs")
        grain, wall = members.T.astype(np.int64)
        inside = (grain >= 0) & (grain < n) & (wall >= 0) & (wall < 6)
        must(bool(inside.all()), "wall_pairs_members are not pairs of a grain and a wall")
        must(bool((np.diff(grain * 6 + wall) > 0).all()), "wall_pairs_members are not sorted")
        for name, numbers in (
            ("grains_motion", motion), ("grains_inverse_mass", self.grains.inverse_mass),
            ("grains_inverse_inertia", self.grains.inverse_inertia), ("applied", self.applied),
            ("pairs_stiffness", pairs.stiffness), ("pairs_shear", pairs.shear),
            ("wall_pairs_stiffness", self.wall_pairs.stiffness), ("wall_pairs_shear", self.wall_pairs.shear),
            ("walls_places", self.walls.places), ("walls_velocities", self.walls.velocities),
            ("walls_top_speeds", self.walls.top_speeds), ("walls_friction", self.walls.friction),
            ("walls_forces", self.walls.forces), ("walls_yields", self.walls.yields),
            ("listing_centres", self.listing.centres), ("listing_walls", self.listing.walls),
            ("listing_slack", self.listing.slack), ("work", self.work), ("applied_work", self.applied_work),
            ("time", self.time),
        ):  # fmt: skip
            must(bool(np.isfinite(numbers).all()), f"{name} is not finite")
        must(bool((motion[:, 3] > 0.0).all()), "grains_motion has a radius that is not positive")
        must(bool((self.walls.places[::2] < self.walls.places[1::2]).all()), "walls_places make no box")
        must(0.0 <= self.listing.slack <= motion[:, 3].min(), "listing_slack is not within a radius")
        must(self.steps >= 0, "steps are negative")
        must(self.stride >= 1, "stride is not positive")
