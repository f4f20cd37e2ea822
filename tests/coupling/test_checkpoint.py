"""Checkpoints of coupled runs: exact resumption with any conductance model, older files, files that do not fit."""

import json
import shutil
from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from porefv import ConductanceModel, Fluid, HydraulicRadius, SectionFriction, Walls
from porefv.coupling import checkpoint
from porefv.coupling.coupling import Coupling
from porefv.dem import checkpoint as grains_checkpoint
from porefv.dem.dem import DEM
from porefv.dem.material import Material
from porefv.dem.plate import Plate
from porefv.errors import InputError

FILES = Path(__file__).parent / "files"
DRAINED = Walls.from_mapping({"z_min": {"pressure": 0.0}, "z_max": {"pressure": 0.0}, "lateral": {"slip": True}})


class Slits(ConductanceModel):
    """A model of a user's own, with a parameter."""

    name = "slits"

    def __init__(self, factor=1.5):
        self.factor = factor

    def conductivity(self, throats, slip):
        return self.factor * throats.fluid_areas * (throats.volumes / throats.wetted_surfaces(slip)) ** 2 / 3


class Cracks(Slits):
    name = "cracks"


class OwnFriction(SectionFriction):
    """Another model under the name of one of the package."""

    def conductivity(self, throats, slip):
        return 2.0 * super().conductivity(throats, slip)


@pytest.fixture
def coupled(reference):
    """coupled(model, **options): 25 grains pressed by a plate, drained at both ends, after 40 steps."""

    def make(model=None, steps=40, **options):
        dem = DEM(reference("n25_s1"), Material(), {"z_max": Plate(stress=3e3, top_speed=0.05)})
        coupling = Coupling(dem, DRAINED, Fluid(viscosity=100.0), model, **options)
        coupling.run(steps)
        return coupling

    return make


def assert_same(one, other):
    """Two runs that are at the same state, to the last bit."""
    assert (one.effort.steps, one.effort.iterations, one.effort.meshes) == (
        other.effort.steps, other.effort.iterations, other.effort.meshes
    )  # fmt: skip
    for part in ("mesh_centres", "mesh_radii", "mesh_box", "pressure", "rate", "products", "factor_mobilities"):
        assert_array_equal(getattr(one.state, part), getattr(other.state, part), err_msg=part)
    for part in ("scheme", "drag_number", "fresh"):
        assert getattr(one.state, part) == getattr(other.state, part), part
    assert_array_equal(one.pressure, other.pressure)
    assert_array_equal(one.fluid_forces, other.fluid_forces)
    assert_array_equal(one.grains.positions, other.grains.positions)
    assert_array_equal(one.grains.velocities, other.grains.velocities)


# ---- exact resumption ----------


@pytest.mark.parametrize("scheme", ["implicit-drag", "semi-implicit"])
def test_a_resumed_run_is_the_run_to_the_last_bit(reference, tmp_path, scheme):
    dem = DEM(
        reference("n200_s1"), Material(15e6, 0.5, 30.0, 2600.0), {"z_max": Plate(stress=6e3, top_speed=0.05)},
    )  # fmt: skip
    viscosity = {"implicit-drag": 100.0, "semi-implicit": 1e-3}[scheme]
    coupling = Coupling(dem, DRAINED, Fluid(viscosity=viscosity), scheme=scheme, renewal=1e-3)
    coupling.run(40)
    checkpoint.save(coupling, tmp_path / "state.npz")
    again = checkpoint.load(tmp_path / "state.npz")
    assert_same(coupling, again)
    assert (coupling.settings, coupling.walls, coupling.fluid) == (again.settings, again.walls, again.fluid)
    for run in (coupling, again):
        run.run(60)
    assert coupling.effort.meshes > 2
    assert_same(coupling, again)


def test_a_state_is_saved_before_the_first_step(coupled, tmp_path):
    coupling = coupled(steps=0)
    checkpoint.save(coupling, tmp_path / "state.npz")
    again = checkpoint.load(tmp_path / "state.npz")
    for run in (coupling, again):
        run.run(20)
    assert_same(coupling, again)


def test_a_file_has_an_entry_for_each_field_of_the_state(coupled, tmp_path):
    coupling = coupled(steps=2)
    checkpoint.save(coupling, tmp_path / "state.npz")
    grains_checkpoint.save(coupling.grains, tmp_path / "grains.npz")
    with np.load(tmp_path / "state.npz") as file, np.load(tmp_path / "grains.npz") as grains:
        own = {name for name in file.files if not name.startswith("dem_")}
        numbers = json.loads(str(file["header"]))["numbers"].keys()
        assert {name.removeprefix("dem_") for name in set(file.files) - own} == set(grains.files)
    assert (own - {"header"}) | numbers == vars(coupling.state).keys()


