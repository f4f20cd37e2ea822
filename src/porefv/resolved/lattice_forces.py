"""Forces of a lattice flow on spheres and walls, by the momentum that links carry to them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from porefv.packing.box import WALL_AXES, WALL_SENSES
from porefv.resolved.fluid_geometry import CEMENTED
from porefv.resolved.lattice import Lattice
from porefv.resolved.lattice_boltzmann import StokesLattice
from porefv.resolved.lattice_links import DIRECTIONS, NO_SLIP, OPEN, OPPOSITE, SYMMETRY, WEIGHTS


@dataclass(frozen=True, eq=False)
class LatticeForces:
    """Forces in units of the pressure difference × spacing².

    Attributes
    ----------
    spheres, sphere_pressure : (n, 3) arrays
        In all, and of the pressure alone.
    walls, wall_pressure : (6, 3) arrays
        Of open walls, the drag along them alone.
    """

    spheres: np.ndarray
    sphere_pressure: np.ndarray
    walls: np.ndarray
    wall_pressure: np.ndarray


def forces_of(flow: StokesLattice, centres: np.ndarray, radii: np.ndarray) -> LatticeForces:
    """Forces of a flow, after `send_back`.

    A link that ends on a body hands it c_q (f_q + f_q̄). Where two bodies touch, no link sees the fluid between them:
    there the pressure around the contact acts on the faces that nodes of one body share with nodes of the other.
    Without it forces of grains that touch are some per cent off.

    Parameters
    ----------
    flow : StokesLattice
    centres, radii : (n, 3), (n,) arrays
        Of the spheres [spacings].
    """
    lattice = flow.lattice
    pressure, _ = flow.moments()
    cuts = lattice.cuts
    q = cuts.directions
    total = flow.f[q, cuts.nodes] + flow.f[OPPOSITE[q], cuts.slots]
    static = 2.0 * WEIGHTS[q] * _pressure_at_cuts(lattice, pressure)
    whole = _exchanged(flow, total, len(radii)) + (patches := _patches(flow, pressure, centres, radii))
    by_pressure = _exchanged(flow, static, len(radii)) + patches
    # Drag along walls has no part of the pressure, and planes of symmetry bear nothing else.
    for wall in range(6):
        along = np.arange(3) != WALL_AXES[wall]
        by_pressure[len(radii) + wall, along] = 0.0
    n = len(radii)
    return LatticeForces(3.0 * whole[:n], 3.0 * by_pressure[:n], 3.0 * whole[n:], 3.0 * by_pressure[n:])


def _pressure_at_cuts(lattice: Lattice, pressure: np.ndarray) -> np.ndarray:
    """(k,): pressure where each link is cut, on the line through its node and the one before."""
    cuts = lattice.cuts
    before = lattice.sources[cuts.directions, cuts.nodes]
    inside = before < len(lattice)
    here = pressure[cuts.nodes]
    return here + np.where(inside, cuts.fractions * (here - pressure[np.where(inside, before, 0)]), 0.0)


def _exchanged(flow: StokesLattice, values: np.ndarray, n: int) -> np.ndarray:
    """(n + 6, 3): what links bring to spheres and walls, with f_q + f_q̄ of each cut link.

    A link that passes a plane of symmetry ends on the image of a body: its own image, of mirrored direction, ends on
    the body. Behind an open wall of pressure p, values are 4 w p less those here.
    """
    lattice = flow.lattice
    cuts, images = lattice.cuts, lattice.images
    forces = np.zeros((n + 6, 3))
    steps = DIRECTIONS[cuts.directions].astype(float)
    passes = cuts.passed >= 0
    mirrored = np.where(passes, -steps, steps)
    walls = np.where(passes, cuts.passed, 0)
    opened = passes & (lattice.kinds[walls] == OPEN)
    odd = opened.sum(axis=1) % 2 == 1
    imposed = np.where(opened, flow.pressures[walls], 0.0).max(axis=1)
    beyond = np.where(odd, 4.0 * WEIGHTS[cuts.directions] * imposed - values, values)
    at_edge = passes.any(axis=1) & (cuts.bodies >= n)  # half of the link is on this side of the plane
    part = np.where(at_edge, 0.5, np.where(passes.any(axis=1), 1.0, 0.0))
    given = (1.0 - part)[:, None] * steps * values[:, None] + part[:, None] * mirrored * beyond[:, None]
    for axis in range(3):
        forces[:, axis] = np.bincount(cuts.bodies, given[:, axis], n + 6)
    # Planes of symmetry bear the normal part of all that passes them.
    carried = flow.f[images.directions, images.slots] + flow.f[OPPOSITE[images.directions], images.nodes]
    for wall in np.flatnonzero(lattice.kinds == SYMMETRY):
        axis, sense = int(WALL_AXES[wall]), WALL_SENSES[wall]
        edge = 0 if sense < 0 else lattice.shape[axis] - 1
        outward = DIRECTIONS[OPPOSITE[images.directions], axis] * sense > 0
        through = outward & (lattice.places[images.nodes, axis] == edge)
        ended = cuts.passed[:, axis] == wall
        # A link to the image of a body, and the mirrored link from the image of the node to the body, both pass.
        forces[n + wall, axis] += sense * (carried[through].sum() + 2.0 * (part * values)[ended].sum())
    # Fluid that enters or leaves drags open walls along them: it has no velocity along them there.
    for wall in np.flatnonzero(lattice.kinds == OPEN):
        through, ended = images.walls == wall, (cuts.passed == wall).any(axis=1)
        outward = DIRECTIONS[OPPOSITE[images.directions[through]]]
        drag = carried[through] @ outward + (part[ended] * (values - beyond)[ended]) @ steps[ended]
        forces[n + wall] += np.where(np.arange(3) == WALL_AXES[wall], 0.0, drag)
    return forces


def _patches(flow: StokesLattice, pressure: np.ndarray, centres: np.ndarray, radii: np.ndarray) -> np.ndarray:
    """(n + 6, 3): what the pressure around contacts does to the faces that bodies share there."""
    lattice = flow.lattice
    n = len(radii)
    first, second, areas = _shared_faces(lattice, n)
    forces = np.zeros((n + 6, 3))
    if len(first) == 0:
        return forces
    around = _pressure_around(lattice, pressure, n)
    upper = np.array(lattice.shape) - 0.5 + lattice.beyond
    places = np.stack([np.zeros(3), upper], axis=1).ravel()
    for a, b, area in zip(first, second, areas, strict=True):
        if b < n:
            depth = radii[a] + radii[b] - np.linalg.norm(centres[a] - centres[b])
            small = min(radii[a], radii[b])
        else:
            wall = b - n
            depth = radii[a] - WALL_SENSES[wall] * (places[wall] - centres[a, WALL_AXES[wall]])
            small = radii[a]
        if depth > CEMENTED * small:
            continue  # a neck of solid
        if b >= n and lattice.kinds[b - n] == OPEN:
            p = flow.pressures[b - n]
        elif (int(a), int(b)) in around:
            p = around[int(a), int(b)]
        else:
            p = _pressure_near(lattice, pressure, int(a), int(b))
        forces[a] += p * area
        forces[b] -= p * area
    forces[n + np.flatnonzero(lattice.kinds == OPEN)] = 0.0
    return forces


def _shared_faces(lattice: Lattice, n: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Pairs of bodies whose nodes are neighbours, and Σ 2 w c over the links from the second to the first."""
    owner, kinds = lattice.owner, lattice.kinds
    firsts, seconds, vectors = [], [], []

    def add(first: np.ndarray, second: np.ndarray, q: int) -> None:
        firsts.append(first)
        seconds.append(second)
        vectors.append(np.broadcast_to(2.0 * WEIGHTS[q] * DIRECTIONS[q], (len(first), 3)))

    for q in range(1, 19):
        step = DIRECTIONS[q]
        here = tuple(slice(max(0, c), min(m, m + c)) for c, m in zip(step, lattice.shape, strict=True))
        there = tuple(slice(max(0, -c), min(m, m - c)) for c, m in zip(step, lattice.shape, strict=True))
        a, b = owner[here], owner[there]  # the link goes from there to here
        shared = (a >= 0) & (b > a)
        add(a[shared], b[shared], q)
        for wall in range(6):
            axis, sense = int(WALL_AXES[wall]), WALL_SENSES[wall]
            if step[axis] * sense >= 0:
                continue
            # From outside through the wall to nodes at it; the node it comes from is the mirrored one.
            edge = 0 if sense < 0 else lattice.shape[axis] - 1
            layer = np.take(owner, edge, axis=axis)
            others = [k for k in range(3) if k != axis]
            behind = layer
            for place, k in enumerate(others):
                if step[k]:
                    behind = np.roll(behind, step[k], axis=place)
                    ends = [slice(None), slice(None)]
                    ends[place] = slice(0, 1) if step[k] > 0 else slice(-1, None)
                    behind[tuple(ends)] = layer[tuple(ends)]
            shared = layer >= 0
            if kinds[wall] != NO_SLIP:
                shared &= behind >= 0
            add(layer[shared], np.full(int(shared.sum()), n + wall, owner.dtype), q)
    first, second = np.concatenate(firsts).astype(np.int64), np.concatenate(seconds).astype(np.int64)
    keys, pairs = np.unique(first * (n + 6) + second, return_inverse=True)
    areas = np.zeros((len(keys), 3))
    np.add.at(areas, pairs, np.concatenate(vectors))
    return keys // (n + 6), keys % (n + 6), areas


