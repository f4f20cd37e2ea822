"""Whether results are what they were: record them with one version of porefv, compare with another.

    python benchmarks/unchanged.py record results.npz
    python benchmarks/unchanged.py compare results.npz [--relative 1e-12]

Recorded, on one thread: the permeability and the force on every sphere and wall of each packing of data/packings with
every conductance model and both kinds of lateral wall; the state of a coupled run after 200 steps, for both coupling
schemes; and the state of a DEM run after 1000 steps. Without `--relative`, arrays must be equal to the bit. With it,
the largest difference of an array must be below that part of its largest value. Bits may differ between processors, and
between versions of numba, NumPy and SciPy.
"""

from __future__ import annotations

import argparse
import os
import sys
from pathlib import Path

os.environ["NUMBA_NUM_THREADS"] = "1"

import numpy as np

from porefv.conductance.registry import MODELS
from porefv.coupling.coupling import Coupling
from porefv.dem.dem import DEM
from porefv.dem.material import Material
from porefv.dem.plate import Plate
from porefv.flow.pore_flow import PoreFlow
from porefv.flow.walls import Wall, Walls
from porefv.mesh.pore_mesh import PoreMesh
from porefv.packing.packing import Packing

PACKINGS = Path(__file__).resolve().parents[1] / "data" / "packings"
FORCES = ("pressure", "viscous", "buoyancy", "wall_pressure", "wall_viscous", "wall_buoyancy")


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("action", choices=("record", "compare"))
    parser.add_argument("file", type=Path, help="results, a .npz file")
    parser.add_argument("--relative", type=float, default=0.0, help="largest difference over largest value of an array")
    options = parser.parse_args()
    now = {**steady_flows(), **dem_run(), **coupled_run("implicit-drag"), **coupled_run("semi-implicit")}
    if options.action == "record":
        np.savez(options.file, **now)
        print(f"{len(now)} arrays recorded in {options.file}")
        return 0
    with np.load(options.file) as file:
        before = {name: file[name] for name in file.files}
    changed = [f"{name}: recorded by one version alone" for name in sorted(before.keys() ^ now.keys())]
    largest = 0.0
    for name in sorted(before.keys() & now.keys()):
        difference = relative_difference(before[name], now[name])
        largest = max(largest, difference)
        if not (difference <= options.relative and (options.relative or before[name].tobytes() == now[name].tobytes())):
            changed.append(f"{name}: differs by {difference:.1e} of its largest value")
    print("\n".join(changed) or f"{len(now)} arrays are as they were; largest relative difference {largest:.1e}")
    return 1 if changed else 0


def relative_difference(a: np.ndarray, b: np.ndarray) -> float:
    """Largest |a - b| over the largest |a|; infinite where shapes differ."""
    if a.shape != b.shape:
        return np.inf
    scale = np.abs(a).max(initial=0.0)
    difference = np.abs(a - b).max(initial=0.0)
    return float(difference / scale) if scale > 0.0 else float(difference)


def steady_flows() -> dict[str, np.ndarray]:
    found = {}
    for path in sorted(PACKINGS.glob("*.csv")):
        mesh = PoreMesh(Packing.read(path))
        for slip in (False, True):
            for name, model in MODELS.items():
                walls = Walls.along("y", slip=slip)
                flow = PoreFlow(mesh, walls, conductance=model(), gravity=(0.0, 0.0, -9.81))
                key = f"{path.stem}/{name}/{'slip' if slip else 'no_slip'}"
                found[f"{key}/permeability"] = np.array(flow.permeability)
                found |= {f"{key}/{part}": getattr(flow.forces, part) for part in FORCES}
    return found


def dem_run() -> dict[str, np.ndarray]:
    """200 grains sheared and pressed by a plate, with friction."""
    dem = DEM(Packing.read(PACKINGS / "n200_s1.csv"), Material(), plates(), gravity=(0.0, 0.0, -9.81), damping=0.1)
    dem.run(1000)
    return {f"dem/{name}": array for name, array in grain_state(dem).items()}


def coupled_run(scheme: str) -> dict[str, np.ndarray]:
    """200 grains pressed by a plate, drained at the top."""
    dem = DEM(Packing.read(PACKINGS / "n200_s1.csv"), Material(), plates())
    coupling = Coupling(dem, Walls(z_max=Wall(pressure=0.0)), scheme=scheme, renewal=5e-4)
    coupling.run(200)
    state = grain_state(dem) | {
        "pressure": coupling.pressure,
        "fluid_forces": coupling.fluid_forces,
        "wall_fluid_forces": coupling.wall_fluid_forces,
        "iterations": np.array(coupling.effort.iterations),
        "meshes": np.array(coupling.effort.meshes),
    }
    return {f"{scheme}/{name}": array for name, array in state.items()}


def plates() -> dict[str, Plate]:
    return {"z_max": Plate(stress=2e3, top_speed=0.5, friction_angle=20.0), "x_min": Plate(velocity=(0.0, 0.1, 0.0))}


def grain_state(dem: DEM) -> dict[str, np.ndarray]:
    contacts = dem.contacts
    return {
        "positions": dem.positions, "velocities": dem.velocities, "spins": dem.spins, "places": dem.places,
        "contact_grains": contacts.grains, "contact_forces": contacts.forces,
        "energies": np.array(list(vars(dem.energies).values())),
    }  # fmt: skip


if __name__ == "__main__":
    sys.exit(main())
