"""Mesh of the fluid: curved tetrahedra of any order, none of them folded.

Netgen bends the faces on a sphere alone, and an element squeezed between two spheres folds. Here the bend of the
surface is carried on into the fluid by a harmonic field, which leaves hardly an element badly shaped; what is still
bad after that is bent less.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from porefv.errors import ComputationError
from porefv.resolved.fluid_geometry import fluid_body

if TYPE_CHECKING:
    import ngsolve

# Least determinant of an element's Jacobian over that of the straight element.
_LEAST = 0.1
# Points are looked up to this distance, in at most so many steps.
_CLOSE, _STEPS = 1e-9, 15
# Elements away from spheres, over those on the largest; growth of elements from small to large.
_COARSENING, _GRADING = 1.2, 0.4


@dataclass(frozen=True)
class FluidMesh:
    """Curved mesh of the fluid.

    Attributes
    ----------
    centres, radii : (n, 3) and (n,) arrays
        Of the spheres.
    mesh : ngsolve.Mesh
        Carries `deformation`.
    deformation : ngsolve.GridFunction
        From straight elements to curved ones.
    straightened : int
        Elements that had to be bent less than the surface asks for.
    """

    centres: np.ndarray
    radii: np.ndarray
    mesh: ngsolve.Mesh
    deformation: Any
    straightened: int

    def at(self, points: np.ndarray) -> tuple[Any, np.ndarray]:
        """Places in the mesh of given points (q, 3), and which of them were found, (q,) bool.

        Elements are found as if straight; the point that the deformation takes to the one looked for is found by
        iteration, which converges as the deformation is small.
        """
        import ngsolve as ngs

        position = ngs.CF((ngs.x, ngs.y, ngs.z))
        guess = points.copy()
        inside = np.ones(len(points), bool)
        for _ in range(_STEPS):
            places = self.mesh(*guess[inside].T)
            found = np.asarray(places["nr"]) >= 0
            inside[inside] = found
            places = places[found]
            if not inside.any():
                break
            step = points[inside] - np.asarray(position(places)).reshape(-1, 3)
            if np.abs(step).max() < _CLOSE:
                break
            guess[inside] += step
        return places, inside


def fluid_mesh(
    centres: np.ndarray,
    radii: np.ndarray,
    lower: np.ndarray,
    upper: np.ndarray,
    *,
    order: int,
    mesh_size: float,
    delta: float,
    regularisation: str,
) -> FluidMesh:
    """Mesh of the box less its spheres; `mesh_size` is the size of elements on a sphere over its radius.

    Parameters
    ----------
    centres, radii, lower, upper, delta, regularisation, mesh_size
        As for `porefv.resolved.fluid_geometry.fluid_body`.
    order : int
        Of the polynomials that bend the elements.

    Raises
    ------
    ComputationError
        If the mesher gives up.
    """
    import netgen.meshing
    import ngsolve as ngs

    netgen.meshing.SetMessageImportance(0)
    ngs.ngsglobals.msg_level = 0
    body = fluid_body(
        centres, radii, lower, upper, delta=delta, regularisation=regularisation, mesh_size=mesh_size
    )  # fmt: skip
    try:
        mesh = ngs.Mesh(body.GenerateMesh(maxh=_COARSENING * mesh_size * float(radii.max()), grading=_GRADING))
    except Exception as error:  # Netgen raises bare exceptions of its own
        reason = str(error).strip() or type(error).__name__
        raise ComputationError(
            f"the fluid around {len(radii)} spheres could not be meshed ({reason}): try another mesh size or delta"
        ) from None
    if mesh.ne == 0:
        raise ComputationError("the mesher gave no element: try another mesh size or delta")
    deformation, straightened = _curve(mesh, order)
    return FluidMesh(centres, radii, mesh, deformation, straightened)


def _curve(mesh: Any, order: int) -> tuple[Any, int]:
    import ngsolve as ngs

    mesh.Curve(order)
    bent = ngs.GridFunction(ngs.VectorH1(mesh, order=order))
    bent.Set(ngs.CF((ngs.x, ngs.y, ngs.z)))
    mesh.Curve(1)
    # The hierarchical basis begins with the vertices: without them it is the departure from straight elements.
    space = ngs.H1(mesh, order=order, dirichlet=".*")
    modes = bent.vec.FV().NumPy().reshape(3, space.ndof)
    modes[:, : mesh.nv] = 0.0
    _extend(mesh, space, modes)
    straightened = _unfold(mesh, space, bent, modes)
    mesh.SetDeformation(bent)
    return bent, straightened


def _extend(mesh: Any, space: Any, modes: np.ndarray) -> None:
    """Carry the bend of the surface into the fluid; small elements are stiffer."""
    import ngsolve as ngs

    u, v = space.TnT()
    form = ngs.BilinearForm(space, symmetric=True)
    form += ngs.specialcf.mesh_size ** (-1) * ngs.Grad(u) * ngs.Grad(v) * ngs.dx
    form.Assemble()
    free = space.FreeDofs()
    inverse = form.mat.Inverse(free, "sparsecholesky")
    inner = np.array(list(free), bool)
    field = ngs.GridFunction(space)
    for axis in range(3):
        field.vec.FV().NumPy()[:] = np.where(inner, 0.0, modes[axis])
        field.vec.data -= inverse @ form.mat * field.vec
        modes[axis] = field.vec.FV().NumPy()


def _unfold(mesh: Any, space: Any, bent: Any, modes: np.ndarray) -> int:
    """Bend badly shaped elements by half, as often as it takes; how many there were."""
    import ngsolve as ngs

    rule = ngs.IntegrationRule(ngs.TET, 2 * space.globalorder)
    determinant = ngs.Det(ngs.specialcf.JacobianMatrix(3))

    def determinants() -> np.ndarray:
        return np.asarray(determinant(mesh.MapToAllElements({ngs.TET: rule}, ngs.VOL))).reshape(mesh.ne, -1)

    straight = determinants()[:, :1]
    touched: set[int] = set()
    for _ in range(30):
        mesh.SetDeformation(bent)
        bad = np.flatnonzero((determinants() / straight).min(axis=1) < _LEAST)
        mesh.UnsetDeformation()
        if len(bad) == 0:
            break
        touched.update(bad.tolist())
        dofs = {dof for element in bad for dof in space.GetDofNrs(ngs.ElementId(ngs.VOL, int(element)))}
        modes[:, sorted(dofs)] *= 0.5
    return len(touched)
