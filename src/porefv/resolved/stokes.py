"""Resolved Stokes flow around spheres by Taylor-Hood finite elements, and what is read off it.

The weak form is ∫ μ ∇u:∇v - p ∇·v = -Σ p_w ∫_w v·n over walls of imposed pressure p_w, where the velocity along
the wall vanishes; the normal stress there is then -p_w. Where a throat is one element wide, its vertices are at rest,
and few velocities are left to meet the pressure's conditions: such elements have velocities of one order more, without
which the flow is some per cent too slow. Forces are the reactions of the discrete equations, so that nothing of the
thrust is lost; with the pressure's part integrated over the surface, the rest is viscous.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from porefv.errors import ComputationError
from porefv.packing.box import WALL_AXES, WALL_SENSES
from porefv.resolved.fluid_mesh import FluidMesh
from porefv.system.memory import available

if TYPE_CHECKING:
    from porefv.system.progress import Progress

# Bytes for each unknown, measured (docs/reference.md): the factor of the direct solver grows faster than linearly.
_BYTES, _GROWTH = 9_500, 1.25
_AT = 5.0e5
_LOADED = 300 * 2**20
# Pressure is held by this part of a mass matrix, without which the factorisation meets zeros.
_HOLD = 1e-9


def required_memory(unknowns: int) -> int:
    """Bytes that a solution with so many unknowns takes at its peak."""
    return int(_LOADED + _BYTES * unknowns * max(unknowns / _AT, 0.1) ** (_GROWTH - 1.0))


@dataclass(frozen=True, eq=False)
class StokesField:
    """A solved flow in a unit of length of its own, with viscosity 1 and imposed pressures between 0 and 1.

    Attributes
    ----------
    domain : FluidMesh
    order : int
        Of the velocity, before it is raised in throats.
    velocity : ngsolve.CoefficientFunction
    pressure : ngsolve.GridFunction
    unknowns : int
    wall_flux : (6,) array
        Flux into the fluid through each wall.
    sphere_total, sphere_pressure : (n, 3) arrays
        Force on each sphere, and the pressure's part of it.
    wall_total, wall_pressure : (6, 3) arrays
        The same on walls; on walls of imposed pressure the total is the drag along them alone. Normal to a wall of
        symmetry, the total counts the viscous stress once, μ ∂u_n/∂n.
    thrust : (3,) array
        Force of the imposed pressures on the fluid.
    open_walls : (6,) bool array
        Walls of imposed pressure.
    """

    domain: FluidMesh
    order: int
    velocity: Any
    pressure: Any
    unknowns: int
    wall_flux: np.ndarray
    sphere_total: np.ndarray
    sphere_pressure: np.ndarray
    wall_total: np.ndarray
    wall_pressure: np.ndarray
    thrust: np.ndarray
    open_walls: np.ndarray

    @property
    def residual(self) -> float:
        """Distance of all forces from the thrust, relative to it."""
        total = self.sphere_total.sum(axis=0) + self.wall_total.sum(axis=0)
        return float(np.abs(total - self.thrust).max() / max(np.abs(self.thrust).max(), 1e-300))

    def velocity_at(self, points: np.ndarray) -> np.ndarray:
        """(q, 3): velocity at each point, zero in the solid."""
        places, inside = self.domain.at(points)
        values = np.zeros((len(points), 3))
        if inside.any():
            values[inside] = np.asarray(self.velocity(places)).reshape(-1, 3)
        return values

    def pressure_at(self, points: np.ndarray) -> np.ndarray:
        """(q,): pressure at each point, NaN in the solid."""
        places, inside = self.domain.at(points)
        values = np.full(len(points), np.nan)
        if inside.any():
            values[inside] = np.asarray(self.pressure(places)).ravel()
        return values

    def pressure_samples(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Points all over the fluid (q, 3), their volumes (q,) and pressures (q,)."""
        import ngsolve as ngs

        rule = ngs.IntegrationRule(ngs.TET, 4)
        places = self.domain.mesh.MapToAllElements({ngs.TET: rule}, ngs.VOL)
        points = np.asarray(ngs.CF((ngs.x, ngs.y, ngs.z))(places)).reshape(-1, 3)
        determinant = np.asarray(ngs.Det(ngs.specialcf.JacobianMatrix(3))(places)).ravel()
        volumes = np.abs(determinant) * np.tile(np.array(rule.weights), self.domain.mesh.ne)
        return points, volumes, np.asarray(self.pressure(places)).ravel()

    def wall_samples(self, wall: int) -> tuple[np.ndarray, np.ndarray]:
        """Points on a wall (q, 3), and the flux into the fluid that each stands for (q,)."""
        import ngsolve as ngs

        rule = ngs.IntegrationRule(ngs.TRIG, 2 * self.order)
        places = self.domain.mesh.MapToAllElements({ngs.TRIG: rule}, self.domain.mesh.Boundaries(f"wall{wall}"))
        points = np.asarray(ngs.CF((ngs.x, ngs.y, ngs.z))(places)).reshape(-1, 3)
        speed = -WALL_SENSES[wall] * np.asarray(self.velocity(places)).reshape(-1, 3)[:, WALL_AXES[wall]]
        jacobian = np.asarray(ngs.specialcf.JacobianMatrix(3, 2)(places)).reshape(-1, 3, 2)
        areas = np.linalg.norm(np.cross(jacobian[:, :, 0], jacobian[:, :, 1]), axis=1)
        return points, speed * areas * np.tile(np.array(rule.weights), len(points) // len(rule.weights))


def _spaces(mesh: Any, order: int, pressures: np.ndarray, slip: np.ndarray) -> Any:
    """Three components of the velocity times the pressure; velocities held where solid or walls hold them."""
    import ngsolve as ngs

    squeezed = _squeezed(mesh, [wall for wall in range(6) if np.isnan(pressures[wall]) and not slip[wall]])
    components = []
    for axis in range(3):
        held = ["solid"]
        for wall in range(6):
            normal = WALL_AXES[wall] == axis
            along_open = not np.isnan(pressures[wall]) and not normal
            closed = np.isnan(pressures[wall]) and (normal or not slip[wall])
            if along_open or closed:
                held.append(f"wall{wall}")
        space = ngs.H1(mesh, order=order, dirichlet="|".join(held))
        for node in squeezed:
            space.SetOrder(node, order + 1)
        space.UpdateDofTables()
        components.append(space)
    return components[0] * components[1] * components[2] * ngs.H1(mesh, order=order - 1)


def _squeezed(mesh: Any, no_slip: list[int]) -> list[Any]:
    """Edges, faces and insides of the elements with three or four vertices where the fluid is at rest."""
    import ngsolve as ngs

    at_rest = mesh.Boundaries("|".join(["solid", *(f"wall{wall}" for wall in no_slip)]))
    solid = {vertex for element in at_rest.Elements() for vertex in element.vertices}
    nodes: set[Any] = set()
    cells = []
    for element in mesh.Elements(ngs.VOL):
        if sum(vertex in solid for vertex in element.vertices) >= 3:
            nodes.update(element.edges)
            nodes.update(element.faces)
            cells.append(ngs.NodeId(ngs.CELL, element.nr))
    return [*nodes, *cells]


def solve_stokes(
    domain: FluidMesh, order: int, pressures: np.ndarray, slip: np.ndarray, progress: Progress
) -> StokesField:
    """Solve for the flow.

    Parameters
    ----------
    domain : FluidMesh
    order : int
        Of the velocity; the pressure's is one less.
    pressures, slip : (6,) arrays
        Imposed pressure of each wall, NaN where impervious; walls of symmetry.
    progress : Progress

    Raises
    ------
    ComputationError
        If memory will not do, or the solution leaves a residual.
    """
    import ngsolve as ngs

    space = _spaces(domain.mesh, order, pressures, slip)
    _ensure_memory(domain.mesh.ne, space.ndof, progress)
    with progress.stage("assembly"):
        *u, p = space.TrialFunction()
        *v, q = space.TestFunction()
        drag = sum(ngs.InnerProduct(ngs.grad(u[axis]), ngs.grad(v[axis])) for axis in range(3))
        swell, test_swell = (sum(ngs.grad(w[axis])[axis] for axis in range(3)) for w in (u, v))
        form = ngs.BilinearForm(space, symmetric=True)
        form += (drag - swell * q - test_swell * p - _HOLD * p * q) * ngs.dx
        form.Assemble()
        load = ngs.LinearForm(space)
        for wall in map(int, np.flatnonzero(~np.isnan(pressures))):
            load += -float(pressures[wall] * WALL_SENSES[wall]) * v[int(WALL_AXES[wall])] * ngs.ds(f"wall{wall}")
        load.Assemble()
    field = ngs.GridFunction(space)
    with progress.stage("solve"):
        inverse = form.mat.Inverse(space.FreeDofs(), inverse="sparsecholesky")
        residual = load.vec.CreateVector()
        for _ in range(3):
            residual.data = load.vec - form.mat * field.vec
            field.vec.data += inverse * residual
        residual.data = load.vec - form.mat * field.vec
        del inverse
    free = np.array(list(space.FreeDofs()), bool)
    reactions = residual.FV().NumPy()
    driven = float(np.linalg.norm(load.vec.FV().NumPy()[free])) or 1.0
    left = float(np.linalg.norm(reactions[free])) / driven
    if not left < 1e-6:
        raise ComputationError(f"the factorisation failed: a residual of {left:.1e} is left; change --mesh-size")
    return _read_off(domain, order, space, field, reactions, load.vec.FV().NumPy(), pressures, slip)


def _ensure_memory(elements: int, unknowns: int, progress: Progress) -> None:
    """State what is needed before it is taken; ComputationError if it is not there."""
    need, have = required_memory(unknowns), available()
    stated = f"{elements} elements, {unknowns} unknowns, about {need / 2**30:.1f} GiB"
    if have is not None:
        stated += f" of {have / 2**30:.1f} GiB free"
        if need > have:
            raise ComputationError(f"the flow takes {stated}: use a machine with more, or fewer spheres")
    progress.note(stated)


def _read_off(
    domain: FluidMesh, order: int, space: Any, field: Any, reactions: Any, load: np.ndarray, pressures: np.ndarray,
    slip: np.ndarray,
) -> StokesField:  # fmt: skip
    """Fluxes and forces of a solution; `reactions` is the force of the fluid on what holds its velocities."""
    import ngsolve as ngs

    mesh = domain.mesh
    bodies = len(domain.radii) + 6
    velocity = ngs.CF(tuple(field.components[:3]))
    pressure = field.components[3]
    names = mesh.GetBoundaries()
    surface = [element for element in mesh.Elements(ngs.BND)]
    walls = np.array([int(name[4:]) if name.startswith("wall") else -1 for name in names])
    wall_of = walls[np.array([element.index for element in surface])]
    positions = np.array([mesh[ngs.NodeId(ngs.VERTEX, v)].point for v in range(mesh.nv)])

    corners = np.array([[vertex.nr for vertex in element.vertices] for element in surface])
    # The normal of the fluid points into the solid, as the pressure pushes; the mesher's own may be turned.
    normal = ngs.specialcf.normal(3)
    sense = _senses(mesh, surface, positions, corners)

    def by_element(integrand: Any) -> np.ndarray:
        return sense * np.array(ngs.Integrate(integrand, mesh, ngs.BND, element_wise=True))

    through = by_element(velocity * normal)
    wall_flux = np.array([-through[wall_of == wall].sum() for wall in range(6)])
    owners = np.where(wall_of >= 0, bodies - 6 + wall_of, _nearest_sphere(positions[corners].mean(axis=1), domain))
    on_surface = np.stack(
        [np.bincount(owners, by_element(pressure * normal[axis]), bodies) for axis in range(3)], axis=1
    )

    # Constants are sums of the vertices' shape functions alone: reactions at vertices add up to forces.
    solid = np.unique(corners[wall_of < 0])
    nearest = _nearest_sphere(positions[solid], domain)
    on_wall = np.zeros((6, mesh.nv), bool)
    for wall in range(6):
        on_wall[wall, corners[wall_of == wall]] = True
    on_wall[:, solid] = False
    total = np.zeros((bodies, 3))
    thrust = np.zeros(3)
    for axis in range(3):
        begin = space.Range(axis).start
        reaction = reactions[begin : begin + mesh.nv]
        total[: bodies - 6, axis] = np.bincount(nearest, reaction[solid], bodies - 6)
        total[bodies - 6 :, axis] = _wall_portions(on_wall, axis, pressures, slip) @ reaction
        thrust[axis] = load[begin : begin + mesh.nv].sum()
    n = bodies - 6
    return StokesField(
        domain, order, velocity, pressure, space.ndof, wall_flux,
        total[:n], on_surface[:n], total[n:], on_surface[n:], thrust, ~np.isnan(pressures),
    )  # fmt: skip


def _nearest_sphere(points: np.ndarray, domain: FluidMesh) -> np.ndarray:
    """The sphere nearest in power to each point: whose surface, flat or half of a bridge it lies on."""
    powers = ((points[:, None, :] - domain.centres) ** 2).sum(axis=2) - domain.radii**2
    return powers.argmin(axis=1)


def _senses(mesh: Any, surface: list[Any], positions: np.ndarray, corners: np.ndarray) -> np.ndarray:
    """1 for surface elements whose normal points out of the fluid, -1 for the others."""
    import ngsolve as ngs

    opposite = np.empty(len(surface), int)
    for k, element in enumerate(surface):
        (cell,) = mesh[element.faces[0]].elements
        (opposite[k],) = {vertex.nr for vertex in mesh[cell].vertices} - set(corners[k].tolist())
    places = mesh.MapToAllElements({ngs.TRIG: ngs.IntegrationRule(ngs.TRIG, 0)}, ngs.BND)
    normals = np.asarray(ngs.specialcf.normal(3)(places)).reshape(-1, 3)
    inward = positions[opposite] - positions[corners].mean(axis=1)
    return np.where((normals * inward).sum(axis=1) < 0.0, 1.0, -1.0)


def _wall_portions(on_wall: np.ndarray, axis: int, pressures: np.ndarray, slip: np.ndarray) -> np.ndarray:
    """(6, nv): part of the reaction along an axis at each vertex that each wall bears.

    On the edges of the box it goes to the wall that the axis is normal to, else to the walls that drag, in equal parts,
    else to the open walls, which keep the fluid from flowing along them.
    """
    portions = np.zeros(on_wall.shape)
    left = np.ones(on_wall.shape[1], bool)
    closed = np.isnan(pressures)
    normal = axis == WALL_AXES
    for bears in (closed & normal, closed & ~normal & ~slip, ~closed & ~normal):
        those = on_wall & bears[:, None] & left
        count = those.sum(axis=0)
        portions += those / np.maximum(count, 1)
        left &= count == 0
    return portions
