"""What is measured on the way: a row of the series, layers of the profiles, permeability, balance of momentum."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict

import numpy as np

from porefv.conductance.model import ConductanceModel
from porefv.coupling.coupling import Coupling
from porefv.coupling.validity import Validity
from porefv.dem.dem import DEM
from porefv.flow.plane_pressures import PlanePressures
from porefv.flow.pore_flow import PoreFlow
from porefv.flow.walls import Wall, Walls
from porefv.mesh.pore_mesh import PoreMesh
from porefv.packing.box import WALL_AXES, WALL_SENSES, WALLS
from porefv.packing.layers import layer_edges, layer_porosities

_ENERGIES = ("kinetic", "elastic", "potential", "sliding", "damping", "walls", "applied", "balance")
_POWERS = ("grains", "walls", "dissipation", "boundary", "pairs", "imbalance", "weight", "error")


def _by_wall(name: str) -> tuple[str, ...]:
    return tuple(f"{name}_{wall}" for wall in WALLS)


GRAIN_COLUMNS = (
    "step", "time", "stage",
    *_by_wall("place"), *_by_wall("contact_stress"),
    "strain_x", "strain_y", "strain_z", "porosity", "coordination", "unbalanced",
    *(f"energy_{name}" for name in _ENERGIES), "momentum_residual",
)  # fmt: skip
FLUID_COLUMNS = (
    *_by_wall("fluid_force"), *_by_wall("total_stress"), *_by_wall("flux"),
    "mean_pressure", "max_pressure",
    *(f"power_{name}" for name in _POWERS), "mass_imbalance",
    "reynolds_max", "reynolds_mean", "stokes_number", "iterations", "meshes",
)  # fmt: skip
PROFILE_COLUMNS = (
    "step", "time", "stage", "layer", "lower", "upper", "pressure", "effective_stress", "total_stress", "porosity",
)  # fmt: skip


def gauge_columns(gauges: int) -> tuple[str, ...]:
    """Columns of `gauge_row`, for so many gauges."""
    return (
        *(f"gauge_pressure_{k + 1}" for k in range(gauges)),
        *(f"gauge_porosity_{k + 1}" for k in range(gauges - 1)),
    )


def grain_row(dem: DEM, coupling: Coupling | None, sizes: np.ndarray, residual: float) -> dict[str, float]:
    """`GRAIN_COLUMNS` but for the stage; `sizes` (3,) are the box's that strains refer to [m].

    Parameters
    ----------
    dem : DEM
    coupling : Coupling or None
        None: without a fluid.
    sizes : (3,) float array
        See above.
    residual : float
        What `momentum_residual` returns of the last step; NaN before the first.
    """
    stress, energies = dem.wall_stress, dem.energies
    row: dict[str, float] = {"step": dem.steps, "time": dem.time}
    row |= {f"place_{wall}": place for wall, place in zip(WALLS, dem.places.tolist(), strict=True)}
    row |= {f"contact_stress_{wall}": stress[wall] for wall in WALLS}
    row |= {f"strain_{axis}": s for axis, s in zip("xyz", (1.0 - dem.box.size / sizes).tolist(), strict=True)}
    row |= {"porosity": dem.porosity, "coordination": dem.coordination}
    row["unbalanced"] = unbalanced(dem, coupling)
    row |= {f"energy_{name}": getattr(energies, name) for name in _ENERGIES}
    return row | {"momentum_residual": residual}


def fluid_row(coupling: Coupling, dem: DEM, validity: Validity) -> dict[str, float]:
    """`FLUID_COLUMNS`; `validity` is the coupling's."""
    fluxes, power, total = coupling.wall_flux, coupling.power, total_stresses(dem, coupling)
    pressure, volumes = coupling.pressure, coupling.mesh.pore_volumes
    thrusts = _thrusts(coupling).tolist()
    row: dict[str, float] = {f"fluid_force_{wall}": force for wall, force in zip(WALLS, thrusts, strict=True)}
    row |= {f"total_stress_{wall}": stress for wall, stress in total.items()}
    row |= {f"flux_{wall}": flux for wall, flux in fluxes.items()}
    row |= {"mean_pressure": float((pressure * volumes).sum() / volumes.sum()), "max_pressure": float(pressure.max())}
    row |= {f"power_{name}": value for name, value in asdict(power).items()}
    weight = float(((dem.masses[:, None] * dem.gravity + dem.applied) * dem.velocities).sum())
    error = power.lost / abs(weight) if weight != 0.0 else np.nan
    row |= {"power_imbalance": power.imbalance, "power_weight": weight, "power_error": error}
    row |= {"mass_imbalance": coupling.mass_imbalance} | asdict(validity)
    return row | {"iterations": coupling.effort.iterations, "meshes": coupling.effort.meshes}


