"""Sources and fixed pressures in regions of a packing."""

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from porefv.errors import ComputationError, InputError
from porefv.flow.inside import FixedPressure, FlowSource
from porefv.flow.pore_flow import PoreFlow
from porefv.flow.regions import Point, Sphere, pore_at, pores_in
from porefv.flow.walls import Wall, Walls
from porefv.mesh.pore_mesh import PoreMesh
from porefv.packing.box import WALLS, Box
from porefv.packing.packing import Packing

MIDDLE = Box([0.3, 0.3, 0.3], [0.7, 0.7, 0.7])
OUTLET = Walls(y_max=Wall(0.0))


def outflow_of_pores(flow):
    i, j = flow.mesh.throats.pores.T
    return np.bincount(i, flow.flux, flow.mesh.n_pores) - np.bincount(j, flow.flux, flow.mesh.n_pores)


def check_forces(flow):
    """The forces add up to those of the pressures on the open walls, also where fluid is injected."""
    forces = flow.forces
    assert forces.conservation_residual < 1e-12
    total = (
        forces.sums["pressure"] + forces.sums["viscous"] + forces.sums["wall_pressure"] + forces.sums["wall_viscous"]
    )
    assert_allclose(total, forces.thrust, rtol=0, atol=1e-12 * forces.scale)


# ---- which pores a region stands for ----------


def cells_around(mesh, point):
    """Cells of four or three spheres that contain a point, by barycentric coordinates; wedges reach to their wall."""
    found = []
    for cell, vertices in enumerate(mesh.cells):
        spheres = vertices[vertices < mesh.n_spheres]
        if len(spheres) < 3:
            continue
        corners = mesh.packing.centres[spheres]
        if len(spheres) == 3:  # the fourth corner beyond the wall, under the point
            axis, upper = divmod(int(vertices.max()) - mesh.n_spheres, 2)
            others = np.delete(np.arange(3), axis)
            system = np.vstack([corners[:, others].T, np.ones(3)])
            weights = np.linalg.solve(system, [*point[others], 1.0])
            beyond = (point - weights @ corners)[axis] * (1 if upper else -1)
            inside = (weights >= 0.0).all() and beyond >= 0.0
        else:
            system = np.vstack([corners.T, np.ones(4)])
            flat = np.linalg.cond(system) > 1e12
            inside = not flat and (np.linalg.solve(system, [*point, 1.0]) >= 0.0).all()
        if inside:
            found.append(cell)
    return found


@pytest.mark.parametrize("name", ["n25_s1", "n54_s1"])
def test_a_point_in_the_void_stands_for_the_pore_whose_cell_contains_it(mesh_of, name):
    mesh = mesh_of(name)
    points = np.random.default_rng(1).uniform(mesh.box.lower, mesh.box.upper, (100, 3))
    free = (np.linalg.norm(points[:, None] - mesh.packing.centres, axis=2) > mesh.packing.radii).all(axis=1)
    edge = np.count_nonzero(mesh.cells >= mesh.n_spheres, axis=1) >= 2
    checked = 0
    for point in points[free]:
        pore, cells = pore_at(mesh, point), cells_around(mesh, point)
        if cells:
            assert pore in mesh.cell_pore[cells]
            checked += 1
        else:
            assert pore in mesh.cell_pore[edge]
    assert checked > 20


def test_a_point_in_a_grain_stands_for_the_pore_of_the_nearest_laguerre_vertex(mesh_of):
    mesh = mesh_of("n25_s1")
    centre = mesh.packing.centres[3]
    (pore,) = pores_in(mesh, Point(centre))
    distances = np.linalg.norm(mesh.pore_centres - centre, axis=1)
    assert distances[pore] == distances.min()


def test_a_box_and_a_sphere_stand_for_the_pores_whose_laguerre_vertices_they_contain(mesh_of):
    mesh = mesh_of("n200_s1")
    vertices = mesh.pore_centres
    in_box = pores_in(mesh, MIDDLE)
    assert_array_equal(in_box, np.flatnonzero((np.abs(vertices - 0.5) <= 0.2).all(axis=1)))
    in_sphere = pores_in(mesh, Sphere([0.5, 0.5, 0.5], 0.2))
    assert 0 < len(in_sphere) < len(in_box) and set(in_sphere) <= set(in_box)


