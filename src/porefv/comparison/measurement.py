"""What a method finds on a scene, and the time and memory that it takes.

Each method is computed in a process of its own: its memory is that of no other.
"""

from __future__ import annotations

import time
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from porefv.comparison.methods import Method
from porefv.conductance.registry import conductance_model
from porefv.scenes.flow_scene import FlowScene
from porefv.solvers.solver import TOLERANCE
from porefv.system.memory import peak_resident, resident


@dataclass(frozen=True)
class MethodResult:
    """What a method finds and what it takes.

    Attributes
    ----------
    method : Method
    permeability : float
        NaN unless the walls drive flow along one axis [m²].
    forces : (n, 3) array
        Pressure and viscous forces on the spheres [N].
    seconds : float
        From the packing in memory to the forces.
    memory : float
        Peak of what the process had in use, less what it had before; NaN where the system does not say [B].
    """

    method: Method
    permeability: float
    forces: np.ndarray
    seconds: float
    memory: float


def measure(scene_file: Path, method: Method) -> MethodResult:
    """Compute a scene by a method, once to compile or load what it needs and then for the clock."""
    scene = FlowScene.read(scene_file)
    if method.conductance is None:
        return _resolve(scene, method)
    model = scene.flow.conductance
    if method.conductance != model.name:
        model = conductance_model(method.conductance)
    tolerance = TOLERANCE if method.tolerance is None else method.tolerance
    options = replace(scene.flow, conductance=model, solver=method.solver, tolerance=tolerance)
    scene = scene.model_copy(update={"flow": options})
    packing = scene.read_packing()

    def run() -> tuple[float, np.ndarray]:
        flow = scene.pore_flow(scene.pore_mesh(packing))
        forces = flow.forces.pressure + flow.forces.viscous
        return (flow.permeability if flow.walls.axis is not None else float("nan")), forces

    run()
    before = resident()
    begin = time.perf_counter()
    permeability, forces = run()
    return MethodResult(method, permeability, forces, time.perf_counter() - begin, _taken(before))


def _resolve(scene: FlowScene, method: Method) -> MethodResult:
    from porefv.resolved.refinement import Options, stokes_reference

    mesh = scene.pore_mesh()
    before = resident()
    begin = time.perf_counter()
    found = stokes_reference(mesh, scene.walls, scene.fluid.viscosity, Options(single=True))
    seconds = time.perf_counter() - begin
    return MethodResult(method, found.permeability, found.values.sphere_total, seconds, _taken(before))


def _taken(before: int | None) -> float:
    """Bytes that the process has taken at its peak since it had so many in use; NaN if that is not known."""
    peak = peak_resident()
    return float("nan") if before is None or peak is None else max(peak - before, 0)
