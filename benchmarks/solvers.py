"""The solvers against size, contrast and number of right-hand sides, and beside PyAMG's multigrid, if installed.

    python benchmarks/solvers.py [--largest 160000]

Networks are those of the packings that benchmarks/scale.py makes. For contrast, each conductance of the smallest is
multiplied by 10^-u, u even between 0 and so many decades. All run to the same flux imbalance, 1e-8.
"""

from __future__ import annotations

import argparse
import time

import numpy as np
from scale import TILES, mirrored

from porefv.errors import ComputationError
from porefv.flow.fluid import Fluid
from porefv.flow.pore_flow import PoreFlow
from porefv.flow.walls import Walls
from porefv.solvers.conjugate_gradients import imbalance
from porefv.solvers.network import Network
from porefv.solvers.pressure_equation import free_network, reached
from porefv.solvers.solver import Solver

TOLERANCE = 1e-8


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--largest", type=int, default=160_000, help=f"spheres, of {', '.join(map(str, TILES))}")
    options = parser.parse_args()
    print("size:")
    for spheres in (n for n in TILES if n <= options.largest):
        compare(*network(spheres), direct=spheres <= 2_000, multigrid=spheres <= 20_000)
    print("contrast, 2000 spheres:")
    for decades in (0, 2, 4, 8, 12):
        print(f"  conductances times 1 to 1e-{decades}")
        compare(*network(2_000, decades), direct=True, multigrid=True)


def network(spheres: int, decades: float = 0.0) -> tuple[Network, np.ndarray]:
    flow = PoreFlow(mirrored(spheres), Walls.along("y"), Fluid(1.0))
    spread = 10.0 ** -np.random.default_rng(0).uniform(0.0, decades, len(flow.conductances))
    pairs, conductances, held = flow.mesh.throats.pores, flow.conductances * spread, flow.imposed_pressures
    free = np.isnan(held)
    free &= reached(pairs, conductances, ~free)
    return free_network(pairs, conductances, np.nan_to_num(held), free, np.zeros(len(held)))


def compare(a: Network, rhs: np.ndarray, *, direct: bool, multigrid: bool) -> None:
    for name in ("direct", "cg") if direct else ("cg",):
        Solver(a, name).solve(rhs, TOLERANCE)  # compiled and warm
        begin = time.perf_counter()
        solver = Solver(a, name)
        try:
            _, report = solver.solve(rhs, TOLERANCE)
        except ComputationError as error:
            print(f"  {len(a):>8} unknowns, {name:<17} {error}")
            continue
        first = time.perf_counter() - begin
        begin = time.perf_counter()
        solver.solve(rhs, TOLERANCE)
        print_row(a, name, report.iterations, first, time.perf_counter() - begin, report.imbalance)
    if multigrid:
        compare_multigrid(a, rhs)


def compare_multigrid(a: Network, rhs: np.ndarray) -> None:
    """CG with PyAMG's multigrids, to the same imbalance."""
    try:
        import pyamg
    except ImportError:
        return
    from scipy.sparse import csr_matrix

    matrix = csr_matrix(a.to_matrix())
    matrix.indices, matrix.indptr = matrix.indices.astype(np.int32), matrix.indptr.astype(np.int32)
    makers = {
        "Ruge-Stüben": lambda: pyamg.ruge_stuben_solver(matrix, strength=("classical", {"theta": 0.25})),
        "aggregation": lambda: pyamg.smoothed_aggregation_solver(
            matrix, strength=("symmetric", {"theta": 0.08}), improve_candidates=None
        ),
    }
    for name, make in makers.items():
        begin = time.perf_counter()
        multigrid = make()
        ready = time.perf_counter() - begin
        iterations, x = 0, np.zeros(len(a))
        begin = time.perf_counter()
        tolerance = 1e-6
        while iterations < 400:  # PyAMG stops by the residual's norm: tighten it until the imbalance is reached
            residuals: list[float] = []
            x = multigrid.solve(rhs, x0=x, tol=tolerance, maxiter=400, accel="cg", residuals=residuals)
            iterations += len(residuals) - 1
            lost, flow, _ = imbalance(a, rhs, x)
            if lost <= TOLERANCE * flow:
                break
            tolerance *= 0.1
        again = time.perf_counter() - begin
        print_row(a, f"{name} (PyAMG)", iterations, ready + again, again, lost / flow)


def print_row(a: Network, name: str, iterations: int, first: float, again: float, reached: float) -> None:
    print(
        f"  {len(a):>8} unknowns, {name:<20} {iterations:>4} iterations, {first:7.3f} s with its set-up, "
        f"{again:7.3f} s for one more, imbalance {reached:.0e}",
        flush=True,
    )


if __name__ == "__main__":
    main()
