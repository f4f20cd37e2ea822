"""Forces of the fluid on every sphere and wall, facet by facet (C12 §2.3)."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from porefv.conductance.model import FORCE_SPLITS, ForceSplit
from porefv.errors import InputError
from porefv.flow.pressure import PressureField, as_field
from porefv.flow.pressure_along_throats import ThroatDrops, apply_pressure_along_throats
from porefv.flow.walls import Walls
from porefv.mesh.facet_kernels import row_sums
from porefv.mesh.pore_mesh import PoreMesh
from porefv.packing.box import WALL_AXES, WALL_NORMALS, WALL_SENSES
from porefv.packing.overlaps import sphere_volumes
from porefv.system.kernels import kernel
from porefv.system.number_checks import three_numbers
from porefv.system.threads import for_rows

# Throats whose forces are in memory at a time.
BLOCK = 1 << 16
# Shear on a sphere with much room, over u / r with u the throat's mean speed: Stokes', in an unbounded stream.
SHEAR = 1.5


@dataclass(frozen=True, eq=False)
class Forces:
    """Forces on the solid [N], positive along the flow.

    Attributes
    ----------
    pressure, viscous, buoyancy : (n, 3) arrays
        On each sphere: C12 eq. 14, eq. 17-18 (`grain_forces`: split), and the weight of the fluid displaced, -ρ V g.
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


def grain_forces(
    mesh: PoreMesh,
    pressure: PressureField | np.ndarray,
    walls: Walls,
    split: ForceSplit = "surface",
    *,
    weight: np.ndarray | None = None,
) -> Forces:
    """Forces on spheres and walls due to a piezometric pressure field and the weight of the fluid.

    Parameters
    ----------
    mesh : PoreMesh
    pressure : PressureField, or (n_pores,) array
        Piezometric pressure that acts on the grains of each pore [Pa]: for a model with pore centres, such as section
        friction, what `acting_pressure` gives; else the pressure of the pores.
    walls : Walls
        Which walls have a pressure, and which do not drag the fluid.
    split : {'surface', 'drag'}
        How the pressure drop of a throat acts on the vertices of its facets. 'surface', as C12 eq. 14-18: the pressure
        drops in the facet's plane, and drag is divided by the wetted surfaces γ^k. 'drag': the pressure falls along the
        throat (`porefv.flow.pressure_along_throats`), and drag is divided by γ^k times the shear on it. That shear
        varies as 1 / r on a sphere with much room around it, as in Stokes' law; on walls it is multiplied by the
        roundness λ of the constriction, because of the cusps along them.
    weight : (3,) array, optional
        Weight of a unit volume of fluid, ρ g [N/m³].

    Returns
    -------
    Forces

    Raises
    ------
    InputError
        For an unknown split, or pressures of the wrong shape or not finite.
    """
    field = as_field(mesh, pressure)
    relative, reference = field.relative, field.reference
    n = mesh.n_spheres
    on_spheres_p = np.zeros((n + 6, 3))
    on_spheres_v = np.zeros((n + 6, 3))
    cell_pressure = relative[mesh.cell_pore]
    drops = cell_pressure[mesh.facets.cells[:, 0]] - cell_pressure[mesh.facets.cells[:, 1]]
    for rows, forces in _unit_forces(mesh, walls.slip, split):
        _scatter(mesh.facets.vertices[rows], drops[rows], forces, on_spheres_p, on_spheres_v)

    sections = np.array([mesh.box.section(axis) for axis in range(3)])
    faces = mesh.wall_faces
    face_pressure = cell_pressure[faces.cells]
    push = np.zeros((6, 3))
    thrust = np.zeros(3)
    for wall, (axis, sense, held) in enumerate(zip(WALL_AXES, WALL_SENSES, walls.held, strict=True)):
        on_wall = faces.walls == wall
        force = sense * np.dot(face_pressure[on_wall], faces.areas[on_wall])
        if held:
            thrust[axis] -= force
        else:
            push[wall, axis] = force + sense * reference * mesh.box.section(axis)
    # On two open ends the reference cancels, without rounding.
    thrust += -(WALL_NORMALS * walls.held[:, None]).sum(axis=0) * reference * sections

    volumes = sphere_volumes(mesh.packing.radii)
    weight = np.zeros(3) if weight is None else three_numbers(weight, "weight", "N/m³")
    spread = float(np.ptp(relative)) or float(np.abs(field.pressure).max()) or 1.0
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


def facet_forces(mesh: PoreMesh, slip: np.ndarray, split: ForceSplit = "surface") -> np.ndarray:
    """(f, 3, 3): force on each vertex of each facet for a unit pressure drop across it, pressure and drag [m²].

    `slip` (6,) bool marks the walls that do not drag the fluid; `split` is as of `grain_forces`.
    """
    forces = np.empty((len(mesh.facets.cells), 3, 3))
    for rows, unit_forces in _unit_forces(mesh, slip, split):
        forces[rows] = unit_forces.pressure + unit_forces.drag
    return forces


class UnitForces(NamedTuple):
    """Forces on the vertices of some facets for a unit pressure drop across each, along the axes.

    Attributes
    ----------
    pressure, drag : (m, 3, 3) arrays
        By pressure and by drag [m²].
    """

    pressure: np.ndarray
    drag: np.ndarray


