"""Clouds of free grains: common drag, settling, and grains alone, in pairs and between walls (docs/coupling.md).

python benchmarks/settling.py                 the tables
python benchmarks/settling.py --seeds 2       quicker
python benchmarks/settling.py collapse        settlement in time at several viscosities
python benchmarks/settling.py surface       mean speed of dilute clouds under a free surface and in a closed box
python benchmarks/settling.py permeability    errors on grains that are held, with the conductances that go with pairs

Up to a solid fraction of 0.25 grains are placed at random. Denser clouds are grown, and then mixed by Monte Carlo moves
of hard spheres: growth leaves grains in contact.
"""

import argparse
from pathlib import Path

import numpy as np
from scipy import sparse
from scipy.sparse.linalg import splu

from porefv import Box, Fluid, Packing, PoreFlow, Walls
from porefv.coupling import Coupling
from porefv.coupling.open_throats import open_throats
from porefv.dem.dem import DEM
from porefv.dem.growth import grow
from porefv.dem.material import Material
from porefv.dem.random_placement import cloud
from porefv.dem.sizes import UniformSizes
from porefv.resolved.reference import StokesReference
from porefv.solvers.pressure_equation import solve_network

SLIP = {"lateral": {"slip": True}}
BOX = Box([0, 0, 0], [1, 1, 1])
# Solid fraction up to which grains are placed at random; and moves of each grain, and their length over the radius,
# that mix a denser cloud.
PLACED, MOVES, LENGTH = 0.25, 300, 0.15
# Times of a settlement, over that in which a grain alone falls by the height.
PARTS = np.arange(1, 10) / 20.0


def coupled(packing, walls=SLIP, roughness=0.02, pairs=True):
    """A coupling of grains at rest, at 1 Pa s."""
    return Coupling(
        DEM(packing), Walls.from_mapping(walls), Fluid(viscosity=1.0), scheme="implicit-drag",
        pair_resistance=pairs, roughness=roughness, end_correction=False,
    )  # fmt: skip


def pore_resistance(coupling):
    """(3 n, 3 n): Eᵀ G⁻¹ E of the grains, by row."""
    equation = coupling.equation
    n, free = len(coupling.grains), len(equation.network)
    matrix = equation.network.to_matrix().tocsc()
    if not equation.network.leaks.any():  # a closed box: pressures are defined up to a constant
        matrix = matrix + sparse.csc_array(([matrix.diagonal()[0]], ([0], [0])), shape=matrix.shape)
    forces = np.stack([equation.forces(unit)[:n].ravel() for unit in np.eye(free)])
    return forces.T @ splu(matrix.tocsc()).solve(forces)


def pair_resistance(coupling, spinning=True):
    """(3 n, 3 n): L of the grains, by row, free to spin or else held from it."""
    n = len(coupling.grains)
    resistance = coupling.pair_resistance
    units = np.eye(6 * n).reshape(6 * n, n, 6)
    whole = np.stack(
        [resistance.multiply(np.concatenate([unit, np.zeros((6, 6))]))[:n].ravel() for unit in units], axis=1
    )
    moves, turns = ((6 * np.arange(n)[:, None] + np.arange(k, k + 3)).ravel() for k in (0, 3))
    if not spinning:
        return whole[np.ix_(moves, moves)]
    inner = whole[np.ix_(turns, turns)]
    inner += 1e-12 * max(np.trace(inner), 1e-300) / len(inner) * np.eye(len(inner))
    return whole[np.ix_(moves, moves)] - whole[np.ix_(moves, turns)] @ np.linalg.solve(
        inner, whole[np.ix_(turns, moves)]
    )


def bed_drag(c):
    """Drag of a fixed random bed of solid fraction c, over Stokes' (Beetstra, van der Hoef and Kuipers 2007)."""
    return (10.0 * c / (1.0 - c) ** 2 + (1.0 - c) ** 2 * (1.0 + 1.5 * np.sqrt(c))) / (1.0 - c)


