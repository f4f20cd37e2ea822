"""The content of summary.json: numbers of the whole sample, how they were computed, and how long it took."""

from __future__ import annotations

import json
import platform
import re
from collections.abc import Collection, Mapping, Sequence
from dataclasses import asdict
from datetime import UTC, datetime
from importlib.metadata import PackageNotFoundError, version
from typing import TYPE_CHECKING, Any

import numpy as np

from porefv.conductance.section_friction.model import SectionFriction
from porefv.errors import ComputationError, printable
from porefv.flow.regions import region_text
from porefv.packing.box import WALLS
from porefv.packing.free_space import WallLayer
from porefv.results.force_table import FORCE_FILES
from porefv.system.number_checks import known
from porefv.system.version import __version__

if TYPE_CHECKING:
    from porefv.flow.directional_permeabilities import DirectionalPermeabilities
    from porefv.flow.pore_flow import PoreFlow
    from porefv.flow.reliability import Reliability
    from porefv.mesh.pore_mesh import PoreMesh

UNITS = {
    "permeability": "m2", "permeabilities": "m2",
    "hydraulic_conductivity": "m/s", "inflow": "m3/s", "outflow": "m3/s",
    "wall_flux": "m3/s", "wall_pressure": "Pa",
    "flow": "m3/s", "velocity": "m/s", "pore_volume": "m3", "box": "m", "radii": "m", "gap": "m", "viscosity": "Pa s",
    "density": "kg/m3", "gravity": "m/s2", "pressure": "Pa", "sums": "N", "thrust": "N", "seconds": "s",
    "pore_sizes": "m", "constriction_sizes": "m", "planes": "m3/s", "tortuosity": "1", "reynolds": "1",
    "diffusion": "1",
    "profile": "1",
}  # fmt: skip


def summary_json(
    mesh: PoreMesh,
    flow: PoreFlow | None,
    *,
    quantities: Collection[str],
    vtk: bool,
    table_format: str,
    seconds: Mapping[str, float],
    layers: Sequence[WallLayer],
    sample: Mapping[str, Any],
    permeabilities: DirectionalPermeabilities | None = None,
    scene: str | None = None,
    packing: str | None = None,
) -> str:
    """The text of summary.json.

    Parameters
    ----------
    mesh : PoreMesh
    flow : PoreFlow or None
        None: the pores alone.
    quantities, vtk, table_format
        What was asked for.
    seconds : mapping of str to float
        Wall time of each stage.
    layers : sequence of WallLayer
        Along the walls.
    sample : mapping
        What `quantity_summaries` returns.
    permeabilities : DirectionalPermeabilities, optional
    scene, packing : str, optional
        Names of the files.
    """
    summary = {
        "created": datetime.now(UTC).isoformat(timespec="seconds"),
        "scene": scene and printable(scene),
        "quantities": list(quantities),
        "packing": {"file": packing and printable(packing), **_packing(mesh, layers)},
        "mesh": _mesh(mesh),
        **({} if flow is None else _flow(flow, quantities, table_format)),
        **({} if permeabilities is None else {"permeabilities": vars(permeabilities)}),
        **sample,
        **_interior(flow, quantities, layers),
        "seconds": {**seconds, "total": sum(seconds.values())},
        "versions": _versions(["vtk"] * vtk + ["pyarrow"] * (table_format == "parquet")),
        "units": UNITS,
    }
    try:
        text = json.dumps(summary, indent=2, ensure_ascii=False, allow_nan=False, default=_plain)
    except ValueError:
        raise ComputationError("a result is not a finite number, and nothing was written") from None
    # Vectors on one line. Strings hold no line breaks in JSON, so that none is met here.
    return re.sub(r"\[\n\s+([^][{}]*?)\n\s+\]", _on_one_line, text) + "\n"


def tested_reliability(flow: PoreFlow) -> Reliability | None:
    """The reliability of a flow by the model that the tested range is of; None for other models."""
    return flow.reliability if flow.conductance.name == SectionFriction.name else None


def _interior(
    flow: PoreFlow | None, quantities: Collection[str], layers: Sequence[WallLayer]
) -> dict[str, dict[str, Any] | None]:
    """Porosity and permeability of the inside, where the box has free space: the box is not the sample then."""
    if flow is None or "permeability" not in quantities or not any(layer.free for layer in layers):
        return {}
    return {"interior": None if flow.interior is None else _finite(asdict(flow.interior))}


def _on_one_line(found: re.Match[str]) -> str:
    return "[" + re.sub(r",\n\s+", ", ", found[1]) + "]"


