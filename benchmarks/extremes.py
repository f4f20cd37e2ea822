"""The stress atlas: packings at the extremes, what becomes of them, and how exact the answers are.

    python benchmarks/extremes.py [--million] [--only AXIS ...] [--dry]

Every case runs from packing arrays to forces, and again with the spheres in another order and all lengths times 0.3.
Tables go into the marked block of docs/extremes.md, pictures to docs/img; --dry prints the tables only.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from scale import PACKINGS, TILES, mirrored
from voids import widest_pores, with_grain

from porefv.conductance.hydraulic_radius import HydraulicRadius
from porefv.conductance.model import ConductanceModel
from porefv.conductance.registry import AUTO, MODELS
from porefv.conductance.section_friction.model import SectionFriction
from porefv.errors import PorefvError
from porefv.export.picture_style import PictureSize, new_figure, style
from porefv.flow.fluid import Fluid
from porefv.flow.pore_flow import PoreFlow
from porefv.flow.walls import Wall, Walls
from porefv.mesh.pore_mesh import PoreMesh
from porefv.packing.box import Box
from porefv.packing.packing import Packing
from porefv.solvers.approximate_cholesky import ApproximateCholesky
from porefv.solvers.conjugate_gradients import refined
from porefv.solvers.network import Network
from porefv.solvers.pressure_equation import free_network

DOCS = Path(__file__).resolve().parents[1] / "docs"
BEGIN, END = "<!-- tables: begin -->", "<!-- tables: end -->"
UNIT = Box([0, 0, 0], [1, 1, 1])
LENGTH = 0.3  # no power of two: the copy's coordinates are rounded anew


@dataclass(frozen=True)
class Case:
    """A packing at an extreme, and the flow through it."""

    axis: str
    name: str
    make: Callable[[], Packing]
    walls: Callable[[], Walls] = lambda: Walls.along("y")
    viscosity: float = 1.0
    model: object = field(default_factory=AUTO)
    options: dict = field(default_factory=dict)
    copied: bool = True  # whether to run the copy: scaling is not the question where lengths themselves are extreme


@dataclass
class Row:
    """What became of a case."""

    case: Case
    spheres: int = 0
    pores: int = 0
    closed: int = 0
    closing: float = 0.0
    hidden: int = 0
    permeability: float = np.nan
    imbalance: float = np.nan
    floor: float = np.nan
    forces: float = np.nan
    copy: float = np.nan
    condition: float = np.nan
    contrast: float = np.nan
    iterations: int = 0
    seconds: float = np.nan
    refusal: str = ""


# ---- measuring ---------------------------------------------------------------------------------------------


def measure(case: Case) -> Row:
    """Run a case, and its copy."""
    row = Row(case)
    begin = time.perf_counter()
    try:
        packing = case.make()
        row.spheres = len(packing)
        begin = time.perf_counter()
        flow = run(case, packing)
        row.seconds = time.perf_counter() - begin
    except PorefvError as error:
        row.seconds = time.perf_counter() - begin
        row.refusal = " ".join(str(error).split("\n")[:2]).replace("  ", " ")
        return row
    throats, report = flow.mesh.throats, flow.solver_report
    row.pores, row.closed = flow.mesh.n_pores, int(np.count_nonzero(flow.conductances == 0.0))
    row.closing = flow.closing_error
    row.hidden = len(flow.mesh.triangulation.hidden)
    row.permeability = flow.permeability
    row.imbalance, row.floor, row.iterations = report.imbalance, report.floor, report.iterations
    row.forces = flow.forces.conservation_residual
    open_ones = flow.conductances[flow.conductances > 0.0]
    row.contrast = open_ones.max() / open_ones.min() if len(open_ones) else np.nan
    row.condition = condition(flow)
    assert len(throats) == len(flow.conductances)
    if case.copied:
        row.copy = difference(flow, case)
    return row


def run(case: Case, packing: Packing) -> PoreFlow:
    """From packing arrays to forces."""
    flow = PoreFlow(PoreMesh(packing, **case.options), case.walls(), Fluid(case.viscosity), case.model)
    _ = flow.permeability, flow.forces
    return flow


def difference(flow: PoreFlow, case: Case) -> float:
    """Between a flow and that through a shuffled and scaled copy: of the permeability and of the largest force."""
    packing = flow.mesh.packing
    order = np.random.default_rng(0).permutation(len(packing))
    box = Box(packing.box.lower * LENGTH, packing.box.upper * LENGTH)
    other = run(case, Packing(packing.centres[order] * LENGTH, packing.radii[order] * LENGTH, box))
    forces = np.abs(other.forces.total / LENGTH**2 - flow.forces.total[order]).max()
    largest = np.abs(flow.forces.total).max()
    k, copied = flow.permeability, other.permeability / LENGTH**2
    return max(abs(copied - k) / k if k > 0.0 else abs(copied), forces / largest if largest > 0.0 else forces)


def condition(flow: PoreFlow) -> float:
    """Largest by smallest eigenvalue of the matrix, by iterations with it and with its inverse."""
    fixed = flow.imposed_pressures
    free = np.isnan(fixed) & ~flow.solution.isolated
    if not free.any():
        return 1.0
    network, _ = free_network(
        flow.mesh.throats.pores, flow.conductances, np.nan_to_num(fixed), free, np.zeros(len(fixed))
    )
    scale = network.diagonal.max()
    network = Network(
        network.starts, network.columns, network.links / scale, network.leaks / scale, network.diagonal / scale
    )
    zero = np.zeros(len(network))
    largest = eigenvalue(len(network), lambda x: -network.residual(zero, x))
    # Pressures of positive sources: no differences, so that the largest contrast leaves them exact.
    factor = ApproximateCholesky.of(network)
    repeats = 30 if len(network) <= 20_000 else 8
    smallest = eigenvalue(len(network), lambda x: refined(network, zero, x, factor, 1e-6, np.inf).x, repeats)
    return largest * smallest


def eigenvalue(n: int, apply: Callable, iterations: int = 30) -> float:
    """The largest eigenvalue of a symmetric matrix, by power iterations."""
    x = np.random.default_rng(0).random(n) + 0.5
    value = 0.0
    for _ in range(iterations):
        x /= np.linalg.norm(x)
        y = apply(x)
        value = float(x @ y)
        x = y
    return value


# ---- packings ----------------------------------------------------------------------------------------------


def stored(name: str) -> Packing:
    return Packing.read(PACKINGS / f"{name}.csv")


def resized(packing: Packing, factor: float) -> Packing:
    """All radii times a factor."""
    return Packing(packing.centres, packing.radii * factor, packing.box)


def placed(radii: np.ndarray, box: Box, seed: int = 0, among: Packing | None = None) -> Packing:
    """Spheres put at random where there is room, the largest first, among others that stand already."""
    rng = np.random.default_rng(seed)
    known = 0 if among is None else len(among)
    centres, sizes = np.empty((known + len(radii), 3)), np.empty(known + len(radii))
    if among is not None:
        centres[:known], sizes[:known] = among.centres, among.radii
    count = known
    for radius in np.sort(radii)[::-1]:
        for _ in range(400):
            centre = rng.uniform(box.lower + radius, box.upper - radius)
            gaps = np.linalg.norm(centres[:count] - centre, axis=1) - sizes[:count]
            if count == 0 or gaps.min() > radius:
                centres[count], sizes[count] = centre, radius
                count += 1
                break
    return Packing(centres[:count], sizes[:count], box)


def power_law(ratio: float, n: int = 1000, exponent: float = 2.5, solid: float = 0.25) -> Packing:
    """Numbers of spheres that fall as a power of their radius, between two radii of this ratio."""
    u = (np.arange(n) + 0.5) / n
    radii = (1.0 + u * (ratio**exponent - 1.0)) ** (-1.0 / exponent) if ratio > 1 else np.ones(n)
    radii *= min(np.cbrt(solid / (4 / 3 * np.pi * (radii**3).sum())), 0.3)
    return placed(radii, UNIT)


def fines(ratio: float, n: int = 500) -> Packing:
    """Fines at random in the voids of 200 grains, `ratio` times smaller than their mean."""
    grains = stored("n200_s1")
    return placed(np.full(n, grains.radii.mean() / ratio), UNIT, among=grains)


def cluster(ratio: float) -> Packing:
    """A cloud of 40 fines in the void between eight large spheres, and none elsewhere."""
    grains = stored("sc8")
    rng = np.random.default_rng(1)
    radius = 0.25 / ratio
    away = rng.normal(size=(40, 3))
    places = 0.5 + away / np.linalg.norm(away, axis=1)[:, None] * rng.uniform(4 * radius, 0.15, 40)[:, None]
    return Packing(np.concatenate([grains.centres, places]), np.concatenate([grains.radii, np.full(40, radius)]), UNIT)


def long_box(size: tuple[float, float, float], n: int = 500) -> Packing:
    """Spheres at random in a box of this shape."""
    box = Box([0, 0, 0], size)
    return placed(np.full(n, min(0.4 * min(size), np.cbrt(0.2 * box.volume / n / 4.19))), box)


LATTICES = {  # positions in the cubic cell, radius of touching spheres; hexagonal: an orthogonal cell
    "sc": ([(0.5, 0.5, 0.5)], 0.5),
    "bcc": ([(0.25, 0.25, 0.25), (0.75, 0.75, 0.75)], np.sqrt(3) / 4),
    "fcc": ([(0.25, 0.25, 0.25), (0.75, 0.75, 0.25), (0.75, 0.25, 0.75), (0.25, 0.75, 0.75)], np.sqrt(2) / 4),
    "hcp": ([(0.25, 0.25, 0.25), (0.75, 0.75, 0.25), (0.25, 7 / 12, 0.75), (0.75, 1 / 12, 0.75)], 0.5),
    "diamond": (
        [(x + s, y + s, z + s) for x, y, z in ((0, 0, 0), (0.5, 0.5, 0), (0.5, 0, 0.5), (0, 0.5, 0.5))
         for s in (0.125, 0.375)],
        np.sqrt(3) / 8,
    ),
}  # fmt: skip


def lattice(kind: str, nudge: float = 0.0, m: int = 4, tilt: float = 0.0) -> Packing:
    """m³ cells of touching spheres, each centre moved by up to `nudge` of the cell along each axis."""
    places, radius = LATTICES[kind]
    cell = np.array([1.0, np.sqrt(3), np.sqrt(8 / 3)]) if kind == "hcp" else np.ones(3)
    shifts = np.stack(np.meshgrid(*[np.arange(m)] * 3, indexing="ij"), axis=-1).reshape(-1, 1, 3)
    centres = ((shifts + np.array(places)) * cell).reshape(-1, 3)
    centres = centres + nudge * np.random.default_rng(0).uniform(-1, 1, centres.shape)
    # Half the gap of neighbours between the outer spheres and the walls, where the cell leaves less.
    room = max(0.0, radius - (np.array(places) * cell).min())
    return Packing((centres + room) / m, np.full(len(centres), radius / m), Box([0, 0, 0], (m * cell + 2 * room) / m))


def tiled(name: str, tiles: tuple[int, int, int]) -> Packing:
    """Mirror images of a packing side by side."""
    packing = stored(name)
    copies = [np.where(np.array(t) % 2 == 1, 1.0 - packing.centres, packing.centres) + t for t in np.ndindex(tiles)]
    return Packing(
        np.concatenate(copies), np.tile(packing.radii, len(copies)), Box(np.zeros(3), np.array(tiles, float))
    )


def moved(packing: Packing, scale: float, boxes: float = 0.0) -> Packing:
    """All lengths times a scale, so many box sizes away from the origin."""
    shift = boxes * packing.box.size
    box = Box((packing.box.lower + shift) * scale, (packing.box.upper + shift) * scale)
    return Packing((packing.centres + shift) * scale, packing.radii * scale, box)


def single(centre=(0.5, 0.5, 0.5), radius: float = 0.3) -> Packing:
    return Packing([centre], [radius], UNIT)


def pair(gap: float) -> Packing:
    """Two spheres along a slanted line, so far apart."""
    direction = np.array([1.0, 2.0, 2.0]) / 3.0
    half = (0.2 + 0.5 * gap) * direction
    return Packing([0.5 - half, 0.5 + half], [0.2, 0.2], UNIT)


def coplanar(normal: int, seed: int = 0) -> Packing:
    grid = (np.stack(np.meshgrid(np.arange(5), np.arange(5)), -1).reshape(-1, 2) + 0.5) / 5
    rng = np.random.default_rng(seed)
    return Packing(np.insert(grid, normal, 0.4, axis=1), rng.uniform(0.05, 0.099, 25), UNIT)


def collinear(axis: int) -> Packing:
    centres = np.full((10, 3), 0.5)
    centres[:, axis] = (np.arange(10) + 0.5) / 10
    return Packing(centres, np.full(10, 0.05), UNIT)


def row_on_wall() -> Packing:
    """Equal spheres that touch one another and the wall z_min."""
    x = (np.arange(8) + 0.5) / 8
    return Packing(np.stack([x, np.full(8, 0.5), np.full(8, 0.0625)], axis=1), np.full(8, 0.0625), UNIT)


def double_row(m: int) -> Packing:
    """Two skew rows: each pair of neighbours of one meets each of the other, m² cells."""
    s = np.linspace(0.1, 0.9, m)
    one = np.stack([s, np.full(m, 0.4), np.full(m, 0.4)], axis=1)
    other = np.stack([np.full(m, 0.6), s, np.full(m, 0.6)], axis=1)
    return Packing(np.concatenate([one, other]), np.full(2 * m, 0.3 / m), UNIT)


class Spread(ConductanceModel):
    """Conductances of section friction, times factors scattered over so many decades.

    The factor hangs on the throat alone, so that a copy in another order and of another size has the same.
    """

    name = "spread"
    force_split = "drag"

    def __init__(self, decades: float):
        self.decades = decades

    def conductivity(self, throats, slip):
        plain = SectionFriction().conductivity(throats, slip)
        phase = 100.0 * np.log(plain / plain.max(), where=plain > 0.0, out=np.zeros_like(plain))
        return plain * 10.0 ** (-self.decades * np.arccos(np.cos(phase)) / np.pi)  # evenly spread exponents


# ---- the cases ---------------------------------------------------------------------------------------------


def contrasted(axis: str, name: str, make: Callable[[], Packing]) -> Iterator[Case]:
    """A case, and the same with the model of the paper."""
    yield Case(axis, name, make)
    yield Case(axis, f"the same, {HydraulicRadius.name}", make, model=HydraulicRadius())


def cases(million: bool) -> Iterator[Case]:
    for ratio in (1, 10, 100, 1e3, 1e4):
        yield from contrasted("Size ratio", f"power law, 1:{ratio:g}", lambda ratio=ratio: power_law(ratio))
    for ratio in (2, 10, 100, 1e3, 1e4):
        name = f"fines in the voids of 200 grains, 1:{ratio:g}"
        yield from contrasted("Size ratio", name, lambda ratio=ratio: fines(ratio))
    for ratio in (100, 1e3, 1e4):
        yield Case("Size ratio", f"a cloud of fines in one void, 1:{ratio:g}", lambda ratio=ratio: cluster(ratio))
    for factor in (0.1, 0.27, 0.5, 0.8, 1.0, 1.04, 1.1):
        packing = resized(stored("n200_s1"), factor)
        name = f"200 grains, radii times {factor:g}, porosity {packing.porosity:.3g}"
        yield Case("Porosity", name, lambda p=packing: p)
    for factor in (1.1, 1.2, 1.3):
        packing = resized(stored("n200_s1"), factor)
        name = f"the same, radii times {factor:g}, porosity {packing.porosity:.3g}, wall_tolerance 0.5"
        yield Case("Porosity", name, lambda p=packing: p, options={"wall_tolerance": 0.5})
    for radius in (0.55, 0.6, 0.7, 0.8, 0.9):
        yield Case(
            "Porosity", f"simple cubic, radius {radius:g} of the spacing",
            lambda radius=radius: resized(lattice("sc"), 2 * radius), options={"wall_tolerance": 0.9},
        )  # fmt: skip
    for name in ("n25_s1", "n200_s1"):
        yield Case("Number", f"{len(stored(name))} spheres", lambda name=name: stored(name))
    for n in [n for n in TILES if million or n < 1_000_000]:
        yield Case("Number", f"{n:,} spheres".replace(",", " "), lambda n=n: mirrored(n))
    yield Case("Number", "2 × 1000 in skew rows: 10⁶ cells", lambda: double_row(1000))
    yield Case("Number", "2 × 50 000 in skew rows: 10⁹ cells", lambda: double_row(50_000), copied=False)
    for long in (10, 100, 1e3, 1e4):
        yield Case("Shape of the box", f"1 × {long:g} × 1, flow along", lambda long=long: long_box((1, long, 1)))
        yield Case("Shape of the box", f"{long:g} × 1 × 1, flow across", lambda long=long: long_box((long, 1, 1)))
        yield Case("Shape of the box", f"{long:g} × 1 × {long:g}, through", lambda long=long: long_box((long, 1, long)))
        name = f"{long:g} × {long:g} × 1, along"
        yield from contrasted("Shape of the box", name, lambda long=long: long_box((long, long, 1)))
    for kind in LATTICES:
        for nudge in (0.0, 1e-16, 1e-15, 1e-12, 1e-9, 1e-6, 1e-4, 1e-2):
            name = f"{kind}, " + ("exact" if nudge == 0 else f"nudged by {nudge:g}")
            yield Case("Lattices", name, lambda kind=kind, nudge=nudge: lattice(kind, nudge))
    for tiles in ((1, 1, 1), (2, 1, 2), (1, 2, 1), (2, 2, 2), (4, 4, 4)):
        yield Case(
            "Mirror images", f"25 grains, {'×'.join(map(str, tiles))} tiles, symmetry walls",
            lambda tiles=tiles: tiled("n25_s1", tiles), lambda: Walls.along("y", slip=True),
        )  # fmt: skip
    for gap in (0.0, 1e-15, 1e-12, 1e-9, -1e-15, -1e-12, -1e-9):
        yield Case("Contact", f"two spheres, gap {gap:g}", lambda gap=gap: pair(gap))
    yield Case("Contact", "a sphere that touches a wall", lambda: single((0.3, 0.5, 0.5)))
    yield Case("Contact", "a sphere that touches two walls, an edge", lambda: single((0.3, 0.3, 0.5)))
    yield Case("Contact", "a sphere that touches three walls, a corner", lambda: single((0.3, 0.3, 0.3)))
    yield Case("Contact", "a sphere that touches all six", lambda: single(radius=0.5))
    yield Case("Contact", "a sphere within another", lambda: Packing([[0.5] * 3, [0.55] * 3], [0.3, 0.05], UNIT))
    yield Case("Contact", "two spheres at one place", lambda: Packing([[0.5] * 3] * 2, [0.1, 0.2], UNIT))
    yield Case("Contact", "centres 1e-15 apart", lambda: Packing([[0.5] * 3, [0.5, 0.5, 0.5 + 1e-15]], [0.1] * 2, UNIT))
    yield from contrasted("Few and flat", "one sphere", single)
    yield from contrasted("Few and flat", "one sphere, radius 1e-6", lambda: single(radius=1e-6))
    for axis in range(3):
        yield Case("Few and flat", f"25 in a plane normal to {'xyz'[axis]}", lambda axis=axis: coplanar(axis))
        yield Case("Few and flat", f"10 in a row along {'xyz'[axis]}", lambda axis=axis: collinear(axis))
    yield Case("Few and flat", "a row of equal spheres on a wall", row_on_wall)
    for scale in (1e-9, 1e-6, 1e-3, 1e3, 1e6, 1e9):
        yield Case("Place and unit", f"54 grains, lengths times {scale:g}", lambda s=scale: moved(stored("n54_s1"), s))
    for boxes in (1e3, 1e6, 1e9, 1e12, 1e15):
        yield Case(
            "Place and unit", f"54 grains, {boxes:g} boxes away", lambda b=boxes: moved(stored("n54_s1"), 1.0, b)
        )
    yield Case("Place and unit", "box of 1e-40 m", lambda: moved(stored("n54_s1"), 1e-40), copied=False)
    yield Case("Place and unit", "54 grains in single precision", single_precision)
    for decades in (0, 4, 8, 12, 16, 20, 30):
        yield Case(
            "Contrast", f"200 grains, conductances times 1 to 1e-{decades}", lambda: stored("n200_s1"),
            model=Spread(decades),
        )  # fmt: skip
    for drop in (1e-300, 1e-15, 1e-9, 1e9, 1e15, 1e300):
        walls = lambda drop=drop: Walls.along("y", drop)  # noqa: E731
        yield Case("Pressure and viscosity", f"ΔP = {drop:g} Pa", lambda: stored("n54_s1"), walls)
    for drop in (1e-9, 1e-3):
        walls = lambda drop=drop: Walls(y_min=Wall(pressure=1e5 + drop), y_max=Wall(pressure=1e5))  # noqa: E731
        yield Case("Pressure and viscosity", f"ΔP = {drop:g} Pa above 1e5 Pa", lambda: stored("n54_s1"), walls)
    for viscosity in (1e-300, 1e-15, 1e15, 1e300):
        yield Case("Pressure and viscosity", f"μ = {viscosity:g} Pa s", lambda: stored("n54_s1"), viscosity=viscosity)


def single_precision() -> Packing:
    packing = stored("n54_s1")
    return Packing(packing.centres.astype(np.float32), packing.radii.astype(np.float32), packing.box)


# ---- one more grain ----------------------------------------------------------------------------------------


def one_more_grain(name: str, sizes: np.ndarray, pores: int = 1) -> dict[str, np.ndarray]:
    """(pores, sizes): permeability with a grain more in the middle of a pore, over that without, for each model.

    In so many of the widest pores, no two of them in one void; sizes are radii over that of the largest that fits.
    """
    packing = stored(name)
    mesh = PoreMesh(packing)
    places, room = widest_pores(packing, pores)
    found = {}
    for model in MODELS.values():
        before = PoreFlow(mesh, Walls.along("y"), Fluid(1.0), model()).permeability
        changes = np.empty((len(places), len(sizes)))
        for row, column in np.ndindex(changes.shape):
            more = with_grain(packing, places[row], sizes[column] * room[row])
            changes[row, column] = PoreFlow(more, Walls.along("y"), Fluid(1.0), model()).permeability / before
        found[model.name] = changes
    return found


def grains(sizes: np.ndarray) -> dict[str, dict[str, np.ndarray]]:
    """One grain more in the widest pore of some packings, and the mean and the highest of several."""
    found = {}
    for name, pores in (("n25_s1", 30), ("n54_s1", 60), ("n200_s1", 30)):
        changes = one_more_grain(name, sizes, pores)
        for title, of in (
            ("widest pore", lambda x: x[0]),
            (f"mean of {pores} pores", lambda x: x.mean(axis=0)),
            (f"highest of {pores}", lambda x: x.max(axis=0)),
        ):
            found[f"{name}, {title}"] = {model: of(values) for model, values in changes.items()}
    return found


# ---- the report --------------------------------------------------------------------------------------------

HEAD = (
    "| case | spheres | pores | closed | permeability, m² | imbalance | force sum | copy | condition | iterations "
    "| time |"
    "\n|---|---|---|---|---|---|---|---|---|---|---|"
)


def power(value: float) -> str:
    """A small number in short."""
    if np.isnan(value):
        return "–"
    return "0" if value == 0.0 else f"{value:.0e}".replace("e-0", "e-").replace("e+0", "e").replace("e+", "e")


def line(row: Row) -> str:
    """A row of the table."""
    if row.refusal:
        return (
            f"| {row.case.name} | {row.spheres or '–'} | *refused*: {row.refusal[:230]} |||||||| {row.seconds:.2f} s |"
        )
    over = f" (floor {power(row.floor)})" if row.imbalance > 1e-10 else ""
    hidden = f", {row.hidden} hidden" if row.hidden else ""
    closing = f" ({power(row.closing)})" if row.closing > 0.0 else ""
    return (
        f"| {row.case.name} | {row.spheres}{hidden} | {row.pores} | {row.closed}{closing} | {row.permeability:.5g} | "
        f"{power(row.imbalance)}{over} | {power(row.forces)} | {power(row.copy)} | {power(row.condition)} | "
        f"{row.iterations} | {row.seconds:.2f} s |"
    )


def tables(rows: list[Row]) -> str:
    """All tables, axis by axis."""
    parts = []
    for axis in dict.fromkeys(row.case.axis for row in rows):
        parts += [f"### {axis}", "", HEAD, *(line(row) for row in rows if row.case.axis == axis), ""]
    finished = [row for row in rows if not row.refusal]
    within = [row for row in finished if row.imbalance <= 1e-10 and row.forces <= 1e-10]
    parts += [
        f"{len(rows)} cases: {len(finished)} finished, {len(within)} of these with imbalance and force sum below "
        f"1e-10; {len(rows) - len(finished)} refused with a reason.",
        "",
    ]
    return "\n".join(parts)


def grain_table(found: dict[str, dict[str, np.ndarray]], sizes: np.ndarray) -> str:
    parts = ["### One more grain", "", "| packing | model | " + " | ".join(f"{size:g}" for size in sizes) + " |"]
    parts.append("|---" * (2 + len(sizes)) + "|")
    for name, models in found.items():
        for model, ratios in models.items():
            parts.append(f"| {name} | {model} | " + " | ".join(f"{100 * (x - 1):+.2g} %" for x in ratios) + " |")
    return "\n".join(parts)


@style()
def draw_cases(done: list[Row]) -> None:
    """How exact each case is that was not refused."""
    figure = new_figure(PictureSize(2000, 1000), layout="constrained")
    axes = figure.subplots()
    for name, mark in (("imbalance", "o"), ("forces", "^"), ("copy", "x")):
        values = [max(getattr(row, name), 1e-17) for row in done]
        label = {"imbalance": "flux imbalance", "forces": "force sum", "copy": "shuffled and scaled copy"}[name]
        axes.semilogy(values, mark, markersize=4, label=label)
    axes.axhline(1e-10, color="0.3", linewidth=1)
    starts = {}
    for k, row in enumerate(done):
        starts.setdefault(row.case.axis, k)
    for axis, start in starts.items():
        axes.axvline(start - 0.5, color="0.8", linewidth=0.8, zorder=0)
        axes.text(start, 3.0, axis, rotation=35)
    axes.set(
        ylabel="relative error", xticks=[], xlabel="cases that finished, in the order of the tables", ylim=(5e-18, 1)
    )
    axes.legend(loc="upper left")
    figure.savefig(DOCS / "img" / "extremes.png")


@style()
def draw_lattices(done: list[Row]) -> None:
    """Lattices nudged."""
    figure = new_figure(PictureSize(1300, 850), layout="constrained")
    axes = figure.subplots()
    for kind in LATTICES:
        ks = [row for row in done if row.case.axis == "Lattices" and row.case.name.startswith(f"{kind},")]
        nudges = [float(row.case.name.split()[-1]) for row in ks[1:]]
        changes = [max(abs(row.permeability / ks[0].permeability - 1.0), 1e-17) for row in ks[1:]]
        axes.loglog(nudges, changes, "o-", label=kind)
    axes.set(xlabel="centres nudged by up to so much of the cell", ylabel="change of permeability")
    axes.grid(alpha=0.3)
    axes.legend()
    figure.savefig(DOCS / "img" / "extremes_lattices.png")


@style()
def draw_grains(found: dict[str, dict[str, np.ndarray]], sizes: np.ndarray) -> None:
    """One more grain: in the widest pore, in the mean of several, and the highest of these."""
    titles = ("widest pore", "mean of several", "highest of these")
    figure = new_figure(PictureSize(2000, 800), layout="constrained")
    axes = figure.subplots(1, 3, sharey=True)
    for k, (name, models) in enumerate(found.items()):
        for model, line in zip(models, ("o-", "x--", "s:"), strict=True):
            label = f"{name.split(',')[0]}, {model}"
            axes[k % 3].semilogx(sizes, 100 * (models[model] - 1), line, color=f"C{k // 3}", label=label)
    for panel, title in zip(axes, titles, strict=True):
        panel.axhline(0, color="0.3", linewidth=1)
        panel.set(xlabel="radius of one more grain, of the largest that fits", title=title)
    axes[0].set_ylabel("permeability, change in %")
    axes[0].legend()
    figure.savefig(DOCS / "img" / "extremes_grain.png")


def write(text: str) -> None:
    """Replace the marked block of the page."""
    page = DOCS / "extremes.md"
    old = page.read_text(encoding="utf-8")
    start, stop = old.index(BEGIN) + len(BEGIN), old.index(END)
    page.write_text(f"{old[:start]}\n\n{text}\n\n{old[stop:]}", encoding="utf-8")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--million", action="store_true", help="a million spheres too: some 6 GiB and ten minutes")
    parser.add_argument("--only", nargs="*", help="axes to run, by the beginning of their names; nothing is written")
    parser.add_argument("--dry", action="store_true", help="print, and write nothing")
    options = parser.parse_args()
    for name in ("n25_s1", "n2000_s1"):  # loads the compiled kernels
        measure(Case("", "", lambda name=name: stored(name)))
    rows = []
    for case in cases(options.million):
        if options.only and not any(case.axis.lower().startswith(axis.lower()) for axis in options.only):
            continue
        rows.append(measure(case))
        print(line(rows[-1]), flush=True)
    sizes = np.array([0.003, 0.01, 0.03, 0.1, 0.2, 0.4, 0.6, 0.8, 1.0])
    found = grains(sizes)
    print(grain_table(found, sizes))
    if not (options.only or options.dry):
        write(tables(rows) + "\n" + grain_table(found, sizes))
        done = [row for row in rows if not row.refusal]
        draw_cases(done)
        draw_lattices(done)
        draw_grains(found, sizes)


if __name__ == "__main__":
    main()
