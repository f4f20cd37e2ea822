"""The one patch of FiPy that `variable.grad` needs on a FluidMesh.

FiPy's gradient is Gauss's: the sum of face values over the faces of a cell, over its volume. The faces of a pore's fluid
do not enclose its volume, for grains are missing, and FiPy asks no mesh for a gradient of its own.
"""

from __future__ import annotations

from typing import Any

from porefv.fipy.fipy_import import load_fipy

load_fipy()

from fipy.variables.gaussCellGradVariable import _GaussCellGradVariable as _Gauss  # noqa: E402  # after FiPy's options

_of_fipy = _Gauss._calcValue


def _gradient(self: Any) -> Any:
    """The gradient that the mesh has for the variable, if it has one; FiPy's otherwise."""
    of_mesh = getattr(self.mesh, "gradient", None)
    return _of_fipy(self) if of_mesh is None else of_mesh(self.var)


def patch_gradient() -> None:
    """Let FiPy ask a mesh that has a `gradient` for it. Other meshes have the gradient that they had."""
    _Gauss._calcValue = _gradient


def restore_gradient() -> None:
    """Take the patch back."""
    _Gauss._calcValue = _of_fipy