def richardson_zaki(c):
    """Settling speed over that of a grain alone."""
    return (1.0 - c) ** 4.65


def dense_cloud(n, c, seed):
    """Equal grains apart, mixed as hard spheres are (Metropolis et al. 1953)."""
    grown = grow(n, UniformSizes(1.0), BOX, Material(friction_angle=0.0), porosity=1.0 - c, seed=seed).packing
    radius = np.cbrt(c / (n * 4.0 / 3.0 * np.pi))
    places, rng = grown.centres.copy(), np.random.default_rng(seed)
    for _ in range(MOVES):
        for k in range(n):
            moved = places[k] + LENGTH * radius * rng.uniform(-1.0, 1.0, 3)
            squares = ((places - moved) ** 2).sum(axis=1)
            squares[k] = np.inf
            if (abs(moved - 0.5) <= 0.5 - radius).all() and squares.min() >= 4.0 * radius**2:
                places[k] = moved
    return Packing(places, np.full(n, radius), BOX)


def of_cloud(c, seed, n=300):
    """Common drag; mean, scatter and fastest of the settling speeds; smallest eigenvalue; in units of Stokes' drag."""
    packing = cloud(n, UniformSizes(1.0), BOX, 1.0 - c, seed) if c <= PLACED else dense_cloud(n, c, seed)
    coupling = coupled(packing)
    stokes = 6.0 * np.pi * packing.radii[0]
    pores = pore_resistance(coupling) / stokes
    resistance = pores + pair_resistance(coupling) / stokes
    down = np.tile([0.0, 0.0, 1.0], n)
    common = down @ pores @ down / n
    speeds = np.linalg.solve(resistance, down).reshape(n, 3)[:, 2]
    mean = speeds.mean()
    return common, mean, speeds.std() / mean, speeds.max() / mean, np.linalg.eigvalsh(resistance)[0]


def alone(side, walls=SLIP, width=None):
    """Speed over Stokes' along x of a grain of radius 1 at the centre of a box: side across z, width along x, y."""
    width = side if width is None else width
    centre = np.array([0.5 * width + 1e-3, 0.5 * width - 2e-3, 0.5 * side + 5e-4])
    coupling = coupled(Packing([centre], [1.0], Box([0, 0, 0], [width, width, side])), walls)
    resistance = pore_resistance(coupling) + pair_resistance(coupling, spinning=False)
    return 6.0 * np.pi / resistance[0, 0]


def faxen(side):
    """Speed over Stokes' of a grain midway between two no-slip walls (Faxén 1922)."""
    x = 2.0 / side
    return 1.0 - 1.004 * x + 0.418 * x**3 + 0.21 * x**4 - 0.169 * x**5


def two(gap, along, side=25.0):
    """Force over Stokes' on each of two grains of radius 1 that move at unit speeds against each other."""
    half = np.array([0.5 * (2.0 + gap), 0.0, 0.0])
    centre = 0.5 * side + np.array([1e-3, -2e-3, 5e-4])
    packing = Packing([centre - half, centre + half], [1.0, 1.0], Box([0, 0, 0], [side] * 3))
    coupling = coupled(packing, roughness=1e-3)
    resistance = pore_resistance(coupling) + pair_resistance(coupling, spinning=False)
    speeds = np.zeros((2, 3))
    speeds[coupling.grains.rows, along] = 1.0, -1.0
    return speeds.ravel() @ resistance @ speeds.ravel() / 2.0 / (6.0 * np.pi)


def jeffrey_onishi(gap, along):
    """The same by the near-contact resistance functions of equal spheres (Jeffrey and Onishi 1984, tables 1 and 3)."""
    if along == 0:
        return 0.5 / gap + 0.45 * np.log(1.0 / gap) + 1.346 + 3.0 / 56.0 * 2.0 * gap * np.log(1.0 / gap)
    return np.log(1.0 / gap) / 3.0 + 0.9983 + 0.2737


