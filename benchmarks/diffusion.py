"""Effective diffusivity by the sections of prisms, and by simpler sections, beside resolved diffusion and Maxwell.

Lattices are of touching spheres, one octant of a unit cell, whose walls are planes of symmetry. The dilute packings
are random, radii between ½ and 1 of the largest; three seeds.

    python benchmarks/diffusion.py               the table
    python benchmarks/diffusion.py --resolved    the resolved values anew, on three grids
"""

import argparse
import json
from collections.abc import Callable
from pathlib import Path

import numpy as np

from porefv.conductance.prism_sections import diffusive_conductances
from porefv.mesh.pore_mesh import PoreMesh
from porefv.mesh.throats import Throats
from porefv.packing.box import Box
from porefv.packing.packing import Packing
from porefv.solvers.pressure_equation import reached, solve_network
from porefv.transport.diffusion import effective_diffusion

DATA = Path(__file__).parents[1] / "data"
REFERENCE = json.loads((DATA / "reference" / "diffusion.json").read_text(encoding="utf-8"))
OCTANTS = {
    "sc": ([[0, 0, 0]], 0.5),
    "bcc": ([[0, 0, 0], [0.5, 0.5, 0.5]], np.sqrt(3) / 4),
    "fcc": ([[0, 0, 0], [0.5, 0.5, 0], [0.5, 0, 0.5], [0, 0.5, 0.5]], np.sqrt(2) / 4),
}
SECTIONS: dict[str, Callable[[Throats], np.ndarray]] = {
    "neck A^f/L": lambda throats: np.maximum(throats.fluid_areas, 0.0) / throats.effective_lengths,
    "mean φ/L²": lambda throats: np.maximum(throats.volumes, 0.0) / throats.effective_lengths**2,
    "prism": diffusive_conductances,
}


def octant(kind: str) -> Packing:
    """An octant of a lattice; centres lie within the box by 1e-6 of a radius, as a packing must have them."""
    centres, radius = OCTANTS[kind]
    places = np.clip(np.array(centres, float), 1e-6 * radius, 0.5 - 1e-6 * radius)
    return Packing(places, np.full(len(places), radius * (1.0 - 1e-6)), Box([0, 0, 0], [0.5, 0.5, 0.5]))


def dilute(number: int, solid: float, seed: int) -> Packing:
    """Random spheres in the unit cube without overlap, the largest first."""
    rng = np.random.default_rng(seed)
    radii = np.sort(rng.uniform(0.5, 1.0, number))[::-1]
    radii *= np.cbrt(solid / (4.0 / 3.0 * np.pi * (radii**3).sum()))
    centres = np.empty((number, 3))
    placed = 0
    while placed < number:
        r = radii[placed]
        place = r + rng.random(3) * (1.0 - 2.0 * r)
        if (((centres[:placed] - place) ** 2).sum(axis=1) > (radii[:placed] + r) ** 2).all():
            centres[placed] = place
            placed += 1
    return Packing(centres, radii, Box([0, 0, 0], [1, 1, 1]))


def by_sections(packing: Packing) -> list[float]:
    """D_eff / D along y by each of the sections."""
    mesh = PoreMesh(packing, wall_tolerance=1.0 - 1e-9)
    return [
        effective_diffusion(
            mesh, "y", conductances=np.where(mesh.throats.closed, 0.0, section(mesh.throats))
        ).relative_diffusivity
        for section in SECTIONS.values()
    ]


def table() -> None:
    print(f"{'':36}" + "D_eff / D by section, and its error")
    print(f"{'packing':12}{'porosity':>9}{'compared to':>16}{'D_eff/D':>9}" + "".join(f"{s:>18}" for s in SECTIONS))
    for kind, expected in REFERENCE["lattices"].items():
        row(f"{kind} touching", octant(kind), "resolved", expected)
    for name, expected in REFERENCE["packings"].items():
        row(name, Packing.read(DATA / "packings" / f"{name}.csv"), "resolved", expected)
    for number, solid in ((300, 0.02), (300, 0.05), (300, 0.1), (3000, 0.1), (300, 0.2)):
        expected = (1.0 - solid) / (1.0 + 0.5 * solid)
        found = np.array([by_sections(dilute(number, solid, seed)) for seed in range(3)])
        print(
            f"{number:5} spheres{1.0 - solid:9.3f}{'Maxwell':>16}{expected:9.4f}"
            + "".join(
                f"{mean:8.4f} {100 * (mean / expected - 1):+5.1f}±{100 * scatter / expected:.1f}%"
                for mean, scatter in zip(found.mean(axis=0), found.std(axis=0), strict=True)
            )
        )


