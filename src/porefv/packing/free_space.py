"""Free space between a wall and the grains: a box larger than the packing, or a bed with fluid above it.

Fluid passes along such a wall as in no packing, and permeabilities come out many times too large.
"""

from __future__ import annotations

import warnings
from dataclasses import dataclass

import numpy as np

from porefv.errors import FreeSpaceWarning, InputError
from porefv.packing.box import WALLS, Box, Floats
from porefv.packing.layers import layer_porosities
from porefv.packing.packing import Packing

# How walls can be placed by the spheres: all of them, or those with free space.
FITS = ("fit", "bed")

# Gap to the nearest grain, over the mean radius, and porosity of the layer along a wall above that of the inside, from
# which on a wall has free space. Walls of packings by growth and settling have gaps of 0.01 and 0.15 more porosity.
_GAP, _MORE = 0.02, 0.25
# A gap, over the mean radius, from which on a wall is moved to the grains for a bed.
_FREE = 0.5


@dataclass(frozen=True)
class WallLayer:
    """The layer along a wall, one mean diameter thick.

    Attributes
    ----------
    wall : str
        Name of the wall.
    gap : float
        From the wall to the nearest sphere, negative where that reaches beyond it [m].
    porosity : float
        Of the layer; NaN where the box is less than four mean diameters wide.
    inside : float
        Porosity between this layer and the opposite one; NaN likewise.
    free : bool
        Whether there is more room than between grains.
    """

    wall: str
    gap: float
    porosity: float
    inside: float
    free: bool


def wall_layers(packing: Packing) -> tuple[WallLayer, ...]:
    """The layers along the six walls, in the order of `porefv.WALLS`.

    A wall has free space if the nearest sphere is further away, by 0.02 mean radii, than half the median distance
    between the surfaces of nearest spheres, or if its layer is more porous by 0.25 than the inside.

    Raises
    ------
    InputError
        If the packing has no box.
    """
    box = packing.walled_box
    if box is None:
        raise InputError("the packing has no box, and gaps are those to its walls")
    radius = float(packing.radii.mean())
    gaps = _gaps(packing, box)
    usual = _half_distance(packing) if (gaps > _GAP * radius).any() else 0.0
    layers = []
    for axis in range(3):
        porosities = np.full(3, np.nan)
        if box.size[axis] >= 8.0 * radius:
            lower, upper = box.lower[axis], box.upper[axis]
            porosities = layer_porosities(packing, axis, [lower, lower + 2.0 * radius, upper - 2.0 * radius, upper])
        inside = float(porosities[1])
        for wall, porosity in ((2 * axis, float(porosities[0])), (2 * axis + 1, float(porosities[2]))):
            free = bool(gaps[wall] > _GAP * radius + usual or porosity > inside + _MORE)
            layers.append(WallLayer(WALLS[wall], float(gaps[wall]), porosity, inside, free))
    return tuple(layers)


def warn_of_free_space(layers: tuple[WallLayer, ...], packing: Packing) -> None:
    """Warn (`FreeSpaceWarning`) of walls of a packing that have free space."""
    said = free_space(layers, float(packing.radii.mean()))
    if said is not None:
        warnings.warn(said, FreeSpaceWarning, stacklevel=2)


def free_space(layers: tuple[WallLayer, ...], radius: float) -> str | None:
    """What is to be said of walls with free space, with the remedy; None if there are none.

    Parameters
    ----------
    layers : tuple of WallLayer
    radius : float
        Mean radius of the spheres [m].
    """
    found = [layer for layer in layers if layer.free]
    if not found:
        return None
    described = []
    for layer in found[:2]:
        text = f"{layer.wall}: nearest sphere {layer.gap:.3g} m away ({layer.gap / radius:.2g} mean radii)"
        if not np.isnan(layer.porosity):
            text += f", porosity {layer.porosity:.2f} along the wall, {layer.inside:.2f} inside"
        described.append(text)
    if len(found) > 2:
        described.append(f"and likewise {', '.join(layer.wall for layer in found[2:])}")
    return (
        f"there is free space between walls and grains ({'; '.join(described)}). Flow along it counts as flow through "
        'the packing. If it is not meant, give box = "fit" (all walls at the outermost spheres) or box = "bed" (walls '
        "with free space only)"
    )


def fitted(packing: Packing, how: str) -> Packing:
    """The packing in a box whose walls are placed by its spheres.

    Parameters
    ----------
    packing : Packing
    how : {"fit", "bed"}
        "fit": each wall touches the outermost sphere. "bed": so does each wall that is more than half a mean radius
        away from the nearest sphere; the others stay.

    Raises
    ------
    InputError
        For another word, or a bed without a box.
    """
    if how not in FITS:
        raise InputError(f"a box is placed by the spheres as one of {', '.join(FITS)}, not {how!r}")
    around = Box.around(packing)
    if how == "fit":
        return packing.with_box(around)
    if packing.walled_box is None:
        raise InputError('the packing has no box of which walls could be moved: give box = "fit"')
    far = _gaps(packing, packing.walled_box) > _FREE * packing.radii.mean()
    return packing.with_box(Box.between(np.where(far, around.wall_places, packing.walled_box.wall_places)))


def _gaps(packing: Packing, box: Box) -> Floats:
    """(6,): distance of each wall from the nearest sphere, negative where that reaches beyond it, m."""
    return (box.wall_distances(packing.centres) - packing.radii[:, None]).min(axis=0)


def _half_distance(packing: Packing) -> float:
    """Half the median distance of a sphere's surface from the nearest one, m; 0 where most touch."""
    from scipy.spatial import cKDTree

    if len(packing) < 2:
        return np.inf  # one sphere: its distance from the walls is what it is
    near = min(8, len(packing))
    distances, others = cKDTree(packing.centres).query(packing.centres, near)
    between = distances[:, 1:] - packing.radii[:, None] - packing.radii[others[:, 1:]]
    return float(max(np.median(between.min(axis=1)), 0.0) / 2.0)
