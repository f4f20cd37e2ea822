"""Checkpoints: a run that was saved goes on as if nothing had happened, and what is no checkpoint says so."""

import json
from dataclasses import is_dataclass
from pathlib import Path

import numpy as np
import pytest

from porefv import Box, ComputationError, InputError, Packing
from porefv.dem import checkpoint
from porefv.dem.dem import DEM
from porefv.dem.material import Material
from porefv.dem.plate import Plate

PACKINGS = Path(__file__).parents[2] / "data" / "packings"
FILES = Path(__file__).parent / "files"


def assembly(name="n200_s1"):
    """Everything at once: friction, plates that move, shear and press, gravity, damping, forces from outside."""
    rng = np.random.default_rng(0)
    dem = DEM(
        Packing.read(PACKINGS / f"{name}.csv"),
        Material(young=1e7, stiffness_ratio=0.6, friction_angle=25.0, density=2500.0),
        {
            "x_min": Plate(velocity=(0.01, 0.3, 0.0), friction_angle=20.0),
            "x_max": Plate(stress=500.0, top_speed=0.2, velocity=(0.0, -0.1, 0.0), friction_angle=15.0),
            "z_max": Plate(stress=2000.0, top_speed=0.5),
        },
        gravity=(0.1, 0.0, -9.81),
        damping=0.05,
    )
    dem.velocities = rng.normal(scale=0.3, size=(len(dem), 3))
    dem.spins = rng.normal(size=(len(dem), 3))
    dem.apply(rng.normal(scale=5.0, size=(len(dem), 3)))
    return dem


def entries(thing, name=""):
    """Everything that a DEM holds by name, down to arrays and numbers."""
    if isinstance(thing, DEM) or is_dataclass(thing):
        parts = vars(thing)
    elif isinstance(thing, tuple):
        parts = dict(zip(getattr(type(thing), "__annotations__", range(len(thing))), thing, strict=True))
    else:
        return {name: thing}
    return {key: entry for part, value in parts.items() for key, entry in entries(value, f"{name}.{part}").items()}


def differences(one, other):
    """Names of what differs in type, layout or the last bit."""
    one, other = entries(one), entries(other)
    found = []
    for name in sorted(one.keys() | other.keys()):
        a, b = one.get(name), other.get(name)
        if isinstance(a, np.ndarray) and isinstance(b, np.ndarray):
            same = (a.dtype, a.shape, a.flags.c_contiguous) == (b.dtype, b.shape, b.flags.c_contiguous)
            same = same and b.flags.writeable and a.tobytes() == b.tobytes()
        else:
            same = type(a) is type(b) and a == b
        if not same:
            found.append(name)
    return found


@pytest.fixture
def saved(tmp_path):
    """A small checkpoint, and its DEM."""
    dem = assembly("sc8")
    dem.run(100)
    path = tmp_path / "state.npz"
    checkpoint.save(dem, path)
    return dem, path


# ---- exact resume ----------


def test_everything_that_a_dem_holds_is_compared(saved):
    # What is missing in a file is missing in `differences`, or in nothing at all.
    dem, path = saved
    names = entries(dem).keys()
    assert {".state.pairs.shear", ".state.listing.slack", ".state.walls.yields", ".state.time", ".damping"} <= names
    other = checkpoint.load(path)
    other.state.pairs.shear[0, 0] += 1e-12
    other.state.time += 1.0
    other.halfway = True
    assert differences(dem, other) == [".halfway", ".state.pairs.shear", ".state.time"]


def test_a_file_has_an_entry_for_each_field_of_the_state(saved):
    _, path = saved
    with np.load(path) as file:
        arrays, numbers = set(file.files) - {"header"}, json.loads(str(file["header"]))["numbers"].keys()
    held = {
        name.removeprefix(".state.").replace(".", "_"): entry
        for name, entry in entries(saved[0].state, ".state").items()
    }
    assert arrays == {name for name, entry in held.items() if isinstance(entry, np.ndarray)} | {"gravity"}
    assert numbers == {name for name in held.keys() - arrays} | {"damping", "step", "ranges"}


