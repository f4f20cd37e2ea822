"""What the tests share: packings (the references of data/, lattices, random ones) and reference values."""

import json
from fractions import Fraction
from functools import lru_cache
from pathlib import Path

import numpy as np
import pytest
from hypothesis import settings

from porefv.flow.fluid import Fluid
from porefv.flow.pore_flow import PoreFlow
from porefv.mesh.pore_mesh import PoreMesh
from porefv.packing.box import Box
from porefv.packing.packing import Packing

DATA = Path(__file__).parent.parent / "data"
SCENE = """\
packing = "{packing}"
[walls]
y_min = {{ pressure = 1.0 }}
y_max = {{ pressure = 0.0 }}
[output]
quantities = ["permeability", "pressure", "forces"]
vtk = {vtk}
"""

# Kernels compile, or load from numba's cache, inside the first example: no deadline can be fair.
settings.register_profile("porefv", deadline=None)
settings.load_profile("porefv")


@pytest.fixture(scope="session")
def reference():
    """reference(name): a packing of data/packings."""
    return lru_cache(lambda name: Packing.read(DATA / "packings" / f"{name}.csv"))


@pytest.fixture(scope="session")
def mesh_of(reference):
    """mesh_of(name): the mesh of a packing of data/packings."""
    return lru_cache(lambda name: PoreMesh(reference(name)))


@pytest.fixture(scope="session")
def values():
    """values(name): the reference values of data/reference/name.json."""
    return lru_cache(lambda name: json.loads((DATA / "reference" / f"{name}.json").read_text()))


@pytest.fixture(scope="session")
def table():
    """table(name): the columns of data/reference/name.csv, below two lines on its origin, as a structured array."""
    return lru_cache(
        lambda name: np.genfromtxt(DATA / "reference" / f"{name}.csv", delimiter=",", names=True, skip_header=2)
    )


@pytest.fixture(scope="session")
def lattice():
    """lattice(kind, m): see `make_lattice`."""
    return make_lattice


@pytest.fixture(scope="session")
def random_packing():
    """random_packing(n, ratio, seed): see `make_random_packing`."""
    return make_random_packing


@pytest.fixture(scope="session")
def unit_flow():
    """unit_flow(mesh, walls, model=None, **options): unit viscosity and density, the default model unless told."""

    def unit_flow(mesh, walls, model=None, **options):
        return PoreFlow(mesh, walls, Fluid(viscosity=1.0, density=1.0), model, **options)

    return unit_flow


@pytest.fixture(scope="session")
def rewritten():
    """rewritten(path, change): a checkpoint whose header and arrays change(header, content) has changed."""

    def rewritten(path, change):
        with np.load(path) as file:
            content = dict(file)
        header = json.loads(str(content["header"]))
        change(header, content)
        content["header"] = np.array(json.dumps(header))
        np.savez(path, **content)

    return rewritten


@pytest.fixture(scope="session")
def write_scene():
    """write_scene(folder, packing, vtk="false"): the path of a scene of a packing of data/packings."""

    def write_scene(folder, packing, vtk="false"):
        path = folder / "scene.toml"
        path.write_text(SCENE.format(packing=(DATA / "packings" / packing).as_posix(), vtk=vtk))
        return path

    return write_scene


@pytest.fixture(scope="session")
def exact_solution():
    """exact_solution(pairs, conductances, fixed): see `solve_exactly`."""
    return solve_exactly


