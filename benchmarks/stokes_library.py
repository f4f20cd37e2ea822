"""Resolved Stokes flow through many small packings: data/reference/stokes, to judge conductance models by.

Every packing stands in the unit cube and is driven along y by a unit pressure, between no-slip walls and between planes
of symmetry. What is there already is left alone.

    python benchmarks/stokes_library.py                  # all of them, each in a process of its own
    python benchmarks/stokes_library.py sc8 nine_0.72    # these
    python benchmarks/stokes_library.py --full sc8       # three runs each, with error bars
"""

import argparse
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np
from voids import widest_pores, with_grain

from porefv.conductance.hydraulic_radius import HydraulicRadius
from porefv.dem.growth import grow
from porefv.dem.material import Material
from porefv.dem.random_placement import cloud
from porefv.dem.sizes import UniformSizes
from porefv.flow.fluid import Fluid
from porefv.flow.pore_flow import PoreFlow
from porefv.flow.walls import Walls
from porefv.mesh.pore_mesh import PoreMesh
from porefv.packing.box import Box
from porefv.packing.packing import Packing
from porefv.resolved.refinement import Options, stokes_reference

DATA = Path(__file__).parent.parent / "data"
UNIT = Box([0, 0, 0], [1, 1, 1])
# Clouds, or grown to a porosity: number of grains, r_max / r_min, porosity, seed.
RANDOM = [
    (8, 1, 0.8, 1), (10, 2, 0.7, 2), (12, 5, 0.85, 3), (12, 2, 0.85, 4), (8, 1, 0.5, 6), (10, 3, 0.65, 21),
    (14, 2, 0.75, 22),
]  # fmt: skip
# Grown until they press: number, r_max / r_min, seed, then radii of all times these factors.
PRESSED = [
    (8, 2, 2, (1.0, 0.8)), (10, 5, 3, (1.0,)), (12, 10, 4, (1.0, 0.9)), (12, 2, 5, (1.0, 0.95, 0.8)),
    (16, 5, 6, (1.0, 0.9)), (16, 1, 11, (1.0, 0.9, 0.7)), (20, 2, 7, (1.0, 0.85)), (20, 10, 8, (1.0, 0.9)),
    (30, 2, 9, (1.0,)), (30, 1, 10, (1.0,)), (14, 4, 23, (1.0, 0.92)), (18, 8, 25, (1.0, 0.85)), (24, 2, 24, (1.0,)),
]  # fmt: skip
# Fines in the voids of eight pressed grains: how many, how much smaller than the smallest, seed.
FINES = [(6, 6, 31), (15, 8, 32)]


def stored(name: str) -> Packing:
    """A packing of data/packings."""
    return Packing.read(DATA / "packings" / f"{name}.csv")


def lattice(solid: float) -> Packing:
    """Eight spheres of a simple cubic lattice that fill a given part of the box."""
    radius = 0.5 * (0.75 * solid / np.pi) ** (1 / 3)
    return Packing([[x, y, z] for x in (0.25, 0.75) for y in (0.25, 0.75) for z in (0.25, 0.75)], [radius] * 8, UNIT)


def floating(ratio: float, place: tuple[float, float, float]) -> Packing:
    """Eight touching spheres, and a small one between them that touches none."""
    eight = stored("sc8")
    return Packing(np.vstack([eight.centres, [place]]), np.append(eight.radii, 0.25 * ratio), UNIT)


def body_centred() -> Packing:
    """Nine equal spheres: eight in the corners of the box touch its walls and the ninth."""
    r = np.sqrt(3.0) / (2.0 * (2.0 + np.sqrt(3.0)))
    corners = [[x, y, z] for x in (r, 1 - r) for y in (r, 1 - r) for z in (r, 1 - r)]
    return Packing([*corners, [0.5, 0.5, 0.5]], [r] * 9, UNIT)


def face_centred() -> Packing:
    """Fourteen equal spheres, in the corners and on the faces of a cube that leaves them just within the box."""
    r = 1.0 / (2.0 + 2.0 * np.sqrt(2.0))
    corners = [[i, j, k] for i in (0, 1) for j in (0, 1) for k in (0, 1)]
    faces = [[0.5, 0.5, 0], [0.5, 0.5, 1], [0.5, 0, 0.5], [0.5, 1, 0.5], [0, 0.5, 0.5], [1, 0.5, 0.5]]
    return Packing(r + (1.0 - 2.0 * r) * np.array([*corners, *faces], float), [r] * 14, UNIT)


def grown(number: int, ratio: float, seed: int, **until: float) -> Packing:
    """Grains grown without friction to a porosity or a stress; from a porosity of 0.6 on, a cloud."""
    sizes = UniformSizes(1.0 / ratio)
    if until.get("porosity", 0.0) >= 0.6:
        return cloud(number, sizes, UNIT, until["porosity"], seed)
    material = Material(young=15e6, friction_angle=30.0)
    dem = grow(number, sizes, UNIT, material, seed=seed, friction_angle=0.0, **until)
    return Packing(dem.packing.centres, dem.packing.radii, UNIT)


