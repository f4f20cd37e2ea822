"""Scenes and results in words, for the terminal."""

from __future__ import annotations

import os
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from porefv import memory
from porefv.errors import InputError
from porefv.packing import WALLS

if TYPE_CHECKING:
    from porefv.packing import Packing
    from porefv.results import Results
    from porefv.scene import Scene


def scene_text(scene: Scene, packing: Packing) -> str:
    """What a scene asks for, and the packing it is about."""
    overlaps = packing.overlaps
    box = packing.box
    assert box is not None  # the scene has seen to it
    walls = {name: vars(wall) for name, wall in zip(WALLS, scene.walls, strict=True)}
    fluid, flow, output = scene.fluid, scene.flow, scene.output
    asked = ", ".join(output.quantities) or "the pores alone"
    directory = output.directory
    exists = " (exists: solve needs --force)" if directory.is_dir() and any(directory.iterdir()) else ""
    rows = [
        (
            "packing",
            f"{_path(scene.packing.file)}: {_count(len(packing))} spheres, radii {_range(packing.radii)} m",
        ),
        (
            "overlaps",
            f"{_count(len(overlaps.pairs))} pairs of spheres, {_count(len(overlaps.wall_ids))} across walls",
        ),
        ("box", f"{_vector(box.lower)} to {_vector(box.upper)} m"),
        ("fluid", f"viscosity {fluid.viscosity:g} Pa s, density {fluid.density:g} kg/m³"),
        ("walls", _walls(walls)),
        ("flow", f"{flow.conductance.name}, solver {flow.solver}, gravity {_vector(flow.gravity)} m/s²"),
        (
            "output",
            f"{asked}{'; VTK files' if output.vtk else ''}, in {_path(directory)}{exists}",
        ),
    ]
    free = memory.available()
    needed = f"about {memory.required(len(packing)) / 2**30:.1f} GiB at the most"
    rows.append(("memory", needed if free is None else f"{needed}, {free / 2**30:.1f} GiB free"))
    return "\n".join([f"{_path(scene.path or 'scene')} is sound", *_rows(rows)])


def outcome(results: Results) -> str:
    """What `solve` says when it is done."""
    summary = results.summary
    found = [f"{_count(summary['packing']['spheres'])} spheres, {_count(summary['mesh']['pores'])} pores"]
    if "permeability" in summary:
        found.append(f"permeability {summary['permeability']:.6g} m²")
    if "forces" in summary:
        found.append(f"force balance {summary['forces']['conservation_residual']:.1e}")
    return f"{', '.join(found)}; {summary['seconds']['total']:.2f} s\nresults in {_path(results.directory)}"


def summary_text(results: Results) -> str:
    """The numbers of a results directory, in paragraphs.

    Raises
    ------
    InputError
        If the summary lacks what every summary has.
    """
    try:
        return _summary_text(results)
    except (KeyError, TypeError, ValueError, AttributeError) as error:
        reason = f"it lacks {error}" if isinstance(error, KeyError) else str(error)
        raise InputError(f"{results.directory}: summary.json is damaged: {reason}. Solve again.") from None


def _summary_text(results: Results) -> str:
    summary = results.summary
    packing, mesh, unusual = summary["packing"], summary["mesh"], summary.get("unusual", {})
    paragraphs: list[tuple[str, list[tuple[str, Any]]]] = [
        ("Packing", [
            ("file", packing["file"] and _path(packing["file"])),
            ("box", f"{_vector(packing['box']['lower'])} to {_vector(packing['box']['upper'])} m"),
            ("spheres", f"{_count(packing['spheres'])}, radii {_range(packing['radii'])} m"),
            ("hidden spheres", packing["hidden_spheres"] or None),
            ("overlapping pairs", _count(packing['overlapping_pairs'])),
            ("porosity", f"{packing['porosity']:.6g}"),
            ("porosity error", _bound(packing["porosity_error"], "too high, where three spheres meet")),
            ("pore volume", f"{packing['pore_volume']:.6g} m³"),
        ]),
        ("Pores", [
            ("pores", f"{_count(mesh['pores'])} ({_count(mesh['united_pores'])} united with another)"),
            ("throats", _count(mesh['throats'])),
            *((name.replace("_", " "), _count(count)) for name, count in unusual.items() if count),
        ]),
        ("Flow", _flow_rows(summary)),
        ("Forces on the spheres", _force_rows(summary)),
        ("Computation", [
            *_solver_rows(summary),
            ("time", ", ".join(f"{stage} {time:.2f}" for stage, time in summary["seconds"].items()) + " s"),
            ("versions", ", ".join(f"{name} {number}" for name, number in summary["versions"].items())),
        ]),
    ]  # fmt: skip
    lines = [f"{_path(results.directory)}: {summary['scene'] and _path(summary['scene'])}, {summary['created']}"]
    for title, rows in paragraphs:
        if rows:
            lines += ["", title, *_rows(rows)]
    return "\n".join(lines)


