"""The pressure equation of a flow in FiPy's words."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from porefv.fipy.fipy_import import load_fipy
from porefv.fipy.pore_mesh import FipyPoreMesh
from porefv.flow.pore_flow import PoreFlow
from porefv.solvers.pressure_equation import reached, solve_isolated

fipy = load_fipy()


@dataclass(frozen=True, eq=False)
class FipyProblem:
    """A flow posed in FiPy: `equation.solve(var=pressure)` solves it.

    A wall of imposed flow has the pressure that porefv has found for it.

    Attributes
    ----------
    flow : PoreFlow
    """

    flow: PoreFlow

    @cached_property
    def held(self) -> np.ndarray:
        """(n_pores,) bool: pores of imposed pressure."""
        return ~np.isnan(self.flow.imposed_pressures)

    @cached_property
    def isolated(self) -> np.ndarray:
        """(n_pores,) bool: pores from which no open path leads to a pore of imposed pressure.

        The equation does not determine their pressures, and would be singular with them.
        """
        return ~reached(self.flow.mesh.throats.pores, self.flow.conductances, self.held)

    @cached_property
    def mesh(self) -> FipyPoreMesh:
        """Mesh of the pores that are neither held nor isolated."""
        return FipyPoreMesh(self.flow.mesh, self.held | self.isolated)

    @cached_property
    def coefficient(self) -> Any:
        """`fipy.FaceVariable` Γ = g / A [m²/(Pa s)]."""
        return self.mesh.coefficient(self.flow.conductances)

    @cached_property
    def pressure(self) -> Any:
        """`fipy.CellVariable` of piezometric pressure, constrained on the faces towards held pores [Pa]."""
        pressure = fipy.CellVariable(name="pressure", mesh=self.mesh, value=0.0)
        held = self.mesh.held_faces.copy()
        held[held] = self.held[self.mesh.held_pores[held]]
        values = np.zeros(self.mesh.numberOfFaces)
        values[held] = self.flow.imposed_pressures[self.mesh.held_pores[held]]
        pressure.constrain(fipy.FaceVariable(mesh=self.mesh, value=values), where=held)
        return pressure

    @cached_property
    def equation(self) -> Any:
        """`fipy.DiffusionTerm(coeff=coefficient) == 0`; with sources, == - flow per volume of a cell."""
        term = fipy.DiffusionTerm(coeff=self.coefficient)
        sources = self.flow.flow_of_sources
        if not sources.any():
            return term == 0.0
        return term == fipy.CellVariable(mesh=self.mesh, value=-sources[self.mesh.pores] / self.mesh.cellVolumes)

    def solve(self) -> np.ndarray:
        """Solve directly; the pressure of each pore, (n_pores,), held and isolated ones included [Pa].

        Isolated pores have the pressures that `porefv.solvers.solve_network` gives them.
        """
        values = np.nan_to_num(self.flow.imposed_pressures)
        if not (self.held | self.isolated).all():
            self.equation.solve(
                var=self.pressure, solver=fipy.LinearLUSolver(tolerance=1e-14, criterion="RHS", iterations=10)
            )
            values[self.mesh.pores] = self.pressure.value
        if self.isolated.any():
            throats = self.flow.mesh.throats
            rest = np.zeros(len(values))
            solve_isolated(throats.pores, self.isolated, self.held, values, rest, links=lambda: throats.areas)
        return values
