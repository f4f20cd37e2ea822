"""Mean velocities of the fluid, in each pore and in the sample, from the fluxes on the faces."""

from __future__ import annotations

import numpy as np

from porefv.mesh.pore_mesh import PoreMesh


def pore_velocities(mesh: PoreMesh, flux: np.ndarray, face_flux: np.ndarray) -> np.ndarray:
    """Mean velocity of each pore, V u = ∫ u dV = ∮ x (u·n) dS for a field without divergence.

    Each throat's flux is taken to pass at the centroid of its facet, each wall face's at its own.

    Parameters
    ----------
    mesh : PoreMesh
    flux : (t,) array
        Flux of each throat, from its first pore to its second [m³/s].
    face_flux : (w,) array
        Flux into the sample through each wall face [m³/s].

    Returns
    -------
    (n_pores, 3) array [m/s]; zero for pores without volume.
    """
    throats = mesh.throats
    centres = throats.total_by_facet(mesh.facets.areas[:, None] * mesh.facets.centroids)[throats.first_facets]
    centres /= np.maximum(throats.areas, np.finfo(float).tiny)[:, None]
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
    volumes = mesh.pore_volumes[:, None]
    return np.divide(moments, volumes, out=np.zeros_like(moments), where=volumes > 0.0)


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
    return -(face_flux[:, None] * (mesh.wall_faces.centroids - middle)).sum(axis=0) / box.volume
