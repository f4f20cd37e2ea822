"""What the resolved flow says about a packing, on the cells and facets of our mesh: computed, written, read back."""

from __future__ import annotations

import json
import platform
from collections.abc import Sequence
from dataclasses import asdict, dataclass, field, fields
from importlib.metadata import version
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from porefv.errors import InputError
from porefv.flow.walls import Wall, Walls, ensure_no_imposed_flow
from porefv.packing.box import WALL_NORMALS, WALLS, Box
from porefv.packing.packing import Packing
from porefv.resolved.facet_quadrature import cells_of, facet_points
from porefv.system.atomic_files import atomic_write
from porefv.system.version import __version__

if TYPE_CHECKING:
    from porefv.mesh.pore_mesh import PoreMesh
    from porefv.resolved.stokes import StokesField

_DIGITS = 7
_KIND = "porefv resolved Stokes flow"


@dataclass(frozen=True)
class Run:
    """One solution, and how it was computed.

    Attributes
    ----------
    mesh_size : float
        Elements on a sphere, over its radius.
    delta : float
        δ of the contacts' regularisation.
    elements, unknowns, straightened : int
        Of the mesh; straightened elements are less bent than the spheres ask for.
    seconds : float
        Wall time.
    permeability : float
        NaN unless driven along one axis [m²].
    thrust_residual : float
        Distance of all forces from the thrust, over it.
    flux_imbalance : float
        Largest net flux out of a cell, over the flux through the sample: zero but for the discretisation.
    """

    mesh_size: float
    delta: float
    elements: int
    unknowns: int
    straightened: int
    seconds: float
    permeability: float
    thrust_residual: float
    flux_imbalance: float


@dataclass(frozen=True)
class LatticeRun:
    """The flow on one lattice, and how it was computed.

    Attributes
    ----------
    nodes : float
        Spacings in the mean radius.
    shape : (3,) tuple of int
        Nodes along x, y and z.
    fluid_nodes, steps : int
        Nodes in the fluid; steps until the flow was at rest.
    seconds : float
        Wall time.
    permeability, thrust_residual, flux_imbalance : float
        See `Run`.
    """

    nodes: float
    shape: tuple[int, int, int]
    fluid_nodes: int
    steps: int
    seconds: float
    permeability: float
    thrust_residual: float
    flux_imbalance: float


@dataclass(frozen=True, eq=False)
class Values:
    """Values of the resolved flow on a packing and its mesh.

    Attributes
    ----------
    sphere_pressure, sphere_viscous : (n, 3) arrays
        The two parts of the force on each sphere [N].
    wall_pressure, wall_viscous : (6, 3) arrays
        The same on each wall. On walls of imposed pressure, the drag along them alone.
    wall_flux : (6,) array
        Flux into the sample through each wall [m³/s].
    facet_flux : (f,) array
        Flux through each facet of the triangulation, from its first cell to its second [m³/s].
    face_flux : (w,) array
        Flux into the sample through each wall face of the cells [m³/s].
    cell_pressure : (m,) array
        Mean pressure of the fluid of each cell, NaN without fluid [Pa].
    vertex_pressure : (m,) array
        Pressure at the Laguerre vertex of each cell, NaN where that is solid or outside of the box [Pa].
    """

    sphere_pressure: np.ndarray
    sphere_viscous: np.ndarray
    wall_pressure: np.ndarray
    wall_viscous: np.ndarray
    wall_flux: np.ndarray
    facet_flux: np.ndarray
    face_flux: np.ndarray
    cell_pressure: np.ndarray
    vertex_pressure: np.ndarray

    @property
    def sphere_total(self) -> np.ndarray:
        """(n, 3): force on each sphere [N]."""
        return self.sphere_pressure + self.sphere_viscous

    def extrapolated(self, coarse: Values, factor: float) -> Values:
        """self + factor (self - coarse), of every value."""
        pairs = ((getattr(self, f.name), getattr(coarse, f.name)) for f in fields(self))
        return Values(*(fine + factor * (fine - other) for fine, other in pairs))


