"""Oedometer on saturated grains against Terzaghi's solution (C14 §3), with nothing fitted.

The sample is brought to 5 kPa between smooth walls. Its modulus comes from a dry compression to the stress of the
test, its permeability from a steady flow, both on the sample of the test; then the top plate presses with the test's
stress at once, and the sample drains through both ends.

    python benchmarks/consolidation.py --grains 500 1000 2000 5000 --seeds 5 5 5 3 --out docs/img/consolidation.png
    python benchmarks/consolidation.py --grains 2000 --stress 50e3 --out docs/img/consolidation_large.png

Samples differ by the seed of their growth. Each test is kept in --store (a file a test), and taken from there the next
time: a run that was stopped goes on with the tests that lack. The modulus is that between gauges within the sample, the
permeability that between taps, as in a laboratory: the grains on the plates are softer bedded and drain freely. What
the bedding settles, known from the dry test too, is taken off the settlement.
"""

from __future__ import annotations

import argparse
import json
import time
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.ticker import FixedLocator, NullLocator

from porefv.conductance.conductances import throat_conductances
from porefv.conductance.model import ConductanceModel
from porefv.conductance.registry import AUTO, MODELS
from porefv.coupling.consolidation import terzaghi_pressure, terzaghi_settlement
from porefv.coupling.coupling import Coupling
from porefv.coupling.end_correction import permeameter
from porefv.dem import checkpoint
from porefv.dem.dem import DEM
from porefv.dem.growth import grow
from porefv.dem.material import Material
from porefv.dem.plate import Plate
from porefv.dem.sizes import UniformSizes
from porefv.export.picture_style import INK, PictureSize, new_figure, style
from porefv.flow.fluid import Fluid
from porefv.flow.pore_flow import PoreFlow
from porefv.flow.walls import Walls
from porefv.mesh.pore_mesh import PoreMesh
from porefv.packing.box import Box
from porefv.packing.packing import Packing

SIDE, CONFINEMENT, VISCOSITY = 0.66, 5e3, 250.0
MATERIAL = Material(young=15e6, stiffness_ratio=0.5, friction_angle=30.0, density=2600.0)
DRAINED = Walls.from_mapping({"z_min": {"pressure": 0.0}, "z_max": {"pressure": 0.0}, "lateral": {"slip": True}})
LAYERS = 10
TIMES = np.array([0.005, 0.01, 0.02, 0.035, 0.05, 0.075, 0.1, 0.15, 0.2, 0.3, 0.4, 0.5, 0.6, 0.8, 1.0, 1.25])
SHOWN = (0.02, 0.05, 0.1, 0.2, 0.4, 0.8)


def named(grains: int, seed: int, ratio: float) -> str:
    """Part of the names of a sample's files."""
    return f"{grains}_{seed}" + ("" if ratio == 0.8 else f"_{ratio:g}")


def sample(grains: int, store: Path, seed: int = 1, ratio: float = 0.8) -> DEM:
    """So many grains at rest under 5 kPa, the smallest of `ratio` times the radius of the largest."""
    path = store / f"sample_{named(grains, seed, ratio)}.npz"
    if not path.exists():
        box = Box([0, 0, 0], [SIDE] * 3)
        smooth = Material(15e6, 0.5, 0.0, 2600.0)
        packing = grow(grains, UniformSizes(ratio), box, stress=CONFINEMENT, seed=seed, material=smooth).packing
        plates = {wall: Plate(stress=CONFINEMENT, top_speed=0.01) for wall in ("x_max", "y_max", "z_max")}
        dem = DEM(packing, MATERIAL, plates, damping=0.3)
        dem.run_to_rest(1e-5, 1e-4, 500_000)
        checkpoint.save(dem, path)
    return checkpoint.load(path)