def row(name: str, packing: Packing, what: str, expected: float) -> None:
    print(
        f"{name:12}{packing.porosity:9.3f}{what:>16}{expected:9.4f}"
        + "".join(f"{found:10.4f} {100 * (found / expected - 1):+6.1f}%" for found in by_sections(packing)),
        flush=True,
    )


# ---- resolved diffusion ---------------------------------------------------------------------------------------------


def resolved(packing: Packing, cells: int) -> float:
    """D_eff / D along y by finite volumes: cubes, and between them faces that are open where they are in the fluid."""
    shape = np.full(3, cells)
    step = packing.box.size / cells
    number = np.arange(cells**3).reshape(shape)
    lower, upper = cells**3, cells**3 + 1
    pairs, weights = [], []
    for axis in range(3):
        conductance = open_parts(packing, axis, cells) * step.prod() / step[axis] ** 2
        first, second = (np.take(number, part, axis) for part in (range(cells - 1), range(1, cells)))
        pairs.append(np.stack([first.ravel(), second.ravel()], axis=1))
        weights.append(np.take(conductance, range(1, cells), axis).ravel())
        if axis == 1:  # half a cell from the wall
            for wall, plane, beside in ((lower, 0, 0), (upper, cells, cells - 1)):
                nodes = np.take(number, beside, axis).ravel()
                pairs.append(np.stack([np.full(len(nodes), wall), nodes], axis=1))
                weights.append(2.0 * np.take(conductance, plane, axis).ravel())
    links, weight = np.concatenate(pairs), np.concatenate(weights)
    at_walls = np.arange(cells**3 + 2) >= lower
    joined = reached(links, weight, at_walls)[links[:, 0]] & (weight > 0.0)  # without crevices between grains
    links, weight = links[joined], weight[joined]
    used, links = np.unique(links, return_inverse=True)  # cells within grains have no open face
    held = np.full(len(used), np.nan)
    held[-2:] = 1.0, 0.0  # the two walls
    links = links.reshape(-1, 2).astype(np.int32)
    found = solve_network(links, weight, held, tolerance=1e-8)
    at_wall = links[:, 0] == len(used) - 2
    passing = (weight * (1.0 - found.pressure[links[:, 1]]))[at_wall].sum()
    return float(passing * packing.box.size[1] / packing.box.section(1))


def open_parts(packing: Packing, axis: int, cells: int, points: int = 4) -> np.ndarray:
    """Part of each face normal to an axis that is in the fluid, from points² points of it; walls' faces included."""
    size, lower = packing.box.size, packing.box.lower
    x = [
        lower[a]
        + size[a] / cells * (np.arange(cells + 1.0) if a == axis else (np.arange(cells * points) + 0.5) / points)
        for a in range(3)
    ]
    solid = np.zeros([len(places) for places in x], bool)
    for centre, radius in zip(packing.centres, packing.radii, strict=True):
        near = tuple(slice(*np.searchsorted(x[a], [centre[a] - radius, centre[a] + radius])) for a in range(3))
        square = sum(
            d**2 for d in np.meshgrid(*(x[a][near[a]] - centre[a] for a in range(3)), indexing="ij", sparse=True)
        )
        solid[near] |= square < radius**2
    parts = [(cells + 1, 1) if a == axis else (cells, points) for a in range(3)]
    return 1.0 - solid.reshape([count for part in parts for count in part]).mean(axis=(1, 3, 5))


def references() -> None:
    packings = {kind: octant(kind) for kind in OCTANTS}
    packings |= {name: Packing.read(DATA / "packings" / f"{name}.csv") for name in list(REFERENCE["packings"])[1:]}
    for name, packing in packings.items():
        print(
            f"{name:12}" + "".join(f"  {cells}³ {resolved(packing, cells):.4f}" for cells in (64, 96, 128)), flush=True
        )


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--resolved", action="store_true", help="work out the resolved values")
    references() if parser.parse_args().resolved else table()
