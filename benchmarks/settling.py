"""Clouds of free grains: common drag, settling, and grains alone, in pairs and between walls (docs/coupling.md).

python benchmarks/settling.py                 the tables
python benchmarks/settling.py --seeds 2       quicker
"""

import argparse

import numpy as np
from scipy import sparse
from scipy.sparse.linalg import splu

from porefv import Box, Fluid, Packing, Walls
from porefv.coupling import Coupling
from porefv.dem.dem import DEM
from porefv.dem.random_placement import cloud
from porefv.dem.sizes import UniformSizes

SLIP = {"lateral": {"slip": True}}


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


def of_cloud(c, seed, n=300):
    """Common drag; mean, scatter and fastest of the settling speeds; smallest eigenvalue; in units of Stokes' drag."""
    packing = cloud(n, UniformSizes(1.0), Box([0, 0, 0], [1, 1, 1]), 1.0 - c, seed)
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


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seeds", type=int, default=5)
    seeds = parser.parse_args().seeds
    print("| c | common drag / law | mean speed / RZ | scatter / mean | fastest / mean | smallest eigenvalue |")
    print("|---|---|---|---|---|---|")
    for c in (0.01, 0.05, 0.10, 0.15, 0.20, 0.25):
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
