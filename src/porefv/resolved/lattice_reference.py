"""The resolved flow through a packing by the lattice-Boltzmann method: three lattices, extrapolated to none."""

from __future__ import annotations

import math
import time
from dataclasses import dataclass, fields
from os import PathLike
from typing import TYPE_CHECKING, Any

import numpy as np

from porefv.errors import ComputationError, InputError
from porefv.flow.fluid import Fluid
from porefv.flow.pore_flow import PoreFlow
from porefv.flow.walls import Walls
from porefv.packing.box import WALL_NORMALS
from porefv.resolved.lattice import Lattice, lattice_of
from porefv.resolved.lattice_boltzmann import StokesLattice
from porefv.resolved.lattice_links import NO_SLIP, OPEN, SYMMETRY
from porefv.resolved.lattice_state import SavedState
from porefv.resolved.lattice_values import LatticeOnMesh, at_points, read_off
from porefv.resolved.reference import (
    LatticeRun,
    StokesReference,
    Values,
    distances,
    ensure_driven,
    permeability_of,
    versions,
)
from porefv.system.memory import available
from porefv.system.progress import Progress
from porefv.system.threads import limited_threads

if TYPE_CHECKING:
    from porefv.mesh.pore_mesh import PoreMesh

STAGES = ("lattice", "flow", "reading off")

# Lattices: their fineness over that asked for. Errors fall with the square of the spacing.
_LEVELS = (0.5, 0.75, 1.0)
# Steps between two looks at the flow.
_LOOK = 50
# Part of the momenta (rms) that is yet to come when the flow counts as at rest, by how fast it changes.
_AT_REST = 5e-5
_MOST_STEPS = 200_000
# Bytes of each node in the fluid: two sets of 19 populations, 19 sources, places, cells and what is read off.
_FLUID_NODE = 2 * 19 * 8 + 19 * 4 + 120
# Bytes of each node: whose it is, its number, how deep it lies.
_NODE = 16
# Seconds between two times that the state is saved.
_SAVE = 120.0
# Million nodes stepped in a second on one thread, and steps for each spacing across the mean radius: for the time said
# before the start.
_SPEED = 7.0
_STEPS = 200.0


@dataclass(frozen=True)
class LatticeOptions:
    """How finely to resolve.

    Parameters
    ----------
    nodes : float
        Spacings in the mean radius, on the finest lattice.
    single : bool
        That lattice only, without extrapolation and error bars.
    """

    nodes: float = 12.0
    single: bool = False

    def __post_init__(self) -> None:
        if not (math.isfinite(self.nodes) and 3.0 <= self.nodes <= 200.0):
            raise InputError(f"nodes must lie between 3 and 200 in the mean radius, not {self.nodes!r}")

    @property
    def levels(self) -> tuple[float, ...]:
        """Spacings in the mean radius, of each lattice."""
        return (self.nodes,) if self.single else tuple(part * self.nodes for part in _LEVELS)


@dataclass(frozen=True)
class Cost:
    """What a reference takes, estimated.

    Attributes
    ----------
    nodes : int
        In the fluid, on the finest lattice.
    memory : int
        [bytes]
    minutes : float
        On one thread of this kind of machine.
    """

    nodes: int
    memory: int
    minutes: float

    def __str__(self) -> str:
        return (
            f"{self.nodes / 1e6:.2g} million nodes in the fluid, {self.memory / 2**30:.2g} GiB of memory, about "
            f"{self.minutes:.2g} minutes on one thread"
        )


def cost(mesh: PoreMesh, options: LatticeOptions) -> Cost:
    """What the reference of a packing takes, before it starts."""
    total = 0.0
    for level in options.levels:
        spacing = float(mesh.packing.radii.mean()) / level
        nodes = float(np.prod(np.maximum(1.0, np.rint(mesh.box.size / spacing))))
        fluid = nodes * mesh.packing.porosity
        total += fluid * _STEPS * level
    return Cost(int(fluid), int(fluid * _FLUID_NODE + nodes * _NODE), total / (_SPEED * 1e6) / 60.0)