def settlement(viscosity, seed=1):
    """Settlement of the mean grain over the height, at the times `PARTS` of the fall of a grain alone by the height.

    200 grains of the immersed deposition of Catalano, Chareyre and Barthélemy (2014, section 4).
    """
    packing = cloud(200, UniformSizes(1.0), Box([0, 0, 0], [0.33, 0.33, 0.83]), 0.75, seed)
    dem = DEM(packing, Material(15e6, 0.5, 30.0, 2600.0), gravity=(0.0, 0.0, -9.81))
    weights = dem.masses * 1600.0 / 2600.0 * 9.81
    dem.apply(np.outer(weights * 1000.0 / 1600.0, [0.0, 0.0, 1.0]))
    walls = Walls.from_mapping({"z_max": {"pressure": 0.0, "free": True}, "lateral": {"slip": True}})
    coupling = Coupling(dem, walls, Fluid(viscosity), pair_resistance=True, renewal=0.1)
    height = packing.box.size[2]
    alone = height * 6.0 * np.pi * viscosity * packing.radii[0] / weights[0]
    found = []
    for part in PARTS:
        coupling.run(round(part * alone / dem.step) - coupling.effort.steps)
        found.append((packing.centres - dem.positions)[:, 2].mean() / height)
    return np.array(found)


def print_collapse():
    """Settlements at several viscosities, and how far each is from that at 100 Pa s."""
    shown = np.isclose(PARTS[:, None], [0.1, 0.2, 0.3, 0.4]).any(axis=1)
    print("| viscosity, Pa s | " + " | ".join(f"{part:.1f}" for part in PARTS[shown]) + " | largest difference |")
    print("|---|---|---|---|---|---|")
    basis = settlement(100.0)
    for viscosity in (50.0, 100.0, 200.0, 1000.0):
        found = settlement(viscosity) if viscosity != 100.0 else basis
        numbers = " | ".join(f"{value:.4f}" for value in found[shown])
        print(f"| {viscosity:.0f} | {numbers} | {100 * np.abs(found / basis - 1.0).max():.1f} % |", flush=True)


def surface_speed(c, seed, height, lid, n=150):
    """Mean speed over that of a grain alone of a cloud in the lower cube of a box that is so many times as high.

    `lid` is the upper wall; the others slip.
    """
    placed = cloud(n, UniformSizes(1.0), BOX, 1.0 - c, seed)
    packing = Packing(placed.centres, placed.radii, Box([0, 0, 0], [1, 1, height]))
    dem = DEM(packing, Material(young=1e5, density=2600.0), gravity=(0.0, 0.0, -9.81))
    viscosity = 1e6 * packing.radii[0] ** 2  # the grains have their speeds within the steps
    Coupling(
        dem, Walls.from_mapping({"z_max": lid, **SLIP}), Fluid(viscosity), pair_resistance=True, end_correction=False
    ).run(20)
    return -dem.velocities[:, 2].mean() * viscosity / (2.0 / 9.0 * 2600.0 * 9.81 * packing.radii[0] ** 2)


def print_surface(seeds):
    """Clouds that fill a cube, and with clear fluid above them."""
    print("| solid fraction | height | closed box | free surface |\n|---|---|---|---|")
    for c in (0.01, 0.02, 0.05, 0.10, 0.20):
        for height in (1.0, 1.6):
            closed, free = (
                np.mean([surface_speed(c, seed, height, lid) for seed in range(1, seeds + 1)])
                for lid in ({"slip": True}, {"pressure": 0.0, "free": True})
            )
            print(f"| {c:.2f} | {height:.1f} | {closed:.2f} | {free:.2f} |", flush=True)