def loosened(number: int, ratio: float, seed: int, factor: float) -> Packing:
    """Grains that press with 1.5 kPa, their radii times a factor."""
    pressed = grown(number, ratio, seed, stress=1500.0)
    return Packing(pressed.centres, factor * pressed.radii, UNIT)


def with_fines(number: int, smaller: float, seed: int) -> Packing:
    """Eight grains that press, and fines at random in their voids, none of which touches anything."""
    grains = grown(8, 2, 2, stress=1500.0)
    radius = grains.radii.min() / smaller
    centres, radii = grains.centres, grains.radii
    rng = np.random.default_rng(seed)
    while len(radii) < 8 + number:
        place = rng.uniform(1.5 * radius, 1.0 - 1.5 * radius, 3)
        if (np.linalg.norm(centres - place, axis=1) > radii + 1.5 * radius).all():
            centres, radii = np.vstack([centres, place]), np.append(radii, radius)
    return Packing(centres, radii, UNIT)


def one_more(name: str, part: float) -> Packing:
    """A packing, and in the widest of its pores a grain of a part of the radius that fits there."""
    packing = stored(name)
    (place,), (room,) = widest_pores(packing, 1)
    return with_grain(packing, place, part * room)


def cases() -> dict[str, Callable[[], Packing]]:
    """Every packing, by name."""
    found: dict[str, Callable[[], Packing]] = {"bcc9": body_centred, "fcc14": face_centred}
    for name in ("sc8", "nine_0.2", "nine_0.4", "nine_0.5", "nine_0.72", "n25_s1", "n54_s1"):
        found[name] = lambda name=name: stored(name)
    for solid in (0.05, 0.1, 0.2, 0.3, 0.4, 0.5):
        found[f"sc8_c{solid:g}"] = lambda solid=solid: lattice(solid)
    for ratio in (0.05, 0.1, 0.2):
        if ratio < 0.2:  # nine_0.2 is the centred one
            found[f"float_{ratio:g}"] = lambda ratio=ratio: floating(ratio, (0.5, 0.5, 0.5))
        found[f"float_{ratio:g}_off"] = lambda ratio=ratio: floating(ratio, (0.56, 0.47, 0.53))
    for number, ratio, porosity, seed in RANDOM:
        found[f"rnd_n{number}_r{ratio}_p{porosity:g}_s{seed}"] = lambda row=(number, ratio, porosity, seed): grown(
            row[0], row[1], row[3], porosity=row[2]
        )
    for number, ratio, seed, factors in PRESSED:
        for factor in factors:
            kind, end = ("press", "") if factor == 1.0 else ("loose", f"_f{factor:g}")
            found[f"{kind}_n{number}_r{ratio}_s{seed}{end}"] = lambda row=(number, ratio, seed, factor): loosened(*row)
    for number, smaller, seed in FINES:
        found[f"fines_n8_m{number}_d{smaller}_s{seed}"] = lambda row=(number, smaller, seed): with_fines(*row)
    for part in (0.2, 0.5):
        found[f"n25_s1_more{part:g}"] = lambda part=part: one_more("n25_s1", part)
    return found


def compute(name: str, kind: str, out: Path, full: bool) -> None:
    """One case between walls of one kind: its file, and a line about it."""
    slip = kind == "symmetry"
    packing = cases()[name]()
    mesh = PoreMesh(packing)
    walls = Walls.along("y", slip=slip)
    options = Options(mesh_size=0.5) if full else Options(mesh_size=0.6, single=True)
    found = stokes_reference(mesh, walls, 1.0, options, name=f"{name}_{kind}")
    found.write(out / f"{name}_{kind}.json")
    model = PoreFlow(mesh, walls, Fluid(viscosity=1.0), HydraulicRadius()).permeability
    last = found.runs[-1]
    print(
        f"{found.name:32} porosity {packing.porosity:.3f}  K {found.permeability:.6g} m²  "
        f"hydraulic radius {100 * (model / found.permeability - 1):+.0f} %  {last.unknowns} unknowns  "
        f"{sum(run.seconds for run in found.runs):.0f} s  errors {found.errors}",
        flush=True,
    )


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("cases", nargs="*", metavar="CASE")
    parser.add_argument("--out", type=Path, default=DATA / "reference" / "stokes")
    parser.add_argument("--full", action="store_true", help="three runs each, with error bars")
    parser.add_argument("--kind", choices=("symmetry", "no_slip"))
    options = parser.parse_args()
    names = options.cases or list(cases())
    kinds = [options.kind] if options.kind else ["symmetry", "no_slip"]
    if len(names) == 1 and options.kind:
        compute(names[0], options.kind, options.out, options.full)
        return
    for name in names:
        for kind in kinds:
            if not (options.out / f"{name}_{kind}.json").exists():
                # A mesher that crashes takes its own case along, not the others.
                command = [sys.executable, __file__, name, "--kind", kind, "--out", str(options.out)]
                subprocess.run(command + ["--full"] * options.full, check=False)


if __name__ == "__main__":
    main()