# ---- the conductance model ----------


@pytest.mark.parametrize("model", [HydraulicRadius(), SectionFriction(friction=2.5)])
def test_a_model_of_the_package_is_in_the_file(coupled, tmp_path, model):
    path = tmp_path / "state.npz"
    coupling = coupled(model, steps=5)
    checkpoint.save(coupling, path)
    again = checkpoint.load(path)
    assert again.conductance == model
    for run in (coupling, again):
        run.run(5)
    assert_same(coupling, again)
    assert checkpoint.load(path, conductance=type(model)(*vars(model).values())).conductance == model


@pytest.mark.parametrize("model", [Slits(), OwnFriction()])
def test_a_run_with_a_model_of_the_users_own_is_resumed(coupled, tmp_path, model):
    coupling = coupled(model)
    checkpoint.save(coupling, tmp_path / "state.npz")
    again = checkpoint.load(tmp_path / "state.npz", conductance=model)
    assert again.conductance is model
    for run in (coupling, again):
        run.run(20)
    assert_same(coupling, again)


def test_a_model_of_the_users_own_must_be_given_again(coupled, tmp_path):
    path = tmp_path / "state.npz"
    checkpoint.save(coupled(Slits(), steps=2), path)
    with pytest.raises(
        InputError,
        match=r"state\.npz has the conductance model 'slits' \(class .*Slits\), .* not in the file\. "
        r"Give the model: porefv\.coupling\.checkpoint\.load\(path, conductance=model\)",
    ):
        checkpoint.load(path)
    with pytest.raises(
        InputError, match=r"state\.npz has the conductance model 'slits', not 'cracks'\. Give the model"
    ):
        checkpoint.load(path, conductance=Cracks())
    with pytest.raises(InputError, match="'slits', not 'section-friction'"):
        checkpoint.load(path, conductance=SectionFriction())
    with pytest.raises(InputError, match=r"must be an object, not a class: write Slits\(\)"):
        checkpoint.load(path, conductance=Slits)


def test_a_model_under_the_name_of_one_of_the_package_is_told_from_it(coupled, tmp_path):
    path = tmp_path / "state.npz"
    checkpoint.save(coupled(OwnFriction(), steps=2), path)
    with pytest.raises(InputError, match=r"'section-friction' \(class .*OwnFriction\)"):
        checkpoint.load(path)


def test_a_run_goes_on_with_the_parameters_it_was_started_with(coupled, tmp_path):
    path = tmp_path / "state.npz"
    checkpoint.save(coupled(SectionFriction(friction=2.5), steps=2), path)
    with pytest.raises(InputError, match=r"SectionFriction\(friction=2\.5.*, not SectionFriction\(friction=1\.35"):
        checkpoint.load(path, conductance=SectionFriction())
    with pytest.raises(InputError, match="'section-friction', not 'hydraulic-radius'"):
        checkpoint.load(path, conductance=HydraulicRadius())


# ---- older files ----------


@pytest.mark.parametrize("name", ["version_1", "version_1_with_grains_of_version_1"])
def test_a_file_of_version_1_is_loaded(coupled, name):
    # The files were written after 40 steps by the versions of porefv 0.1.0 that had these formats.
    again, coupling = checkpoint.load(FILES / f"{name}.npz"), coupled(HydraulicRadius())
    assert again.conductance == HydraulicRadius()
    assert (again.effort.steps, again.effort.meshes, again.scheme) == (40, 1, "implicit-drag")
    for _ in range(2):
        assert_same_but_for_the_solver(again, coupling)
        for run in (coupling, again):
            run.run(20)


def test_a_file_of_version_1_of_another_model_needs_it(coupled):
    path = FILES / "version_1_of_another_model.npz"
    with pytest.raises(InputError, match="conductance model 'slits', which is not one of porefv"):
        checkpoint.load(path)
    assert_same_but_for_the_solver(checkpoint.load(path, conductance=Slits()), coupled(Slits()))


def assert_same_but_for_the_solver(one, other):
    # Pressures are found to a tolerance, of their power; the solver had another preconditioner then.
    assert np.linalg.norm(one.pressure - other.pressure) < 0.01 * np.linalg.norm(other.pressure)
    assert_allclose(one.grains.positions, other.grains.positions, rtol=1e-5)


def test_a_newer_format_says_so(rewritten, tmp_path):
    path = tmp_path / "state.npz"
    for change, format_ in (
        (lambda header, content: header.update(version=checkpoint.VERSION + 1, porefv="9.9"), checkpoint.VERSION + 1),
        (newer_grains, grains_checkpoint.VERSION + 1),
    ):
        shutil.copy(FILES / "version_1.npz", path)
        rewritten(path, change)
        with pytest.raises(InputError, match=rf"state\.npz has format {format_}, written by porefv 9\.9"):
            checkpoint.load(path)