# ---- sources ----------


@pytest.mark.parametrize("region", [Point([0.4, 0.5, 0.6]), MIDDLE, Sphere([0.5, 0.5, 0.5], 0.3)])
def test_what_a_source_injects_leaves_through_the_open_wall(mesh_of, region):
    flow = PoreFlow(mesh_of("n200_s1"), OUTLET, sources=[FlowSource(region, 1e-3)])
    assert_allclose(flow.wall_flux["y_max"], -1e-3, rtol=1e-9)
    assert_allclose([flow.inflow, flow.outflow], 1e-3, rtol=1e-9)
    assert flow.imbalance < 1e-9 and flow.pressure.min() >= 0.0
    check_forces(flow)


def test_a_source_is_divided_by_void_volume(mesh_of):
    mesh = mesh_of("n200_s1")
    flow = PoreFlow(mesh, OUTLET, sources=[FlowSource(MIDDLE, 2.0)])
    pores = pores_in(mesh, MIDDLE)
    volumes = mesh.pore_volumes[pores]
    assert_allclose(outflow_of_pores(flow)[pores], 2.0 * volumes / volumes.sum(), rtol=0, atol=1e-9)


def test_flows_of_walls_and_sources_superpose(mesh_of):
    mesh = mesh_of("n200_s1")
    sources = [FlowSource(Point([0.2, 0.3, 0.4]), 0.2), FlowSource(MIDDLE, -0.05)]
    driven = PoreFlow(mesh, Walls.along("y"))
    fed = PoreFlow(mesh, Walls.along("y", 0.0), sources=sources)
    both = PoreFlow(mesh, Walls.along("y"), sources=sources)
    assert_allclose(both.pressure, driven.pressure + fed.pressure, rtol=0, atol=1e-9 * np.ptp(both.pressure))
    assert_allclose(both.forces.total, driven.forces.total + fed.forces.total, rtol=0, atol=1e-9 * both.forces.scale)
    velocity = driven.pore_velocity + fed.pore_velocity
    assert_allclose(both.pore_velocity, velocity, rtol=0, atol=1e-8 * np.abs(velocity).max())
    check_forces(both)


def test_a_source_in_a_pore_on_a_pressure_wall_leaves_through_the_wall(mesh_of):
    mesh = mesh_of("n25_s1")
    face = np.flatnonzero(mesh.wall_faces.walls == 3)[0]
    position = mesh.wall_faces.centroids[face] + mesh.triangulation.origin
    flow = PoreFlow(mesh, OUTLET, sources=[FlowSource(Point(position - [0, 1e-9, 0]), 0.5)])
    assert_array_equal(flow.pressure, 0.0)
    assert flow.wall_flux["y_max"] == -0.5 and flow.imbalance == 0.0


def test_a_source_and_an_imposed_flow_need_no_pressure_if_they_add_up_to_zero(mesh_of):
    mesh = mesh_of("n200_s1")
    source = FlowSource(Point([0.5, 0.5, 0.5]), 1e-3)
    flow = PoreFlow(mesh, Walls(y_max=Wall(inflow=-1e-3)), sources=[source])
    plain = PoreFlow(mesh, OUTLET, sources=[source])
    assert_allclose(flow.pressure, plain.pressure, rtol=0, atol=1e-12 * np.ptp(plain.pressure))
    with pytest.raises(InputError, match="sum is 0.0005 m³/s instead of 0"):
        PoreFlow(mesh, Walls(y_max=Wall(inflow=-5e-4)), sources=[source])
    with pytest.raises(InputError, match="no wall has a pressure"):
        PoreFlow(mesh, Walls(), sources=[source, FlowSource(MIDDLE, -1e-3)])


