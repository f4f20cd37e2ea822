"""What a flow on a lattice says about a packing, on the cells and facets of our mesh."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from porefv.packing.box import WALL_NORMALS
from porefv.resolved.lattice_boltzmann import StokesLattice
from porefv.resolved.lattice_crossings import (
    CellSides,
    add_image_flux,
    add_link_flux,
    add_mirrored_flux,
    cell_sides,
    locate,
)
from porefv.resolved.lattice_forces import forces_of
from porefv.resolved.lattice_links import DIRECTIONS, OPEN, OPPOSITE, SYMMETRY
from porefv.resolved.reference import Values

if TYPE_CHECKING:
    from porefv.mesh.pore_mesh import PoreMesh


class LatticeOnMesh:
    """Where the nodes of a lattice are in a mesh of the same packing.

    Parameters
    ----------
    mesh : PoreMesh
    spacing : float
        Of the lattice [m].
    """

    def __init__(self, mesh: PoreMesh, places: np.ndarray, spacing: float):
        self.mesh = mesh
        shift = mesh.triangulation.origin - mesh.box.lower
        self.sides: CellSides = cell_sides(mesh, shift, spacing)
        self.cells = np.empty(len(places), np.int32)
        locate(places, 0, self.sides, self.cells)
        self.vertices = (mesh.local_vertices + shift) / spacing

    def pressures(self, of_cells: np.ndarray) -> np.ndarray:
        """(n,): of the nodes, those of their cells; 1/2 where there is none."""
        return np.nan_to_num(of_cells[self.cells], nan=0.5)


def read_off(
    flow: StokesLattice, found: LatticeOnMesh, viscosity: float, low: float, drop: float
) -> tuple[Values, float]:
    """Values of a flow at rest, and the largest net flux out of a cell over the flux through the sample.

    Parameters
    ----------
    flow : StokesLattice
        Pressure p stands for low + p drop.
    found : LatticeOnMesh
    viscosity, low, drop : float
        Of the fluid [Pa s]; lowest imposed pressure and range of the imposed ones [Pa].
    """
    flow.send_back()
    mesh, lattice = found.mesh, flow.lattice
    h = lattice.spacing
    # μ ∇²u = ∇p: velocities are momenta times this; fluxes and forces of links go with the spacing squared.
    flux_unit = flow.velocity_scale * drop * h / viscosity * h**2
    force_unit = drop * h**2
    forces = forces_of(flow, (mesh.packing.centres - mesh.box.lower) / h, mesh.packing.radii / h)
    facet_flux, face_flux = _fluxes(flow, found)
    faces = mesh.wall_faces
    first, second = mesh.facets.cells.T
    net = np.bincount(first, facet_flux, mesh.n_cells) - np.bincount(second, facet_flux, mesh.n_cells)
    net -= np.bincount(faces.cells, face_flux, mesh.n_cells)
    wall_flux = flow.wall_flux()
    imbalance = float(np.abs(net).max() / max(np.abs(wall_flux).max(), 1e-300))

    pressure, _ = flow.moments()
    count = np.bincount(found.cells, minlength=mesh.n_cells)
    total = np.bincount(found.cells, pressure, mesh.n_cells)
    mean = np.divide(total, count, out=np.full(mesh.n_cells, np.nan), where=count > 0)
    opened = lattice.kinds == OPEN
    sections = WALL_NORMALS * mesh.box.wall_areas[:, None]
    sections[opened] = 0.0
    values = Values(
        sphere_pressure=forces.sphere_pressure * force_unit,
        sphere_viscous=(forces.spheres - forces.sphere_pressure) * force_unit,
        wall_pressure=forces.wall_pressure * force_unit + low * sections,
        wall_viscous=(forces.walls - forces.wall_pressure) * force_unit,
        wall_flux=wall_flux * flux_unit,
        facet_flux=facet_flux * flux_unit,
        face_flux=face_flux * flux_unit,
        cell_pressure=low + drop * mean,
        vertex_pressure=low + drop * at_points(lattice.node, found.vertices, pressure),
    )
    return values, imbalance


def _fluxes(flow: StokesLattice, found: LatticeOnMesh) -> tuple[np.ndarray, np.ndarray]:
    """(f,) and (w,): flux through facets and wall faces, of the links that pass them; conserved in every cell."""
    mesh, lattice = found.mesh, flow.lattice
    images = lattice.images
    facet_flux = np.zeros(len(mesh.facets.cells))
    add_link_flux(lattice.places, found.cells, lattice.sources, flow.f, DIRECTIONS, OPPOSITE, found.sides, facet_flux)
    through = np.flatnonzero(lattice.kinds[images.walls] == OPEN)
    flux = flow.image_flux()[through]
    wall_cells = np.empty(len(through), np.int32)
    links = np.stack([images.nodes[through], images.directions[through].astype(np.int32)], axis=1)
    add_image_flux(
        lattice.places, found.cells, links, flux, DIRECTIONS, lattice.beyond, np.array(lattice.shape), found.sides,
        facet_flux, wall_cells,
    )  # fmt: skip
    along = lattice.kinds[images.walls] == SYMMETRY
    starts = np.concatenate([[0], np.cumsum(np.diff(images.starts)[along])])
    of = np.repeat(along, np.diff(images.starts))
    origins = images.origins[of]
    moved = images.weights[of] * flow.f[images.origin_directions[of], origins]
    add_mirrored_flux(lattice.places, found.cells, images.nodes[along], starts, origins, moved, found.sides, facet_flux)
    faces = mesh.wall_faces
    face_flux = np.zeros(len(faces.cells))
    keys = faces.cells.astype(np.int64) * 6 + faces.walls
    order = np.argsort(keys)
    asked = wall_cells.astype(np.int64) * 6 + images.walls[through]
    at = np.minimum(np.searchsorted(keys[order], asked), len(keys) - 1)
    right = keys[order][at] == asked
    np.add.at(face_flux, order[at[right]], flux[right])
    return facet_flux, face_flux


def at_points(node: np.ndarray, points: np.ndarray, values: np.ndarray) -> np.ndarray:
    """(q,): values of nodes, linear between them; NaN in solids and outside of the box."""
    base = np.floor(points - 0.5).astype(int)
    part = points - 0.5 - base
    total, weight = np.zeros(len(points)), np.zeros(len(points))
    limits = np.array(node.shape) - 1
    for corner in np.ndindex(2, 2, 2):
        w = np.prod(np.where(corner, part, 1.0 - part), axis=1)
        place = base + corner
        inside = ((place >= -1) & (place <= limits + 1)).all(axis=1)
        found = node[tuple(np.clip(place, 0, limits).T)]
        known = inside & (found >= 0)
        total[known] += w[known] * values[found[known]]
        weight[known] += w[known]
    nearest = np.clip(np.rint(points - 0.5).astype(int), 0, limits)
    in_fluid = node[tuple(nearest.T)] >= 0
    inside = ((points >= 0.0) & (points <= limits + 1.0)).all(axis=1)
    return np.where(in_fluid & inside & (weight > 0.0), total / np.maximum(weight, 1e-300), np.nan)