def _flow_rows(summary: Mapping[str, Any]) -> list[tuple[str, Any]]:
    if "flow" not in summary:
        return []
    flow, fluid = summary["flow"], summary["fluid"]
    rows = [
        ("fluid", f"viscosity {fluid['viscosity']:g} Pa s, density {fluid['density']:g} kg/m³"),
        ("walls", _walls(summary["walls"])),
        ("conductance", flow["conductance"]),
        ("inflow", f"{flow['inflow']:.6g} m³/s"),
        ("outflow", f"{flow['outflow']:.6g} m³/s (imbalance {flow['imbalance']:.1e})"),
        ("closing error", _bound(flow.get("closing_error"), "of the flow, in throats closed that may be open")),
    ]
    if "permeability" in summary:
        rows += [
            ("permeability", f"{summary['permeability']:.6g} m²"),
            ("hydraulic conductivity", f"{summary['hydraulic_conductivity']:.6g} m/s"),
        ]
    return rows


def _force_rows(summary: Mapping[str, Any]) -> list[tuple[str, Any]]:
    if "forces" not in summary:
        return []
    sums = summary["forces"]["sums"]
    rows = [(part, f"({_vector(sums[part])}) N") for part in ("pressure", "viscous", "buoyancy", "total")]
    rows.append(("walls, total", f"({_vector(sums['wall_total'])}) N"))
    rows.append(("force balance", f"{summary['forces']['conservation_residual']:.1e}"))
    return rows


def _bound(error: float | None, of_what: str) -> str | None:
    return f"at most {error:.1e} {of_what}" if error else None


def _solver_rows(summary: Mapping[str, Any]) -> list[tuple[str, Any]]:
    if "solver" not in summary:
        return []
    solver = summary["solver"]
    unknowns, iterations = f"{_count(solver['unknowns'])} unknowns", f"{solver['iterations']} iterations"
    return [("solver", f"{solver['name']}, {unknowns}, {iterations}, imbalance {solver['imbalance']:.1e}")]


def _walls(walls: Mapping[str, Mapping[str, Any]]) -> str:
    """Walls that have the same condition together."""
    groups: dict[str, list[str]] = {}
    for name, wall in walls.items():
        kind = "no-flux" if wall["pressure"] is None else f"{wall['pressure']:g} Pa"
        groups.setdefault(f"{kind}, {'slip' if wall['slip'] else 'no-slip'}", []).append(name)
    return "; ".join(f"{' '.join(names)}: {kind}" for kind, names in groups.items())


def _rows(rows: Iterable[tuple[str, Any]]) -> list[str]:
    rows = [(name, value) for name, value in rows if value is not None]
    width = max(len(name) for name, _ in rows)
    return [f"  {name:{width}}  {value}" for name, value in rows]


def _count(number: int) -> str:
    return f"{number:,}".replace(",", " ")


def _range(values: Iterable[float]) -> str:
    lowest, highest = min(values), max(values)
    return f"{lowest:.4g}" if lowest == highest else f"{lowest:.4g} to {highest:.4g}"


def _vector(values: Iterable[float]) -> str:
    return ", ".join(f"{value:.6g}" for value in values)


def _path(path: str | os.PathLike[str]) -> str:
    return str(Path(os.path.normpath(path)))
