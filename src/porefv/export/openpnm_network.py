"""Pores and throats as a plain dictionary in the names of OpenPNM, the pore-network package, which is not needed."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from porefv.flow.pore_flow import PoreFlow
from porefv.flow.walls import Walls
from porefv.mesh.cell_mesh import ensure_walls
from porefv.mesh.pore_mesh import PoreMesh
from porefv.packing.box import WALLS
from porefv.solvers.pressure_equation import reached


def mesh_to_openpnm(mesh: PoreMesh) -> dict[str, np.ndarray]:
    """The pores and throats of a mesh: the part of `openpnm_network` that needs no flow."""
    ensure_walls(mesh)
    throats = mesh.throats
    return openpnm_network(
        mesh.pore_centres,
        throats.pores,
        pore_data={"volume": mesh.pore_volumes, "walls": mesh.pore_walls},
        throat_data={"length": throats.lengths, "area": throats.areas, "fluid_area": throats.fluid_areas},
    )


def flow_to_openpnm(flow: PoreFlow) -> dict[str, np.ndarray]:
    """The pores and throats of a flow, with conductances, fluxes, pressures, and the imposed pressures."""
    mesh, throats = flow.mesh, flow.mesh.throats
    return openpnm_network(
        mesh.pore_centres,
        throats.pores,
        pore_data={"volume": mesh.pore_volumes, "walls": mesh.pore_walls, "pressure": flow.pressure},
        throat_data={
            "length": throats.lengths, "area": throats.areas, "fluid_area": throats.fluid_areas,
            "conductance": flow.conductances, "flux": flow.flux,
        },
        walls=flow.walls,
    )  # fmt: skip


def openpnm_network(
    points: np.ndarray,
    pairs: np.ndarray,
    *,
    pore_data: Mapping[str, np.ndarray],
    throat_data: Mapping[str, np.ndarray],
    walls: Walls | None = None,
) -> dict[str, np.ndarray]:
    """A network in the names of OpenPNM.

    OpenPNM wants one throat between two pores at most. Throats between the same two pores are parallel: they become
    one, with the sums of their conductances, fluxes and cross-sections, and the mean of their lengths, weighted with
    the areas of their facets.

    Parameters
    ----------
    points : (n, 3) array
        Laguerre vertex of each pore [m].
    pairs : (t, 2) int array
        Pores of each throat.
    pore_data : mapping
        (n,) arrays `volume` [m³], `walls` (`PoreMesh.pore_walls`) and, if known, `pressure` [Pa].
    throat_data : mapping
        (t,) arrays `length` [m], `area`, `fluid_area` [m²] and, if known, `conductance` [m³/(Pa s)] and `flux` [m³/s].
    walls : Walls, optional
        With the imposed pressures of a flow.

    Returns
    -------
    dict of str to array
        With n pores and u throats:

        ``pore.coords`` (n, 3) [m], ``pore.volume`` (n,) [m³], ``pore.all`` (n,) bool; ``pore.x_min`` ...
        ``pore.z_max`` (n,) bool: pores with a face on the wall.

        ``throat.conns`` (u, 2) int, the smaller pore first, in lexicographic order; ``throat.all`` (u,) bool;
        ``throat.length`` (u,) [m], ``throat.cross_sectional_area`` (u,) [m²], of the fluid.

        Of a flow also ``throat.hydraulic_conductance`` (u,) [m³/(Pa s)], ``throat.flux`` (u,), from the smaller pore to
        the other [m³/s], ``pore.pressure`` (n,) [Pa], ``pore.imposed_pressure`` (n,), NaN for pores without [Pa], and
        ``pore.isolated`` (n,) bool: pores that no flow reaches from those, to be trimmed before OpenPNM solves.
    """
    lower, upper = np.sort(pairs, axis=1).astype(np.int64).T
    n = len(points)
    keys, throat = np.unique(lower * n + upper, return_inverse=True)
    conns = np.stack(np.divmod(keys, n), axis=1)
    bits = pore_data["walls"].astype(int)
    network = {
        "pore.all": np.ones(n, bool),
        "pore.coords": np.array(points, float),
        "pore.volume": np.array(pore_data["volume"], float),
        **{f"pore.{wall}": (bits >> w) & 1 == 1 for w, wall in enumerate(WALLS)},
        "throat.all": np.ones(len(conns), bool),
        "throat.conns": conns,
        "throat.length": _sums(throat_data["area"] * throat_data["length"], throat)
        / _sums(throat_data["area"], throat),
        "throat.cross_sectional_area": _sums(np.maximum(throat_data["fluid_area"], 0.0), throat),
    }
    if "pressure" in pore_data:
        network["pore.pressure"] = np.array(pore_data["pressure"], float)
    if "conductance" in throat_data:
        network["throat.hydraulic_conductance"] = _sums(throat_data["conductance"], throat)
        sense = np.where(pairs[:, 0] == lower, 1.0, -1.0)
        network["throat.flux"] = _sums(sense * throat_data["flux"], throat)
    if walls is not None:
        network["pore.imposed_pressure"] = _imposed(bits, walls)
        held = ~np.isnan(network["pore.imposed_pressure"])
        network["pore.isolated"] = ~reached(conns.astype(np.int32), network["throat.hydraulic_conductance"], held)
    return network


def _sums(values: np.ndarray, throat: np.ndarray) -> np.ndarray:
    return np.bincount(throat, values)


def _imposed(bits: np.ndarray, walls: Walls) -> np.ndarray:
    """(n,): pressure of the pores on walls with one, the mean of several, NaN elsewhere [Pa]."""
    held = np.flatnonzero(walls.held)
    touches = (bits[:, None] >> held) & 1
    count = touches.sum(axis=1)
    return np.divide(touches @ walls.pressures[held], count, out=np.full(len(bits), np.nan), where=count > 0)