def dry(grains: int, stress: float, store: Path, seed: int, ratio: float) -> dict:
    """Compression of the dry sample from 5 kPa to a stress: settlement, and moduli by plates and by gauges within."""
    path = store / f"dry_{named(grains, seed, ratio)}_{stress:g}.json"
    if not path.exists():
        dem = sample(grains, store, seed, ratio)
        height, start = float(dem.box.size[2]), dem.positions
        places = (start[:, 2] - dem.box.lower[2]) / height
        dem.set_plates({"z_max": Plate(stress=stress, top_speed=0.01)})
        dem.run_to_rest(1e-5, 1e-4, 500_000)
        settled = height - float(dem.box.size[2])
        held = np.bincount(dem.contacts.grains.ravel(), minlength=grains + 6)[:grains] >= 3  # the others rattle
        within = (places > 0.1) & (places < 0.9) & held
        slope = np.polyfit(places[within] * height, (dem.positions - start)[within, 2], 1)[0]
        pressed = dem.packing
        dem.set_plates({"z_max": Plate(stress=CONFINEMENT, top_speed=0.01)})
        dem.run_to_rest(1e-5, 1e-4, 500_000)
        added = stress - CONFINEMENT
        path.write_text(
            json.dumps(
                {
                    "height": height,
                    "settlement": settled,
                    "modulus": added * height / settled,
                    "gauged_modulus": added / -slope,
                    "given_back": 1.0 - (height - float(dem.box.size[2])) / settled,
                    "permeability_after": {
                        name: permeability(pressed, model())["taps"] for name, model in MODELS.items()
                    },
                }
            )
        )
    return json.loads(path.read_text())


def permeability(packing: Packing, model: ConductanceModel) -> dict:
    """Permeability [m²] over the whole height, and between taps, and how deep the ends are [m]."""
    mesh = PoreMesh(packing)
    whole = PoreFlow(mesh, Walls.along("z", slip=True), conductance=model).permeability
    taps = permeameter(mesh, throat_conductances(mesh, model, DRAINED.slip, 1.0), 2)
    assert taps is not None
    return {"whole": whole, "taps": taps.mobility, "depths": taps.depths}


def print_ends(grains: int, store: Path) -> None:
    """How deep the ends are by each model of conductance, in mean radii."""
    dem = sample(grains, store)
    for name, model in MODELS.items():
        found = permeability(dem.packing, model())
        depths = np.array(found["depths"]) / dem.radii.mean()
        print(
            f"{grains} grains, {name}: k {found['taps']:.4g} m² between taps, "
            f"ends {depths[0]:.2f} and {depths[1]:.2f} radii"
        )