def _packing(mesh: PoreMesh, layers: Sequence[WallLayer]) -> dict[str, Any]:
    packing = mesh.packing
    return {
        "spheres": len(packing),
        "hidden_spheres": len(mesh.triangulation.hidden),
        "overlapping_pairs": len(packing.overlaps.pairs),
        "overlapping_triples": packing.triple_overlaps,
        "radii": [packing.radii.min(), packing.radii.max()],
        "box": {"lower": mesh.box.lower, "upper": mesh.box.upper},
        "porosity": packing.porosity,
        "walls": {layer.wall: _wall_layer(layer) for layer in layers},
        "pore_volume": packing.porosity * mesh.box.volume,
        "reading": None if packing.reading is None else packing.reading.as_data(),
    }


def _wall_layer(layer: WallLayer) -> dict[str, float | bool | None]:
    porosities = {"porosity": known(layer.porosity), "inside": known(layer.inside)}
    return {"gap": layer.gap, **porosities, "free_space": layer.free}


def _mesh(mesh: PoreMesh) -> dict[str, Any]:
    return {
        "cells": mesh.n_cells,
        "pores": mesh.n_pores,
        "united_pores": mesh.n_united,
        "throats": len(mesh.throats),
        "unite_tolerance": mesh.unite_tolerance,
    }


def _flow(flow: PoreFlow, quantities: Collection[str], table_format: str) -> dict[str, Any]:
    walls = {
        name: {"pressure": wall.pressure, "slip": bool(wall.slip)}
        | {key: value for key in ("inflow", "velocity") if (value := getattr(wall, key)) is not None}
        for name, wall in zip(WALLS, flow.walls, strict=True)
    }
    found: dict[str, Any] = {
        "fluid": {"viscosity": flow.fluid.viscosity, "density": flow.fluid.density},
        "walls": walls,
        "flow": {
            "conductance": flow.conductance.name,
            "conductance_model": repr(flow.conductance),
            "gravity": flow.gravity,
            "inflow": flow.inflow,
            "outflow": flow.outflow,
            "imbalance": flow.imbalance,
            "closing_error": flow.closing_error,
            "wall_flux": flow.wall_flux,
            "wall_pressure": flow.wall_pressure,
        },
        "unusual": _unusual(flow),
        "solver": {name: known(value) for name, value in vars(flow.solver_report).items()},
    }
    if flow.sources:
        found["sources"] = [{"region": region_text(s.region), "flow": s.flow} for s in flow.sources]
    if flow.fixed_pressures:
        found["pressures"] = [
            {"region": region_text(fixed.region), "pressure": fixed.pressure, "flow": flux}
            for fixed, flux in zip(flow.fixed_pressures, flow.fixed_pressure_flux, strict=True)
        ]
    if flow.reynolds is not None:
        found["reynolds"] = {"sample": flow.reynolds, "largest_pore": flow.pore_reynolds}
    if (reliability := tested_reliability(flow)) is not None:
        found["reliability"] = asdict(reliability)
    if "permeability" in quantities:
        found["permeability"] = flow.permeability
        found["hydraulic_conductivity"] = flow.hydraulic_conductivity
    if "forces" in quantities:
        forces = flow.forces
        found["forces"] = {
            "sums": forces.sums,
            "thrust": forces.thrust,
            "conservation_residual": forces.conservation_residual,
            "table": FORCE_FILES[table_format],
        }
    return found


def _unusual(flow: PoreFlow) -> dict[str, int | None]:
    """Counts of throats and pores that need a rule of their own; None for what nothing has computed."""
    throats = flow.mesh.throats
    counts: dict[str, np.ndarray | None] = {
        "pores_of_several_pressures": flow.pores_of_several_pressures,
        "closed_throats": throats.closed,
        "throats_without_length": throats.lengths <= 0.0,
        "throats_without_conductance": flow.conductances == 0.0,
        "isolated_pores": flow.solution.isolated,
    }
    counts["throats_without_volume"] = counts["throats_without_surface"] = counts["throats_wider_than_the_box"] = None
    if "volumes" in vars(throats):  # the conductance model, or the forces, need them
        counts["throats_without_volume"] = throats.volumes <= 0.0
        surfaces = throats.wetted_surfaces(flow.walls.slip)
        counts["throats_without_surface"] = surfaces <= 0.0
        # No passage in a box has a hydraulic radius as large as the box: the spheres beside it are dust.
        counts["throats_wider_than_the_box"] = throats.volumes > np.maximum(surfaces, 0.0) * flow.mesh.box.size.min()
    return {name: None if found is None else int(np.count_nonzero(found)) for name, found in counts.items()}


def _versions(used: Sequence[str]) -> dict[str, str]:
    found = {"porefv": __version__, "python": platform.python_version()}
    for name in ("numpy", "scipy", "numba", *used):
        try:
            found[name] = version(name)
        except PackageNotFoundError:
            found[name] = "unknown"
    return found


def _plain(value: Any) -> Any:
    return value.tolist()  # numpy's arrays and numbers


def _finite(values: dict[str, Any]) -> dict[str, Any]:
    return {name: known(value) for name, value in values.items()}