def lattice_reference(
    mesh: PoreMesh,
    walls: Walls,
    viscosity: float = 1.0,
    options: LatticeOptions | None = None,
    *,
    name: str = "",
    progress: Progress | None = None,
    threads: int | None = None,
    state: str | PathLike[str] | None = None,
) -> StokesReference:
    """Resolved Stokes flow through a packing, by a lattice-Boltzmann method.

    Lattices of 1/2, 3/4 and 1 times the fineness asked for. Values are extrapolated from the last two by the square of
    the spacing. Error bars are half of what that adds, and half of its difference from the extrapolation of the first
    two.

    Parameters
    ----------
    mesh : PoreMesh
        Its packing and box bound the fluid; values are read off on its facets and cells.
    walls : Walls
        At least one must have a pressure.
    viscosity : float
        Dynamic viscosity of the fluid [Pa s].
    options : LatticeOptions, optional
    name : str
        Name of the reference that is returned.
    progress : Progress, optional
        Has the stages `STAGES`; quiet by default.
    threads : int, optional
        Number of threads at most.
    state : path, optional
        File to which the state is saved every two minutes, and from which an interrupted computation of the same
        packing goes on. It is removed at the end.

    Raises
    ------
    InputError
        If no wall has a pressure, or the state is of another computation.
    ComputationError
        If the flow does not come to rest, or memory will not do.
    """
    options = options or LatticeOptions()
    progress = progress or Progress(STAGES, quiet=True)
    ensure_driven(walls)
    need, have = cost(mesh, options), available()
    progress.note(str(need))
    if have is not None and need.memory > have:
        raise ComputationError(
            f"the lattice needs {need.memory / 2**30:.1f} GiB of memory, and {have / 2**30:.1f} GiB are free: ask for "
            f"fewer nodes in a radius than {options.nodes:g}"
        )
    with limited_threads(threads or 1 << 16):
        found = _Refinement(mesh, walls, viscosity, options, progress, state).run()
    values, errors, runs = found
    return StokesReference(
        name=name,
        packing=mesh.packing,
        walls=walls,
        viscosity=viscosity,
        values=values,
        errors=errors,
        permeability=permeability_of(values, mesh, walls, viscosity),
        method="lattice-boltzmann",
        runs=runs,
        cells=mesh.cells,
        facet_vertices=mesh.facets.vertices,
        facet_cells=mesh.facets.cells,
        face_cells=mesh.wall_faces.cells,
        face_walls=mesh.wall_faces.walls,
        versions=versions("numpy", "numba"),
    )