def _pressure_around(lattice: Lattice, pressure: np.ndarray, n: int) -> dict[tuple[int, int], float]:
    """Mean pressure of the nodes with links to both of two bodies, by pair."""
    cuts = lattice.cuts
    ends = np.unique(np.stack([cuts.nodes, cuts.bodies], axis=1), axis=0)
    nodes, bodies = [ends[:, 0]], [ends[:, 1]]
    for wall in np.flatnonzero(lattice.kinds == SYMMETRY):
        edge = 0 if WALL_SENSES[wall] < 0 else lattice.shape[WALL_AXES[wall]] - 1
        at_wall = np.unique(ends[lattice.places[ends[:, 0], WALL_AXES[wall]] == edge, 0])
        nodes.append(at_wall)
        bodies.append(np.full(len(at_wall), n + wall, bodies[0].dtype))
    node, body = np.concatenate(nodes), np.concatenate(bodies)
    order = np.lexsort((body, node))
    node, body = node[order], body[order]
    sums: dict[int, list[float]] = {}
    # The k-th next entry of the list, as long as it is of the same node.
    for k in range(1, int(np.bincount(node).max())):
        same = np.flatnonzero(node[k:] == node[:-k])
        keys, pairs = np.unique(body[same].astype(np.int64) * (n + 6) + body[same + k], return_inverse=True)
        totals = np.bincount(pairs, pressure[node[same]])
        for key, total, count in zip(keys.tolist(), totals.tolist(), np.bincount(pairs).tolist(), strict=True):
            known = sums.setdefault(key, [0.0, 0.0])
            known[0] += total
            known[1] += count
    return {(key // (n + 6), key % (n + 6)): total / count for key, (total, count) in sums.items()}


def _pressure_near(lattice: Lattice, pressure: np.ndarray, first: int, second: int) -> float:
    """Mean pressure of the nodes of the first body's links: where none has links to both."""
    cuts = lattice.cuts
    nodes = cuts.nodes[(cuts.bodies == first) | (cuts.bodies == second)]
    return float(pressure[nodes].mean()) if len(nodes) else 0.0