def consolidation(
    grains: int, seed: int, ratio: float, stress: float, store: Path, conductance: str, **options
) -> dict:
    """The coupled test: profiles of pressure and settlement at given time factors."""
    name = "_".join([conductance, *(f"{key}-{value}" for key, value in sorted(options.items()))])
    model = MODELS[conductance]()
    path = store / f"wet_{named(grains, seed, ratio)}_{stress:g}_{name}.json"
    if not path.exists():
        measured = dry(grains, stress, store, seed, ratio)
        dem = sample(grains, store, seed, ratio)
        dem.damping = 0.0
        flow = permeability(dem.packing, model)
        height = float(dem.box.size[2])
        unit = (0.5 * height) ** 2 / (flow["taps"] * measured["gauged_modulus"] / VISCOSITY)
        dem.set_plates({"z_max": Plate(stress=stress, top_speed=0.5)})
        coupling = Coupling(dem, DRAINED, Fluid(viscosity=VISCOSITY), model, **options)
        begin, cpu = time.perf_counter(), time.process_time()
        rows = []
        imbalance = 0.0
        for moment in TIMES * unit:
            coupling.run(max(round(moment / dem.step) - coupling.effort.steps, 0))
            mesh = coupling.mesh
            places = (mesh.vertices[:, 2] - dem.box.lower[2]) / dem.box.size[2]
            layers = np.clip((places * LAYERS).astype(int), 0, LAYERS - 1)
            pressure = np.bincount(layers, coupling.cell_pressure * mesh.cell_volumes, LAYERS)
            pressure /= np.bincount(layers, mesh.cell_volumes, LAYERS)
            imbalance = max(imbalance, coupling.power.imbalance)
            rows.append(
                {
                    "time": coupling.effort.steps * dem.step,
                    "pressure": (pressure / (stress - CONFINEMENT)).tolist(),
                    "peak": float(coupling.pressure.max() / (stress - CONFINEMENT)),
                    "settlement": height - float(dem.box.size[2]),
                    "contact": dem.wall_stress["z_max"],
                }
            )
            print(
                f"  T {moment / unit:.3f}  {coupling.effort.steps} steps  middle {pressure[LAYERS // 2]:.0f} Pa",
                flush=True,
            )
        effort = coupling.effort
        path.write_text(
            json.dumps(
                {
                    "grains": grains, "seed": seed, "stress": stress, "options": options, "flow": flow,
                    "diameter": float(2 * dem.radii.mean()), "step": dem.step, "drag_number": coupling.drag_number,
                    "rows": rows, "steps": effort.steps, "iterations": effort.iterations, "meshes": effort.meshes,
                    "seconds": time.perf_counter() - begin, "cpu": time.process_time() - cpu,
                    "parts": effort.seconds, "imbalance": imbalance,
                }
            )
        )  # fmt: skip
    run = json.loads(path.read_text()) | {"dry": dry(grains, stress, store, seed, ratio)}
    run["dry"]["initial_modulus"] = dry(grains, 1.1 * CONFINEMENT, store, seed, ratio)["gauged_modulus"]
    run["flow"]["after"] = run["dry"]["permeability_after"][conductance]
    return run


def exact_layers(t: float) -> np.ndarray:
    """(LAYERS,): Terzaghi's mean pressure in each layer."""
    fine = (np.arange(LAYERS * 50) + 0.5) / (LAYERS * 25)
    return terzaghi_pressure(fine, t).reshape(LAYERS, 50).mean(axis=1)


def course(run: dict, modulus: str = "gauged_modulus", taps: str = "taps") -> list[tuple[float, np.ndarray, float]]:
    """T, pressures of the layers, and degree of consolidation of the sample without its bedding, at each moment."""
    height, settled = run["dry"]["height"], run["dry"]["settlement"]
    coefficient = run["flow"][taps] * run["dry"][modulus] / VISCOSITY
    bedding = settled - (run["stress"] - CONFINEMENT) * height / run["dry"]["gauged_modulus"]
    return [
        (
            coefficient * row["time"] / (0.5 * height) ** 2,
            np.array(row["pressure"]),
            (row["settlement"] - bedding) / (settled - bedding),
        )
        for row in run["rows"]
    ]


def errors(run: dict, **kinds: str) -> tuple[float, float]:
    """Largest distance from Terzaghi of the layers' pressures and of the settlement, from T = 0.05 on."""
    late = [moment for planned, moment in zip(TIMES, course(run, **kinds), strict=True) if planned >= 0.05]
    return (
        max(float(np.abs(pressure - exact_layers(t)).max()) for t, pressure, _ in late),
        max(abs(settled - float(terzaghi_settlement(t))) for t, _, settled in late),
    )


def spread(values: list[float]) -> str:
    """Mean and standard deviation of samples, or the value of one."""
    mean = f"{np.mean(values):.3f}"
    return mean if len(values) == 1 else f"{mean} ± {np.std(values, ddof=1):.3f}"


