"""A bed under clear fluid that a rising pressure at its bottom lifts (docs/coupling.md).

    python benchmarks/lifting.py --seeds 3 --store lifting

600 grains, r_min/r_max = 0.8, settle in a box of 0.5 x 0.5 x 1 m under their weight in the fluid. The pressure at the
bottom rises from nothing. The weight over the section, W/A, is the pressure that carries the bed; the floor then bears
no contact. Side walls have neither friction nor viscous drag. Settled beds are kept in --store.
"""

from __future__ import annotations

import argparse
import json
import time
from pathlib import Path

import numpy as np

from porefv.coupling.coupling import Coupling
from porefv.dem import checkpoint
from porefv.dem.dem import DEM
from porefv.dem.material import Material
from porefv.dem.random_placement import cloud
from porefv.dem.settling import settle
from porefv.dem.sizes import UniformSizes
from porefv.flow.fluid import Fluid
from porefv.flow.walls import Walls
from porefv.packing.box import Box

GRAINS, BOX, POROSITY = 600, Box([0, 0, 0], [0.5, 0.5, 1.0]), 0.7
MATERIAL = Material(young=15e6, stiffness_ratio=0.5, friction_angle=30.0, density=2600.0)
FLUID = Fluid(viscosity=10.0, density=1000.0)
GRAVITY = 9.81
EVERY = 20  # steps between two looks


def bed(seed: int, store: Path) -> DEM:
    """Grains at rest on the floor, under their weight in the fluid."""
    path = store / f"bed_{seed}.npz"
    if not path.exists():
        packing = cloud(GRAINS, UniformSizes(0.8), BOX, POROSITY, seed)
        dem = DEM(packing, MATERIAL, gravity=(0.0, 0.0, -GRAVITY), damping=0.3)
        dem.apply(buoyancy(dem))
        settle(dem, unbalanced=1e-4)
        checkpoint.save(dem, path)
    dem = checkpoint.load(path)
    dem.damping = 0.0
    return dem


def buoyancy(dem: DEM) -> np.ndarray:
    """(n, 3): force of the hydrostatic pressure on each grain [N]."""
    return np.outer(dem.masses * FLUID.density / MATERIAL.density * GRAVITY, [0.0, 0.0, 1.0])


def walls(pressure: float) -> Walls:
    """So much pressure at the bottom, clear fluid at the top."""
    return Walls.from_mapping(
        {"z_min": {"pressure": pressure}, "z_max": {"pressure": 0.0, "free": True}, "lateral": {"slip": True}}
    )


def lift(seed: int, rate: float, store: Path, until: float, **options) -> dict[str, np.ndarray]:
    """The ramp, up to `until` times W/A: a row every 20 steps."""
    dem = bed(seed, store)
    dem.apply(buoyancy(dem))
    weight = float(dem.masses.sum()) * (1.0 - FLUID.density / MATERIAL.density) * GRAVITY
    section = dem.box.section(2)
    bearing = weight / section
    coupling = Coupling(dem, walls(0.0), FLUID, **options)
    begun, heights, mass = dem.time, dem.positions[:, 2], dem.masses / dem.masses.sum()
    begin, rows = time.process_time(), []
    while (pressure := rate * (dem.time - begun)) < until * bearing:
        coupling.set_walls(walls(pressure))
        coupling.run(EVERY)
        flux = coupling.wall_flux
        rows.append(
            {
                "pressure": pressure / bearing,
                "floor": -dem.last_wall_forces[4, 2] / weight,
                "risen": float(mass @ (dem.positions[:, 2] - heights)) / (2.0 * dem.radii.mean()),
                "in": flux["z_min"],
                "out": -flux["z_max"],
                "imbalance": coupling.mass_imbalance,
            }
        )
    found = {name: np.array([row[name] for row in rows]) for name in rows[0]}
    effort = coupling.effort
    return found | {
        "bearing": bearing, "steps": effort.steps, "seconds": time.process_time() - begin, "scheme": coupling.scheme,
        "iterations": effort.iterations / effort.steps, "meshes": effort.meshes,
    }  # fmt: skip


def when(course: dict[str, np.ndarray], happened: np.ndarray) -> float:
    """Bottom pressure over W/A from which on something holds without a break; NaN where it does not at the end."""
    first = np.flatnonzero(~happened)[-1] + 1
    return float(course["pressure"][first]) if first < len(happened) else float("nan")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seeds", type=int, default=3)
    parser.add_argument("--rates", type=float, nargs="+", default=[1000.0], help="of the bottom pressure [Pa/s]")
    parser.add_argument("--until", type=float, default=1.05, help="bottom pressure at the end, over W/A")
    parser.add_argument("--store", type=Path, default=Path("lifting"), help="directory of settled beds")
    parser.add_argument("--options", type=json.loads, default={}, help="of Coupling, as JSON")
    options = parser.parse_args()
    options.store.mkdir(exist_ok=True)
    print("| Pa/s | seed | W/A, Pa | contact below 0.01 W/A | below 0.001 | risen by 0.01 d | in against out |")
    print("|---|---|---|---|---|---|---|")
    for rate in options.rates:
        for seed in range(1, options.seeds + 1):
            course = lift(seed, rate, options.store, options.until, **options.options)
            lifted = [when(course, course["floor"] < part) for part in (0.01, 0.001)]
            risen = when(course, course["risen"] > 0.01)
            unequal = np.abs(course["in"] - course["out"]) / np.abs(course["in"])
            print(
                f"| {rate:g} | {seed} | {course['bearing']:.0f} | {lifted[0]:.3f} | {lifted[1]:.3f} | {risen:.3f} | "
                f"{unequal.max():.0e} |", flush=True
            )  # fmt: skip
            print(
                f"  {course['scheme']}, {course['steps']} steps, {course['iterations']:.2f} iterations each, "
                f"{course['meshes']} meshes, {course['seconds']:.0f} s; mass imbalance of pores up to "
                f"{course['imbalance'].max():.2g}"
            )


if __name__ == "__main__":
    main()
