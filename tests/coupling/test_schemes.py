"""Order and stability of the steps in time, on a linear skeleton whose motion is known."""

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.linalg import expm

from porefv import Fluid, Walls
from porefv.coupling.coupling import Coupling
from porefv.dem.dem import DEM
from porefv.dem.grain_model import GrainModel
from porefv.dem.material import Material

DRAINED = Walls.from_mapping({"z_min": {"pressure": 0.0}, "z_max": {"pressure": 0.0}, "lateral": {"slip": True}})


class LinearSkeleton:
    """Grains on springs of fixed stiffness, along the normals of the contacts they begin with: a `GrainModel`."""

    def __init__(self, packing, step):
        dem = DEM(packing, Material(friction_angle=0.0))
        self.start, self.radii, self.box, self.masses = dem.positions, dem.radii, dem.box, dem.masses
        self.step, self.rows, self.wall_velocities = step, np.arange(len(dem)), np.zeros((6, 3))
        self.stiffness = np.zeros((3 * len(dem), 3 * len(dem)))
        contacts = dem.contacts
        for (i, j), normal in zip(contacts.grains, contacts.normals, strict=True):
            block = dem.material.young * np.outer(normal, normal) * dem.radii[i]
            for a, b, sign in ((i, i, 1), (j, j, 1), (i, j, -1), (j, i, -1)):
                if a < len(dem) and b < len(dem):
                    self.stiffness[3 * a : 3 * a + 3, 3 * b : 3 * b + 3] += sign * block
        self.displacements = np.zeros((len(dem), 3))
        self.velocities = np.zeros((len(dem), 3))

    @property
    def positions(self):
        return self.start + self.displacements

    def predict(self):
        forces = -(self.stiffness @ self.displacements.ravel()).reshape(-1, 3)
        mobilities = self.step / self.masses
        self.free = self.velocities + mobilities[:, None] * forces
        return self.free, np.zeros(6), mobilities, np.zeros(6)

    def correct(self, forces, thrusts):
        self.velocities = self.free + self.step / self.masses[:, None] * forces
        self.displacements = self.displacements + self.step * self.velocities


@pytest.fixture
def skeleton(reference):
    """skeleton(step): n25_s1 on springs, and a push to begin with."""

    def make(step):
        model = LinearSkeleton(reference("n25_s1"), step)
        model.velocities = 1e-9 * np.random.default_rng(5).normal(size=(25, 3))
        return model

    return make


def exact(model, coupling, time):
    """Displacements at a time: M u'' + Eᵀ G⁻¹ E u' + K u = 0."""
    pores = coupling.equation
    forces = np.stack([pores.forces(unit)[:-6].ravel() for unit in np.eye(len(pores.network))], axis=1)
    drag = forces @ np.linalg.solve(pores.network.to_matrix().toarray(), forces.T)
    inverse = np.repeat(1.0 / model.masses, 3)[:, None]
    n = len(model.stiffness)
    motion = np.block([[np.zeros((n, n)), np.eye(n)], [-inverse * model.stiffness, -inverse * drag]])
    return (expm(time * motion) @ np.append(model.displacements.ravel(), model.velocities.ravel()))[:n]


def error(skeleton, scheme, viscosity, step, time):
    model = skeleton(step)
    assert isinstance(model, GrainModel)
    coupling = Coupling(model, DRAINED, Fluid(viscosity=viscosity), scheme=scheme, tolerance=1e-9)
    right = exact(model, coupling, time)
    coupling.run(round(time / step))
    assert coupling.effort.meshes == 1
    return np.abs(model.displacements.ravel() - right).max() / np.abs(right).max()


@pytest.mark.parametrize(
    ("scheme", "viscosity"), [("semi-implicit", 30.0), ("implicit-drag", 3.0), ("implicit-drag", 1e3)]
)
def test_steps_are_of_first_order(skeleton, scheme, viscosity):
    errors = [error(skeleton, scheme, viscosity, step, 0.004) for step in (4e-5, 2e-5, 1e-5)]
    assert errors[-1] < 1e-3
    assert_allclose(np.log2(np.divide(errors[:-1], errors[1:])), 1.0, atol=0.01)


@pytest.mark.parametrize("viscosity", [1e-6, 1e-2, 1e2, 1e6, 1e10])
def test_the_implicit_step_is_stable_at_the_dry_limit(skeleton, viscosity):
    # Leapfrog without a fluid is stable up to dt = 2 / ω: the fluid takes nothing from that.
    model = skeleton(1.0)
    inverse = np.repeat(1.0 / model.masses, 3)
    fastest = np.sqrt(np.linalg.eigvals(inverse[:, None] * model.stiffness).real.max())
    model.step = 1.9 / fastest
    coupling = Coupling(model, DRAINED, Fluid(viscosity=viscosity), scheme="implicit-drag", tolerance=1e-8)
    start = np.abs(model.velocities).max()
    coupling.run(400)
    assert np.abs(model.velocities).max() < 10 * start


def test_a_semi_implicit_step_beyond_its_limit_runs_away(skeleton, monkeypatch):
    # What is refused deserves it: a little above a drag number of 2 velocities grow, a little below they do not.
    import porefv.coupling.coupling as coupled

    monkeypatch.setattr(coupled, "UNSTABLE", np.inf)
    grown = {}
    for number in (1.7, 2.3):
        probe = Coupling(skeleton(1e-6), DRAINED, Fluid(viscosity=1.0), scheme="semi-implicit")
        model = skeleton(1e-6)
        start = np.abs(model.velocities).max()
        coupling = Coupling(
            model, DRAINED, Fluid(viscosity=number / probe.drag_number), scheme="semi-implicit", tolerance=1e-6
        )
        coupling.run(40)
        grown[number] = np.abs(model.velocities).max() / start
    assert grown[1.7] < 1.0 < 1e3 < grown[2.3]
