"""Forces of the fluid on every sphere and wall, facet by facet (C12 §2.3)."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from porefv.errors import InputError
from porefv.facets import row_sums
from porefv.kernels import njit
from porefv.mesh import PoreMesh
from porefv.packing import WALLS
from porefv.patches import add_patches

if TYPE_CHECKING:
    from porefv.conductance import ConductanceModel

SHARES = ("surface", "drag")
# Throats whose forces are at hand at a time.
BLOCK = 1 << 16
# Shear on a sphere with much room, over u / r with u the throat's mean speed: Stokes', in an unbounded stream.
SHEAR = 1.5
# Where between the centre of a pore and its Laguerre vertex the pressure is that acts on its solid: fitted to the force
# on small free grains.
ACTING = 0.6


@dataclass(frozen=True, eq=False)
class Forces:
    """Forces on the solid [N], positive along the flow.

    Attributes
    ----------
    pressure, viscous, buoyancy : (n, 3) arrays
        On each sphere: C12 eq. 14, eq. 17-18 (`fluid_forces`: shares), and the weight of the fluid displaced, -ρ V g.
    wall_pressure, wall_viscous, wall_buoyancy : (6, 3) arrays
        On each wall, in the order x_min, x_max, y_min, ...: the piezometric pressure on it, the drag along it, and
        the hydrostatic pressure on it (zero at the highest corner of the box). Walls of imposed pressure are open:
        they bear none but the hydrostatic part.
    thrust : (3,) array
        Force of the imposed pressures on the ends of the sample: what all pressure and viscous forces add up to.
    scale : float
        Pressure range times section: what forces are measured against.
    """

    pressure: np.ndarray
    viscous: np.ndarray
    buoyancy: np.ndarray
    wall_pressure: np.ndarray
    wall_viscous: np.ndarray
    wall_buoyancy: np.ndarray
    thrust: np.ndarray
    scale: float

    @property
    def total(self) -> np.ndarray:
        """(n, 3): total force on each sphere [N]."""
        return self.pressure + self.viscous + self.buoyancy

    @property
    def wall_total(self) -> np.ndarray:
        """(6, 3): total force on each wall [N]."""
        return self.wall_pressure + self.wall_viscous + self.wall_buoyancy

    @property
    def sums(self) -> dict[str, np.ndarray]:
        """Sum of each part over the spheres, and over the walls [N]."""
        return {
            part: getattr(self, part).sum(axis=0)
            for part in (
                "pressure", "viscous", "buoyancy", "total",
                "wall_pressure", "wall_viscous", "wall_buoyancy", "wall_total",
            )
        }  # fmt: skip

    @property
    def conservation_residual(self) -> float:
        """Distance of the sum of all pressure and viscous forces from the thrust, relative to ΔP S."""
        parts = (self.pressure, self.viscous, self.wall_pressure, self.wall_viscous)
        residual = np.abs(sum(part.sum(axis=0) for part in parts) - self.thrust).max()
        return float(residual / self.scale) if residual != 0.0 else 0.0

    def __repr__(self) -> str:
        total = ", ".join(f"{x:.4g}" for x in self.total.sum(axis=0))
        return f"Forces({len(self.pressure)} spheres, total [{total}] N, residual {self.conservation_residual:.1e})"


def fluid_forces(
    mesh: PoreMesh,
    pressure: np.ndarray,
    pressure_walls: np.ndarray,
    slip: np.ndarray,
    *,
    reference: float = 0.0,
    weight: np.ndarray | None = None,
    shares: str = "surface",
) -> Forces:
    """Forces due to a piezometric pressure field and the weight of the fluid.

    Parameters
    ----------
    mesh : PoreMesh
    pressure : (n_pores,) array
        Piezometric pressure that acts on the solid of each pore (`acting_pressure`) less the reference [Pa].
    pressure_walls, slip : (6,) bool arrays
        Walls of imposed pressure; walls that do not drag the fluid.
    reference : float
        Pressure that all pores have besides [Pa]: pushes on the walls only.
    weight : (3,) array, optional
        Weight of a unit volume of fluid, ρ g [N/m³].
    shares : {'surface', 'drag'}
        How a throat's drop of pressure acts on the vertices of its facets. 'surface', as C12 eq. 14-18: pressure drops
        in the facet's plane, drag goes by the surface γ^k that is wetted. 'drag': pressure falls along the throat
        (`porefv.patches`), and drag goes by γ^k times the shear on it, which on a sphere with much room around goes as
        1 / r, by radius as Stokes', and on walls is less by λ, the roundness of the neck, for the cusps along them.
    """
    n = mesh.n_spheres
    on_spheres_p = np.zeros((n + 6, 3))
    on_spheres_v = np.zeros((n + 6, 3))
    cell_pressure = pressure[mesh.cell_pore]
    drops = cell_pressure[mesh.facet_cells[:, 0]] - cell_pressure[mesh.facet_cells[:, 1]]
    for rows, by_pressure, by_drag in _unit_forces(mesh, slip, shares):
        _scatter(mesh.facet_vertices[rows], drops[rows], by_pressure, by_drag, on_spheres_p, on_spheres_v)

    faces = mesh.wall_faces
    face_pressure = cell_pressure[faces.cells]
    push = np.zeros((6, 3))
    thrust = np.zeros(3)
    for wall in range(6):
        on_wall = faces.walls == wall
        axis, sense = wall // 2, (1.0 if wall % 2 else -1.0)
        force = sense * np.dot(face_pressure[on_wall], faces.areas[on_wall])
        if pressure_walls[wall]:
            thrust[axis] -= force
        else:
            push[wall, axis] = force + sense * reference * mesh.box.section(axis)
    for axis in range(3):  # on two open ends the reference cancels, without rounding
        ends = int(pressure_walls[2 * axis]) - int(pressure_walls[2 * axis + 1])
        thrust[axis] += ends * reference * mesh.box.section(axis)

    volumes = 4.0 / 3.0 * np.pi * mesh.packing.radii**3
    weight = np.zeros(3) if weight is None else np.asarray(weight, float)
    sections = np.array([mesh.box.section(axis) for axis in range(3)])
    spread = float(np.ptp(pressure)) or float(np.abs(pressure + reference).max()) or 1.0
    return Forces(
        pressure=on_spheres_p[:n],
        viscous=on_spheres_v[:n],
        buoyancy=-np.outer(volumes, weight),
        wall_pressure=on_spheres_p[n:] + push,
        wall_viscous=on_spheres_v[n:],
        wall_buoyancy=_hydrostatic(mesh, weight),
        thrust=thrust,
        scale=max(spread, abs(reference)) * float(sections.max()),
    )


def acting_weights(
    mesh: PoreMesh, model: ConductanceModel, conductances: np.ndarray, slip: np.ndarray, held: np.ndarray
) -> tuple[np.ndarray, np.ndarray] | None:
    """How the pressure that acts on the solid of a pore leans towards those of other pores; None if it never does.

    A model that has throats begin at the centres of pores (`Throats.centres`) knows the pressure there. Forces want it
    on the surfaces around, nearer to the Laguerre vertices: other by part of what throats lose in between.

    Parameters
    ----------
    mesh : PoreMesh
    model : ConductanceModel
        With a method `beyond_vertices`, or none.
    conductances : (t,) array
    slip : (6,) bool array
    held : (n_pores,) bool array
        Pores of imposed pressure, which is that on their solid.

    Returns
    -------
    pores : (u, 2) array
        Pores of the throats by which pressures lean.
    weights : (u, 2) array
        w of the other pore for the first and the second, which adds w (p_other - p). In each pore they add up to 1 at
        most.
    """
    if not hasattr(model, "beyond_vertices"):
        return None
    throats, beyond = model.beyond_vertices(mesh.throats, slip)
    pores = mesh.throats.pores[throats]
    weights = np.where((conductances[throats] == 0.0)[:, None] | held[pores], 0.0, ACTING * beyond)
    if not weights.any():
        return None
    sums = np.bincount(pores.ravel(), weights.ravel(), mesh.n_pores)
    return pores, weights / np.maximum(sums, 1.0)[pores]


def acting_pressure(leaning: tuple[np.ndarray, np.ndarray] | None, pressure: np.ndarray) -> np.ndarray:
    """(n_pores,): pressure that acts on the solid of each pore, from those at their centres and `acting_weights`."""
    if leaning is None:
        return pressure
    pores, weights = leaning
    towards = weights * (pressure[pores[:, ::-1]] - pressure[pores])
    return pressure + np.bincount(pores.ravel(), towards.ravel(), len(pressure))


def facet_forces(mesh: PoreMesh, slip: np.ndarray, shares: str = "surface") -> np.ndarray:
    """(f, 3, 3): force on each vertex of each facet for a unit pressure drop across it, pressure and drag [m²].

    `shares` as of `fluid_forces`.
    """
    forces = np.empty((len(mesh.facet_cells), 3, 3))
    for rows, by_pressure, by_drag in _unit_forces(mesh, slip, shares):
        forces[rows] = by_pressure + by_drag
    return forces


def _unit_forces(mesh: PoreMesh, slip: np.ndarray, shares: str) -> Iterator[tuple[np.ndarray, np.ndarray, np.ndarray]]:
    """Facets (m,), and forces (m, 3, 3) on their vertices for unit drops, by pressure and by drag, in blocks.

    F^{p,k} = A^k n and F^{v,k} = A^f n γ^k / Σγ, with 'drag' then moved to where they act.
    """
    if shares not in SHARES:
        raise InputError(f"unknown shares {shares!r}; known: {', '.join(SHARES)}")
    throats = mesh.throats
    weights = throats.facet_wetted_surfaces(slip)
    if shares == "drag":
        volumes = throats.total_by_facet(throats.facet_volumes)
        surfaces = throats.total_by_facet(row_sums(weights))
        roundness = np.append(throats.roundness(slip), 1.0)[throats.facet_throat]  # the last: facets within a pore
        weights = _sheared(weights, volumes, surfaces, roundness, mesh.facet_vertices, mesh.n_spheres, mesh.sizes)
    sums = throats.total_by_facet(_positive_sum(weights))
    parts = _shares(weights, sums, throats.total_by_facet(np.ones(len(sums))))
    vectors = throats.total_vectors(throats.facet_fluid_areas[:, None] * throats.facet_normals)
    facets, starts = throats.facets_of_throats
    within = np.flatnonzero(throats.facet_throat < 0)  # a united pore
    for first in [*range(0, len(throats), BLOCK), -1]:
        block = np.arange(first, min(first + BLOCK, len(throats)))
        rows = facets[starts[block[0]] : starts[block[-1] + 1]] if first >= 0 else within
        by_pressure = throats.facet_sectors[rows, :, None] * throats.facet_normals[rows, None, :]
        by_drag = parts[rows, :, None] * vectors[rows, None, :]
        if shares == "drag" and first >= 0:
            add_patches(
                block, starts, facets, mesh.facet_cells, mesh.facet_vertices, mesh.n_spheres, mesh.local_points,
                mesh.sizes, mesh.local_vertices, throats.facet_normals, throats.facet_necks, parts,
                by_pressure, by_drag,
            )  # fmt: skip
        yield rows, by_pressure, by_drag


@njit(cache=True)
def _sheared(weights, volumes, surfaces, roundness, facet_vertices, n, sizes):
    """Wetted surfaces times the shear on them, relative to that in a narrow throat: √(1 + (c R_h / r)²), on walls λ.

    It is in proportion to 1 / R_h in a throat that is narrow for its spheres, to c / r on a sphere with much room.
    """
    sheared = weights.copy()
    for f in range(weights.shape[0]):
        if volumes[f] <= 0.0 or surfaces[f] <= 0.0:
            continue
        radius = volumes[f] / surfaces[f]
        for v in range(3):
            k = facet_vertices[f, v]
            if k < n:
                sheared[f, v] *= np.sqrt(1.0 + (SHEAR * radius / sizes[k]) ** 2)
            else:
                sheared[f, v] *= roundness[f]
    return sheared


@njit(cache=True)
def _positive_sum(weights):
    """(f,): sum of the positive weights of each facet."""
    sums = np.zeros(weights.shape[0])
    for f in range(weights.shape[0]):
        for v in range(3):
            sums[f] += max(weights[f, v], 0.0)
    return sums


@njit(cache=True)
def _shares(weights, sums, facets):
    """(f, 3): γ^k / Σγ, the negative γ^k that a signed decomposition can give taken as zero.

    Where no γ^k is positive, the vertices of all the facets of the throat share equally.
    """
    shares = np.empty_like(weights)
    for f in range(weights.shape[0]):
        for v in range(3):
            shares[f, v] = max(weights[f, v], 0.0) / sums[f] if sums[f] > 0.0 else 1.0 / (3.0 * facets[f])
    return shares


@njit(cache=True)
def _scatter(facet_vertices, drops, by_pressure, by_drag, pressure, viscous):
    """Add every facet's forces to its vertices."""
    for f in range(facet_vertices.shape[0]):
        if drops[f] == 0.0:
            continue
        for v in range(3):
            k = facet_vertices[f, v]
            for axis in range(3):
                pressure[k, axis] += by_pressure[f, v, axis] * drops[f]
                viscous[k, axis] += by_drag[f, v, axis] * drops[f]


def _hydrostatic(mesh, weight):
    """(6, 3): force of a hydrostatic pressure, zero at the highest corner of the box, on each wall."""
    forces = np.zeros((len(WALLS), 3))
    size = mesh.box.size
    for wall in range(6):
        axis, upper = wall // 2, wall % 2
        # Depth below the highest corner, at the middle of the wall, of each component of the weight.
        depth = np.where(weight > 0.0, 0.5 * size, -0.5 * size)
        depth[axis] = (size[axis] if upper else 0.0) - (0.0 if weight[axis] > 0.0 else size[axis])
        forces[wall, axis] = (1.0 if upper else -1.0) * np.dot(weight, depth) * mesh.box.section(axis)
    return forces