def read_off(field: StokesField, mesh: PoreMesh, viscosity: float, low: float, drop: float) -> tuple[Values, float]:
    """Values of a field solved in units of the box's longest side, and its `Run.flux_imbalance`.

    Parameters
    ----------
    field : StokesField
        In lengths of the box's longest side from its lower corner; pressure p stands for low + p drop.
    mesh : PoreMesh
    viscosity, low, drop : float
        Of the fluid [Pa s]; lowest imposed pressure and range of the imposed ones [Pa].
    """
    length = float(mesh.box.size.max())
    shift = mesh.triangulation.origin - mesh.box.lower
    speed, force = drop * length / viscosity, drop * length**2
    flow = speed * length**2
    points = facet_points(mesh)
    velocity = field.velocity_at((points.points + shift) / length)
    through = (velocity * mesh.facets.normals[points.facets]).sum(axis=1) * points.weights * speed
    facet_flux = np.bincount(points.facets, through, len(mesh.facets.cells))

    faces = mesh.wall_faces
    face_flux = np.zeros(len(faces.cells))
    for wall in map(int, np.flatnonzero(field.open_walls)):
        places, flux = field.wall_samples(wall)
        cells = cells_of(mesh, places * length - shift)
        per_cell = np.bincount(cells, flux * flow, mesh.n_cells)
        on_wall = faces.walls == wall
        face_flux[on_wall] = per_cell[faces.cells[on_wall]]
    first, second = mesh.facets.cells.T
    net = np.bincount(first, facet_flux, mesh.n_cells) - np.bincount(second, facet_flux, mesh.n_cells)
    net -= np.bincount(faces.cells, face_flux, mesh.n_cells)
    imbalance = float(np.abs(net).max() / max(np.abs(field.wall_flux).max() * flow, 1e-300))

    places, volumes, pressures = field.pressure_samples()
    cells = cells_of(mesh, places * length - shift)
    volume = np.bincount(cells, volumes, mesh.n_cells)
    moment = np.bincount(cells, volumes * pressures, mesh.n_cells)
    mean = np.divide(moment, volume, out=np.full(mesh.n_cells, np.nan), where=volume > 0.0)
    at_vertices = field.pressure_at((mesh.local_vertices + shift) / length)
    sections = WALL_NORMALS * mesh.box.wall_areas[:, None]
    sections[field.open_walls] = 0.0
    wall_pressure = np.where(field.open_walls[:, None], 0.0, field.wall_pressure)
    values = Values(
        sphere_pressure=field.sphere_pressure * force,
        sphere_viscous=(field.sphere_total - field.sphere_pressure) * force,
        wall_pressure=wall_pressure * force + low * sections,
        wall_viscous=(field.wall_total - wall_pressure) * force,
        wall_flux=field.wall_flux * flow,
        facet_flux=facet_flux,
        face_flux=face_flux,
        cell_pressure=low + drop * mean,
        vertex_pressure=low + drop * at_vertices,
    )
    return values, imbalance


