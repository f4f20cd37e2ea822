import json
import os
import re
import shutil
import signal
import subprocess
import sys
import time
import tomllib
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import pytest

from porefv.cli.program import main
from porefv.coupling.walls_in_time import PressureTable, SinePressure
from porefv.dem.dem import DEM
from porefv.errors import ComputationError, InputError, MissingExtraError
from porefv.packing.box import WALLS
from porefv.scenes.simulation_scene import SimulationScene
from porefv.simulation import measurements, simulate
from porefv.simulation.measurements import layer_stresses
from porefv.simulation.reading import read_profiles, read_series
from porefv.simulation.run_record import read_record
from porefv.system.progress import Progress

ROOT = Path(__file__).parents[2]
EXAMPLES = [ROOT / "data" / "scenes" / f"{name}.toml" for name in ("oedometer", "triaxial", "permeameter")]

DRY = f"""\
[packing]
file = "{ROOT}/data/packings/n54_s1.csv"
scale = 0.05
[[stages]]
name = "press"
plates = {{ z_max = {{ stress = 5.0e3, top_speed = 0.01 }} }}
damping = 0.2
duration = 0.02
"""
WET = f"""\
[packing]
file = "{ROOT}/data/packings/n54_s1.csv"
scale = 0.05
[fluid]
viscosity = 1.0
[walls]
z_min = {{ pressure = 0.0 }}
lateral = {{ slip = true }}
[[stages]]
name = "prepare"
fluid = false
damping = 0.2
plates = {{ z_max = {{ stress = 2.0e3, top_speed = 0.01 }} }}
duration = 0.02
[[stages]]
name = "load"
plates = {{ z_max = {{ stress = 6.0e3, top_speed = 0.1 }} }}
duration = 0.02
[output]
profiles = 0.004
"""


@pytest.fixture
def path(tmp_path):
    """A scene file to be written."""
    return tmp_path / "scene.toml"


def run(path, text, *options):
    path.write_text(text)
    assert main(["simulate", str(path), "--quiet", *options]) == 0
    return path.parent / "results"


def files(directory):
    """Content of each file that must not depend on where a run was stopped; seconds are in the others."""
    return {
        str(file.relative_to(directory)): file.read_bytes()
        for file in sorted(directory.rglob("*"))
        if file.is_file() and file.suffix in (".csv", ".pvd", ".vtp", ".vtu")
    }


# ---- physics ----------


