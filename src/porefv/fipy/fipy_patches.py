"""What FiPy asks of a mesh only with a patch: the gradient of a variable, and the solver of an equation.

FiPy's gradient is Gauss's: the sum of face values over the faces of a cell, over its volume. The faces of a pore's
fluid do not enclose its volume, for grains are missing. FiPy's default solver measures its residual against a
right-hand side that values on walls swell, and may leave a time step unsolved without a word.

Both patches put a question before what FiPy does: has the mesh an answer of its own? Meshes other than `FluidMesh` have
none, and nothing changes for them. `install` is called when a `FluidMesh` is made; `remove` takes both back.
"""

from __future__ import annotations

import inspect
from typing import Any

from porefv.errors import ComputationError
from porefv.fipy.fipy_import import load_fipy

fipy = load_fipy()

from fipy.terms.term import Term  # noqa: E402  # after FiPy's options have been taken care of
from fipy.variables.gaussCellGradVariable import _GaussCellGradVariable  # noqa: E402

_SOLVER_PARAMETERS = ["self", "var", "solver", "args", "kwargs"]


def _of_fipy(owner: Any, name: str) -> Any:
    """FiPy's own function, also where this module has replaced it and is loaded once more."""
    found = getattr(owner, name, None)
    return getattr(found, "of_fipy", found)


_gradient_of_fipy = _of_fipy(_GaussCellGradVariable, "_calcValue")
_solver_of_fipy = _of_fipy(Term, "getDefaultSolver")


def _gradient(self: Any) -> Any:
    of_mesh = getattr(self.mesh, "gradient", None)
    return _gradient_of_fipy(self) if of_mesh is None else of_mesh(self.var)


def _solver(self: Any, var: Any = None, solver: Any = None, *args: Any, **kwargs: Any) -> Any:
    variable = var if var is not None else next((v for v in self._vars if v is not None), None)
    of_mesh = getattr(getattr(variable, "mesh", None), "solver_for", None)
    if of_mesh is not None:
        solver = of_mesh(self, variable, solver)
    return _solver_of_fipy(self, var, solver, *args, **kwargs)


_gradient.of_fipy = _gradient_of_fipy  # type: ignore[attr-defined]
_solver.of_fipy = _solver_of_fipy  # type: ignore[attr-defined]


def install() -> None:
    """Let FiPy ask a mesh for `gradient(variable)`, and for `solver_for(equation, variable, solver)`.

    Raises
    ------
    ComputationError
        If this FiPy has no such places.
    """
    known = _gradient_of_fipy is not None and _solver_of_fipy is not None
    if not known or list(inspect.signature(_solver_of_fipy).parameters) != _SOLVER_PARAMETERS:
        raise ComputationError(
            f"porefv does not know FiPy {fipy.__version__}: install a version that its setup.cfg names"
        )
    _GaussCellGradVariable._calcValue = _gradient
    Term.getDefaultSolver = _solver


def remove() -> None:
    """Take the patches back: a mesh of the fluid then has FiPy's gradients, which are wrong on it, and solver."""
    _GaussCellGradVariable._calcValue = _gradient_of_fipy
    Term.getDefaultSolver = _solver_of_fipy