def print_table(corrected: dict[int, list[dict]], plain: dict[int, list[dict]]) -> None:
    """A row for each number of grains: means over the samples, and the standard deviation of errors."""
    print(
        "\n| grains | samples | across | k, m² | E, MPa | error of p/Δσ, T ≥ 0.05 | of U | p/Δσ, ends not corrected |"
    )
    print("|---|---|---|---|---|---|---|---|")
    for grains, runs in corrected.items():
        across, k, modulus = np.mean(
            [(x["dry"]["height"] / x["diameter"], x["flow"]["taps"], x["dry"]["gauged_modulus"] / 1e6) for x in runs],
            axis=0,
        )
        pressures, settlements = zip(*(errors(run) for run in runs), strict=True)
        ends = spread([errors(run)[0] for run in plain[grains]]) if grains in plain else ""
        print(
            f"| {grains} | {len(runs)} | {across:.1f} | {k:.2e} | {modulus:.2f} | {spread(pressures)} | "
            f"{spread(settlements)} | {ends} |"
        )


def draw(samples: dict[int, list[dict]], path: Path) -> None:
    """Pressures over the height, settlement over time, and errors against grains across or which constants.

    Pressures are those of the first sample of the most grains, settlements those of the first of each number.
    """
    with style():
        figure = new_figure(PictureSize(1700, 620, 150), layout="constrained")
        left, middle, right = figure.subplots(1, 3)
        runs = {grains: found[0] for grains, found in samples.items()}
        largest = runs[max(runs)]
        draw_profiles(left, largest)
        t = np.geomspace(1e-3, 2.0, 200)
        middle.semilogx(t, terzaghi_settlement(t), "-", color=INK, lw=1.2, label="Terzaghi")
        for grains, run in runs.items():
            moments = course(run)
            middle.semilogx([m[0] for m in moments], [m[2] for m in moments], "o", ms=3, label=f"{grains} grains")
        middle.set(xlabel="T", ylabel="U", ylim=(1.0, -0.05), title="settlement, less the bedding")
        middle.legend()
        if len(runs) > 1:
            draw_errors(right, samples)
        else:
            for modulus, k, label in (
                ("initial_modulus", "taps", "initial modulus, initial k"),
                ("gauged_modulus", "after", "secant modulus, final k"),
            ):
                moments = course(largest, modulus, k)
                right.plot([m[0] for m in moments], [m[1][LAYERS // 2] for m in moments], "o", ms=4, label=label)
            right.plot(t, [exact_layers(x)[LAYERS // 2] for x in t], "-", color=INK, lw=1.2, label="Terzaghi")
            right.set(xlabel="T", ylabel="p / Δσ in the middle", xlim=(0, 1.5), title="which constants")
            right.legend()
        figure.savefig(path)


def draw_profiles(axes: Axes, run: dict) -> None:
    """Pressures of layers beside Terzaghi's, at some of the times."""
    z = np.linspace(0.0, 2.0, 201)
    for k, t in enumerate(TIMES):
        if t in SHOWN:
            now, pressure, _ = course(run)[k]
            (line,) = axes.plot(terzaghi_pressure(z, now), 0.5 * z, lw=1.2)
            axes.plot(pressure, (np.arange(LAYERS) + 0.5) / LAYERS, "o", ms=4, color=line.get_color(), label=f"{t:g}")
    axes.set(xlabel="p / Δσ", ylabel="z / h", title=f"{run['grains']} grains; lines: Terzaghi", xlim=(0.0, 1.5))
    axes.legend(title="T")


def draw_errors(axes: Axes, samples: dict[int, list[dict]]) -> None:
    """Errors of all samples against the grains across, and a line through the means."""
    for part, name in enumerate(("pressure", "settlement")):
        across = [np.mean([run["dry"]["height"] / run["diameter"] for run in runs]) for runs in samples.values()]
        found = [[errors(run)[part] for run in runs] for runs in samples.values()]
        (line,) = axes.loglog(across, [np.mean(each) for each in found], "-", lw=1.2, label=f"{name}, mean")
        for x, each in zip(across, found, strict=True):
            axes.loglog([x] * len(each), each, "o", ms=3, color=line.get_color())
    for axis, ticks in ((axes.xaxis, [8, 10, 12, 16, 20, 25]), (axes.yaxis, [0.005, 0.01, 0.02, 0.05, 0.1, 0.2])):
        axis.set_major_locator(FixedLocator(ticks))
        axis.set_major_formatter("{x:g}")
        axis.set_minor_locator(NullLocator())
    axes.set(xlabel="grains across the sample", ylabel="largest error, T ≥ 0.05", title="convergence; points: samples")
    axes.legend()


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--grains", type=int, nargs="+", default=[500, 1000, 2000, 5000])
    parser.add_argument(
        "--seeds", type=int, nargs="+", default=[1], help="samples of each number of grains, or one number for all"
    )
    parser.add_argument("--ratio", type=float, default=0.8, help="smallest over largest radius")
    parser.add_argument("--stress", type=float, default=10e3, help="of the plate in the test [Pa]")
    parser.add_argument("--store", type=Path, default=Path("consolidation"), help="directory for runs")
    parser.add_argument("--exchange", default="facets", help="facets or volumes")
    parser.add_argument("--conductance", choices=MODELS, default=AUTO.name)
    parser.add_argument("--pairs", action="store_true", help="with the resistance of pairs")
    parser.add_argument("--out", type=Path, help="picture to draw")
    parser.add_argument("--ends", action="store_true", help="only say how deep the ends are, by model of conductance")
    parser.add_argument("--plain", action="store_true", help="without the correction of the ends, too")
    options = parser.parse_args()
    options.store.mkdir(exist_ok=True)
    if options.ends:
        for grains in options.grains:
            print_ends(grains, options.store)
        return
    seeds = options.seeds if len(options.seeds) > 1 else options.seeds * len(options.grains)
    other: dict[str, object] = {} if options.exchange == "facets" else {"exchange": options.exchange}
    if options.pairs:
        other["pair_resistance"] = True
    found: dict[bool, dict[int, list[dict]]] = {True: {}, False: {}}
    for grains, samples in zip(options.grains, seeds, strict=True):
        for seed in range(1, samples + 1):
            for ends in (True, False) if options.plain else (True,):
                run = consolidation(
                    grains, seed, options.ratio, options.stress, options.store, options.conductance,
                    end_correction=ends, **other,
                )  # fmt: skip
                print_run(run, ends)
                found[ends].setdefault(grains, []).append(run)
    print_table(found[True], found[False])
    if options.out:
        draw(found[True], options.out)


def print_run(run: dict, ends: bool) -> None:
    """Constants, cost and errors of one sample."""
    flow, moduli = run["flow"], run["dry"]
    print(
        f"{run['grains']} grains, seed {run['seed']}, ends {'corrected' if ends else 'as they are'}: "
        f"k {flow['taps']:.4g} between taps, {flow['whole']:.4g} in all, {flow['after']:.4g} m² in the end; "
        f"E {moduli['gauged_modulus']:.4g} between gauges, "
        f"{moduli['modulus']:.4g} between plates, {moduli['initial_modulus']:.4g} Pa at first"
    )
    print(
        f"  {run['steps']} steps of {run['step']:.3g} s, {run['seconds']:.0f} s ({run['cpu']:.0f} s of CPU), "
        f"{run['iterations'] / run['steps']:.2f} iterations a step, {run['meshes']} meshes; "
        f"power balances to {run['imbalance']:.1e}; highest pressure at first {run['rows'][0]['peak']:.2f} Δσ"
    )
    for kinds in ({}, {"modulus": "modulus", "taps": "whole"}, {"modulus": "initial_modulus"}, {"taps": "after"}):
        pressure, settled = errors(run, **kinds)
        print(f"  errors of pressure {pressure:.3f}, of settlement {settled:.3f} {kinds or ''}", flush=True)


if __name__ == "__main__":
    main()