@dataclass(frozen=True, eq=False)
class StokesReference:
    """The resolved flow through a packing, with its provenance.

    Attributes
    ----------
    name : str
    method : {'finite-elements', 'lattice-boltzmann'}
    packing : Packing
    walls : Walls
    viscosity : float
        [Pa s]
    values : Values
        The best there are: of the finest run, extrapolated to δ = 0 where there are contacts, or to a spacing of 0.
    errors : dict of str to float
        Error bars: `permeability` [m²]; `forces`, `facet_flux`, `cell_pressure`, rms over those of the values.
    permeability : float
        NaN unless driven along one axis [m²].
    runs : list of Run or of LatticeRun
    cells, facet_vertices, facet_cells, face_cells, face_walls : int arrays
        Of the mesh that the values stand on.
    versions : dict of str to str
    order : int or None
        Of the velocity of finite elements; the pressure's is one less.
    contacts : str or None
        How finite elements regularise contacts: caps, bridges.
    """

    name: str
    method: str
    packing: Packing
    walls: Walls
    viscosity: float
    values: Values
    errors: dict[str, float]
    permeability: float
    runs: Sequence[Run | LatticeRun]
    cells: np.ndarray
    facet_vertices: np.ndarray
    facet_cells: np.ndarray
    face_cells: np.ndarray
    face_walls: np.ndarray
    versions: dict[str, str] = field(default_factory=dict)
    order: int | None = None
    contacts: str | None = None

    # ---- on a mesh ----------------------------------------------------------------------------------------------

    def pore_mesh(self, **options: Any) -> PoreMesh:
        """The packing's mesh; `options` as of `PoreMesh`."""
        from porefv.mesh.pore_mesh import PoreMesh

        return PoreMesh(self.packing, **options)

    def throat_flux(self, mesh: PoreMesh) -> np.ndarray:
        """(t,): flux through each throat of a mesh of this packing, from its first pore to its second [m³/s]."""
        self._ensure(mesh)
        throats = mesh.throats
        totals = throats.total_vectors(self.values.facet_flux[:, None] * np.ones(3))
        return totals[throats.first_facets, 0]

    def pore_pressure(self, mesh: PoreMesh) -> np.ndarray:
        """(n_pores,): mean pressure of each pore over its fluid volume, NaN without fluid [Pa]."""
        self._ensure(mesh)
        known = np.isfinite(self.values.cell_pressure)
        volumes = np.where(known, np.maximum(mesh.cell_void_volumes, 0.0), 0.0)
        moments = volumes * np.where(known, self.values.cell_pressure, 0.0)
        volume = np.bincount(mesh.cell_pore, volumes, mesh.n_pores)
        moment = np.bincount(mesh.cell_pore, moments, mesh.n_pores)
        return np.divide(moment, volume, out=np.full(mesh.n_pores, np.nan), where=volume > 0.0)

    def conductances(self, mesh: PoreMesh) -> np.ndarray:
        """(t,): K_ij = q_ij / (p_i - p_j) of each throat [m³/(Pa s)]; of any sign where p_i and p_j hardly differ."""
        pressure = self.pore_pressure(mesh)
        i, j = mesh.throats.pores.T
        drops = pressure[i] - pressure[j]
        return np.divide(self.throat_flux(mesh), drops, out=np.full(len(drops), np.nan), where=drops != 0.0)

    def _ensure(self, mesh: PoreMesh) -> None:
        pairs = [(mesh.packing.centres, self.packing.centres), (mesh.packing.radii, self.packing.radii)]
        pairs += [
            (mesh.cells, self.cells),
            (mesh.facets.vertices, self.facet_vertices),
            (mesh.facets.cells, self.facet_cells),
        ]
        if not all(np.array_equal(theirs, ours) for theirs, ours in pairs):
            raise InputError(
                f"{self.name}: the mesh is not the one these values were read off: another packing, or another "
                "version of the triangulation. Compute the reference again"
            )

    # ---- files --------------------------------------------------------------------------------------------------

    def write(self, path: str | PathLike[str]) -> None:
        """Write a JSON file, which appears whole or not at all."""
        box = self.packing.walled_box
        assert box is not None
        content = {
            "kind": _KIND,
            "name": self.name,
            "method": self.method,
            "about": f"Stokes flow, {_METHODS[self.method][0]}; SI units; see docs/reference.md",
            "packing": {
                "lower": box.lower, "upper": box.upper, "centres": self.packing.centres, "radii": self.packing.radii
            },
            "walls": {name: vars(wall) for name, wall in zip(WALLS, self.walls, strict=True)},
            "viscosity": self.viscosity,
            "order": self.order,
            "contacts": self.contacts,
            "permeability": self.permeability,
            "errors": self.errors,
            "runs": [asdict(run) for run in self.runs],
            "versions": self.versions,
            "mesh": {name: getattr(self, name) for name in _MESH},
            "values": {f.name: _rounded(getattr(self.values, f.name)) for f in fields(Values)},
        }  # fmt: skip
        with atomic_write(path) as temporary:
            temporary.write_text(_text(content), encoding="utf-8")

    @classmethod
    def read(cls, path: str | PathLike[str]) -> StokesReference:
        """Read what `write` wrote.

        Raises
        ------
        InputError
            If the file is not of that kind.
        """
        try:
            content = json.loads(Path(path).read_text(encoding="utf-8"))
        except (OSError, ValueError) as error:
            raise InputError(f"cannot read {path}: {error}") from None
        if not isinstance(content, dict) or content.get("kind") != _KIND:
            raise InputError(f"{path} holds no resolved flow of porefv reference")
        packing, mesh, values = content["packing"], content["mesh"], content["values"]
        method = content.get("method", "finite-elements")
        if method not in _METHODS:
            raise InputError(f"{path} is of the method {method!r}, which this version does not know")
        _, kind = _METHODS[method]
        shapes = {"cells": 4, "facet_vertices": 3, "facet_cells": 2}
        return cls(
            name=content["name"],
            method=method,
            packing=Packing(packing["centres"], packing["radii"], Box(packing["lower"], packing["upper"])),
            walls=Walls(**{name: Wall(**wall) for name, wall in content["walls"].items()}),
            viscosity=content["viscosity"],
            values=Values(**{name: np.array(array, float) for name, array in values.items()}),
            errors={name: _number(error) for name, error in content["errors"].items()},
            permeability=_number(content["permeability"]),
            order=content["order"],
            contacts=content["contacts"],
            runs=[kind(**{key: _number(value) for key, value in run.items()}) for run in content["runs"]],
            versions=content["versions"],
            **{
                name: np.array(mesh[name], np.int32).reshape((-1, shapes[name]) if name in shapes else -1)
                for name in _MESH
            },
        )


