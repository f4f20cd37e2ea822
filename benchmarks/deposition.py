"""Course of an immersed deposition (docs/coupling.md): its front, what is behind it, and its gauges.

python benchmarks/deposition.py 500          runs deposition_500.toml with frames; 5000: deposition.toml
python benchmarks/deposition.py DIRECTORY    measures a run that there is, with frames and gauges

The solid fraction of a place is that of a slice a diameter thick. The front is the highest place where it is half of
that of the start. Its thickness is the distance of the highest places where it is 0.1 and 0.9 of the start. Behind the
front is from 6 to 2 diameters below it. Speeds are over that of a grain alone, between a row of the table and the next
one. Gradients are those between gauges that are 2 diameters or more below the front, over the critical one of the
start, and over the weight, less the buoyancy, of the grains that are there.
"""

import argparse
import tomllib
from itertools import pairwise
from pathlib import Path

import numpy as np

from porefv import Packing, simulation
from porefv.packing.layers import layer_porosities
from porefv.scenes import SimulationScene
from porefv.simulation.gauge_picture import Gauges
from porefv.simulation.run_record import read_record

SCENES = Path(__file__).resolve().parents[1] / "data" / "scenes"
NAMES = {"500": "deposition_500", "5000": "deposition"}
# Slices in a diameter.
FINE = 20


def simulated(name):
    """Results of a scene with frames, beside this script."""
    data = tomllib.loads((SCENES / f"{name}.toml").read_text(encoding="utf-8"))
    data["output"] |= {"directory": str(SCENES / "results" / f"{name}_frames"), "frames": 1.0, "profiles": 1.0}
    return simulation.run(SimulationScene.from_mapping(data, directory=SCENES), force=True)


def solid_fractions(packing):
    """Places up the vessel, and the solid fraction of a slice a diameter thick around each."""
    diameter = 2.0 * packing.radii.mean()
    box = packing.box
    edges = np.linspace(box.lower[2], box.upper[2], round(FINE * box.size[2] / diameter) + 1)
    solid = np.concatenate([[0.0], np.cumsum(1.0 - layer_porosities(packing, 2, edges))])
    return edges[FINE // 2 : -FINE // 2], (solid[FINE:] - solid[:-FINE]) / FINE


def front_of(packing, start):
    """Height of the front [m], its thickness over the diameter, and the solid fraction behind it over the start's."""
    places, fractions = solid_fractions(packing)
    diameter = 2.0 * packing.radii.mean()
    front, first, last = (places[np.flatnonzero(fractions >= part * start)[-1]] for part in (0.5, 0.1, 0.9))
    behind = (places > front - 6.0 * diameter) & (places < front - 2.0 * diameter)
    return front, (first - last) / diameter, fractions[behind].mean() / start


def bed_of(layers, load):
    """Height of the bed, by the layers of a profile [m]."""
    bears = layers["effective_stress"] > 0.01 * load
    count = len(bears) if bears.all() else int(np.argmin(bears))
    return float(layers["lower"][count]) if count < len(bears) else float(layers["upper"][-1])


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("run", help="500, 5000, or a directory of results")
    parser.add_argument("--every", type=float, default=10.0, help="time between rows of the table [s]")
    options = parser.parse_args()
    results = simulated(NAMES[options.run]) if options.run in NAMES else Path(options.run)
    scene, series = SimulationScene.from_record(read_record(results).scene), simulation.read_series(results)
    gauges = Gauges.of(scene, series)
    step = series["time"][-1] / series["step"][-1]
    paths = sorted((results / "frames").glob("grains_*.vtp"))
    frames = {step * int(path.stem.removeprefix("grains_")): path for path in paths}
    known = np.array(list(frames))
    times = np.unique([known[np.abs(known - t).argmin()] for t in np.arange(0.0, known[-1] + 1e-9, options.every)])
    first = Packing.read(frames[times[0]])
    start = 1.0 - first.porosity
    weight = (scene.material.density - scene.fluid.density) * 9.81
    alone = 2.0 / 9.0 * weight * first.radii.mean() ** 2 / scene.fluid.viscosity
    load = weight * (4.0 / 3.0 * np.pi * first.radii**3).sum() / first.box.section(2)
    profiles = simulation.read_profiles(results)
    measured = {time: front_of(Packing.read(frames[time]), start) for time in times}
    print(
        "| t, s | front, m | thickness / d | c behind / start | speed | law at c | bed, m | gradient "
        "| gradient / weight |"
    )
    print("|---|---|---|---|---|---|---|---|---|")
    for time, later in pairwise(times):
        front, thickness, behind = measured[time]
        speed = (front - measured[later][0]) / (later - time) / alone
        profile = profiles[profiles["time"] == profiles["time"][np.abs(profiles["time"] - later).argmin()]]
        bed = bed_of(profile, load)
        below = (gauges.places[1:] <= front - 4.0 * first.radii.mean()) & (gauges.places[:-1] >= bed)
        rows = (gauges.times > max(time, 0.2)) & (gauges.times <= later)
        shown = ["", ""]
        if below.any():
            gradients = gauges.gradients[rows][:, below]
            for k, scale in enumerate((gauges.critical_at_start, gauges.critical[rows][:, below])):
                ratio = gradients / scale
                shown[k] = f"{ratio.mean():.3f} ({ratio.min():.2f} to {ratio.max():.2f})"
        law = (1.0 - behind * start) ** 4.65
        print(
            f"| {time:.0f} | {front:.3f} | {thickness:.1f} | {behind:.2f} | {speed:.3f} | {law:.3f} | {bed:.2f} "
            f"| {shown[0]} | {shown[1]} |"
        )
    last = series[-1]
    print(
        f"\nat {last['time']:.1f} s: contacts bear {last['contact_stress_z_min'] / load:.3f} of the weight on the floor"
    )
    print(f"largest pressure {last['max_pressure'] / load:.4f} of the weight")
    print(f"{last['meshes']:.0f} meshes, {last['step']:.0f} steps")
    error = np.abs(series["power_error"][series["time"] > 0.2])
    print(f"power: {np.nanmax(error):.1e} of the weight's at worst, {np.nanmedian(error):.0e} in the median")
    floor = (series["total_stress_z_min"] / load)[series["time"] > 0.5]
    print(f"fluid and contacts on the floor: {floor.mean():.4f} of the weight, standard deviation {floor.std():.4f}")
    for time in (5.0, *times[1:]):
        row = series[np.abs(series["time"] - time).argmin()]
        print(f"{row['time']:.0f} s: contacts on the floor bear {row['contact_stress_z_min'] / load:.3f} of the weight")


if __name__ == "__main__":
    main()