def test_a_dry_run_has_nothing_of_the_fluid(path):
    found = run(path, DRY)
    rows = read_series(found)
    assert not {"mean_pressure", "flux_z_min"} & set(rows.dtype.names)
    assert rows["contact_stress_z_max"][-1] == pytest.approx(5e3, rel=0.02)
    # A row at the start, and then at equal steps, as near to 200 intervals as whole steps allow.
    dem = SimulationScene.read(path).grains()
    steps = round(0.02 / dem.step)
    every = round(0.02 / 200 / dem.step)
    assert len(rows) == 1 + -(-steps // every)
    assert rows["strain_z"][0] == 0.0 and rows["strain_z"][-1] > 0.0
    assert not (found / "profiles.csv").exists()


def test_load_goes_from_the_fluid_to_the_contacts_and_their_sum_is_the_total(path):
    rows = read_series(run(path, WET))
    wet = rows[rows["stage"] == 2]
    assert np.isnan(rows["mean_pressure"][rows["stage"] == 1]).all()
    assert wet["mean_pressure"].max() > 1e3 > 300.0 > wet["mean_pressure"][-1]
    area = 0.05**2
    # The plate's section along z does not change: forces and stresses differ by it alone.
    assert wet["total_stress_z_max"] == pytest.approx(wet["contact_stress_z_max"] + wet["fluid_force_z_max"] / area)
    assert wet["total_stress_z_max"][-1] == pytest.approx(6e3, rel=0.01)
    assert wet["contact_stress_z_min"][-1] == pytest.approx(6e3, rel=0.1)


def test_momentum_balances_and_what_the_box_loses_flows_out(path):
    rows = read_series(run(path, WET.replace("[output]", "[coupling]\ntolerance = 1.0e-10\n[output]\nevery = 1.0e-9")))
    wet = rows[rows["stage"] == 2]
    assert wet["momentum_residual"].max() < 1e-12
    assert wet["power_imbalance"].max() < 1e-6
    places = np.append(rows["place_z_max"][rows["stage"] == 1][-1], wet["place_z_max"])
    times = np.append(rows["time"][rows["stage"] == 1][-1], wet["time"])
    loss = np.diff(places) / np.diff(times) * 0.05**2
    flow = sum(wet[f"flux_{wall}"] for wall in WALLS)
    assert np.abs(flow - loss).max() < 1e-9 * np.abs(loss).max()


def test_the_effective_stress_of_layers_is_that_of_the_sample_and_the_pressure_falls_towards_the_drain(path):
    text = WET.replace("duration = 0.02\n[output]", "duration = 0.004\n[output]")
    profiles = read_profiles(run(path, text))
    last = profiles[profiles["time"] == profiles["time"][-1]]
    assert len(last) == 10 and last["upper"][-1] == pytest.approx(0.05, rel=0.01)
    assert last["pressure"][0] < last["pressure"][4] < last["pressure"][-1]
    assert last["effective_stress"][0] > last["effective_stress"][-2]
    dem = SimulationScene.read(path).grains()
    edges = np.linspace(dem.box.lower[2], dem.box.upper[2], 7)
    assert layer_stresses(dem, 2, edges).mean() == pytest.approx(dem.stress[2, 2], rel=1e-12)


def test_pressures_follow_their_pressure_history(path):
    """A pressure that rises on one wall drives a flow that follows it, grains being too heavy and held."""
    text = WET.replace("z_min = { pressure = 0.0 }", "z_min = { pressure = 0.0 }\nz_max = { pressure = 0.0 }")
    text = text.replace("plates = { z_max = { stress = 6.0e3, top_speed = 0.1 } }\n", "plates = { z_max = {} }\n")
    rise = "walls = { z_min = { pressure = { times = [0.0, 0.001], pressures = [0.0, 100.0] } } }\nduration = 0.002"
    swing = "[[stages]]\nwalls = { z_min = { pressure = { mean = 100.0, amplitude = 50.0, period = 0.002 } } }\n"
    text = text.replace("duration = 0.02\n[output]", f"{rise}\n{swing}duration = 0.002\n[output]\nevery = 1.0e-9")
    rows = read_series(run(path, text))
    # Power of the walls is pressure times flux: it tells the pressure, which is that of the middle of each step.
    wet = rows[rows["stage"] >= 2]
    wet = wet[np.abs(wet["flux_z_min"]) > 1e-12]
    pressure = wet["power_boundary"] / wet["flux_z_min"]
    found = json.loads((path.parent / "results" / "simulation.json").read_text())
    begin, then = (span["begin"] for span in found["spans"][1:])
    middle = wet["time"] - 0.5 * (wet["time"][-1] - wet["time"][-2])
    rising = PressureTable((0.0, 0.001), (0.0, 100.0))
    swinging = SinePressure(100.0, 50.0, 0.002)
    expected = [
        rising.at(t - begin) if stage == 2 else swinging.at(t - then)
        for t, stage in zip(middle, wet["stage"], strict=True)
    ]
    assert pressure == pytest.approx(expected, rel=1e-6, abs=1e-6)
    assert max(expected) > 140.0 and min(expected) < 10.0


def test_buoyancy_is_there_with_the_fluid_and_gone_without(path, monkeypatch):
    seen = []
    recorded = DEM.apply

    def apply(dem, forces):
        seen.append(np.array(forces)[:, 2].sum())
        recorded(dem, forces)

    monkeypatch.setattr("porefv.simulation.measurements.unbalanced", lambda dem, coupling: 0.0)
    monkeypatch.setattr(DEM, "apply", apply)
    text = "gravity = [0.0, 0.0, -10.0]\n" + WET.replace("duration = 0.02", "duration = 0.001")
    run(path, text.replace("[output]", "[[stages]]\nfluid = false\nduration = 0.001\n[output]"))
    dem = SimulationScene.read(path).grains()
    assert seen == pytest.approx([1000.0 * 10.0 * dem.masses.sum() / 2600.0, 0.0])


def test_a_stage_keeps_what_it_does_not_name(path):
    text = DRY.replace("duration = 0.02", "duration = 0.001\n[[stages]]\nfriction_angle = 10.0\nduration = 0.001")
    text += "[[stages]]\nplates = { z_max = {} }\nduration = 0.001\n"
    made = []
    original = SimulationScene.grains

    def grains(self, *packing):
        made.append(original(self, *packing))
        return made[-1]

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(SimulationScene, "grains", grains)
        rows = read_series(run(path, text))
    still = rows[rows["stage"] == 3]
    moving = rows[rows["stage"] == 2]
    assert np.ptp(moving["place_z_max"]) > 0.0 and np.ptp(still["place_z_max"]) == 0.0
    assert made[0].material.friction_angle == 10.0 and made[0].plates["z_max"].stress is None


def test_a_stage_ends_at_rest_or_says_why_not(path, capsys):
    resting = DRY.replace("duration = 0.02", "rest = { unbalanced = 5.0e-3 }")
    rows = read_series(run(path, resting))
    assert rows["unbalanced"][-1] <= 5e-3
    assert rows["contact_stress_z_max"][-1] == pytest.approx(5e3, rel=1e-2)
    path.write_text(resting.replace("5.0e-3 }", "5.0e-3, limit = 1.0e-3 }"))
    assert main(["simulate", str(path), "--force"]) == 1
    said = capsys.readouterr().err
    assert "stage 'press' does not come to rest" in said and "wall z_max presses with" in said
    assert "there is no checkpoint yet" in said


# ---- taken up again ----------


def test_a_run_that_is_killed_goes_on_to_the_last_bit(path, tmp_path):
    sine = "walls = { z_min = { pressure = { amplitude = 500.0, period = 0.004 } } }\nduration = 0.03\n[output]"
    text = WET.replace("duration = 0.02\n[output]", sine) + "frames = 0.005\n[checkpoint]\nsteps = 100\n"
    whole = run(path, text).rename(tmp_path / "whole")
    command = [sys.executable, "-m", "porefv", "simulate", str(path), "--quiet", "--resume"]
    environment = os.environ | {"PYTHONPATH": str(ROOT / "src")}
    process = subprocess.Popen(command, env=environment)
    stopped = tmp_path / "results" / "simulation.json"
    deadline = time.monotonic() + 120.0
    while time.monotonic() < deadline and process.poll() is None:
        if stopped.exists() and (point := json.loads(stopped.read_text())["checkpoint"]):
            if point["coupled"] and point["step"] > 500:
                break
        time.sleep(0.01)
    process.kill()
    assert process.wait() not in (0, 2, 130)
    assert json.loads(stopped.read_text())["status"] == "running"
    shutil.copyfile(stopped, tmp_path / "when_killed.json")
    with (tmp_path / "results" / "series.csv").open("a") as file:
        file.write("1,2,a row that was not finis")
    subprocess.run(command, env=environment, check=True)
    assert files(tmp_path / "results") == files(whole)
    assert json.loads(stopped.read_text())["status"] == "complete"
    assert len(list((tmp_path / "results").glob("checkpoint_*.npz"))) == 1


@pytest.mark.parametrize(("error", "status"), [(KeyboardInterrupt(), 130), (ComputationError("it runs away"), 1)])
def test_what_stops_leaves_the_series_and_says_how_to_go_on(path, capsys, monkeypatch, error, status):
    path.write_text(WET + "[checkpoint]\nsteps = 100\n")
    original = DEM.run
    with monkeypatch.context() as patch:

        def fail(dem, steps):
            if dem.steps > 250:
                raise error
            original(dem, steps)

        patch.setattr(DEM, "run", fail)
        assert main(["simulate", str(path)]) == status
    said = capsys.readouterr().err
    assert f"go on from there with: porefv simulate {path} --resume" in said and "Traceback" not in said
    assert len(read_series(path.parent / "results")) > 10
    assert read_record(path.parent / "results").status == ("interrupted" if status == 130 else "failed")
    assert main(["simulate", str(path), "--resume", "--quiet"]) == 0


def test_an_interrupt_waits_for_a_checkpoint(path, monkeypatch, capsys):
    path.write_text(DRY)
    original = DEM.run
    sent = []

    def interrupted(dem, steps):
        original(dem, steps)
        if dem.steps > 150 and not sent:
            sent.append(dem.steps)
            signal.raise_signal(signal.SIGINT)

    monkeypatch.setattr(DEM, "run", interrupted)
    assert main(["simulate", str(path)]) == 130
    point = read_record(path.parent / "results").checkpoint
    assert point.step >= sent[0]
    assert main(["simulate", str(path), "--resume"]) == 0
    assert "results in" in capsys.readouterr().out
    after = files(path.parent / "results")
    assert after == files(run(path, DRY, "--force"))


def test_sigterm_waits_for_a_checkpoint_too(path, capsys, monkeypatch):
    path.write_text(DRY)
    original, sent = DEM.run, []

    def terminated(dem, steps):
        original(dem, steps)
        if dem.steps > 150 and not sent:
            sent.append(dem.steps)
            signal.raise_signal(signal.SIGTERM)

    monkeypatch.setattr(DEM, "run", terminated)
    assert main(["simulate", str(path)]) == 143
    assert "go on from there with" in capsys.readouterr().err
    record = read_record(path.parent / "results")
    assert record.status == "interrupted" and record.checkpoint.step >= sent[0]
    assert signal.getsignal(signal.SIGTERM) is signal.SIG_DFL
    assert main(["simulate", str(path), "--resume", "--quiet"]) == 0


@pytest.mark.parametrize("options", [["--resume"], ["--force"]])
def test_of_two_runs_at_once_one_is_refused_and_the_other_is_right(path, tmp_path, options):
    whole = files(run(path, WET + "[checkpoint]\nsteps = 50\n").rename(tmp_path / "whole"))
    environment = os.environ | {"PYTHONPATH": str(ROOT / "src")}
    processes = [
        subprocess.Popen(
            [sys.executable, "-m", "porefv", "simulate", str(path), "--quiet", *options],
            env=environment, stderr=subprocess.PIPE, text=True,
        )
        for _ in range(2)
    ]  # fmt: skip
    said = [process.communicate()[1] for process in processes]
    statuses = [process.returncode for process in processes]
    assert sorted(statuses) in ([0, 0], [0, 2])  # the second may have come when the first was done
    if 2 in statuses:
        assert "results is being written by process" in said[statuses.index(2)]
    assert files(tmp_path / "results") == whole


@pytest.mark.parametrize(
    ("damage", "said"),
    [
        (lambda content: content.replace(b"1", b"2", 1), "is not as it was written"),
        (lambda content: content[:-1] + b"\0", "is not as it was written"),
        (lambda content: content[:-100], "shorter than at its checkpoint"),
        (lambda content: content + content[-50:], "has grown since the run was complete"),
    ],
)
def test_damage_of_the_series_is_found(path, capsys, damage, said):
    found = run(path, DRY.replace("0.02", "0.002"))
    (found / "series.csv").write_bytes(damage((found / "series.csv").read_bytes()))
    for arguments in (["info", str(found)], ["plot", str(found), "--out", str(path.parent / "picture.png")]):
        assert main(arguments) == 2
        assert said in capsys.readouterr().err
    with pytest.raises(InputError, match=said):
        read_series(found)
    if "grown" not in said:  # rows after a checkpoint are dropped by whoever goes on from it
        path.write_text(path.read_text() + "[[stages]]\nduration = 0.001\n")
        assert main(["simulate", str(path), "--resume"]) == 2
        assert said in capsys.readouterr().err


def test_stages_may_be_added_and_nothing_else_changed(path, capsys):
    found = run(path, DRY)
    before = (found / "series.csv").read_bytes()
    assert main(["simulate", str(path), "--resume", "--quiet"]) == 0  # it is complete
    assert (found / "series.csv").read_bytes() == before
    path.write_text(DRY.replace("stress = 5.0e3", "stress = 6.0e3"))
    assert main(["simulate", str(path), "--resume"]) == 2
    assert "differs from the one that the run in" in capsys.readouterr().err
    run(path, DRY + "[[stages]]\nduration = 0.001\n", "--resume")
    after = (found / "series.csv").read_bytes()
    assert after.startswith(before) and len(after) > len(before)


def test_results_are_replaced_by_force_only_and_other_files_never(path, capsys, monkeypatch):
    found = run(path, DRY.replace("0.02", "0.001"))
    (found / "notes.txt").write_text("mine")
    with monkeypatch.context() as patch:
        patch.setattr(SimulationScene, "grains", lambda self: pytest.fail("computed"))
        assert main(["simulate", str(path)]) == 2
    assert "--resume on the command line), replace them with force=True (--force" in capsys.readouterr().err
    assert main(["simulate", str(path), "--force", "--resume"]) == 2
    run(path, DRY.replace("0.02", "0.0005"), "--force")
    assert (found / "notes.txt").read_text() == "mine"
    (found / "simulation.json").unlink()
    assert main(["simulate", str(path), "--force"]) == 2
    assert "holds files that are not results of porefv simulate" in capsys.readouterr().err


def test_what_is_not_of_a_run_is_not_removed(path, tmp_path, capsys):
    path.write_text(DRY.replace("0.02", "0.001"))
    (tmp_path / "results").mkdir()
    (tmp_path / "results" / "simulation.json").write_text('{"mine": 1}')
    (tmp_path / "results" / "series.csv").write_text("mine")
    for option in ("--force", "--resume"):
        assert main(["simulate", str(path), option]) == 2
    assert (tmp_path / "results" / "series.csv").read_text() == "mine"
    shutil.rmtree(tmp_path / "results")
    found = run(path, path.read_text())
    before = (found / "simulation.json").read_bytes()
    (tmp_path / "others").mkdir()
    (tmp_path / "others" / "grains_1.vtp").write_text("mine")
    (found / "frames").symlink_to("../others")
    assert main(["simulate", str(path), "--force"]) == 2
    assert "frames: it is a link" in capsys.readouterr().err
    (found / "frames").unlink()
    (found / "frames" / "grains_1.vtp").mkdir(parents=True)
    assert main(["simulate", str(path), "--force"]) == 2
    assert "grains_1.vtp: it is a directory" in capsys.readouterr().err
    assert (found / "simulation.json").read_bytes() == before
    assert (tmp_path / "others" / "grains_1.vtp").read_text() == "mine"


def test_names_of_stages_are_no_formulas(path):
    text = DRY.replace("0.02", "0.001").replace('"press"', "'$\\frac{$x'")
    assert main(["plot", str(run(path, text)), "--out", str(path.parent / "picture.png")]) == 0


def test_a_row_that_is_being_written_is_left_out(path):
    found = run(path, DRY.replace("0.02", "0.001"))
    rows = len(read_series(found))
    record = read_record(found)
    record.status = "interrupted"
    record.write(found)
    with (found / "series.csv").open("a") as file:
        file.write("1650,0.09,2,0.0")
    assert len(read_series(found)) == rows
    with (found / "series.csv").open("a") as file:
        file.write("\n")
    with pytest.raises(InputError, match=r"damaged after its last checkpoint: .*[^.]\. Go on from there with"):
        read_series(found)


def test_parquet_is_missed_before_the_run(path, monkeypatch):
    monkeypatch.setitem(sys.modules, "pyarrow", None)
    path.write_text(DRY + '[output]\ntable_format = "parquet"\n')
    for refuses in (simulate.run, simulate.check):
        with pytest.raises(MissingExtraError, match="Writing series.parquet needs .* pip install pyarrow"):
            refuses(SimulationScene.read(path))
    assert not (path.parent / "results").exists()


def test_parquet_has_what_the_series_has(path):
    parquet = pytest.importorskip("pyarrow.parquet")
    found = run(path, DRY + '[output]\ntable_format = "parquet"\n')
    table, rows = parquet.read_table(found / "series.parquet"), read_series(found)
    assert tuple(table.column_names) == rows.dtype.names
    assert np.array_equal(table["strain_z"].to_numpy(), rows["strain_z"])


def test_npy_has_what_series_and_profiles_have_until_the_run_begins_anew(path):
    found = run(path, DRY + '[output]\ntable_format = "npy"\nprofiles = 0.01\n')
    for name, rows in (("series.npy", read_series(found)), ("profiles.npy", read_profiles(found))):
        table = np.load(found / name)
        assert table.dtype == rows.dtype and table.tobytes() == rows.tobytes()
    run(path, DRY, "--force")
    assert not list(found.glob("*.npy"))


def test_the_old_key_of_parquet_files_is_refused_with_the_new_one(path):
    path.write_text(DRY + "[output]\nparquet = true\n")
    with pytest.raises(InputError, match='line .* write table_format = "parquet" instead of parquet = true'):
        SimulationScene.read(path)


def test_frames_are_taken_at_the_times_asked(path):
    pyvista = pytest.importorskip("pyvista")
    found = run(path, WET + "frames = [0.0, 0.03]\n") / "frames"
    step = max(int(name.stem.split("_")[1]) for name in found.glob("pores_*.vtu"))
    assert sorted(name.name for name in found.glob("grains_*")) == ["grains_000000000.vtp", f"grains_{step:09d}.vtp"]
    pores = pyvista.read(found / f"pores_{step:09d}.vtu")
    assert pores["pressure"].max() > 0.0
    for series in ("grains", "pores"):
        times = [float(t) for t in re.findall(r'timestep="([^"]+)"', (found / f"{series}.pvd").read_text())]
        assert times == pytest.approx([0.0, 0.03], rel=1e-3)
    assert not (found / "throats.pvd").exists()


def test_frames_name_their_fields_as_steady_results_do_and_say_where_they_come_from(path):
    pyvista = pytest.importorskip("pyvista")
    found = run(path, WET + "frames = [0.0, 0.03]\nvelocity = true\nthroats = true\n") / "frames"
    first, last = (pyvista.read(name) for name in sorted(found.glob("pores_*.vtu")))
    assert set(first.cell_data) == set(last.cell_data) == {"pore", "volume", "walls", "pressure", "velocity"}
    assert np.isnan(first["pressure"]).all() and np.isfinite(last["velocity"]).all()
    throats = pyvista.read(sorted(found.glob("throats_*.vtp"))[-1])
    assert set(throats.point_data) == {"pore", "volume", "pressure"}
    np.testing.assert_array_equal(throats["flux_magnitude"], abs(throats["flux"]))
    assert throats["flux_magnitude"].max() > 0.0
    grains = pyvista.read(sorted(found.glob("grains_*.vtp"))[-1])
    assert abs(grains["fluid_force"]).max() > 0.0
    for data in (last, throats, grains):
        assert data.field_data["viscosity"][0] > 0.0
        assert data.field_data["scene"][0] == str(path)
        assert data.field_data["time"][0] == pytest.approx(0.03, rel=1e-3)


def test_the_resultant_of_a_frame_is_contact_force_fluid_force_and_weight(path):
    pyvista = pytest.importorskip("pyvista")
    grains = pyvista.read(sorted((run(path, WET + "frames = [0.03]\n") / "frames").glob("grains_*.vtp"))[-1])
    scene = SimulationScene.read(path)
    weight = scene.grains().masses[:, None] * np.asarray(scene.gravity)
    total = grains["contact_force"] + grains["fluid_force"] + weight
    np.testing.assert_allclose(grains["force"], total, rtol=1e-9, atol=1e-12)


# ---- bad scenes ----------


@pytest.mark.parametrize(
    ("old", "new", "line", "said"),
    [
        ("duration = 0.02\n[output]", "duraton = 0.02\n[output]", 18, "[stages 2] unknown key 'duraton'; did you mean"),
        ("damping = 0.2", "damping = 2.0", 12, "[stages 1] damping: must lie in [0, 1), not 2.0"),
        ("fluid = false\n", "", 11, "damping: is for dry stages"),
        ("top_speed = 0.1 }", "top_sped = 0.1 }", 17, "[stages 2.plates.z_max] unknown key 'top_sped'"),
        (", top_speed = 0.1 }", "}", 17, "a wall with a stress needs a top_speed in m/s"),
        ("{ z_max = { stress = 6.0e3, top_speed = 0.1 } }", "{ top = {} }", 17, "unknown wall 'top'"),
        ("duration = 0.02\n[output]", "[output]", 15, "[stages 2] duration: missing"),
        ("duration = 0.02\n[output]", "duration = 1\nrest = {}\n[output]", 18, "duration and rest exclude each other"),
        (
            "z_min = { pressure = 0.0 }",
            "z_min = { pressure = {times = [0, 1], pressures = [1]} }",
            7,
            "as many pressures",
        ),
        (
            "z_min = { pressure = 0.0 }",
            "z_min = { pressure = {times = [1, 0], pressures = [1, 2]} }",
            7,
            "increasing times",
        ),
        (
            "z_min = { pressure = 0.0 }",
            "z_min = { pressure = { amplitude = 1, period = 0} }",
            7,
            "positive number of s",
        ),
        ("[fluid]\nviscosity = 1.0\n", "", 4, "[walls] is about the fluid, and there is none"),
        ("profiles = 0.004", "profiles = [0.1, 0.1]", 20, "[output] profiles: expected increasing times in s"),
        ("scale = 0.05", "scale = -1", 3, "[packing] scale: must be a positive number"),
        ("[output]", "[coupling]\nscheme = 'fast'\n[output]", 20, "unknown scheme 'fast'"),
        (
            "[output]",
            "[coupling]\nstride = 5\n[output]",
            20,
            "[coupling] stride: a stride of 5 needs pair_resistance = true",
        ),
        (
            "[output]",
            "[coupling]\nstride = 5\npair_resistance = true\nscheme = 'semi-implicit'\n[output]",
            22,
            "[coupling] scheme: a stride of 5 needs an implicit step; set scheme to 'auto'",
        ),
        ("[output]", "[coupling]\nroughness = 0.1\n[output]", 20, "set pair_resistance = true, or drop it"),
        ("[output]", "[checkpoint]\nsteps = 1\nseconds = 1\n[output]", 21, "seconds and steps exclude each other"),
        ('name = "load"', 'name = "prepare"', 10, "two stages are called 'prepare'"),
    ],
)
def test_errors_name_the_file_the_line_and_the_key(path, capsys, old, new, line, said):
    assert old in WET
    path.write_text(WET.replace(old, new))
    assert main(["simulate", str(path)]) == 2
    error = capsys.readouterr().err
    assert f"scene.toml, line {line}: " in error
    assert said in error
    assert not (path.parent / "results").exists()


def test_a_scene_needs_stages(path):
    path.write_text(DRY.split("[[stages]]")[0])
    with pytest.raises(InputError, match="stages: at least one is needed"):
        SimulationScene.read(path)


# ---- progress, pictures, examples, documentation ----------


class Shown(Progress):
    """Keeps what is shown."""

    draws = True

    def __init__(self):
        super().__init__(quiet=True)
        self.states, self.draws = [], True

    def show(self, state, part=None):
        self.states.append((state, part))

    @contextmanager
    def stage(self, name):
        yield


def test_the_terminal_shows_how_much_is_done_energy_and_imbalance(path):
    path.write_text(WET)
    shown = Shown()
    simulate.run(SimulationScene.read(path), progress=shown)
    states, parts = zip(*shown.states, strict=True)
    assert all(re.fullmatch(r"(unbalanced \S+  )?kinetic \S+(  imbalance \S+)?", state) for state in states)
    assert any("unbalanced" in state for state in states) == any(part is None for part in parts)
    assert max(part for part in parts if part is not None) == pytest.approx(1.0, abs=0.02)  # a step may be longer


def test_plot_draws_series(path):
    pytest.importorskip("matplotlib")
    found = run(path, WET)
    assert main(["plot", str(found), "--out", str(path.parent / "picture.png")]) == 0
    assert (path.parent / "picture.png").read_bytes().startswith(b"\x89PNG")
    from porefv.simulation.series_picture import series_picture

    pressures, stresses, strains, profiles = series_picture(found).axes
    rows = read_series(found)
    assert np.array_equal(pressures.lines[0].get_ydata(), rows["mean_pressure"], equal_nan=True)
    assert len(stresses.lines) >= 12 and len(strains.lines) >= 3 and len(profiles.lines) > 1


@pytest.mark.parametrize("example", EXAMPLES, ids=lambda example: example.stem)
def test_example_scenes_run(example, tmp_path):
    """A twentieth of each timed stage; stages to rest as they are."""
    data = tomllib.loads(example.read_text(encoding="utf-8"))
    for stage in data["stages"]:
        if "duration" in stage:
            stage["duration"] /= 20.0
    data["output"]["directory"] = str(tmp_path / "results")
    found = read_series(simulate.run(SimulationScene.from_mapping(data, directory=example.parent)))
    assert set(found["stage"]) == set(range(1, len(data["stages"]) + 1))
    wet = found[~np.isnan(found["mean_pressure"])]
    assert len(wet) > 1 and np.isfinite(wet["max_pressure"]).all()
    assert wet["momentum_residual"].max() < 1e-10
    if example.stem != "triaxial":
        measured = read_record(tmp_path / "results").permeability
        assert [entry.when for entry in measured] == ["before", "after"]
        assert measured[1].permeability < measured[0].permeability


def test_the_page_names_every_column_and_its_scenes_are_sound():
    page = (ROOT / "docs" / "simulate.md").read_text(encoding="utf-8")
    columns = measurements.GRAIN_COLUMNS + measurements.FLUID_COLUMNS + measurements.PROFILE_COLUMNS
    columns = {re.sub("|".join(f"_{wall}$" for wall in WALLS), "_WALL", column) for column in columns}
    assert [column for column in sorted(columns) if f"`{column}`" not in page] == []
    scenes = re.findall(r"^```ini\n(.*?)^```$", page, re.MULTILINE | re.DOTALL)
    assert scenes
    for text in scenes:
        SimulationScene.from_mapping(tomllib.loads(text), directory=ROOT / "data" / "scenes")


@pytest.mark.parametrize("name", ["oedometer", "triaxial", "permeameter", "pack_dense", "pack_settled"])
def test_check_validates_every_kind_of_scene(name, capsys):
    assert main(["check", str(ROOT / "data" / "scenes" / f"{name}.toml")]) == 0
    assert "in a box of" in capsys.readouterr().out


def test_the_record_says_how_the_packing_file_was_read(path):
    reading = SimulationScene.from_mapping(tomllib.loads(DRY)).read_packing().reading
    assert read_record(run(path, DRY)).reading == reading.as_data()


def test_check_reads_the_packing_file_once(path, monkeypatch):
    path.write_text(DRY)
    reads = []
    read_packing = SimulationScene.read_packing
    monkeypatch.setattr(SimulationScene, "read_packing", lambda scene: reads.append(scene) or read_packing(scene))
    assert main(["check", str(path)]) == 0
    assert len(reads) == 1
