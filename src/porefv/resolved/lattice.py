"""Lattice: the fluid of a packing as nodes of a cubic lattice, and the links between them that solids and walls cut."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from porefv.resolved.lattice_links import OPPOSITE, Ends, classify, mark_spheres, room_for

# Spheres that touch a link at a distance below this have the node on their surface: the link is then of this length.
_SHORTEST = 1e-3


@dataclass(frozen=True, eq=False)
class Lattice:
    """Nodes in the fluid, from which populations travel along 18 links to their neighbours.

    Places are in spacings, from the lower corner of the box. The planes of the lower walls lie half a spacing before
    the first nodes; those of the upper walls up to a spacing beyond the last ones.

    Attributes
    ----------
    shape : (3,) tuple of int
        Nodes along x, y, z, those in solids included.
    spacing : float
        [m]
    kinds : (6,) int8 array
        Of the walls: see `lattice_of`.
    beyond : (3,) array
        Distance of the last nodes from the upper walls [spacings].
    places : (n, 3) int32 array
        Of the nodes in the fluid, counted from 0: a node is at its place + 1/2.
    owner : int32 array of that shape
        Sphere in which a node lies; -1 in the fluid.
    node : int32 array of that shape
        Number of each node in the fluid; -1 in solids.
    sources : (19, n) int32 array
        Where the population of each direction comes from: a node, or n + a slot, which the links below fill.
    cuts : Cuts
        Links that end on spheres and walls without slip.
    images : Images
        Links through planes of symmetry and through open walls.
    slots : int
        As many as the direction with the most of these links needs.
    """

    shape: tuple[int, int, int]
    spacing: float
    kinds: np.ndarray
    beyond: np.ndarray
    places: np.ndarray
    owner: np.ndarray
    node: np.ndarray
    sources: np.ndarray
    cuts: Cuts
    images: Images
    slots: int

    def __len__(self) -> int:
        return len(self.places)

    def __repr__(self) -> str:
        return f"Lattice({'×'.join(map(str, self.shape))}, {len(self)} nodes in the fluid, {self.spacing:.3g} m apart)"


@dataclass(frozen=True, eq=False)
class Cuts:
    """Links that end on a solid, each from a node along a direction. The population that comes back has a slot.

    Attributes
    ----------
    nodes, slots : (k,) int32 arrays
    directions : (k,) int8 array
    fractions : (k,) array
        Part δ of the link in the fluid, in (0, 1].
    weights : (k,) array
        (1 - 2 δ) / (1 + 2 δ); 0 where the opposite link is cut too.
    bodies : (k,) int32 array
        Sphere, or the number of spheres + the wall.
    passed : (k, 3) int8 array
        Along each axis, the plane of symmetry or open wall that is passed on the way to the image of the body; or -1.
    """

    nodes: np.ndarray
    directions: np.ndarray
    slots: np.ndarray
    fractions: np.ndarray
    weights: np.ndarray
    bodies: np.ndarray
    passed: np.ndarray


@dataclass(frozen=True, eq=False)
class Images:
    """What comes into nodes through walls: part × 2 w × imposed pressure + Σ weight × population, of mirrored nodes.

    Attributes
    ----------
    nodes, slots : (k,) int32 arrays
    directions : (k,) int8 array
        Into the node.
    walls : (k,) int8 array
        The open wall that is passed, or else the plane of symmetry.
    imposed : (k,) array
        Part that an open wall has changed the sign of: 1, or 0 behind planes of symmetry.
    starts : (k + 1,) int64 array
        Range of the sources of each.
    origins, origin_directions, weights : arrays
        Of the sources.
    """

    nodes: np.ndarray
    directions: np.ndarray
    slots: np.ndarray
    walls: np.ndarray
    imposed: np.ndarray
    starts: np.ndarray
    origins: np.ndarray
    origin_directions: np.ndarray
    weights: np.ndarray


def lattice_of(centres: np.ndarray, radii: np.ndarray, size: np.ndarray, kinds: np.ndarray, spacing: float) -> Lattice:
    """The lattice in a box.

    Parameters
    ----------
    centres, radii : (n, 3), (n,) arrays
        Of the spheres, from the box's lower corner [m].
    size : (3,) array
        Of the box [m].
    kinds : (6,) int array
        Of the walls: `NO_SLIP`, `SYMMETRY` or `OPEN` of `porefv.resolved.lattice_links`.
    spacing : float
        [m]
    """
    centres, radii, lengths = centres / spacing, radii / spacing, np.asarray(size) / spacing
    shape = (max(1, round(lengths[0])), max(1, round(lengths[1])), max(1, round(lengths[2])))
    beyond = lengths - (np.array(shape) - 0.5)
    kinds = np.asarray(kinds, np.int8)
    owner = np.full(shape, -1, np.int32)
    mark_spheres(centres, radii, owner, np.zeros(shape, np.float32))
    node = np.full(shape, -1, np.int32)
    places = np.argwhere(owner < 0).astype(np.int32)
    node[owner < 0] = np.arange(len(places), dtype=np.int32)
    sources = np.full((19, len(places)), -1, np.int32)
    sources[0] = np.arange(len(places), dtype=np.int32)
    counts = np.zeros(3, np.int64)
    ends = room_for(0, 0, 0)
    for filling in (False, True):
        classify(places, node, owner, centres, radii, kinds, beyond, sources, ends, counts, filling)
        if not filling:
            ends = room_for(*map(int, counts))
    cuts, images, slots = _with_slots(ends, sources)
    return Lattice(shape, spacing, kinds, beyond, places, owner, node, sources, cuts, images, slots)


def _with_slots(ends: Ends, sources: np.ndarray) -> tuple[Cuts, Images, int]:
    """Give each link that is cut or mirrored a slot of its incoming direction, and write them into `sources`."""
    n, n_cuts, n_images = sources.shape[1], len(ends.cut_nodes), len(ends.image_nodes)
    incoming = np.concatenate([OPPOSITE[ends.cut_directions], ends.image_directions.astype(np.int64)])
    slots = np.empty(n_cuts + n_images, np.int32)
    most = 0
    for q in range(1, 19):
        links = np.flatnonzero(incoming == q)
        slots[links] = n + np.arange(len(links))
        most = max(most, len(links))
    cut = (sources <= -2) & (sources > -2 - n_cuts)
    # Where the opposite link is cut as well, one node lies between two solids: nothing is left to interpolate with.
    double = cut[ends.cut_directions, ends.cut_nodes]
    fractions = np.maximum(ends.fractions, _SHORTEST)
    weights = np.where(double, 0.0, (1.0 - 2.0 * fractions) / (1.0 + 2.0 * fractions))
    special = sources <= -2
    sources[special] = slots[-2 - sources[special]]
    return (
        Cuts(ends.cut_nodes, ends.cut_directions, slots[:n_cuts], fractions, weights, ends.bodies, ends.passed),
        Images(
            ends.image_nodes, ends.image_directions, slots[n_cuts:], ends.walls, ends.imposed, ends.starts,
            ends.origins, ends.origin_directions, ends.weights,
        ),
        most,
    )  # fmt: skip
