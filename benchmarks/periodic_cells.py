"""Permeabilities of periodic cells: lattices against resolved Stokes flow, dense random packings against Carman-Kozeny.

python benchmarks/periodic_cells.py lattices
python benchmarks/periodic_cells.py random [spheres] [seeds]

The random packings are equal spheres, put at random and moved apart as springs that overlap would, while they grow to a
solid fraction of 0.62. The overlap that is left is below 1e-6 of the radius, and taken off it.
"""

import sys

import numpy as np
from scipy.optimize import minimize

from porefv import Cell, Fluid, HydraulicRadius, Packing, PeriodicFlow, SectionFriction
from porefv.packing.images import images_within
from porefv.packing.neighbours import neighbour_pairs

UNIT = Fluid(viscosity=1.0)
MODELS = (SectionFriction(), HydraulicRadius())
# Drag K over Stokes' of one sphere (Zick and Homsy 1982, table 2): k = 2 a² / (9 c K).
ZICK_HOMSY = {
    "sc": {0.125: 4.292, 0.216: 7.442, 0.343: 15.40, 0.45: 28.10, 0.5236: 42.14},
    "bcc": {0.6802: 162.9},
    "fcc": {0.7405: 435.0},
}
BASES = {
    "sc": [[0, 0, 0]],
    "bcc": [[0, 0, 0], [0.5, 0.5, 0.5]],
    "fcc": [[0, 0, 0], [0.5, 0.5, 0], [0.5, 0, 0.5], [0, 0.5, 0.5]],
}
TOUCHING = {"sc": 0.5, "bcc": np.sqrt(3) / 4, "fcc": np.sqrt(2) / 4}
SOLID = 0.62


def lattices():
    print("lattice  solid   " + "  ".join(f"{model.name:>16}" for model in MODELS) + "   over Zick and Homsy")
    for kind, drags in ZICK_HOMSY.items():
        for solid, drag in drags.items():
            radius = min(np.cbrt(solid / len(BASES[kind]) / (4 / 3 * np.pi)), TOUCHING[kind])
            packing = Packing(BASES[kind], np.full(len(BASES[kind]), radius), Cell([1, 1, 1]))
            exact = 2 * radius**2 / (9 * solid * drag)
            found = [PeriodicFlow(packing, UNIT, model).permeability[0, 0] / exact for model in MODELS]
            print(f"{kind:7}  {solid:.4f}  " + "  ".join(f"{ratio:16.3f}" for ratio in found))


def overlap_energy(places, radius):
    """Σ overlap² / 2 of equal spheres in a unit cube, and its gradient."""
    points = places.reshape(-1, 3)
    points = points - np.floor(points)
    images = images_within(points, np.ones(3), 2 * radius)
    centres = points[images.spheres] + images.steps
    pairs = neighbour_pairs(centres, np.full(len(centres), radius))
    home = ~images.steps.any(axis=1)
    i, j = pairs[home[pairs[:, 0]]].T  # images come in the order of their spheres: each pair of spheres once
    away = centres[j] - centres[i]
    distances = np.linalg.norm(away, axis=1)
    depths = 2 * radius - distances
    push = (depths / distances)[:, None] * away
    gradient = np.zeros_like(points)
    np.add.at(gradient, images.spheres[i], push)
    np.add.at(gradient, images.spheres[j], -push)
    return 0.5 * float((depths**2).sum()) / radius**2, gradient.ravel() / radius**2


def random_packing(n, seed):
    """n equal spheres in a unit cube, solid fraction `SOLID` but for 1e-6."""
    places = np.random.default_rng(seed).uniform(0, 1, 3 * n)
    for solid in np.linspace(0.3, SOLID, 33):
        radius = np.cbrt(solid / n / (4 / 3 * np.pi))
        options = {"maxiter": 20_000, "maxfun": 40_000, "ftol": 0.0, "gtol": 1e-9, "maxcor": 30}
        places = minimize(overlap_energy, places, (radius,), "L-BFGS-B", jac=True, options=options).x
    packing = Packing(places.reshape(-1, 3), np.full(n, radius), Cell([1, 1, 1])).wrapped()
    depth = packing.overlaps.depths.max(initial=0.0)
    if depth > 1e-6 * radius:
        raise SystemExit(f"seed {seed}: spheres overlap by {depth / radius:.1e} of their radius; take another seed")
    return Packing(packing.centres, packing.radii - 0.5000001 * depth, packing.box)


def random(n=500, seeds=5):
    print(
        "seed  solid   "
        + "  ".join(f"{model.name:>16}" for model in MODELS)
        + "   over Carman-Kozeny 180, smallest and largest axis"
    )
    for seed in range(1, seeds + 1):
        packing = random_packing(n, seed)
        porosity, diameter = packing.porosity, 2 * packing.radii[0]
        kozeny = diameter**2 * porosity**3 / (180 * (1 - porosity) ** 2)
        text = []
        for model in MODELS:
            flow = PeriodicFlow(packing, UNIT, model)
            principal = flow.principal_permeabilities / kozeny
            text.append(f"{principal.mean():.3f} ({principal[2]:.3f} {principal[0]:.3f})")
        print(f"{seed:4}  {1 - porosity:.4f}  " + "  ".join(text), flush=True)


if __name__ == "__main__":
    what, *numbers = sys.argv[1:] or ["lattices"]
    {"lattices": lattices, "random": random}[what](*map(int, numbers))
