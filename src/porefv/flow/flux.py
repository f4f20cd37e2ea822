"""Fluxes through throats, out of pores and through walls, from a pressure field."""

from __future__ import annotations

import numpy as np

from porefv.conductance.conductances import check_conductances
from porefv.flow.pressure import PressureField, as_field
from porefv.mesh.pore_mesh import PoreMesh
from porefv.system.number_checks import ensure_finite


def fluxes(mesh: PoreMesh, conductances: np.ndarray, pressure: PressureField | np.ndarray) -> np.ndarray:
    """q = K (p_i - p_j) of each throat.

    Parameters
    ----------
    mesh : PoreMesh
    conductances : (t,) array
        K of each throat [m³/(Pa s)].
    pressure : PressureField, or (n_pores,) array
        Piezometric pressure of each pore [Pa].

    Returns
    -------
    (t,) array
        Flux from the first pore of each throat to its second; zero between isolated pores [m³/s].

    Raises
    ------
    InputError
        For arrays of the wrong shape, or with values that are not allowed.
    ComputationError
        If a flux is not a finite number.

    Notes
    -----
    Theory, method: :eq:`eq-conductance`.
    """
    conductances = check_conductances(mesh, conductances)
    field, pairs = as_field(mesh, pressure), mesh.throats.pores
    found = conductances * field.drops(pairs)
    found[field.isolated[pairs].all(axis=1)] = 0.0
    return ensure_finite(found, "fluxes")


def net_outflows(mesh: PoreMesh, flux: np.ndarray) -> np.ndarray:
    """(n_pores,): what each pore gives to its neighbours, from the fluxes of the throats (t,) [m³/s]."""
    i, j = mesh.throats.pores.T
    return np.bincount(i, flux, mesh.n_pores) - np.bincount(j, flux, mesh.n_pores)


def wall_face_fluxes(mesh: PoreMesh, outflows: np.ndarray, held: np.ndarray) -> np.ndarray:
    """(w,): flux into the sample through each wall face, from the net outflow of each pore (n_pores,) [m³/s].

    A pore's flux is divided among its faces on walls of imposed pressure, `held` (6,) bool, in proportion to their
    areas.
    """
    faces = mesh.wall_faces
    pores = mesh.cell_pore[faces.cells]
    areas = np.where(held[faces.walls], faces.areas, 0.0)
    total = np.bincount(pores, areas, mesh.n_pores)[pores]
    parts = np.divide(areas, total, out=np.zeros(len(pores)), where=total > 0.0)
    return parts * outflows[pores]


def wall_fluxes(mesh: PoreMesh, face_flux: np.ndarray) -> np.ndarray:
    """(6,): flux into the sample through each wall, from those through the wall faces (w,) [m³/s]."""
    return np.bincount(mesh.wall_faces.walls, face_flux, 6)