def newer_grains(header, content):
    grains = json.loads(str(content["grains_header"]))
    grains |= {"version": grains_checkpoint.VERSION + 1, "porefv": "9.9"}
    content["grains_header"] = np.array(json.dumps(grains))


# ---- files that do not fit ----------


def test_damaged_checkpoints_are_refused(coupled, tmp_path):
    path = tmp_path / "state.npz"
    checkpoint.save(coupled(steps=0), path)
    content = bytearray(path.read_bytes())
    content[len(content) // 2] ^= 0x10
    path.write_bytes(content)
    with pytest.raises(InputError, match="damaged"):
        checkpoint.load(path)


def test_a_checkpoint_of_grains_alone_is_not_one_of_a_coupling(coupled, tmp_path):
    grains_checkpoint.save(coupled(steps=0).grains, tmp_path / "grains.npz")
    with pytest.raises(InputError, match=r"grains\.npz is not a checkpoint of porefv\.coupling.*'porefv\.dem'"):
        checkpoint.load(tmp_path / "grains.npz")


@pytest.mark.parametrize(
    ("change", "reason"),
    [
        (lambda header, content: content.pop("pressure"), "'pressure' is missing"),
        (lambda header, content: content.update(pressure=np.zeros(3)), r"rate is float64 \(\d+,\), not float64 \(3,\)"),
        (
            lambda header, content: content.update(pressure=content["pressure"].astype(np.float32)),
            "pressure is float32",
        ),
        (lambda header, content: content.update(products=np.zeros((3, 0))), "products is float64"),
        (lambda header, content: content.update(products=np.zeros((2, 5))), "products is of 5, not of 0 or"),
        (
            lambda header, content: content.update(
                dict.fromkeys(("pressure", "rate"), np.zeros(5)), products=np.zeros((2, 0))
            ),
            "cannot go on: .* of 5 free pores",
        ),
        (lambda header, content: content.update(factor_mobilities=np.zeros(5)), "factor_mobilities is of 5"),
        (lambda header, content: content.update(mesh_radii=np.zeros(3)), "mesh_radii is float64"),
        (lambda header, content: header["numbers"].update(fresh=0), "fresh is 0, not bool"),
        (
            lambda header, content: header["numbers"].update(drag_number="low"),
            "drag_number is 'low', not float or nothing",
        ),
        (lambda header, content: header["numbers"].pop("scheme"), "'scheme' is missing"),
        (lambda header, content: header["settings"].update(exchange="barter"), "unknown exchange 'barter'"),
        (lambda header, content: header["settings"].update(colour="red"), "colour"),
        (lambda header, content: header["conductance"]["parameters"].update(friction=-1.0), "friction must be"),
        (lambda header, content: header["effort"].pop("steps") and header["effort"].update(colour=1), "colour"),
        (lambda header, content: header["numbers"].update(scheme="magic"), "there is no scheme 'magic'"),
        (lambda header, content: content["pressure"].put(0, np.nan), "pressure is not finite"),
        (lambda header, content: content["mesh_centres"].put(0, np.inf), "mesh_centres is not finite"),
        (lambda header, content: content["mesh_radii"].put(0, -1.0), "radi"),
        (lambda header, content: content["dem_pairs_others"].put(0, 2**30), "pairs_others are not those of pairs"),
        (lambda header, content: header["effort"].update(steps=None), "steps, iterations and meshes are counts"),
        (lambda header, content: header["effort"].update(seconds="long"), "the seconds are of"),
        (lambda header, content: header["effort"]["seconds"].update(forces=10**400), "the seconds are no numbers"),
        (lambda header, content: header.update(walls=3), "damaged"),
        (lambda header, content: header.update(conductance={}), "'name' is missing"),
        (lambda header, content: content.pop("dem_pairs_shear"), r"porefv\.dem.*'pairs_shear' is missing"),
    ],
)
def test_content_that_does_not_fit_together_is_refused(rewritten, coupled, tmp_path, change, reason):
    path = tmp_path / "state.npz"
    checkpoint.save(coupled(steps=2), path)
    rewritten(path, change)
    with pytest.raises(InputError, match=rf"state\.npz .*{reason}"):
        checkpoint.load(path)


def test_grains_of_another_program_cannot_be_saved(coupled, tmp_path):
    coupling = coupled(steps=0)
    coupling.grains = object()
    with pytest.raises(InputError, match=r"only a coupling with a porefv\.dem\.DEM can be saved"):
        checkpoint.save(coupling, tmp_path / "state.npz")
    assert list(tmp_path.iterdir()) == []
