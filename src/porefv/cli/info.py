"""The command `porefv info`: print a summary of results."""

from __future__ import annotations

import argparse
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from porefv.cli.options import add_command
from porefv.cli.packing_text import hidden_row, is_packing_file, packing_text
from porefv.cli.text import count_text, path_text, range_text, rows_text, say, vector_text, walls_text
from porefv.errors import InputError

if TYPE_CHECKING:
    from porefv.results.reading import Results


def register(commands: Any) -> None:
    """Add the command to the command line."""
    parser = add_command(
        commands, "info", "print a summary of results, or of a packing file",
        "porefv info results\nporefv info packing.csv", "formats.md",
    )  # fmt: skip
    parser.add_argument("results", metavar="RESULTS", type=Path, help="results directory, or packing file")
    parser.set_defaults(command=run)


def run(options: argparse.Namespace) -> None:
    """Run the command."""
    from porefv.results.reading import read
    from porefv.simulation.run_record import is_simulation, read_record

    if is_simulation(options.results):
        from porefv.cli.simulate import outcome_text
        from porefv.simulation.reading import check_series

        record = read_record(options.results)
        check_series(record, options.results)
        say(outcome_text(record, options.results))
    elif is_packing_file(options.results):
        from porefv.packing.packing import Packing

        packing = Packing.read(options.results)
        text = packing_text(packing, options.results)
        say(text if packing.box is None else f"{text}\n{hidden_row(packing)}")
    else:
        say(summary_text(read(options.results)))


def summary_text(results: Results) -> str:
    """The numbers of a results directory, in paragraphs.

    Raises
    ------
    InputError
        If the summary lacks what every summary has.
    """
    try:
        return _summary_text(results)
    except (KeyError, TypeError, ValueError, AttributeError, OverflowError) as error:
        reason = f"it lacks {error}" if isinstance(error, KeyError) else str(error)
        raise InputError(f"{results.directory}: summary.json is damaged: {reason}. Solve again.") from None


def _summary_text(results: Results) -> str:
    summary = results.summary
    packing, mesh, unusual = summary["packing"], summary["mesh"], summary.get("unusual", {})
    paragraphs: list[tuple[str, list[tuple[str, Any]]]] = [
        ("Packing", [
            ("file", packing["file"] and path_text(packing["file"])),
            ("box", f"{vector_text(packing['box']['lower'])} to {vector_text(packing['box']['upper'])} m"),
            ("spheres", f"{count_text(packing['spheres'])}, radii {range_text(packing['radii'])} m"),
            ("hidden spheres", packing["hidden_spheres"] or None),
            ("overlapping pairs", count_text(packing['overlapping_pairs'])),
            ("porosity", f"{packing['porosity']:.6g}"),
            *_wall_rows(packing),
            ("pore volume", f"{packing['pore_volume']:.6g} m³"),
        ]),
        ("Pores", [
            ("pores", f"{count_text(mesh['pores'])} ({count_text(mesh['united_pores'])} united with another)"),
            ("throats", count_text(mesh['throats'])),
            *((name.replace("_", " "), count_text(count)) for name, count in unusual.items() if count),
        ]),
        ("Flow", _flow_rows(summary)),
        ("Permeabilities along the axes", _axes_rows(summary)),
        ("Sample", _sample_rows(summary)),
        ("Forces on the spheres", _force_rows(summary)),
        ("Computation", [
            *_solver_rows(summary),
            ("time", ", ".join(f"{stage} {time:.2f}" for stage, time in summary["seconds"].items()) + " s"),
            ("versions", ", ".join(f"{name} {number}" for name, number in summary["versions"].items())),
        ]),
    ]  # fmt: skip
    lines = [
        f"{path_text(results.directory)}: {summary['scene'] and path_text(summary['scene'])}, {summary['created']}"
    ]
    for title, rows in paragraphs:
        if rows:
            lines += ["", title, *rows_text(rows)]
    return "\n".join(lines)


def _wall_rows(packing: Mapping[str, Any]) -> list[tuple[str, Any]]:
    """The walls that have free space between them and the grains."""
    rows = []
    for name, wall in packing.get("walls", {}).items():
        if wall["free_space"]:
            text = f"{name}: nearest sphere {wall['gap']:.3g} m away"
            if wall["porosity"] is not None:
                text += f", porosity {wall['porosity']:.2f}, inside {wall['inside']:.2f}"
            rows.append(("free space", text))
    return rows


def _flow_rows(summary: Mapping[str, Any]) -> list[tuple[str, Any]]:
    if "flow" not in summary:
        return []
    flow, fluid = summary["flow"], summary["fluid"]
    rows = [
        ("fluid", f"viscosity {fluid['viscosity']:g} Pa s, density {fluid['density']:g} kg/m³"),
        ("walls", walls_text(summary["walls"])),
        ("conductance", flow["conductance"]),
        ("inflow", f"{flow['inflow']:.6g} m³/s"),
        ("outflow", f"{flow['outflow']:.6g} m³/s (imbalance {flow['imbalance']:.1e})"),
        ("Reynolds number", _reynolds(summary.get("reynolds"))),
        ("outside tested range", _outside(summary.get("reliability"))),
        ("closing error", _bound(flow.get("closing_error"), "of the flow, in throats closed that may be open")),
    ]
    if any("inflow" in wall or "velocity" in wall for wall in summary["walls"].values()):
        pressures = ", ".join(f"{name} {pressure:.6g}" for name, pressure in flow["wall_pressure"].items())
        rows.append(("pressures of the walls", f"{pressures} Pa"))
    for source in summary.get("sources", []):
        rows.append(("source", f"{source['flow']:.6g} m³/s in {source['region']}"))
    for fixed in summary.get("pressures", []):
        rows.append(
            ("fixed pressure", f"{fixed['pressure']:.6g} Pa in {fixed['region']}, flow {fixed['flow']:.6g} m³/s")
        )
    if "permeability" in summary:
        rows += [
            ("permeability", f"{summary['permeability']:.6g} m²"),
            ("inside", _inside(summary.get("interior"))),
            ("hydraulic conductivity", f"{summary['hydraulic_conductivity']:.6g} m/s"),
        ]
    return rows


