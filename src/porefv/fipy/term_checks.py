"""What FiPy's terms cannot do on the fluid in pores, told by name before an equation is solved."""

from __future__ import annotations

import warnings
import weakref
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
# What pores may gain or lose of all that passes them, in a velocity that is free of divergence.
_DIVERGENCE = 1e-2
# Who calls solve() or sweep(), as seen from a warning.
_CALLER = 6

_told: weakref.WeakKeyDictionary[Any, set[str]] = weakref.WeakKeyDictionary()
_meshes: weakref.WeakKeyDictionary[Any, weakref.ref[Any]] = weakref.WeakKeyDictionary()


def check_terms(equation: Any, variable: Any) -> None:
    """Refuse terms that are wrong on the fluid in pores; warn of those that mostly are, once for each equation.

    Parameters
    ----------
    equation : fipy term
    variable : fipy.CellVariable
        What the equation is solved for, of terms that name none.

    Raises
    ------
    InputError
        For a VanLeerConvectionTerm, and for an equation that has been solved on another mesh.

    Warns
    -----
    TransportWarning
        For a velocity that is interpolated from cells or not free of divergence, for a flow through faces without a
        condition, for central differences at an inlet, and for a diffusion coefficient that is a tensor.
    """
    mesh = _meshes.get(equation)
    if mesh is not None and mesh() is not variable.mesh:
        raise InputError(
            "this equation has been solved on another mesh, whose geometry FiPy keeps in its terms: make it anew"
        )
    _meshes[equation] = weakref.ref(variable.mesh)
    told = _told.setdefault(equation, set())
    for term in _terms(equation):
        of_term = term.var if term.var is not None else variable
        if isinstance(term, _AbstractConvectionTerm):
            found = _of_convection(term, of_term)
        elif isinstance(term, _AbstractDiffusionTerm):
            found = _of_diffusion(term, of_term)
        else:
            continue
        for message in found:
            if message not in told:
                told.add(message)
                warnings.warn(message, TransportWarning, stacklevel=_CALLER)


def _terms(equation: Any) -> Iterator[Any]:
    if hasattr(equation, "other"):
        yield from _terms(equation.term)
        yield from _terms(equation.other)
    else:
        yield equation


def _of_convection(term: Any, variable: Any) -> Iterator[str]:
    name = type(term).__name__
    if isinstance(term, fipy.VanLeerConvectionTerm):
        raise InputError(
            "VanLeerConvectionTerm takes volume over area for the size of a cell, and overshoots on pores: "
            "use UpwindConvectionTerm or PowerLawConvectionTerm"
        )
    velocity = term.coeff
    if not isinstance(velocity, fipy.FaceVariable) or isinstance(velocity, _CellToFaceVariable):
        yield (
            f"the velocity of a {name} is not given on faces: what is uniform, or interpolated from pores, is not "
            "free of divergence where grains are in its way. Take flow.to_fipy().velocity"
        )
        return
    mesh = variable.mesh
    flux = mesh.flux(velocity)
    through = np.abs(flux)
    # Twice what passes the pores, for all faces between two of them count with both.
    gained = float(np.abs(np.asarray(velocity.divergence.value) * mesh.cellVolumes).sum())
    if gained > _DIVERGENCE * through.sum():
        yield (
            f"pores gain or lose {100.0 * gained / through.sum():.0f} % of what the velocity of a {name} carries: a "
            "uniform or interpolated velocity does not go round grains. Take flow.to_fipy().velocity, unless the fluid "
            "is stored or injected"
        )
    passed = mesh.exteriorFaces.value & (through > _NOTHING * through.max(initial=0.0))
    value, slope = _mask(variable.arithmeticFaceValue), _mask(variable.faceGrad)
    open_ = int((passed & ~value & ~slope).sum())
    if open_:
        yield (
            f"{variable.name or 'the variable'} has no condition on {counted(open_, 'face')} that fluid passes: "
            "nothing is carried through them. Constrain its value where fluid enters, and its faceGrad, to zero, where "
            "it leaves"
        )
    loose = int((passed & (flux < 0.0) & ~value & slope).sum())
    if loose:
        yield (
            f"{variable.name or 'the variable'} has no value on {counted(loose, 'face')} through which fluid enters: "
            "it enters with the value of the pore. Constrain its value there"
        )
    if isinstance(term, fipy.CentralDifferenceConvectionTerm) and (passed & value).any():
        yield (
            "central differences at an inlet give values out of range: use UpwindConvectionTerm or "
            "PowerLawConvectionTerm"
        )


def _of_diffusion(term: Any, variable: Any) -> Iterator[str]:
    coefficient = getattr(term, "nthCoeff", None)
    if isinstance(coefficient, fipy.FaceVariable):
        rank = coefficient.rank
    else:
        rank = np.ndim(getattr(coefficient, "value", 0.0))
    if variable.rank == 0 and rank > 0:
        yield (
            "the coefficient of a DiffusionTerm is a vector or a tensor: what it carries along the faces of pores "
            "means nothing. Give a number for each face, n·D·n"
        )
    if term.order > 2 and (_mask(variable.arithmeticFaceValue).any() or _mask(variable.faceGrad).any()):
        yield (
            f"FiPy's constrain() does not reach a DiffusionTerm of order {term.order}: give its conditions as "
            "boundaryConditions, with FixedValue and NthOrderBoundaryCondition"
        )


def _mask(field: Any) -> np.ndarray:
    """(f,) bool: faces on which a field is constrained, in all components."""
    mask = field.constraintMask
    values: np.ndarray = np.asarray(mask.value if hasattr(mask, "value") else mask, bool)
    return np.all(values.reshape(-1, values.shape[-1]), axis=0)