def _unit_forces(mesh: PoreMesh, slip: np.ndarray, split: ForceSplit) -> Iterator[tuple[np.ndarray, UnitForces]]:
    """Facets (m,), and the forces on their vertices for unit drops, in blocks.

    F^{p,k} = A^k n and F^{v,k} = A^f n γ^k / Σγ. With the split 'drag', the part of the drag that is pressure on the
    spheres along the throat is moved from the second to the first.
    """
    if split not in FORCE_SPLITS:
        raise InputError(f"unknown force split {split!r}; known: {', '.join(FORCE_SPLITS)}")
    throats = mesh.throats
    weights = mesh.facets.wetted_surfaces(slip)
    if split == "drag":
        volumes = throats.total_by_facet(mesh.facets.volumes)
        surfaces = throats.total_by_facet(row_sums(weights))
        roundness = np.append(throats.roundness(slip), 1.0)[throats.facet_throat]  # the last: facets within a pore
        weights = _sheared(weights, volumes, surfaces, roundness, mesh.facets.vertices, mesh.cell_vertices)
    sums = throats.total_by_facet(_positive_sum(weights))
    fractions = _drag_fractions(weights, sums, throats.total_by_facet(np.ones(len(sums))))
    vectors = throats.total_vectors(mesh.facets.fluid_areas[:, None] * mesh.facets.normals)
    facets, starts = throats.facets_of_throats
    within = np.flatnonzero(throats.facet_throat < 0)  # a united pore
    for first in [*range(0, len(throats), BLOCK), -1]:
        block = np.arange(first, min(first + BLOCK, len(throats)))
        rows = facets[starts[block[0]] : starts[block[-1] + 1]] if first >= 0 else within
        forces = UnitForces(
            pressure=mesh.facets.sectors[rows, :, None] * mesh.facets.normals[rows, None, :],
            drag=fractions[rows, :, None] * vectors[rows, None, :],
        )
        if split == "drag" and first >= 0:
            for_rows(
                apply_pressure_along_throats,
                len(block),
                block,
                throats.facets_of_throats,
                mesh.facets.planes,
                mesh.cell_vertices,
                mesh.local_vertices,
                ThroatDrops(throats.doubling_heights, fractions),
                *forces,
            )
        yield rows, forces


@kernel
def _sheared(weights, volumes, surfaces, roundness, facet_vertices, vertices):
    """(f, 3): wetted surfaces times the shear on them, relative to a narrow throat: √(1 + (c R_h / r)²), on walls λ.

    It is in proportion to 1 / R_h in a throat that is narrow for its spheres, to c / r on a sphere with much room.
    """
    sheared = weights.copy()
    for f in range(weights.shape[0]):
        if volumes[f] <= 0.0 or surfaces[f] <= 0.0:
            continue
        radius = volumes[f] / surfaces[f]
        for v in range(3):
            k = facet_vertices[f, v]
            if k < vertices.n_spheres:
                sheared[f, v] *= np.sqrt(1.0 + (SHEAR * radius / vertices.sizes[k]) ** 2)
            else:
                sheared[f, v] *= roundness[f]
    return sheared


@kernel
def _positive_sum(weights):
    """(f,): sum of the positive weights of each facet."""
    sums = np.zeros(weights.shape[0])
    for f in range(weights.shape[0]):
        for v in range(3):
            sums[f] += max(weights[f, v], 0.0)
    return sums


@kernel
def _drag_fractions(weights, sums, facets):
    """(f, 3): γ^k / Σγ, the negative γ^k that a signed decomposition can give taken as zero.

    Where no γ^k is positive, the drag is divided equally among the vertices of all the facets of the throat.
    """
    fractions = np.empty_like(weights)
    for f in range(weights.shape[0]):
        for v in range(3):
            fractions[f, v] = max(weights[f, v], 0.0) / sums[f] if sums[f] > 0.0 else 1.0 / (3.0 * facets[f])
    return fractions


@kernel
def _scatter(facet_vertices, drops, forces, pressure, viscous):
    """Add the forces on every facet's vertices, for its pressure drop, to `pressure` and `viscous` (n + 6, 3) [N]."""
    for f in range(facet_vertices.shape[0]):
        if drops[f] == 0.0:
            continue
        for v in range(3):
            k = facet_vertices[f, v]
            for axis in range(3):
                pressure[k, axis] += forces.pressure[f, v, axis] * drops[f]
                viscous[k, axis] += forces.drag[f, v, axis] * drops[f]


def _hydrostatic(mesh, weight):
    """(6, 3): force of a hydrostatic pressure, zero at the highest corner of the box, on each wall."""
    forces = np.zeros((6, 3))
    size = mesh.box.size
    for wall, (axis, sense) in enumerate(zip(WALL_AXES, WALL_SENSES, strict=True)):
        # Depth below the highest corner, at the middle of the wall, of each component of the weight.
        depth = np.where(weight > 0.0, 0.5 * size, -0.5 * size)
        depth[axis] = (size[axis] if sense > 0.0 else 0.0) - (0.0 if weight[axis] > 0.0 else size[axis])
        forces[wall, axis] = sense * np.dot(weight, depth) * mesh.box.section(axis)
    return forces