def total_stresses(dem: DEM, coupling: Coupling | None) -> dict[str, float]:
    """Normal stress of contacts and fluid together on each wall [Pa]."""
    stresses = dem.wall_stress
    if coupling is None:
        return stresses
    thrusts = _thrusts(coupling)
    return {
        name: stresses[name] + thrust / area
        for name, thrust, area in zip(WALLS, thrusts, dem.box.wall_areas, strict=True)
    }


def _thrusts(coupling: Coupling) -> np.ndarray:
    """(6,): force of the fluid on each wall, along its outward normal [N]."""
    return coupling.wall_fluid_forces[np.arange(6), WALL_AXES] * WALL_SENSES


# ---- balance ----------------------------------------------------------------------------------------------------


def momentum(dem: DEM) -> np.ndarray:
    """(3,): Σ m v half a step ago [kg m/s]."""
    return (dem.masses[:, None] * dem.velocities).sum(axis=0)


def momentum_residual(dem: DEM, coupling: Coupling | None, before: np.ndarray) -> float:
    """How far grains, walls and fluid are from Newton's second law over the last step, relative to the forces.

    Parameters
    ----------
    before : (3,) array
        `momentum` before the step [kg m/s].

    Notes
    -----
    Contacts between grains cancel, and so does what the fluid does to grains and walls together: the rate of momentum
    is the weight and what is applied, less the forces on the walls. Damping takes momentum besides: NaN.
    """
    if dem.damping > 0.0:
        return np.nan
    rate = (momentum(dem) - before) / dem.last_step
    outside = dem.masses.sum() * dem.gravity + dem.applied.sum(axis=0)
    on_walls = dem.last_wall_forces
    if coupling is not None:
        on_walls = np.concatenate([on_walls, coupling.wall_fluid_forces])
    scale = np.abs(rate).sum() + np.abs(outside).sum() + np.abs(on_walls).sum()
    if scale == 0.0:
        return 0.0
    return float(np.abs(rate - outside + on_walls.sum(axis=0)).max() / scale)


def unbalanced(dem: DEM, coupling: Coupling | None) -> float:
    """`DEM.unbalanced`, with the force of the fluid on each grain among the forces."""
    if coupling is None:
        return dem.unbalanced
    kept = dem.applied
    dem.apply(kept + coupling.fluid_forces)
    with_fluid = dem.unbalanced
    dem.apply(kept)
    return with_fluid


# ---- gauges -----------------------------------------------------------------------------------------------------


