"""Mean velocities of the fluid, in each pore and in the sample, from the fluxes on the faces."""

from __future__ import annotations

import numpy as np

from porefv.mesh.cell_mesh import ensure_walls
from porefv.mesh.pore_mesh import PoreMesh


def pore_velocities(
    mesh: PoreMesh, flux: np.ndarray, face_flux: np.ndarray, injected: np.ndarray | None = None
) -> np.ndarray:
    """Mean velocity of each pore, V u = ∫ u dV = ∮ x (u·n) dS - ∫ x (∇·u) dV.

    Each throat's flux is taken to pass at the centroid of its facet, each wall face's at its own. What is injected
    into a pore enters at the mean of the centroids of its throats, weighted by their areas.

    Parameters
    ----------
    mesh : PoreMesh
    flux : (t,) array
        Flux of each throat, from its first pore to its second [m³/s].
    face_flux : (w,) array
        Flux into the sample through each wall face [m³/s].
    injected : (n_pores,) array, optional
        Volume injected into each pore per unit time, other than through walls [m³/s].

    Returns
    -------
    (n_pores, 3) array [m/s]; zero for pores without volume.

    Notes
    -----
    Theory, method: :eq:`eq-pore-velocity`.
    """
    ensure_walls(mesh)
    throats, centres = mesh.throats, throat_centroids(mesh)
    i, j = throats.pores.T
    faces = mesh.wall_faces
    pores = mesh.cell_pore[faces.cells]
    moments = np.empty((mesh.n_pores, 3))
    for axis in range(3):
        through = flux * centres[:, axis]
        moments[:, axis] = (
            np.bincount(i, through, mesh.n_pores)
            - np.bincount(j, through, mesh.n_pores)
            - np.bincount(pores, face_flux * faces.centroids[:, axis], mesh.n_pores)
        )
        if injected is not None:
            weighted = throats.areas * centres[:, axis]
            moments[:, axis] -= (
                injected * _by_pore(mesh, weighted) / np.maximum(_by_pore(mesh, throats.areas), np.finfo(float).tiny)
            )
    volumes = mesh.pore_volumes[:, None]
    return np.divide(moments, volumes, out=np.zeros_like(moments), where=volumes > 0.0)


def throat_centroids(mesh: PoreMesh) -> np.ndarray:
    """(t, 3): centroid of the facets of each throat, from the mesh's local origin [m]."""
    throats = mesh.throats
    centres = throats.total_by_facet(mesh.facets.areas[:, None] * mesh.facets.centroids)[throats.first_facets]
    return centres / np.maximum(throats.areas, np.finfo(float).tiny)[:, None]


def _by_pore(mesh: PoreMesh, values: np.ndarray) -> np.ndarray:
    """(n_pores,): sums over the throats of each pore, of values of throats (t,)."""
    i, j = mesh.throats.pores.T
    return np.bincount(i, values, mesh.n_pores) + np.bincount(j, values, mesh.n_pores)


def darcy_velocity(mesh: PoreMesh, face_flux: np.ndarray) -> np.ndarray:
    """Mean of the velocity over the box, grains at rest included: ∫ u dV = ∮ x (u·n) dS over the walls.

    Between two opposite walls its component along their axis is Q / S.

    Parameters
    ----------
    mesh : PoreMesh
    face_flux : (w,) array
        Flux into the sample through each wall face, taken to pass at its centroid [m³/s].

    Returns
    -------
    (3,) array [m/s]
    """
    box = mesh.box
    # From the middle of the box, so that an imbalance of the fluxes has the least effect.
    middle = 0.5 * (box.lower + box.upper) - mesh.triangulation.origin
    return (face_flux[:, None] * (middle - mesh.wall_faces.centroids)).sum(axis=0) / box.volume + 0.0  # no -0