def test_velocities_of_a_source_do_not_depend_on_where_the_box_stands(random_packing):
    packing = random_packing(60, seed=3, box=Box([0, 0, 0], [1, 1, 1]))
    moved = Packing(packing.centres + 64.0, packing.radii, Box([64, 64, 64], [65, 65, 65]))
    here = PoreFlow(packing, OUTLET, sources=[FlowSource(Point([0.5, 0.25, 0.5]), 1.0)])
    there = PoreFlow(moved, OUTLET, sources=[FlowSource(Point([64.5, 64.25, 64.5]), 1.0)])
    # Coordinates that are 64 times as large have 64 times the rounding.
    assert_allclose(there.pore_velocity, here.pore_velocity, rtol=0, atol=1e-9 * np.abs(here.pore_velocity).max())


# ---- fixed pressures ----------


def test_the_flow_of_a_fixed_pressure_imposed_as_a_source_gives_the_same_flow(mesh_of):
    mesh, point = mesh_of("n200_s1"), Point([0.4, 0.5, 0.6])
    fixed = PoreFlow(mesh, OUTLET, fixed_pressures=[FixedPressure(point, 2.0)])
    (flow,) = fixed.fixed_pressure_flux
    fed = PoreFlow(mesh, OUTLET, sources=[FlowSource(point, flow)])
    assert flow > 0.0
    assert_allclose(fed.pressure, fixed.pressure, rtol=0, atol=1e-9)
    assert_allclose(fed.wall_flux["y_max"], fixed.wall_flux["y_max"], rtol=1e-9)
    for found in (fixed, fed):
        check_forces(found)


def test_all_pores_of_a_region_have_its_pressure(mesh_of):
    mesh = mesh_of("n200_s1")
    flow = PoreFlow(mesh, Walls.along("y"), fixed_pressures=[FixedPressure(MIDDLE, 5.0), FixedPressure(MIDDLE, 5.0)])
    pores = pores_in(mesh, MIDDLE)
    assert_allclose(flow.pressure[pores], 5.0, rtol=1e-15)
    assert_allclose(flow.imposed_pressures[pores], 5.0, rtol=1e-15)
    assert flow.fixed_pressure_flux[1] == 0.0 < flow.fixed_pressure_flux[0]
    assert_allclose(flow.fixed_pressure_flux[0] + sum(flow.wall_flux.values()), 0.0, atol=1e-9 * flow.inflow)
    assert flow.imbalance < 1e-9
    check_forces(flow)


def test_regions_alone_drive_a_flow_between_impervious_walls(mesh_of):
    mesh = mesh_of("n200_s1")
    regions = [FixedPressure(Point([0.2, 0.2, 0.2]), 1e5 + 1.0), FixedPressure(Point([0.8, 0.8, 0.8]), 1e5)]
    flow = PoreFlow(mesh, Walls(), fixed_pressures=regions)
    assert flow.fixed_pressure_flux == pytest.approx([flow.inflow, -flow.inflow], rel=1e-9)
    assert not any(flow.wall_flux.values()) and flow.wall_pressure == {}
    low = PoreFlow(mesh, Walls(), fixed_pressures=[FixedPressure(r.region, r.pressure - 1e5) for r in regions])
    assert_allclose(flow.flux, low.flux, rtol=0, atol=1e-12 * flow.inflow)
    check_forces(flow)
    again = PoreFlow.from_pressure(mesh, low.pressure, Walls(), fixed_pressures=low.fixed_pressures)
    assert_allclose(again.flux, low.flux, rtol=0, atol=1e-9 * flow.inflow)


def test_imposed_flow_and_regions_together(mesh_of):
    mesh = mesh_of("n200_s1")
    flow = PoreFlow(
        mesh, Walls(y_min=Wall(inflow=0.1), y_max=Wall(inflow=-0.02)),
        sources=[FlowSource(Point([0.7, 0.3, 0.5]), 0.05)],
        fixed_pressures=[FixedPressure(Point([0.2, 0.6, 0.5]), -3.0)],
    )  # fmt: skip
    assert_allclose(flow.fixed_pressure_flux, [-0.13], rtol=1e-8)
    assert_allclose([flow.wall_flux["y_min"], flow.wall_flux["y_max"]], [0.1, -0.02], rtol=1e-8)
    check_forces(flow)