# What each method is, and the class of its runs.
_METHODS: dict[str, tuple[str, Any]] = {
    "finite-elements": ("Taylor-Hood finite elements on curved tetrahedra", Run),
    "lattice-boltzmann": ("lattice-Boltzmann method with two relaxation times", LatticeRun),
}
_MESH = ("cells", "facet_vertices", "facet_cells", "face_cells", "face_walls")


def _number(value: Any) -> Any:
    return float("nan") if value is None else value


def _rounded(array: np.ndarray) -> np.ndarray:
    """To so many significant digits of the largest value: zeros stay short."""
    finite = np.abs(array[np.isfinite(array)])
    largest = float(finite.max()) if finite.size else 0.0
    if largest == 0.0:
        return array
    return np.round(array, _DIGITS - int(np.ceil(np.log10(largest)))) + 0.0


def _text(content: dict[str, Any]) -> str:
    """JSON, an entry of the first two levels a line; what is not a number is null."""

    def plain(value: Any) -> Any:
        if isinstance(value, np.ndarray):
            return plain(value.tolist())
        if isinstance(value, (list, tuple)):
            return [plain(x) for x in value]
        if isinstance(value, dict):
            return {key: plain(x) for key, x in value.items()}
        if isinstance(value, (float, np.floating)):
            return float(value) if np.isfinite(value) else None
        return value.item() if isinstance(value, np.generic) else value

    def compact(value: Any) -> str:
        return json.dumps(value, ensure_ascii=False, separators=(",", ":"), allow_nan=False)

    def nested(table: dict[str, Any]) -> str:
        return ",\n".join(f'  "{key}": {compact(value)}' for key, value in table.items())

    lines = []
    for key, value in plain(content).items():
        lines.append(f'"{key}": {{\n{nested(value)}\n }}' if isinstance(value, dict) else f'"{key}": {compact(value)}')
    return "{\n " + ",\n ".join(lines) + "\n}\n"


def permeability_of(values: Values, mesh: PoreMesh, walls: Walls, viscosity: float) -> float:
    """Along the axis of the flow, by the mean of inflow and outflow [m²]; NaN unless it is along one axis."""
    axis = walls.axis
    if axis is None or walls.pressures[2 * axis] == walls.pressures[2 * axis + 1]:
        return float("nan")
    drop = walls.pressures[2 * axis] - walls.pressures[2 * axis + 1]
    flux = 0.5 * (values.wall_flux[2 * axis] - values.wall_flux[2 * axis + 1])
    return float(viscosity * flux * mesh.box.size[axis] / (drop * mesh.box.section(axis)))


def ensure_driven(walls: Walls) -> None:
    """InputError unless pressures of walls, one at least, drive the flow."""
    ensure_no_imposed_flow(walls)
    if np.isnan(walls.pressures).all():
        raise InputError("no wall has a pressure: give at least one, for instance y_min = { pressure = 1.0 }")


def distances(first: Values, second: Values, scale: Values) -> dict[str, float]:
    """Differences of two values, rms over those of a third: `forces`, `facet_flux` and `cell_pressure`."""
    found = {}
    parts = (("forces", "sphere_total"), ("facet_flux", "facet_flux"), ("cell_pressure", "cell_pressure"))
    for name, part in parts:
        difference, size = getattr(first, part) - getattr(second, part), getattr(scale, part)
        known = np.isfinite(difference) & np.isfinite(size)
        square = float(np.sum(size[known] ** 2))
        found[name] = float(np.sqrt(np.sum(difference[known] ** 2) / square)) if square > 0.0 else float("nan")
    return found


def versions(*packages: str) -> dict[str, str]:
    """Of what the numbers depend on."""
    found = {"porefv": __version__, "python": platform.python_version()}
    return found | {name: version(name) for name in packages}
