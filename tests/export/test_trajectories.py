"""Trajectories: what ParaView reads is what there was, also after a resume."""

import subprocess
import sys
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from porefv import Box, InputError, Packing
from porefv.dem import checkpoint
from porefv.dem.dem import DEM
from porefv.dem.material import Material
from porefv.dem.plate import Plate
from porefv.export.trajectories import Trajectory

pyvista = pytest.importorskip("pyvista")
PACKINGS = Path(__file__).parents[2] / "data" / "packings"


def sample():
    dem = DEM(
        Packing.read(PACKINGS / "n25_s1.csv"),
        Material(young=1e7, friction_angle=25.0),
        {"z_max": Plate(stress=2000.0, top_speed=0.3), "x_min": Plate(velocity=(0.0, 0.1, 0.0), friction_angle=20.0)},
        gravity=(0.0, 0.0, -9.81),
    )
    dem.velocities = np.random.default_rng(0).normal(scale=0.1, size=(len(dem), 3))
    dem.apply(np.random.default_rng(1).normal(size=(len(dem), 3)))
    return dem


def smooth_sample():
    dem = sample()
    dem.set_material(Material(young=1e7, stiffness_ratio=0.0, friction_angle=0.0))
    return dem


def frames(directory, series="grains"):
    """Times, and the frames at these times, as PyVista reads them."""
    reader = pyvista.PVDReader(directory / f"{series}.pvd")
    found = []
    for time in reader.time_values:
        reader.set_active_time_value(time)
        found.append(reader.read()[0])
    return list(reader.time_values), found


def files(directory, series="grains"):
    return sorted(path.name for path in directory.glob(f"{series}_*.vtp"))


# ---- what is in a frame ----------


def test_frames_read_back_as_the_grains_were(tmp_path):
    dem = sample()
    trajectory = Trajectory(tmp_path / "new" / "frames", dem)
    expected = []
    for _ in range(3):
        dem.run(50)
        trajectory.write()
        expected.append((dem.time, dem.positions, dem.velocities, dem.spins))
    times, found = frames(trajectory.directory)
    assert times == [time for time, *_ in expected] == trajectory.times
    for (_, positions, velocities, spins), points in zip(expected, found, strict=True):
        assert_array_equal(points.points, positions)
        assert_array_equal(points["id"], np.arange(25))
        assert_array_equal(points["radius"], dem.radii)
        assert_array_equal(points["velocity"], velocities)
        assert_array_equal(points["spin"], spins)
    assert repr(trajectory) == f"Trajectory({trajectory.directory}, 3 frames, to {dem.time:.4g} s)"
    assert not (trajectory.directory / "contacts.pvd").exists()


def test_the_resultant_force_is_what_changes_the_velocity(tmp_path):
    # Without friction: tangential forces are those of the step before.
    dem = smooth_sample()
    dem.run(100)
    Trajectory(tmp_path, dem).write()
    force, before = frames(tmp_path)[1][0]["force"], dem.velocities
    dem.run(1)
    changes = dem.masses[:, None] * (dem.velocities - before) / dem.step
    assert_allclose(changes, force, atol=1e-11 * np.abs(force).max())


def test_contacts_are_lines_between_centres_or_to_walls(tmp_path):
    dem = sample()
    dem.run(100)
    Trajectory(tmp_path, dem, contacts=True).write()
    contacts, (lines,) = dem.contacts, frames(tmp_path, "contacts")[1]
    ends = lines.points[lines.lines.reshape(-1, 3)[:, 1:]]
    i, j = contacts.grains.T
    walled = j >= 25
    assert 0 < walled.sum() < len(contacts) == lines.n_cells
    assert_array_equal(ends[:, 0], dem.positions[i])
    assert_array_equal(ends[~walled, 1], dem.positions[j[~walled]])
    assert_array_equal(ends[walled, 1], contacts.points[walled])
    assert_array_equal(lines["grains"], contacts.grains)
    assert_array_equal(lines["force"], contacts.forces)


