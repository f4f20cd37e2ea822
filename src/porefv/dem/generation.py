"""Packings made from nothing: clouds of grains apart, grown until they press, or settled under gravity.

Growth of radii at random places is the procedure of Chareyre et al. (2012, §3.1), after Chareyre, Briançon and
Villard (2002): grains grow from a sparse cloud between rigid walls while friction decides how dense they get; the
radius expansion - friction decrease procedure then lowers friction at constant stress until a porosity is reached.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Protocol

import numpy as np

from porefv.dem.dem import DEM
from porefv.dem.material import Material
from porefv.errors import ComputationError, InputError
from porefv.packing.box import Box
from porefv.packing.packing import Packing
from porefv.system.kernels import njit
from porefv.system.number_checks import is_finite_number

# Porosity of the cloud that growth starts from.
_SPARSE = 0.75
# Places tried in a cloud, for each grain, before it counts as full.
_TRIES = 5000
# Steps between two changes of the radii, and the strain of the fastest growth in one step.
_STRIDE = 50
_FASTEST = 1.0e-4
# Strain of radii, in one stride, per distance from the target stress over E. Packings answer with a stiffness of
# 0.3 to 0.5 E: well below 2 over that, so that stress comes to its target without swinging.
_GAIN = 2.5
# Stress may differ from its target, and from the stress on the walls, by these parts.
_CLOSE, _WALLS_CLOSE = 2.0e-3, 5.0e-3
# Growth to a porosity: strain in one step; stress, over E, beyond which the porosity is out of reach; and below which
# grains are taken to be apart.
_STEADY, _TOO_HARD, _NO_STRESS = 2.0e-5, 1.0e-2, 1.0e-9
# Part of the friction left after a stride of lowering it, and the least tan φ that counts as friction.
_SMOOTHING, _SMOOTH = 0.98, 1.0e-3
# A packing that is not at rest after so many steps will not be.
_MOST_STEPS = 2_000_000


class Sizes(Protocol):
    """A distribution of sizes."""

    def draw(self, n: int, rng: np.random.Generator) -> np.ndarray:
        """(n,): relative radii of n grains, in random order."""


@dataclass(frozen=True)
class UniformSizes:
    """Radii spread evenly, by number, between r_min and r_max.

    Parameters
    ----------
    ratio : float
        r_min / r_max, in (0, 1].

    Examples
    --------
    >>> sorted(UniformSizes(0.5).draw(3, np.random.default_rng(0)).tolist())
    [0.5, 0.75, 1.0]
    """

    ratio: float

    def __post_init__(self) -> None:
        if not (is_finite_number(self.ratio) and 0.0 < self.ratio <= 1.0):
            raise InputError(f"ratio, r_min over r_max, must lie in (0, 1], not {self.ratio!r}")

    def draw(self, n: int, rng: np.random.Generator) -> np.ndarray:
        """(n,): relative radii of n grains, in random order."""
        return rng.permutation(np.linspace(self.ratio, 1.0, n))


@dataclass(frozen=True)
class Grading:
    """Sizes from a grading curve: what part of the mass passes each sieve.

    Between two sieves the curve is straight over the logarithm of the diameter, as it is usually drawn; two equal
    diameters hold grains of that one size.

    Parameters
    ----------
    diameters : sequence of float
        Of the sieves, in any unit, none smaller than the one before.
    passing : sequence of float
        Fraction of the mass that passes each: from 0 at the first to 1 at the last, never falling.

    Notes
    -----
    Grains are taken at even steps of the distribution by number: as close to the curve as n grains can come.
    """

    diameters: Sequence[float]
    passing: Sequence[float]

    def __post_init__(self) -> None:
        d, f = self.diameters, self.passing
        if len(d) < 2 or not all(is_finite_number(x) and x > 0.0 for x in d) or list(d) != sorted(d):
            raise InputError(f"diameters must be two or more positive numbers, none below the one before, not {d!r}")
        if len(f) != len(d):
            raise InputError(f"passing must have a fraction for each of the {len(d)} diameters, not {len(f)}")
        if not all(is_finite_number(x) for x in f) or list(f) != sorted(f) or f[0] != 0.0 or f[-1] != 1.0:
            raise InputError(f"passing must rise from 0.0 to 1.0 (fractions of the mass, not per cent), not {f!r}")

    def draw(self, n: int, rng: np.random.Generator) -> np.ndarray:
        """(n,): relative radii of n grains, in random order."""
        d, f = np.array(self.diameters, float), np.array(self.passing, float)
        a, b = d[:-1], d[1:]
        # dm ~ d ln d between sieves, a number ~ dm / d³: its integral is (a⁻³ - b⁻³) / (3 ln b/a), or a⁻³ if a = b.
        one_size = a == b
        width = np.where(one_size, 1.0, 3.0 * np.log(b / np.where(one_size, 0.5 * b, a)))
        numbers = np.diff(f) * np.where(one_size, a**-3, (a**-3 - b**-3) / width)
        ends = np.concatenate([[0.0], np.cumsum(numbers)])
        wanted = (np.arange(n) + 0.5) / n * ends[-1]
        k = np.clip(np.searchsorted(ends, wanted, side="right") - 1, 0, len(a) - 1)
        part = (wanted - ends[k]) / numbers[k]
        diameters = (a[k] ** -3 - part * (a[k] ** -3 - b[k] ** -3)) ** (-1.0 / 3.0)
        return rng.permutation(0.5 * diameters)


@dataclass(frozen=True)
class PackingState:
    """How far the making of a packing has come.

    Attributes
    ----------
    stage : str
        What is being done.
    steps : int
        Steps taken.
    stress : float
        Mean stress [Pa].
    porosity : float
    unbalanced : float
        As `DEM.unbalanced`; infinite without contacts.
    """

    stage: str
    steps: int
    stress: float
    porosity: float
    unbalanced: float


Report = Callable[[PackingState], None]


# ---- a cloud ------------------------------------------------------------------------------------------------------


def cloud(n: int, sizes: Sizes, box: Box, porosity: float, seed: int = 0) -> Packing:
    """Grains apart at random places in a box: random sequential addition, the largest first.

    Parameters
    ----------
    n : int
    sizes : UniformSizes or Grading
        Radii are scaled for the porosity.
    box : Box
    porosity : float
        In (0, 1). Below 0.65 or so, with grains of about one size, there is no room left to be found.
    seed : int
        The same seed gives the same cloud.

    Raises
    ------
    InputError
        If an argument is out of range, or the porosity cannot be reached.
    """
    _check_number(n)
    _check_porosity(porosity)
    rng = np.random.default_rng(_check_seed(seed))
    radii = sizes.draw(n, rng)
    radii = radii * np.cbrt((1.0 - porosity) * box.volume / (4.0 / 3.0 * np.pi * (radii**3).sum()))
    order = np.argsort(-radii, kind="stable")
    if 2.0 * radii.max() >= box.size.min():
        raise InputError(
            f"at porosity {porosity:g} the largest of {n} grains is {2.0 * radii.max():.4g} m wide, and the box "
            f"{box.size.min():.4g} m; ask for more grains, or a higher porosity"
        )
    centres, placed = _place(radii[order], box.size, rng, _TRIES * n)
    if placed < n:
        reached = 1.0 - 4.0 / 3.0 * np.pi * (radii[order][:placed] ** 3).sum() / box.volume
        raise InputError(
            f"a cloud of porosity {porosity:g} cannot be reached by placing grains at random: {placed} of {n} found "
            f"room, at porosity {reached:.3f}; ask for a higher porosity, or let grains grow or settle to it"
        )
    found = np.empty((n, 3))
    found[order] = centres + box.lower
    return Packing(found, radii, box)


def _place(radii: np.ndarray, size: np.ndarray, rng: np.random.Generator, tries: int) -> tuple[np.ndarray, int]:
    """Centres of grains, radii falling, apart in a box from the origin on; and how many found room."""
    # A grid for each factor two of the radius: cells at least as wide as the grains in them, and no more cells than
    # a few for each grain, so that a few fine grains in a large box cost no memory.
    least = float(np.cbrt(np.prod(size) / (8.0 * len(radii))))
    levels = int(math.log2(radii[0] / radii[-1])) + 1
    edges = np.maximum(2.0 * radii[0] * 0.5 ** np.arange(levels), least)
    cells = np.maximum((size / edges[:, None]).astype(np.int64), 1)
    firsts = np.concatenate([[0], np.cumsum(cells.prod(axis=1))])
    level = np.minimum(np.log2(radii[0] / radii).astype(np.int64), levels - 1)
    heads = np.full(firsts[-1], -1, np.int64)
    return _add_in_turn(radii, size, level, cells, firsts, heads, rng, tries)


@njit(cache=True)
def _add_in_turn(radii, size, level, cells, firsts, heads, rng, tries):
    """Random sequential addition. heads: last grain of each cell, -1 if none; chains lead on from there."""
    n = radii.shape[0]
    centres = np.empty((n, 3))
    chain = np.full(n, -1, np.int64)
    x = np.empty(3)
    lowest, highest = np.empty(3, np.int64), np.empty(3, np.int64)
    k = 0
    while k < n and tries > 0:
        tries -= 1
        r = radii[k]
        for a in range(3):
            x[a] = r + (size[a] - 2.0 * r) * rng.random()
        free = True
        for grid in range(level[k] + 1):
            # Grains before this one are larger: their cells in this grid reach as far as they and it.
            for a in range(3):
                here = int(x[a] / size[a] * cells[grid, a])
                lowest[a], highest[a] = max(here - 1, 0), min(here + 1, cells[grid, a] - 1)
            for i in range(lowest[0], highest[0] + 1):
                for j in range(lowest[1], highest[1] + 1):
                    for m in range(lowest[2], highest[2] + 1):
                        other = heads[firsts[grid] + (i * cells[grid, 1] + j) * cells[grid, 2] + m]
                        while other >= 0 and free:
                            square = 0.0
                            for a in range(3):
                                square += (centres[other, a] - x[a]) ** 2
                            free = square >= (r + radii[other]) ** 2
                            other = chain[other]
            if not free:
                break
        if free:
            grid = level[k]
            cell = firsts[grid]
            for a in range(3):
                centres[k, a] = x[a]
            cell += (
                int(x[0] / size[0] * cells[grid, 0]) * cells[grid, 1] + int(x[1] / size[1] * cells[grid, 1])
            ) * cells[grid, 2] + int(x[2] / size[2] * cells[grid, 2])
            chain[k] = heads[cell]
            heads[cell] = k
            k += 1
    return centres, k


# ---- growth -------------------------------------------------------------------------------------------------------


def grow(
    n: int,
    sizes: Sizes,
    box: Box,
    material: Material | None = None,
    *,
    stress: float | None = None,
    porosity: float | None = None,
    seed: int = 0,
    friction_angle: float | None = None,
    damping: float = 0.2,
    unbalanced: float = 1.0e-3,
    report: Report | None = None,
    threads: int | None = None,
) -> DEM:
    """Grains grown at random places between rigid smooth walls, to a mean stress, a porosity, or both.

    To a stress, the friction during growth decides the porosity: the lower, the denser. Given both, friction is
    lowered at constant stress until the porosity is reached, and then given back.

    Parameters
    ----------
    n : int
    sizes : UniformSizes or Grading
    box : Box
    material : Material, optional
        What the grains are of in the end.
    stress : float, optional
        Mean stress, positive in compression [Pa].
    porosity : float, optional
        As `DEM.porosity`, in (0, 1). Alone: grains stop growing there, and press with whatever stress this takes.
    seed : int
        Of the cloud at the start.
    friction_angle : float, optional
        Friction between grains while they grow, the material's by default [degrees].
    damping : float
        Local damping, in (0, 1); the DEM keeps it.
    unbalanced : float
        `DEM.unbalanced` below which the packing counts as at rest.
    report : callable, optional
        Called with a `PackingState` now and then.
    threads : int, optional
        As for `DEM`. The packing is another, as good, for another number of threads.

    Returns
    -------
    DEM
        At rest, loose grains too, to go on with. Its mean stress is within 0.2 % of the target, and of that on the
        walls within 0.5 %.

    Raises
    ------
    InputError
        If an argument is out of range.
    ComputationError
        If the porosity cannot be reached, or the packing does not come to rest.

    Notes
    -----
    Radii are scaled between short runs, by a strain in proportion to the distance from the target stress
    (Chareyre et al., 2002): growth slows down as grains jam, and goes on for as long as they rearrange.
    """
    material = material if material is not None else Material()
    _check_number(n)
    _check_growth(stress, porosity, damping, unbalanced)
    growing = material if friction_angle is None else replace(material, friction_angle=friction_angle)
    start = cloud(n, sizes, box, _SPARSE if porosity is None else max(_SPARSE, porosity), seed)
    dem = DEM(start, growing, damping=damping, threads=threads)
    watch = _Watch(dem, report)
    if stress is None:
        assert porosity is not None  # _check_growth has seen to it
        _fill(dem, porosity, watch)
        _relax(dem, unbalanced, watch)
        if growing != material:
            dem.set_material(material)
            _relax(dem, unbalanced, watch)
        return _stopped(dem)
    _approach(dem, stress, watch)
    _hold(dem, stress, unbalanced, watch)
    if porosity is not None:
        _lower_friction(dem, stress, porosity, watch)
    if dem.material != material:
        dem.set_material(material)
        _hold(dem, stress, unbalanced, watch)
    return _stopped(dem)


class _Watch:
    """Counts strides of a run, tells of them, and ends a run that leads nowhere."""

    def __init__(self, dem: DEM, report: Report | None, most: int = _MOST_STEPS):
        self.dem, self.report, self.most = dem, report, most
        self.strides = 0

    def stride(self, stage: str, steps: int = _STRIDE) -> float:
        """Take some steps; the mean stress after them [Pa]."""
        dem = self.dem
        dem.run(steps)
        self.strides += 1
        stress = mean_stress(dem)
        if self.report is not None and self.strides % 20 == 0:
            self.report(PackingState(stage, dem.steps, stress, dem.porosity, dem.unbalanced))
        if dem.steps > self.most:
            raise ComputationError(
                f"the packing is not at rest after {dem.steps} steps: mean stress {stress:.4g} Pa, porosity "
                f"{dem.porosity:.4f}, unbalanced force {dem.unbalanced:.3g}. More grains, or a higher stress, settle "
                "sooner"
            )
        return stress


def mean_stress(dem: DEM) -> float:
    """A third of the trace of the stress of the grains, positive in compression [Pa]."""
    return float(np.trace(dem.stress)) / 3.0


def _approach(dem: DEM, target: float, watch: _Watch) -> None:
    """Grow fast until grains begin to press, ever slower as what presses is no longer their motion."""
    slow = _GAIN * target / dem.material.young
    strain = _STRIDE * _FASTEST
    while strain > slow:
        while watch.stride("growing") < 0.5 * target:
            dem.scale_radii(1.0 + strain)
        for _ in range(40):
            if watch.stride("growing") < 0.25 * target:
                break
        else:
            return  # it stays: the grains are jammed
        strain *= 0.5


def _hold(dem: DEM, target: float, unbalanced: float, watch: _Watch) -> None:
    """Grow or shrink in proportion to the distance from a stress until that is reached at rest."""
    while True:
        stress = watch.stride("pressing")
        if abs(stress - target) < _CLOSE * target and watch.strides % 4 == 0 and dem.unbalanced < unbalanced:
            walls = np.mean(list(dem.wall_stress.values()))
            if abs(walls - stress) < _WALLS_CLOSE * stress:
                return
        dem.scale_radii(_correction(dem, stress, target))


def _correction(dem: DEM, stress: float, target: float) -> float:
    """The factor for the radii that brings stress nearer to its target."""
    strain = _GAIN * (target - stress) / dem.material.young
    return 1.0 + min(max(strain, -_STRIDE * _FASTEST), _STRIDE * _FASTEST)


def _lower_friction(dem: DEM, target: float, porosity: float, watch: _Watch) -> None:
    """Lower friction at constant stress until a porosity is reached (Chareyre et al., 2002)."""
    if dem.porosity < porosity:
        raise ComputationError(
            f"at {target:.4g} Pa, growth with a friction angle of {dem.material.friction_angle:.3g} degrees gives "
            f"porosity {dem.porosity:.4f}, below the {porosity:g} asked for; grow with more friction "
            "(friction_angle), or ask for less porosity"
        )
    waited = 0
    while dem.porosity > porosity:
        stress = watch.stride("smoothing")
        dem.scale_radii(_correction(dem, stress, target))
        if stress > 0.9 * target:
            # The porosity follows friction only while stress stays what it is to be.
            tangent = _SMOOTHING * dem.material.friction
            smooth = tangent < _SMOOTH
            angle = 0.0 if smooth else math.degrees(math.atan(tangent))
            dem.set_material(replace(dem.material, friction_angle=angle))
            waited = waited + 1 if smooth else 0
        if waited > 1000:
            raise ComputationError(
                f"at {target:.4g} Pa, even without friction the porosity is {dem.porosity:.4f}, above the "
                f"{porosity:g} asked for; ask for more porosity or stress, or for more different sizes"
            )


def _fill(dem: DEM, porosity: float, watch: _Watch) -> None:
    """Grow at a steady rate to a porosity."""
    hard = _TOO_HARD * dem.material.young
    while True:
        left = math.log((1.0 - porosity) / (1.0 - dem.porosity)) / 3.0
        if left <= 0.0:
            return
        dem.scale_radii(math.exp(min(left, _STRIDE * _STEADY)))
        stress = watch.stride("growing")
        if stress > hard:
            raise ComputationError(
                f"porosity {porosity:g} cannot be reached: at {dem.porosity:.4f} grains press with {stress:.3g} Pa, "
                f"over {_TOO_HARD:g} of their modulus; ask for more porosity, or less friction while they grow"
            )
        if left <= _STRIDE * _STEADY:
            return


def _relax(dem: DEM, unbalanced: float, watch: _Watch) -> None:
    """Run until grains are at rest, pressing on each other or apart."""
    while watch.stride("resting") > _NO_STRESS * dem.material.young:
        if watch.strides % 4 == 0 and dem.unbalanced < unbalanced:
            return


def _stopped(dem: DEM) -> DEM:
    """The same without the drift of loose grains: nothing slows those that meet no other."""
    dem.velocities, dem.spins = np.zeros(3), np.zeros(3)
    return dem


# ---- settling -----------------------------------------------------------------------------------------------------


def settle(dem: DEM, *, unbalanced: float = 1.0e-3, report: Report | None = None) -> DEM:
    """Let grains fall under the gravity of a DEM until they are at rest.

    Parameters
    ----------
    dem : DEM
        With gravity and, to come to rest soon, damping.
    unbalanced : float
        `DEM.unbalanced` below which the grains count as at rest, once the kinetic energy of their translation is
        also below a thousandth of what is stored in contacts.
    report : callable, optional
        Called with a `PackingState` now and then.

    Returns
    -------
    DEM
        The same.

    Raises
    ------
    InputError
        Without gravity, or with neither damping nor friction.
    ComputationError
        If the grains do not come to rest.
    """
    pull = float(np.linalg.norm(dem.gravity))
    if pull == 0.0:
        raise InputError("grains settle under gravity; give the DEM one, such as gravity=(0, 0, -9.81)")
    if dem.damping == 0.0 and dem.material.friction == 0.0:
        raise InputError("grains without friction and damping never rest; give the DEM some damping, such as 0.3")
    _check_unbalanced(unbalanced)
    fall = math.sqrt(2.0 * float(np.linalg.norm(dem.box.size)) / pull)
    watch = _Watch(dem, report, dem.steps + _MOST_STEPS // 4 + int(50.0 * fall / dem.step))
    while True:
        watch.stride("settling", 4 * _STRIDE)
        if dem.unbalanced < unbalanced:
            # Spin is left out: nothing slows a grain that spins on a smooth wall and touches no other.
            moving = 0.5 * float((dem.masses * (dem.velocities**2).sum(axis=1)).sum())
            if moving < 1.0e-3 * dem.energies.elastic:
                return dem


# ---- arguments ----------------------------------------------------------------------------------------------------


def _check_number(n: object) -> None:
    if not isinstance(n, (int, np.integer)) or isinstance(n, bool) or n < 1:
        raise InputError(f"the number of grains must be a whole number, 1 or more, not {n!r}")


def _check_seed(seed: object) -> int:
    if not isinstance(seed, (int, np.integer)) or isinstance(seed, bool) or seed < 0:
        raise InputError(f"seed must be a whole number, 0 or more, not {seed!r}")
    return int(seed)


def _check_porosity(porosity: object) -> None:
    if not (is_finite_number(porosity) and 0.0 < porosity < 1.0):  # type: ignore[operator]
        raise InputError(f"porosity must lie between 0 and 1, not {porosity!r}")


def _check_unbalanced(unbalanced: object) -> None:
    if not (is_finite_number(unbalanced) and 1.0e-8 <= unbalanced < 1.0):  # type: ignore[operator]
        raise InputError(f"unbalanced must lie between 1e-8 and 1, not {unbalanced!r}")


def _check_growth(stress: float | None, porosity: float | None, damping: float, unbalanced: float) -> None:
    if stress is None and porosity is None:
        raise InputError("growth needs a stress in Pa, a porosity, or both")
    if stress is not None and not (is_finite_number(stress) and stress > 0.0):
        raise InputError(f"stress must be a positive number of Pa (compression), not {stress!r}")
    if porosity is not None:
        _check_porosity(porosity)
    if not (is_finite_number(damping) and 0.0 < damping < 1.0):
        raise InputError(f"damping must lie between 0 and 1, not {damping!r}: growth needs some to come to rest")
    _check_unbalanced(unbalanced)
