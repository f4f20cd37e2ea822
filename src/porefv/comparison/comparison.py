"""Comparison of methods on a scene: all of them computed, and their errors measured from the best."""

from __future__ import annotations

from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from multiprocessing import get_context
from pathlib import Path

import numpy as np

from porefv.comparison.measurement import MethodResult, measure
from porefv.comparison.methods import RESOLVED_UP_TO, methods
from porefv.conductance.registry import MODELS
from porefv.errors import InputError, MissingExtraError
from porefv.resolved.refinement import require_ngsolve
from porefv.scenes.flow_scene import FlowScene
from porefv.solvers.solver import DIRECT_LIMIT
from porefv.system.progress import Progress


@dataclass(frozen=True)
class MethodComparison:
    """Results of all methods, against the most accurate of them.

    Attributes
    ----------
    results : list of MethodResult
    reference : MethodResult
        What errors are measured from: the resolved flow, or without it the scene's own method.
    remarks : tuple of str
        Why there is no resolved flow, and how to get it.
    """

    results: list[MethodResult]
    reference: MethodResult
    remarks: tuple[str, ...] = ()

    def errors(self, result: MethodResult) -> tuple[float, float]:
        """Error of the permeability, and of the forces (rms), relative to the reference's."""
        permeability = result.permeability / self.reference.permeability - 1.0
        scale = np.sqrt((self.reference.forces**2).sum())
        distance = np.sqrt(((result.forces - self.reference.forces) ** 2).sum())
        return float(permeability), float(distance / scale) if scale > 0.0 else float("nan")

    def is_best(self, result: MethodResult) -> bool:
        """Whether no other method has a smaller error of the forces in less time: the Pareto front."""
        error = self.errors(result)[1]
        return not any(self.errors(other)[1] < error and other.seconds < result.seconds for other in self.results)


def compare(scene_file: Path, *, resolved: bool | None = None, progress: Progress | None = None) -> MethodComparison:
    """Compute a scene by all methods.

    Parameters
    ----------
    scene_file : Path
    resolved : bool, optional
        Whether to compute the resolved Stokes flow; by default for up to `RESOLVED_UP_TO` spheres, if its extra is
        installed.
    progress : Progress, optional
        Has a stage for each method.

    Raises
    ------
    InputError
        If the scene is not fit for use, or the resolved flow is asked for and not installed.
    """
    scene = FlowScene.read(scene_file)
    scene.ensure_driven_by_pressures_of_walls()
    if not scene.walls.held.any():
        raise InputError(f"{scene_file}: no wall has a pressure, and nothing flows: there is nothing to compare")
    mesh = scene.pore_mesh()
    remarks = []
    if resolved is None:
        resolved = mesh.n_spheres <= RESOLVED_UP_TO
        try:
            require_ngsolve()
        except MissingExtraError:
            resolved = False
            remarks = ['The resolved flow needs an extra: pip install "porefv[reference]"']
        else:
            if not resolved:
                remarks = [f"The resolved flow is computed up to {RESOLVED_UP_TO} spheres, or with --resolved."]
    elif resolved:
        require_ngsolve()
    own = scene.flow.conductance.name
    results = []
    chosen = methods(tuple(MODELS), own, mesh.n_pores > DIRECT_LIMIT, bool(resolved))
    progress = progress or Progress(quiet=True)
    progress.stages = tuple(method.name for method in chosen)
    for method in chosen:
        with progress.stage(method.name), ProcessPoolExecutor(1, mp_context=get_context("spawn")) as pool:
            results.append(pool.submit(measure, scene_file, method).result())
    reference = results[-1] if resolved else next(found for found in results if found.method.conductance == own)
    return MethodComparison(results, reference, tuple(remarks))