def _inside(found: Mapping[str, Any] | None) -> str | None:
    """Permeability and porosity two mean diameters away from the walls."""
    if found is None or found["permeability"] is None:
        return None
    return f"permeability {found['permeability']:.6g} m², porosity {found['porosity']:.4f}, away from the walls"


def _axes_rows(summary: Mapping[str, Any]) -> list[tuple[str, Any]]:
    if "permeabilities" not in summary:
        return []
    found = summary["permeabilities"]
    rows = [(axis, f"{found[axis]:.6g} m²") for axis in "xyz"]
    return [*rows, ("walls beside the flow", "slip" if found["slip"] else "no-slip")]


def _reynolds(found: Mapping[str, float] | None) -> str | None:
    """The number of the Darcy velocity, and the largest of a pore's; None where no density was given."""
    return None if found is None else f"{found['sample']:.3g}, in a pore at most {found['largest_pore']:.3g}"


def _outside(found: Mapping[str, Any] | None) -> str | None:
    """How much of the flow is where the model was not tested, if that is worth a word."""
    if found is None or found["outside"] < 0.01:
        return None
    parts = {
        name.replace("_", " "): part for name, part in found.items() if name not in ("outside", "of") and part >= 0.01
    }
    kinds = ", ".join(f"{name} {100 * part:.0f} %" for name, part in parts.items())
    return f"{100 * found['outside']:.0f} % of the {found.get('of', 'dissipation')} ({kinds})"


def _sample_rows(summary: Mapping[str, Any]) -> list[tuple[str, Any]]:
    """The quantities of the sample besides permeability and forces."""
    rows: list[tuple[str, Any]] = []
    if "tortuosity" in summary:
        tortuosity = summary["tortuosity"]
        rows.append(
            ("hydraulic tortuosity", "unknown, as nothing flows" if tortuosity is None else f"{tortuosity:.6g}")
        )
    if "diffusion" in summary:
        rows += _diffusion_rows(summary["diffusion"])
    if "velocity" in summary:
        rows += [
            ("Darcy velocity", f"({vector_text(summary['velocity']['darcy'])}) m/s"),
            ("interstitial velocity", f"({vector_text(summary['velocity']['interstitial'])}) m/s"),
        ]
    if "profile" in summary:
        profile = summary["profile"]
        layers = f"{count_text(profile['layers'])} layers along {profile['axis']}"
        rows.append(("profile", f"{layers}, porosity {range_text(profile['porosity'])}"))
    for name, title, weights in (
        ("pore_sizes", "pore radius", {"by_number": "by number", "by_volume": "by void volume"}),
        ("constriction_sizes", "constriction radius", {"by_number": "by number", "by_flux": "by flux"}),
    ):
        rows += [
            (f"{title}, {words}", _radii(summary[name][kind])) for kind, words in weights.items() if name in summary
        ]
    if summary.get("planes", {}).get("flux"):
        planes = summary["planes"]
        count = f"{count_text(planes['planes'])} planes along {planes['axis']}"
        fluxes = dict.fromkeys(f"{flux:.6g}" for flux in planes["flux"])  # one, where they are the same
        rows.append(("flux through planes", f"{' to '.join(fluxes)} m³/s, {count}"))
    return rows


def _diffusion_rows(found: Mapping[str, Any]) -> list[tuple[str, Any]]:
    if found["relative_diffusivity"] == 0.0:
        return [("effective diffusivity", f"0 along {found['axis']}, as no open path leads through the sample")]
    return [
        ("effective diffusivity", f"{found['relative_diffusivity']:.6g} of the fluid's, along {found['axis']}"),
        ("formation factor", f"{found['formation_factor']:.6g}"),
        ("diffusive tortuosity", f"{found['diffusive_tortuosity']:.6g}"),
    ]


def _radii(found: Mapping[str, float | None]) -> str:
    if found["mean"] is None:
        return "none"
    return f"median {found['r50']:.4g} m, 10 % below {found['r10']:.4g} m, 90 % below {found['r90']:.4g} m"


def _force_rows(summary: Mapping[str, Any]) -> list[tuple[str, Any]]:
    if "forces" not in summary:
        return []
    sums = summary["forces"]["sums"]
    rows = [(part, f"({vector_text(sums[part])}) N") for part in ("pressure", "viscous", "buoyancy", "total")]
    rows.append(("walls, total", f"({vector_text(sums['wall_total'])}) N"))
    rows.append(("force balance", f"{summary['forces']['conservation_residual']:.1e}"))
    rows.append(("table", summary["forces"].get("table", "forces.csv")))  # the only one until 0.1
    return rows


def _bound(error: float | None, of_what: str) -> str | None:
    return f"at most {error:.1e} {of_what}" if error else None


def _solver_rows(summary: Mapping[str, Any]) -> list[tuple[str, Any]]:
    if "solver" not in summary:
        return []
    solver = summary["solver"]
    unknowns, iterations = f"{count_text(solver['unknowns'])} unknowns", f"{solver['iterations']} iterations"
    return [("solver", f"{solver['name']}, {unknowns}, {iterations}, imbalance {solver['imbalance']:.1e}")]