# ---- what is refused ----------


@pytest.mark.parametrize(
    ("imposed", "said"),
    [
        ({"sources": [FlowSource(Point([2.0, 0.5, 0.5]), 1.0)]}, "the point 2, 0.5, 0.5 lies outside the box"),
        ({"sources": [FlowSource(Sphere([9.0, 0.5, 0.5], 0.1), 1.0)]}, "no pore has its Laguerre vertex in the sphere"),
        ({"fixed_pressures": [FixedPressure(Box([0.5, 0.5, 0.5], [0.5001, 0.5001, 0.5001]), 1.0)]}, "in the box from"),
        ({"sources": [FixedPressure(MIDDLE, 1.0)]}, "sources must be a list of FlowSource"),
        ({"sources": [FlowSource("here", 1.0)]}, "a region must be a Point, a Sphere or a Box"),
        (
            {"fixed_pressures": [FixedPressure(MIDDLE, 1.0), FixedPressure(Sphere([0.5, 0.5, 0.5], 0.4), 2.0)]},
            "two pressures",
        ),
        (
            {"fixed_pressures": [FixedPressure(Box([0, 0.5, 0], [1, 1, 1]), 1.0)]},
            "on y_max, which has the pressure 0 Pa",
        ),
    ],
)
def test_regions_that_cannot_be_are_refused(mesh_of, imposed, said):
    with pytest.raises(InputError, match=said):
        _ = PoreFlow(mesh_of("n200_s1"), OUTLET, **imposed).pressure


def test_bad_values_are_refused():
    for make in (
        lambda: FlowSource(MIDDLE, float("nan")),
        lambda: FixedPressure(MIDDLE, "high"),
        lambda: Point([0.0, 1.0]),
        lambda: Sphere([0, 0, 0], 0.0),
    ):
        with pytest.raises(InputError):
            make()


def test_a_source_in_an_isolated_pore_is_refused_by_its_place():
    """Spheres of a simple cubic lattice at 1.42 times their touching radius close every throat between them."""
    centres = (np.stack(np.meshgrid(*[np.arange(3)] * 3), axis=-1).reshape(-1, 3) + 0.5) / 3
    mesh = PoreMesh(Packing(centres, np.full(27, 0.5 * 1.42 / 3), Box([0, 0, 0], [1, 1, 1])), wall_tolerance=0.5)
    flow = PoreFlow(mesh, OUTLET, sources=[FlowSource(Point([1 / 3, 1 / 3, 1 / 3]), 1.0)])
    with pytest.raises(
        ComputationError, match=r"pore \d+ at 0.333333333, 0.333333333, 0.333333333 m has a source of 1 m³/s"
    ):
        _ = flow.pressure


def test_permeability_is_refused_where_regions_drive_the_flow(mesh_of):
    flow = PoreFlow(mesh_of("n25_s1"), Walls.along("y"), sources=[FlowSource(Point([0.5, 0.5, 0.5]), 1.0)])
    with pytest.raises(InputError, match="without sources and fixed pressures"):
        _ = flow.permeability
    assert "1 source" in repr(flow) and list(flow.wall_flux) == list(WALLS)


def test_quantities_of_the_sample_count_what_regions_inject(mesh_of):
    mesh = mesh_of("n200_s1")
    flow = PoreFlow(mesh, OUTLET, sources=[FlowSource(Point([0.4, 0.5, 0.6]), 1e-3)])
    # Planes behind the source have its flow, those before it have none.
    assert_allclose(flow.plane_fluxes([0.1, 0.9], "y"), [0.0, 1e-3], rtol=1e-9, atol=1e-12)
    velocities = (flow.pore_velocity * mesh.pore_volumes[:, None]).sum(axis=0)
    assert_allclose(flow.darcy_velocity, velocities / mesh.box.volume, rtol=1e-12)
    with pytest.raises(InputError, match="no regions that drive"):
        _ = PoreFlow(mesh, Walls.along("y"), sources=flow.sources).tortuosity
