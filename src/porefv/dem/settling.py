"""Packings by settling: grains fall under gravity until they are at rest."""

from __future__ import annotations

import math

import numpy as np

from porefv.dem.dem import DEM
from porefv.dem.strided_run import MOST_STEPS, STRIDE, Report, StridedRun, check_unbalanced
from porefv.errors import InputError


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
    check_unbalanced(unbalanced)
    fall = math.sqrt(2.0 * float(np.linalg.norm(dem.box.size)) / pull)
    run = StridedRun(dem, report, dem.steps + MOST_STEPS // 4 + int(50.0 * fall / dem.step))
    while True:
        run.stride("settling", 4 * STRIDE)
        if dem.unbalanced < unbalanced:
            # Spin is left out: nothing slows a grain that spins on a smooth wall and touches no other.
            moving = 0.5 * float((dem.masses * (dem.velocities**2).sum(axis=1)).sum())
            if moving < 1.0e-3 * dem.energies.elastic:
                return dem
