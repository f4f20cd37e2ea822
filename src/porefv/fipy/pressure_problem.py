"""The pressure equation of a flow in FiPy's words."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from porefv.fipy.fipy_import import load_fipy
from porefv.fipy.pore_mesh import FipyPoreMesh
from porefv.flow.pore_flow import PoreFlow

fipy = load_fipy()


@dataclass(frozen=True, eq=False)
class FipyProblem:
    """A flow posed in FiPy: `equation.solve(var=pressure)` solves it.

    Attributes
    ----------
    flow : PoreFlow
    mesh : FipyPoreMesh
        Without the pores on pressure walls.
    """

    flow: PoreFlow
    mesh: FipyPoreMesh

    @cached_property
    def coefficient(self) -> Any:
        """`fipy.FaceVariable` Γ = g / A [m²/(Pa s)]."""
        return self.mesh.coefficient(self.flow.conductances)

    @cached_property
    def pressure(self) -> Any:
        """`fipy.CellVariable` of piezometric pressure, constrained on the faces towards held pores [Pa]."""
        pressure = fipy.CellVariable(name="pressure", mesh=self.mesh, value=0.0)
        held = self.mesh.held_faces
        values = np.zeros(self.mesh.numberOfFaces)
        values[held] = self.flow.imposed_pressures[self.mesh.held_pores[held]]
        pressure.constrain(fipy.FaceVariable(mesh=self.mesh, value=values), where=held)
        return pressure

    @cached_property
    def equation(self) -> Any:
        """`fipy.DiffusionTerm(coeff=coefficient) == 0`."""
        return fipy.DiffusionTerm(coeff=self.coefficient) == 0.0

    def solve(self) -> np.ndarray:
        """Solve directly; the pressure of each pore, (n_pores,), held ones included [Pa]."""
        self.equation.solve(
            var=self.pressure, solver=fipy.LinearLUSolver(tolerance=1e-14, criterion="RHS", iterations=10)
        )
        values = self.flow.imposed_pressures.copy()
        values[self.mesh.pores] = self.pressure.value
        return values
