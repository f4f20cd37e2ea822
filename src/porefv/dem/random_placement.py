"""Clouds: grains apart, at random places in a box."""

from __future__ import annotations

import math

import numpy as np

from porefv.dem.sizes import Sizes
from porefv.errors import InputError
from porefv.packing.box import Box
from porefv.packing.overlaps import sphere_volumes
from porefv.packing.packing import Packing
from porefv.system.kernels import kernel
from porefv.system.number_checks import is_finite_number

# Places tried in a cloud, for each grain, before it counts as full.
_TRIES = 5000


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
    check_count(n)
    check_porosity(porosity)
    rng = np.random.default_rng(_check_seed(seed))
    radii = sizes.draw(n, rng)
    radii = radii * np.cbrt((1.0 - porosity) * box.volume / (sphere_volumes(1.0) * (radii**3).sum()))
    order = np.argsort(-radii, kind="stable")
    if 2.0 * radii.max() >= box.size.min():
        raise InputError(
            f"at porosity {porosity:g} the largest of {n} grains is {2.0 * radii.max():.4g} m wide, and the box "
            f"{box.size.min():.4g} m; ask for more grains, or a higher porosity"
        )
    centres, placed = _place(radii[order], box.size, rng, _TRIES * n)
    if placed < n:
        reached = 1.0 - sphere_volumes(radii[order][:placed]).sum() / box.volume
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


@kernel
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


def check_count(n: object) -> None:
    """InputError unless the number of grains is a whole number, 1 or more."""
    if not isinstance(n, (int, np.integer)) or isinstance(n, bool) or n < 1:
        raise InputError(f"the number of grains must be a whole number, 1 or more, not {n!r}")


def check_porosity(porosity: object) -> None:
    """InputError unless the porosity is a number in (0, 1)."""
    if not (is_finite_number(porosity) and 0.0 < porosity < 1.0):  # type: ignore[operator]
        raise InputError(f"porosity must lie between 0 and 1, not {porosity!r}")


def _check_seed(seed: object) -> int:
    if not isinstance(seed, (int, np.integer)) or isinstance(seed, bool) or seed < 0:
        raise InputError(f"seed must be a whole number, 0 or more, not {seed!r}")
    return int(seed)
