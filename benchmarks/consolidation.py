"""Oedometer on saturated grains against Terzaghi's solution (C14 §3), with nothing fitted.

The sample is brought to 5 kPa between smooth walls. Its modulus comes from a dry compression to the stress of the
test, its permeability from a steady flow, both on the sample of the test; then the top plate presses with the test's
stress at once, and the sample drains through both ends.

    python benchmarks/consolidation.py --grains 500 1000 2000 5000 20000 --out docs/img
    python benchmarks/consolidation.py --grains 5000 --stress 100e3 --out docs/img

Each run is kept in --store (a file a run), and taken from there the next time.
"""

from __future__ import annotations

import argparse
import json
import time
from pathlib import Path

import numpy as np

from porefv import Box, Fluid, Packing, PoreFlow, PoreMesh, Walls
from porefv.coupling import Coupling
from porefv.coupling.ends import permeameter
from porefv.dem import DEM, Material, Plate, UniformSizes, checkpoint, grow
from porefv.flow import throat_conductances
from porefv.poromechanics import terzaghi_pressure, terzaghi_settlement

SIDE, CONFINEMENT, VISCOSITY = 0.66, 5e3, 250.0
MATERIAL = Material(young=15e6, stiffness_ratio=0.5, friction_angle=30.0, density=2600.0)
DRAINED = Walls.from_mapping({"z_min": {"pressure": 0.0}, "z_max": {"pressure": 0.0}, "lateral": {"slip": True}})
LAYERS = 10
TIMES = np.array([0.005, 0.01, 0.02, 0.035, 0.05, 0.075, 0.1, 0.15, 0.2, 0.3, 0.4, 0.5, 0.6, 0.8, 1.0, 1.25])


def sample(grains: int, store: Path) -> DEM:
    """So many grains at rest under 5 kPa."""
    path = store / f"sample_{grains}.npz"
    if not path.exists():
        box = Box([0, 0, 0], [SIDE] * 3)
        smooth = Material(15e6, 0.5, 0.0, 2600.0)
        packing = grow(grains, UniformSizes(0.8), box, stress=CONFINEMENT, seed=1, material=smooth).packing
        plates = {wall: Plate(stress=CONFINEMENT, top_speed=0.01) for wall in ("x_max", "y_max", "z_max")}
        dem = DEM(packing, MATERIAL, plates, damping=0.3)
        dem.run_to_rest(1e-5, 1e-4, 500_000)
        checkpoint.save(dem, path)
    return checkpoint.load(path)


def dry(grains: int, stress: float, store: Path) -> dict:
    """Compression of the dry sample from 5 kPa to a stress: settlement, and moduli by plates and by gauges within."""
    path = store / f"dry_{grains}_{stress:g}.json"
    if not path.exists():
        dem = sample(grains, store)
        height, start = float(dem.box.size[2]), dem.positions
        places = (start[:, 2] - dem.box.lower[2]) / height
        dem.set_plates({"z_max": Plate(stress=stress, top_speed=0.01)})
        dem.run_to_rest(1e-5, 1e-4, 500_000)
        settled = height - float(dem.box.size[2])
        within = (places > 0.1) & (places < 0.9)
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
                    "permeability_after": permeability(pressed)["taps"],
                }
            )
        )
    return json.loads(path.read_text())


def permeability(packing: Packing) -> dict:
    """Permeability [m²] over the whole height, and between taps, and how deep the ends are [m]."""
    mesh = PoreMesh(packing)
    whole = PoreFlow(mesh, Walls.along("z", slip=True)).permeability
    taps = permeameter(mesh, throat_conductances(mesh, PoreFlow(mesh, DRAINED).conductance, DRAINED.slip, 1.0), 2)
    assert taps is not None
    return {"whole": whole, "taps": taps.mobility, "depths": taps.depths}


def consolidation(grains: int, stress: float, store: Path, **options) -> dict:
    """The coupled test: profiles of pressure and settlement at given time factors."""
    name = "_".join([f"{key}-{value}" for key, value in sorted(options.items())])
    path = store / f"wet_{grains}_{stress:g}_{name}.json"
    if not path.exists():
        measured = dry(grains, stress, store)
        dem = sample(grains, store)
        dem.damping = 0.0
        flow = permeability(dem.packing)
        height = float(dem.box.size[2])
        unit = (0.5 * height) ** 2 / (flow["taps"] * measured["gauged_modulus"] / VISCOSITY)
        dem.set_plates({"z_max": Plate(stress=stress, top_speed=0.5)})
        coupling = Coupling(dem, DRAINED, Fluid(viscosity=VISCOSITY), **options)
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
            print(f"  T {moment / unit:.3f}  {coupling.effort.steps} steps  middle {pressure[LAYERS // 2]:.0f} Pa", flush=True)
        effort = coupling.effort
        path.write_text(
            json.dumps(
                {
                    "grains": grains, "stress": stress, "options": options, "dry": measured, "flow": flow,
                    "diameter": float(2 * dem.radii.mean()), "step": dem.step, "drag_number": coupling.drag_number,
                    "rows": rows, "steps": effort.steps, "iterations": effort.iterations, "meshes": effort.meshes,
                    "seconds": time.perf_counter() - begin, "cpu": time.process_time() - cpu,
                    "parts": effort.seconds, "imbalance": imbalance,
                }
            )
        )  # fmt: skip
    return json.loads(path.read_text())


def compare(run: dict, modulus: str = "gauged_modulus", permeability: str = "taps") -> dict:
    """Largest distance from Terzaghi of the layers' pressures and of the settlement, from T = 0.05 on."""
    height = run["dry"]["height"]
    coefficient = run["flow"][permeability] * run["dry"][modulus] / VISCOSITY
    fine = (np.arange(LAYERS * 50) + 0.5) / (LAYERS * 25)
    errors, settlements = [], []
    for row in run["rows"]:
        t = coefficient * row["time"] / (0.5 * height) ** 2
        if t >= 0.0499:
            exact = terzaghi_pressure(fine, t).reshape(LAYERS, 50).mean(axis=1)
            errors.append(float(np.abs(np.array(row["pressure"]) - exact).max()))
            settlements.append(float(abs(row["settlement"] / run["dry"]["settlement"] - terzaghi_settlement(t))))
    return {"pressure": max(errors), "settlement": max(settlements)}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--grains", type=int, nargs="+", default=[500, 1000, 2000, 5000])
    parser.add_argument("--stress", type=float, default=10e3, help="of the plate in the test [Pa]")
    parser.add_argument("--store", type=Path, default=Path("consolidation"), help="directory for runs")
    parser.add_argument("--plain", action="store_true", help="without the correction of the ends, too")
    options = parser.parse_args()
    options.store.mkdir(exist_ok=True)
    for grains in options.grains:
        for corrected in (True, False) if options.plain else (True,):
            run = consolidation(grains, options.stress, options.store, end_correction=corrected)
            print(
                f"{grains} grains, ends corrected {corrected}: k {run['flow']['taps']:.4g} (whole {run['flow']['whole']:.4g}) m², "
                f"E {run['dry']['gauged_modulus']:.4g} (plates {run['dry']['modulus']:.4g}) Pa, {run['steps']} steps, "
                f"{run['seconds']:.0f} s, {run['iterations'] / run['steps']:.2f} iterations a step, {run['meshes']} meshes"
            )
            for modulus in ("gauged_modulus", "modulus"):
                for k in ("taps", "whole"):
                    print("   ", modulus, k, compare(run, modulus, k))


if __name__ == "__main__":
    main()
