"""Porosity by layer, between planes normal to an axis: exact for any overlap."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from porefv.errors import InputError
from porefv.packing.box import Box, Floats, read_only
from porefv.packing.packing import Packing
from porefv.system.number_checks import is_finite_number


def layer_edges(box: Box, axis: int, layers: int) -> Floats:
    """(layers + 1,) places of the planes between equally thick layers along an axis of the box, walls included, m.

    Raises
    ------
    InputError
        If the number of layers is not a whole number, 1 or more.
    """
    if not (is_finite_number(layers) and layers >= 1 and layers == int(layers)):
        raise InputError(f"layers must be a whole number, 1 or more, not {layers!r}")
    return np.linspace(box.lower[axis], box.upper[axis], int(layers) + 1)


def layer_porosities(packing: Packing, axis: int, edges: ArrayLike) -> Floats:
    """Porosity of each layer between planes normal to an axis.

    The solid of a layer is the sum, over the spheres, of the part of the ball that lies in its Laguerre cell, in the
    box, and between the planes of the layer. Each part has a closed form (Edelsbrunner 1995 has the same sum over
    simplices), so that the result is exact for any overlap, also where three or more spheres and walls share points.
    The porosities, weighted with the volumes of the layers, add up to `Packing.porosity`.

    Parameters
    ----------
    packing : Packing
        With a box.
    axis : int
        0, 1 or 2.
    edges : (l + 1,) array
        Increasing places along the axis, from the lower wall to the upper [m].

    Returns
    -------
    (l,) array

    Raises
    ------
    InputError
        If the edges do not increase from wall to wall.

    Examples
    --------
    >>> ball = Packing([[0.5, 0.5, 0.5]], [0.5], Box([0, 0, 0], [1, 1, 1]))
    >>> layer_porosities(ball, 2, [0.0, 0.5, 1.0]).round(6).tolist()  # 1 - π / 6
    [0.476401, 0.476401]
    """
    box = packing.walled_box
    if box is None:
        raise InputError("the packing has no box, and layers lie between two of its walls")
    edges = np.asarray(edges, float)
    if edges.ndim != 1 or len(edges) < 2 or not (np.diff(edges) > 0.0).all():
        raise InputError("edges of layers must be two or more increasing places")
    if edges[0] != box.lower[axis] or edges[-1] != box.upper[axis]:
        raise InputError(
            f"edges of layers must lead from wall to wall, {box.lower[axis]:.6g} to {box.upper[axis]:.6g} m, "
            f"not {edges[0]:.6g} to {edges[-1]:.6g}"
        )
    # Not at the top: it loads numba, which a script that only reads a packing does not need.
    from porefv.packing.solids_in_layers import solids_in_layers

    solids = np.empty(len(edges) - 1)
    starts, others = _neighbours(packing)
    solids_in_layers(
        packing.centres, packing.radii, box.lower, box.upper, starts, others, axis, read_only(edges, "edges"), solids
    )
    return 1.0 - solids / (np.diff(edges) * box.section(axis))


def _neighbours(packing: Packing) -> tuple[NDArray[np.int64], NDArray[np.int32]]:
    """Spheres that overlap each sphere: those of sphere i are others[starts[i]] ... others[starts[i + 1] - 1]."""
    pairs = packing.overlaps.pairs
    spheres, others = np.concatenate([pairs, pairs[:, ::-1]]).T
    order = np.argsort(spheres, kind="stable")
    return np.searchsorted(spheres[order], np.arange(len(packing) + 1)), others[order]