def gauge_row(dem: DEM, coupling: Coupling | None, axis: int, places: Sequence[float]) -> dict[str, float]:
    """`gauge_columns`: pressures at places along an axis [m], and porosities between neighbouring ones.

    Nothing is measured at, or next to, a gauge that a wall has passed, nor pressures without a fluid.

    Parameters
    ----------
    dem : DEM
    coupling : Coupling or None
        None: without a fluid.
    axis : int
        0, 1 or 2.
    places : sequence of float
        Increasing [m].
    """
    lower, upper = dem.box.lower[axis], dem.box.upper[axis]
    at = np.array(places)
    (inside,) = np.nonzero((lower <= at) & (at <= upper))
    if not len(inside):
        return {}
    row: dict[str, float] = {}
    if coupling is not None:
        found = PlanePressures.of(coupling.mesh, coupling.cell_pressure, axis).at(at[inside])
        row |= {f"gauge_pressure_{k + 1}": pressure for k, pressure in zip(inside, found.tolist(), strict=True)}
    edges = np.unique([lower, *at[inside], upper])
    porosities = layer_porosities(dem.packing, axis, edges)
    return row | {f"gauge_porosity_{k + 1}": float(porosities[edges.searchsorted(at[k])]) for k in inside[:-1]}


# ---- profiles ---------------------------------------------------------------------------------------------------


def profile_rows(dem: DEM, coupling: Coupling | None, axis: int, layers: int) -> list[dict[str, float]]:
    """`PROFILE_COLUMNS` of each layer, but for the stage; layers are equally thick, across an axis of the box now.

    Parameters
    ----------
    dem : DEM
    coupling : Coupling or None
        None: without a fluid; pressures are NaN.
    axis : int
        Across which the layers lie: 0, 1 or 2.
    layers : int
        Number of layers.
    """
    edges = layer_edges(dem.box, axis, layers)
    stresses, porosities = layer_stresses(dem, axis, edges), layer_porosities(dem.packing, axis, edges)
    pressures, total = np.full(layers, np.nan), stresses
    if coupling is not None:
        pressures = PlanePressures.of(coupling.mesh, coupling.cell_pressure, axis).means(edges)
        total = pressures + stresses
    return [
        {
            "step": dem.steps, "time": dem.time, "layer": k + 1, "lower": edges[k], "upper": edges[k + 1],
            "pressure": pressures[k], "effective_stress": stresses[k], "total_stress": total[k],
            "porosity": porosities[k],
        }
        for k in range(layers)
    ]  # fmt: skip


def layer_stresses(dem: DEM, axis: int, edges: np.ndarray) -> np.ndarray:
    """(l,): normal stress that contacts bear across each layer, positive in compression [Pa].

    The force through a plane is that of the contacts whose branch crosses it; its mean over the planes of a layer
    counts each contact with the part of its branch that lies in the layer. Over the whole box this is `DEM.stress`.
    """
    contacts, x = dem.contacts, dem.positions
    n = len(dem)
    i, j = contacts.grains.T
    ends = np.where((j < n)[:, None], x[np.minimum(j, n - 1)], contacts.points)
    a, b = x[i, axis], ends[:, axis]
    lower, upper = np.minimum(a, b), np.maximum(a, b)
    # Force on the side that is lower on the axis.
    push = np.where(b > a, -1.0, 1.0) * contacts.forces[:, axis]
    inside = np.minimum(upper[:, None], edges[1:]) - np.maximum(lower[:, None], edges[:-1])
    return (push[:, None] * np.maximum(inside, 0.0)).sum(axis=0) / (np.diff(edges) * dem.box.section(axis))


# ---- permeability -----------------------------------------------------------------------------------------------


def permeability(dem: DEM, axis: int, slip: np.ndarray, conductance: ConductanceModel) -> float:
    """Of the grains where they stand, by steady flow along an axis; `slip` (6,) of the walls [m²].

    Parameters
    ----------
    dem : DEM
    axis : int
        Along which the fluid flows: 0, 1 or 2.
    slip : (6,) bool array
        Walls that do not drag the fluid.
    conductance : ConductanceModel

    Returns
    -------
    float
        Permeability [m²].
    """
    walls = {name: Wall(slip=bool(slips)) for name, slips in zip(WALLS, slip, strict=True)}
    for end, pressure in enumerate((1.0, 0.0)):
        wall = 2 * axis + end
        walls[WALLS[wall]] = Wall(pressure, bool(slip[wall]))
    return PoreFlow(PoreMesh(dem.packing), Walls(**walls), conductance=conductance).permeability