def test_a_run_goes_on_from_a_checkpoint_to_the_last_bit(tmp_path):
    dem = assembly()
    dem.run(300)
    contacts = dem.contacts
    tangential = contacts.forces - (contacts.forces * contacts.normals).sum(axis=1)[:, None] * contacts.normals
    walled = contacts.grains[:, 1] >= len(dem)
    assert tangential[walled].any() and tangential[~walled].any()  # there is something to forget
    assert dem.moved_since_listing > 0.0  # and a list of pairs that is not fresh
    checkpoint.save(dem, tmp_path / "state.npz")
    again = checkpoint.load(tmp_path / "state.npz")
    assert differences(dem, again) == []
    moved = []
    for _ in range(50):
        dem.run(10)
        again.run(10)
        moved.append(dem.moved_since_listing)
    assert min(np.diff(moved)) < 0.0  # pairs were listed anew on the way
    assert differences(dem, again) == []
    assert again.energies == dem.energies
    assert (again.steps, again.time) == (800, dem.time)


def test_saving_changes_nothing(tmp_path):
    dem, undisturbed = assembly("sc8"), assembly("sc8")
    for one in (dem, undisturbed):
        one.run(50)
    checkpoint.save(dem, tmp_path / "state.npz")
    assert differences(dem, undisturbed) == []


def test_a_loaded_dem_is_a_dem_like_any_other(saved):
    dem, path = saved
    again = checkpoint.load(path)
    for one in (dem, again):
        one.set_plates({"y_max": Plate(velocity=(0.0, -0.01, 0.0))})
        one.set_material(Material(young=0.8e7, friction_angle=10.0))
        one.scale_radii(1.001)
        one.apply(np.ones((len(one), 3)))
        one.run(100)
    assert differences(dem, again) == []
    assert repr(again) == repr(dem)


def test_plates_may_be_given_velocities_of_any_kind(tmp_path):
    dem = assembly("sc8")
    dem.set_plates({"x_min": Plate(velocity=np.array([0.1, 0.2, 0.3], np.float32)), "y_min": Plate(velocity=[0, 1, 2])})
    checkpoint.save(dem, tmp_path / "state.npz")
    again = checkpoint.load(tmp_path / "state.npz")
    assert np.array_equal(again.wall_velocities, dem.wall_velocities)
    assert again.plates["y_min"] == Plate(velocity=(0.0, 1.0, 2.0))


def test_the_file_is_named_as_asked_and_opens_without_pickle(tmp_path):
    dem = assembly("sc8")
    checkpoint.save(dem, tmp_path / "state")
    assert [path.name for path in tmp_path.iterdir()] == ["state"]
    with np.load(tmp_path / "state", allow_pickle=False) as file:
        assert np.array_equal(file["grains_motion"][:, :3], dem.positions[file["order"]])
        assert json.loads(str(file["header"]))["version"] == checkpoint.VERSION


def test_a_checkpoint_that_cannot_be_completed_leaves_the_one_before(saved, monkeypatch):
    dem, path = saved
    before = path.read_bytes()

    def full(file, **arrays):
        file.write(b"PK")
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(np, "savez", full)
    with pytest.raises(InputError, match=r"cannot write .*state\.npz.*No space left"):
        checkpoint.save(dem, path)
    assert path.read_bytes() == before
    assert list(path.parent.iterdir()) == [path]


# ---- what is no checkpoint ----------