def test_normal_forces_are_positive_and_grow_with_the_overlap(tmp_path):
    dem = smooth_sample()
    dem.run(100)
    Trajectory(tmp_path, dem, contacts=True).write()
    contacts, (lines,) = dem.contacts, frames(tmp_path, "contacts")[1]
    i, j = contacts.grains.T
    r = np.append(dem.radii, np.full(6, np.nan))
    # A wall counts as a sphere of the grain's size.
    other = np.where(j < 25, r[j], r[i])
    expected = 2.0 * dem.material.young * r[i] * other / (r[i] + other) * contacts.overlaps
    assert_allclose(lines["normal_force"], expected, rtol=1e-9)


def test_grains_apart_have_no_contacts_and_no_lines(tmp_path):
    dem = DEM(Packing([[0, 0, 0], [1, 0, 0]], [0.1, 0.1], Box([-2, -2, -2], [2, 2, 2])))
    Trajectory(tmp_path, dem, contacts=True).write()
    (lines,) = frames(tmp_path, "contacts")[1]
    assert lines.n_lines == 0
    assert set(lines.cell_data) == {"grains", "force", "normal_force"}  # for ParaView to colour by, later
    assert_array_equal(frames(tmp_path)[1][0]["force"], np.zeros((2, 3)))


def test_walls_are_the_sides_of_the_box_facing_outwards(tmp_path):
    dem = sample()
    dem.run(100)
    Trajectory(tmp_path, dem).write()
    (sides,) = frames(tmp_path, "walls")[1]
    box = dem.box
    assert_array_equal(np.reshape(sides.bounds, (3, 2)).T, [box.lower, box.upper])
    outwards = np.zeros((6, 3))
    outwards[np.arange(6), np.arange(6) // 2] = [-1, 1, -1, 1, -1, 1]
    assert_allclose(sides.compute_normals(consistent_normals=False)["Normals"], outwards, atol=1e-6)
    for wall, centre in enumerate(sides.cell_centers().points):
        assert_allclose(centre[wall // 2], dem.places[wall], rtol=1e-14)
    assert_array_equal(sides["wall"], np.arange(6))
    assert_array_equal(sides["velocity"], dem.wall_velocities)
    assert_allclose(sides["force"], dem.wall_forces, rtol=1e-12, atol=1e-12)


# ---- the list of frames ----------


def test_the_list_names_complete_frames_only_and_is_replaced_at_once(tmp_path, monkeypatch):
    dem = sample()
    trajectory = Trajectory(tmp_path, dem)
    trajectory.write()
    before = (tmp_path / "grains.pvd").read_bytes()
    dem.run(10)

    def full(dataset, path):
        path.write_bytes(b"half a frame")
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("porefv.export.trajectories.write_xml", full)
    with pytest.raises(InputError, match="cannot write .*grains_000000010.vtp.*No space left"):
        trajectory.write()
    assert (tmp_path / "grains.pvd").read_bytes() == before
    assert files(tmp_path) == ["grains_000000000.vtp"]
    assert not list(tmp_path.glob(".*"))
    monkeypatch.undo()
    trajectory.write()
    assert files(tmp_path) == ["grains_000000000.vtp", "grains_000000010.vtp"]
    named = [entry.get("file") for entry in ElementTree.parse(tmp_path / "grains.pvd").iter("DataSet")]
    assert named == files(tmp_path)


def test_a_second_frame_of_a_step_takes_the_place_of_the_first(tmp_path):
    dem = sample()
    trajectory = Trajectory(tmp_path, dem)
    trajectory.write()
    dem.velocities = np.zeros((25, 3))
    trajectory.write()
    times, (points,) = frames(tmp_path)
    assert times == [0.0]
    assert not points["velocity"].any()


def test_a_resumed_run_keeps_earlier_frames_and_drops_later_ones(tmp_path):
    # One run goes through; the other is saved after two frames, writes two more, and goes on from the checkpoint.
    whole = sample()
    reference = Trajectory(tmp_path / "whole", whole, contacts=True)
    for _ in range(4):
        whole.run(50)
        reference.write()

    directory = tmp_path / "frames"
    dem = sample()
    trajectory = Trajectory(directory, dem, contacts=True)
    for frame in range(4):
        dem.run(50 if frame < 2 else 70)
        trajectory.write()
        if frame == 1:
            checkpoint.save(dem, tmp_path / "state.npz")
    assert len(files(directory)) == 4

    dem = checkpoint.load(tmp_path / "state.npz")
    trajectory = Trajectory(directory, dem, contacts=True)
    assert len(files(directory)) == 4  # nothing is lost before there is something new
    trajectory.write()  # of the step of the checkpoint: no second frame
    for _ in range(2):
        dem.run(50)
        trajectory.write()
    for series in ("grains", "walls", "contacts"):
        times, found = frames(directory, series)
        expected_times, expected = frames(tmp_path / "whole", series)
        assert times == expected_times
        assert files(directory, series) == files(tmp_path / "whole", series)
        for one, other in zip(found, expected, strict=True):
            assert_array_equal(one.points, other.points)


def test_contacts_no_longer_written_are_dropped_with_the_frames_they_belong_to(tmp_path):
    dem = sample()
    trajectory = Trajectory(tmp_path, dem, contacts=True)
    for _ in range(2):
        dem.run(20)
        trajectory.write()
        if len(trajectory) == 1:
            checkpoint.save(dem, tmp_path / "state.npz")
    again = checkpoint.load(tmp_path / "state.npz")
    trajectory = Trajectory(tmp_path, again)
    again.run(30)
    trajectory.write()
    assert files(tmp_path) == ["grains_000000020.vtp", "grains_000000050.vtp"]
    assert files(tmp_path, "contacts") == ["contacts_000000020.vtp"]
    assert frames(tmp_path, "contacts")[0] == frames(tmp_path)[0][:1]


# ---- bad input ----------


def test_a_new_run_does_not_write_over_an_old_one(tmp_path):
    dem = sample()
    Trajectory(tmp_path, dem).write()
    with pytest.raises(InputError, match="holds a trajectory of 1 frame, and this run is at its start"):
        Trajectory(tmp_path, sample())


@pytest.mark.parametrize("content", ["", "no xml", "<a><DataSet file='x.vtp' timestep='0'/></a>", "<a><DataSet/></a>"])
def test_a_foreign_list_is_refused_before_anything_is_written(tmp_path, content):
    (tmp_path / "walls.pvd").write_text(content)
    with pytest.raises(InputError, match=r"walls\.pvd is not a list of frames of porefv, or it is damaged"):
        Trajectory(tmp_path, sample())
    assert [path.name for path in tmp_path.iterdir()] == ["walls.pvd"]


def test_a_file_in_place_of_the_directory_is_named(tmp_path):
    (tmp_path / "frames").write_text("")
    with pytest.raises(InputError, match="cannot make the directory .*frames"):
        Trajectory(tmp_path / "frames", sample())


def test_vtk_is_loaded_by_those_who_write_frames_only():
    program = """
import sys
import porefv.dem.checkpoint, porefv.dem.grain_model, porefv.export.trajectories
print([name for name in ("pyvista", "vtkmodules") if name in sys.modules])
"""
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"


def test_frames_are_read_back_with_the_box_that_they_had(tmp_path):
    dem = sample()
    trajectory = Trajectory(tmp_path, dem)
    packings = []
    for _ in range(3):
        dem.run(10)
        trajectory.write()
        packings.append(dem.packing)
    assert not np.array_equal(packings[0].box.upper, packings[2].box.upper)  # a plate presses
    for frame, expected in ((0, packings[0]), (1, packings[1]), (None, packings[2])):
        found = Packing.read(tmp_path / "grains.pvd", frame=frame)
        assert_array_equal(found.centres, expected.centres)
        assert_array_equal(found.radii, expected.radii)
        assert_array_equal(found.box.lower, expected.box.lower)
        assert_array_equal(found.box.upper, expected.box.upper)
    assert found.reading.frames == 3 and found.reading.frame == 2
    file = next(tmp_path.glob("grains_*10.vtp"))
    assert_array_equal(Packing.read(file).centres, packings[0].centres)
    with pytest.raises(InputError, match=r"walls.pvd: its frame 2 cannot be read: .*there is no radius"):
        Packing.read(tmp_path / "walls.pvd")
    file.unlink()
    with pytest.raises(InputError, match=r"grains.pvd: its frame 0 cannot be read: .*there is no such file"):
        Packing.read(tmp_path / "grains.pvd", frame=0)
    with pytest.raises(InputError, match="3 frames, 0 to 2"):
        Packing.read(tmp_path / "grains.pvd", frame=3)