class _Refinement:
    """The flow on each lattice in turn, each started from the one before."""

    def __init__(
        self,
        mesh: PoreMesh,
        walls: Walls,
        viscosity: float,
        options: LatticeOptions,
        progress: Progress,
        state: str | PathLike[str] | None,
    ):
        self.mesh, self.walls, self.viscosity, self.options, self.progress = mesh, walls, viscosity, options, progress
        self.low = float(np.nanmin(walls.pressures))
        self.drop = float(np.nanmax(walls.pressures)) - self.low
        self.saved = SavedState(state, mesh, walls, [viscosity, options.nodes, float(options.single)])

    def run(self) -> tuple[Values, dict[str, float], list[Any]]:
        done = self.saved.done
        before: tuple[Lattice, np.ndarray, np.ndarray] | None = None
        for number, level in enumerate(self.options.levels):
            if number < len(done):
                continue
            values, run, before = self._level(number, level, before)
            done.append((values, run))
            self.saved.keep_level()
        self.saved.remove()
        values = done[-1][0]
        errors: dict[str, float] = {}
        if len(done) > 1:
            parts = [values for values, _ in done]
            # Nodes along the longest side: the spacing is rounded to a whole number of them.
            sides = [max(run.shape) for _, run in done]
            best = [_extrapolated(parts[k], parts[k + 1], sides[k], sides[k + 1]) for k in range(len(parts) - 1)]
            errors = self._errors(best, parts[-1])
            values = best[-1]
        return values, errors, [run for _, run in done]

    def _level(
        self, number: int, level: float, before: tuple[Lattice, np.ndarray, np.ndarray] | None
    ) -> tuple[Values, LatticeRun, tuple[Lattice, np.ndarray, np.ndarray]]:
        begin = time.perf_counter()
        mesh, walls, box = self.mesh, self.walls, self.mesh.box
        # The longest side is a whole number of spacings, and so are all of a cube.
        longest = float(box.size.max())
        spacing = longest / max(1, round(longest * level / float(mesh.packing.radii.mean())))
        kinds = np.where(np.isfinite(walls.pressures), OPEN, np.where(walls.slip, SYMMETRY, NO_SLIP))
        with self.progress.stage("lattice"):
            lattice = lattice_of(mesh.packing.centres - box.lower, mesh.packing.radii, box.size, kinds, spacing)
            if len(lattice) == 0:
                raise ComputationError("no node of the lattice lies in the fluid: the packing has no void of its size")
            on_mesh = LatticeOnMesh(mesh, lattice.places, spacing)
            flow = StokesLattice(lattice, (walls.pressures - self.low) / (self.drop or 1.0))
            steps, change = self.saved.populations(number, flow)
            if steps == 0:
                self._start(flow, on_mesh, before)
            flow.send_back()
        with self.progress.stage("flow"):
            steps = self._settle(number, flow, steps, change)
        with self.progress.stage("reading off"):
            values, imbalance = read_off(flow, on_mesh, self.viscosity, self.low, self.drop)
            pressure, momentum = flow.moments()
        forces = values.sphere_total.sum(axis=0) + (values.wall_pressure + values.wall_viscous).sum(axis=0)
        thrust = self._thrust()
        run = LatticeRun(
            nodes=level,
            shape=lattice.shape,
            fluid_nodes=len(lattice),
            steps=steps,
            seconds=round(time.perf_counter() - begin, 2),
            permeability=permeability_of(values, mesh, walls, self.viscosity),
            thrust_residual=float(np.linalg.norm(forces - thrust) / max(np.abs(thrust).max(), 1e-300)),
            flux_imbalance=imbalance,
        )
        self.progress.note(f"{level:g} nodes in a radius: permeability {run.permeability:.6g} m², {run.seconds:.0f} s")
        return values, run, (lattice, pressure, momentum)

    def _start(
        self, flow: StokesLattice, on_mesh: LatticeOnMesh, before: tuple[Lattice, np.ndarray, np.ndarray] | None
    ) -> None:
        """From the coarser lattice, or from the pores' pressures: long waves of pressure take most of the time."""
        if before is None:
            pores = PoreFlow(self.mesh, self.walls, Fluid(viscosity=self.viscosity)).cell_pressure
            flow.start_from(on_mesh.pressures((pores - self.low) / (self.drop or 1.0)))
            return
        coarse, pressure, momentum = before
        ratio = flow.lattice.spacing / coarse.spacing
        points = (flow.lattice.places + 0.5) * ratio
        start = at_points(coarse.node, points, pressure)
        unknown = np.isnan(start)
        start[unknown] = pressure.mean()
        moving = np.stack([np.nan_to_num(at_points(coarse.node, points, part)) for part in momentum.T], axis=1)
        flow.start_from(start, moving / ratio)

    def _settle(self, number: int, flow: StokesLattice, steps: int, change: float) -> int:
        """Step until the flow is at rest; the number of steps."""
        last = flow.moments()[1]
        saved = time.perf_counter()
        while steps < _MOST_STEPS:
            for _ in range(_LOOK):
                flow.step()
            steps += _LOOK
            flow.send_back()
            momentum = flow.moments()[1]
            now = float(np.linalg.norm(momentum - last)) / max(float(np.linalg.norm(momentum)), 1e-300)
            # What is yet to come, if changes fall as they do.
            ratio = min(now / change, 0.999) if change > 0.0 else 0.999
            left = now * ratio / (1.0 - ratio)
            self.progress.show(f"{steps} steps  to come {left:.0e}")
            if left < _AT_REST or now == 0.0:
                return steps
            last, change = momentum, now
            if time.perf_counter() - saved > _SAVE:
                self.saved.keep_populations(number, flow, steps, change)
                saved = time.perf_counter()
        raise ComputationError(f"the flow is not at rest after {steps} steps")

    def _thrust(self) -> np.ndarray:
        """(3,): what all forces add up to, the sum of the pressures on open walls [N]."""
        pressures = np.nan_to_num(self.walls.pressures)
        inward = -WALL_NORMALS * self.mesh.box.wall_areas[:, None]
        return (pressures[:, None] * inward).sum(axis=0)

    def _errors(self, best: list[Values], finest: Values) -> dict[str, float]:
        def permeability(of: Values) -> float:
            return permeability_of(of, self.mesh, self.walls, self.viscosity)

        coarser, finer = best[0], best[-1]
        errors = {
            "permeability": 0.5 * abs(permeability(finer) - permeability(coarser))
            + 0.5 * abs(permeability(finer) - permeability(finest))
        }
        both, last = distances(finer, coarser, finer), distances(finer, finest, finer)
        return errors | {name: 0.5 * both[name] + 0.5 * last[name] for name in both}


def _extrapolated(coarse: Values, fine: Values, nodes: int, more: int) -> Values:
    """To a spacing of zero; where the coarser lattice has no node in a cell, the finer one's."""
    found = fine.extrapolated(coarse, 1.0 / ((more / nodes) ** 2 - 1.0))
    pairs = ((getattr(found, part.name), getattr(fine, part.name)) for part in fields(Values))
    return Values(*(np.where(np.isnan(value), finer, value) for value, finer in pairs))
