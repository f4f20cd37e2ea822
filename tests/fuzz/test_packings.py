"""Adversarial packings through the whole flow: refused with a reason, or conserved, bounded and finite."""

import os

import numpy as np
from hypothesis import event, given, settings
from hypothesis import strategies as st

from porefv.conductance.effective_radius import EffectiveRadius
from porefv.conductance.hydraulic_radius import HydraulicRadius
from porefv.conductance.section_friction.model import SectionFriction
from porefv.errors import PorefvError
from porefv.flow.fluid import Fluid
from porefv.flow.pore_flow import PoreFlow
from porefv.flow.walls import Wall, Walls
from porefv.mesh.pore_mesh import PoreMesh
from porefv.packing.box import WALLS, Box
from porefv.packing.packing import Packing

FUZZ = settings.get_profile("fuzz-nightly" if os.environ.get("POREFV_FUZZ") == "nightly" else "fuzz")


def nudged(value, ulps):
    for _ in range(abs(ulps)):
        value = float(np.nextafter(value, np.inf if ulps > 0 else -np.inf))
    return value


# Ties of every kind: a coarse grid, and its places moved by units in the last place; generic places; near walls.
grid = st.builds(nudged, st.integers(1, 7).map(lambda k: k / 8), st.sampled_from([0, 0, 0, 1, -1, 5]))
places = st.one_of(grid, st.floats(0.01, 0.99), st.sampled_from([1e-12, 1e-6, 1 - 1e-6, 0.125, 0.875]))
# Touching on the grid, one unit more or less, overlapping, dust, larger than the gap to the walls.
sizes = st.one_of(
    st.builds(nudged, st.sampled_from([0.0625, 0.125, 0.125, 0.125]), st.integers(-1, 1)),
    st.floats(0.01, 0.2),
    st.sampled_from([1e-13, 1e-9, 1e-6, 1e-3, 0.07, 0.13, 0.3]),
)
shapes = st.sampled_from([(1, 1, 1)] * 4 + [(1e4, 1, 1), (1, 1e4, 1), (1e4, 1, 1e4), (1, 0.3, 2.7), (1e-3, 1, 1)])


@st.composite
def few(draw):
    """Up to fourteen spheres, every number drawn."""
    spheres = np.array(draw(st.lists(st.tuples(places, places, places, sizes), min_size=1, max_size=14)))
    if draw(st.sampled_from([True, True, True, False])):  # none reaches beyond a wall
        spheres[:, 3] = np.minimum(spheres[:, 3], np.minimum(spheres[:, :3], 1.0 - spheres[:, :3]).min(axis=1))
    return spheres


@st.composite
def many(draw):
    """A lattice with spheres left out, moved and resized, or a random cloud, grown until they touch or overlap."""
    rng = np.random.default_rng(draw(st.integers(0, 2**32 - 1)))
    if draw(st.booleans()):
        m = draw(st.integers(2, 4))
        centres = (np.stack(np.meshgrid(*[np.arange(m)] * 3), -1).reshape(-1, 3) + 0.5) / m
        if draw(st.booleans()):  # body-centred
            centres = np.concatenate([centres, centres[(centres < 1 - 0.6 / m).all(axis=1)] + 0.5 / m])
        centres = centres[rng.random(len(centres)) < draw(st.sampled_from([1.0, 1.0, 0.7]))]
        centres = centres + draw(st.sampled_from([0.0, 0.0, 1e-16, 1e-15, 1e-12, 1e-9, 1e-3])) * rng.uniform(
            -1, 1, centres.shape
        )
    else:
        centres = rng.uniform(0.05, 0.95, (draw(st.integers(1, 60)), 3))
    if len(centres) == 0:
        centres = np.full((1, 3), 0.5)
    gaps = np.linalg.norm(centres[:, None] - centres, axis=2)
    np.fill_diagonal(gaps, np.inf)
    walls = 2 * np.minimum(centres, 1 - centres).min(axis=1)
    radii = 0.5 * np.minimum(gaps.min(axis=1), walls) * draw(st.sampled_from([0.1, 0.9, 1.0, 1.0, 1.05, 1.3]))
    decades = draw(st.sampled_from([0, 0, 1, 6]))
    return np.column_stack([centres, radii * 10.0 ** (-decades * rng.random(len(radii)))])


