"""Forces of the fluid on every sphere and wall, facet by facet (C12 §2.3)."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from porefv.conductance.model import FORCE_SPLITS, ForceSplit
from porefv.errors import InputError, counted
from porefv.flow.pressure import PressureField, as_field
from porefv.flow.pressure_along_throats import ThroatDrops, apply_pressure_along_throats
from porefv.flow.walls import Walls, ensure_no_imposed_flow
from porefv.mesh.pore_mesh import PoreMesh
from porefv.mesh.throats import ThroatFacets
from porefv.mesh.vectors import dot, vector_at
from porefv.packing.box import WALL_AXES, WALL_NORMALS, WALL_SENSES
from porefv.packing.overlaps import sphere_volumes
from porefv.system.html_table import html_table
from porefv.system.kernels import helper, kernel
from porefv.system.number_checks import three_numbers
from porefv.system.threads import for_rows

# Throats whose forces are in memory at a time.
BLOCK = 1 << 14
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
        Force of the imposed pressures on the ends of the sample: what all pressure and viscous forces add up to. It
        is so with sources, too, because fluid is injected without momentum.
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
        """Distance of the sum of all pressure and viscous forces from the thrust, relative to ΔP S.

        Theory, forces: :eq:`eq-force-sum`.
        """
        parts = (self.pressure, self.viscous, self.wall_pressure, self.wall_viscous)
        residual = np.abs(sum(part.sum(axis=0) for part in parts) - self.thrust).max()
        return float(residual / self.scale) if residual != 0.0 else 0.0

    def _repr_html_(self) -> str:
        rows = [
            (part.replace("_", ", "), ", ".join(f"{x:.4g}" for x in total) + " N") for part, total in self.sums.items()
        ]
        rows.append(("residual", f"{self.conservation_residual:.1e}"))
        return html_table(f"Forces on {counted(len(self.pressure), 'sphere')} and six walls, sums", rows)

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

    Notes
    -----
    Theory, forces: :eq:`eq-surface-split`, :eq:`eq-pressure-along-throat`, :eq:`eq-drag-shares` and :eq:`eq-buoyancy`.
    """
    ensure_no_imposed_flow(walls)
    field = as_field(mesh, pressure)
    relative, reference = field.relative, field.reference
    n = mesh.n_spheres
    on_spheres_p = np.zeros((n + 6, 3))
    on_spheres_v = np.zeros((n + 6, 3))
    cell_pressure = relative[mesh.cell_pore]
    drops = cell_pressure[mesh.facets.cells[:, 0]] - cell_pressure[mesh.facets.cells[:, 1]]
    for rows, forces in unit_forces(mesh, walls.slip, split):
        scatter_forces(mesh.facets.vertices[rows], drops[rows], forces, on_spheres_p, on_spheres_v)

    sections = np.array([mesh.box.section(axis) for axis in range(3)])
    faces = mesh.wall_faces
    face_pressure = cell_pressure[faces.cells]
    push = np.zeros((6, 3))
    thrust = np.zeros(3)
    for wall, (axis, sense, held) in enumerate(zip(WALL_AXES, WALL_SENSES, walls.held, strict=True)):
        on_wall = faces.walls == wall
        force = sense * (face_pressure[on_wall] * faces.areas[on_wall]).sum()
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

    `slip` (6,) bool marks the walls that do not drag the fluid; `split` is as of `grain_forces`. A facet within a
    united pore is taken as a throat of its own.
    """
    forces = np.empty((len(mesh.facets.cells), 3, 3))
    for rows, found in unit_forces(mesh, slip, split, within=True):
        forces[rows] = found.pressure + found.drag
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


class FacetSolids(NamedTuple):
    """The facets as sections, and the solid along them.

    Attributes
    ----------
    vertices : (f, 3) int32 array
    normals : (f, 3) array
        [-]
    fluid_areas, volumes : (f,) arrays
        A^f, φ [m², m³].
    sectors, surfaces : (f, 3) arrays
        A^k, γ^k [m²].
    """

    vertices: np.ndarray
    normals: np.ndarray
    fluid_areas: np.ndarray
    volumes: np.ndarray
    sectors: np.ndarray
    surfaces: np.ndarray


class DragLaw(NamedTuple):
    """How the drag on a throat is divided among its solid.

    Attributes
    ----------
    slip : (6,) bool array
        Walls that do not drag the fluid.
    sheared : bool
        Whether surfaces count with the shear on them: the split 'drag'.
    roundness : (t,) array
        λ of each throat; empty where `sheared` is false [-].
    """

    slip: np.ndarray
    sheared: bool
    roundness: np.ndarray


def unit_forces(
    mesh: PoreMesh, slip: np.ndarray, split: ForceSplit, *, within: bool = False
) -> Iterator[tuple[np.ndarray, UnitForces]]:
    """Facets (m,) of throats, and the forces on their vertices for unit drops, in blocks; then those within pores.

    F^{p,k} = A^k n and F^{v,k} = A^f n γ^k / Σγ. With the split 'drag', the part of the drag that is pressure on the
    spheres along the throat is moved from the second to the first.
    """
    if split not in FORCE_SPLITS:
        raise InputError(f"unknown force split {split!r}; known: {', '.join(FORCE_SPLITS)}")
    throats, facets, along = mesh.throats, mesh.facets, split == "drag"
    solids = FacetSolids(
        facets.vertices, facets.normals, facets.fluid_areas, facets.volumes, facets.sectors, facets.surfaces
    )
    law = DragLaw(np.asarray(slip, bool), along, throats.roundness(slip) if along else np.empty(0))
    own, starts = throats.facets_of_throats
    for begin in range(0, len(throats), BLOCK):
        end = min(begin + BLOCK, len(throats))
        rows = own[starts[begin] : starts[end]]
        fractions, forces = _room(len(rows))
        for_rows(
            _forces_of_throats, end - begin, begin, throats.facets_of_throats, solids, mesh.cell_vertices, law,
            fractions, forces,
        )  # fmt: skip
        if along:
            for_rows(
                apply_pressure_along_throats, end - begin, begin, throats.facets_of_throats, facets.planes,
                mesh.cell_vertices, mesh.local_vertices, ThroatDrops(throats.doubling_heights, fractions), *forces,
            )  # fmt: skip
        yield rows, forces
    if within:
        rows = np.flatnonzero(throats.facet_throat < 0)
        fractions, forces = _room(len(rows))
        alone = ThroatFacets(rows, np.arange(len(rows) + 1))
        law = law._replace(roundness=np.ones(len(rows)))
        for_rows(_forces_of_throats, len(rows), 0, alone, solids, mesh.cell_vertices, law, fractions, forces)
        yield rows, forces


def _room(rows: int) -> tuple[np.ndarray, UnitForces]:
    """Fractions (m, 3) and forces of so many facets, to be filled in."""
    return np.empty((rows, 3)), UnitForces(*np.empty((2, rows, 3, 3)))


@kernel
def _forces_of_throats(first, last, begin, throats, solids, vertices, law, fractions, forces):
    """Fill in the forces on the facets of throats for a unit pressure drop, and the fractions of the drag.

    The pressure drops in the plane of the facets. Drag is divided by the γ^k, of which the negative ones that a signed
    decomposition can give count as zero; where no γ^k is positive, equally.

    Parameters
    ----------
    first, last : int
        Throats to treat, first ... last - 1, counted from `begin` on.
    begin : int
        The throat whose first facet is in row 0 of what is filled in.
    throats : ThroatFacets
    solids : FacetSolids
    vertices : Vertices
    law : DragLaw
    fractions : (m, 3) array
        Of the throat's drag, for each vertex of each of its facets [-].
    forces : UnitForces
    """
    n = vertices.n_spheres
    for t in range(begin + first, begin + last):
        start = throats.starts[t]
        count = throats.starts[t + 1] - start
        row = start - throats.starts[begin]
        f = throats.facets[start]
        volume = 0.0
        surface = 0.0
        x = y = z = 0.0
        for j in range(count):
            g = throats.facets[start + j]
            # In the sense of the throat's first facet.
            sense = 1.0 if dot(vector_at(f, solids.normals), vector_at(g, solids.normals)) > 0.0 else -1.0
            along = sense * solids.fluid_areas[g]
            x += along * solids.normals[g, 0]
            y += along * solids.normals[g, 1]
            z += along * solids.normals[g, 2]
            volume += solids.volumes[g]
            for v in range(3):
                fractions[row + j, v] = solids.surfaces[g, v]
                k = solids.vertices[g, v]
                if k >= n and law.slip[k - n]:
                    fractions[row + j, v] = 0.0
            surface += fractions[row + j, 0] + fractions[row + j, 1] + fractions[row + j, 2]
        if law.sheared and volume > 0.0 and surface > 0.0:
            for j in range(count):
                for v in range(3):
                    k = solids.vertices[throats.facets[start + j], v]
                    fractions[row + j, v] *= (
                        _relative_shear(volume / surface, vertices.sizes[k]) if k < n else law.roundness[t]
                    )
        total = 0.0
        for j in range(count):
            for v in range(3):
                fractions[row + j, v] = max(fractions[row + j, v], 0.0)
                total += fractions[row + j, v]
        for j in range(count):
            g = throats.facets[start + j]
            sense = 1.0 if dot(vector_at(f, solids.normals), vector_at(g, solids.normals)) > 0.0 else -1.0
            drag = (sense * x, sense * y, sense * z)
            for v in range(3):
                fractions[row + j, v] = fractions[row + j, v] / total if total > 0.0 else 1.0 / (3.0 * count)
                for axis in range(3):
                    forces.pressure[row + j, v, axis] = solids.sectors[g, v] * solids.normals[g, axis]
                    forces.drag[row + j, v, axis] = fractions[row + j, v] * drag[axis]


@helper
def _relative_shear(hydraulic_radius, radius):
    """Shear on a sphere relative to that in a narrow throat: √(1 + (c R_h / r)²).

    It is in proportion to 1 / R_h in a throat that is narrow for its spheres, to c / r on a sphere with much room.
    """
    return np.sqrt(1.0 + (SHEAR * hydraulic_radius / radius) ** 2)


@kernel
def scatter_forces(facet_vertices, drops, forces, pressure, viscous):
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
