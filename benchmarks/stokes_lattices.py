"""Resolved Stokes flow through periodic lattices of spheres, beside the drag of Zick and Homsy (1982).

One cell between planes of symmetry, pressure walls on the planes where the flow is antisymmetric: for the simple cubic
lattice a cube with its sphere, for the others an eighth of the cubic cell, spheres cut by the walls.

    python benchmarks/stokes_lattices.py
"""

import time

import numpy as np

from porefv.resolved.fluid_mesh import fluid_mesh
from porefv.resolved.stokes import solve_stokes
from porefv.system.progress import Progress

# Solid fraction, drag over 6π μ a U.
ZICK_HOMSY = {
    "SC": [(0.125, 4.292), (0.216, 7.442), (0.343, 15.4), (0.45, 28.1), (np.pi / 6, 42.1)],
    "BCC": [(np.sqrt(3) * np.pi / 8, 162.9)],
    "FCC": [(np.sqrt(2) * np.pi / 6, 435.0)],
}
# Spheres at these corners or centres of the unit cube of the computation; how many whole spheres it holds.
PLACES = {
    "SC": ([[0.5, 0.5, 0.5]], 1.0),
    "BCC": ([[0, 0, 0], [1, 1, 1]], 0.25),
    "FCC": ([[0, 0, 0], [1, 1, 0], [1, 0, 1], [0, 1, 1]], 0.5),
}
# Elements on a sphere over its radius: the denser the lattice, the narrower its throats.
FINE = {"SC": 0.3, "BCC": 0.3, "FCC": 0.2}
WALLS = np.array([np.nan, np.nan, 1.0, 0.0, np.nan, np.nan])


def drag(lattice: str, solid: float, mesh_size: float, delta: float) -> tuple[float, int]:
    """Drag on a sphere over 6π μ a U, and the number of unknowns."""
    centres, count = np.array(PLACES[lattice][0], float), PLACES[lattice][1]
    radius = (3.0 * solid / (4.0 * np.pi * count)) ** (1 / 3)
    fluid = fluid_mesh(
        centres, np.full(len(centres), radius), np.zeros(3), np.ones(3),
        order=3, mesh_size=mesh_size, delta=delta, regularisation="caps",
    )  # fmt: skip
    field = solve_stokes(fluid, 3, WALLS, np.ones(6, bool), Progress(quiet=True))
    velocity = 0.5 * (field.wall_flux[2] - field.wall_flux[3])
    return 1.0 / count / (6.0 * np.pi * radius * velocity), field.unknowns


def main() -> None:
    print(f"{'lattice':8}{'c':>8}{'Z & H':>9}{'coarse':>9}{'fine':>9}{'δ / 2':>9}{'δ = 0':>9}{'error':>9}{'time':>8}")
    for lattice, cases in ZICK_HOMSY.items():
        for solid, exact in cases:
            begin = time.perf_counter()
            size = FINE[lattice]
            coarse, fine, closer = (
                drag(lattice, solid, *level)[0] for level in ((1.5 * size, 0.03), (size, 0.03), (size, 0.015))
            )
            limit = closer + (closer - fine) / (2.0**1.5 - 1.0)
            print(
                f"{lattice:8}{solid:8.4f}{exact:9.4g}{coarse:9.4g}{fine:9.4g}{closer:9.4g}{limit:9.4g}"
                f"{100 * (limit / exact - 1):+8.2f}%{time.perf_counter() - begin:7.1f}s",
                flush=True,
            )


if __name__ == "__main__":
    main()
