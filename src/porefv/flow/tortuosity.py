"""Hydraulic tortuosity: how much longer the paths of the fluid are than the sample."""

from __future__ import annotations

import numpy as np

from porefv.mesh.pore_mesh import PoreMesh
from porefv.packing.box import WALL_AXES


def hydraulic_tortuosity(mesh: PoreMesh, flux: np.ndarray, face_flux: np.ndarray, axis: int) -> float:
    """T = ∫ |u| dV / ∫ u·e dV, mean size of the velocity over its mean along the axis (Duda, Koza & Matyka 2011).

    In a network, |u| integrates to |q| l over a throat of flux q and length l, and u·e to Q H over the sample:
    T = Σ |q| l / (Q H), with H the distance of the two walls and Q the flux between them. The length l of a throat is
    the distance of the Laguerre vertices of its two pores. The fluid passes straight between a wall and the Laguerre
    vertex of a pore on it.

    Parameters
    ----------
    mesh : PoreMesh
    flux : (t,) array
        Flux of each throat [m³/s].
    face_flux : (w,) array
        Flux into the sample through each wall face [m³/s].
    axis : int
        Of the pair of opposite walls between which the fluid flows: 0, 1 or 2.

    Returns
    -------
    float
        1 or more, as q l·e adds up to Q H; NaN if nothing flows.

    References
    ----------
    A. Duda, Z. Koza, M. Matyka: Hydraulic tortuosity in arbitrary porous media flow. Phys. Rev. E 84, 036319 (2011).
    """
    points, faces, box = mesh.pore_centres, mesh.wall_faces, mesh.box
    i, j = mesh.throats.pores.T
    lengths = np.linalg.norm(points[j] - points[i], axis=1)
    across = WALL_AXES[faces.walls]
    beside = mesh.cell_pore[faces.cells]
    to_walls = np.abs(points[beside, across] - box.wall_places[faces.walls])
    passing = 0.5 * np.abs(face_flux[across == axis]).sum()
    if passing == 0.0:
        return np.nan
    paths = (np.abs(flux) * lengths).sum() + (np.abs(face_flux) * to_walls).sum()
    return float(paths / (passing * box.size[axis]))
