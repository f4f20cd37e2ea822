"""`porefv trade SCENE.toml`: the ladder of methods on the user's own scene, error against time and memory.

Every rung is computed in a process of its own, once to compile or load what it needs and then for the clock: its
memory is that of no other.
"""

from __future__ import annotations

import csv
import json
import os
import resource
import sys
import time
from collections.abc import Callable, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, replace
from multiprocessing import get_context
from pathlib import Path
from typing import Any

import numpy as np

from porefv.trade.command import SMALL

# Tolerances of the iterative solver, from coarse to the default.
TOLERANCES = (1e-2, 1e-4, 1e-6, 1e-10)


@dataclass(frozen=True)
class Rung:
    """A method: a conductance model with a solver, or the resolved flow.

    Parameters
    ----------
    name : str
    conductance : str or None
        None: the resolved flow.
    solver : str
    tolerance : float or None
        None: the default.
    """

    name: str
    conductance: str | None
    solver: str = "auto"
    tolerance: float | None = None


@dataclass(frozen=True)
class Outcome:
    """What a rung gives and what it takes.

    Attributes
    ----------
    rung : Rung
    permeability : float
        NaN unless the walls drive flow along one axis [m²].
    forces : (n, 3) array
        Pressure and viscous forces on the spheres [N].
    seconds : float
        From the packing in memory to the forces.
    memory : int
        Most that the process held, less what it held before it began [B].
    """

    rung: Rung
    permeability: float
    forces: np.ndarray
    seconds: float
    memory: int


@dataclass(frozen=True)
class Trade:
    """Outcomes of all rungs, against the best of them.

    Attributes
    ----------
    outcomes : list of Outcome
    judge : Outcome
        What errors are measured from: the resolved flow, or without it the scene's own method.
    """

    outcomes: list[Outcome]
    judge: Outcome

    def errors(self, outcome: Outcome) -> tuple[float, float]:
        """Of the permeability, and of the forces (rms), relative to the judge's."""
        permeability = outcome.permeability / self.judge.permeability - 1.0
        scale = np.sqrt((self.judge.forces**2).sum())
        distance = np.sqrt(((outcome.forces - self.judge.forces) ** 2).sum())
        return float(permeability), float(distance / scale) if scale > 0.0 else float("nan")

    def is_best(self, outcome: Outcome) -> bool:
        """Whether no other rung has smaller forces' error in less time: the Pareto front."""
        error = self.errors(outcome)[1]
        return not any(self.errors(other)[1] < error and other.seconds < outcome.seconds for other in self.outcomes)


def ladder(conductances: Sequence[str], own: str, iterative: bool, resolved: bool) -> list[Rung]:
    """Rungs from coarse to fine: all conductance models, tolerances of the scene's own, the resolved flow."""
    rungs = [Rung(name, name) for name in conductances]
    if iterative:
        rungs += [Rung(f"{own}, cg to {tolerance:.0e}", own, "cg", tolerance) for tolerance in TOLERANCES]
    if resolved:
        rungs.append(Rung("resolved Stokes flow", None))
    return rungs


def climb(scene_file: Path, rung: Rung) -> Outcome:
    """Compute one rung of a scene."""
    from porefv.scene import Scene

    scene = Scene.read(scene_file)
    if rung.conductance is None:
        return _resolve(scene, rung)
    from porefv.conductance import conductance_model

    model = scene.flow.conductance
    if rung.conductance != model.name:
        model = conductance_model(rung.conductance)
    options = replace(scene.flow, conductance=model, solver=rung.solver, tolerance=rung.tolerance)
    scene = replace(scene, flow=options)
    packing = scene.read_packing()

    def run() -> tuple[float, np.ndarray]:
        flow = scene.pore_flow(scene.pore_mesh(packing))
        forces = flow.forces.pressure + flow.forces.viscous
        return (flow.permeability if flow.walls.axis is not None else float("nan")), forces

    run()
    before = _held()
    begin = time.perf_counter()
    permeability, forces = run()
    return Outcome(rung, permeability, forces, time.perf_counter() - begin, max(_most_held() - before, 0))


def _resolve(scene: Any, rung: Rung) -> Outcome:
    from porefv.reference import Options, stokes_reference

    mesh = scene.pore_mesh()
    before = _held()
    begin = time.perf_counter()
    found = stokes_reference(mesh, scene.walls, scene.fluid.viscosity, Options(single=True))
    seconds = time.perf_counter() - begin
    return Outcome(rung, found.permeability, found.values.sphere_total, seconds, _most_held() - before)


def _most_held() -> int:
    """Largest resident size of this process so far [B]."""
    unit = 1 if sys.platform == "darwin" else 1024
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * unit


def _held() -> int:
    """Resident size of this process now [B]; the largest so far where the system does not say."""
    try:
        pages = int(Path("/proc/self/statm").read_text(encoding="ascii").split()[1])
    except OSError:
        return _most_held()
    return pages * os.sysconf("SC_PAGE_SIZE")