def solve_exactly(pairs, conductances, fixed):
    """Pressures of a network in rational numbers, by elimination."""
    n = len(fixed)
    free = [i for i in range(n) if np.isnan(fixed[i])]
    row = {i: k for k, i in enumerate(free)}
    a = [[Fraction(0)] * (len(free) + 1) for _ in free]
    for (i, j), k in zip(pairs.tolist(), conductances.tolist(), strict=True):
        for u, v in ((i, j), (j, i)):
            if u in row:
                a[row[u]][row[u]] += Fraction(k)
                if v in row:
                    a[row[u]][row[v]] -= Fraction(k)
                else:
                    a[row[u]][-1] += Fraction(k) * Fraction(float(fixed[v]))
    for k in range(len(free)):
        for r in range(k + 1, len(free)):
            factor = a[r][k] / a[k][k]
            if factor:
                a[r] = [x - factor * y for x, y in zip(a[r], a[k], strict=True)]
    x = [Fraction(0)] * len(free)
    for k in reversed(range(len(free))):
        x[k] = (a[k][-1] - sum(a[k][c] * x[c] for c in range(k + 1, len(free)))) / a[k][k]
    pressure = [Fraction(0) if np.isnan(p) else Fraction(float(p)) for p in fixed]
    for i, value in zip(free, x, strict=True):
        pressure[i] = value
    return pressure


def make_lattice(kind, m, radius=None, spacing=1.0):
    """A lattice of equal spheres, touching unless a radius is given, in a box that is its own mirror image.

    Parameters
    ----------
    kind : {'sc', 'bcc', 'fcc', 'hcp'}
        `sc`: m³ periodic cells, spheres in their middles. `bcc`, `fcc`: m³ cubic cells, spheres on the corners
        too, the outer ones touching the walls. `hcp`: m (odd) layers of m rows, mirror-symmetric along x and z.
    m : int
    radius : float, optional
        Radius, as a fraction of the touching one.
    spacing : float
        Edge of the cubic cell; for `hcp`, distance of neighbours.
    """
    touching = {"sc": 1 / 2, "bcc": np.sqrt(3) / 4, "fcc": np.sqrt(2) / 4, "hcp": 1 / 2}[kind]
    if kind == "hcp":
        points = []
        for layer in range(m):
            b = layer % 2
            for row in range(m):
                half = (row + b) % 2
                x = np.arange(m + 1 - half) + 0.5 * half
                y = (row + b / 3) * np.sqrt(3) / 2
                points += [(t, y, layer * np.sqrt(2 / 3)) for t in x]
        points = np.array(points)
    else:
        corners = np.stack(np.meshgrid(*[np.arange(m + 1.0)] * 3, indexing="ij"), axis=-1).reshape(-1, 3)
        if kind == "sc":
            points = corners[(corners < m).all(axis=1)]
        else:
            shifts = {"bcc": [(0.5, 0.5, 0.5)], "fcc": [(0.5, 0.5, 0), (0.5, 0, 0.5), (0, 0.5, 0.5)]}[kind]
            points = np.concatenate([corners, *(corners + shift for shift in shifts)])
            points = points[(points <= m).all(axis=1)]
    # Half the distance of neighbours between the outer centres and the walls.
    centres = (points + touching) * spacing
    upper = (points.max(axis=0) + 2 * touching) * spacing
    radii = np.full(len(points), touching * spacing * (1.0 if radius is None else radius))
    return Packing(centres, radii, Box([0, 0, 0], upper))


def make_random_packing(n, ratio=0.5, seed=0, fraction=0.25, box=None):
    """Random sequential addition: n spheres without overlap, the largest first.

    Parameters
    ----------
    ratio : float
        Radii lie between this fraction of the largest, and the largest.
    fraction : float
        Solid fraction; beyond 0.3 places are hard to find.
    """
    rng = np.random.default_rng(seed)
    box = Box([0, 0, 0], [1, 1, 1]) if box is None else box
    radii = np.sort(rng.uniform(ratio, 1.0, n))[::-1]
    radii = np.minimum(
        radii * np.cbrt(fraction * box.volume / (4 / 3 * np.pi * (radii**3).sum())), 0.45 * box.size.min()
    )
    centres = np.empty((n, 3))
    k = 0
    for _ in range(1000 * n):
        if k == n:
            break
        r = radii[k]
        c = rng.uniform(box.lower + r, box.upper - r)
        if (((centres[:k] - c) ** 2).sum(axis=1) > (radii[:k] + r) ** 2).all():
            centres[k] = c
            k += 1
    assert k > 0
    return Packing(centres[:k], radii[:k], box)
