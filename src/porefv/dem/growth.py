"""Packings by growth: grains grow at random places until they press on each other.

Growth of radii is the procedure of Chareyre et al. (2012, §3.1), after Chareyre, Briançon and Villard (2002): grains
grow from a sparse cloud between rigid walls while friction decides how dense they get. The radius expansion - friction
decrease procedure then lowers friction at constant stress until a porosity is reached.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from porefv.dem.dem import DEM
from porefv.dem.material import Material
from porefv.dem.random_placement import check_count, check_porosity, cloud
from porefv.dem.sizes import Sizes
from porefv.dem.strided_run import STRIDE, Report, StridedRun, check_unbalanced
from porefv.errors import ComputationError, InputError
from porefv.packing.box import Box
from porefv.system.number_checks import is_finite_number

# Porosity of the cloud that growth starts from.
_SPARSE = 0.75
# Strain of the fastest growth in one step.
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
    check_count(n)
    _check_growth(stress, porosity, damping, unbalanced)
    growing = material if friction_angle is None else replace(material, friction_angle=friction_angle)
    start = cloud(n, sizes, box, _SPARSE if porosity is None else max(_SPARSE, porosity), seed)
    dem = DEM(start, growing, damping=damping)
    run = StridedRun(dem, report)
    if stress is None:
        assert porosity is not None  # _check_growth has seen to it
        _fill(dem, porosity, run)
        _relax(dem, unbalanced, run)
        if growing != material:
            dem.set_material(material)
            _relax(dem, unbalanced, run)
        return _stopped(dem)
    _approach(dem, stress, run)
    _hold(dem, stress, unbalanced, run)
    if porosity is not None:
        _lower_friction(dem, stress, porosity, run)
    if dem.material != material:
        dem.set_material(material)
        _hold(dem, stress, unbalanced, run)
    return _stopped(dem)


def _approach(dem: DEM, target: float, run: StridedRun) -> None:
    """Grow fast until grains begin to press, ever slower as what presses is no longer their motion."""
    slow = _GAIN * target / dem.material.young
    strain = STRIDE * _FASTEST
    while strain > slow:
        while run.stride("growing") < 0.5 * target:
            dem.scale_radii(1.0 + strain)
        for _ in range(40):
            if run.stride("growing") < 0.25 * target:
                break
        else:
            return  # it stays: the grains are jammed
        strain *= 0.5


def _hold(dem: DEM, target: float, unbalanced: float, run: StridedRun) -> None:
    """Grow or shrink in proportion to the distance from a stress until that is reached at rest."""
    while True:
        stress = run.stride("pressing")
        if abs(stress - target) < _CLOSE * target and run.strides % 4 == 0 and dem.unbalanced < unbalanced:
            walls = np.mean(list(dem.wall_stress.values()))
            if abs(walls - stress) < _WALLS_CLOSE * stress:
                return
        dem.scale_radii(_correction(dem, stress, target))


def _correction(dem: DEM, stress: float, target: float) -> float:
    """The factor for the radii that brings stress nearer to its target."""
    strain = _GAIN * (target - stress) / dem.material.young
    return 1.0 + min(max(strain, -STRIDE * _FASTEST), STRIDE * _FASTEST)


def _lower_friction(dem: DEM, target: float, porosity: float, run: StridedRun) -> None:
    """Lower friction at constant stress until a porosity is reached (Chareyre et al., 2002)."""
    if dem.porosity < porosity:
        raise ComputationError(
            f"at {target:.4g} Pa, growth with a friction angle of {dem.material.friction_angle:.3g} degrees gives "
            f"porosity {dem.porosity:.4f}, below the {porosity:g} asked for; grow with more friction "
            "(friction_angle), or ask for less porosity"
        )
    waited = 0
    while dem.porosity > porosity:
        stress = run.stride("smoothing")
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


def _fill(dem: DEM, porosity: float, run: StridedRun) -> None:
    """Grow at a steady rate to a porosity."""
    hard = _TOO_HARD * dem.material.young
    while True:
        left = math.log((1.0 - porosity) / (1.0 - dem.porosity)) / 3.0
        if left <= 0.0:
            return
        dem.scale_radii(math.exp(min(left, STRIDE * _STEADY)))
        stress = run.stride("growing")
        if stress > hard:
            raise ComputationError(
                f"porosity {porosity:g} cannot be reached: at {dem.porosity:.4f} grains press with {stress:.3g} Pa, "
                f"over {_TOO_HARD:g} of their modulus; ask for more porosity, or less friction while they grow"
            )
        if left <= STRIDE * _STEADY:
            return


def _relax(dem: DEM, unbalanced: float, run: StridedRun) -> None:
    """Run until grains are at rest, pressing on each other or apart."""
    while run.stride("resting") > _NO_STRESS * dem.material.young:
        if run.strides % 4 == 0 and dem.unbalanced < unbalanced:
            return


def _stopped(dem: DEM) -> DEM:
    """The same without the drift of loose grains: nothing slows those that meet no other."""
    dem.velocities, dem.spins = np.zeros(3), np.zeros(3)
    return dem


def _check_growth(stress: float | None, porosity: float | None, damping: float, unbalanced: float) -> None:
    if stress is None and porosity is None:
        raise InputError("growth needs a stress in Pa, a porosity, or both")
    if stress is not None and not (is_finite_number(stress) and stress > 0.0):
        raise InputError(f"stress must be a positive number of Pa (compression), not {stress!r}")
    if porosity is not None:
        check_porosity(porosity)
    if not (is_finite_number(damping) and 0.0 < damping < 1.0):
        raise InputError(f"damping must lie between 0 and 1, not {damping!r}: growth needs some to come to rest")
    check_unbalanced(unbalanced)
