"""The pressure that acts on the grains around a pore, where it differs from the pressure at the pore's centre.

A conductance model may let throats begin at pore centres other than the Laguerre vertices. The pressure of a pore is
then that at its centre. The surfaces of the grains are nearer to the Laguerre vertex. The two pressures differ by a
part of the pressure drop that is lost between the vertex and the centre.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from porefv.conductance.model import ConductanceModel
from porefv.flow.pressure import PressureField, as_field, held_pressures
from porefv.flow.walls import Walls, ensure_no_imposed_flow
from porefv.mesh.cell_mesh import ensure_walls
from porefv.mesh.pore_mesh import PoreMesh

# Where between the centre of a pore and its Laguerre vertex the pressure is that acts on the grains: fitted to the
# force on small free grains.
ACTING = 0.6


@dataclass(frozen=True, eq=False)
class SolidPressureWeights:
    """Weights that interpolate the pressure acting on the grains of a pore between its own and those of its neighbours.

    Attributes
    ----------
    pores : (u, 2) array
        Pores of the throats across which pressures are interpolated.
    weights : (u, 2) array
        w of the other pore for the first and the second, which adds w (p_other - p). In each pore they add up to 1 at
        most.
    """

    pores: np.ndarray
    weights: np.ndarray

    def interpolate(self, pressure: np.ndarray) -> np.ndarray:
        """(n_pores,): pressure that acts on the grains of each pore, from the pressure of each pore (n_pores,) [Pa]."""
        differences = self.weights * (pressure[self.pores[:, ::-1]] - pressure[self.pores])
        return pressure + np.bincount(self.pores.ravel(), differences.ravel(), len(pressure))


def solid_pressure_weights(
    mesh: PoreMesh, model: ConductanceModel, conductances: np.ndarray, slip: np.ndarray, held: np.ndarray
) -> SolidPressureWeights | None:
    """Weights of the pressure that acts on the grains; None where it is the pressure of the pore itself.

    Parameters
    ----------
    mesh : PoreMesh
    model : ConductanceModel
    conductances : (t,) array
        K of each throat [m³/(Pa s)].
    slip : (6,) bool array
        Walls of symmetry.
    held : (n_pores,) bool array
        Pores of imposed pressure, which is that on their grains.

    Notes
    -----
    Theory, forces: :eq:`eq-acting-pressure`.
    """
    ensure_walls(mesh)
    beyond = model.drop_beyond_vertices(mesh.throats, slip)
    if beyond is None:
        return None
    pores = mesh.throats.pores[beyond.throats]
    closed = (conductances[beyond.throats] == 0.0)[:, None]
    weights = np.where(closed | held[pores], 0.0, ACTING * beyond.parts)
    if not weights.any():
        return None
    sums = np.bincount(pores.ravel(), weights.ravel(), mesh.n_pores)
    return SolidPressureWeights(pores, weights / np.maximum(sums, 1.0)[pores])


def acting_pressure(
    mesh: PoreMesh,
    model: ConductanceModel,
    conductances: np.ndarray,
    walls: Walls,
    pressure: PressureField | np.ndarray,
    *,
    inside: np.ndarray | None = None,
) -> PressureField:
    """The pressure that acts on the grains of each pore, from the pressures of the pores.

    Parameters
    ----------
    mesh : PoreMesh
    model : ConductanceModel
        The model that gave the conductances.
    conductances : (t,) array
        K of each throat [m³/(Pa s)].
    walls : Walls
    pressure : PressureField, or (n_pores,) array
        Piezometric pressure of each pore [Pa].
    inside : (n_pores,) array, optional
        Pressure imposed on pores, NaN where there is none [Pa].

    Notes
    -----
    Theory, forces: :eq:`eq-acting-pressure`.
    """
    ensure_no_imposed_flow(walls)
    field = as_field(mesh, pressure)
    held = ~np.isnan(held_pressures(mesh, walls.pressures, inside))
    weights = solid_pressure_weights(mesh, model, conductances, walls.slip, held)
    if weights is None:
        return field
    return replace(field, relative=weights.interpolate(field.relative), remainder=np.zeros(mesh.n_pores))
