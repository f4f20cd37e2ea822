"""Paths of particles that the fluid carries through the network of pores, with residence times."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from porefv.errors import ComputationError, InputError
from porefv.mesh.void_routes import SpheresOnLines, routes_to_necks, routes_to_walls
from porefv.packing.box import WALL_AXES

if TYPE_CHECKING:
    import pyvista

    from porefv.flow.pore_flow import PoreFlow
    from porefv.mesh.pore_mesh import PoreMesh


@dataclass(frozen=True, eq=False)
class Paths:
    """Paths of particles from where the fluid enters to where it leaves, one after the other.

    Path i has the points offsets[i] ... offsets[i + 1] - 1.

    Attributes
    ----------
    points : (m, 3) array
        On walls, in necks, between the two necks of a pore, and where a path leads round a grain [m].
    offsets : (n + 1,) int array
    pores : (m,) int array
        Pore of each point; in a neck, the pore that the path leaves there.
    times : (m,) array
        Since the particle entered. The residence time of a pore is spread evenly over the path's length in it [s].
    pressures : (m,) array
        Piezometric; in a neck the mean of its two pores [Pa].
    speeds : (m,) array
        Size of the mean velocity of the pore; in a neck, its flux over its fluid area A^f [m/s].
    height : float or None
        Distance of the two pressure walls [m]; None if they are not one pair of opposite walls.
    cut : int
        Ways through pores, each counted once, on which no line that was tried passes outside all grains.
    """

    points: np.ndarray
    offsets: np.ndarray
    pores: np.ndarray
    times: np.ndarray
    pressures: np.ndarray
    speeds: np.ndarray
    height: float | None
    cut: int

    def __len__(self) -> int:
        return len(self.offsets) - 1

    @property
    def residence_times(self) -> np.ndarray:
        """(n,): time that each particle takes through the sample [s]."""
        return self.times[self.offsets[1:] - 1]

    @property
    def lengths(self) -> np.ndarray:
        """(n,): length of each path [m]."""
        steps = np.linalg.norm(np.diff(self.points, axis=0, append=self.points[-1:]), axis=1)
        steps[self.offsets[1:] - 1] = 0.0  # from the end of a path to the start of the next
        return np.add.reduceat(steps, self.offsets[:-1])

    @property
    def tortuosities(self) -> np.ndarray:
        """(n,): length of each path over the distance of the two pressure walls; 1 or more.

        Raises
        ------
        InputError
            If the pressure walls are not one pair of opposite walls.
        """
        if self.height is None:
            raise InputError("path tortuosity needs exactly two pressure walls, opposite each other")
        return self.lengths / self.height

    @property
    def path_tortuosity(self) -> float:
        """Mean of `tortuosities`. As paths are drawn by flux, it is the mean by flux."""
        return float(self.tortuosities.mean())

    @property
    def path_tortuosity_scatter(self) -> float:
        """Standard deviation of `tortuosities`."""
        return float(self.tortuosities.std())

    def to_pyvista(self) -> pyvista.PolyData:
        """A line for each path, with the point data `time`, `pressure`, `speed`, `pore`: see `paths_polydata`.

        Raises
        ------
        MissingExtraError
            If pyvista is not installed.
        """
        from porefv.export.vtk_datasets import paths_polydata
        from porefv.system.optional_imports import load

        return load("pyvista", "to_pyvista()").PolyData(paths_polydata(self))

    def __repr__(self) -> str:
        return f"Paths({len(self)} paths, {len(self.points)} points)"


class _Ways(NamedTuple):
    """How fluid leaves pores: those of pore i are starts[i] ... starts[i + 1] - 1.

    Attributes
    ----------
    keys : (k,) array
        Pore, plus the part of its outflow by this way and those before it.
    ways : (k,) int array
        Throat, t + wall face, or t + w for what is withdrawn inside the pore.
    starts : (n_pores + 1,) int array
    """

    keys: np.ndarray
    ways: np.ndarray
    starts: np.ndarray


class _Visits(NamedTuple):
    """Visits of particles to pores, path by path.

    Attributes
    ----------
    pores, ways, paths, places : (v,) int arrays
        Pore, way out of it (`_Ways`), path, and how many visits of the path came before.
    times : (v,) array
        When the particle enters the pore [s].
    """

    pores: np.ndarray
    ways: np.ndarray
    paths: np.ndarray
    places: np.ndarray
    times: np.ndarray


def paths(flow: PoreFlow, face_flux: np.ndarray, injected: np.ndarray | None, count: int, seed: int = 0) -> Paths:
    """Paths of particles, drawn by flux: as many enter by a face, and leave a pore by a throat, as fluid does.

    A particle stays in a pore for V / q: the pore's void volume over what flows through it, the same for all particles
    (plug flow). The mean of the residence times over many paths tends to Σ V / Q, with V of the pores that the flow
    reaches and Q the flow through the sample. In pores that are mixed the mean would be the same, the scatter larger.

    A path leads from neck to neck. In a pore it is straight where a straight line meets no sphere, and else goes by the
    centre of the pore's inscribed sphere (`porefv.mesh.void_routes`).

    Parameters
    ----------
    flow : PoreFlow
    face_flux : (w,) array
        Flux into the sample through each wall face [m³/s].
    injected : (n_pores,) array, optional
        Volume injected into each pore per unit time, other than through walls [m³/s].
    count : int
        Number of paths, 1 or more.
    seed : int
        Of the random numbers, 0 or more.

    Raises
    ------
    InputError
        For a count or a seed that is none, or if nothing flows.
    ComputationError
        If a pore that particles reach has no outflow, as the pressures are far from balance, or a void volume below
        zero.
    """
    for value, name, least in ((count, "count", 1), (seed, "seed", 0)):
        if isinstance(value, bool) or not isinstance(value, (int, np.integer)) or value < least:
            raise InputError(f"{name} must be a whole number, {least} or more, not {value!r}")
    mesh, flux = flow.mesh, flow.flux
    pores_of_faces = mesh.cell_pore[mesh.wall_faces.cells]
    injected = np.zeros(mesh.n_pores) if injected is None else injected
    entering = np.concatenate([face_flux, injected])
    if not (entering > 0.0).any():
        raise InputError("nothing flows: there are no paths")
    random = np.random.default_rng(seed)
    entries = random.choice(len(entering), count, p=np.maximum(entering, 0.0) / np.maximum(entering, 0.0).sum())
    pores_of_entries = np.concatenate([pores_of_faces, np.arange(mesh.n_pores)])
    ways, through = _ways(mesh, flux, entering, pores_of_entries)
    stays = np.divide(mesh.pore_volumes, through, out=np.zeros(mesh.n_pores), where=through > 0.0)
    return _assemble(flow, entries, _walk(mesh, ways, pores_of_entries[entries], stays, random), stays)


def _ways(
    mesh: PoreMesh, flux: np.ndarray, entering: np.ndarray, pores_of_entries: np.ndarray
) -> tuple[_Ways, np.ndarray]:
    """The ways out of each pore, and what flows through each pore (n_pores,) [m³/s]."""
    pores = np.concatenate([np.where(flux > 0.0, mesh.throats.pores[:, 0], mesh.throats.pores[:, 1]), pores_of_entries])
    leaving = np.concatenate([np.abs(flux), np.maximum(-entering, 0.0)])
    through = np.bincount(pores, leaving, mesh.n_pores)
    used = np.flatnonzero(leaving > 0.0)
    order = used[np.argsort(pores[used], kind="stable")]
    starts = np.searchsorted(pores[order], np.arange(mesh.n_pores + 1))
    # Sums by pore, as differences of one running sum would lose the digits of small pores.
    parts = leaving[order] / through[pores[order]]
    running = np.concatenate([[0.0], np.cumsum(parts)])
    keys = pores[order] + (running[1:] - running[starts[pores[order]]])
    return _Ways(keys, order, starts), through


def _walk(mesh: PoreMesh, ways: _Ways, first: np.ndarray, stays: np.ndarray, random: np.random.Generator) -> _Visits:
    """The visits of particles to pores, path by path, from their first pores (n,) and the stays in pores (n_pores,)."""
    throats = mesh.throats
    times = np.zeros(len(first))
    walked: list[tuple[np.ndarray, ...]] = []
    here, who, step = first, np.arange(len(first)), 0
    while len(who):
        begin, end = ways.starts[here], ways.starts[here + 1]
        if (begin == end).any():
            pore = int(here[np.argmax(begin == end)])
            raise ComputationError(f"no fluid leaves pore {pore}, which particles reach: the flow is not in balance")
        if step > mesh.n_pores:
            raise ComputationError("a particle goes round in a circle: the flow does not go down the pressure")
        chosen = np.searchsorted(ways.keys, here + random.random(len(here)), side="right")
        way = ways.ways[np.clip(chosen, begin, end - 1)]
        walked.append((here, way, who, np.full(len(who), step), times[who]))
        times[who] += stays[here]
        goes_on = way < len(throats)
        pairs = throats.pores[way[goes_on]]
        here = pairs.sum(axis=1) - here[goes_on]
        who = who[goes_on]
        step += 1
    columns = [np.concatenate(values) for values in zip(*walked, strict=True)]
    order = np.lexsort((columns[3], columns[2]))
    return _Visits(*(values[order] for values in columns))


def _assemble(flow: PoreFlow, entries: np.ndarray, visits: _Visits, stays: np.ndarray) -> Paths:
    """The points of the paths, from what each enters by (n,), the visits, and the stays in pores (n_pores,)."""
    mesh = flow.mesh
    visited, taken, number, place, before = visits
    if (stays[visited] < 0.0).any():
        pore = int(visited[np.argmax(stays[visited] < 0.0)])
        raise ComputationError(
            f"pore {pore} has a void volume below zero, as spheres overlap, or reach through flat cells: there is no "
            "residence time"
        )
    t = len(mesh.throats)
    came = np.empty(len(taken), int)
    came[1:] = taken[:-1]
    came[place == 0] = t + entries
    inward, cut_in = _routes(flow, came, visited)
    outward, cut_out = _routes(flow, taken, visited)
    # A visit to a pore: from where it is entered, by the middle, to where it is left; three points there, two back.
    points = np.concatenate([inward[:, [0, 1, 2]], outward[:, [1, 0]]], axis=1)
    _straight_from_walls(flow, came, points[:, 0], points[:, 4])
    _straight_from_walls(flow, taken, points[:, 4], points[:, 0])
    # Fluid cuts corners: it goes straight from one to the other where that is free, without the way to the middle.
    _, first, back = np.unique(np.stack([came, taken], axis=1), axis=0, return_index=True, return_inverse=True)
    straight_once = ~SpheresOnLines(mesh.packing).cut(points[first, 0], points[first, 4])
    cut = int(((cut_in | cut_out)[first] & ~straight_once).sum())
    straight = straight_once[back.ravel()]
    points[straight, 1:4] = 0.5 * (points[straight, :1] + points[straight, 4:])
    middle = np.linalg.norm(flow.pore_velocity, axis=1)[visited]
    pressure = flow.pressure[visited]
    speed_in, pressure_in = _at_ends(flow, came, middle, pressure)
    speed_out, pressure_out = _at_ends(flow, taken, middle, pressure)
    arcs = np.zeros(points.shape[:2])
    arcs[:, 1:] = np.cumsum(np.linalg.norm(np.diff(points, axis=1), axis=2), axis=1)
    total = arcs[:, -1:]
    half = arcs[:, 2:3]
    to_middle = np.divide(arcs, half, out=np.ones_like(arcs), where=half > 0.0)
    from_middle = np.divide(arcs - half, total - half, out=np.zeros_like(arcs), where=total > half)
    into, out = np.clip(1.0 - to_middle, 0.0, 1.0), np.clip(from_middle, 0.0, 1.0)
    into[:, 0], out[:, -1] = 1.0, 1.0
    fraction = np.divide(
        arcs, total, out=np.broadcast_to(np.linspace(0.0, 1.0, 5), arcs.shape).copy(), where=total > 0.0
    )

    def between(at_in: np.ndarray, at_middle: np.ndarray, at_out: np.ndarray) -> np.ndarray:
        return at_middle[:, None] + into * (at_in - at_middle)[:, None] + out * (at_out - at_middle)[:, None]

    # The first point of a visit but the first is the last of the visit before. Points that coincide are left out.
    keep = np.ones(points.shape[:2], bool)
    keep[:, :-1] = (np.diff(points, axis=1) != 0.0).any(axis=2)
    keep[:, 0] = (place == 0) & (keep[:, 0] | (total[:, 0] == 0.0))
    axis = flow.walls.axis
    counts = np.bincount(number, keep.sum(axis=1), len(entries)).astype(int)
    return Paths(
        points=points[keep],
        offsets=np.concatenate([[0], np.cumsum(counts)]),
        pores=np.broadcast_to(visited[:, None], keep.shape)[keep],
        times=(before[:, None] + fraction * stays[visited][:, None])[keep],
        pressures=between(pressure_in, pressure, pressure_out)[keep],
        speeds=between(speed_in, middle, speed_out)[keep],
        height=None if axis is None or flow.sources or flow.fixed_pressures else float(mesh.box.size[axis]),
        cut=cut,
    )


def _straight_from_walls(flow: PoreFlow, ways: np.ndarray, begin: np.ndarray, end: np.ndarray) -> None:
    """Move points (v, 3) on walls, begin, to those nearest to the other ends (v, 3) if nothing is between.

    Pressure walls are passed anywhere: what comes from one goes straight to a neck.
    """
    faces = flow.mesh.wall_faces
    rows = np.flatnonzero((ways >= len(flow.mesh.throats)) & (ways < len(flow.mesh.throats) + len(faces.cells)))
    walls = faces.walls[ways[rows] - len(flow.mesh.throats)]
    nearest = end[rows].copy()
    nearest[np.arange(len(rows)), WALL_AXES[walls]] = flow.mesh.box.wall_places[walls]
    free = ~SpheresOnLines(flow.mesh.packing).cut(nearest, end[rows])
    begin[rows[free]] = nearest[free]


def _routes(flow: PoreFlow, ways: np.ndarray, visited: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Routes (v, 3, 3) from the ways (v,) to the middles of pores (v,), and (v,) bool whether they cut a sphere."""
    mesh = flow.mesh
    t, w = len(mesh.throats), len(mesh.wall_faces.cells)
    points = np.repeat(mesh.inscribed_spheres.centres[visited][:, None], 3, axis=1)  # of what begins or ends inside
    cut = np.zeros(len(ways), bool)
    through_throat = ways < t
    if through_throat.any():
        throats, back = np.unique(ways[through_throat], return_inverse=True)
        sides = routes_to_necks(mesh, throats, flow.walls.slip)
        second = mesh.throats.pores[ways[through_throat], 1] == visited[through_throat]
        points[through_throat] = np.where(second[:, None, None], sides[1].points[back], sides[0].points[back])
        cut[through_throat] = np.where(second, sides[1].cut[back], sides[0].cut[back])
    at_wall = (ways >= t) & (ways < t + w)
    if at_wall.any():
        faces, back = np.unique(ways[at_wall] - t, return_inverse=True)
        found = routes_to_walls(mesh, faces)
        points[at_wall], cut[at_wall] = found.points[back], found.cut[back]
    return points, cut


def _at_ends(
    flow: PoreFlow, ways: np.ndarray, speeds: np.ndarray, pressures: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Speeds and pressures where pores are entered or left: in necks; elsewhere those of the pore, (v,) each."""
    throats = flow.mesh.throats
    necks = np.flatnonzero(ways < len(throats))
    speeds, pressures = speeds.copy(), pressures.copy()
    taken = ways[necks]
    speeds[necks] = np.abs(flow.flux[taken]) / throats.fluid_areas[taken]
    pressures[necks] = flow.pressure[throats.pores[taken]].mean(axis=1)
    return speeds, pressures