def trade(scene_file: Path, *, resolved: bool | None = None, report: Callable[[str], None] | None = None) -> Trade:
    """Climb the ladder on a scene.

    Parameters
    ----------
    scene_file : Path
    resolved : bool, optional
        Whether to compute the resolved Stokes flow; by default for up to `SMALL` spheres, if its extra is installed.
    report : function, optional
        Called with the name of each rung before it is computed.

    Raises
    ------
    InputError
        If the scene is not fit for use, or the resolved flow is asked for and not installed.
    """
    from porefv.conductance import MODELS
    from porefv.errors import InputError, MissingExtraError
    from porefv.reference.study import require_ngsolve
    from porefv.scene import Scene
    from porefv.solvers import DIRECT_LIMIT

    scene = Scene.read(scene_file)
    if np.isnan(scene.walls.pressures).all():
        raise InputError(f"{scene_file}: no wall has a pressure, and nothing flows: there is nothing to trade")
    mesh = scene.pore_mesh()
    if resolved is not False:
        try:
            require_ngsolve()
        except MissingExtraError:
            if resolved:
                raise
            resolved = False
        if resolved is None:
            resolved = mesh.n_spheres <= SMALL
    own = scene.flow.conductance.name
    outcomes = []
    for rung in ladder(tuple(MODELS), own, mesh.n_pores > DIRECT_LIMIT, bool(resolved)):
        if report:
            report(rung.name)
        with ProcessPoolExecutor(1, mp_context=get_context("spawn")) as pool:
            outcomes.append(pool.submit(climb, scene_file, rung).result())
    judge = outcomes[-1] if resolved else next(o for o in outcomes if o.rung.conductance == own)
    return Trade(outcomes, judge)


# ---- what the user sees -------------------------------------------------------------------------------------------


def table(found: Trade) -> str:
    """The ladder as text."""
    width = max(len(outcome.rung.name) for outcome in found.outcomes)
    judged = (
        "the resolved flow" if found.judge.rung.conductance is None else f"{found.judge.rung.name}, for want of better"
    )
    lines = [
        f"{'':{width}}  {'permeability':>12}  {'error':>8}  {'forces, rms':>11}  {'time':>9}  {'memory':>8}",
    ]
    for outcome in found.outcomes:
        permeability, forces = found.errors(outcome)
        judge = outcome is found.judge
        lines.append(
            f"{outcome.rung.name:{width}}  {outcome.permeability:>12.5g}  "
            f"{'-' if judge or np.isnan(permeability) else f'{100 * permeability:+.2g} %':>8}  "
            f"{'-' if judge else f'{100 * forces:.2g} %':>11}  {_time(outcome.seconds):>9}  "
            f"{outcome.memory / 2**20:>5.0f} MB{'  *' if found.is_best(outcome) else ''}"
        )
    lines.append(f"Errors are distances from {judged}. * No other rung has better forces in less time.")
    return "\n".join(lines)


def _time(seconds: float) -> str:
    return f"{1e3 * seconds:.3g} ms" if seconds < 1.0 else f"{seconds:.3g} s"


def save(found: Trade, folder: Path) -> None:
    """trade.csv, trade.png and summary.json in a directory."""
    with (folder / "trade.csv").open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file)
        writer.writerow(["rung", "permeability_m2", "permeability_error", "forces_error", "seconds", "memory_bytes"])
        for outcome in found.outcomes:
            errors = found.errors(outcome)
            writer.writerow([outcome.rung.name, outcome.permeability, *errors, outcome.seconds, outcome.memory])
    summary = {"kind": "trade", "judge": found.judge.rung.name}
    (folder / "summary.json").write_text(json.dumps(summary, indent=2), encoding="utf-8")
    draw(found, folder / "trade.png")


def draw(found: Trade, path: Path) -> None:
    """Error of the forces against time and against memory, the Pareto front joined."""
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    figure, axes = plt.subplots(1, 2, figsize=(10, 4.2), sharey=True, layout="constrained")
    others = [outcome for outcome in found.outcomes if outcome is not found.judge]
    for axis, measure, label in (
        (axes[0], lambda outcome: outcome.seconds, "time, s"),
        (axes[1], lambda outcome: outcome.memory / 2**20, "memory, MB"),
    ):
        for outcome in others:
            error = max(found.errors(outcome)[1], 1e-12)
            axis.loglog(measure(outcome), error, "o", label=outcome.rung.name)
        best = sorted((o for o in others if found.is_best(o)), key=measure)
        axis.loglog([measure(o) for o in best], [max(found.errors(o)[1], 1e-12) for o in best], "k-", lw=0.7, zorder=0)
        if found.judge.rung.conductance is None:
            axis.axvline(measure(found.judge), color="k", ls=":", label="resolved Stokes flow")
        axis.set_xlabel(label)
    axes[0].set_ylabel("error of the forces, rms")
    axes[1].legend(fontsize=8, loc="center left", bbox_to_anchor=(1.0, 0.5))
    figure.savefig(path, dpi=110)