def test_a_truncated_file_is_refused(saved, tmp_path):
    _, path = saved
    content = path.read_bytes()
    for length in (0, 1, 100, len(content) // 2, len(content) - 1):
        cut = tmp_path / "cut.npz"
        cut.write_bytes(content[:length])
        with pytest.raises(InputError, match=r"cut\.npz is not a checkpoint .* or it is damaged .*start the run anew"):
            checkpoint.load(cut)


def test_no_flipped_bit_goes_unnoticed(saved, tmp_path):
    dem, path = saved
    content = bytearray(path.read_bytes())
    rng = np.random.default_rng(0)
    refused = 0
    # Everywhere, and in the archive's directory at the end in particular.
    for place in np.concatenate([rng.integers(0, len(content), 200), len(content) - rng.integers(1, 1500, 200)]):
        flipped = content.copy()
        flipped[place] ^= 1 << rng.integers(8)
        (tmp_path / "flipped.npz").write_bytes(flipped)
        try:
            again = checkpoint.load(tmp_path / "flipped.npz")
        except InputError as error:
            assert "flipped.npz" in str(error)
            refused += 1
        else:  # a date, or another thing without a meaning here
            assert differences(dem, again) == []
    assert refused > 100


def test_foreign_files_are_refused(tmp_path):
    path = tmp_path / "other.npz"
    writers = [
        lambda: path.write_text("x,y,z,radius\n"),
        lambda: np.savez(path, state=np.zeros((3, 10))),
        lambda: np.savez(path, header=np.array(json.dumps({"format": "another", "version": 1}))),
        lambda: np.savez(path, header=np.array("[]")),
        lambda: np.savez(path, header=np.array(["{}", None], object)),
        lambda: np.save(path.open("wb"), np.zeros(3)),
    ]
    for write in writers:
        write()
        with pytest.raises(InputError, match=r"other\.npz is not a checkpoint of porefv\.dem"):
            checkpoint.load(path)


def test_a_file_that_is_not_there_is_named(tmp_path):
    with pytest.raises(InputError, match=r"cannot read .*missing\.npz: No such file"):
        checkpoint.load(tmp_path / "missing.npz")
    with pytest.raises(InputError, match="cannot read"):
        checkpoint.load(tmp_path)


def test_a_newer_format_says_so(rewritten, saved):
    _, path = saved

    def newer(header, content):
        header.update(version=checkpoint.VERSION + 1, porefv="9.9")
        content.clear()

    rewritten(path, newer)
    with pytest.raises(InputError, match=r"state\.npz has format 6, written by porefv 9\.9.*Install the newer porefv"):
        checkpoint.load(path)


@pytest.mark.parametrize(
    ("change", "reason"),
    [
        (lambda header, content: content.pop("pairs_shear"), "'pairs_shear' is missing"),
        (lambda header, content: content.update(pairs_shear=np.zeros((1, 3))), r"pairs_shear is float64 \(1, 3\), not"),
        (lambda header, content: content.update(pairs_others=content["pairs_others"].astype(np.int64)), "int64"),
        (lambda header, content: content.update(order=content["order"].astype(np.int32)), "order is int32"),
        (lambda header, content: content.update(gravity=np.zeros(2)), r"gravity is float64 \(2,\)"),
        (lambda header, content: content.update(walls_places=np.zeros((6, 1))), "walls_places is float64"),
        (lambda header, content: header["numbers"].pop("time"), "'time' is missing"),
        (lambda header, content: header["numbers"].update(time="soon"), "time is 'soon', not float"),
        (lambda header, content: header["numbers"].update(steps=True), "steps is True, not int"),
        (lambda header, content: header["numbers"].update(ranges=5), "ranges is int64"),
        (lambda header, content: header["material"].update(colour="red"), "colour"),
        (lambda header, content: header["material"].update(young=-1.0), "young"),
        (lambda header, content: header["plates"].pop("z_max"), "'z_max' is missing"),
        (lambda header, content: header["numbers"].update(step=float("inf")), "step is out of range"),
        (lambda header, content: header["numbers"].update(step=1e308), "step is out of range"),
        (lambda header, content: header.update(plates="many"), "no attribute"),
        (lambda header, content: header["plates"]["z_max"].update(velocity=[10**400, 0, 0]), "damaged"),
        (lambda header, content: header["numbers"].update(time=float("nan")), "time is not finite"),
        (lambda header, content: header["numbers"].update(listing_slack=1e9), "listing_slack is not within a radius"),
        (lambda header, content: content["order"].put(0, -1), "order is no numbering"),
        (lambda header, content: content["order"].put(0, 1), "order is no numbering"),
        (lambda header, content: content["rank"].put(0, 10**12), "rank is not the inverse of order"),
        (lambda header, content: content["pairs_grains"].put(1, 2**30), "are not pairs of two grains"),
        (lambda header, content: content["pairs_grains"].put(0, -1), "are not pairs of two grains"),
        (lambda header, content: content["pairs_grains"].put([0, 1], [5, 6]), "pairs_grains are not sorted"),
        (lambda header, content: content["pairs_starts"].put(1, 10**12), "pairs_starts are not those of pairs"),
        (lambda header, content: content["pairs_others"].put(0, 2**30), "pairs_others are not those of pairs"),
        (lambda header, content: content["wall_pairs_members"].put(0, -7), "not pairs of a grain and a wall"),
        (lambda header, content: content["wall_pairs_members"].put(1, 6), "not pairs of a grain and a wall"),
        (lambda header, content: content["grains_motion"].put(0, np.nan), "grains_motion is not finite"),
        (lambda header, content: content["grains_motion"].put(3, -1.0), "radius that is not positive"),
        (lambda header, content: content["walls_places"].put(0, 1e9), "walls_places make no box"),
    ],
)
def test_content_that_does_not_fit_together_is_refused(rewritten, saved, change, reason):
    _, path = saved
    rewritten(path, change)
    with pytest.raises(InputError, match=rf"state\.npz is not a checkpoint .*{reason}"):
        checkpoint.load(path)


def test_a_file_that_would_unpack_to_any_size_is_refused(saved):
    _, path = saved
    with np.load(path) as file:
        content = dict(file)
    np.savez_compressed(path, **content)
    with pytest.raises(InputError, match="its arrays are packed"):
        checkpoint.load(path)


@pytest.mark.parametrize("name", ["order", "rank", "pairs_grains", "pairs_starts", "pairs_others", "pairs_ranges",
                                  "wall_pairs_members", "wall_pairs_ranges"])  # fmt: skip
def test_no_index_leads_out_of_an_array(rewritten, tmp_path, name):
    rng = np.random.default_rng(0)
    for value in (-1, 2**31 - 1, -(2**31), 7):
        dem = assembly("sc8")
        checkpoint.save(dem, tmp_path / "state.npz")
        rewritten(tmp_path / "state.npz", lambda _, content: content[name].put(rng.integers(content[name].size), value))  # noqa: B023
        try:
            checkpoint.load(tmp_path / "state.npz").run(20)
        except InputError as error:
            assert name in str(error)


# ---- saving on the way ----------


def test_a_run_in_chunks_is_the_run(tmp_path):
    # Only the work of applied forces is added up by chunks.
    dem, whole = assembly(), assembly()
    checkpoint.run_saving(dem, 500, tmp_path / "state.npz", every=130)
    whole.run(500)
    assert set(differences(dem, whole)) <= {".state.applied_work", ".state.time"}
    np.testing.assert_allclose(dem.energies.applied, whole.energies.applied, rtol=1e-10)
    assert differences(dem, checkpoint.load(tmp_path / "state.npz")) == []


def test_a_runaway_leaves_the_last_good_state(tmp_path):
    dem = DEM(Packing([[0, 0, 0], [0, 0, 1]], [0.1, 0.1], Box([-9, -9, -9], [9, 9, 9])))
    path = tmp_path / "state.npz"
    # A tenth of the radius in one step after 100 of them, still far from the wall.
    pull = 1e-3 * dem.radii[1] * dem.masses[1] / dem.step**2
    dem.apply([[0, 0, 0], [0, 0, pull]])
    with pytest.raises(ComputationError, match=r"runs away at step \d+.* Last good state, step 80, in .*state\.npz"):
        checkpoint.run_saving(dem, 10_000, path, every=40)
    good = checkpoint.load(path)
    assert good.steps == 80 < dem.steps <= 120
    good.run(dem.steps - 81)  # it was good to the step before
    # The runaway itself is not put in its place.
    before = path.read_bytes()
    with pytest.raises(ComputationError, match=r"grain 1 moves at .* not saved; .*state\.npz is as it was"):
        checkpoint.run_saving(dem, 10, path, every=5)
    assert path.read_bytes() == before


def test_an_interrupt_leaves_the_last_good_state(tmp_path, monkeypatch):
    dem, path = assembly("sc8"), tmp_path / "state.npz"
    run = dem.run

    def interrupted(steps):
        run(steps)
        if dem.steps == 30:
            raise KeyboardInterrupt

    monkeypatch.setattr(dem, "run", interrupted, raising=False)
    with pytest.raises(KeyboardInterrupt, match=r"Last good state, step 20, in .*state\.npz"):
        checkpoint.run_saving(dem, 100, path, every=10)
    again, reference = checkpoint.load(path), assembly("sc8")
    again.run(10)
    for _ in range(3):
        reference.run(10)
    assert differences(again, reference) == []


def test_a_checkpoint_that_cannot_be_written_stops_the_run_before_it_starts(tmp_path):
    dem = assembly("sc8")
    with pytest.raises(InputError, match="cannot write"):
        checkpoint.run_saving(dem, 10, tmp_path / "missing" / "state.npz", every=5)
    assert dem.steps == 0


@pytest.mark.parametrize(("steps", "every", "name"), [(-1, 5, "steps"), (10, 0, "every"), (10, 2.5, "every")])
def test_steps_must_be_whole_numbers(tmp_path, steps, every, name):
    with pytest.raises(InputError, match=f"{name} must be a whole number"):
        checkpoint.run_saving(assembly("sc8"), steps, tmp_path / "state.npz", every=every)
    assert list(tmp_path.iterdir()) == []


# ---- older files ----------


@pytest.mark.parametrize("version", [1, 2, 3, 4])
def test_a_file_of_an_older_version_is_loaded(version):
    # Written after 100 steps by the versions of porefv, 0.1.0 and 0.2.0, that had those formats; 3 by two threads.
    again, dem = checkpoint.load(FILES / f"version_{version}.npz"), assembly("sc8")
    dem.run(100)
    for _ in range(2):
        one, other = entries(again), entries(dem)
        assert one.keys() == other.keys()
        for name, entry in one.items():
            if isinstance(entry, np.ndarray):
                # They may have rounded differently on another processor.
                scale = np.abs(np.nan_to_num(other[name])).max(initial=1e-3)
                np.testing.assert_allclose(entry, other[name], atol=1e-6 * scale, err_msg=name)
            else:
                assert entry == (pytest.approx(other[name], 1e-6) if isinstance(entry, float) else other[name])
        again.run(50)
        dem.run(50)


def test_saving_a_file_of_an_older_version_again_makes_it_one_of_today(tmp_path):
    old = checkpoint.load(FILES / "version_2.npz")
    checkpoint.save(old, tmp_path / "new.npz")
    assert differences(old, checkpoint.load(tmp_path / "new.npz")) == []


@pytest.mark.parametrize("version", [1, 2])
def test_an_older_file_that_lacks_something_is_refused(rewritten, version, tmp_path):
    path = tmp_path / "old.npz"
    path.write_bytes((FILES / f"version_{version}.npz").read_bytes())
    rewritten(path, lambda header, content: content.pop("shear"))
    with pytest.raises(InputError, match=r"old\.npz is not a checkpoint .*'pairs_shear' is missing"):
        checkpoint.load(path)
