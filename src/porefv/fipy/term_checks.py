"""What FiPy's terms cannot do on the fluid in pores, told by name before an equation is solved."""

from __future__ import annotations

import warnings
from collections.abc import Iterator
from typing import Any

import numpy as np

from porefv.errors import InputError, TransportWarning, counted
from porefv.fipy.fipy_import import load_fipy

fipy = load_fipy()

from fipy.terms.abstractConvectionTerm import _AbstractConvectionTerm  # noqa: E402  # after FiPy's options
from fipy.terms.abstractDiffusionTerm import _AbstractDiffusionTerm  # noqa: E402
from fipy.variables.cellToFaceVariable import _CellToFaceVariable  # noqa: E402

# A flux below this part of the largest one is rounding.
_NOTHING = 1e-9
# Who calls solve() or sweep(), as seen from a check.
_CALLER = 7


def check_terms(equation: Any, variable: Any) -> None:
    """Refuse terms that are wrong on the fluid in pores; warn of those that mostly are.

    Parameters
    ----------
    equation : fipy term
    variable : fipy.CellVariable
        What the equation is solved for, of terms that name none.

    Raises
    ------
    InputError
        For a VanLeerConvectionTerm.

    Warns
    -----
    TransportWarning
        For a velocity that is no FaceVariable, for a flow through faces without a condition, for central differences
        at an inlet, and for a diffusion coefficient that is a tensor.
    """
    for term in _terms(equation):
        if isinstance(term, _AbstractConvectionTerm):
            _check_convection(term, term.var if term.var is not None else variable)
        elif isinstance(term, _AbstractDiffusionTerm):
            _check_diffusion(term, term.var if term.var is not None else variable)


def _terms(equation: Any) -> Iterator[Any]:
    if hasattr(equation, "other"):
        yield from _terms(equation.term)
        yield from _terms(equation.other)
    else:
        yield equation


def _check_convection(term: Any, variable: Any) -> None:
    name = type(term).__name__
    if isinstance(term, fipy.VanLeerConvectionTerm):
        raise InputError(
            "VanLeerConvectionTerm takes volume over area for the size of a cell, and overshoots on pores: "
            "use UpwindConvectionTerm or PowerLawConvectionTerm"
        )
    velocity = term.coeff
    if not isinstance(velocity, fipy.FaceVariable) or isinstance(velocity, _CellToFaceVariable):
        warnings.warn(
            f"the velocity of a {name} is not given on faces: what is uniform, or interpolated from pores, is not "
            "free of divergence where grains are in its way. Take flow.to_fipy().velocity",
            TransportWarning, stacklevel=_CALLER,
        )  # fmt: skip
        return
    mesh = variable.mesh
    through = np.abs(mesh.flux(velocity))
    passed = mesh.exteriorFaces.value & (through > _NOTHING * through.max(initial=0.0))
    value, slope = _mask(variable.arithmeticFaceValue), _mask(variable.faceGrad)
    open_ = passed & ~value & ~slope
    if open_.any():
        warnings.warn(
            f"{variable.name or 'the variable'} has no condition on {counted(int(open_.sum()), 'face')} that fluid "
            "passes: nothing is carried through them. Constrain its value where fluid enters, and its faceGrad, to "
            "zero, where it leaves",
            TransportWarning, stacklevel=_CALLER,
        )  # fmt: skip
    if isinstance(term, fipy.CentralDifferenceConvectionTerm) and (passed & value).any():
        warnings.warn(
            "central differences at an inlet give values out of range: use UpwindConvectionTerm or "
            "PowerLawConvectionTerm",
            TransportWarning, stacklevel=_CALLER,
        )  # fmt: skip


def _check_diffusion(term: Any, variable: Any) -> None:
    coefficient = getattr(term, "nthCoeff", None)
    rank = (
        coefficient.rank if isinstance(coefficient, fipy.FaceVariable) else np.ndim(getattr(coefficient, "value", 0.0))
    )
    if variable.rank == 0 and rank > 0:
        warnings.warn(
            "the coefficient of a DiffusionTerm is a vector or a tensor: what it carries along the faces of pores "
            "means nothing. Give a number for each face, n·D·n",
            TransportWarning, stacklevel=_CALLER,
        )  # fmt: skip


def _mask(field: Any) -> np.ndarray:
    """(f,) bool: faces on which a field is constrained, in all components."""
    mask = field.constraintMask
    values: np.ndarray = np.asarray(mask.value if hasattr(mask, "value") else mask, bool)
    return np.all(values.reshape(-1, values.shape[-1]), axis=0)