@st.composite
def flows(draw):
    """A flow: nothing is computed yet, or refused."""
    spheres = draw(st.one_of(few(), many()))
    shape = np.array(draw(shapes))
    scale = 10.0 ** draw(st.one_of(st.integers(-9, 9), st.integers(-30, 30)))
    shift = draw(st.sampled_from([0.0, 0.0, 0.0, 1.0, -1.0, 1e3, 1e6])) * shape
    box = Box(shift * scale, (shift + shape) * scale)
    packing = Packing((spheres[:, :3] * shape + shift) * scale, spheres[:, 3] * shape.min() * scale, box)
    mesh = PoreMesh(
        packing,
        unite_tolerance=draw(st.sampled_from([0.01, 0.01, 0.0, 0.5])),
        wall_tolerance=draw(st.sampled_from([0.05, 0.05, 0.5, 2.0])),
    )
    slip = draw(st.booleans())
    if draw(st.booleans()):
        walls = Walls.along(draw(st.sampled_from("xyz")), 10.0 ** draw(st.integers(-15, 15)), slip=slip)
    else:
        held = draw(st.lists(st.one_of(st.none(), st.integers(-1000, 1000).map(float)), min_size=6, max_size=6))
        walls = Walls(**{name: Wall(p, slip) for name, p in zip(WALLS, held, strict=True)})
    return PoreFlow(
        mesh,
        walls,
        Fluid(10.0 ** draw(st.integers(-15, 15)), 1000.0),
        draw(st.sampled_from([*[SectionFriction()] * 4, HydraulicRadius(), EffectiveRadius()])),
        gravity=(0.0, 0.0, draw(st.sampled_from([0.0, -9.81]))),
        solver=draw(st.sampled_from(["auto", "direct", "cg"])),
    )


def check(flow):
    """What holds of every flow that is not refused."""
    mesh, box = flow.mesh, flow.mesh.box
    low, high = np.nanmin(flow.walls.pressures), np.nanmax(flow.walls.pressures)
    assert abs(mesh.cell_volumes.sum() / box.volume - 1.0) < 1e-9
    void = mesh.packing.porosity * box.volume
    assert abs(mesh.facets.volumes.sum() - void) < 1e-9 * box.volume
    assert abs(mesh.cell_void_volumes.sum() - void) < 1e-9 * box.volume
    report, forces = flow.solver_report, flow.forces
    for values in (
        flow.pressure, flow.conductances, flow.flux, flow.pore_velocity, forces.total, forces.wall_total,
        mesh.pore_volumes, mesh.throats.volumes, [flow.inflow, flow.outflow, mesh.packing.porosity],
    ):  # fmt: skip
        assert np.isfinite(values).all()
    assert (flow.conductances >= 0.0).all()
    assert report.imbalance <= max(report.tolerance, report.floor)
    room = 1e-9 * (high - low) + 1e-14 * max(abs(low), abs(high))
    assert low - room <= flow.pressure.min() and flow.pressure.max() <= high + room
    assert forces.conservation_residual <= 1e-10
    return report


@settings(FUZZ)
@given(st.data())
def test_a_flow_is_refused_with_a_reason_or_conserved_bounded_and_finite(data):
    try:
        report = check(data.draw(flows()))
    except PorefvError as error:
        assert str(error) and "not finite" not in str(error)
        event("refused: " + str(error).split("(")[0][:60])
        return
    event("done, imbalance " + ("below 1e-10" if report.imbalance <= 1e-10 else "at the floor of rounding"))