def permeability_errors(reference):
    """Relative errors of the permeability with section friction, and with the conductances that go with pairs."""
    mesh, walls = reference.pore_mesh(), reference.walls
    flow = PoreFlow(mesh, walls, Fluid(reference.viscosity))
    with_pairs = open_throats(mesh, flow.conductance, walls.slip, reference.viscosity).conductances
    i, j = mesh.throats.pores.T
    held = flow.imposed_pressures
    most = np.nanmax(held)

    def through(conductances):
        pressure = solve_network(mesh.throats.pores, conductances, held, tolerance=1e-8).pressure
        flux = conductances * (pressure[i] - pressure[j])
        return flux[held[i] == most].sum() - flux[held[j] == most].sum()

    plain = flow.permeability / reference.permeability
    return plain - 1.0, plain * through(with_pairs) / through(flow.conductances) - 1.0


def print_permeability():
    """Errors over the cases of data/reference/stokes, by lateral walls."""
    folder = Path(__file__).parent.parent / "data" / "reference" / "stokes"
    columns = "lateral walls", "cases", "rms", "worst", "with pairs: rms", "worst", "changed by more than 0.3 points"
    print(f"| {' | '.join(columns)} |\n|{'---|' * len(columns)}")
    for kind, title in (("symmetry", "symmetry"), ("no_slip", "no-slip")):
        paths = sorted(folder.glob(f"*_{kind}.json"))
        found = {path.stem: permeability_errors(StokesReference.read(path)) for path in paths}
        errors = 100.0 * np.array(list(found.values()))
        rms, worst = np.sqrt((errors**2).mean(axis=0)), np.abs(errors).max(axis=0)
        changed = np.abs(errors[:, 1] - errors[:, 0]) > 0.3
        numbers = " | ".join(f"{rms[k]:.1f} % | {worst[k]:.1f} %" for k in range(2))
        print(f"| {title} | {len(found)} | {numbers} | {changed.sum()} |")
        for name, (before, after) in found.items():
            if abs(after - before) > 0.003:
                print(f"  {name} {100 * before:+.1f} % {100 * after:+.1f} %")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("what", nargs="?", choices=["tables", "collapse", "surface", "permeability"], default="tables")
    parser.add_argument("--seeds", type=int, default=5)
    options = parser.parse_args()
    if options.what == "collapse":
        print_collapse()
        return
    if options.what == "surface":
        print_surface(options.seeds)
        return
    if options.what == "permeability":
        print_permeability()
        return
    seeds = options.seeds
    print("| c | common drag / law | mean speed / RZ | scatter / mean | fastest / mean | smallest eigenvalue |")
    print("|---|---|---|---|---|---|")
    for c in (0.01, 0.05, 0.10, 0.15, 0.20, 0.25, 0.35, 0.45):
        found = np.array([of_cloud(c, seed) for seed in range(1, seeds + 1)])
        common, mean, scatter, _, _ = found.mean(axis=0)
        print(
            f"| {c:.2f} | {common / bed_drag(c):.2f} | {mean / richardson_zaki(c):.2f} | {scatter:.2f} | "
            f"{found[:, 3].max():.1f} | {found[:, 4].min():.3f} |",
            flush=True,
        )
    print("\n| L/a | slip walls | 1 - 3.01 a/L | two no-slip walls | Faxén | six no-slip walls |")
    print("|---|---|---|---|---|---|")
    between = {wall: {"slip": True} for wall in ("x_min", "x_max", "y_min", "y_max")}
    for side in (7.0, 13.0, 25.0, 50.0):
        print(
            f"| {side:.0f} | {alone(side):.2f} | {1.0 - 3.01 / side:.2f} | {alone(side, between, 50.0):.2f} | "
            f"{faxen(side):.2f} | {alone(side, {}):.2f} |"
        )
    print("\n| h/a | approaching | Jeffrey, Onishi | sliding | Jeffrey, Onishi |\n|---|---|---|---|---|")
    for gap in (0.005, 0.01, 0.02, 0.05, 0.1):
        print(
            f"| {gap:g} | {two(gap, 0):.2f} | {jeffrey_onishi(gap, 0):.2f} | {two(gap, 1):.2f} | "
            f"{jeffrey_onishi(gap, 1):.2f} |"
        )


if __name__ == "__main__":
    main()
